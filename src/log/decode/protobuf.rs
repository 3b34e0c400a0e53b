//! Protobuf messages of any type, by the descriptors in their channel's schema (a serialized `FileDescriptorSet`).
//!
//! Fields go by the names of the `.proto` file. A number, text or list that is not in the payload has its default;
//! a message, and whatever else knows absence, is null then. Enums are their numbers, maps arrays of `key` and
//! `value`. `prost_reflect` reads the wire, with at most 100 messages within messages.

use std::collections::BTreeSet;
use std::sync::Arc;

use prost_reflect::prost::Message as _;
use prost_reflect::prost_types::FileDescriptorSet;
use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MapKey, MessageDescriptor, ReflectMessage,
    Value as Wire,
};

use super::path::{Filter, MessagePath, PathMiss, Step};
use super::{DecodeError, Value};

/// A value takes no byte of the payload where it has its default: more than this for each byte is no message in use.
const MOST_VALUES_PER_BYTE: usize = 64;

/// The same for a message without a byte.
const MOST_VALUES: usize = 1 << 16;

/// A message type, and which of its fields are wanted.
#[derive(Clone, Debug)]
pub(super) struct Message {
    descriptor: MessageDescriptor,
    /// Names of the fields; none for all.
    wanted: Option<Arc<BTreeSet<String>>>,
}

impl Message {
    /// # Errors
    /// [`DecodeError::Descriptor`]; [`DecodeError::MissingRoot`] where they hold no type of that name.
    pub(super) fn new(schema_name: &str, descriptors: &[u8]) -> Result<Self, DecodeError> {
        let set =
            FileDescriptorSet::decode(descriptors).map_err(|e| DecodeError::Descriptor(e.to_string()))?;
        // others, such as editions, make the pool panic
        for file in &set.file {
            if !matches!(file.syntax.as_deref(), None | Some("proto2" | "proto3")) {
                let (name, syntax) = (file.name(), file.syntax());
                return Err(DecodeError::Descriptor(format!(
                    "file {name:?} is of syntax {syntax:?}, expected proto2 or proto3"
                )));
            }
        }
        let pool = unpanicked(|| DescriptorPool::decode(descriptors))
            .ok_or_else(|| DecodeError::Descriptor(ODD.to_owned()))?
            .map_err(|e| DecodeError::Descriptor(e.to_string()))?;
        // a map without keys or values makes decoding panic
        for entry in pool.all_messages().filter(MessageDescriptor::is_map_entry) {
            if entry.get_field(1).is_none() || entry.get_field(2).is_none() {
                let name = entry.full_name();
                return Err(DecodeError::Descriptor(format!("the map {name:?} has no key or no value")));
            }
        }
        let descriptor = pool.get_message_by_name(schema_name);
        let missing = || DecodeError::MissingRoot { name: schema_name.to_owned() };
        Ok(Self { descriptor: descriptor.ok_or_else(missing)?, wanted: None })
    }

    /// Of the message the fields that `paths` begin with.
    pub(super) fn select(&self, paths: &[MessagePath]) -> Result<Self, PathMiss> {
        let mut wanted = Some(BTreeSet::new());
        for path in paths {
            self.check(path)?;
            for step in &path.steps {
                match step {
                    Step::Field(name) => {
                        wanted.iter_mut().for_each(|names| _ = names.insert(name.clone()));
                        break;
                    }
                    Step::Filter(filter) => {
                        wanted.iter_mut().for_each(|names| names.extend(filter.fields.first().cloned()));
                    }
                    Step::Index(_) | Step::First(_) => break,
                }
            }
            if !path.steps.iter().any(|step| matches!(step, Step::Field(_))) {
                wanted = None;
            }
        }
        Ok(Self { descriptor: self.descriptor.clone(), wanted: wanted.map(Arc::new) })
    }

    /// Whether any message of the type could be followed along `path`.
    fn check(&self, path: &MessagePath) -> Result<(), PathMiss> {
        let mut place = Place::One(Kind::Message(self.descriptor.clone()));
        for (depth, step) in path.steps.iter().enumerate() {
            let through = |place: &Place, filter: &Filter| {
                let last = filter.fields.iter().try_fold(place.clone(), |p, name| p.field(path, depth, name));
                last.map(drop)
            };
            place = match step {
                Step::Field(name) => place.field(path, depth, name)?,
                Step::Index(_) => place.element(path, depth)?,
                Step::Filter(filter) => through(&place, filter).map(|()| place)?,
                Step::First(filters) => {
                    let element = place.element(path, depth)?;
                    filters.iter().try_for_each(|filter| through(&element, filter))?;
                    element
                }
            };
        }
        Ok(())
    }

