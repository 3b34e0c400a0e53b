//! What Foxglove-style viewers need of a log, held against one: a channel that breaks a rule is not shown, and
//! nothing says so. The rules are numbered as in [`violations`].

// Each test crate that has this module uses a part of it.
#![allow(dead_code)]

mod schema;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde_json::Value;
use trackfuse::log::decode::Decoder;

/// A log that spans more than this has a message with a time of another epoch.
const LONGEST_NS: u64 = 365 * 86_400 * 1_000_000_000;

/// Most vertices of a scene.
const MOST_VERTICES: usize = 20_000;

/// All lists of a scene's entity.
const PRIMITIVES: [&str; 8] =
    ["arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"];

/// Fails unless what was added to the log at `path` keeps the rules.
#[track_caller]
pub(crate) fn assert_shown(path: &Path) {
    let log = fs::read(path).expect("a log");
    let prefixes = added_prefixes(&log);
    // a run that judges fixes may stand beside the sensor's own topics
    let is_sensor = |topic: &str| ["/usbl/fix", "/usbl/raw"].contains(&topic);
    let is_new = |topic: &str| !is_sensor(topic) && prefixes.iter().any(|p| topic.starts_with(p));
    let found = violations(&log, is_new);
    assert!(found.is_empty(), "{}:\n{}", path.display(), found.join("\n"));
}

/// What the topics of earlier runs begin with, which their metadata records name.
fn added_prefixes(log: &[u8]) -> Vec<String> {
    let summary = mcap::Summary::read(log).expect("an MCAP").expect("a summary");
    let records = summary.metadata_indexes.iter().filter_map(|index| index.name.strip_prefix("trackfuse:"));
    records.map(|prefix| format!("{prefix}/")).collect()
}

/// Everything about the topics that `is_judged` names which a viewer would not show, a sentence each:
///
/// 1. JSON messages with JSON Schemas whose name is their title; other messages with what decodes them.
/// 2. Schemas hold to the subset that viewers read.
/// 3. Messages are JSON that fits its schema; quaternions are of unit length.
/// 4. Chunks, their indexes, statistics, and a summary that has every schema and channel.
/// 5. Times that can be played.
/// 7. Whatever is drawn has a frame, and all frames connect.
/// 8. A scene is one message that stays, of visible lines, not too large.
pub(crate) fn violations(log: &[u8], is_judged: impl Fn(&str) -> bool) -> Vec<String> {
    let mut found = Violations::default();
    let summary = match mcap::Summary::read(log) {
        Ok(Some(summary)) => summary,
        Ok(None) => return vec!["rule 4: no summary".into()],
        Err(error) => return vec![format!("rule 4: the summary can't be read: {error}")],
    };
    check_index(log, &summary, &mut found);
    let mut schemas: BTreeMap<u16, Value> = BTreeMap::new();
    for channel in summary.channels.values().filter(|c| is_judged(&c.topic)) {
        if let Some(schema) = check_channel(channel, &mut found) {
            schemas.insert(channel.id, schema);
        }
    }
    let decoders = decoders(&summary, &is_judged, &mut found);
    let mut times: BTreeSet<u64> = BTreeSet::new();
    let (mut frames, mut scenes) = (Frames::default(), BTreeMap::<String, usize>::new());
    let (mut count, mut judged) = (0, 0);
    for message in mcap::MessageStream::new(log).expect("an MCAP") {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                found.add(4, format!("a message can't be read: {error}"));
                break;
            }
        };
        count += 1;
        let (topic, name) = (&message.channel.topic, message.channel.schema.as_ref().map(|s| s.name.clone()));
        if let Some(decoder) = decoders.get(&message.channel.id) {
            times.insert(message.log_time);
            judged += 1;
            match decoder.decode(&message.data) {
                Ok(value) => check_quaternions(&value.to_json(), topic, &mut found),
                Err(error) => found.add(3, format!("{topic}: {error}")),
            }
        }
        let value: Result<Value, _> = serde_json::from_slice(&message.data);
        if let (Some("foxglove.FrameTransform"), Ok(value)) = (name.as_deref(), &value) {
            frames.connect(value);
        }
        let Some(schema) = schemas.get(&message.channel.id) else { continue };
        judged += 1;
        times.insert(message.log_time);
        if message.log_time == 0 {
            found.add(5, format!("{topic}: log_time 0"));
        }
        let value = match value {
            Ok(value) => value,
            Err(error) => {
                found.add(3, format!("{topic}: no JSON: {error}"));
                continue;
            }
        };
        if let Err(error) = schema::fits(&value, schema, "$") {
            found.add(3, format!("{topic}: {error}"));
        }
        check_quaternions(&value, topic, &mut found);
        match name.as_deref() {
            Some("foxglove.SceneUpdate") => {
                *scenes.entry(topic.clone()).or_default() += 1;
                check_scene(&value, topic, &mut found);
                for entity in list(&value["entities"]) {
                    frames.draw(&entity["frame_id"], topic, &mut found);
                }
            }
            Some("foxglove.PoseInFrame") => frames.draw(&value["frame_id"], topic, &mut found),
            _ => {}
        }
    }
    if summary.stats.as_ref().is_some_and(|stats| stats.message_count != count) {
        found.add(4, format!("statistics count other than {count} messages"));
    }
    for (topic, count) in scenes {
        if count != 1 {
            found.add(8, format!("{topic}: {count} scenes, expected one"));
        }
    }
    if let (Some(first), Some(last)) = (times.first(), times.last()) {
        if last - first > LONGEST_NS {
            found.add(5, "log times span more than a year");
        }
        if first == last && judged > 1 {
            found.add(5, "all log times are equal");
        }
    }
    frames.check(&mut found);
    found.0.into_iter().collect()
}

