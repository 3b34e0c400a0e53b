//! `trackfuse usbl` where what stands beside the fixes does not fit them.

use serde_json::{Value, json};

use super::trial::{Output, Trial, assert_says};
use super::trial_log::{TrialLog, ns, stamp, xyz};
use super::usbl::{Dive, SHIP, SIGMA, polar_log, run, xyz_message};

fn refused(log: impl AsRef<[u8]>, config: &str, words: &[&str]) {
    let ran = run(&Trial::of(log).config(config), &[]);
    assert_eq!(ran.code, 2, "{ran:#?}");
    assert_says(&ran.stderr, words);
}

fn cleaned(log: impl AsRef<[u8]>, config: &str) -> (Value, Output) {
    let trial = Trial::of(log).config(config);
    let ran = run(&trial, &["--json", "--quiet"]);
    assert!([0, 3].contains(&ran.code), "{ran:#?}");
    (serde_json::from_str(&ran.stdout).unwrap(), Output::read(&trial.path("in.usbl.mcap")))
}

/// The fixes with a depth every `step_s` until `to_s`, `later_s` late by its stamp.
fn with_depths(dive: &Dive, (step_s, to_s): (f64, f64), later_s: f64) -> Vec<u8> {
    let mut log = TrialLog::new();
    for i in 0..(to_s / step_s) as u32 {
        let t = f64::from(i) * step_s;
        let message = json!({"timestamp": stamp(ns(t + later_s)), "depth": -dive.position(t)[2]});
        log.json("/ctd", t, &message);
    }
    dive.fixes.iter().for_each(|fix| log.json("/usbl/fix", fix.sample.time_s, &xyz_message(fix)));
    log.finish()
}

fn depth() -> String {
    format!("{SIGMA}depth = \"/ctd.depth\"\n")
}

#[test]
fn a_depth_that_never_meets_a_fix_is_refused_and_one_that_rarely_does_is_told() {
    let dive = Dive::new(41);
    let words = ["none of the 7", "has a depth beside it", "depths from ", "hint: `time = \"log\"`"];
    refused(with_depths(&dive, (1.0, 3600.0), 3660.0), &depth(), &["different epochs", "depth", "hint: "]);
    refused(with_depths(&dive, (1.0, 3600.0), -3600.0), &depth(), &words);
    let (found, _) =
        cleaned(with_depths(&dive, (1.0, 3600.0), -3600.0), &format!("{}time = \"log\"\n", depth()));
    assert_eq!(found["depth"]["fixes"], found["source"]["positions"], "{found}");
    refused(with_depths(&dive, (12.0, 3600.0), 0.0), &depth(), &["none of the 7", "one every 12.0 s"]);
    let (found, _) = cleaned(with_depths(&dive, (1.0, 1800.0), 0.0), &depth());
    assert!(found["depth"]["fixes"].as_u64() < found["source"]["positions"].as_u64(), "{found}");
    assert_says(&found["warnings"].to_string(), &["fixes have no depths about them", "more than 10 s apart"]);
}

#[test]
fn a_ship_that_never_meets_a_fix_is_refused_with_both_spans_and_one_that_rarely_does_is_told() {
    let dive = Dive::new(42);
    let names = ["range", "bearing", "depression"];
    let config = format!("{SHIP}angles = \"rad\"\n");
    let log = |step_s: u32, later_s: f64| polar_log(&dive, names, 1.0, (step_s, later_s)).finish();
    let words = ["none of the 7", "position and heading", "fixes from", "headings from", "hint: "];
    refused(log(1, 7200.0), &config, &words);
    // the defaults, said by the user, are not assumed
    let config = "[usbl]\nship = \"/ship/navigation.position\"\nheading = \"/ship/navigation.heading\"\nangles = \"rad\"\n\
                  range_sigma_m = 0.5\nangle_sigma_deg = 0.3\nheading_sigma_deg = 0.3\n";
    let (found, _) = cleaned(log(12, 0.0), config);
    assert_eq!(found["source"]["position_sigma_from"], "config");
    assert_says(
        &found["warnings"].to_string(),
        &["are left out", "more than 10 s apart", "one every 12.0 s"],
    );
}

