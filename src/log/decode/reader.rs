//! Fields one behind another, as the binary encodings of ROS have them: the order is the definition's, and nothing
//! in the bytes names a field.

use std::sync::Arc;

use super::definition::{Element, Field, Scalar, Shape, Struct};
use super::selection::Pick;
use super::{DecodeError, Value};

/// How an encoding lays out what a definition says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Bytes of the payload before those that are read; alignment counts from behind them.
    pub(super) header_len: usize,
    /// Whether every number stands at a multiple of its size, and a text ends with NUL.
    pub(super) aligned: bool,
    pub(super) little_endian: bool,
    /// Bytes of a character of a `wstring`: 2 or 4; 0 where there are none.
    pub(super) wide_unit_size: usize,
}

pub(super) struct Reader<'p> {
    /// The payload behind its header.
    bytes: &'p [u8],
    at: usize,
    rules: Rules,
    /// Whether a `wstring` with characters was passed.
    pub(super) has_met_wide_text: bool,
    /// Whether one was with characters that no text has.
    has_met_odd_text: bool,
}

impl<'p> Reader<'p> {
    pub(super) fn new(bytes: &'p [u8], rules: Rules) -> Self {
        Self { bytes, at: 0, rules, has_met_wide_text: false, has_met_odd_text: false }
    }

    /// Whether every `wstring` was a text, and nothing is left but zeros that fill up to a multiple of 4.
    pub(super) fn is_plausible(&self) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let filled = self.bytes.len().is_multiple_of(4) && rest.len() < 4;
        let is_at_end = rest.is_empty() || (filled && rest.iter().all(|byte| *byte == 0));
        is_at_end && !self.has_met_odd_text
    }

    pub(super) fn read_struct(&mut self, layout: &Struct, pick: &Pick) -> Result<Value, DecodeError> {
        if layout.has_no_content {
            self.take(1, layout.least_size)?;
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
        if field.element.least_size() == 0 {
            return Ok(Value::Array(Vec::new()));
        }
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
            Element::WideText => Ok(Value::Text(self.read_wide_text()?)),
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
            element if count == 0 || element.least_size() == 0 => {}
            Element::Scalar(scalar) => {
                self.take(scalar.size(), scalar.size().saturating_mul(count))?;
            }
            Element::Text => {
                for _ in 0..count {
                    self.take_text()?;
                }
            }
            Element::WideText => {
                for _ in 0..count {
                    self.read_wide_text()?;
                }
            }
            Element::Struct(inner) => {
                for _ in 0..count {
                    self.skip_struct(inner)?;
                }
            }
        }
        Ok(())
    }

    fn skip_struct(&mut self, layout: &Struct) -> Result<(), DecodeError> {
        if layout.has_no_content {
            self.take(1, layout.least_size)?;
            return Ok(());
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
        let text = if self.rules.aligned { bytes.strip_suffix(&[0]) } else { None };
        Ok(text.unwrap_or(bytes))
    }

    /// Also notes what no text holds: then its characters have another size.
    fn read_wide_text(&mut self) -> Result<String, DecodeError> {
        let length = self.read_length()?;
        self.has_met_wide_text |= length > 0;
        let bytes = self.take(1, length.saturating_mul(self.rules.wide_unit_size))?;
        let little_endian = self.rules.little_endian;
        let mut text: String = if self.rules.wide_unit_size == 2 {
            let order = if little_endian { u16::from_le_bytes } else { u16::from_be_bytes };
            let units = bytes.as_chunks().0.iter().map(|unit| order(*unit));
            char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
        } else {
            let order = if little_endian { u32::from_le_bytes } else { u32::from_be_bytes };
            let units = bytes.as_chunks().0.iter().map(|unit| order(*unit));
            units.map(|unit| char::from_u32(unit).unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
        };
        if text.ends_with('\0') {
            text.pop();
        }
        self.has_met_odd_text |= text.contains(['\0', char::REPLACEMENT_CHARACTER]);
        Ok(text)
    }

    fn order<const N: usize, T>(
        &mut self,
        little: fn([u8; N]) -> T,
        big: fn([u8; N]) -> T,
    ) -> Result<T, DecodeError> {
        let bytes = self.take_array()?;
        Ok(if self.rules.little_endian { little(bytes) } else { big(bytes) })
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
        let behind = if self.rules.aligned { alignment - 1 } else { 0 };
        (self.at + behind) & !behind
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
        DecodeError::Truncated { field: String::new(), at: at + self.rules.header_len, need, left }
    }
}

/// Not all that calls itself a string is UTF-8, and a broken frame name must not cost the message.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