/// Each once.
#[derive(Default)]
struct Violations(BTreeSet<String>);

impl Violations {
    fn add(&mut self, rule: u8, what: impl std::fmt::Display) {
        self.0.insert(format!("rule {rule}: {what}"));
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn check_index(log: &[u8], summary: &mcap::Summary, found: &mut Violations) {
    if summary.stats.is_none() {
        found.add(4, "no statistics");
    }
    if summary.chunk_indexes.is_empty() {
        found.add(4, "no chunk index");
    }
    let mut indexed = 0;
    for chunk in &summary.chunk_indexes {
        match summary.read_message_indexes(log, chunk) {
            Ok(indexes) => indexed += indexes.values().map(Vec::len).sum::<usize>() as u64,
            Err(error) => {
                found.add(4, format!("chunk at {}: message index: {error}", chunk.chunk_start_offset));
            }
        }
    }
    // Chunks that can't be decoded are in the counts, and in no index.
    let left_out =
        summary.stats.as_ref().is_some_and(|s| (s.chunk_count as usize) > summary.chunk_indexes.len());
    if !left_out && summary.stats.as_ref().is_some_and(|stats| stats.message_count != indexed) {
        found.add(4, format!("{indexed} messages are indexed, other than the statistics count"));
    }
}

/// The channel's schema, where it has one that a viewer reads.
fn check_channel(channel: &mcap::Channel<'_>, found: &mut Violations) -> Option<Value> {
    let topic = &channel.topic;
    if channel.message_encoding != "json" {
        // others are read in their own way
        return None;
    }
    let Some(schema) = &channel.schema else {
        found.add(1, format!("{topic}: no schema"));
        return None;
    };
    if schema.encoding != "jsonschema" {
        found.add(1, format!("{topic}: schema encoding {:?}, expected \"jsonschema\"", schema.encoding));
        return None;
    }
    let Ok(text) = serde_json::from_slice::<Value>(&schema.data) else {
        found.add(1, format!("{topic}: schema {} is not JSON", schema.name));
        return None;
    };
    if text["title"] != schema.name.as_str() {
        found.add(1, format!("{topic}: schema {:?} has the title {}", schema.name, text["title"]));
    }
    if let Err(error) = schema::check_subset(&text, "$") {
        found.add(2, format!("{topic}: schema {}: {error}", schema.name));
        return None;
    }
    Some(text)
}

/// Of channels of other encodings than JSON.
fn decoders(
    summary: &mcap::Summary,
    is_judged: impl Fn(&str) -> bool,
    found: &mut Violations,
) -> BTreeMap<u16, Decoder> {
    let mut decoders = BTreeMap::new();
    let others = summary.channels.values().filter(|c| c.message_encoding != "json" && is_judged(&c.topic));
    for channel in others {
        let made = match &channel.schema {
            Some(s) => Decoder::new(&channel.message_encoding, &s.encoding, &s.name, &s.data),
            None => Decoder::new(&channel.message_encoding, "", "", &[]),
        };
        match made {
            Ok(decoder) => _ = decoders.insert(channel.id, decoder),
            Err(error) => found.add(1, format!("{}: {error}", channel.topic)),
        }
    }
    decoders
}

fn check_quaternions(value: &Value, topic: &str, found: &mut Violations) {
    if let Some(object) = value.as_object() {
        for (key, field) in object {
            if matches!(key.as_str(), "orientation" | "rotation") {
                let parts = ["x", "y", "z", "w"].map(|part| field[part].as_f64().unwrap_or(f64::NAN));
                let length = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
                if (length - 1.0).abs().is_nan() || (length - 1.0).abs() > 1e-3 {
                    found.add(3, format!("{topic}: a quaternion of length {length}"));
                }
            }
            check_quaternions(field, topic, found);
        }
    }
    list(value).iter().for_each(|item| check_quaternions(item, topic, found));
}

fn check_scene(scene: &Value, topic: &str, found: &mut Violations) {
    let mut ids = BTreeSet::new();
    let mut vertices = 0;
    for entity in list(&scene["entities"]) {
        let id = entity["id"].as_str().unwrap_or_default();
        let mut broken = |what: &str| found.add(8, format!("{topic}: entity {id:?}: {what}"));
        if id.is_empty() || !ids.insert(id) {
            broken("no id of its own");
        }
        if entity["lifetime"]["sec"] != 0 || entity["lifetime"]["nsec"] != 0 {
            broken("a lifetime that ends");
        }
        if entity["frame_locked"] != true {
            broken("not frame_locked");
        }
        for primitive in PRIMITIVES {
            if !entity[primitive].is_array() {
                broken(&format!("no list of {primitive}"));
            }
            for item in list(&entity[primitive]) {
                let colored = item["color"]["a"].as_f64().is_some_and(|a| a > 0.0);
                if !colored && list(&item["colors"]).is_empty() {
                    broken(&format!("one of its {primitive} has alpha 0"));
                }
                vertices += list(&item["points"]).len().max(1);
            }
        }
        for line in list(&entity["lines"]) {
            if line["type"] != 0 {
                broken("a line that is no LINE_STRIP");
            }
            if line["scale_invariant"] != true {
                broken("a line that is not scale_invariant");
            }
            if list(&line["points"]).len() < 2 {
                broken("a line of fewer than two points");
            }
        }
    }
    if vertices > MOST_VERTICES {
        found.add(8, format!("{topic}: {vertices} vertices, expected at most {MOST_VERTICES}"));
    }
}

/// Which frames are drawn in, and which stand in which.
#[derive(Default)]
struct Frames {
    drawn: BTreeMap<String, String>,
    parents: BTreeMap<String, String>,
}

impl Frames {
    fn connect(&mut self, transform: &Value) {
        let part = |key: &str| transform[key].as_str().unwrap_or_default().to_owned();
        self.parents.insert(part("child_frame_id"), part("parent_frame_id"));
    }

    fn draw(&mut self, frame: &Value, topic: &str, found: &mut Violations) {
        match frame.as_str() {
            None | Some("") => found.add(7, format!("{topic}: drawn in no frame")),
            Some(frame) => _ = self.drawn.insert(frame.to_owned(), topic.to_owned()),
        }
    }

    fn root<'f>(&'f self, frame: &'f str) -> &'f str {
        let mut frame = frame;
        // as many steps as there are, so that a ring ends too
        for _ in 0..self.parents.len() {
            frame = self.parents.get(frame).map_or(frame, String::as_str);
        }
        frame
    }

    fn check(&self, found: &mut Violations) {
        let roots: BTreeSet<&str> = self.drawn.keys().map(|frame| self.root(frame)).collect();
        if roots.len() > 1 {
            found.add(7, format!("frames do not connect: {:?}", self.drawn));
        }
    }
}