#[test]
fn what_is_wrong_with_the_ship_is_told() {
    let dive = Dive::new(43);
    let mut log = polar_log(&dive, ["range", "bearing", "depression"], 1.0, (1, 0.0));
    for t in 0..500 {
        let message = json!({"timestamp": stamp(ns(f64::from(t))), "position": null, "heading": 0.1});
        log.json("/ship/navigation", f64::from(t), &message);
    }
    let config = format!("{SHIP}angles = \"rad\"\n");
    let trial = Trial::of(log.finish()).config(&config);
    assert_says(&run(&trial, &[]).stderr, &["ship: 500 samples are left out"]);
    // stamps since the ship's computer was switched on
    let mut log = TrialLog::new();
    for t in 0..100_u32 {
        let message = json!({"timestamp": stamp(u64::from(t) * 1_000_000_000 + 1), "position": xyz([0.0; 3]), "heading": 0.1});
        log.json("/ship/navigation", f64::from(t), &message);
    }
    let message = json!({"timestamp": stamp(ns(1.0)), "range": 9.0, "bearing": 1.0, "depression": 1.0});
    log.json("/usbl/raw", 1.0, &message);
    refused(log.finish(), &config, &["the ship's clocks are of different epochs", "hint: `time = \"log\"`"]);
}

#[test]
fn a_headings_own_unit_holds_and_degrees_are_refused_as_radians() {
    let dive = Dive::new(44);
    let mut log = polar_log(&dive, ["range", "bearing_rad", "depression_rad"], 1.0, (1, 0.0));
    for t in 0..3600 {
        let heading = (-0.002 * f64::from(t)).rem_euclid(std::f64::consts::TAU);
        let message = json!({"timestamp": stamp(ns(f64::from(t))), "heading_rad": heading,
                             "course": 40.0 + heading});
        log.json("/gyro", f64::from(t), &message);
    }
    let log = log.finish();
    let config = |heading: &str, angles: &str| {
        let config = SHIP.replace("/ship/navigation.heading", heading);
        format!("{config}angles = \"{angles}\"\n")
    };
    let (_, output) = cleaned(&log, &config("/gyro.heading_rad", "deg"));
    let ([seen_m, _], _) = dive.held_against(&output.topics["/usbl/track"]);
    assert!(seen_m < 2.0, "{seen_m}");
    let words = ["\"heading\"", "beyond a turn", "in 3600 of 3600", "hint: ", "angles = \"deg\""];
    refused(&log, &config("/gyro.course", "rad"), &words);
}

/// The fixes as latitudes and longitudes with a height of `name`, m, `up_m` above the truth, and a depth a second.
fn places(dive: &Dive, name: &str, up_m: f64) -> Vec<u8> {
    use trackfuse::math::geodesy::{Geodetic, LocalFrame};
    let frame = LocalFrame::new(Geodetic::from_degrees([59.4, 10.5, 0.0]));
    let mut log = TrialLog::new();
    for t in 0..3600 {
        let depth = -dive.position(f64::from(t))[2];
        log.json("/ctd", f64::from(t), &json!({"timestamp": stamp(ns(f64::from(t))), "depth": depth}));
        let at = xyz([0.0, 0.0, -4.0]);
        log.json("/ship", f64::from(t), &json!({"timestamp": stamp(ns(f64::from(t))), "position": at}));
    }
    for fix in &dive.fixes {
        let [latitude, longitude, _] = frame.to_geodetic(fix.sample.value).to_degrees();
        let up = fix.sample.value[2] + up_m;
        let height = if name == "depth" { -up } else { up };
        let message = json!({"timestamp": stamp(ns(fix.sample.time_s)), "latitude": latitude, "longitude": longitude,
                             name: height});
        log.json("/usbl/fix", fix.sample.time_s, &message);
    }
    log.finish()
}

