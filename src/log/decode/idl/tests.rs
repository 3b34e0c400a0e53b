use proptest::prelude::*;

use super::super::{Decoder, Value};
use super::*;

const FIX: &str = "\
================================================================================
IDL: nav/msg/Fix
// generated from rosidl_adapter/resource/msg.idl.em
#include \"geometry_msgs/msg/Point.idl\"

module nav {
  module msg {
    module Fix_Constants {
      @verbatim (language=\"comment\", text=\"a } brace\" \"of text\")
      const uint8 AXES = 3;
    };
    typedef double double__3[3];
    typedef geometry_msgs::msg::Point Place;
    enum Kind { RAW, @value(7) FILTERED };
    @verbatim (language=\"comment\", text=\"fix\")
    struct Fix {
      @default (value=1)
      uint8 id, quality;
      Place place;
      double__3 sigma;
      sequence<geometry_msgs::msg::Point, 5> trail;
      string<10> name;
      Kind kind;
      unsigned long long count;
      float axes[Fix_Constants::AXES];
    };
  };
};
================================================================================
IDL: geometry_msgs/msg/Point
module geometry_msgs { module msg { struct Point { double x; double y; double z; }; }; };
";

fn fields(schema_name: &str, text: &str) -> Result<String, DecodeError> {
    let field = |f: &RawField| format!("{} {:?} {:?}", f.name, f.element, f.shape);
    Ok(parse(schema_name, text)?.root.fields.iter().map(field).collect::<Vec<_>>().join("\n"))
}

#[test]
fn typedefs_enums_constants_and_bounds_give_the_layout_of_the_same_msg() {
    let point = "===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z";
    let msg = format!(
        "uint8 id\nuint8 quality\ngeometry_msgs/Point place\nfloat64[3] sigma\ngeometry_msgs/Point[] trail\n\
         string name\nuint32 kind\nuint64 count\nfloat32[3] axes\n{point}"
    );
    let decoders = [
        Decoder::new("cdr", "ros2idl", "nav/msg/Fix", FIX.as_bytes()).unwrap(),
        Decoder::new("cdr", "omgidl", "nav::msg::Fix", FIX.as_bytes()).unwrap(),
        Decoder::new("cdr", "ros2idl", "nav/Fix", FIX.as_bytes()).unwrap(),
        Decoder::new("cdr", "ros2msg", "nav/msg/Fix", msg.as_bytes()).unwrap(),
    ];
    let payload: Vec<u8> = [vec![0, 1, 0, 0], (0..=255).collect()].concat();
    let mut payload = payload;
    // two points in the trail, a name of three bytes
    (payload[60], payload[61], payload[62], payload[63]) = (2, 0, 0, 0);
    let at = 4 + 56 + 8 + 48;
    payload[at..at + 4].copy_from_slice(&[3, 0, 0, 0]);
    let values = decoders.map(|decoder| decoder.decode(&payload).unwrap());
    assert!(values.iter().all(|value| format!("{value:?}") == format!("{:?}", values[3])), "{values:?}");
    assert_eq!(values[0].field("quality"), Some(&Value::Uint(1)));
    assert!(matches!(values[0].field("trail"), Some(Value::Array(items)) if items.len() == 2));
}

#[test]
fn what_is_not_read_is_refused_with_its_line() {
    let error = |text: &str| fields("T", text).unwrap_err().to_string();
    assert_eq!(
        error("struct T {\n union U x;\n};"),
        "definition line 2: \"union\", expected a number, a text, a sequence or the name of a struct"
    );
    assert!(error("struct T : B { long x; };").contains("expected {"));
    assert!(error("struct T { @optional long x; };").contains("no optional member"));
    assert!(error("struct T { sequence<sequence<long>> x; };").contains("no sequence of sequences"));
    assert!(error("struct T { long x[0]; };").contains("not zero"));
    assert!(error("struct T { long double x; };").contains("expected ;"));
    assert_eq!(error("struct U { long x; };"), "type T is not defined in the schema");
}

#[test]
fn a_struct_without_members_is_one_byte() {
    let text = "struct E { octet structure_needs_at_least_one_member; }; struct T { E e; octet a; };";
    let decoder = Decoder::new("cdr", "omgidl", "T", text.as_bytes()).unwrap();
    let value = decoder.decode(&[0, 1, 0, 0, 9, 5]).unwrap();
    assert_eq!(value.field("a"), Some(&Value::Uint(5)));
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(text: String) {
        let _ = fields("T", &text);
    }

    #[test]
    fn text_like_a_definition_never_panics(
        text in "(module|struct|T|\\{|\\}|;|double|sequence<|>|typedef|::|@a|\\(|\\)|[0-9]{1,30}|\\[|\\]|,| |\n){0,60}",
    ) {
        let _ = fields("T", &text);
    }
}
