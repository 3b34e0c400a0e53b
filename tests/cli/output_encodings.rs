//! `output.encoding`: the same result in every encoding, and what the tools of each make of it.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use trackfuse::log::decode::Decoder;
use trackfuse::simulate::{Scenario, SensorEncoding, write_log};

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::two_sensors;

const POINTS: &str = "origin = [59.4, 10.5, 3.0]\n[[characteristic_point]]\nname = \"half way\"\n\
                      z_m = -30.0\n";

/// Two sensors fused with their messages in this encoding.
fn fused(encoding: &str) -> Trial {
    let trial = Trial::of(two_sensors()).config(&format!("[output]\nencoding = \"{encoding}\"\n{POINTS}"));
    assert_eq!(trial.fuse(&[]).code, 0, "{encoding}");
    trial
}

/// A simulated climb whose log holds ROS 2 messages and nothing else.
fn ros_2_log() -> Vec<u8> {
    let mut scenario =
        Scenario::from_toml(include_str!("../../sample_logs/steep_climb.scenario.toml")).unwrap();
    scenario.recording.bystanders = false;
    scenario.recording.encoding = SensorEncoding::Cdr;
    let mut log = Cursor::new(Vec::new());
    write_log(&scenario, &mut log).unwrap();
    log.into_inner()
}

/// A channel's type and messages, whatever its encoding.
#[derive(Default)]
struct Topic {
    schema: String,
    messages: Vec<Value>,
}

fn topics(path: &Path) -> BTreeMap<String, Topic> {
    let log = fs::read(path).unwrap();
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for message in mcap::MessageStream::new(&log).unwrap().map(Result::unwrap) {
        let schema = message.channel.schema.clone().unwrap();
        let decoder =
            Decoder::new(&message.channel.message_encoding, &schema.encoding, &schema.name, &schema.data);
        let value = decoder.unwrap().decode(&message.data).unwrap().to_json();
        let topic = topics.entry(message.channel.topic.clone()).or_default();
        topic.schema.clone_from(&schema.name);
        topic.messages.push(value);
    }
    topics.retain(|topic, _| topic.starts_with("/fused/"));
    topics
}

/// A protobuf message with JSON's names for times, and without what is absent.
fn as_json(value: &Value) -> Value {
    match value {
        Value::Object(fields) => {
            let name = |name: &str| match name {
                "seconds" => "sec".to_owned(),
                "nanos" => "nsec".to_owned(),
                name => name.to_owned(),
            };
            fields.iter().filter(|(_, v)| !v.is_null()).map(|(k, v)| (name(k), as_json(v))).collect()
        }
        Value::Array(items) => items.iter().map(as_json).collect(),
        // -0, which protobuf leaves out
        Value::Number(n) => json!(n.as_f64().unwrap() + 0.0),
        other => other.clone(),
    }
}

#[test]
fn output_as_a_path_ends_where_the_track_does_however_long_it_is() {
    for rate_hz in [1500, 1501, 1503] {
        let config = format!("[output]\nencoding = \"cdr\"\nrate_hz = {rate_hz}.0\n");
        let trial = Trial::of(two_sensors()).config(&config);
        assert_eq!(trial.fuse(&[]).code, 0);
        let topics = topics(&trial.path("in.fused.mcap"));
        let (track, path) = (&topics["/fused/track"].messages, &topics["/fused/path"].messages[0]["poses"]);
        let poses = path.as_array().unwrap();
        assert!(track.len() > 10_000 && poses.len() == 10_000, "{} of {}", poses.len(), track.len());
        for (pose, point) in [(&poses[0], &track[0]), (&poses[9999], &track[track.len() - 1])] {
            assert_eq!(pose["header"]["stamp"], point["header"]["stamp"], "{rate_hz} Hz");
        }
    }
}

#[test]
fn output_as_protobuf_says_what_it_says_as_json_field_by_field() {
    let [expected, found] = ["json", "protobuf"].map(|e| topics(&fused(e).path("in.fused.mcap")));
    assert_eq!(expected.keys().collect::<Vec<_>>(), found.keys().collect::<Vec<_>>());
    assert_eq!(expected.len(), 9);
    for (name, topic) in &expected {
        assert_eq!(topic.schema, found[name].schema);
        assert_eq!(topic.messages.len(), found[name].messages.len(), "{name}");
        for (json, protobuf) in topic.messages.iter().zip(&found[name].messages) {
            let (mut json, mut protobuf) = (as_json(json), as_json(protobuf));
            if name == "/fused/fix" {
                // lists that JSON may leave out, and we do
                assert_eq!(protobuf.as_object_mut().unwrap().shift_remove("metadata"), Some(json!([])));
            }
            json.sort_all_objects();
            protobuf.sort_all_objects();
            assert_eq!(json, protobuf, "{name}");
        }
    }
}

