//! The decoders against real recordings; `decode_golden.py` made the numbers.
#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]
#![expect(clippy::unreadable_literal, reason = "numbers as the script prints them")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use mcap::MessageStream;
use trackfuse::log::decode::{Decoder, MessagePath, Value};

/// The recordings' directory, which is too large to live here.
fn test_data() -> Option<PathBuf> {
    let dir = std::env::var_os("TRACKFUSE_TEST_DATA").map(PathBuf::from);
    if dir.is_none() {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
    }
    dir
}

fn decoder_of(channel: &mcap::Channel<'_>) -> Result<Decoder, String> {
    let (encoding, name, data) = match &channel.schema {
        Some(schema) => (schema.encoding.as_str(), schema.name.as_str(), &*schema.data),
        None => ("", "", &[][..]),
    };
    Decoder::new(&channel.message_encoding, encoding, name, data).map_err(|e| e.to_string())
}

fn logs_in(dir: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(dir).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "mcap")).collect()
}

#[test]
fn every_message_of_the_recordings_decodes() {
    let Some(dir) = test_data() else { return };
    let logs = ["", "rosbag2", "others", "climbs"].iter().flat_map(|sub| logs_in(&dir.join(sub)));
    let mut decoded = 0;
    for path in logs {
        let bytes = std::fs::read(&path).unwrap();
        let mut decoders = HashMap::new();
        for message in MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let channel = &message.channel;
            let decoder = decoders.entry(channel.id).or_insert_with(|| decoder_of(channel));
            match decoder {
                Ok(decoder) => {
                    let result = decoder.decode(&message.data);
                    assert!(result.is_ok(), "{} {}: {result:?}", path.display(), channel.topic);
                    decoded += 1;
                }
                Err(e) => {
                    let foreign = channel.message_encoding == "wrong_format";
                    assert!(
                        foreign && e.contains("expected json, cdr, ros1 or protobuf"),
                        "{} {}: {e}",
                        path.display(),
                        channel.topic
                    );
                }
            }
        }
    }
    assert!(decoded > 100_000, "{decoded}");
}

