//! `trackfuse usbl` on dives whose truth is known.

use std::f64::consts::TAU;
use std::fs;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};
use trackfuse::sample::Sample;
use trackfuse::simulate::{DiveConstants, SimulatedFix, Trajectory, UsblConstants, dive, watch_by_usbl};

use super::trial::{Output, Ran, Trial, assert_says, trackfuse};
use super::trial_log::{TrialLog, ns, stamp, xyz};

pub(super) struct Dive {
    pub(super) truth: Trajectory,
    pub(super) fixes: Vec<SimulatedFix>,
    pub(super) silence_s: [f64; 2],
}

impl Dive {
    /// An hour with 30 % wild fixes and four minutes of silence.
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let truth = dive(&DiveConstants::default(), &mut rng);
        let watched = UsblConstants { wild_fixes: 0.3, ..UsblConstants::default() };
        let record = watch_by_usbl(&truth, 3600.0, &watched, &mut rng);
        Self { truth, fixes: record.fixes, silence_s: record.silence_s.unwrap() }
    }

    pub(super) fn position(&self, time_s: f64) -> [f64; 3] {
        self.truth.at(time_s).position.into()
    }

    pub(super) fn log(&self, message: impl Fn(&SimulatedFix) -> Value) -> Vec<u8> {
        let mut log = TrialLog::new();
        self.fixes.iter().for_each(|fix| log.json("/usbl/fix", fix.sample.time_s, &message(fix)));
        log.finish()
    }

    /// Root mean square 3-D distance of a track from the truth, seen and in the silence, and the share of single axes
    /// whose 95 % band holds it.
    pub(super) fn held_against(&self, track: &[super::trial::Written]) -> ([f64; 2], f64) {
        let (mut sums, mut held, mut axes) = ([(0.0, 0.0); 2], 0, 0);
        for point in track {
            let t = (point.timestamp_ns() - ns(0.0) as i64) as f64 * 1e-9;
            let (p, truth) = (point.vector("position"), self.position(t));
            let silent = usize::from(t > self.silence_s[0] && t < self.silence_s[1]);
            sums[silent].0 += (0..3).map(|i| (p[i] - truth[i]).powi(2)).sum::<f64>();
            sums[silent].1 += 1.0;
            if point.value.get("position_lower").is_some() {
                let (low, high) = (point.vector("position_lower"), point.vector("position_upper"));
                held += (0..3).filter(|&i| (low[i]..=high[i]).contains(&truth[i])).count();
                axes += 3;
            }
        }
        (sums.map(|(sum, count): (f64, f64)| (sum / count).sqrt()), held as f64 / f64::from(axes))
    }
}

pub(super) fn xyz_message(fix: &SimulatedFix) -> Value {
    json!({"timestamp": stamp(ns(fix.sample.time_s)), "frame_id": "enu", "position": xyz(fix.sample.value)})
}

pub(super) fn run(trial: &Trial, args: &[&str]) -> Ran {
    let config: &[&str] = if trial.path("trial.toml").exists() { &["--config", "trial.toml"] } else { &[] };
    trackfuse(trial.folder(), &[&["usbl", "in.mcap"], config, args].concat())
}

fn report(trial: &Trial, code: i32) -> (Value, Output) {
    let ran = run(trial, &["--json", "--quiet", "--force"]);
    assert_eq!(ran.code, code, "{ran:#?}");
    crate::viewer_rules::assert_shown(&trial.path("in.usbl.mcap"));
    (serde_json::from_str(&ran.stdout).unwrap(), Output::read(&trial.path("in.usbl.mcap")))
}

pub(super) const SIGMA: &str = "[usbl]\nsigma_m = 3.0\n";

