//! Message paths: a topic, and the way from its messages to one value.
//!
//! The syntax is that of the viewers: `/odom.pose.pose.position`, `/beacons.fixes[0].p`, `/beacons.fixes[-1]`,
//! `/fix{status==2}.position`, `/beacons.fixes[:]{id==2}{ok==true}.p` (the first element that matches), and
//! quotes around what is not a plain name: `"/a.b"."my field"`.
//! Differs from the viewers: a path leads to one value, so that `[:]` must have a filter behind it.

use std::cmp::Ordering;

use super::Value;
use super::path_text::{self, PathError};

/// A topic, and the steps from a message of it to one value.
#[derive(Clone, Debug, PartialEq)]
pub struct MessagePath {
    /// The topic, without quotes.
    pub topic: String,
    /// The steps in their order; none means the message itself.
    pub steps: Vec<Step>,
}

/// One step into a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// `.name`
    Field(String),
    /// `[2]`, or from the end: `[-1]`
    Index(i64),
    /// `{id==2}`: the value itself where it matches, else nothing.
    Filter(Filter),
    /// `[:]{id==2}`: the first element that passes all filters, else nothing.
    First(Vec<Filter>),
}

/// A condition on a field of an object, such as `status.fix>=2`.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// The way to the field, at least one name.
    pub fields: Vec<String>,
    /// How the field is compared.
    pub comparison: Comparison,
    /// What it is compared with.
    pub literal: Literal,
}

/// How a filter compares. Values of different kinds are unequal and have no order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// `==`
    Equal,
    /// `!=`
    Unequal,
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
}

/// The right side of a filter.
#[derive(Clone, Debug, PartialEq)]
pub enum Literal {
    /// `true` or `false`
    Bool(bool),
    /// A whole number; wide enough for every 64-bit id.
    Int(i128),
    /// A number with a point or an exponent, finite.
    Float(f64),
    /// Text in quotes.
    Text(String),
}

/// A path that leads nowhere: the first step that failed, and what there is instead.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathMiss {
    /// An object has no field of that name.
    #[error("no field {field:?} in {parent}; it has: {}", listed(available))]
    Field {
        /// The name that was asked for.
        field: String,
        /// The path to the object.
        parent: String,
        /// The names that the object has.
        available: Vec<String>,
    },
    /// An array has no such element.
    #[error("no element [{index}] in {parent}; it has {len}")]
    Index {
        /// The index that was asked for; below zero from the end.
        index: i64,
        /// The path to the array.
        parent: String,
        /// How many elements the array has.
        len: usize,
    },
    /// A step into a value of the wrong kind.
    #[error("{parent} is {found}, expected {expected} for the step {step}")]
    Kind {
        /// The path to the value.
        parent: String,
        /// What the value is.
        found: &'static str,
        /// What the step needs.
        expected: &'static str,
        /// The step, as written.
        step: String,
    },
}

impl MessagePath {
    /// Reads a path.
    ///
    /// # Errors
    /// [`PathError`] says where in the text what was expected.
    pub fn parse(text: &str) -> Result<Self, PathError> {
        path_text::parse(text)
    }

