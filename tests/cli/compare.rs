//! `compare`, against references whose distance from the track is known.

use std::process::Command;

use serde_json::Value;

use super::trial::{Ran, Trial, assert_says, trackfuse};
use super::trial_log::{EPOCH_NS, Sensor, TrialLog, position, stamp, two_sensors, xyz};

/// Where the truth is written, under topics that never become sources.
const TRUTH: &str = "/truth/track";

fn truth(from_s: f64, to_s: f64, rate_hz: f64) -> Sensor {
    Sensor { rate_hz, sigma: 0.0, ..Sensor::new(from_s, to_s, 9) }
}

/// The log of two sensors with this truth beside them, fused.
fn fused(truth: &Sensor) -> Trial {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(5.0, 13.0, 2));
    log.sensor(TRUTH, truth);
    let points = "[[characteristic_point]]\nname = \"half way\"\nz_m = -30.0\n";
    let trial = Trial::of(log.finish()).config(points);
    assert_eq!(trial.fuse(&[]).code, 0);
    trial
}

fn compare(trial: &Trial, args: &[&str]) -> Ran {
    trackfuse(trial.folder(), &[&["compare", "in.fused.mcap"], args].concat())
}

fn json(trial: &Trial, code: i32, args: &[&str]) -> Value {
    let ran = compare(trial, &[&["--json", "--quiet"], args].concat());
    assert_eq!(ran.code, code, "{ran:#?}");
    serde_json::from_str(&ran.stdout).unwrap()
}

#[test]
fn compare_finds_the_distance_that_the_closed_form_has() {
    let trial = fused(&truth(-1.0, 16.0, 90.0));
    let report = json(&trial, 0, &["--reference", TRUTH]);
    let output = super::trial::Output::read(&trial.path("in.fused.mcap"));
    let squares = output.track().iter().map(|w| {
        let (p, t) = (w.vector("position"), (w.log_time - EPOCH_NS) as f64 * 1e-9);
        (0..3).map(|i| (p[i] - position(t)[i]).powi(2)).sum::<f64>()
    });
    let rmse = (squares.sum::<f64>() / output.track().len() as f64).sqrt();
    let found = &report["all"]["position_m"];
    assert_eq!(found["count"], output.track().len());
    assert!((found["rmse"].as_f64().unwrap() - rmse).abs() < 1e-4, "{found} {rmse}");
    assert!(found["bands"]["inside"].as_f64().unwrap() > 0.8, "{found}");
    let phases: Vec<&str> =
        report["phases"].as_array().unwrap().iter().map(|p| p["phase"].as_str().unwrap()).collect();
    assert_eq!(phases, ["single", "overlap", "single", "extrapolated"]);
    let point = &report["characteristic_points"][0];
    assert!((point["reference"]["time_s"].as_f64().unwrap() - 7.5).abs() < 1e-3, "{point}");
    assert!(point["time_error"].as_f64().unwrap() < 0.01, "{point}");
    assert!(report["interpolated_position"]["error"].as_f64().unwrap() < 1e-4);
}

#[test]
fn compare_text_has_the_numbers_of_the_json() {
    let trial = fused(&truth(0.0, 15.0, 20.0));
    let report = json(&trial, 0, &["--reference", TRUTH, "--height", "deep=-50"]);
    let ran = compare(&trial, &["--reference", TRUTH, "--height", "deep=-50"]);
    let rmse = format!("{:.3}", report["all"]["position_m"]["rmse"].as_f64().unwrap());
    let jump = format!("{:.2} m/s2", report["acceleration_jump"]["jump_m_s2"].as_f64().unwrap());
    assert_says(&ran.stdout, &["overlap: tether + beacon", &rmse, &jump, "half way", "deep", "worst at"]);
}

#[test]
fn compare_takes_a_position_and_a_velocity_from_paths() {
    let trial = fused(&truth(-1.0, 16.0, 100.0));
    let of = |args: &[&str]| json(&trial, 0, args)["all"].clone();
    let whole = of(&["--reference", TRUTH]);
    let (position, velocity) = (format!("{TRUTH}.position"), format!("{TRUTH}.velocity"));
    assert_eq!(of(&["--reference", &velocity, "--reference", &position]), whole);
    assert!(of(&["--reference", &position])["velocity_m_s"].is_null());
}

