//! The layout of a message type: a tree of structs, whatever language it was defined in.
//!
//! A parser hands over a [`RawDefinition`], whose types name each other; [`resolve`] links them. The result is
//! finite: no type holds itself, nesting ends at [`MAX_DEPTH`], and every element takes at least one byte, so
//! that the bytes of a message bound what is allocated for it.

use std::collections::HashMap;
use std::sync::Arc;

use super::DecodeError;

/// Structs within structs; the deepest in common use (a stamped pose with covariance) is five.
pub(super) const MAX_DEPTH: usize = 32;

/// A struct whose fields are all linked.
#[derive(Debug)]
pub(super) struct Struct {
    pub(super) fields: Vec<Field>,
    /// Bytes that a value takes at the least, without padding; never 0.
    pub(super) least_size: usize,
    depth: usize,
}

#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: Arc<str>,
    pub(super) element: Element,
    pub(super) shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    One,
    Fixed(usize),
    Sequence,
}

#[derive(Clone, Debug)]
pub(super) enum Element {
    Scalar(Scalar),
    Text,
    WideText,
    Struct(Arc<Struct>),
}

/// A number or truth value; `size` is in bytes: 1, 2, 4 or 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    Bool,
    Int { size: u8 },
    Uint { size: u8 },
    Float { size: u8 },
}

impl Scalar {
    pub(super) const fn size(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::Int { size } | Self::Uint { size } | Self::Float { size } => size as usize,
        }
    }
}

impl Element {
    /// Whether this is one unsigned byte, whose arrays are kept as bytes.
    pub(super) const fn is_byte(&self) -> bool {
        matches!(self, Self::Scalar(Scalar::Uint { size: 1 }))
    }

    /// Bytes that one element takes at the least; a text has its length in front.
    pub(super) fn least_size(&self) -> usize {
        match self {
            Self::Scalar(scalar) => scalar.size(),
            Self::Text | Self::WideText => 4,
            Self::Struct(inner) => inner.least_size,
        }
    }
}

impl Field {
    fn depth(&self) -> usize {
        match &self.element {
            Element::Struct(inner) => inner.depth,
            _ => 0,
        }
    }

    fn least_size(&self) -> usize {
        match self.shape {
            Shape::One => self.element.least_size(),
            Shape::Fixed(count) => self.element.least_size().saturating_mul(count),
            Shape::Sequence => 4,
        }
    }
}

/// The type of a message, and those that it may be made of.
#[derive(Debug)]
pub(super) struct RawDefinition {
    pub(super) root: RawStruct,
    pub(super) others: Vec<RawStruct>,
}

/// A struct as its text has it: the types of its fields are still names.
#[derive(Debug)]
pub(super) struct RawStruct {
    /// `package/Type`, or `Type` where the text names no package.
    pub(super) name: String,
    pub(super) fields: Vec<RawField>,
}

#[derive(Debug)]
pub(super) struct RawField {
    pub(super) name: String,
    pub(super) element: RawElement,
    pub(super) shape: Shape,
}

#[derive(Debug)]
pub(super) enum RawElement {
    Scalar(Scalar),
    Text,
    WideText,
    Named(String),
}

/// Links the types that `root` is made of; of two types with one name the first counts.
///
/// # Errors
/// [`DecodeError::MissingType`], [`DecodeError::CyclicType`], [`DecodeError::DeepType`].
pub(super) fn resolve(definition: &RawDefinition) -> Result<Arc<Struct>, DecodeError> {
    let mut by_name = HashMap::new();
    let mut by_short_name = HashMap::new();
    for raw in std::iter::once(&definition.root).chain(&definition.others) {
        by_name.entry(raw.name.as_str()).or_insert(raw);
        by_short_name.entry(short(&raw.name)).or_insert(raw);
    }
    Linker { by_name, by_short_name, done: HashMap::new(), open: Vec::new() }.link(&definition.root)
}

fn short(name: &str) -> &str {
    name.rsplit_once('/').map_or(name, |(_, short)| short)
}

struct Linker<'r> {
    by_name: HashMap<&'r str, &'r RawStruct>,
    by_short_name: HashMap<&'r str, &'r RawStruct>,
    done: HashMap<&'r str, Arc<Struct>>,
    open: Vec<&'r str>,
}

impl<'r> Linker<'r> {
    fn link(&mut self, raw: &'r RawStruct) -> Result<Arc<Struct>, DecodeError> {
        if let Some(done) = self.done.get(raw.name.as_str()) {
            return Ok(Arc::clone(done));
        }
        if self.open.contains(&raw.name.as_str()) {
            return Err(DecodeError::CyclicType { name: raw.name.clone() });
        }
        let too_deep = || DecodeError::DeepType { name: raw.name.clone(), most: MAX_DEPTH };
        if self.open.len() >= MAX_DEPTH {
            return Err(too_deep());
        }
        self.open.push(&raw.name);
        let fields =
            raw.fields.iter().map(|field| self.link_field(raw, field)).collect::<Result<Vec<_>, _>>()?;
        self.open.pop();

        let depth = 1 + fields.iter().map(Field::depth).max().unwrap_or(0);
        if depth > MAX_DEPTH {
            return Err(too_deep());
        }
        // A struct without fields has one byte, `structure_needs_at_least_one_member`.
        let least_size =
            fields.iter().fold(0_usize, |sum, field| sum.saturating_add(field.least_size())).max(1);
        let linked = Arc::new(Struct { fields, least_size, depth });
        self.done.insert(&raw.name, Arc::clone(&linked));
        Ok(linked)
    }

    fn link_field(&mut self, parent: &'r RawStruct, field: &'r RawField) -> Result<Field, DecodeError> {
        let element = match &field.element {
            RawElement::Scalar(scalar) => Element::Scalar(*scalar),
            RawElement::Text => Element::Text,
            RawElement::WideText => Element::WideText,
            RawElement::Named(name) => {
                let raw = self.find(parent, name).ok_or_else(|| DecodeError::MissingType {
                    name: name.clone(),
                    parent: parent.name.clone(),
                    field: field.name.clone(),
                })?;
                Element::Struct(self.link(raw)?)
            }
        };
        Ok(Field { name: field.name.as_str().into(), element, shape: field.shape })
    }

    /// A name without a package means the package that it stands in, else any that has such a type.
    fn find(&self, parent: &RawStruct, name: &str) -> Option<&'r RawStruct> {
        if name.contains('/') {
            return self.by_name.get(name).copied();
        }
        let beside = parent.name.rsplit_once('/').map(|(package, _)| format!("{package}/{name}"));
        let beside = beside.and_then(|full| self.by_name.get(full.as_str()));
        beside.or_else(|| self.by_short_name.get(name)).copied()
    }
}
