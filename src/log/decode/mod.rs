//! Messages of every supported encoding into one [`Value`], and the [`MessagePath`]s into it.
//!
//! A [`Decoder`] is compiled once per channel and then knows what its messages look like. Definitions and
//! payloads are taken to be hostile: depth is bounded, and nothing is allocated that the bytes don't back.
//!
//! An encoding is one variant of the private `Format` and one module that makes a [`Value`] of a payload.

mod cdr;
mod definition;
mod idl;
mod idl_text;
mod json;
mod msg;
mod path;
mod path_text;
mod protobuf;
mod reader;
mod ros1;
mod selection;
mod value;

use std::sync::Arc;

use definition::{RawDefinition, Struct};
use msg::Dialect;
use protobuf::Message;
use selection::Pick;

pub use path::{Comparison, Filter, Literal, MessagePath, PathMiss, Step};
pub use path_text::PathError;
pub use value::Value;

/// Decodes the messages of one channel; cheap to clone.
#[derive(Clone, Debug)]
pub struct Decoder {
    format: Format,
}

#[derive(Clone, Debug)]
enum Format {
    Json,
    Cdr { root: Arc<Struct>, pick: Pick },
    Ros1 { root: Arc<Struct>, pick: Pick },
    Protobuf(Message),
}

impl Decoder {
    /// A decoder of whole messages, from the fields of an MCAP channel and its schema (empty without one).
    ///
    /// # Errors
    /// [`DecodeError::MessageEncoding`] and [`DecodeError::SchemaEncoding`] for what is not supported, else
    /// what is wrong with the definition.
    pub fn new(
        message_encoding: &str,
        schema_encoding: &str,
        schema_name: &str,
        schema_data: &[u8],
    ) -> Result<Self, DecodeError> {
        // Comments may be in any encoding; names are checked to be ASCII.
        let text = || String::from_utf8_lossy(schema_data);
        let wrong = |expected| DecodeError::SchemaEncoding {
            message: message_encoding.to_owned(),
            found: schema_encoding.to_owned(),
            expected,
        };
        let format = match (message_encoding, schema_encoding) {
            ("json", _) => Format::Json,
            ("cdr", "ros2msg") => Format::cdr(&msg::parse(schema_name, &text(), Dialect::Ros2)?)?,
            ("cdr", "ros2idl" | "omgidl") => Format::cdr(&idl::parse(schema_name, &text())?)?,
            ("cdr", _) => return Err(wrong("ros2msg, ros2idl or omgidl")),
            ("ros1", "ros1msg") => {
                let definition = msg::parse(schema_name, &text(), Dialect::Ros1)?;
                Format::Ros1 { root: definition::resolve(&definition, 0)?, pick: Pick::All }
            }
            ("ros1", _) => return Err(wrong("ros1msg")),
            ("protobuf", "protobuf") => Format::Protobuf(Message::new(schema_name, schema_data)?),
            ("protobuf", _) => return Err(wrong("protobuf")),
            _ => return Err(DecodeError::MessageEncoding { found: message_encoding.to_owned() }),
        };
        Ok(Self { format })
    }

    /// A decoder that holds itself to what the `wanted` paths need, and skips the rest where it can.
    ///
    /// Its values hold at least what the paths lead to, at the same place as in the whole message; the topics
    /// of the paths are not looked at.
    ///
    /// # Errors
    /// [`PathMiss`] where a path leads nowhere in any message of the channel, as far as its schema tells:
    /// for JSON nothing is known before the message.
    pub fn select(&self, wanted: &[MessagePath]) -> Result<Self, PathMiss> {
        let format = match &self.format {
            Format::Json => Format::Json,
            Format::Cdr { root, .. } => {
                Format::Cdr { root: Arc::clone(root), pick: Pick::of_paths(root, wanted)? }
            }
            Format::Ros1 { root, .. } => {
                Format::Ros1 { root: Arc::clone(root), pick: Pick::of_paths(root, wanted)? }
            }
            Format::Protobuf(message) => Format::Protobuf(message.select(wanted)?),
        };
        Ok(Self { format })
    }

    /// Decodes one message.
    ///
    /// # Errors
    /// [`DecodeError::Json`], [`DecodeError::Truncated`], [`DecodeError::Representation`], [`DecodeError::WideText`],
    /// [`DecodeError::Protobuf`] or [`DecodeError::TooManyValues`].
    pub fn decode(&self, payload: &[u8]) -> Result<Value, DecodeError> {
        match &self.format {
            Format::Json => json::decode(payload),
            Format::Cdr { root, pick } => cdr::decode(root, pick, payload),
            Format::Ros1 { root, pick } => ros1::decode(root, pick, payload),
            Format::Protobuf(message) => message.decode(payload),
        }
    }
}

impl Format {
    fn cdr(definition: &RawDefinition) -> Result<Self, DecodeError> {
        // An empty struct is one byte there, `structure_needs_at_least_one_member`.
        Ok(Self::Cdr { root: definition::resolve(definition, 1)?, pick: Pick::All })
    }
}

