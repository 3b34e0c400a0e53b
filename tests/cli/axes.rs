//! Axes, lever arms and attitudes, held to positions and velocities that are written down by hand.

use serde_json::{Value, json};

use super::trial::{Output, Trial, assert_says};
use super::trial_log::{TrialLog, ns, stamp};

/// A log of 81 messages within 8 s on one topic.
fn log_of(message: impl Fn(f64) -> Value) -> Vec<u8> {
    let mut log = TrialLog::new();
    for k in 0..=80 {
        let t = 0.1 * f64::from(k);
        let mut value = message(t);
        value["timestamp"] = stamp(ns(t));
        log.json("/rov/state", t, &value);
    }
    log.finish()
}

fn config(keys: &str) -> String {
    format!(
        "[[source]]\nname = \"rov\"\nposition = \"/rov/state.pose.position\"\nposition_sigma_m = 0.01\n{keys}\n"
    )
}

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

/// A pose whose attitude is a turn by `angle_rad` about an axis of length 1.
fn pose(position: [f64; 3], [x, y, z]: [f64; 3], angle_rad: f64) -> Value {
    let (sin, cos) = (0.5 * angle_rad).sin_cos();
    let orientation = json!({"x": sin * x, "y": sin * y, "z": sin * z, "w": cos});
    json!({"pose": {"position": xyz(position), "orientation": orientation}})
}

fn assert_near_by(output: &Output, t: f64, expected: [f64; 3]) {
    let found = output.near(t).vector("position");
    assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 0.1), "at {t} s: {found:?}, {expected:?}");
}

fn assert_near(output: &Output, field: &str, t: f64, expected: [f64; 3]) {
    let found = output.near(t).vector(field);
    assert!(
        (0..3).all(|i| (found[i] - expected[i]).abs() < 0.02),
        "{field} at {t} s: {found:?}, {expected:?}"
    );
}

