//! Recordings of others, which `TRACKFUSE_TEST_DATA` leads to.

use std::fs;

use serde_json::json;

use super::trial::{Trial, assert_says, logs};

#[test]
fn real_logs_without_clear_sources_end_with_an_error_that_names_their_topics() {
    for path in logs("others").iter().chain(&logs("rosbag2")) {
        let log = fs::read(path).unwrap();
        let channels = mcap::Summary::read(&log).ok().flatten().map(|s| s.channels).unwrap_or_default();
        let ran = Trial::of(log).fuse(&[]);
        assert_eq!(ran.code, 2, "{}: {ran:#?}", path.display());
        assert_says(&ran.stderr, &["no channel is recognised as a source"]);
        let named = channels.values().any(|c| ran.stderr.contains(&c.topic));
        assert!(
            named || ran.stderr.contains("the log has no channels"),
            "{}: {}",
            path.display(),
            ran.stderr
        );
    }
}

#[test]
fn real_logs_of_simulated_climbs_are_fused() {
    for path in logs("climbs").iter().step_by(3) {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let ran = Trial::of(fs::read(path).unwrap()).fuse(&[]);
        assert!(matches!(ran.code, 0 | 3), "{name}: {ran:#?}");
        assert_eq!(ran.code == 3, !ran.stderr.is_empty(), "{name}: {ran:#?}");
        if name.starts_with("no_error") || name.starts_with("single") {
            assert_eq!(ran.code, 0, "{name}: {ran:#?}");
        }
    }
}

#[test]
fn real_logs_of_a_flight_give_the_gauge_and_the_beacon_and_never_the_truth() {
    let Some(path) = logs("").into_iter().find(|p| p.ends_with("flight_two_sensors.mcap")) else { return };
    let (report, output) = Trial::of(fs::read(path).unwrap()).report(3);
    let names: Vec<_> = report["sources"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, ["gauge", "beacon"]);
    assert_eq!(report["unused_topics"], json!(["/cub1/pose"]));
    assert!(output.track().len() > 3000);
}
