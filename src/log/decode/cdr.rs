//! CDR, the binary encoding of ROS 2 messages (XCDR version 1, plain: OMG DDS-XTypes 1.3, 7.4.3).
//!
//! A payload starts with four bytes that name the representation; every number behind them is aligned to its
//! own size, counted from there.

use std::str;
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
