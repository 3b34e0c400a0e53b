//! `trackfuse simulate` of dives: what it prints, and that its logs are what the other commands take.

use std::fs;

use serde_json::Value;

use super::trial::{Trial, assert_says, trackfuse};

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sample_logs/usbl_dive.scenario.toml");

#[test]
fn a_dive_says_what_was_made_of_it() {
    let trial = Trial::of("not read");
    let ran = trackfuse(trial.folder(), &["simulate", SAMPLE, "-o", "made.mcap"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert_says(
        &ran.stdout,
        &["3600.00 s of truth", "ship 3601, depth 3601, reference 3601", "silence from "],
    );
    assert_says(&ran.stdout, &["down to ", " wild, ", " late, ", " repeated"]);
    let stored = fs::read(SAMPLE.replace("scenario.toml", "mcap")).unwrap();
    assert!(fs::read(trial.path("made.mcap")).unwrap() == stored, "the stored sample log differs");

    let ran = trackfuse(trial.folder(), &["simulate", SAMPLE, "-o", "made.mcap", "--force", "--json"]);
    let said: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(said["scenario"], "usbl_dive");
    assert_eq!(said["bytes"], stored.len().to_string());
    let number = |at: &str| said.pointer(at).unwrap().as_f64().unwrap();
    assert!((number("/duration_s") - 3600.0).abs() < 1e-9 && number("/deepest_m") > 400.0);
    assert!((number("/silence_s/1") - number("/silence_s/0") - 240.0).abs() < 1e-6);
    let messages = number("/fixes/total") + number("/fixes/repeated");
    assert!((number("/samples/usbl") - messages).abs() < 1e-9, "{said}");
    assert!((0.25..0.35).contains(&(number("/fixes/wild") / number("/fixes/total"))), "{said}");
}

#[test]
fn a_simulated_dive_is_cleaned_and_its_track_is_near_the_reference() {
    let trial = Trial::of(fs::read(SAMPLE.replace("scenario.toml", "mcap")).unwrap());
    fs::write(trial.path("dive.toml"), "[usbl]\nsigma_m = 3.0\ndepth = \"/vehicle/depth.depth\"\n").unwrap();
    let ran = trackfuse(trial.folder(), &["usbl", "in.mcap", "--config", "dive.toml", "--json"]);
    let cleaned: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(cleaned["source"]["positions"], 757, "{ran:#?}");
    assert!(cleaned["fixes"]["repeated"].as_u64() > Some(5), "{cleaned}");
    let args =
        ["compare", "in.usbl.mcap", "--estimate", "/usbl/track", "--reference", "/reference/ins", "--json"];
    let ran = trackfuse(trial.folder(), &args);
    let compared: Value = serde_json::from_str(&ran.stdout).unwrap();
    let rmse_m = |phase: usize| compared["phases"][phase]["position_m"]["rmse"].as_f64().unwrap();
    assert!(rmse_m(0) < 2.0 && rmse_m(1) < 15.0, "seen {} m, in the silence {} m", rmse_m(0), rmse_m(1));
}

#[test]
fn a_wrong_dive_is_refused_with_its_line_or_its_range() {
    let trial = Trial::of("not read");
    for (text, says) in [
        ("[dive]\nduration = 60.0\n", &["line 2", "`duration`", "`duration_s`"][..]),
        ("[dive]\nduration_s = 1e12\n", &["\"dive.duration_s\": got 1000000000000, expected 60 to 100000"]),
        ("[dive\n", &["line 1"]),
    ] {
        fs::write(trial.path("bad.toml"), text).unwrap();
        let ran = trackfuse(trial.folder(), &["simulate", "bad.toml", "-o", "other.mcap"]);
        assert_eq!(ran.code, 2, "{ran:#?}");
        assert_says(&ran.stderr, &[&["error: bad.toml: "], says].concat());
        assert!(!trial.path("other.mcap").exists());
    }
}
