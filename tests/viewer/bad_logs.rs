//! The rules can fail: logs that break one each, and what is said of them.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use serde_json::{Value, json};

use crate::viewer_rules::violations;

/// A second, the time of the first message.
const SECOND_NS: u64 = 1_000_000_000;

/// A channel of JSON messages a second apart.
struct Channel {
    topic: &'static str,
    schema: &'static str,
    text: String,
    messages: Vec<String>,
}

fn log_with(options: WriteOptions, times: impl Fn(usize) -> u64, channels: &[Channel]) -> Vec<u8> {
    let mut writer: Writer<_> = options.create(Cursor::new(Vec::new())).unwrap();
    for channel in channels {
        let schema = writer.add_schema(channel.schema, "jsonschema", channel.text.as_bytes()).unwrap();
        let id = writer.add_channel(schema, channel.topic, "json", &BTreeMap::new()).unwrap();
        for (i, message) in channel.messages.iter().enumerate() {
            let (log_time, publish_time) = (times(i), times(i));
            let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time };
            writer.write_to_known_channel(&header, message.as_bytes()).unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn seconds(i: usize) -> u64 {
    (1 + i as u64) * SECOND_NS
}

fn judged(channels: &[Channel]) -> Vec<String> {
    violations(&log_with(WriteOptions::new(), seconds, channels), |_| true)
}

/// Fails unless something is found, and all of it is of that rule and says so.
#[track_caller]
fn assert_named(found: &[String], rule: u8, says: &str) {
    assert!(!found.is_empty(), "nothing is found, expected: {says}");
    for violation in found {
        assert!(violation.starts_with(&format!("rule {rule}: ")), "{found:?}");
    }
    assert!(found.iter().any(|violation| violation.contains(says)), "{says:?} is not in {found:?}");
}

fn depth(schema: &Value, messages: &[&str]) -> Channel {
    let messages = messages.iter().map(|&m| m.to_owned()).collect();
    Channel { topic: "/depth", schema: "trial.Depth", text: schema.to_string(), messages }
}

fn depth_schema() -> Value {
    json!({"title": "trial.Depth", "type": "object", "properties": {"z": {"type": "number"}}, "required": ["z"]})
}

const DEPTHS: [&str; 2] = ["{\"z\":-1.5}", "{\"z\":-1}"];

fn scene() -> Value {
    let pose = json!({
        "position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}
    });
    json!({"deletions": [], "entities": [{
        "timestamp": {"sec": 1, "nsec": 0}, "frame_id": "enu", "id": "track", "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": true, "metadata": [], "arrows": [], "cubes": [], "spheres": [], "cylinders": [],
        "triangles": [], "texts": [], "models": [],
        "lines": [{
            "type": 0, "pose": pose, "thickness": 2, "scale_invariant": true, "colors": [], "indices": [],
            "points": [{"x": 0, "y": 0, "z": 0}, {"x": 1, "y": 0, "z": 0}],
            "color": {"r": 1, "g": 1, "b": 1, "a": 1}
        }]
    }]})
}

fn scenes(scenes: &[Value]) -> Channel {
    let text = include_str!("../../schemas/foxglove.SceneUpdate.schema.json").to_owned();
    let messages = scenes.iter().map(Value::to_string).collect();
    Channel { topic: "/scene", schema: "foxglove.SceneUpdate", text, messages }
}

fn pose(frame: &str, orientation: [f64; 4]) -> Channel {
    let [x, y, z, w] = orientation;
    let message = json!({
        "timestamp": {"sec": 1, "nsec": 0}, "frame_id": frame,
        "pose": {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": x, "y": y, "z": z, "w": w}}
    });
    let text = include_str!("../../schemas/foxglove.PoseInFrame.schema.json").to_owned();
    let messages = vec![message.to_string(), message.to_string()];
    Channel { topic: "/pose", schema: "foxglove.PoseInFrame", text, messages }
}

const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

#[test]
fn a_good_log_breaks_no_rule() {
    let channels = [depth(&depth_schema(), &DEPTHS), scenes(&[scene()]), pose("enu", LEVEL)];
    assert_eq!(judged(&channels), [""; 0]);
    let bad = [depth(&depth_schema(), &["{\"z\":NaN}", DEPTHS[0]])];
    let log = log_with(WriteOptions::new(), seconds, &bad);
    assert_eq!(violations(&log, |topic| topic != "/depth"), [""; 0], "of what is not judged nothing is said");
}

#[test]
fn rule_1_a_schema_is_named_by_its_title() {
    let mut untitled = depth_schema();
    untitled.as_object_mut().unwrap().remove("title");
    assert_named(&judged(&[depth(&untitled, &DEPTHS)]), 1, "title null");
    untitled["title"] = "trial.Height".into();
    assert_named(&judged(&[depth(&untitled, &DEPTHS)]), 1, "\"trial.Height\"");
    let mut cut = depth(&untitled, &DEPTHS);
    cut.text.truncate(5);
    assert_named(&judged(&[cut]), 1, "not JSON");
}

#[test]
fn rule_2_a_schema_holds_to_what_viewers_read() {
    let matrix = json!({"type": "array", "items": {"type": "array", "items": {"type": "number"}}});
    for (field, says) in [
        (matrix, "nested arrays"),
        (json!({"type": ["number", "null"]}), "type [\"number\",\"null\"]"),
        (json!({"$ref": "#/$defs/depth"}), "$ref"),
        (json!({"anyOf": [{"type": "number"}]}), "type null"),
        (json!({"oneOf": [{"const": "deep"}]}), "oneOf of other than numbers"),
        (json!({"type": "array", "items": [{"type": "number"}]}), "without one schema"),
        (json!({"type": "string", "contentEncoding": "base32"}), "contentEncoding"),
        (json!({"type": "object", "properties": {"deep": {"type": "null"}}}), "$.z.deep: type \"null\""),
    ] {
        let mut schema = depth_schema();
        schema["properties"]["z"] = field;
        assert_named(&judged(&[depth(&schema, &DEPTHS)]), 2, says);
    }
    let list = json!({"title": "trial.Depth", "type": "array", "items": {"type": "number"}});
    assert_named(&judged(&[depth(&list, &["[1]", "[2]"])]), 2, "expected \"object\"");
}

#[test]
fn rule_3_a_message_is_json_that_fits_its_schema() {
    for (message, says) in [
        ("{\"z\":NaN}", "no JSON"),
        ("{\"z\":Infinity}", "no JSON"),
        ("{\"z\":null}", "null is no number"),
        ("{\"z\":\"deep\"}", "is no number"),
        ("{}", "$.z is missing"),
        ("{\"z\":1,\"speed\":2}", "$.speed is not in the schema"),
        ("[1]", "is no object"),
    ] {
        assert_named(&judged(&[depth(&depth_schema(), &[message, DEPTHS[0]])]), 3, says);
    }
    let mut named = scene();
    named["entities"][0]["lines"][0]["type"] = "LINE_STRIP".into();
    assert!(judged(&[scenes(&[named])]).iter().any(|v| v.contains("none of the enum's numbers")));
    for (orientation, says) in [([0.0; 4], "length 0"), ([0.0, 0.0, 1.0, 1.0], "length 1.414")] {
        assert_named(&judged(&[pose("enu", orientation)]), 3, says);
    }
}

#[test]
fn rule_4_a_log_has_chunks_indexes_and_statistics() {
    let options = WriteOptions::new;
    for (options, says) in [
        (options().use_chunks(false), "no chunk index"),
        (options().emit_chunk_indexes(false), "no chunk index"),
        (options().emit_message_indexes(false), "message index"),
        (options().emit_statistics(false), "no statistics"),
    ] {
        let log = log_with(options, seconds, &[depth(&depth_schema(), &DEPTHS)]);
        assert_named(&violations(&log, |_| true), 4, says);
    }
}

#[test]
fn rule_5_times_can_be_played() {
    let judged = |times: fn(usize) -> u64| {
        let log = log_with(WriteOptions::new(), times, &[depth(&depth_schema(), &DEPTHS)]);
        violations(&log, |_| true)
    };
    assert_named(&judged(|i| i as u64 * SECOND_NS), 5, "/depth: log_time 0");
    assert_named(&judged(|i| SECOND_NS + i as u64 * 400 * 86_400 * SECOND_NS), 5, "more than a year");
    assert_named(&judged(|_| SECOND_NS), 5, "all log times are equal");
}

#[test]
fn rule_7_whatever_is_drawn_has_a_frame_and_all_frames_connect() {
    assert_named(&judged(&[pose("", LEVEL)]), 7, "/pose: drawn in no frame");
    assert_named(&judged(&[pose("map", LEVEL), scenes(&[scene()])]), 7, "do not connect");
    let transform = json!({"parent_frame_id": "enu", "child_frame_id": "map"}).to_string();
    let frames = json!({
        "title": "foxglove.FrameTransform", "type": "object",
        "properties": {"parent_frame_id": {"type": "string"}, "child_frame_id": {"type": "string"}}
    });
    let (topic, schema) = ("/tf", "foxglove.FrameTransform");
    let tf = Channel { topic, schema, text: frames.to_string(), messages: vec![transform] };
    assert_eq!(judged(&[tf, pose("map", LEVEL), scenes(&[scene()])]), [""; 0]);
}

#[test]
fn rule_8_a_scene_is_one_message_that_stays_of_visible_lines() {
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 9] = [
        (|e| e["lines"][0]["color"]["a"] = 0.into(), "lines has alpha 0"),
        (|e| e["lines"][0]["type"] = 2.into(), "no LINE_STRIP"),
        (|e| e["lines"][0]["scale_invariant"] = false.into(), "not scale_invariant"),
        (|e| drop(e["lines"][0]["points"].as_array_mut().unwrap().pop()), "fewer than two points"),
        (|e| e["frame_locked"] = false.into(), "not frame_locked"),
        (|e| e["lifetime"]["sec"] = 1.into(), "a lifetime that ends"),
        (|e| e["id"] = "".into(), "no id of its own"),
        (|e| drop(e.as_object_mut().unwrap().remove("cubes")), "no list of cubes"),
        (
            |e| e["lines"][0]["points"] = vec![json!({"x": 0, "y": 0, "z": 0}); 20_001].into(),
            "20001 vertices",
        ),
    ];
    for (change, says) in changes {
        let mut bad = scene();
        change(&mut bad["entities"][0]);
        let mut found = judged(&[scenes(&[bad]), depth(&depth_schema(), &DEPTHS)]);
        // a missing list is missed by the schema too
        found.retain(|v| !v.contains("cubes is missing"));
        assert_named(&found, 8, says);
    }
    let mut twins = scene();
    let entities = twins["entities"].as_array_mut().unwrap();
    entities.push(entities[0].clone());
    assert_named(&judged(&[scenes(&[twins]), depth(&depth_schema(), &DEPTHS)]), 8, "no id of its own");
    assert_named(&judged(&[scenes(&[scene(), scene()])]), 8, "2 scenes, expected one");
}