    /// Follows the path into a message of its topic; `None` where a filter lets nothing through.
    ///
    /// # Errors
    /// [`PathMiss`] where the path leads nowhere.
    pub fn resolve<'v>(&self, message: &'v Value) -> Result<Option<&'v Value>, PathMiss> {
        let mut value = message;
        for (depth, step) in self.steps.iter().enumerate() {
            let next = match step {
                Step::Field(name) => Some(self.field(value, name, depth)?),
                Step::Index(index) => Some(self.element(value, *index, depth)?),
                Step::Filter(filter) => self.passes(value, filter, depth)?.then_some(value),
                Step::First(filters) => self.first(value, filters, depth)?,
            };
            match next {
                Some(next) => value = next,
                None => return Ok(None),
            }
        }
        Ok(Some(value))
    }

    fn field<'v>(&self, value: &'v Value, name: &str, depth: usize) -> Result<&'v Value, PathMiss> {
        let Value::Object(fields) = value else {
            return Err(self.wrong_kind(value.kind(), "an object", depth));
        };
        value.field(name).ok_or_else(|| {
            self.no_field(name, depth, fields.iter().map(|(name, _)| name.to_string()).collect())
        })
    }

    fn element<'v>(&self, value: &'v Value, index: i64, depth: usize) -> Result<&'v Value, PathMiss> {
        let items = self.items(value, depth)?;
        let position = if index < 0 { items.len() as i64 + index } else { index };
        usize::try_from(position)
            .ok()
            .and_then(|position| items.get(position))
            .ok_or_else(|| PathMiss::Index { index, parent: self.up_to(depth), len: items.len() })
    }

    /// A field that no element has is a miss; one that only some have is not.
    fn first<'v>(
        &self,
        value: &'v Value,
        filters: &[Filter],
        depth: usize,
    ) -> Result<Option<&'v Value>, PathMiss> {
        let mut miss = None;
        let mut any_complete = false;
        for item in self.items(value, depth)? {
            match self.passes_all(item, filters, depth) {
                Ok(true) => return Ok(Some(item)),
                Ok(false) => any_complete = true,
                Err(first) => _ = miss.get_or_insert(first),
            }
        }
        match miss {
            Some(miss) if !any_complete => Err(miss),
            _ => Ok(None),
        }
    }

    fn passes_all(&self, value: &Value, filters: &[Filter], depth: usize) -> Result<bool, PathMiss> {
        for filter in filters {
            if !self.passes(value, filter, depth)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn items<'v>(&self, value: &'v Value, depth: usize) -> Result<&'v [Value], PathMiss> {
        match value {
            Value::Array(items) => Ok(items),
            _ => Err(self.wrong_kind(value.kind(), "an array", depth)),
        }
    }

    fn passes(&self, value: &Value, filter: &Filter, depth: usize) -> Result<bool, PathMiss> {
        let mut value = value;
        for name in &filter.fields {
            value = self.field(value, name, depth)?;
        }
        Ok(filter.comparison.holds(filter.literal.compare(value)))
    }

    #[cold]
    pub(super) fn no_field(&self, name: &str, depth: usize, available: Vec<String>) -> PathMiss {
        PathMiss::Field { field: name.to_owned(), parent: self.up_to(depth), available }
    }

    #[cold]
    pub(super) fn wrong_kind(&self, found: &'static str, expected: &'static str, depth: usize) -> PathMiss {
        let step = self.steps.get(depth).map(ToString::to_string).unwrap_or_default();
        PathMiss::Kind { parent: self.up_to(depth), found, expected, step }
    }

    /// The path up to the step at `depth`, without it.
    fn up_to(&self, depth: usize) -> String {
        let steps = self.steps.iter().take(depth).cloned().collect();
        Self { topic: self.topic.clone(), steps }.to_string()
    }
}

impl Comparison {
    /// `order` is that of the field against the literal, `None` for what can't be compared.
    fn holds(self, order: Option<Ordering>) -> bool {
        match self {
            Self::Equal => order.is_some_and(Ordering::is_eq),
            Self::Unequal => !order.is_some_and(Ordering::is_eq),
            Self::Less => order.is_some_and(Ordering::is_lt),
            Self::LessOrEqual => order.is_some_and(Ordering::is_le),
            Self::Greater => order.is_some_and(Ordering::is_gt),
            Self::GreaterOrEqual => order.is_some_and(Ordering::is_ge),
        }
    }
}

impl Literal {
    /// The order of `value` against this literal; whole numbers are compared exactly.
    fn compare(&self, value: &Value) -> Option<Ordering> {
        match (value, self) {
            (Value::Bool(value), Self::Bool(literal)) => Some(value.cmp(literal)),
            (Value::Text(value), Self::Text(literal)) => Some(value.cmp(literal)),
            (Value::Int(value), Self::Int(literal)) => Some(i128::from(*value).cmp(literal)),
            (Value::Uint(value), Self::Int(literal)) => Some(i128::from(*value).cmp(literal)),
            (_, Self::Int(literal)) => value.as_f64()?.partial_cmp(&(*literal as f64)),
            (_, Self::Float(literal)) => value.as_f64()?.partial_cmp(literal),
            _ => None,
        }
    }
}

