//! Which parts of a message type the wanted paths need.

use super::definition::{Element, Field, Shape, Struct};
use super::path::{Filter, MessagePath, PathMiss, Step};

/// What to decode of a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    /// All of it.
    All,
    /// Of a struct, or of each struct in an array, the fields that have a pick: one entry per field.
    Fields(Vec<Option<Pick>>),
}

impl Pick {
    /// What all `paths` together need of `root`.
    ///
    /// # Errors
    /// [`PathMiss`] where a path leads nowhere in any message of this type.
    pub(super) fn of_paths(root: &Struct, paths: &[MessagePath]) -> Result<Self, PathMiss> {
        let mut pick = Self::nothing_of(root);
        for path in paths {
            pick.add(path, 0, Place::Struct(root))?;
        }
        Ok(pick)
    }

    pub(super) fn of_field(&self, index: usize) -> Option<&Self> {
        match self {
            Self::All => Some(self),
            Self::Fields(picks) => picks.get(index)?.as_ref(),
        }
    }

    /// How many fields of `layout` are picked.
    pub(super) fn count(&self, layout: &Struct) -> usize {
        match self {
            Self::All => layout.fields.len(),
            Self::Fields(picks) => picks.iter().flatten().count(),
        }
    }

    fn nothing_of(layout: &Struct) -> Self {
        Self::Fields(vec![None; layout.fields.len()])
    }

    /// Adds what the steps of `path` from `depth` on need of the value at `place`.
    fn add(&mut self, path: &MessagePath, depth: usize, place: Place<'_>) -> Result<(), PathMiss> {
        let Some(step) = path.steps.get(depth) else {
            *self = Self::All;
            return Ok(());
        };
        match step {
            Step::Field(name) => {
                let (pick, inner) = self.descend(path, depth, place, name)?;
                pick.add(path, depth + 1, inner)
            }
            Step::Filter(filter) => {
                self.add_filter(path, depth, place, filter)?;
                self.add(path, depth + 1, place)
            }
            Step::Index(_) => self.add(path, depth + 1, place.element(path, depth)?),
            Step::First(filters) => {
                let element = place.element(path, depth)?;
                for filter in filters {
                    self.add_filter(path, depth, element, filter)?;
                }
                self.add(path, depth + 1, element)
            }
        }
    }

    fn add_filter(
        &mut self,
        path: &MessagePath,
        depth: usize,
        place: Place<'_>,
        filter: &Filter,
    ) -> Result<(), PathMiss> {
        let (mut pick, mut place) = (self, place);
        for name in &filter.fields {
            (pick, place) = pick.descend(path, depth, place, name)?;
        }
        *pick = Self::All;
        Ok(())
    }

    /// The pick and the place of a field; where nothing was picked of it yet, an empty pick.
    fn descend<'p, 'd>(
        &'p mut self,
        path: &MessagePath,
        depth: usize,
        place: Place<'d>,
        name: &str,
    ) -> Result<(&'p mut Self, Place<'d>), PathMiss> {
        let Place::Struct(layout) = place else {
            return Err(path.wrong_kind(place.kind(), "an object", depth));
        };
        let found = layout.fields.iter().enumerate().find(|(_, field)| &*field.name == name);
        let Some((index, field)) = found else {
            let available = layout.fields.iter().map(|field| field.name.to_string()).collect();
            return Err(path.no_field(name, depth, available));
        };
        let inner = Place::of_field(field);
        // Under `All` everything is picked already, and stays so: `All` stands in for its own parts.
        if matches!(self, Self::All) {
            return Ok((self, inner));
        }
        match self {
            Self::Fields(picks) => match picks.get_mut(index) {
                Some(slot) => Ok((slot.get_or_insert_with(|| inner.nothing()), inner)),
                None => Err(path.no_field(name, depth, Vec::new())),
            },
            Self::All => Err(path.no_field(name, depth, Vec::new())),
        }
    }
}

