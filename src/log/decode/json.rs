//! JSON payloads into [`Value`]; the depth of nesting is limited to 128 by `serde_json`.

use std::fmt;
use std::sync::Arc;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

use super::{DecodeError, Value};

/// The whole payload, which must be one JSON value and nothing behind it.
pub(super) fn decode(payload: &[u8]) -> Result<Value, DecodeError> {
    Ok(serde_json::from_slice(payload)?)
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, b: bool) -> Result<Value, E> {
        Ok(Value::Bool(b))
    }

    fn visit_i64<E>(self, i: i64) -> Result<Value, E> {
        Ok(Value::Int(i))
    }

    fn visit_u64<E>(self, u: u64) -> Result<Value, E> {
        Ok(Value::Uint(u))
    }

    fn visit_f64<E>(self, f: f64) -> Result<Value, E> {
        Ok(Value::Float(f))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned()))
    }

    fn visit_string<E>(self, text: String) -> Result<Value, E> {
        Ok(Value::Text(text))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut fields = Vec::new();
        while let Some((name, value)) = map.next_entry::<String, Value>()? {
            fields.push((Arc::from(name), value));
        }
        Ok(Value::Object(fields))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_kind_of_json_becomes_its_value_in_the_order_of_the_text() {
        let value = decode(br#"{"z":[null,true,-1,18446744073709551615,0.5],"a":"b"}"#).unwrap();
        let items =
            vec![Value::Null, Value::Bool(true), Value::Int(-1), Value::Uint(u64::MAX), Value::Float(0.5)];
        let fields = vec![("z".into(), Value::Array(items)), ("a".into(), Value::Text("b".into()))];
        assert_eq!(value, Value::Object(fields));
    }

    #[test]
    fn text_behind_the_value_and_bare_nan_are_errors_that_say_where() {
        assert!(decode(b"{} {}").unwrap_err().to_string().contains("column 4"));
        assert!(decode(br#"{"x":NaN}"#).unwrap_err().to_string().contains("column 6"));
    }

    #[test]
    fn nesting_without_end_is_an_error_and_no_crash() {
        assert!(decode(&vec![b'['; 1_000_000]).unwrap_err().to_string().contains("recursion"));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(payload: Vec<u8>) {
            let _ = decode(&payload);
        }
    }
}
