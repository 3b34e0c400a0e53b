//! The same samples in every encoding give the same track, to the last bit.

use std::io::Cursor;

use serde_json::Value;
use trackfuse::simulate::{Scenario, SensorEncoding, write_log};

use super::trial::Trial;
use super::trial_log::{Cdr, TrialLog};

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

/// A simulated climb as its recorder encodes it.
fn simulated(encoding: SensorEncoding) -> Vec<u8> {
    let mut scenario =
        Scenario::from_toml(include_str!("../../sample_logs/steep_climb.scenario.toml")).unwrap();
    scenario.recording.encoding = encoding;
    let mut log = Cursor::new(Vec::new());
    write_log(&scenario, &mut log).unwrap();
    log.into_inner()
}

/// The sensors of the JSON log with their messages defined by IDL, which the simulator doesn't write.
fn by_idl() -> Vec<u8> {
    let json = simulated(SensorEncoding::Json);
    let mut log = TrialLog::new();
    for topic in ["/tether/track", "/beacon/track"] {
        log.channel(topic, "cdr", ("nav/msg/Track", "ros2idl", IDL));
        for message in mcap::MessageStream::new(&json).unwrap().map(Result::unwrap) {
            if message.channel.topic == topic {
                let value: Value = serde_json::from_slice(&message.data).unwrap();
                let vector = |name: &str| ["x", "y", "z"].map(|axis| value[name][axis].as_f64().unwrap());
                let data = Cdr::new()
                    .header(message.publish_time, "enu")
                    .f64s(&vector("position"))
                    .f64s(&vector("velocity"));
                log.raw(topic, [message.log_time, message.publish_time], &data.done());
            }
        }
    }
    log.finish()
}

/// All that `fuse` made of a log; a log with a warning is none to compare.
fn track(log: Vec<u8>) -> Vec<Value> {
    let (_, output) = Trial::of(log).report(0);
    output.track().iter().map(|written| written.value.clone()).collect()
}

#[test]
fn encodings_of_the_same_samples_give_the_same_track_to_the_last_bit() {
    let expected = track(simulated(SensorEncoding::Json));
    assert!(expected.len() > 250);
    for (name, log) in [
        ("cdr", simulated(SensorEncoding::Cdr)),
        ("ros1", simulated(SensorEncoding::Ros1)),
        ("protobuf", simulated(SensorEncoding::Protobuf)),
        ("idl", by_idl()),
    ] {
        let summary = mcap::Summary::read(&log).unwrap().unwrap();
        let tether = summary.channels.values().find(|c| c.topic == "/tether/track").unwrap();
        assert_ne!(tether.message_encoding, "json", "{name}");
        let found = track(log);
        let differs = expected.iter().zip(&found).position(|(a, b)| format!("{a}") != format!("{b}"));
        assert_eq!((found.len(), differs), (expected.len(), None), "{name}");
    }
}
