//! The layout of a message type: a tree of structs, whatever language it was defined in.
//!
//! A parser hands over a [`RawDefinition`], whose types name each other; [`resolve`] links them. The result is
//! finite: no type holds itself, nesting ends at [`MAX_DEPTH`], and what is known of the least size of every
//! element lets the bytes of a message bound what is allocated for it.

use std::collections::HashMap;
use std::sync::Arc;

use super::DecodeError;

/// Structs within structs; the deepest in common use (a stamped pose with covariance) is five.
pub(super) const MAX_DEPTH: usize = 32;

/// A struct whose fields are all linked.
#[derive(Debug)]
pub(super) struct Struct {
    pub(super) fields: Vec<Field>,
    /// Bytes that a value takes at the least, without padding; 0 only for a ROS 1 type without content.
    pub(super) least_size: usize,
    /// Whether it has no fields, or only such as take no bytes.
    pub(super) has_no_content: bool,
    /// Whether there is a `wstring` anywhere in it.
    pub(super) has_wide_text: bool,
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
    fn has_wide_text(&self) -> bool {
        match &self.element {
            Element::Struct(inner) => inner.has_wide_text,
            element => matches!(element, Element::WideText),
        }
    }

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
    /// `package/Type`, or `Type` where the text names no package; in IDL all modules, `package/msg/Type`.
    pub(super) name: String,
    pub(super) fields: Vec<RawField>,
}

#[derive(Debug)]
pub(super) struct RawField {
    pub(super) name: String,
    pub(super) element: RawElement,
    pub(super) shape: Shape,
}

#[derive(Clone, Debug)]
pub(super) enum RawElement {
    Scalar(Scalar),
    Text,
    WideText,
    Named(String),
}

/// Links the types that `root` is made of; of two types with one name the first counts. A struct without fields
/// takes `empty_size` bytes: 0, or 1 as in CDR, where it is given a member that has no name.
///
/// # Errors
/// [`DecodeError::MissingType`], [`DecodeError::CyclicType`], [`DecodeError::DeepType`].
pub(super) fn resolve(definition: &RawDefinition, empty_size: usize) -> Result<Arc<Struct>, DecodeError> {
    let mut by_name = HashMap::new();
    let mut by_short_name = HashMap::new();
    for raw in std::iter::once(&definition.root).chain(&definition.others) {
        by_name.entry(raw.name.as_str()).or_insert(raw);
        by_short_name.entry(short(&raw.name)).or_insert(raw);
    }
    Linker { by_name, by_short_name, empty_size, done: HashMap::new(), open: Vec::new() }
        .link(&definition.root)
}

fn short(name: &str) -> &str {
    name.rsplit_once('/').map_or(name, |(_, short)| short)
}

struct Linker<'r> {
    by_name: HashMap<&'r str, &'r RawStruct>,
    by_short_name: HashMap<&'r str, &'r RawStruct>,
    empty_size: usize,
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
        let content = fields.iter().fold(0_usize, |sum, field| sum.saturating_add(field.least_size()));
        let has_no_content = content == 0;
        let least_size = content.max(self.empty_size);
        let has_wide_text = fields.iter().any(Field::has_wide_text);
        let linked = Arc::new(Struct { fields, least_size, has_no_content, has_wide_text, depth });
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

    /// A name is looked for beside its parent, then in each of the scopes around that; one without a package means
    /// any type of that name where none is nearer.
    fn find(&self, parent: &RawStruct, name: &str) -> Option<&'r RawStruct> {
        let mut scope = parent.name.as_str();
        while let Some((outer, _)) = scope.rsplit_once('/') {
            if let Some(found) = self.by_name.get(format!("{outer}/{name}").as_str()) {
                return Some(found);
            }
            scope = outer;
        }
        let global = self.by_name.get(name);
        let any = || if name.contains('/') { None } else { self.by_short_name.get(name) };
        global.or_else(any).copied()
    }
}
