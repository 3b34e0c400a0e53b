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
    let (report, output) = Trial::of(fs::read(path).unwrap()).report(0);
    let names: Vec<_> = report["sources"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, ["gauge", "beacon"]);
    assert_eq!(report["unused_topics"], json!(["/cub1/pose"]));
    assert!(output.track().len() > 3000);
    // what was put into the beacon: a bias of (0.8, -0.5, 0.4) m, and stamps 0.12 s late
    let unknowns = report["registration"]["unknowns"].as_array().unwrap();
    let of = |kind: &str, axis: Option<&str>| {
        let unknown = unknowns.iter().find(|u| u["kind"] == kind && u["axis"].as_str() == axis).unwrap();
        (unknown["value"].as_f64().unwrap(), unknown["sigma"].as_f64().unwrap())
    };
    for (axis, planted) in [("x", 0.8), ("y", -0.5), ("z", 0.4)] {
        let (value, sigma) = of("bias", Some(axis));
        assert!((value - planted).abs() < 3.0 * sigma && sigma < 0.06, "{axis}: {value} {sigma}");
    }
    let (value, sigma) = of("clock-offset", None);
    assert!((value - 0.12).abs() < 3.0 * sigma && sigma < 0.013, "{value} {sigma}");
}