    /// Decodes one message.
    pub(super) fn decode(&self, payload: &[u8]) -> Result<Value, DecodeError> {
        let message = unpanicked(|| DynamicMessage::decode(self.descriptor.clone(), payload))
            .ok_or_else(|| DecodeError::Descriptor(ODD.to_owned()))?
            .map_err(|error| DecodeError::Protobuf(error.to_string()))?;
        let most = MOST_VALUES.saturating_add(payload.len().saturating_mul(MOST_VALUES_PER_BYTE));
        let too_many = DecodeError::TooManyValues { bytes: payload.len(), most };
        Budget { left: most }.object(&message, self.wanted.as_deref()).ok_or(too_many)
    }
}

/// What is said of descriptors that `prost_reflect` takes and then panics on.
const ODD: &str = "they are such as no compiler writes";

/// What `f` returns, `None` where it panics: `prost_reflect` does on some descriptors that no compiler writes.
fn unpanicked<T>(f: impl FnOnce() -> T) -> Option<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(f)).ok()
}

/// A place in the type of a message.
#[derive(Clone)]
enum Place {
    One(Kind),
    Many(Kind),
}

impl Place {
    fn field(&self, path: &MessagePath, depth: usize, name: &str) -> Result<Self, PathMiss> {
        let Self::One(Kind::Message(message)) = self else {
            return Err(path.wrong_kind(self.kind(), "an object", depth));
        };
        let field = message.get_field_by_name(name).ok_or_else(|| {
            path.no_field(name, depth, message.fields().map(|field| field.name().to_owned()).collect())
        })?;
        let many = field.is_list() || field.is_map();
        Ok(if many { Self::Many(field.kind()) } else { Self::One(field.kind()) })
    }

    fn element(&self, path: &MessagePath, depth: usize) -> Result<Self, PathMiss> {
        match self {
            Self::Many(kind) => Ok(Self::One(kind.clone())),
            Self::One(_) => Err(path.wrong_kind(self.kind(), "an array", depth)),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Many(_) => "an array",
            Self::One(Kind::Message(_)) => "an object",
            Self::One(Kind::String) => "text",
            Self::One(Kind::Bytes) => "an array of bytes",
            Self::One(Kind::Bool) => "a truth value",
            Self::One(_) => "a number",
        }
    }
}

/// How many values may still be made; `None` from its methods where there are more.
struct Budget {
    left: usize,
}

impl Budget {
    fn object(&mut self, message: &DynamicMessage, wanted: Option<&BTreeSet<String>>) -> Option<Value> {
        let is_wanted = |field: &FieldDescriptor| wanted.is_none_or(|names| names.contains(field.name()));
        let mut values = Vec::new();
        for field in message.descriptor().fields().filter(is_wanted) {
            let value = if field.supports_presence() && !message.has_field(&field) {
                self.left = self.left.checked_sub(1)?;
                Value::Null
            } else {
                self.value(&message.get_field(&field))?
            };
            values.push((Arc::from(field.name()), value));
        }
        Some(Value::Object(values))
    }

    fn value(&mut self, wire: &Wire) -> Option<Value> {
        self.left = self.left.checked_sub(1)?;
        Some(match wire {
            Wire::Bool(b) => Value::Bool(*b),
            Wire::I32(i) | Wire::EnumNumber(i) => Value::Int(i64::from(*i)),
            Wire::I64(i) => Value::Int(*i),
            Wire::U32(u) => Value::Uint(u64::from(*u)),
            Wire::U64(u) => Value::Uint(*u),
            Wire::F32(f) => Value::Float(f64::from(*f)),
            Wire::F64(f) => Value::Float(*f),
            Wire::String(text) => Value::Text(text.clone()),
            Wire::Bytes(bytes) => Value::Bytes(bytes.to_vec()),
            Wire::Message(message) => self.object(message, None)?,
            Wire::List(items) => {
                Value::Array(items.iter().map(|item| self.value(item)).collect::<Option<_>>()?)
            }
            Wire::Map(entries) => {
                // a map has no order: that of the keys makes the result the same each time
                let mut entries: Vec<_> = entries.iter().collect();
                entries.sort_by_cached_key(|(key, _)| order_of(key));
                let entry = |(key, value)| {
                    let fields = [
                        ("key", self.value(&Wire::from(MapKey::clone(key)))?),
                        ("value", self.value(value)?),
                    ];
                    Some(Value::Object(fields.map(|(name, value)| (Arc::from(name), value)).into()))
                };
                Value::Array(entries.into_iter().map(entry).collect::<Option<_>>()?)
            }
        })
    }
}