#[test]
fn a_dive_becomes_a_track_with_honest_bands_and_every_wild_fix_is_flagged() {
    let dive = Dive::new(11);
    let (report, output) = report(&Trial::of(dive.log(xyz_message)).config(SIGMA), 0);
    let ([seen_m, silent_m], covered) = dive.held_against(&output.topics["/usbl/track"]);
    assert!(seen_m < 2.2 && silent_m < 30.0, "{seen_m} {silent_m}");
    assert!((0.88..=1.0).contains(&covered), "{covered}");
    let said = &output.topics["/usbl/fixes"];
    assert_eq!(said.len(), dive.fixes.len());
    let (mut missed, mut false_alarms, mut wild) = (0, 0, 0);
    for (message, fix) in said.iter().zip(&dive.fixes) {
        let is_wild = message.value["verdict"] == "wild";
        wild += usize::from(fix.wild);
        missed += usize::from(fix.wild && !is_wild);
        false_alarms += usize::from(!fix.wild && is_wild);
        assert!(message.value["position_residual"]["x"].is_number());
    }
    assert!(wild > 150 && missed <= wild / 50, "{missed} of {wild}");
    assert!(false_alarms < dive.fixes.len() / 50, "{false_alarms}");
    let counted = report["fixes"]["off_by_itself"].as_u64().unwrap()
        + report["fixes"]["off_as_cycle"].as_u64().unwrap();
    assert_eq!(counted as usize, wild - missed + false_alarms);
    let phases: Vec<&str> =
        report["phases"].as_array().unwrap().iter().map(|p| p["phase"].as_str().unwrap()).collect();
    assert_eq!(phases, ["single", "bridged"]);
}

#[test]
fn the_prediction_knows_the_past_alone_and_the_papers_has_no_sigma() {
    let dive = Dive::new(12);
    let (_, output) = report(&Trial::of(dive.log(xyz_message)).config(SIGMA), 0);
    let prediction = &output.topics["/usbl/prediction"];
    let ([seen_m, _], _) = dive.held_against(prediction);
    assert!(seen_m < 25.0, "{seen_m}");
    assert!(prediction.iter().all(|p| p.value["method"] == "usbl-causal"));
    // what comes after an instant changes nothing that was said at it
    let early =
        Dive { fixes: dive.fixes.iter().filter(|f| f.sample.time_s < 1800.0).copied().collect(), ..dive };
    let config = format!("{SIGMA}cycle_s = 20.0\n");
    let trial = Trial::of(early.log(xyz_message)).config(&config);
    let (_, half) = report(&trial, 0);
    let at = |output: &Output, i: usize| output.topics["/usbl/prediction"][i].vector("position");
    for i in [100, 700, 1500] {
        let (whole, half) = (at(&output, i), at(&half, i));
        assert!((0..3).all(|a| (whole[a] - half[a]).abs() < 0.5), "{i}: {whole:?} {half:?}");
    }
    let paper = Trial::of(early.log(xyz_message)).config(&format!("{config}prediction = \"paper\"\n"));
    let (_, output) = report(&paper, 0);
    let paper = &output.topics["/usbl/prediction"];
    assert!(!paper.is_empty() && paper.iter().all(|p| p.value.get("position_sigma").is_none()));
}

#[test]
fn late_and_repeated_messages_change_nothing_but_their_marks() {
    let dive = Dive::new(13);
    let (_, plain) = report(&Trial::of(dive.log(xyz_message)).config(SIGMA), 0);
    // every 50th arrives a quarter of a minute late, every 60th twice; a recorder writes what comes as it comes
    let is_late = |i: usize| i % 50 == 9;
    let arrives_s =
        |(i, fix): (usize, &SimulatedFix)| fix.sample.time_s + if is_late(i) { 15.0 } else { 0.0 };
    let mut coming: Vec<(f64, usize)> =
        dive.fixes.iter().enumerate().map(|(i, fix)| (arrives_s((i, fix)), i)).collect();
    coming.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut log, mut newest_s, mut late) = (TrialLog::new(), f64::NEG_INFINITY, Vec::new());
    for (time_s, i) in coming {
        let stamp_s = dive.fixes[i].sample.time_s;
        if stamp_s < newest_s {
            late.push(ns(stamp_s) as i64);
        }
        newest_s = newest_s.max(stamp_s);
        for _ in 0..=usize::from(i % 60 == 0) {
            log.json("/usbl/fix", time_s, &xyz_message(&dive.fixes[i]));
        }
    }
    assert!(late.len() > 5);
    let trial = Trial::of(log.finish()).config(SIGMA);
    let ran = run(&trial, &["--json", "--quiet"]);
    let found: Value = serde_json::from_str(&ran.stdout).unwrap();
    let n = dive.fixes.len();
    assert_eq!(found["fixes"]["repeated"], n.div_ceil(60), "{ran:#?}");
    assert_eq!(found["fixes"]["late"], late.len(), "{ran:#?}");
    let output = Output::read(&trial.path("in.usbl.mcap"));
    let position = |output: &Output| output.topics["/usbl/track"][1000].vector("position");
    let (a, b) = (position(&plain), position(&output));
    assert!((0..3).all(|i| (a[i] - b[i]).abs() < 0.01), "{a:?} {b:?}");
    let said = &output.topics["/usbl/fixes"];
    let marked = said.iter().filter(|m| m.value["verdict"] == "duplicate").count();
    assert_eq!(marked, n.div_ceil(60));
    let came_late = said.iter().filter(|m| m.value["late"] == true);
    let mut came_late: Vec<i64> = came_late.map(super::trial::Written::timestamp_ns).collect();
    came_late.sort_unstable();
    late.sort_unstable();
    assert_eq!(came_late, late);
}

