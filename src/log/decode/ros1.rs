//! The binary encoding of ROS 1 messages: packed, little-endian, no header.
//!
//! <http://wiki.ros.org/msg> has the types and their sizes.

use super::definition::Struct;
use super::reader::{Reader, Rules};
use super::selection::Pick;
use super::{DecodeError, Value};

const RULES: Rules = Rules { header_len: 0, aligned: false, little_endian: true, wide_unit_size: 0 };

/// What `pick` wants of the message; the rest is skipped, but checked to be there.
pub(super) fn decode(root: &Struct, pick: &Pick, payload: &[u8]) -> Result<Value, DecodeError> {
    Reader::new(payload, RULES).read_struct(root, pick)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Decoder, MessagePath, Value};

    const ODOMETRY: &str = "Header header\nstring child_frame_id\nbyte quality\nEmpty[] none\nPoint[] trail\n\
        duration age\nfloat32 speed\nuint8[] raw\n\
        ===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n\
        ===\nMSG: nav/Point\nfloat64 x\nfloat64 y\nfloat64 z\n===\nMSG: nav/Empty\nEmptier[9] e\n\
        ===\nMSG: nav/Emptier";

    fn decoder() -> Decoder {
        Decoder::new("ros1", "ros1msg", "nav/Odometry", ODOMETRY.as_bytes()).unwrap()
    }

    /// The message, packed by hand.
    fn message() -> Vec<u8> {
        let mut bytes = Vec::new();
        let u32s = |bytes: &mut Vec<u8>, values: &[u32]| {
            bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        };
        u32s(&mut bytes, &[7, 3_000_000_000, 250, 4]);
        bytes.extend(b"odom");
        u32s(&mut bytes, &[1]);
        bytes.extend(b"\0\xfe");
        u32s(&mut bytes, &[4_000_000_000, 1]);
        bytes.extend([1.5_f64, -2.0, 0.1].iter().flat_map(|v| v.to_le_bytes()));
        u32s(&mut bytes, &[0xffff_ffff, 5]);
        bytes.extend(0.5_f32.to_le_bytes());
        u32s(&mut bytes, &[2]);
        bytes.extend([8, 9]);
        bytes
    }

    #[test]
    fn fields_stand_one_behind_another_and_times_are_unsigned() {
        let value = decoder().decode(&message()).unwrap();
        let at = |path: &str| MessagePath::parse(path).unwrap().resolve(&value).unwrap().unwrap().clone();
        assert_eq!(at("t.header.stamp").as_stamp(), Some((3_000_000_000, 250)));
        assert_eq!(at("t.header.frame_id"), Value::Text("odom".into()));
        assert_eq!(at("t.child_frame_id"), Value::Text("\0".into()));
        assert_eq!(at("t.quality"), Value::Int(-2));
        assert_eq!(at("t.trail[0]").as_vector3(), Some([1.5, -2.0, 0.1]));
        assert_eq!(at("t.age").as_stamp(), Some((-1, 5)));
        assert_eq!(at("t.speed"), Value::Float(0.5));
        assert_eq!(at("t.raw"), Value::Bytes(vec![8, 9]));
    }

    #[test]
    fn billions_of_elements_without_a_byte_are_none() {
        let value = decoder().decode(&message()).unwrap();
        assert_eq!(value.field("none"), Some(&Value::Array(Vec::new())));
    }

    #[test]
    fn a_selection_skips_the_rest_and_every_cut_is_an_error() {
        let path = MessagePath::parse("t.trail[0].y").unwrap();
        let selected = decoder().select(std::slice::from_ref(&path)).unwrap();
        let value = selected.decode(&message()).unwrap();
        assert_eq!(path.resolve(&value), Ok(Some(&Value::Float(-2.0))));
        assert_eq!(value.field("raw"), None);
        for len in 0..message().len() {
            assert!(
                decoder().decode(&message()[..len]).is_err() && selected.decode(&message()[..len]).is_err()
            );
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(payload: Vec<u8>) {
            let _ = decoder().decode(&payload);
            let _ = decoder().select(&[]).unwrap().decode(&payload);
        }
    }
}