#[test]
fn axes_of_the_body_turn_the_lever_arm() {
    // 2 m ahead of the sensor, 1 m to its right and 3 m above it is what is tracked, which goes straight on while it
    // turns left
    let log = log_of(|t| {
        let (sin, cos) = (0.4 * t).sin_cos();
        let lever = [2.0 * cos + sin, 2.0 * sin - cos, 3.0];
        let tracked = [1.0 + 2.0 * t, -t, -20.0 + t];
        pose([0, 1, 2].map(|i| tracked[i] - lever[i]), [0.0, 0.0, 1.0], 0.4 * t)
    });
    let (report, output) = Trial::of(log).config(&config("offset_m = [2.0, -1.0, 3.0]")).report(0);
    for t in [1.0, 4.0, 7.0] {
        assert_near(&output, "position", t, [1.0 + 2.0 * t, -t, -20.0 + t]);
        assert_near(&output, "velocity", t, [2.0, -1.0, 1.0]);
    }
    assert!(!report["notes"].to_string().contains("offset_m"));

    // rolled by a quarter turn to the right, what is on its left is above it
    let log = log_of(|t| pose([t, 0.0, -20.0], [1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2));
    let (_, output) = Trial::of(log).config(&config("offset_m = [0.0, 1.5, 0.0]")).report(0);
    assert_near(&output, "position", 4.0, [4.0, 0.0, -18.5]);
}

#[test]
fn axes_of_the_track_are_the_lever_arms_where_no_attitude_is_known_and_a_note_says_so() {
    let none = json!({"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0});
    let plain = |t: f64| json!({"pose": {"position": xyz([t, 0.0, -20.0])}});
    let zeros = |t: f64| json!({"pose": {"position": xyz([t, 0.0, -20.0]), "orientation": none}});
    for log in [log_of(plain), log_of(zeros)] {
        let (report, output) = Trial::of(log).config(&config("offset_m = [0.0, 1.5, 0.0]")).report(0);
        assert_near(&output, "position", 4.0, [4.0, 1.5, -20.0]);
        assert_says(&report["notes"].to_string(), &["rov: `offset_m` is added as it is"]);
    }
}

#[test]
fn axes_that_some_messages_do_not_give_cost_those_their_position() {
    let quarter = |t: f64| pose([t, 0.0, -20.0], [0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
    let log = log_of(|t| {
        let mut message = quarter(t);
        if t < 0.95 {
            message["pose"]["orientation"] = xyz([0.0; 3]);
        }
        message
    });
    let (report, output) = Trial::of(log).config(&config("offset_m = [2.0, 0.0, 0.0]")).report(3);
    assert_near(&output, "position", 4.0, [4.0, 2.0, -20.0]);
    assert_eq!(report["sources"][0]["positions"], 71);
    assert_says(
        &report["warnings"].to_string(),
        &["10 samples are left out: no orientation of unit length to turn `offset_m` by"],
    );
}

#[test]
fn axes_of_north_east_down_hold_for_attitude_lever_arm_and_body_velocity_too() {
    // heading east, nose level: ahead is east, right is south
    let log = log_of(|t| {
        let mut message = pose([7.0, 3.0 * t, 10.0 - 0.5 * t], [0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
        message["twist"] = json!({"linear": xyz([3.0, 0.0, -0.5])});
        message
    });
    let keys = "velocity = \"/rov/state.twist.linear\"\nvelocity_sigma_m_s = 0.01\nvelocity_frame = \"body\"\n\
                axes = \"ned\"\noffset_m = [2.0, 1.0, 0.25]";
    let (_, output) = Trial::of(log).config(&config(keys)).report(0);
    for t in [1.0, 4.0, 7.0] {
        assert_near(&output, "position", t, [3.0 * t + 2.0, 7.0 - 1.0, -10.0 + 0.5 * t - 0.25]);
        assert_near(&output, "velocity", t, [3.0, 0.0, 0.5]);
    }
}

#[test]
fn axes_that_are_mislabelled_cost_their_source_its_place_with_the_reason() {
    let mut log = TrialLog::new();
    for k in 0..=160 {
        let t = 0.05 * f64::from(k);
        let [x, y, z] = [6.0 * t.sin(), 9.0 * (0.6 * t).cos() + t, -50.0 + 4.0 * t];
        let noise = |i: i32| 0.05 * f64::from(k * k * 7 + i * 31).sin();
        let message = |v: [f64; 3]| {
            let v = xyz([0, 1, 2].map(|i| v[i] + noise(i as i32)));
            json!({"timestamp": stamp(ns(t)), "position": v})
        };
        log.json("/tether/track", t, &message([x, y, z]));
        log.json("/beacon/track", t, &message([y, x, -z]));
    }
    let log = log.finish();
    let (report, output) = Trial::of(&log).report(3);
    assert_says(
        &report["warnings"].to_string(),
        &["beacon is left out: its positions are mirrored", "say `axes = \\\"ned\\\"` for this source"],
    );
    let [x, y, z] = [6.0 * 4.0_f64.sin(), 9.0 * 2.4_f64.cos() + 4.0, -34.0];
    assert_near_by(&output, 4.0, [x, y, z]);
    let config = "[[source]]\nname = \"tether\"\nposition = \"/tether/track.position\"\n[[source]]\nname = \"beacon\"\n\
                  position = \"/beacon/track.position\"\naxes = \"ned\"\n";
    let (report, output) = Trial::of(&log).config(config).report(0);
    assert_eq!(report["warnings"], json!([]));
    assert_near_by(&output, 4.0, [x, y, z]);
}

#[test]
fn axes_of_positions_and_velocities_that_have_different_names_are_told() {
    let mut log = TrialLog::new();
    for k in 0..=80 {
        let t = 0.1 * f64::from(k);
        let message = |frame: &str, key: &str, v| {
            let mut message = json!({"timestamp": stamp(ns(t)), "frame_id": frame});
            message[key] = xyz(v);
            message
        };
        log.json("/rov/pos", t, &message("map", "position", [3.0 * t, 0.0, -20.0]));
        log.json("/rov/vel", t, &message("base_link", "velocity", [3.0, 0.0, 0.0]));
    }
    let log = log.finish();
    let config =
        "[[source]]\nname = \"rov\"\nposition = \"/rov/pos.position\"\nvelocity = \"/rov/vel.velocity\"\n";
    let (report, _) = Trial::of(&log).config(config).report(3);
    assert_says(
        &report["warnings"].to_string(),
        &["rov: its positions are in \\\"map\\\", its velocities in \\\"base_link\\\""],
    );
    Trial::of(&log).config(&format!("{config}velocity_frame = \"world\"\n")).report(0);
}
