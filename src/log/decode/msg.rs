//! The `ros1msg` and `ros2msg` schema encodings: `.msg` texts joined by lines of `=`, each headed by
//! `MSG: package/Type`.
//!
//! <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html> and <http://wiki.ros.org/msg> have the
//! syntax of one text, <https://mcap.dev/spec/registry#ros2msg> of the joined ones. Constants, defaults and bounds
//! don't change the bytes of a message: they are read over.
//!
//! The messages of `/_service_event` topics come with the `.srv` text of their service: what they hold is made of
//! it as `rosidl` does.

use super::DecodeError;
use super::definition::{RawDefinition, RawElement, RawField, RawStruct, Scalar, Shape};

/// Types that many texts name without spelling them out; one in the text itself goes before.
const WELL_KNOWN_OF_ROS_2: &str = "\
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: service_msgs/ServiceEventInfo
uint8 event_type
builtin_interfaces/Time stamp
char[16] client_gid
int64 sequence_number
";

/// The same of ROS 1, where times are no types but parts of the language.
const WELL_KNOWN_OF_ROS_1: &str = "\
================================================================================
MSG: ros/time
uint32 sec
uint32 nsec
================================================================================
MSG: ros/duration
int32 sec
int32 nsec
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
";

/// Which ROS a text is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    Ros1,
    Ros2,
}

/// The types of `text`; the first has no header and is the message itself, called `schema_name`.
///
/// # Errors
/// [`DecodeError::Definition`] names the line.
pub(super) fn parse(schema_name: &str, text: &str, dialect: Dialect) -> Result<RawDefinition, DecodeError> {
    let well_known = match dialect {
        Dialect::Ros1 => WELL_KNOWN_OF_ROS_1,
        Dialect::Ros2 => WELL_KNOWN_OF_ROS_2,
    };
    let mut definition = parse_text(schema_name, text, dialect)?;
    definition.others.extend(parse_text("", well_known, dialect)?.others);
    Ok(definition)
}

fn parse_text(schema_name: &str, text: &str, dialect: Dialect) -> Result<RawDefinition, DecodeError> {
    let mut root = RawStruct { name: package_and_type(schema_name), fields: Vec::new() };
    let mut service =
        schema_name.contains("/srv/").then(|| root.name.strip_suffix("_Event")).flatten().map(str::to_owned);
    let mut others: Vec<RawStruct> = Vec::new();
    let mut header_expected = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let error = |expected: &'static str| DecodeError::Definition {
            line: index + 1,
            found: line.chars().take(80).collect(),
            expected,
        };
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if line.starts_with("==") && line.bytes().all(|byte| byte == b'=') {
            header_expected = true;
        } else if header_expected {
            let name = line.strip_prefix("MSG:").ok_or_else(|| error("a header \"MSG: package/Type\""))?;
            others.push(RawStruct { name: package_and_type(name.trim()), fields: Vec::new() });
            header_expected = false;
        } else if line == "---" {
            // what stood before it is the request, what follows the response
            let name =
                service.take().ok_or_else(|| error("a message; services and actions can't be decoded"))?;
            let event = event_of(&root.name, &name);
            let request = std::mem::replace(&mut root, event);
            others.insert(0, RawStruct { name: format!("{name}_Request"), ..request });
            others.push(RawStruct { name: format!("{name}_Response"), fields: Vec::new() });
        } else if let Some(field) = parse_line(line, dialect).map_err(error)? {
            others.last_mut().unwrap_or(&mut root).fields.push(field);
        }
    }
    Ok(RawDefinition { root, others })
}

/// The message of a service's events: who and when, and what was asked or answered where it is recorded.
fn event_of(name: &str, service: &str) -> RawStruct {
    let field = |name: &str, of: String, shape| RawField {
        name: name.to_owned(),
        element: RawElement::Named(of),
        shape,
    };
    let fields = vec![
        field("info", "service_msgs/ServiceEventInfo".to_owned(), Shape::One),
        field("request", format!("{service}_Request"), Shape::Sequence),
        field("response", format!("{service}_Response"), Shape::Sequence),
    ];
    RawStruct { name: name.to_owned(), fields }
}

