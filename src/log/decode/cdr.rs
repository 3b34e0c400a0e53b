//! CDR, the binary encoding of ROS 2 messages (XCDR version 1, plain: OMG DDS-XTypes 1.3, 7.4.3).
//!
//! A payload starts with four bytes that name the representation; every number behind them is aligned to its
//! own size, counted from there.
//!
//! A `wstring` has 2 bytes a character with some middlewares and 4 with others, and the payload doesn't say which:
//! both are tried, and the one that ends where the payload does is right.

use super::definition::Struct;
use super::reader::{Reader, Rules};
use super::selection::Pick;
use super::{DecodeError, Value};

pub(super) const HEADER_LEN: usize = 4;

/// What `pick` wants of the message; the rest is skipped, but checked to be there.
pub(super) fn decode(root: &Struct, pick: &Pick, payload: &[u8]) -> Result<Value, DecodeError> {
    if !root.has_wide_text {
        return open(payload, 0)?.read_struct(root, pick);
    }
    let read = |unit_size| -> Result<_, DecodeError> {
        let mut reader = open(payload, unit_size)?;
        let value = reader.read_struct(root, pick)?;
        Ok((value, reader.is_plausible(), reader.has_met_wide_text))
    };
    match (read(2), read(4)) {
        (Ok((value, _, false)), _) => Ok(value),
        // as text, so that NaN equals itself
        (Ok((two, true, _)), Ok((four, true, _))) if format!("{two:?}") == format!("{four:?}") => Ok(two),
        (Ok((_, true, _)), Ok((_, true, _))) => Err(DecodeError::WideText),
        (Ok((value, true, _)), _) | (_, Ok((value, true, _))) => Ok(value),
        (Err(error), Err(_)) => Err(error),
        _ => Err(DecodeError::WideText),
    }
}

fn open(payload: &[u8], wide_unit_size: usize) -> Result<Reader<'_>, DecodeError> {
    let (header, bytes) = payload.split_first_chunk::<HEADER_LEN>().ok_or(DecodeError::Truncated {
        field: String::new(),
        at: 0,
        need: HEADER_LEN,
        left: payload.len(),
    })?;
    let representation = u16::from_be_bytes([header[0], header[1]]);
    let rules =
        |little_endian| Rules { header_len: HEADER_LEN, aligned: true, little_endian, wide_unit_size };
    match representation {
        0x0000 | 0x0001 => Ok(Reader::new(bytes, rules(representation == 1))),
        _ => Err(DecodeError::Representation { representation, name: representation_name(representation) }),
    }
}