#[test]
fn latitudes_longitudes_and_depths_are_fixes_too_and_a_depth_channel_helps() {
    use trackfuse::math::geodesy::{Geodetic, LocalFrame};
    let dive = Dive::new(14);
    let frame = LocalFrame::new(Geodetic::from_degrees([59.4, 10.5, 0.0]));
    let mut log = TrialLog::new();
    for t in 0..3600 {
        let depth = -dive.position(f64::from(t))[2];
        log.json("/ctd", f64::from(t), &json!({"timestamp": stamp(ns(f64::from(t))), "depth": depth}));
    }
    for fix in &dive.fixes {
        let [latitude, longitude, altitude] = frame.to_geodetic(fix.sample.value).to_degrees();
        let message = json!({"timestamp": stamp(ns(fix.sample.time_s)), "latitude": latitude, "longitude": longitude,
                             "depth": -altitude});
        log.json("/usbl/fix", fix.sample.time_s, &message);
    }
    let config =
        format!("[output]\norigin = [59.4, 10.5, 0.0]\n{SIGMA}depth = \"/ctd.depth\"\ndepth_sigma_m = 0.5\n");
    let trial = Trial::of(log.finish()).config(&config);
    let (found, output) = report(&trial, 0);
    let ([seen_m, _], _) = dive.held_against(&output.topics["/usbl/track"]);
    assert!(seen_m < 2.0, "{seen_m}");
    let mid = dive.silence_s[0] + 120.0;
    let near = output.topics["/usbl/track"]
        .iter()
        .min_by_key(|p| (p.timestamp_ns() - ns(mid) as i64).abs())
        .unwrap();
    assert!((near.vector("position")[2] - dive.position(mid)[2]).abs() < 2.0, "the depth goes on in silence");
    assert!(found["fixes"]["off_depth"].as_u64().unwrap() > 50);
    assert!(output.topics.contains_key("/usbl/track_fix") && output.topics.contains_key("/usbl/geojson"));
    // without an origin z = 0 is the surface all the same
    let trial = trial.config(SIGMA);
    let (found, _) = report(&trial, 0);
    assert_eq!(found["track"]["origin"][2], 0.0);
}

/// The ship circles over the dive, and its system measures range, bearing and depression of every fix's place, each
/// with noise; `names` are the fields' names and the factor from radians. The ship is known every so many seconds, so
/// much later.
pub(super) fn polar_log(
    dive: &Dive,
    names: [&str; 3],
    per_radian: f64,
    (step_s, later_s): (u32, f64),
) -> TrialLog {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let ship = |t: f64| {
        let angle = 0.002 * t;
        ([150.0 * angle.cos(), 150.0 * angle.sin(), -4.0], (-angle).rem_euclid(TAU))
    };
    let mut log = TrialLog::new();
    for t in (0..3600).step_by(step_s as usize).map(f64::from) {
        let (p, heading) = ship(t);
        let message =
            json!({"timestamp": stamp(ns(t + later_s)), "position": xyz(p), "heading": heading * per_radian});
        log.json("/ship/navigation", t + later_s, &message);
    }
    for fix in &dive.fixes {
        let t = fix.sample.time_s;
        let (from, heading) = ship(t);
        let place = if fix.wild { fix.sample.value } else { dive.position(t) };
        let [east, north, up] = [0, 1, 2].map(|i| place[i] - from[i]);
        let range = (east * east + north * north + up * up).sqrt() + 0.4 * normal();
        let noise = 0.003;
        let bearing = (east.atan2(north) - heading + noise * normal()).rem_euclid(TAU);
        let depression = (-up).atan2(east.hypot(north)) + noise * normal();
        let message = json!({"timestamp": stamp(ns(t)), names[0]: range, names[1]: bearing * per_radian,
                             names[2]: depression * per_radian});
        log.json("/usbl/raw", t, &message);
    }
    log
}

