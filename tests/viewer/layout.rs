//! The layouts beside the sample logs show a fused one and a cleaned dive: every topic, message path and frame in them is
//! there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde_json::Value;
use trackfuse::log::decode::{self, Decoder, MessagePath};

use super::fused::{DIVE, NAMES, fused};

/// The layouts, and the prefix of the topics that each shows.
const LAYOUTS: [&str; 2] = ["fused", "usbl"];

fn layout() -> Value {
    layout_of("fused")
}

fn layout_of(prefix: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("sample_logs/{prefix}.layout.json"));
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// A topic's schema and messages.
#[derive(Default)]
struct Topic {
    schema: String,
    messages: Vec<decode::Value>,
}

/// The JSON channels of a fused sample log.
fn topics(name: &str) -> BTreeMap<String, Topic> {
    let decoder = Decoder::new("json", "", "", &[]).unwrap();
    let log = fs::read(fused(name)).unwrap();
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for message in mcap::MessageStream::new(&log).unwrap().map(Result::unwrap) {
        if message.channel.message_encoding == "json" {
            let topic = topics.entry(message.channel.topic.clone()).or_default();
            topic.schema.clone_from(&message.channel.schema.as_ref().unwrap().name);
            topic.messages.push(decoder.decode(&message.data).unwrap());
        }
    }
    topics
}

/// What a path leads to in the messages of its topic.
fn values(topics: &BTreeMap<String, Topic>, path: &str) -> Vec<decode::Value> {
    let path = MessagePath::parse(path).unwrap();
    let topic = topics.get(&path.topic).unwrap_or_else(|| panic!("{path}: no such topic"));
    // a field without a value is left out of some messages
    topic.messages.iter().filter_map(|m| path.resolve(m).ok().flatten().cloned()).collect()
}

fn text<'v>(value: &'v Value, key: &str) -> &'v str {
    value[key].as_str().unwrap_or_else(|| panic!("no {key} in {value}"))
}

/// The panels that a part of the layout's tree shows.
fn shown(tree: &Value, panels: &mut Vec<String>) {
    if let Some(panel) = tree.as_str() {
        return panels.push(panel.to_owned());
    }
    assert!(["row", "column"].contains(&text(tree, "direction")), "{tree}");
    assert!((5.0..=95.0).contains(&tree["splitPercentage"].as_f64().unwrap()), "{tree}");
    shown(&tree["first"], panels);
    shown(&tree["second"], panels);
}

#[test]
fn layouts_have_each_panel_once_with_a_title_for_both_viewers() {
    for layout in LAYOUTS.map(layout_of) {
        let configs = layout["configById"].as_object().unwrap();
        let mut panels = Vec::new();
        shown(&layout["layout"], &mut panels);
        let unique: BTreeSet<&String> = panels.iter().collect();
        assert_eq!(unique.len(), panels.len(), "{panels:?}");
        assert_eq!(unique, configs.keys().collect());
        for (id, config) in configs {
            assert_eq!(text(config, "lichtblickPanelTitle"), text(config, "foxglovePanelTitle"), "{id}");
        }
        for key in ["globalVariables", "userNodes"] {
            assert_eq!(layout[key], serde_json::json!({}));
        }
        assert_eq!(layout["playbackConfig"]["speed"], 1);
    }
}

#[test]
fn layout_message_paths_lead_to_values_in_a_sample_log_with_its_track() {
    for (name, prefix) in [("steep_climb", "fused"), ("oblique_climb", "fused"), (DIVE, "usbl")] {
        let topics = topics(name);
        let mut checked = 0;
        for (id, config) in layout_of(prefix)["configById"].as_object().unwrap() {
            let kind = id.split('!').next().unwrap();
            for path in config["paths"].as_array().into_iter().flatten() {
                let path = text(path, "value");
                if path.parse::<f64>().is_ok() {
                    continue; // a line at that height
                }
                let values = values(&topics, path);
                let fits = |value: &decode::Value| match kind {
                    "Plot" => value.as_f64().is_some_and(f64::is_finite),
                    _ => matches!(value, decode::Value::Text(_)),
                };
                assert!(values.len() > 10 && values.iter().all(fits), "{name}: {id}: {path}: {values:?}");
                checked += 1;
            }
            match kind {
                "Plot" | "StateTransitions" => {
                    assert!(config["paths"].as_array().is_some_and(|p| !p.is_empty()));
                }
                "RosOut" => assert_eq!(topics[text(config, "topicToRender")].schema, "foxglove.Log"),
                "3D" | "map" => {}
                _ => panic!("{id}: a panel that nothing is known of"),
            }
        }
        assert!(checked > 20, "{checked}");
    }
}