/// A value's place in the layout of a message.
#[derive(Clone, Copy)]
enum Place<'d> {
    Struct(&'d Struct),
    Array(&'d Element),
    Bytes,
    Leaf(&'static str),
}

impl<'d> Place<'d> {
    fn of_field(field: &'d Field) -> Self {
        match (field.shape, &field.element) {
            (Shape::One, element) => Self::of_element(element),
            (_, element) if element.is_byte() => Self::Bytes,
            (_, element) => Self::Array(element),
        }
    }

    fn of_element(element: &'d Element) -> Self {
        match element {
            Element::Struct(inner) => Self::Struct(inner),
            Element::Scalar(_) => Self::Leaf("a number"),
            Element::Text | Element::WideText => Self::Leaf("text"),
        }
    }

    fn element(self, path: &MessagePath, depth: usize) -> Result<Self, PathMiss> {
        match self {
            Self::Array(element) => Ok(Self::of_element(element)),
            _ => Err(path.wrong_kind(self.kind(), "an array", depth)),
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::Struct(_) => "an object",
            Self::Array(_) => "an array",
            Self::Bytes => "an array of bytes",
            Self::Leaf(kind) => kind,
        }
    }

    /// The pick that takes nothing of this place but its presence.
    fn nothing(self) -> Pick {
        match self {
            Self::Struct(layout) => Pick::nothing_of(layout),
            Self::Array(Element::Struct(layout)) => Pick::nothing_of(layout),
            _ => Pick::All,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Decoder;
    use super::*;

    const BEACONS: &str = "string name\nFix[] fixes\nuint8[] raw\n\
        ===\nMSG: p/Fix\nint32 id\nPoint p\nfloat64[3] sigma\n===\nMSG: p/Point\nfloat64 x\nfloat64 y\nfloat64 z";

    fn select(paths: &[&str]) -> Result<String, String> {
        let paths: Vec<_> = paths.iter().map(|path| MessagePath::parse(path).unwrap()).collect();
        let decoder = Decoder::new("cdr", "ros2msg", "p/msg/Beacons", BEACONS.as_bytes()).unwrap();
        match decoder.select(&paths).map_err(|miss| miss.to_string())?.format {
            super::super::Format::Cdr { pick, .. } => Ok(written(&pick)),
            _ => unreachable!("a cdr decoder"),
        }
    }

    /// One character a field: `*` all, `-` nothing, else its own fields in brackets.
    fn written(pick: &Pick) -> String {
        match pick {
            Pick::All => "*".to_owned(),
            Pick::Fields(picks) => {
                let fields = picks.iter().map(|pick| pick.as_ref().map_or("-".to_owned(), written));
                format!("({})", fields.collect::<String>())
            }
        }
    }

    #[test]
    fn paths_together_pick_what_each_of_them_needs() {
        assert_eq!(select(&[]).unwrap(), "(---)");
        assert_eq!(select(&["/b"]).unwrap(), "*");
        assert_eq!(select(&["/b.fixes[0].p"]).unwrap(), "(-(-*-)-)");
        assert_eq!(select(&["/b.fixes[0].p.x", "/b.fixes[1].sigma[2]"]).unwrap(), "(-(-(*--)*)-)");
        assert_eq!(select(&["/b.fixes[0]", "/b.fixes[0].p.x", "/b.fixes[0].id"]).unwrap(), "(-*-)");
        assert_eq!(select(&["/b.fixes[0].p.x", "/b.fixes[0]"]).unwrap(), "(-*-)");
    }

    #[test]
    fn a_filter_needs_its_own_field_too() {
        assert_eq!(select(&["/b.fixes[:]{id==2}.p"]).unwrap(), "(-(**-)-)");
        assert_eq!(select(&["/b{name=='a'}.fixes[0].sigma"]).unwrap(), "(*(--*)-)");
    }

    #[test]
    fn a_path_that_no_message_can_follow_is_refused_before_the_first() {
        let miss = |path| select(&[path]).unwrap_err();
        assert_eq!(miss("/b.fixes[0].q"), "no field \"q\" in /b.fixes[0]; it has: id, p, sigma");
        assert_eq!(miss("/b.fixes[:]{idd==1}"), "no field \"idd\" in /b.fixes; it has: id, p, sigma");
        assert_eq!(miss("/b.fixes.p"), "/b.fixes is an array, expected an object for the step .p");
        assert_eq!(miss("/b.name[0]"), "/b.name is text, expected an array for the step [0]");
        assert_eq!(miss("/b.raw[0]"), "/b.raw is an array of bytes, expected an array for the step [0]");
    }
}