/// The names of DDS-XTypes 1.3, table 60.
fn representation_name(representation: u16) -> &'static str {
    match representation {
        0x0002 | 0x0003 => "PL_CDR, parameter list",
        0x0004 => "XML",
        0x0006 | 0x0007 => "CDR2, XCDR version 2",
        0x0008 | 0x0009 => "D_CDR2, XCDR version 2",
        0x000a | 0x000b => "PL_CDR2, XCDR version 2",
        _ => "unknown",
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::super::definition::{Element, Shape};
    use super::super::{Decoder, MessagePath};
    use super::*;

    const ODOMETRY: &str = "std_msgs/Header header\nstring child_frame_id\nWithCovariance pose\n\
        ===\nMSG: p/WithCovariance\nPose pose\nfloat64[36] covariance\n\
        ===\nMSG: p/Pose\nPoint position\n===\nMSG: p/Point\nfloat64 x\nfloat64 y\nfloat64 z";

    fn decoder(text: &str) -> Decoder {
        Decoder::new("cdr", "ros2msg", "p/msg/Root", text.as_bytes()).unwrap()
    }

    fn json(value: &str) -> Value {
        serde_json::from_str(value).unwrap()
    }

    /// A CDR writer for the tests: the alignment rule, and nothing of the reader.
    struct Writer {
        bytes: Vec<u8>,
        little_endian: bool,
    }

    impl Writer {
        fn new(little_endian: bool) -> Self {
            Self { bytes: vec![0, u8::from(little_endian), 0, 0], little_endian }
        }

        fn put(&mut self, size: usize, bits: u64) -> &mut Self {
            while !(self.bytes.len() - 4).is_multiple_of(size) {
                self.bytes.push(0xee);
            }
            let little = bits.to_le_bytes();
            let number = little.iter().take(size).copied();
            if self.little_endian {
                self.bytes.extend(number);
            } else {
                self.bytes.extend(number.rev());
            }
            self
        }

        fn text(&mut self, text: &str) -> &mut Self {
            self.put(4, text.len() as u64 + 1);
            self.bytes.extend(text.bytes().chain([0]));
            self
        }

        fn value(&mut self, element: &Element, shape: Shape, value: &Value) {
            if let (Shape::Sequence, Value::Array(items)) = (shape, value) {
                self.put(4, items.len() as u64);
            }
            match (element, value) {
                (_, Value::Array(items)) => {
                    for item in items {
                        self.value(element, Shape::One, item);
                    }
                }
                (_, Value::Text(text)) => _ = self.text(text),
                (Element::Struct(inner), Value::Object(fields)) => {
                    if fields.is_empty() {
                        self.put(1, 0);
                    }
                    for (field, (_, value)) in inner.fields.iter().zip(fields) {
                        self.value(&field.element, field.shape, value);
                    }
                }
                (Element::Scalar(scalar), value) => {
                    let bits = match *value {
                        Value::Bool(b) => u64::from(b),
                        Value::Int(i) => i as u64,
                        Value::Uint(u) => u,
                        Value::Float(f) if scalar.size() == 4 => u64::from((f as f32).to_bits()),
                        Value::Float(f) => f.to_bits(),
                        _ => unreachable!("a scalar's value"),
                    };
                    self.put(scalar.size(), bits);
                }
                _ => unreachable!("value and layout agree"),
            }
        }
    }

    fn odometry(little_endian: bool) -> Vec<u8> {
        let mut writer = Writer::new(little_endian);
        writer.put(4, 7).put(4, 8).text("map").text("vehicle");
        for i in 0..39_u32 {
            writer.put(8, f64::from(i).to_bits());
        }
        writer.bytes
    }

    #[test]
    fn both_byte_orders_give_the_same_message() {
        let decoder = decoder(ODOMETRY);
        let value = decoder.decode(&odometry(true)).unwrap();
        assert_eq!(value, decoder.decode(&odometry(false)).unwrap());
        assert_eq!(value.field("header").unwrap().field("stamp").unwrap().as_stamp(), Some((7, 8)));
        let pose = value.field("pose").unwrap();
        assert_eq!(
            pose.field("pose").unwrap().field("position").unwrap().as_vector3(),
            Some([0.0, 1.0, 2.0])
        );
        let covariance: Vec<_> = (3..39).map(f64::from).collect();
        assert_eq!(pose.field("covariance").unwrap().as_numbers(), Some(covariance));
    }

    #[test]
    fn a_selection_holds_what_the_paths_lead_to_and_no_more() {
        let wanted =
            ["/t.header.stamp", "/t.pose.pose.position"].map(|path| MessagePath::parse(path).unwrap());
        let value = decoder(ODOMETRY).select(&wanted).unwrap().decode(&odometry(true)).unwrap();
        let expected = r#"{"header": {"stamp": {"sec": 7, "nanosec": 8}}, "pose": {"pose": {"position": {"x": 0.0, "y": 1.0, "z": 2.0}}}}"#;
        assert_eq!(format!("{value:?}").replace("Int(7)", "Uint(7)"), format!("{:?}", json(expected)));
    }

    #[test]
    fn a_text_is_as_long_as_it_says_with_or_without_a_nul() {
        let decoder = decoder("string a\nstring b\nuint8 c");
        let payload = [0, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, b'h', b'i', 9];
        assert_eq!(decoder.decode(&payload).unwrap().field("b"), Some(&Value::Text("hi".into())));
        let latin = [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0xe9, 0, 9];
        assert_eq!(decoder.decode(&latin).unwrap().field("b"), Some(&Value::Text("\u{fffd}".into())));
    }

    #[test]
    fn an_empty_struct_takes_one_byte() {
        let decoder = decoder("E[2] e\nuint8 x\n===\nMSG: p/E\nint32 A=1");
        assert_eq!(decoder.decode(&[0, 1, 0, 0, 9, 9, 5]).unwrap().field("x"), Some(&Value::Uint(5)));
    }

    #[test]
    fn no_element_of_an_empty_sequence_is_aligned() {
        let decoder = decoder("float64[] a\nuint8 x");
        let payload = [0, 1, 0, 0, 0, 0, 0, 0, 5];
        assert_eq!(decoder.decode(&payload).unwrap().field("x"), Some(&Value::Uint(5)));
        let skipping = decoder.select(&[MessagePath::parse("t.x").unwrap()]).unwrap();
        assert_eq!(skipping.decode(&payload).unwrap().field("x"), Some(&Value::Uint(5)));
    }

    #[test]
    fn an_array_that_claims_more_than_is_left_is_refused_before_it_is_allocated() {
        for text in
            ["float64[] a", "E[] a\n===\nMSG: p/E\n", "string[] a", "uint8[] a", "float64[99999999999] a"]
        {
            let decoder = decoder(text);
            for decoder in [decoder.select(&[]).unwrap(), decoder] {
                let error = decoder.decode(&[0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff]).unwrap_err().to_string();
                assert!(error.starts_with("payload too short: field \"a\" needs"), "{text}: {error}");
            }
        }
    }

    #[test]
    fn a_payload_cut_anywhere_is_an_error_that_names_the_field() {
        let decoder = decoder(ODOMETRY);
        let whole = odometry(true);
        let wanted = [MessagePath::parse("t.header.stamp").unwrap()];
        for len in 0..whole.len() {
            assert!(decoder.decode(&whole[..len]).is_err());
            assert!(decoder.select(&wanted).unwrap().decode(&whole[..len]).is_err());
        }
        let error = decoder.decode(&whole[..59]).unwrap_err().to_string();
        assert_eq!(
            error,
            "payload too short: field \"pose.pose.position.z\" needs 8 bytes at byte 52, 7 left"
        );
    }

    #[test]
    fn other_representations_are_refused_by_name() {
        let error = |second| decoder("bool a").decode(&[0, second, 0, 0, 1]).unwrap_err().to_string();
        assert!(error(3).contains("0x0003 (PL_CDR, parameter list)"));
        assert!(error(9).contains("0x0009 (D_CDR2, XCDR version 2)"));
        assert!(error(0x77).contains("0x0077 (unknown)"));
    }

    #[test]
    fn the_size_of_wide_characters_is_the_one_that_ends_where_the_payload_does() {
        let decoder = decoder("wstring a\nfloat64 x");
        let message = |size: usize, text: &str| {
            let mut writer = Writer::new(true);
            writer.put(4, text.chars().count() as u64);
            text.chars().for_each(|c| _ = writer.put(size, c as u64));
            writer.put(8, 2.5_f64.to_bits());
            writer.bytes
        };
        let wanted = [MessagePath::parse("t.x").unwrap()];
        for (size, text) in [(2, "höhe"), (4, "höhe"), (2, ""), (4, "ab€"), (2, "€"), (4, "e")] {
            let payload = message(size, text);
            let value = decoder.decode(&payload).unwrap();
            assert_eq!(value.field("a"), Some(&Value::Text(text.into())), "{size}");
            assert_eq!(value.field("x"), Some(&Value::Float(2.5)));
            let skipped = decoder.select(&wanted).unwrap().decode(&payload).unwrap();
            assert_eq!(skipped.field("x"), Some(&Value::Float(2.5)));
        }
        // cut in the middle, it ends nowhere
        let error = decoder.decode(&[message(2, "höhe"), vec![1; 3]].concat()).unwrap_err();
        assert!(error.to_string().contains("2 bytes or 4"), "{error}");
    }

    /// A definition with one field of each line, and values for it.
    fn messages() -> impl Strategy<Value = (String, Value)> {
        let element = prop_oneof![
            any::<bool>().prop_map(|b| ("bool", Value::Bool(b))),
            any::<u8>().prop_map(|u| ("char", Value::Uint(u.into()))),
            any::<i8>().prop_map(|i| ("int8", Value::Int(i.into()))),
            any::<u16>().prop_map(|u| ("uint16", Value::Uint(u.into()))),
            any::<i32>().prop_map(|i| ("int32", Value::Int(i.into()))),
            any::<u64>().prop_map(|u| ("uint64", Value::Uint(u))),
            any::<f32>().prop_map(|f| ("float32", Value::Float(f.into()))),
            any::<f64>().prop_map(|f| ("float64", Value::Float(f))),
            "[a-zA-Z0-9é]{0,9}".prop_map(|text| ("string", Value::Text(text))),
            Just(("E", Value::Object(Vec::new()))),
            any::<i64>().prop_map(|i| ("I", Value::Object(vec![("i".into(), Value::Int(i))]))),
        ];
        let field = (element, 0..3_usize, 0..4_usize).prop_map(|((name, value), shape, count)| match shape {
            0 => (name.to_owned(), value),
            1 => (format!("{name}[{}]", count + 1), Value::Array(vec![value; count + 1])),
            _ => (format!("{name}[<=9]"), Value::Array(vec![value; count])),
        });
        prop::collection::vec(field, 0..8).prop_map(|fields| {
            let lines = fields.iter().enumerate().map(|(index, (kind, _))| format!("{kind} f{index}\n"));
            let text: String = lines.collect();
            let named = |(index, (_, value))| (format!("f{index}").into(), value);
            let values = fields.into_iter().enumerate().map(named).collect();
            (text + "===\nMSG: p/E\n===\nMSG: p/I\nint64 i", Value::Object(values))
        })
    }

    /// Arrays of `char` come back as bytes.
    fn with_bytes(decoded: &Value, expected: Value) -> Value {
        match (decoded, expected) {
            (Value::Bytes(_), Value::Array(items)) => {
                Value::Bytes(items.iter().map(|item| item.as_i64().unwrap() as u8).collect())
            }
            (Value::Object(decoded), Value::Object(expected)) => Value::Object(
                decoded.iter().zip(expected).map(|((_, d), (name, e))| (name, with_bytes(d, e))).collect(),
            ),
            (_, expected) => expected,
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back((text, value) in messages(), little_endian: bool, wanted in 0..8_usize) {
            let decoder = decoder(&text);
            let super::super::Format::Cdr { root, .. } = &decoder.format else { unreachable!() };
            let mut writer = Writer::new(little_endian);
            writer.value(&Element::Struct(Arc::clone(root)), Shape::One, &value);
            let decoded = decoder.decode(&writer.bytes).unwrap();
            // As text, so that NaN equals itself.
            prop_assert_eq!(format!("{:?}", decoded), format!("{:?}", with_bytes(&decoded, value.clone())));

            let path = MessagePath::parse(&format!("t.f{wanted}")).unwrap();
            if let Ok(selected) = decoder.select(std::slice::from_ref(&path)) {
                let part = selected.decode(&writer.bytes).unwrap();
                prop_assert_eq!(format!("{:?}", path.resolve(&part)), format!("{:?}", path.resolve(&decoded)));
            }
        }

        #[test]
        fn arbitrary_bytes_never_panic((text, _) in messages(), payload: Vec<u8>, little_endian: bool) {
            let decoder = decoder(&text);
            let _ = decoder.decode(&payload);
            let headed = [&[0, u8::from(little_endian), 0, 0], payload.as_slice()].concat();
            let _ = decoder.decode(&headed);
            let _ = decoder.select(&[]).unwrap().decode(&headed);
        }
    }
}