#[test]
fn layouts_draw_the_scene_and_the_pose_in_their_frame() {
    for (name, prefix) in [("steep_climb", "fused"), (DIVE, "usbl")] {
        let topics = topics(name);
        let layout = layout_of(prefix);
        let configs = layout["configById"].as_object().unwrap();
        let (_, space) = configs.iter().find(|(id, _)| id.starts_with("3D!")).unwrap();
        let drawn = space["topics"].as_object().unwrap();
        let expected = ["scene", "pose"].map(|name| format!("/{prefix}/{name}"));
        assert_eq!(drawn.keys().collect::<Vec<_>>(), expected.each_ref());
        for (topic, settings) in drawn {
            assert_eq!(settings["visible"], true);
            let schema = topics[topic].schema.as_str();
            assert!(["foxglove.SceneUpdate", "foxglove.PoseInFrame"].contains(&schema));
        }
        for path in [format!("/{prefix}/scene.entities[0].frame_id"), format!("/{prefix}/pose.frame_id")] {
            let frame = decode::Value::Text(text(space, "followTf").into());
            assert_eq!(values(&topics, &path)[0], frame, "{path}");
        }
    }
}

#[test]
fn layout_map_has_the_tracks_place_in_its_middle() {
    let topics = topics("steep_climb");
    let map = &layout()["configById"]["map!track"];
    for (topic, schema) in [("/fused/fix", "foxglove.LocationFix"), ("/fused/geojson", "foxglove.GeoJSON")] {
        assert_eq!(topics[topic].schema, schema);
        assert!(map["topicColors"].get(topic).is_some());
    }
    for (path, key) in [("/fused/fix.latitude", "lat"), ("/fused/fix.longitude", "lon")] {
        let center = map["center"][key].as_f64().unwrap();
        let values = values(&topics, path);
        // a picture of zoom 17 is some 500 m wide
        assert!(values.iter().all(|v| (v.as_f64().unwrap() - center).abs() < 0.002), "{path}: {values:?}");
    }
}

/// Whether the camera that the layout describes has `point` in its picture, as the viewers place it.
fn is_seen(camera: &Value, point: [f64; 3]) -> bool {
    let angle = |key: &str| camera[key].as_f64().unwrap().to_radians();
    let (phi, theta, half) = (angle("phi"), -angle("thetaOffset"), angle("fovy") / 2.0);
    let target = [0, 1, 2].map(|i| camera["targetOffset"][i].as_f64().unwrap());
    let distance = camera["distance"].as_f64().unwrap();
    // from the target to the camera, and the picture's two directions
    let back = [phi.sin() * theta.sin(), -phi.sin() * theta.cos(), phi.cos()];
    let right = [theta.cos(), theta.sin(), 0.0];
    let up = [-phi.cos() * theta.sin(), phi.cos() * theta.cos(), phi.sin()];
    let dot = |u: [f64; 3]| (0..3).map(|i| u[i] * (point[i] - target[i])).sum::<f64>();
    let ahead = distance - dot(back);
    ahead > 0.0 && dot(right).abs() < ahead * half.tan() && dot(up).abs() < ahead * half.tan()
}

#[test]
fn layout_cameras_see_the_climbs_and_the_dive_from_end_to_end() {
    let layout = layout();
    let camera = &layout["configById"]["3D!scene"]["cameraState"];
    for name in NAMES {
        let track = values(&topics(name), "/fused/track.position");
        for point in track.iter().map(|p| p.as_vector3().unwrap()) {
            assert!(is_seen(camera, point), "{name}: {point:?}");
        }
    }
    let dive = layout_of("usbl");
    let far = &dive["configById"]["3D!scene"]["cameraState"];
    for point in values(&topics(DIVE), "/usbl/track.position").iter().map(|p| p.as_vector3().unwrap()) {
        assert!(is_seen(far, point), "{DIVE}: {point:?}");
    }
    assert!(!is_seen(camera, [0.0, 0.0, 60.0]) && !is_seen(camera, [100.0, -100.0, -30.0]));
}
