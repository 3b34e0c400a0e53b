//! One value type for every encoding, with the readings that a source needs.

use std::sync::Arc;

/// A decoded message, or a part of it.
///
/// Times and durations stay the objects that they are in their encoding; [`Value::as_stamp`] reads them all.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// No value (JSON only).
    Null,
    /// True or false.
    Bool(bool),
    /// A signed whole number.
    Int(i64),
    /// An unsigned whole number.
    Uint(u64),
    /// A real number; a binary encoding may carry NaN and infinities.
    Float(f64),
    /// Text; what was not UTF-8 in the message became U+FFFD.
    Text(String),
    /// An array of bytes, kept compact: a path can't index it.
    Bytes(Vec<u8>),
    /// An array of anything else.
    Array(Vec<Value>),
    /// Named fields in the order of the message; the names are shared with the channel's definition.
    Object(Vec<(Arc<str>, Value)>),
}

impl Value {
    /// The field of that name, if this is an object that has it.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Object(fields) => fields.iter().find(|(n, _)| &**n == name).map(|(_, value)| value),
            _ => None,
        }
    }

    /// The number; NaN and infinities are passed on, null and text are no numbers.
    #[must_use]
    pub fn as_f64(&self) -> Option<f64> {
        match *self {
            Self::Int(i) => Some(i as f64),
            Self::Uint(u) => Some(u as f64),
            Self::Float(f) => Some(f),
            _ => None,
        }
    }

    /// The whole number, if it is one and fits.
    #[must_use]
    pub fn as_i64(&self) -> Option<i64> {
        match *self {
            Self::Int(i) => Some(i),
            Self::Uint(u) => i64::try_from(u).ok(),
            // Past 2^53 a float no longer says which whole number was meant.
            Self::Float(f) if f.fract() == 0.0 && f.abs() <= 9_007_199_254_740_992.0 => Some(f as i64),
            _ => None,
        }
    }

    /// Three numbers: an object with `x`, `y` and `z`, or an array of exactly three.
    #[must_use]
    pub fn as_vector3(&self) -> Option<[f64; 3]> {
        match self {
            Self::Object(_) => {
                Some([self.field("x")?.as_f64()?, self.field("y")?.as_f64()?, self.field("z")?.as_f64()?])
            }
            Self::Array(items) => match items.as_slice() {
                [x, y, z] => Some([x.as_f64()?, y.as_f64()?, z.as_f64()?]),
                _ => None,
            },
            _ => None,
        }
    }

    /// Seconds and nanoseconds of a time or duration object, whatever its encoding calls them.
    #[must_use]
    pub fn as_stamp(&self) -> Option<(i64, i64)> {
        let either = |names: &[&str]| names.iter().find_map(|name| self.field(name))?.as_i64();
        Some((either(&["sec", "secs", "seconds"])?, either(&["nsec", "nanosec", "nsecs", "nanos"])?))
    }

    /// The numbers of an array that holds nothing else, such as a covariance.
    #[must_use]
    pub fn as_numbers(&self) -> Option<Vec<f64>> {
        match self {
            Self::Array(items) => items.iter().map(Self::as_f64).collect(),
            Self::Bytes(bytes) => Some(bytes.iter().copied().map(f64::from).collect()),
            _ => None,
        }
    }

    /// The same as JSON, which has no NaN and no infinities: null.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Self::Null => serde_json::Value::Null,
            Self::Bool(truth) => (*truth).into(),
            Self::Int(i) => (*i).into(),
            Self::Uint(u) => (*u).into(),
            Self::Float(f) => (*f).into(),
            Self::Text(text) => text.as_str().into(),
            Self::Bytes(bytes) => bytes.as_slice().into(),
            Self::Array(items) => items.iter().map(Self::to_json).collect(),
            Self::Object(fields) => {
                fields.iter().map(|(name, value)| (name.to_string(), value.to_json())).collect()
            }
        }
    }

    /// What kind of value this is, in words for a message to the user.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Bool(_) => "a truth value",
            Self::Int(_) | Self::Uint(_) | Self::Float(_) => "a number",
            Self::Text(_) => "text",
            Self::Bytes(_) => "an array of bytes",
            Self::Array(_) => "an array",
            Self::Object(_) => "an object",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(fields: &[(&str, Value)]) -> Value {
        Value::Object(fields.iter().map(|(name, value)| ((*name).into(), value.clone())).collect())
    }

    #[test]
    fn a_vector_is_an_object_with_xyz_or_three_numbers() {
        let named = object(&[("z", Value::Int(3)), ("x", Value::Float(1.0)), ("y", Value::Uint(2))]);
        let listed = Value::Array(vec![Value::Int(1), Value::Int(2), Value::Int(3)]);
        assert_eq!(named.as_vector3(), Some([1.0, 2.0, 3.0]));
        assert_eq!(listed.as_vector3(), Some([1.0, 2.0, 3.0]));
        assert_eq!(Value::Array(vec![Value::Int(1); 4]).as_vector3(), None);
    }

    #[test]
    fn null_and_the_text_nan_are_no_numbers() {
        assert_eq!(Value::Null.as_f64(), None);
        assert_eq!(Value::Text("NaN".into()).as_f64(), None);
        assert_eq!(Value::Array(vec![Value::Int(1), Value::Null]).as_numbers(), None);
        assert_eq!(
            object(&[("x", Value::Null), ("y", Value::Int(0)), ("z", Value::Int(0))]).as_vector3(),
            None
        );
    }

    #[test]
    fn a_stamp_reads_the_names_of_every_encoding() {
        for (sec, nsec) in [("sec", "nsec"), ("sec", "nanosec"), ("secs", "nsecs"), ("seconds", "nanos")] {
            let stamp = object(&[(sec, Value::Int(-2)), (nsec, Value::Uint(5))]);
            assert_eq!(stamp.as_stamp(), Some((-2, 5)));
        }
        let broken = object(&[("sec", Value::Float(0.5)), ("nsec", Value::Int(0))]);
        assert_eq!(broken.as_stamp(), None);
        assert_eq!(object(&[("sec", Value::Uint(u64::MAX)), ("nsec", Value::Int(0))]).as_stamp(), None);
    }
}