/// At most twenty names: a hostile message may have a million.
fn listed(names: &[String]) -> String {
    const MOST: usize = 20;
    if names.is_empty() {
        return "no fields".to_owned();
    }
    let text = names.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().checked_sub(MOST) {
        None | Some(0) => text,
        Some(more) => format!("{text} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message() -> Value {
        let json = r#"{"stamp": 1, "ok": true, "name": "a", "fixes": [
            {"id": 1, "p": [1, 2, 3]}, {"id": 2, "p": [4, 5, 6]}, {"p": [7, 8, 9]}]}"#;
        serde_json::from_str(json).unwrap()
    }

    fn resolve(path: &str) -> Result<Option<Value>, String> {
        let path = MessagePath::parse(path).unwrap();
        path.resolve(&message()).map(Option::<&Value>::cloned).map_err(|miss| miss.to_string())
    }

    fn vector(path: &str) -> Option<[f64; 3]> {
        resolve(path).unwrap()?.as_vector3()
    }

    #[test]
    fn fields_and_indices_lead_to_a_value_from_either_end() {
        assert_eq!(resolve("/t").unwrap(), Some(message()));
        assert_eq!(vector("/t.fixes[0].p"), Some([1.0, 2.0, 3.0]));
        assert_eq!(vector("/t.fixes[-1].p"), Some([7.0, 8.0, 9.0]));
        assert_eq!(resolve("/t.fixes[1].p[2]"), Ok(Some(Value::Uint(6))));
    }

    #[test]
    fn a_filter_on_an_array_takes_the_first_element_that_passes() {
        assert_eq!(vector("/t.fixes[:]{id==2}.p"), Some([4.0, 5.0, 6.0]));
        assert_eq!(vector("/t.fixes[:]{id>0}{id!=1}.p"), Some([4.0, 5.0, 6.0]));
        assert_eq!(vector("/t.fixes[:]{id==3}.p"), None);
    }

    #[test]
    fn a_filter_on_a_message_lets_it_through_or_gives_nothing() {
        assert_eq!(resolve("/t{ok==true}.stamp"), Ok(Some(Value::Uint(1))));
        assert_eq!(resolve("/t{name==\"a\"}{stamp<=1.5}.stamp"), Ok(Some(Value::Uint(1))));
        assert_eq!(resolve("/t{name!='a'}.stamp"), Ok(None));
        assert_eq!(resolve("/t{name>1}.stamp"), Ok(None));
    }

    #[test]
    fn a_path_that_leads_nowhere_names_the_step_and_what_there_is() {
        let miss = |path| resolve(path).unwrap_err();
        assert_eq!(miss("/t.fix.p"), "no field \"fix\" in /t; it has: stamp, ok, name, fixes");
        assert_eq!(miss("/t.fixes[1].q.x"), "no field \"q\" in /t.fixes[1]; it has: id, p");
        assert_eq!(miss("/t.fixes[3]"), "no element [3] in /t.fixes; it has 3");
        assert_eq!(miss("/t.fixes[-4]"), "no element [-4] in /t.fixes; it has 3");
        assert_eq!(miss("/t.fixes.p"), "/t.fixes is an array, expected an object for the step .p");
        assert_eq!(miss("/t.name[0]"), "/t.name is text, expected an array for the step [0]");
        assert_eq!(miss("/t{idd==1}"), "no field \"idd\" in /t; it has: stamp, ok, name, fixes");
        assert_eq!(miss("/t.fixes[:]{idd==1}"), "no field \"idd\" in /t.fixes; it has: id, p");
    }

    #[test]
    fn whole_numbers_are_compared_exactly_and_nan_equals_nothing() {
        let id = Value::Uint(u64::MAX);
        let passes = |value: &Value, filter: &str| {
            let object = Value::Object(vec![("id".into(), value.clone())]);
            let path = MessagePath::parse(&format!("t{{{filter}}}")).unwrap();
            path.resolve(&object).unwrap().is_some()
        };
        assert!(passes(&id, "id==18446744073709551615"));
        assert!(!passes(&id, "id==18446744073709551614"));
        assert!(!passes(&Value::Float(f64::NAN), "id==0"));
        assert!(passes(&Value::Float(f64::NAN), "id!=0"));
    }

    #[test]
    fn a_miss_among_very_many_fields_stays_readable() {
        let names = (0..1000).map(|i| format!("f{i}")).collect();
        let miss = PathMiss::Field { field: "x".into(), parent: "/t".into(), available: names };
        assert!(miss.to_string().ends_with("f18, f19 and 980 more"));
    }
}
