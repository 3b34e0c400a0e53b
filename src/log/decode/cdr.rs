//! CDR, the binary encoding of ROS 2 messages (XCDR version 1, plain: OMG DDS-XTypes 1.3, 7.4.3).
//!
//! A payload starts with four bytes that name the representation; every number behind them is aligned to its
//! own size, counted from there.

use std::sync::Arc;

use super::definition::{Element, Field, Scalar, Shape, Struct};
use super::selection::Pick;
use super::{DecodeError, Value};

const HEADER_LEN: usize = 4;

/// What `pick` wants of the message; the rest is skipped, but checked to be there.
pub(super) fn decode(root: &Struct, pick: &Pick, payload: &[u8]) -> Result<Value, DecodeError> {
    let mut reader = Reader::new(payload)?;
    reader.read_struct(root, pick)
}

struct Reader<'p> {
    /// The payload behind its header.
    bytes: &'p [u8],
    at: usize,
    little_endian: bool,
}

impl<'p> Reader<'p> {
    fn new(payload: &'p [u8]) -> Result<Self, DecodeError> {
        let (header, bytes) = payload.split_first_chunk::<HEADER_LEN>().ok_or(DecodeError::Truncated {
            field: String::new(),
            at: 0,
            need: HEADER_LEN,
            left: payload.len(),
        })?;
        let representation = u16::from_be_bytes([header[0], header[1]]);
        match representation {
            0x0000 | 0x0001 => Ok(Self { bytes, at: 0, little_endian: representation == 1 }),
            _ => {
                Err(DecodeError::Representation { representation, name: representation_name(representation) })
            }
        }
    }

    fn read_struct(&mut self, layout: &Struct, pick: &Pick) -> Result<Value, DecodeError> {
        if layout.fields.is_empty() {
            self.take(1, 1)?;
            return Ok(Value::Object(Vec::new()));
        }
        let mut values = Vec::with_capacity(pick.count(layout));
        for (index, field) in layout.fields.iter().enumerate() {
            match pick.of_field(index) {
                Some(pick) => {
                    let value = self.read_field(field, pick).map_err(|e| e.inside(&field.name))?;
                    values.push((Arc::clone(&field.name), value));
                }
                None => self.skip_field(field).map_err(|e| e.inside(&field.name))?,
            }
        }
        Ok(Value::Object(values))
    }

    fn read_field(&mut self, field: &Field, pick: &Pick) -> Result<Value, DecodeError> {
        let count = match field.shape {
            Shape::One => return self.read_element(&field.element, pick),
            Shape::Fixed(count) => count,
            Shape::Sequence => self.read_length()?,
        };
        self.check_left(count, field.element.least_size())?;
        if field.element.is_byte() {
            return Ok(Value::Bytes(self.take(1, count)?.to_vec()));
        }
        let mut items = Vec::with_capacity(count);
        for _ in 0..count {
            items.push(self.read_element(&field.element, pick)?);
        }
        Ok(Value::Array(items))
    }

    fn read_element(&mut self, element: &Element, pick: &Pick) -> Result<Value, DecodeError> {
        match element {
            Element::Scalar(scalar) => self.read_scalar(*scalar),
            Element::Text => Ok(Value::Text(text(self.take_text()?))),
            Element::WideText => Err(self.wide_text()),
            Element::Struct(inner) => self.read_struct(inner, pick),
        }
    }

    fn read_scalar(&mut self, scalar: Scalar) -> Result<Value, DecodeError> {
        let bits = match scalar.size() {
            1 => u64::from(self.take_array::<1>()?[0]),
            2 => u64::from(self.order(u16::from_le_bytes, u16::from_be_bytes)?),
            4 => u64::from(self.order(u32::from_le_bytes, u32::from_be_bytes)?),
            _ => self.order(u64::from_le_bytes, u64::from_be_bytes)?,
        };
        Ok(match scalar {
            Scalar::Bool => Value::Bool(bits != 0),
            Scalar::Uint { .. } => Value::Uint(bits),
            Scalar::Int { size: 1 } => Value::Int(i64::from(bits as i8)),
            Scalar::Int { size: 2 } => Value::Int(i64::from(bits as i16)),
            Scalar::Int { size: 4 } => Value::Int(i64::from(bits as i32)),
            Scalar::Int { .. } => Value::Int(bits as i64),
            Scalar::Float { size: 4 } => Value::Float(f64::from(f32::from_bits(bits as u32))),
            Scalar::Float { .. } => Value::Float(f64::from_bits(bits)),
        })
    }