/// The field at `path` of the topic's message number `index`, in the order of `log_time`, is `expected`:
/// whole numbers by value, the rest exactly. So it is when only that field is decoded.
fn golden(dir: &Path, file: &str, index: usize, path: &str, expected: &Value) {
    let path = MessagePath::parse(path).unwrap();
    let bytes = std::fs::read(dir.join(file)).unwrap();
    let stream = MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let mut messages: Vec<_> = stream.filter(|message| message.channel.topic == path.topic).collect();
    messages.sort_by_key(|message| message.log_time);
    let message = &messages[index];

    let decoder = decoder_of(&message.channel).unwrap();
    let selected = decoder.select(std::slice::from_ref(&path)).unwrap();
    for decoder in [decoder, selected] {
        let value = decoder.decode(&message.data).unwrap();
        let found = path.resolve(&value).unwrap().unwrap();
        let same = found == expected || (expected.as_i64().is_some() && found.as_i64() == expected.as_i64());
        assert!(same, "{file} {path}: {found:?}, expected {expected:?}");
    }
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

#[test]
fn cdr_positions_and_velocities_are_those_of_an_independent_decoder() {
    let Some(dir) = test_data() else { return };
    golden(&dir, "flight_two_sensors.mcap", 1234, "/cub1/pose.header.stamp.sec", &Value::Int(1763073222));
    golden(&dir, "flight_two_sensors.mcap", 1234, "/cub1/pose.header.stamp.nanosec", &Value::Int(289258386));
    golden(&dir, "flight_two_sensors.mcap", 1234, "/cub1/pose.header.frame_id", &text("qualisys"));
    golden(&dir, "flight_two_sensors.mcap", 1234, "/cub1/pose.pose.position.x", &Value::Float(-7.95190625));
    golden(
        &dir,
        "flight_two_sensors.mcap",
        1234,
        "/cub1/pose.pose.position.y",
        &Value::Float(-3.768822265625),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        1234,
        "/cub1/pose.pose.position.z",
        &Value::Float(2.568865478515625),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        1234,
        "/cub1/pose.pose.orientation.w",
        &Value::Float(0.43199974102042055),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        77,
        "/gauge/velocity.header.stamp.nanosec",
        &Value::Int(690561056),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        77,
        "/gauge/velocity.twist.linear.x",
        &Value::Float(4.094149446806737),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        77,
        "/gauge/velocity.twist.linear.y",
        &Value::Float(-1.0076257766254053),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        77,
        "/gauge/velocity.twist.linear.z",
        &Value::Float(-0.07762948547558927),
    );
    golden(&dir, "flight_two_sensors.mcap", 159, "/beacon/odom.header.stamp.nanosec", &Value::Int(944678545));
    golden(&dir, "flight_two_sensors.mcap", 159, "/beacon/odom.child_frame_id", &text("vehicle"));
    golden(
        &dir,
        "flight_two_sensors.mcap",
        159,
        "/beacon/odom.pose.pose.position.x",
        &Value::Float(-5.083071568673487),
    );
    golden(
        &dir,
        "flight_two_sensors.mcap",
        159,
        "/beacon/odom.pose.pose.position.z",
        &Value::Float(1.8704146843124831),
    );
    golden(&dir, "flight_two_sensors.mcap", 159, "/beacon/odom.pose.covariance[35]", &Value::Float(0.0225));
    golden(
        &dir,
        "flight_two_sensors.mcap",
        159,
        "/beacon/odom.twist.twist.linear.y",
        &Value::Float(3.07891413466827),
    );
    golden(&dir, "flight_two_sensors.mcap", 159, "/beacon/odom.twist.covariance[0]", &Value::Float(0.0225));
    golden(&dir, "flight_two_sensors.mcap", 159, "/beacon/odom.twist.covariance[1]", &Value::Float(0.0));
}

#[test]
fn cdr_arrays_texts_and_nested_types_are_those_of_an_independent_decoder() {
    let Some(dir) = test_data() else { return };
    golden(&dir, "rosbag2/cdr_test_0.mcap", 2, "/test_topic.bool_value", &Value::Bool(false));
    golden(&dir, "rosbag2/cdr_test_0.mcap", 2, "/test_topic.int32_value", &Value::Int(123));
    golden(&dir, "rosbag2/cdr_test_0.mcap", 2, "/test_topic.uint64_value", &Value::Int(0));
    golden(&dir, "rosbag2/cdr_test_0.mcap", 3, "/array_topic.bool_values[2]", &Value::Bool(true));
    golden(&dir, "rosbag2/cdr_test_0.mcap", 3, "/array_topic.string_values[2]", &text("Complex Hello3"));
    golden(
        &dir,
        "rosbag2/cdr_test_0.mcap",
        3,
        "/array_topic.defaults_values[2].uint64_value",
        &Value::Int(50000000),
    );
    golden(&dir, "rosbag2/cdr_test_0.mcap", 3, "/array_topic.string_values_default[1]", &text("max value"));
    golden(&dir, "rosbag2/cdr_test_0.mcap", 3, "/array_topic.alignment_check", &Value::Int(0));
    golden(&dir, "rosbag2/talker.mcap", 9, "/rosout.stamp.sec", &Value::Int(1585866239));
    golden(&dir, "rosbag2/talker.mcap", 9, "/rosout.msg", &text("Publishing: 'Hello, world! 9'"));
    golden(&dir, "rosbag2/talker.mcap", 9, "/rosout.line", &Value::Int(38));
    golden(&dir, "rosbag2/only_topics.mcap", 6, "/parameter_events.node", &text("/introspection_client"));
    golden(
        &dir,
        "rosbag2/only_topics.mcap",
        6,
        "/parameter_events.new_parameters[0].name",
        &text("client_configure_introspection"),
    );
    golden(
        &dir,
        "rosbag2/only_topics.mcap",
        6,
        "/parameter_events.new_parameters[0].value.string_value",
        &text("disabled"),
    );
    golden(&dir, "others/autoferry_s02.mcap", 200, "/lidar/detections.header.frame_id", &text("piren_ned"));
    golden(
        &dir,
        "others/autoferry_s02.mcap",
        200,
        "/lidar/detections.poses[0].position.x",
        &Value::Float(-0.8167368173599243),
    );
    golden(
        &dir,
        "others/autoferry_s02.mcap",
        200,
        "/lidar/detections.poses[-1].position.y",
        &Value::Float(-515.3672485351562),
    );
}

#[test]
fn ros_1_fixes_and_odometry_are_those_of_an_independent_decoder() {
    const HUSKY: &str = "others/husky_gps_odom_ros1.mcap";
    let Some(dir) = test_data() else { return };
    golden(&dir, HUSKY, 499, "/fix.header.stamp.sec", &Value::Int(1432235697));
    golden(&dir, HUSKY, 499, "/fix.header.stamp.nsec", &Value::Int(637219905));
    golden(&dir, HUSKY, 499, "/fix.header.seq", &Value::Int(600));
    golden(&dir, HUSKY, 499, "/fix.header.frame_id", &text("/gps"));
    golden(&dir, HUSKY, 499, "/fix.status.status", &Value::Int(1));
    golden(&dir, HUSKY, 499, "/fix.latitude", &Value::Float(42.377046166666666));
    golden(&dir, HUSKY, 499, "/fix.longitude", &Value::Float(-71.14732266666667));
    golden(&dir, HUSKY, 499, "/fix.altitude", &Value::Float(-22.5));
    golden(&dir, HUSKY, 499, "/fix.position_covariance[8]", &Value::Float(2.5600000000000005));
    golden(&dir, HUSKY, 499, "/fix.position_covariance_type", &Value::Int(1));
    golden(&dir, HUSKY, 499, "/husky_velocity_controller/odom.header.seq", &Value::Int(1354));
    golden(&dir, HUSKY, 499, "/husky_velocity_controller/odom.header.stamp.nsec", &Value::Int(933414973));
    golden(
        &dir,
        HUSKY,
        499,
        "/husky_velocity_controller/odom.pose.pose.position.x",
        &Value::Float(52.288854219437596),
    );
    golden(
        &dir,
        HUSKY,
        499,
        "/husky_velocity_controller/odom.pose.pose.position.y",
        &Value::Float(-19.787164851365258),
    );
    golden(
        &dir,
        HUSKY,
        499,
        "/husky_velocity_controller/odom.pose.pose.orientation.z",
        &Value::Float(-0.19312598255984836),
    );
    golden(
        &dir,
        HUSKY,
        499,
        "/husky_velocity_controller/odom.twist.twist.linear.x",
        &Value::Float(1.0025689658778003),
    );
}

#[test]
fn json_fields_are_those_of_an_independent_decoder() {
    let Some(dir) = test_data() else { return };
    golden(&dir, "climbs/async_0.mcap", 100, "/tether/track.timestamp.nsec", &Value::Int(0));
    golden(&dir, "climbs/async_0.mcap", 100, "/tether/track.position.x", &Value::Float(2.97688));
    golden(&dir, "climbs/async_0.mcap", 100, "/tether/track.velocity.z", &Value::Float(8.897641));
    golden(&dir, "others/nbp1406_rv_palmer.mcap", 4999, "/knudsen/depth.depth_m", &Value::Float(4252.39));
    golden(&dir, "others/nbp1406_rv_palmer.mcap", 4999, "/knudsen/depth.valid", &Value::Bool(true));
    golden(&dir, "others/nbp1406_rv_palmer.mcap", 4999, "/knudsen/depth.lat", &Value::Float(-23.76523));
    golden(&dir, "others/nbp1406_rv_palmer.mcap", 4999, "/knudsen/depth.lon", &Value::Float(-19.497662));
    golden(&dir, "others/nbp1406_rv_palmer.mcap", 4999, "/knudsen/depth.sound_speed", &Value::Float(1500.0));
}