/// `package/msg/Type` and `package/Type` are the same type.
fn package_and_type(name: &str) -> String {
    let mut parts = name.split('/');
    match (parts.next(), parts.next_back()) {
        (Some(package), Some(short)) => format!("{package}/{short}"),
        _ => name.to_owned(),
    }
}

/// `TYPE NAME`, `TYPE NAME DEFAULT`, or `None` for a constant: `TYPE NAME=VALUE`.
fn parse_line(line: &str, dialect: Dialect) -> Result<Option<RawField>, &'static str> {
    let (type_text, rest) = line.split_once(char::is_whitespace).ok_or("a type and a field name")?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, behind) = rest.split_at_checked(end).unwrap_or((rest, ""));
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err("a field name that starts with a letter");
    }
    let (element, shape) = parse_type(type_text, dialect)?;
    if behind.trim_start().starts_with('=') {
        return Ok(None);
    }
    if !behind.is_empty() && !behind.starts_with(|c: char| c.is_whitespace() || c == '#') {
        return Err("a field name of letters, digits and _");
    }
    Ok(Some(RawField { name: name.to_owned(), element, shape }))
}

/// `string<=10[<=5]`: an element, then perhaps an array.
fn parse_type(text: &str, dialect: Dialect) -> Result<(RawElement, Shape), &'static str> {
    const BAD_SIZE: &str = "an array size such as [], [3] or [<=3], not zero";
    let (element, shape) = match text.split_once('[') {
        None => (text, Shape::One),
        Some((element, size)) => {
            let size = size.strip_suffix(']').ok_or(BAD_SIZE)?.trim();
            let number = size.strip_prefix("<=").unwrap_or(size).trim();
            let shape = match (size, number.parse::<usize>()) {
                ("", _) => Shape::Sequence,
                (_, Err(_) | Ok(0)) => return Err(BAD_SIZE),
                (_, Ok(count)) if number == size => Shape::Fixed(count),
                _ => Shape::Sequence,
            };
            (element, shape)
        }
    };
    let (name, bound) = element.split_once("<=").unwrap_or((element, ""));
    if !bound.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err("a bound such as string<=10");
    }
    Ok((parse_element(name, dialect)?, shape))
}