    fn skip_field(&mut self, field: &Field) -> Result<(), DecodeError> {
        let count = match field.shape {
            Shape::One => 1,
            Shape::Fixed(count) => count,
            Shape::Sequence => self.read_length()?,
        };
        self.check_left(count, field.element.least_size())?;
        match &field.element {
            _ if count == 0 => {}
            Element::Scalar(scalar) => {
                self.take(scalar.size(), scalar.size().saturating_mul(count))?;
            }
            Element::Text => {
                for _ in 0..count {
                    self.take_text()?;
                }
            }
            Element::WideText => return Err(self.wide_text()),
            Element::Struct(inner) => {
                for _ in 0..count {
                    self.skip_struct(inner)?;
                }
            }
        }
        Ok(())
    }

    fn skip_struct(&mut self, layout: &Struct) -> Result<(), DecodeError> {
        if layout.fields.is_empty() {
            self.take(1, 1)?;
        }
        for field in &layout.fields {
            self.skip_field(field).map_err(|e| e.inside(&field.name))?;
        }
        Ok(())
    }

    fn read_length(&mut self) -> Result<usize, DecodeError> {
        let length = self.order(u32::from_le_bytes, u32::from_be_bytes)?;
        Ok(usize::try_from(length).unwrap_or(usize::MAX))
    }

    /// A text's bytes, without the NUL that ends it; some writers give an empty text no NUL.
    fn take_text(&mut self) -> Result<&'p [u8], DecodeError> {
        let length = self.read_length()?;
        let bytes = self.take(1, length)?;
        Ok(bytes.strip_suffix(&[0]).unwrap_or(bytes))
    }

    fn order<const N: usize, T>(
        &mut self,
        little: fn([u8; N]) -> T,
        big: fn([u8; N]) -> T,
    ) -> Result<T, DecodeError> {
        let bytes = self.take_array()?;
        Ok(if self.little_endian { little(bytes) } else { big(bytes) })
    }

    fn take_array<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let at = self.aligned(N);
        match self.bytes.get(at..).and_then(|rest| rest.first_chunk::<N>()) {
            Some(bytes) => {
                self.at = at + N;
                Ok(*bytes)
            }
            None => Err(self.truncated(at, N)),
        }
    }

    /// `len` bytes from the next multiple of `alignment`.
    fn take(&mut self, alignment: usize, len: usize) -> Result<&'p [u8], DecodeError> {
        let at = self.aligned(alignment);
        match self.bytes.get(at..).and_then(|rest| rest.get(..len)) {
            Some(bytes) => {
                self.at = at + len;
                Ok(bytes)
            }
            None => Err(self.truncated(at, len)),
        }
    }

    /// `alignment` is a power of two.
    fn aligned(&self, alignment: usize) -> usize {
        (self.at + alignment - 1) & !(alignment - 1)
    }

    /// Before anything is allocated for it: can the bytes left hold so many elements?
    fn check_left(&self, count: usize, least_size: usize) -> Result<(), DecodeError> {
        let need = count.saturating_mul(least_size);
        if need > self.bytes.len().saturating_sub(self.at) {
            return Err(self.truncated(self.at, need));
        }
        Ok(())
    }

    #[cold]
    fn truncated(&self, at: usize, need: usize) -> DecodeError {
        let left = self.bytes.len().saturating_sub(at);
        DecodeError::Truncated { field: String::new(), at: at + HEADER_LEN, need, left }
    }

    #[cold]
    fn wide_text(&self) -> DecodeError {
        DecodeError::WideText { field: String::new(), at: self.at + HEADER_LEN }
    }
}

/// Not all that calls itself a string is UTF-8, and a broken frame name must not cost the message.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
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
    use proptest::prelude::*;

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
    fn a_wide_text_is_refused_where_it_stands() {
        let error = decoder("uint8 a\nwstring b").decode(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]).unwrap_err();
        assert!(error.to_string().starts_with("field \"b\" at byte 5 is a wstring"));
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