/// By number, then by text.
fn order_of(key: &MapKey) -> (i128, String) {
    match key {
        MapKey::Bool(b) => (i128::from(*b), String::new()),
        MapKey::I32(i) => (i128::from(*i), String::new()),
        MapKey::I64(i) => (i128::from(*i), String::new()),
        MapKey::U32(u) => (i128::from(*u), String::new()),
        MapKey::U64(u) => (i128::from(*u), String::new()),
        MapKey::String(text) => (0, text.clone()),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use prost_reflect::prost_types::field_descriptor_proto::{Label, Type};
    use prost_reflect::prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto};

    use super::super::Decoder;
    use super::*;

    /// Descriptors and a message, both by `tests/protobuf_golden.py`.
    const DESCRIPTORS: &[&str] = &[
        "0a770a1f676f6f676c652f70726f746f6275662f74696d657374616d702e70726f746f120f676f6f676c652e70726f74",
        "6f627566223b0a0954696d657374616d7012180a077365636f6e647318012001280352077365636f6e647312140a056e",
        "616e6f7318022001280552056e616e6f73620670726f746f330ab8030a096669782e70726f746f12036e61761a1f676f",
        "6f676c652f70726f746f6275662f74696d657374616d702e70726f746f22280a05506f696e7412090a01781801200128",
        "0112090a017918022001280112090a017a18032001280122b5020a03466978122d0a0974696d657374616d7018012001",
        "280b321a2e676f6f676c652e70726f746f6275662e54696d657374616d70121c0a08706f736974696f6e18022001280b",
        "320a2e6e61762e506f696e74121c0a0876656c6f6369747918032001280b320a2e6e61762e506f696e7412120a0a636f",
        "76617269616e636518042003280112170a046b696e6418052001280e32092e6e61762e4b696e6412100a086672616d65",
        "5f6964180620012809120b0a0372617718072001280c12190a05747261696c18082003280b320a2e6e61762e506f696e",
        "7412200a047461677318092003280b32122e6e61762e4669782e54616773456e747279120d0a05636f756e74180a2001",
        "28101a2b0a0954616773456e747279120b0a036b6579180120012809120d0a0576616c75651802200128113a0238012a",
        "1b0a044b696e6412070a035241571000120a0a06534d4f4f54481007620670726f746f33",
    ];
    const FIX: &[&str] = &[
        "0a0b08c0edb3b9061080e59a77121209000000000000f83f1900000000002044c022189a9999999999b93f0000000000",
        "0000009c7500883ce4377e28073204656ec3bc3a0200ff420911000000000000004042004a050a0161100c4a050a0162",
        "100951fdffffffffffffff",
    ];

    fn bytes(hex: &[&str]) -> Vec<u8> {
        let digits: Vec<u8> = hex.concat().bytes().collect();
        digits.chunks(2).map(|two| u8::from_str_radix(str::from_utf8(two).unwrap(), 16).unwrap()).collect()
    }

    fn decoder() -> Decoder {
        Decoder::new("protobuf", "protobuf", "nav.Fix", &bytes(DESCRIPTORS)).unwrap()
    }

    fn at(value: &Value, path: &str) -> Value {
        MessagePath::parse(path).unwrap().resolve(value).unwrap().unwrap().clone()
    }

    #[test]
    fn fields_are_those_that_an_independent_library_wrote_and_defaults_where_it_wrote_nothing() {
        let value = decoder().decode(&bytes(FIX)).unwrap();
        assert_eq!(at(&value, "t.timestamp").as_stamp(), Some((1_731_000_000, 250_000_000)));
        assert_eq!(at(&value, "t.position").as_vector3(), Some([1.5, 0.0, -40.25]));
        assert_eq!(at(&value, "t.velocity"), Value::Null);
        assert_eq!(at(&value, "t.covariance").as_numbers(), Some(vec![0.1, 0.0, 1e300]));
        assert_eq!(at(&value, "t.kind"), Value::Int(7));
        assert_eq!(at(&value, "t.frame_id"), Value::Text("enü".into()));
        assert_eq!(at(&value, "t.raw"), Value::Bytes(vec![0, 255]));
        assert_eq!(at(&value, "t.trail[1]").as_vector3(), Some([0.0; 3]));
        assert_eq!(at(&value, "t.tags[0].key"), Value::Text("a".into()));
        assert_eq!(at(&value, "t.tags[:]{key=='b'}.value"), Value::Int(-5));
        assert_eq!(at(&value, "t.count"), Value::Int(-3));
    }

    #[test]
    fn a_selection_holds_what_its_paths_lead_to_and_refuses_paths_that_lead_nowhere() {
        let select = |path: &str| decoder().select(&[MessagePath::parse(path).unwrap()]);
        let value = select("t{kind==7}.position.x").unwrap().decode(&bytes(FIX)).unwrap();
        assert_eq!(at(&value, "t{kind==7}.position.x"), Value::Float(1.5));
        assert_eq!(value.field("raw"), None);
        assert_eq!(select("t").unwrap().decode(&bytes(FIX)).unwrap(), decoder().decode(&bytes(FIX)).unwrap());
        let miss = |path: &str| select(path).unwrap_err().to_string();
        assert_eq!(miss("t.position.w"), "no field \"w\" in t.position; it has: x, y, z");
        assert_eq!(miss("t.trail.x"), "t.trail is an array, expected an object for the step .x");
        assert_eq!(miss("t.kind[0]"), "t.kind is a number, expected an array for the step [0]");
        assert!(miss("t.trail[:]{w==1}.x").contains("no field \"w\""));
    }

    #[test]
    fn what_is_no_descriptor_no_type_and_no_message_is_an_error() {
        let error =
            |name, data: &[u8]| Decoder::new("protobuf", "protobuf", name, data).unwrap_err().to_string();
        assert!(error("nav.Fix", b"?").starts_with("protobuf descriptor: "));
        assert_eq!(error("nav.Fox", &bytes(DESCRIPTORS)), "type nav.Fox is not defined in the schema");
        let edition = FileDescriptorProto {
            name: Some("e.proto".into()),
            syntax: Some("editions".into()),
            ..FileDescriptorProto::default()
        };
        let set = FileDescriptorSet { file: vec![edition] }.encode_to_vec();
        assert!(
            error("T", &set).contains("\"e.proto\" is of syntax \"editions\", expected proto2 or proto3")
        );
        let payload = bytes(FIX);
        let cut = decoder().decode(&payload[..payload.len() - 1]).unwrap_err().to_string();
        assert!(cut.starts_with("protobuf payload: "), "{cut}");
    }

    /// A type that holds itself, and a thousand numbers.
    fn wide() -> Decoder {
        let number = |number: i32| FieldDescriptorProto {
            name: Some(format!("f{number}")),
            number: Some(number),
            label: Some(Label::Optional.into()),
            r#type: Some(Type::Double.into()),
            ..FieldDescriptorProto::default()
        };
        let inner = FieldDescriptorProto {
            label: Some(Label::Repeated.into()),
            r#type: Some(Type::Message.into()),
            type_name: Some(".T".into()),
            ..number(1)
        };
        let message = DescriptorProto {
            name: Some("T".into()),
            field: std::iter::once(inner).chain((2..=1001).map(number)).collect(),
            ..DescriptorProto::default()
        };
        let file = FileDescriptorProto {
            name: Some("t.proto".into()),
            syntax: Some("proto3".into()),
            message_type: vec![message],
            ..FileDescriptorProto::default()
        };
        let set = FileDescriptorSet { file: vec![file] };
        Decoder::new("protobuf", "protobuf", "T", &set.encode_to_vec()).unwrap()
    }

    #[test]
    fn few_bytes_do_not_become_millions_of_values_nor_very_deep_ones() {
        let error = wide().decode(&[0x0a, 0].repeat(100_000)).unwrap_err().to_string();
        assert!(error.contains("more than 12865536 values"), "{error}");
        let mut deep = Vec::new();
        for _ in 0..2_000 {
            let mut outer = vec![0x0a];
            prost_reflect::prost::encoding::encode_varint(deep.len() as u64, &mut outer);
            outer.append(&mut deep);
            deep = outer;
        }
        let error = wide().decode(&deep).unwrap_err().to_string();
        assert!(error.contains("recursion"), "{error}");
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(payload: Vec<u8>, at: usize, byte: u8) {
            let _ = decoder().decode(&payload);
            let _ = Decoder::new("protobuf", "protobuf", "nav.Fix", &payload);
            let (mut message, mut schema) = (bytes(FIX), bytes(DESCRIPTORS));
            let (m, s) = (at % message.len(), at % schema.len());
            (message[m], schema[s]) = (byte, byte);
            let _ = decoder().decode(&message);
            if let Ok(decoder) = Decoder::new("protobuf", "protobuf", "nav.Fix", &schema) {
                let _ = decoder.decode(&bytes(FIX));
            }
        }
    }
}