fn parse_element(name: &str, dialect: Dialect) -> Result<RawElement, &'static str> {
    let is_ros_1 = dialect == Dialect::Ros1;
    let scalar = match name {
        "bool" => Scalar::Bool,
        "byte" if is_ros_1 => Scalar::Int { size: 1 },
        "byte" | "char" | "uint8" => Scalar::Uint { size: 1 },
        "int8" => Scalar::Int { size: 1 },
        "int16" => Scalar::Int { size: 2 },
        "uint16" => Scalar::Uint { size: 2 },
        "int32" => Scalar::Int { size: 4 },
        "uint32" => Scalar::Uint { size: 4 },
        "int64" => Scalar::Int { size: 8 },
        "uint64" => Scalar::Uint { size: 8 },
        "float32" => Scalar::Float { size: 4 },
        "float64" => Scalar::Float { size: 8 },
        "string" => return Ok(RawElement::Text),
        "wstring" => return Ok(RawElement::WideText),
        "time" | "duration" if is_ros_1 => return Ok(RawElement::Named(format!("ros/{name}"))),
        "time" => return Ok(RawElement::Named("builtin_interfaces/Time".to_owned())),
        "duration" => return Ok(RawElement::Named("builtin_interfaces/Duration".to_owned())),
        _ => {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
            let named = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(plain);
            return if named {
                Ok(RawElement::Named(package_and_type(name)))
            } else {
                Err("a type name such as float64 or package/Type")
            };
        }
    };
    Ok(RawElement::Scalar(scalar))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::definition::{Element, Struct, resolve};
    use super::*;

    fn root(text: &str) -> Result<std::sync::Arc<Struct>, DecodeError> {
        resolve(&parse("pkg/msg/Root", text, Dialect::Ros2)?, 1)
    }

    fn error(text: &str) -> String {
        root(text).unwrap_err().to_string()
    }

    #[test]
    fn constants_comments_and_defaults_leave_no_fields() {
        let text = "# comment\r\nint32 A=1\r\nstring B = \"# x\"\r\nint32 a 5 # why\r\nstring b \"= # x\"\r\nbool c# d";
        let root = root(text).unwrap();
        assert_eq!(root.fields.iter().map(|f| &*f.name).collect::<Vec<_>>(), ["a", "b", "c"]);
    }

    #[test]
    fn bounds_and_sizes_give_the_shape() {
        let root = root("string<=10 a\nint32[] b\nfloat64[36] c\nint32[<=5] d\nstring<=3[2] e").unwrap();
        let shapes: Vec<_> = root.fields.iter().map(|f| f.shape).collect();
        assert_eq!(shapes, [Shape::One, Shape::Sequence, Shape::Fixed(36), Shape::Sequence, Shape::Fixed(2)]);
        assert_eq!(root.least_size, 4 + 4 + 288 + 4 + 8);
    }

    #[test]
    fn a_bare_type_name_means_the_package_it_stands_in() {
        let text =
            "other/B b\n===\nMSG: other/msg/B\nC c\n===\nMSG: third/C\nbool x\n===\nMSG: other/C\nint8 y";
        let Element::Struct(b) = &root(text).unwrap().fields[0].element else { panic!("b is a struct") };
        let Element::Struct(c) = &b.fields[0].element else { panic!("c is a struct") };
        assert_eq!(&*c.fields[0].name, "y");
    }

    #[test]
    fn times_and_headers_need_no_definition() {
        let root =
            root("std_msgs/Header header\nbuiltin_interfaces/Time a\ntime b\nduration c\nHeader d").unwrap();
        assert_eq!(root.least_size, 12 + 8 + 8 + 8 + 12);
    }

    #[test]
    fn what_can_not_be_linked_is_an_error_that_names_it() {
        assert_eq!(
            error("geometry_msgs/Pose pose"),
            "type geometry_msgs/Pose, of pkg/Root.pose, is not defined in the schema"
        );
        assert_eq!(error("A a\n===\nMSG: pkg/A\nRoot[] r"), "type pkg/Root contains itself");
        let deep =
            (0..40).fold("T0 x".to_owned(), |text, i| format!("{text}\n==\nMSG: p/T{i}\nT{} x", i + 1));
        assert_eq!(error(&deep), "type p/T31 is nested more than 32 types deep");
    }

    #[test]
    fn a_line_that_is_no_field_is_an_error_with_its_number() {
        assert_eq!(error("int32 a\nint32"), "definition line 2: \"int32\", expected a type and a field name");
        assert!(error("int32[0] a").contains("not zero"));
        assert!(error("int32[x] a").contains("array size"));
        assert!(error("int32 0a").contains("starts with a letter"));
        assert!(error("int32 a-b").contains("letters, digits"));
        assert!(error("===\nint32 a").contains("MSG: package/Type"));
        assert!(error("int64 a\n---\nint64 b").contains("services"));
    }

    #[test]
    fn the_event_of_a_service_holds_who_and_when_the_request_and_the_response() {
        let text = "int64 a\nP p\n---\nint64 sum\n===\nMSG: pkg/P\nbool x";
        let event = resolve(&parse("pkg/srv/Add_Event", text, Dialect::Ros2).unwrap(), 1).unwrap();
        assert_eq!(
            event.fields.iter().map(|f| &*f.name).collect::<Vec<_>>(),
            ["info", "request", "response"]
        );
        assert_eq!(event.least_size, 1 + 8 + 16 + 8 + 4 + 4);
        let element = |i: usize| match &event.fields[i].element {
            Element::Struct(inner) => inner.fields.iter().map(|f| f.name.to_string()).collect::<Vec<_>>(),
            _ => Vec::new(),
        };
        assert_eq!((element(1), element(2)), (vec!["a".into(), "p".into()], vec!["sum".to_owned()]));
        let twice = parse("pkg/srv/Add_Event", "---\n---", Dialect::Ros2).unwrap_err().to_string();
        assert!(twice.contains("services"), "{twice}");
    }

    proptest! {
        #[test]
        fn arbitrary_text_never_panics(text: String) {
            let _ = root(&text);
        }

        #[test]
        fn text_like_a_definition_never_panics(
            text in "((int32|string<=|A|p/A|time)(\\[(<=)?[0-9]{0,30}\\])? [a-z=# ]{0,5}\n|={1,4}\n|MSG: (p/)?A\n){0,20}",
        ) {
            let _ = root(&text);
        }
    }
}
