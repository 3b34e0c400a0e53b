//! Messages of every supported encoding into one [`Value`], and the [`MessagePath`]s into it.
//!
//! A [`Decoder`] is compiled once per channel and then knows what its messages look like. Definitions and
//! payloads are taken to be hostile: depth is bounded, and nothing is allocated that the bytes don't back.
//!
//! An encoding is one variant of the private `Format` and one module that makes a [`Value`] of a payload.

mod cdr;
mod definition;
mod json;
mod path;
mod path_text;
mod ros2;
mod selection;
mod value;

use std::sync::Arc;

use definition::Struct;
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
        let format = match (message_encoding, schema_encoding) {
            ("json", _) => Format::Json,
            ("cdr", "ros2msg") => {
                // Comments may be in any encoding; names are checked to be ASCII.
                let text = String::from_utf8_lossy(schema_data);
                let root = definition::resolve(&ros2::parse(schema_name, &text)?)?;
                Format::Cdr { root, pick: Pick::All }
            }
            ("cdr", _) => return Err(DecodeError::SchemaEncoding { found: schema_encoding.to_owned() }),
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
        };
        Ok(Self { format })
    }

    /// Decodes one message.
    ///
    /// # Errors
    /// [`DecodeError::Json`], [`DecodeError::Truncated`], [`DecodeError::Representation`] or
    /// [`DecodeError::WideText`].
    pub fn decode(&self, payload: &[u8]) -> Result<Value, DecodeError> {
        match &self.format {
            Format::Json => json::decode(payload),
            Format::Cdr { root, pick } => cdr::decode(root, pick, payload),
        }
    }
}

/// A channel or a message that can't be decoded.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// A message encoding that nothing here reads.
    #[error("message encoding {found:?} is not supported, expected cdr or json")]
    MessageEncoding {
        /// The channel's message encoding.
        found: String,
    },
    /// CDR messages whose schema is in a language that nothing here reads.
    #[error("schema encoding {found:?} of cdr messages is not supported, expected ros2msg")]
    SchemaEncoding {
        /// The schema's encoding; empty where the channel has no schema.
        found: String,
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
    /// A `wstring`, whose bytes differ between middlewares that don't say which they are.
    #[error("field {field:?} at byte {at} is a wstring, which has no agreed encoding")]
    WideText {
        /// The field's place in the message.
        field: String,
        /// Where in the payload.
        at: usize,
    },
}

impl DecodeError {
    /// Puts `name` before the place of the field.
    #[cold]
    fn inside(mut self, name: &str) -> Self {
        if let Self::Truncated { field, .. } | Self::WideText { field, .. } = &mut self {
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
            refusal("ros1", "ros1msg"),
            "message encoding \"ros1\" is not supported, expected cdr or json"
        );
        assert_eq!(
            refusal("cdr", "ros2idl"),
            "schema encoding \"ros2idl\" of cdr messages is not supported, expected ros2msg"
        );
        assert_eq!(
            refusal("cdr", ""),
            "schema encoding \"\" of cdr messages is not supported, expected ros2msg"
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