#[test]
fn altitudes_are_no_depths_and_a_depth_says_where_the_surface_is() {
    let dive = Dive::new(45);
    let log = places(&dive, "altitude", 45.0);
    let (found, output) = cleaned(&log, SIGMA);
    assert_says(&found["notes"].to_string(), &["heights are altitudes", "surface_at_zero"]);
    assert!(output.topics["/usbl/track"].iter().all(|p| p.value.get("depth").is_none()));
    refused(&log, &depth(), &["off the depth sensor's", "a median of 4", "hint: `origin = [59.4"]);
    let origin = "[output]\norigin = [59.4, 10.5, 45.0]\n";
    let (_, output) = cleaned(&log, &format!("{origin}{}", depth()));
    let ([seen_m, _], _) = dive.held_against(&output.topics["/usbl/track"]);
    assert!(seen_m < 2.2, "{seen_m}");
    assert!(output.topics["/usbl/track"].iter().all(|p| p.value.get("depth").is_some()));
}

#[test]
fn depths_count_from_the_surface_however_far_and_high_the_origin_is() {
    let log = places(&Dive::new(46), "depth", 0.0);
    for origin in ["[59.22, 10.5, 0.0]", "[59.4, 10.5, 35.0]"] {
        let ran =
            run(&Trial::of(&log).config(&format!("[output]\norigin = {origin}\n{}", depth())), &["--json"]);
        assert_eq!(ran.code, 0, "{ran:#?}");
        let found: Value = serde_json::from_str(&ran.stdout).unwrap();
        let (off, all) = (&found["fixes"]["off_depth"], &found["source"]["positions"]);
        assert!(off.as_u64().unwrap() < all.as_u64().unwrap() / 3, "{off} of {all}");
        assert_eq!(found["notes"].to_string().contains("20 km from `origin`"), origin.starts_with("[59.22"));
    }
}

#[test]
fn a_range_is_taken_in_one_frame_alone() {
    let log = places(&Dive::new(47), "depth", 0.0);
    let config = format!("{SIGMA}ship = \"/ship.position\"\nsigma_of_range = 0.005\n");
    refused(log, &config, &["in one frame", "the ship's positions are metres", "hint: "]);
}

#[test]
fn a_position_beside_a_range_and_bearings_is_the_fix() {
    let dive = Dive::new(48);
    let mut log = TrialLog::new();
    for fix in &dive.fixes {
        let [x, y, z] = fix.sample.value;
        let message = json!({"timestamp": stamp(ns(fix.sample.time_s)), "x": x, "y": y, "z": z,
                             "range": 900.0, "bearing": 1.0, "depression": 1.0});
        log.json("/usbl/raw", fix.sample.time_s, &message);
    }
    let (_, output) = cleaned(log.finish(), &format!("{SIGMA}fix = \"/usbl/raw\"\n"));
    let ([seen_m, _], _) = dive.held_against(&output.topics["/usbl/track"]);
    assert!(seen_m < 2.2, "{seen_m}");
}

#[test]
fn a_sensors_topic_below_the_prefix_of_a_run_stays_a_sensors() {
    let dive = Dive::new(49);
    let mut log = TrialLog::new();
    for fix in &dive.fixes {
        log.json("/nav/fixes", fix.sample.time_s, &xyz_message(fix));
        log.json("/nav/usbl", fix.sample.time_s, &xyz_message(fix));
    }
    let trial = Trial::of(log.finish()).config("[output]\nrate_hz = 1.0\n");
    let args = ["fuse", "in.mcap", "--config", "trial.toml", "--prefix", "/nav", "-o", "out.mcap", "--quiet"];
    let ran = super::trial::trackfuse(trial.folder(), &args);
    assert!([0, 3].contains(&ran.code), "{ran:#?}");
    let ran = super::trial::trackfuse(trial.folder(), &["inspect", "out.mcap", "--json"]);
    let found: Value = serde_json::from_str(&ran.stdout).unwrap();
    let said = |topic: &str| {
        let channels = found["channels"].as_array().unwrap();
        channels.iter().find(|c| c["topic"] == topic).unwrap().to_string()
    };
    assert!(!said("/nav/fixes").contains("written by trackfuse"), "{}", said("/nav/fixes"));
    assert!(said("/nav/pose").contains("written by trackfuse"), "{}", said("/nav/pose"));
}
