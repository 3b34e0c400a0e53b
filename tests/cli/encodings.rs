//! The same samples in every encoding give the same track, to the last bit.

use prost_reflect::prost::Message as _;
use prost_reflect::prost_types::field_descriptor_proto::{Label, Type};
use prost_reflect::prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
};
use serde_json::{Value, json};

use super::trial::Trial;
use super::trial_log::{Cdr, Sensor, TrialLog, ns, stamp, xyz};

const VECTORS: &str =
    "Vector position\nVector velocity\n===\nMSG: nav/Vector\nfloat64 x\nfloat64 y\nfloat64 z";

const IDL: &str = "\
===============================================================================
IDL: nav/msg/Track
module nav { module msg {
  struct Track {
    std_msgs::msg::Header header; Vector position, velocity;
  };
}; };
===============================================================================
IDL: nav/msg/Vector
module nav { module msg { struct Vector { double x, y, z; }; }; };
===============================================================================
IDL: std_msgs/msg/Header
module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };
module std_msgs { module msg {
  struct Header { builtin_interfaces::msg::Time stamp; @verbatim (language=\"comment\", text=\"f\") string frame_id; };
}; };
";

/// One sample in each of the encodings.
type Encode = fn(u64, [f64; 3], [f64; 3]) -> Vec<u8>;

fn json(time_ns: u64, p: [f64; 3], v: [f64; 3]) -> Vec<u8> {
    let message =
        json!({"timestamp": stamp(time_ns), "frame_id": "enu", "position": xyz(p), "velocity": xyz(v)});
    message.to_string().into_bytes()
}

fn cdr(time_ns: u64, p: [f64; 3], v: [f64; 3]) -> Vec<u8> {
    Cdr::new().header(time_ns, "enu").f64s(&p).f64s(&v).done()
}

fn ros_1(time_ns: u64, p: [f64; 3], v: [f64; 3]) -> Vec<u8> {
    let header = [0, (time_ns / 1_000_000_000) as u32, (time_ns % 1_000_000_000) as u32, 3];
    let mut bytes: Vec<u8> = header.iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(b"enu");
    bytes.extend(p.iter().chain(&v).flat_map(|v| v.to_le_bytes()));
    bytes
}

/// As the wire format's specification has it: a tag before each field, lengths before messages.
fn protobuf(time_ns: u64, p: [f64; 3], v: [f64; 3]) -> Vec<u8> {
    let varint = |mut value: u64| {
        let mut bytes = Vec::new();
        while value > 0x7f {
            bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        bytes.push(value as u8);
        bytes
    };
    let with_length = |tag: u8, inside: Vec<u8>| [vec![tag], varint(inside.len() as u64), inside].concat();
    let vector = |v: [f64; 3]| {
        let axis = |(i, v): (usize, f64)| [vec![(i as u8 + 1) << 3 | 1], v.to_le_bytes().to_vec()].concat();
        v.into_iter().enumerate().flat_map(axis).collect::<Vec<u8>>()
    };
    let time = [vec![8], varint(time_ns / 1_000_000_000), vec![16], varint(time_ns % 1_000_000_000)].concat();
    [
        with_length(0x0a, time),
        with_length(0x12, b"enu".to_vec()),
        with_length(0x1a, vector(p)),
        with_length(0x22, vector(v)),
    ]
    .concat()
}

fn descriptors() -> Vec<u8> {
    let field = |number: i32, name: &str, kind: Type, of: &str| FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: (!of.is_empty()).then(|| of.to_owned()),
        ..FieldDescriptorProto::default()
    };
    let message =
        |name: &str, field| DescriptorProto { name: Some(name.into()), field, ..DescriptorProto::default() };
    let file = FileDescriptorProto {
        name: Some("track.proto".into()),
        package: Some("nav".into()),
        syntax: Some("proto3".into()),
        message_type: vec![
            message("Time", vec![field(1, "seconds", Type::Int64, ""), field(2, "nanos", Type::Int32, "")]),
            message(
                "Vector",
                (1..).zip(["x", "y", "z"]).map(|(i, n)| field(i, n, Type::Double, "")).collect(),
            ),
            message(
                "Track",
                vec![
                    field(1, "timestamp", Type::Message, ".nav.Time"),
                    field(2, "frame_id", Type::String, ""),
                    field(3, "position", Type::Message, ".nav.Vector"),
                    field(4, "velocity", Type::Message, ".nav.Vector"),
                ],
            ),
        ],
        ..FileDescriptorProto::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// All that `fuse` made of two sensors whose messages are encoded so.
fn track(encoding: &str, schema: (&str, &str, &[u8]), encode: Encode) -> Vec<Value> {
    let mut log = TrialLog::new();
    for (topic, sensor) in
        [("/tether/track", Sensor::new(0.0, 8.0, 1)), ("/beacon/track", Sensor::new(5.0, 13.0, 2))]
    {
        log.channel_of(topic, encoding, schema);
        for (t, p, v) in sensor.samples() {
            log.raw(topic, [ns(t); 2], &encode(ns(t), p, v));
        }
    }
    let (_, output) = Trial::of(log.finish()).report(0);
    output.track().iter().map(|written| written.value.clone()).collect()
}

/// Name, encoding, text.
type Schema<'a> = (&'a str, &'a str, &'a [u8]);

#[test]
fn encodings_of_the_same_samples_give_the_same_track_to_the_last_bit() {
    let expected = track("json", ("", "", b""), json);
    assert!(expected.len() > 250);
    let msg = format!("std_msgs/Header header\n{VECTORS}");
    let protobuf_schema = descriptors();
    let others: [(&str, Schema<'_>, Encode); 4] = [
        ("cdr", ("nav/msg/Track", "ros2msg", msg.as_bytes()), cdr),
        ("cdr", ("nav/msg/Track", "ros2idl", IDL.as_bytes()), cdr),
        ("ros1", ("nav/Track", "ros1msg", msg.as_bytes()), ros_1),
        ("protobuf", ("nav.Track", "protobuf", &protobuf_schema), protobuf),
    ];
    for (encoding, schema, encode) in others {
        let found = track(encoding, schema, encode);
        let differs = expected.iter().zip(&found).position(|(a, b)| format!("{a}") != format!("{b}"));
        assert_eq!((found.len(), differs), (expected.len(), None), "{encoding} {}", schema.1);
    }
}