pub(super) const SHIP: &str = "[usbl]\nship = \"/ship/navigation.position\"\nheading = \"/ship/navigation.heading\"\n\
                    range_sigma_m = 0.4\nangle_sigma_deg = 0.17\nheading_sigma_deg = 0.01\nship_sigma_m = 0.1\n";

#[test]
fn ranges_bearings_and_depressions_are_fixes_with_the_ships_position_and_heading() {
    let dive = Dive::new(20);
    let in_degrees = polar_log(&dive, ["range", "bearing", "depression"], 360.0 / TAU, (1, 0.0)).finish();
    let trial = Trial::of(&in_degrees).config(&format!("{SHIP}angles = \"deg\"\n"));
    let (found, output) = report(&trial, 0);
    assert_eq!(found["source"]["position"], "/usbl/raw");
    assert_eq!(found["source"]["position_sigma_from"], "config");
    let track = &output.topics["/usbl/track"];
    let ([seen_m, silent_m], covered) = dive.held_against(track);
    assert!(seen_m < 2.0 && silent_m < 30.0, "{seen_m} {silent_m}");
    assert!((0.88..=1.0).contains(&covered), "{covered}");
    // the same in radians, which the names say
    let named = polar_log(&dive, ["slant_range", "azimuth_rad", "depression_rad"], 1.0, (1, 0.0)).finish();
    let named = Trial::of(named).config(&format!("{SHIP}angles = \"rad\"\n"));
    let (_, other) = report(&named, 0);
    let apart = |i: usize| {
        let (a, b) = (track[i].vector("position"), other.topics["/usbl/track"][i].vector("position"));
        (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    assert!(apart(500) < 1e-6 && apart(3000) < 1e-6);
    // what is missing is asked for by name
    let refused = |config: &str, words: &[&str]| {
        let ran = run(&Trial::of(&in_degrees).config(config), &[]);
        assert_eq!(ran.code, 2, "{ran:#?}");
        assert_says(&ran.stderr, words);
    };
    refused("[usbl]\nangles = \"deg\"\n", &["ship's position and heading", "hint: ", "ship = "]);
    refused(SHIP, &["may be degrees or radians", "hint: ", "angles = "]);
    refused(&format!("{SHIP}angles = \"rad\"\n"), &["beyond a turn", "hint: ", "angles = "]);
    let ran = run(&Trial::of(&in_degrees), &[]);
    assert_says(&ran.stderr, &["ship"]);
}

#[test]
fn noise_that_grows_with_the_range_widens_the_bands_where_the_vehicle_is_far() {
    let dive = Dive::new(21);
    let mut log = TrialLog::new();
    for t in 0..3600 {
        let message = json!({"timestamp": stamp(ns(f64::from(t))), "position": xyz([0.0, 0.0, -4.0])});
        log.json("/ship/navigation", f64::from(t), &message);
    }
    for fix in &dive.fixes {
        let (t, value) = (fix.sample.time_s, fix.sample.value);
        let place = dive.position(t);
        let range = place.iter().map(|p| p * p).sum::<f64>().sqrt();
        let noise = if fix.wild { 1.0 } else { 1.0_f64.hypot(0.005 * range) / 3.0 };
        let sample =
            Sample { value: [0, 1, 2].map(|i| place[i] + noise * (value[i] - place[i])), ..fix.sample };
        log.json("/usbl/fix", t, &xyz_message(&SimulatedFix { sample, ..*fix }));
    }
    let ship = "[usbl]\nsigma_m = 1.0\nship = \"/ship/navigation.position\"\nsigma_of_range = 0.005\n";
    let (found, output) = report(&Trial::of(log.finish()).config(ship), 0);
    let said = &output.topics["/usbl/fixes"];
    let sigma = |i: usize| said[i].vector("position_sigma")[0];
    assert!(
        (sigma(2) - 1.0).abs() < 0.1 && sigma(said.len() / 2) > 2.0,
        "{} {}",
        sigma(2),
        sigma(said.len() / 2)
    );
    assert!(
        (found["track"]["noise_scale"][0].as_f64().unwrap() - 1.0).abs() < 0.15,
        "the noise is as stated"
    );
    let (_, covered) = dive.held_against(&output.topics["/usbl/track"]);
    assert!((0.88..=1.0).contains(&covered), "{covered}");
}

#[test]
fn what_is_written_leads_back_compares_exports_and_is_never_fused_again() {
    let dive = Dive::new(15);
    let trial = Trial::of(dive.log(xyz_message)).config(SIGMA);
    let before = fs::read(trial.path("in.mcap")).unwrap();
    assert_eq!(run(&trial, &["--report", "page.html", "--quiet"]).code, 0);
    assert!(
        fs::read_to_string(trial.path("page.html")).unwrap().contains("thrown out with their whole exchange")
    );
    let args = [
        "compare",
        "in.usbl.mcap",
        "--estimate",
        "/usbl/prediction",
        "--reference",
        "/usbl/track",
        "--quiet",
    ];
    let compared = trackfuse(trial.folder(), &args);
    assert_eq!(compared.code, 0, "{compared:#?}");
    let exported = trackfuse(trial.folder(), &["export", "in.usbl.mcap"]);
    assert_eq!(exported.code, 0, "{exported:#?}");
    assert!(exported.stdout.lines().count() > 3000 && exported.stdout.contains(",bridged,usbl"));
    let again = trackfuse(trial.folder(), &["usbl", "in.usbl.mcap", "-o", "again.mcap"]);
    assert_eq!(again.code, 2, "{again:#?}");
    let restored = trackfuse(trial.folder(), &["restore", "in.usbl.mcap", "-o", "back.mcap"]);
    assert_eq!(restored.code, 0, "{restored:#?}");
    assert!(fs::read(trial.path("back.mcap")).unwrap() == before);
    let first = fs::read(trial.path("in.usbl.mcap")).unwrap();
    assert_eq!(run(&trial, &["--force", "--quiet"]).code, 0);
    assert!(fs::read(trial.path("in.usbl.mcap")).unwrap() == first, "the same bytes each time");
}

#[test]
fn a_log_without_fixes_or_with_two_systems_says_how_to_name_them() {
    let dive = Dive::new(16);
    let mut log = TrialLog::new();
    log.json("/nav/fix", 0.0, &xyz_message(&dive.fixes[0]));
    let ran = run(&Trial::of(log.finish()), &[]);
    assert_eq!(ran.code, 2, "{ran:#?}");
    assert_says(
        &ran.stderr,
        &["no topic with a position has `usbl` in its name", "fix = \"/nav/fix.position\""],
    );
    let mut log = TrialLog::new();
    for topic in ["/usbl1/fix", "/usbl2/fix"] {
        dive.fixes.iter().for_each(|fix| log.json(topic, fix.sample.time_s, &xyz_message(fix)));
    }
    let log = log.finish();
    let ran = run(&Trial::of(&log), &[]);
    assert_eq!(ran.code, 2, "{ran:#?}");
    assert_says(&ran.stderr, &["several topics", "/usbl1/fix", "/usbl2/fix", "hint: "]);
    let named = Trial::of(&log).config(&format!("{SIGMA}fix = \"/usbl2/fix.position\"\n"));
    assert_eq!(report(&named, 0).0["source"]["position"], "/usbl2/fix.position");
    let wrong = Trial::of(&log)
        .config(&format!("{SIGMA}fix = \"/usbl2/fix.position\"\ndepth = \"/usbl1/fix.position\"\n"));
    assert_says(&run(&wrong, &[]).stderr, &["depth", "no finite number"]);
}

#[test]
fn a_dive_that_is_mostly_wild_ends_with_a_warning() {
    let mut dive = Dive::new(17);
    for fix in dive.fixes.iter_mut().filter(|f| ((f.sample.time_s / 20.0) as usize).is_multiple_of(2)) {
        let far = 40.0 + fix.sample.time_s % 37.0 + 5.0 * (fix.sample.time_s / 20.0).floor() % 90.0;
        fix.sample.value[0] += far;
    }
    let trial = Trial::of(dive.log(xyz_message)).config(SIGMA);
    let ran = run(&trial, &[]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stderr, &["warning: "]);
}

#[test]
fn every_encoding_says_the_same_of_a_fix() {
    let dive = Dive::new(18);
    let log = dive.log(xyz_message);
    let verdicts = |encoding: &str| {
        let config = format!("[output]\nencoding = \"{encoding}\"\n{SIGMA}");
        let (_, output) = report(&Trial::of(&log).config(&config), 0);
        let said = |m: &super::trial::Written| (m.value["verdict"].clone(), m.value["exchange"].clone());
        output.topics["/usbl/fixes"].iter().map(said).collect::<Vec<_>>()
    };
    let json = verdicts("json");
    assert!(json.len() > 700);
    assert_eq!(verdicts("protobuf"), json);
    assert_eq!(verdicts("cdr"), json);
}