/// A channel or a message that can't be decoded.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// A message encoding that nothing here reads.
    #[error("message encoding {found:?} is not supported, expected json, cdr, ros1 or protobuf")]
    MessageEncoding {
        /// The channel's message encoding.
        found: String,
    },
    /// Messages whose schema is in a language that nothing here reads, or that doesn't fit their encoding.
    #[error("schema encoding {found:?} of {message} messages is not supported, expected {expected}")]
    SchemaEncoding {
        /// The channel's message encoding.
        message: String,
        /// The schema's encoding; empty where the channel has no schema.
        found: String,
        /// What is read.
        expected: &'static str,
    },
    /// A line of a message definition that is not as the language has it.
    #[error("definition line {line}: {found:?}, expected {expected}")]
    Definition {
        /// The line's number, from 1.
        line: usize,
        /// The line, up to 80 characters of it.
        found: String,
        /// What should stand there.
        expected: &'static str,
    },
    /// A type that is used, but defined nowhere.
    #[error("type {name}, of {parent}.{field}, is not defined in the schema")]
    MissingType {
        /// The missing type.
        name: String,
        /// The type that has a field of it.
        parent: String,
        /// That field.
        field: String,
    },
    /// A type that contains itself, whose messages would have no end.
    #[error("type {name} contains itself")]
    CyclicType {
        /// The type.
        name: String,
    },
    /// Types within types, further than any message in use.
    #[error("type {name} is nested more than {most} types deep")]
    DeepType {
        /// The type where the limit was passed.
        name: String,
        /// The limit.
        most: usize,
    },
    /// A JSON payload that is no JSON.
    #[error("json payload: {0}")]
    Json(#[from] serde_json::Error),
    /// A CDR payload in a representation that nothing here reads.
    #[error(
        "cdr representation {representation:#06x} ({name}) is not supported, expected plain CDR, 0x0000 or 0x0001"
    )]
    Representation {
        /// The first two bytes of the payload.
        representation: u16,
        /// Its name.
        name: &'static str,
    },
    /// A payload that ends before the message does, or an array that claims more than there is.
    #[error("payload too short: field {field:?} needs {need} bytes at byte {at}, {left} left")]
    Truncated {
        /// The field's place in the message; empty for the message itself.
        field: String,
        /// Where in the payload.
        at: usize,
        /// How many bytes it needs at the least.
        need: usize,
        /// How many bytes there are.
        left: usize,
    },
    /// Characters of a `wstring` have 2 bytes with some middlewares, 4 with others, and this message fits both or
    /// neither.
    #[error("the message has a wstring, and doesn't tell whether its characters have 2 bytes or 4")]
    WideText,
    /// A schema that has no type of the name that it goes by.
    #[error("type {name} is not defined in the schema")]
    MissingRoot {
        /// That name.
        name: String,
    },
    /// A Protobuf schema that is no set of file descriptors.
    #[error("protobuf descriptor: {0}")]
    Descriptor(String),
    /// A payload that is no Protobuf, or not of the channel's type.
    #[error("protobuf payload: {0}")]
    Protobuf(String),
    /// A payload of few bytes that would become very many values.
    #[error("the message's {bytes} bytes stand for more than {most} values")]
    TooManyValues {
        /// Bytes of the payload.
        bytes: usize,
        /// The limit.
        most: usize,
    },
}

impl DecodeError {
    /// Puts `name` before the place of the field.
    #[cold]
    fn inside(mut self, name: &str) -> Self {
        if let Self::Truncated { field, .. } = &mut self {
            let place = if field.is_empty() { name.to_owned() } else { format!("{name}.{field}") };
            *field = place;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(message_encoding: &str, schema_encoding: &str) -> String {
        Decoder::new(message_encoding, schema_encoding, "p/msg/T", b"bool a").unwrap_err().to_string()
    }

    #[test]
    fn an_encoding_that_nothing_reads_is_an_error_that_names_what_is_read() {
        assert_eq!(
            refusal("flatbuffer", "flatbuffer"),
            "message encoding \"flatbuffer\" is not supported, expected json, cdr, ros1 or protobuf"
        );
        assert_eq!(
            refusal("cdr", ""),
            "schema encoding \"\" of cdr messages is not supported, expected ros2msg, ros2idl or omgidl"
        );
        assert_eq!(
            refusal("ros1", "ros2msg"),
            "schema encoding \"ros2msg\" of ros1 messages is not supported, expected ros1msg"
        );
    }

    #[test]
    fn json_needs_no_schema_and_a_selection_of_it_checks_no_path() {
        let decoder = Decoder::new("json", "", "", b"").unwrap();
        let path = MessagePath::parse("/t.position.x").unwrap();
        let selected = decoder.select(std::slice::from_ref(&path)).unwrap();
        let message = selected.decode(br#"{"position": null}"#).unwrap();
        let miss = path.resolve(&message).unwrap_err().to_string();
        assert_eq!(miss, "/t.position is null, expected an object for the step .x");
    }

    #[test]
    fn a_selection_of_a_selection_starts_from_the_whole_message() {
        let decoder = Decoder::new("cdr", "ros2msg", "p/msg/T", b"uint8 a\nuint8 b").unwrap();
        let [a, b] = ["/t.a", "/t.b"].map(|path| MessagePath::parse(path).unwrap());
        let selected = decoder.select(&[a]).unwrap().select(std::slice::from_ref(&b)).unwrap();
        let message = selected.decode(&[0, 1, 0, 0, 5, 6]).unwrap();
        assert_eq!(b.resolve(&message), Ok(Some(&Value::Uint(6))));
    }
}