#[test]
fn compare_of_frames_that_differ_and_of_a_source_is_done_with_a_warning() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    for (t, p, _) in truth(0.0, 8.0, 20.0).samples() {
        let ns = super::trial_log::ns(t);
        let message = serde_json::json!({"timestamp": stamp(ns), "frame_id": "tank", "position": xyz(p)});
        log.json(TRUTH, t, &message);
    }
    let trial = Trial::of(log.finish());
    assert_eq!(trial.fuse(&[]).code, 0);
    let other = compare(&trial, &["--reference", TRUTH]);
    assert_eq!(other.code, 3, "{other:#?}");
    assert_says(&other.stdout, &["frame \"enu\"", "\"tank\"", "mean nothing"]);
    let circular = compare(&trial, &["--reference", "/tether/track"]);
    assert_eq!(circular.code, 3, "{circular:#?}");
    assert_says(&circular.stdout, &["made of /tether/track", "proves nothing"]);
    for topic in ["/fused/track", "/tether/track"] {
        let of_itself = compare(&trial, &["--estimate", topic, "--reference", topic]);
        assert_eq!(of_itself.code, 3, "{of_itself:#?}");
        assert_says(&of_itself.stdout, &[&format!("the reference is {topic} itself"), "proves nothing"]);
    }
}

#[test]
fn compare_of_a_coarse_reference_says_that_it_is() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor { sigma: 1e-3, ..Sensor::new(0.0, 40.0, 1) });
    // slower than the track when it is thinned, so that the reference is interpolated
    log.sensor(TRUTH, &truth(0.0, 40.0, 0.25));
    let trial = Trial::of(log.finish()).config("[output]\nrate_hz = 0.2\n");
    trial.fuse(&[]);
    let ran = compare(&trial, &["--reference", TRUTH]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stderr, &["the reference is too coarse"]);
}

#[test]
fn compare_refuses_what_can_not_be_compared() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let twice = ["--reference", "/tether/track", "--reference", "/beacon/track.velocity"];
    let cases: [(&[&str], i32, &[&str]); 5] = [
        (&twice, 2, &["velocity of the reference is given twice", "/beacon/track.velocity"]),
        (&["--reference", "/nowhere"], 2, &["/nowhere", "it has:"]),
        (&["--reference", "/fused/log"], 2, &["/fused/log", "no position or velocity", "hint:"]),
        (&["--reference", "/tether/track", "--estimate", "/fused/nothing"], 2, &["/fused/nothing"]),
        (&[], 2, &["--reference"]),
    ];
    for (args, code, says) in cases {
        let ran = compare(&trial, args);
        assert_eq!(ran.code, code, "{args:?}: {ran:#?}");
        assert_says(&ran.stderr, says);
    }
    let late = fused(&truth(100.0, 110.0, 20.0));
    let ran = compare(&late, &["--reference", TRUTH]);
    assert_eq!(ran.code, 1, "{ran:#?}");
    assert_says(&ran.stderr, &["no instant in common", "100.00 to 110.00 s", "hint: `--reference-time log`"]);
}

/// `evo_ape tum` without alignment, over the same points, with the reference interpolated by numpy.
#[test]
fn compare_agrees_with_evo_on_the_position() {
    let Some(python) = std::env::var_os("TRACKFUSE_TEST_PYTHON") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_PYTHON is not set\n");
        return;
    };
    let trial = fused(&truth(-1.0, 16.0, 30.0));
    let report = json(&trial, 0, &["--reference", TRUTH]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/evo_agreement.py");
    let done = Command::new(python)
        .arg(script)
        .args(["in.fused.mcap", "/fused/track", TRUTH])
        .current_dir(trial.folder())
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let evo: f64 = String::from_utf8(done.stdout).unwrap().trim().parse().unwrap();
    let ours = report["all"]["position_m"]["rmse"].as_f64().unwrap();
    assert!(ours > 1e-3 && (ours - evo).abs() < 1e-6, "ours {ours}, evo's {evo}");
}