#[test]
fn output_as_protobuf_can_be_compared_and_exported_as_that_of_json() {
    let tables = ["json", "protobuf"].map(|encoding| {
        let trial = fused(encoding);
        let run = |args: &[&str]| trackfuse(trial.folder(), args);
        let table = run(&["export", "in.fused.mcap"]);
        let report = run(&["compare", "in.fused.mcap", "--reference", "/beacon/track", "--json", "--quiet"]);
        assert_eq!((table.code, report.code), (0, 3), "{table:#?} {report:#?}");
        (table.stdout, serde_json::from_str::<Value>(&report.stdout).unwrap())
    });
    assert!(tables[0] == tables[1]);
    assert_eq!(tables[0].1, tables[1].1);
    assert_eq!(tables[0].1["characteristic_points"].as_array().map(Vec::len), Some(1));
}

#[test]
fn output_to_a_ros_2_log_is_ros_messages_with_the_numbers_of_json() {
    let config =
        "[output]\norigin = [59.4, 10.5, 3.0]\n[[characteristic_point]]\nname = \"40 m\"\nz_m = -40.0\n";
    let of_json = format!("[output]\nencoding = \"json\"\n{}", &config[9..]);
    let [ros, json] = [config, &of_json].map(|config| {
        let trial = Trial::of(ros_2_log()).config(config);
        let (report, _) = trial.report(0);
        (trial, report["notes"].to_string())
    });
    assert_says(&json.1, &["the log's profile is ros2"]);
    assert!(!ros.1.contains("ros2"), "{}", ros.1);
    let [found, expected] = [&ros.0, &json.0].map(|trial| topics(&trial.path("in.fused.mcap")));
    let types: BTreeMap<&str, &str> =
        found.iter().map(|(name, t)| (name.as_str(), t.schema.as_str())).collect();
    let standard = [
        ("/fused/events", "trackfuse_msgs/msg/CharacteristicPoint"),
        ("/fused/fix", "sensor_msgs/msg/NavSatFix"),
        ("/fused/geojson", "foxglove_msgs/msg/GeoJSON"),
        ("/fused/log", "rcl_interfaces/msg/Log"),
        ("/fused/path", "nav_msgs/msg/Path"),
        ("/fused/pcf", "nav_msgs/msg/Odometry"),
        ("/fused/pose", "geometry_msgs/msg/PoseStamped"),
        ("/fused/residuals", "trackfuse_msgs/msg/Residual"),
        ("/fused/scene", "visualization_msgs/msg/MarkerArray"),
        ("/fused/track", "nav_msgs/msg/Odometry"),
    ];
    assert_eq!(types, BTreeMap::from(standard));
    for topic in ["/fused/track", "/fused/pose", "/fused/fix", "/fused/events", "/fused/residuals"] {
        assert_eq!(found[topic].messages.len(), expected[topic].messages.len(), "{topic}");
    }
    for (odometry, point) in found["/fused/track"].messages.iter().zip(&expected["/fused/track"].messages) {
        assert_eq!(odometry["header"]["stamp"]["nanosec"], point["timestamp"]["nsec"]);
        assert_eq!(
            (&odometry["header"]["frame_id"], &odometry["child_frame_id"]),
            (&json!("enu"), &json!("fused"))
        );
        assert_eq!(odometry["pose"]["pose"]["position"], point["position"]);
        assert_eq!(odometry["twist"]["twist"]["linear"], point["velocity"]);
        let orientation = &odometry["pose"]["pose"]["orientation"];
        assert_eq!(*orientation, json!({"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}));
        for (part, sigma) in [("pose", "position_sigma"), ("twist", "velocity_sigma")] {
            let covariance = odometry[part]["covariance"].as_array().unwrap();
            assert_eq!(covariance[21], -1.0, "the rotation is not estimated");
            for (i, axis) in ["x", "y", "z"].iter().enumerate() {
                let expected = point[sigma][axis].as_f64().unwrap().powi(2);
                assert!((covariance[7 * i].as_f64().unwrap() - expected).abs() < 1e-12);
            }
        }
    }
    let last = |topics: &BTreeMap<String, Topic>, topic: &str| topics[topic].messages.last().unwrap().clone();
    assert_eq!(
        last(&found, "/fused/path")["poses"].as_array().map(Vec::len),
        Some(found["/fused/track"].messages.len())
    );
    let (event, own) = (last(&found, "/fused/events"), last(&expected, "/fused/events"));
    assert_eq!((&event["name"], &event["position"]), (&own["name"], &own["position"]));
    assert_eq!(event["time_sigma"], json!([own["time_sigma"]]));
    let (fix, own) = (last(&found, "/fused/fix"), last(&expected, "/fused/fix"));
    assert_eq!(
        (&fix["latitude"], &fix["position_covariance"]),
        (&own["latitude"], &own["position_covariance"])
    );
    assert_eq!(last(&found, "/fused/geojson"), last(&expected, "/fused/geojson"));
    assert!(found["/fused/log"].messages[0]["msg"].as_str().is_some_and(|text| text.len() > 500));
    assert_eq!(found["/fused/log"].messages[0]["level"], 20);

    // what a table or a comparison needs is in the odometry, and in what stands beside it
    let table = |trial: &Trial| {
        let ran = trackfuse(trial.folder(), &["export", "in.fused.mcap"]);
        assert_eq!(ran.code, 0, "{ran:#?}");
        ran.stdout.lines().skip(1).map(|l| l.split(',').map(str::to_owned).collect()).collect::<Vec<Vec<_>>>()
    };
    for (a, b) in table(&ros.0).iter().zip(table(&json.0)) {
        assert_eq!((&a[..8], &a[17..]), (&b[..8], &[String::new(), String::new()][..]));
        for (a, b) in a[11..17].iter().zip(&b[11..17]) {
            assert!((a.parse::<f64>().unwrap() - b.parse::<f64>().unwrap()).abs() < 1e-9);
        }
    }
    let errors = [&ros.0, &json.0].map(|trial| {
        let args = ["compare", "in.fused.mcap", "--reference", "/reference/ins", "--json", "--quiet"];
        let ran = trackfuse(trial.folder(), &args);
        let report: Value = serde_json::from_str(&ran.stdout).unwrap();
        assert_eq!(report["characteristic_points"].as_array().map(Vec::len), Some(1), "{report}");
        let position = &report["all"]["position_m"];
        [&position["rmse"], &position["bands"]["inside"], &position["bands"]["normalised_rmse"]]
            .map(|v| (v.as_f64().unwrap() * 1e9).round())
    });
    assert_eq!(errors[0], errors[1]);
}

#[test]
fn output_beside_a_ros_2_log_is_a_ros_2_log_too() {
    let trial = Trial::of(ros_2_log());
    assert_eq!(trial.fuse(&["--sidecar", "side.mcap"]).code, 0);
    assert_eq!(&fs::read(trial.path("side.mcap")).unwrap()[8 + 9..][..8], b"\x04\0\0\0ros2");
}

/// What another tool reads of a log; `None`, said aloud, where it is not at hand.
fn read_by(tool: &str, log: &Path) -> Option<Value> {
    let skipped = |why: &str| {
        let line = format!("skipped: {tool}: {why}\n");
        // past the test runner, which would keep it to itself
        let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
        None
    };
    let Some(python) = std::env::var_os("TRACKFUSE_TEST_PYTHON") else {
        return skipped("TRACKFUSE_TEST_PYTHON is not set");
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/other_readers.py");
    let ran = Command::new(python).arg(script).arg(tool).arg(log).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr);
    match ran.status.code() {
        Some(0) => Some(serde_json::from_slice(&ran.stdout).unwrap()),
        Some(77) => skipped(&said),
        _ => panic!("{tool}: {said}"),
    }
}

#[test]
fn output_to_a_ros_2_log_is_a_bag_that_an_independent_library_reads() {
    let trial = Trial::of(ros_2_log()).config("[output]\norigin = [59.4, 10.5, 3.0]\n");
    assert_eq!(trial.fuse(&[]).code, 0);
    let Some(found) = read_by("rosbags", &trial.path("in.fused.mcap")) else { return };
    let own = topics(&trial.path("in.fused.mcap"));
    assert!(found.get("/tether/track").is_some(), "what was there is read too: {found}");
    for (name, topic) in &own {
        assert_eq!(found[name]["type"], topic.schema, "{name}");
        assert_eq!(found[name]["count"], topic.messages.len(), "{name}");
    }
    let (theirs, ours) = (&found["/fused/track"]["last"], own["/fused/track"].messages.last().unwrap());
    assert_eq!(theirs["child_frame_id"], "fused");
    assert_eq!(theirs["pose"]["pose"]["position"], ours["pose"]["pose"]["position"]);
    assert_eq!(theirs["twist"]["covariance"], ours["twist"]["covariance"]);
    assert_eq!(found["/fused/path"]["last"]["poses"]["len"], own["/fused/track"].messages.len());
    let markers = own["/fused/scene"].messages[0]["markers"].as_array().unwrap().len();
    assert_eq!(found["/fused/scene"]["last"]["markers"]["len"], markers);
    assert_eq!(found["/fused/fix"]["last"]["position_covariance_type"], 2);
}

#[test]
fn output_in_every_encoding_is_taken_by_rerun_which_finds_poses_in_space() {
    for encoding in ["json", "protobuf", "cdr"] {
        let trial = fused(encoding);
        let Some(found) = read_by("rerun", &trial.path("in.fused.mcap")) else { return };
        for (topic, of) in found.as_object().unwrap().iter().filter(|(topic, _)| topic.starts_with("/fused/"))
        {
            assert_eq!(of["status"], "ok", "{encoding}: {topic}");
        }
        let components = found["/fused/pose"]["components"].to_string();
        // of JSON it keeps the bytes
        assert_eq!(components.contains("translation"), encoding != "json", "{encoding}: {components}");
        let places = found["/fused/fix"]["components"].to_string();
        assert_eq!(places.contains("GeoPoints"), encoding != "json", "{encoding}: {places}");
    }
}
