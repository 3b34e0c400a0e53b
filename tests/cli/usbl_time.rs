//! `trackfuse usbl` where time is not what it should be, and where nobody says how good a fix is.

use serde_json::Value;
use trackfuse::sample::Sample;
use trackfuse::simulate::SimulatedFix;

use super::trial::{Output, Ran, Trial, assert_says};
use super::trial_log::{TrialLog, ns};
use super::usbl::{Dive, SIGMA, run, xyz_message};

fn cleaned(log: TrialLog, config: &str) -> (Ran, Value, Output) {
    let trial = Trial::of(log.finish()).config(config);
    let ran = run(&trial, &["--json", "--quiet"]);
    assert!([0, 3].contains(&ran.code), "{ran:#?}");
    let found = serde_json::from_str(&ran.stdout).unwrap();
    (ran, found, Output::read(&trial.path("in.usbl.mcap")))
}

fn write(log: &mut TrialLog, fix: &SimulatedFix, stamp_s: f64, arrives_s: f64) {
    let sample = Sample { time_s: stamp_s, ..fix.sample };
    log.json("/usbl/fix", arrives_s, &xyz_message(&SimulatedFix { sample, ..*fix }));
}

fn warnings(found: &Value) -> String {
    found["warnings"].to_string()
}

#[test]
fn two_dives_in_one_log_are_two_tracks_with_nothing_between() {
    const LATER_S: f64 = 3.0 * 86_400.0;
    let (first, second) = (Dive::new(31), Dive::new(32));
    let mut log = TrialLog::new();
    for (dive, later_s) in [(&first, 0.0), (&second, LATER_S)] {
        dive.fixes
            .iter()
            .for_each(|f| write(&mut log, f, f.sample.time_s + later_s, f.sample.time_s + later_s));
    }
    let (ran, found, output) = cleaned(log, SIGMA);
    assert_eq!(ran.code, 0, "{ran:#?}");
    for topic in ["/usbl/track", "/usbl/prediction"] {
        let track = &output.topics[topic];
        assert!((6500..7400).contains(&track.len()), "{topic}: {}", track.len());
        let hour = ns(3700.0) as i64;
        assert!(track.iter().all(|p| p.timestamp_ns() < hour || p.timestamp_ns() > ns(LATER_S) as i64));
    }
    let early: Vec<_> = output.topics["/usbl/track"].iter().take(3500).cloned().collect();
    let ([seen_m, _], _) = first.held_against(&early);
    assert!(seen_m < 2.2, "{seen_m}");
    assert!(found["prediction"]["silent_rmse_m"].as_f64().unwrap() < 150.0);
}

#[test]
fn a_fix_with_a_stray_stamp_is_left_out_and_named_and_leaves_the_rest_as_it_was() {
    let dive = Dive::new(33);
    let log = |stray_s: Option<f64>| {
        let mut log = TrialLog::new();
        for (i, fix) in dive.fixes.iter().enumerate() {
            let time_s = fix.sample.time_s;
            write(&mut log, fix, stray_s.filter(|_| i == 300).unwrap_or(time_s), time_s);
        }
        cleaned(log, SIGMA)
    };
    let (_, _, plain) = log(None);
    for stray_s in [86_400.0, -1.7e9] {
        let (ran, found, output) = log(Some(stray_s));
        assert_eq!(ran.code, 3, "{ran:#?}");
        assert_says(&warnings(&found), &["1 of 7", "long silence parts them"]);
        let track = &output.topics["/usbl/track"];
        assert!(track.len().abs_diff(plain.topics["/usbl/track"].len()) < 20, "{}", track.len());
        let ([seen_m, _], _) = dive.held_against(track);
        assert!(seen_m < 2.2, "{seen_m}");
        let strays = output.topics["/usbl/fixes"].iter().filter(|f| f.value["reason"] == "stray").count();
        assert_eq!(strays, 1);
        assert_eq!(found["fixes"]["late"], 0, "a stamp of tomorrow makes nothing late");
        let before = plain.topics["/usbl/prediction"].len();
        assert!(output.topics["/usbl/prediction"].len().abs_diff(before) < 60);
    }
}

#[test]
fn a_clock_that_was_set_back_is_asked_about_and_late_fixes_are_only_counted() {
    let dive = Dive::new(34);
    let log = |back_s: f64, late: &dyn Fn(usize) -> f64| {
        let mut log = TrialLog::new();
        let mut order: Vec<(f64, usize)> =
            dive.fixes.iter().enumerate().map(|(i, f)| (f.sample.time_s + late(i), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (arrives_s, i) in order {
            let time_s = dive.fixes[i].sample.time_s;
            write(
                &mut log,
                &dive.fixes[i],
                if time_s > 2400.0 { time_s - back_s } else { time_s },
                arrives_s,
            );
        }
        cleaned(log, SIGMA).1
    };
    let set_back = log(600.0, &|_| 0.0);
    assert_says(&warnings(&set_back), &["by up to 5", "was a clock set back?"]);
    let late = log(0.0, &|i| if i % 40 == 7 { 25.0 } else { 0.0 });
    assert!(late["fixes"]["late"].as_u64().unwrap() > 10, "{late}");
    assert!(!warnings(&late).contains("came after"), "{late}");
}

#[test]
fn a_stream_of_ten_fixes_a_second_is_predicted_too() {
    let dive = Dive::new(35);
    let mut log = TrialLog::new();
    for i in 0..6000_u32 {
        let time_s = 100.0 + f64::from(i) / 10.0;
        let noise = |k: u32| (f64::from(i * 3 + k) * 12.9898).sin() * 2.0;
        let mut value = dive.position(time_s);
        (0..3).for_each(|k| value[k as usize] += noise(k));
        let fix = SimulatedFix { sample: Sample { time_s, value, sigma: [1.4; 3] }, wild: false };
        write(&mut log, &fix, time_s, time_s);
    }
    let (_, found, output) = cleaned(log, "[usbl]\nsigma_m = 1.4\n");
    assert!(output.topics["/usbl/prediction"].len() > 550, "{found}");
    assert!(found["prediction"]["rmse_m"].as_f64().unwrap() < 3.0, "{found}");
}

#[test]
fn without_a_stated_sigma_the_noise_is_found_and_nothing_is_worse_for_it() {
    let dive = Dive::new(36);
    let log = || {
        let mut log = TrialLog::new();
        dive.fixes.iter().for_each(|f| write(&mut log, f, f.sample.time_s, f.sample.time_s));
        log
    };
    let (_, found, output) = cleaned(log(), "");
    let (_, _, stated) = cleaned(log(), SIGMA);
    assert_eq!(found["source"]["position_sigma_from"], "estimated");
    let sigma = |message: &super::trial::Written| message.vector("position_sigma");
    let middle = sigma(&output.topics["/usbl/fixes"][300]);
    assert!(middle.iter().all(|s| (s - 3.0).abs() < 0.4), "{middle:?}");
    for topic in ["/usbl/track", "/usbl/prediction"] {
        let ([seen_m, _], covered) = dive.held_against(&output.topics[topic]);
        let ([as_stated_m, _], _) = dive.held_against(&stated.topics[topic]);
        assert!(seen_m < 1.1 * as_stated_m + 0.1, "{topic}: {seen_m} {as_stated_m}");
        assert!(covered > 0.85, "{topic}: {covered}");
    }
}
