//! Dives as logs: what stands in them against the truth, and what of a scenario is refused.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::io::Cursor;

use nalgebra::Matrix3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::estimate::usbl::geometry::{Polar, Ship, above_level, position};
use crate::simulate::ScenarioFile;
use crate::simulate::dive::scenario::{MessagesScenario, ShipScenario};
use crate::simulate::dive::ship::seen_from;

/// A dive of 20 min whose fixes are all good; `text` adds to it.
fn scenario(text: &str) -> DiveScenario {
    let mut scenario = DiveScenario::from_toml(text).unwrap();
    scenario.dive.duration_s = 1200.0;
    (scenario.usbl.silence_s, scenario.usbl.cycle_s) = (0.0, 5.0);
    scenario.usbl.spacing_s = 0.25;
    scenario
}

const POLAR: &str =
    "seed = 4\n[dive]\n[messages]\nfixes_as = \"polar\"\nrange_sigma_m = 2.0\nangle_sigma_deg = 0.5";
const GEODETIC: &str =
    "seed = 4\norigin = [-33.9, 18.4]\n[dive]\n[messages]\nfixes_as = \"geodetic\"\n[usbl]\nsigma_m = 0.0";

fn log_of(scenario: &DiveScenario) -> (Vec<u8>, SimulatedDive) {
    let mut log = Cursor::new(Vec::new());
    let dive = write_dive_log(scenario, &mut log).unwrap();
    (log.into_inner(), dive)
}

/// A message: when it stands in the log and when it was stamped, s after release, and what it says.
struct Read {
    log_s: f64,
    stamp_s: f64,
    said: Value,
}

impl Read {
    fn number(&self, key: &str) -> f64 {
        self.said[key].as_f64().unwrap()
    }

    fn position(&self) -> Vector3<f64> {
        Vector3::from(["x", "y", "z"].map(|axis| self.said["position"][axis].as_f64().unwrap()))
    }
}

fn read(log: &[u8]) -> BTreeMap<String, Vec<Read>> {
    let release_ns = DiveScenario::default().epoch_ns;
    let mut topics = BTreeMap::<String, Vec<Read>>::new();
    for message in mcap::MessageStream::new(log).unwrap() {
        let message = message.unwrap();
        let said: Value = serde_json::from_slice(&message.data).unwrap();
        let [sec, nsec] = ["sec", "nsec"].map(|key| said["timestamp"][key].as_i64().unwrap());
        assert_eq!((sec * 1_000_000_000 + nsec) as u64, message.publish_time);
        let since = |ns: i64| (ns - release_ns) as f64 * 1e-9;
        let read =
            Read { log_s: since(message.log_time as i64), stamp_s: since(message.publish_time as i64), said };
        topics.entry(message.channel.topic.clone()).or_default().push(read);
    }
    topics
}

fn rms<'a>(errors: impl IntoIterator<Item = &'a Vector3<f64>>) -> f64 {
    let squares: Vec<f64> = errors.into_iter().map(Vector3::norm_squared).collect();
    (squares.iter().sum::<f64>() / (3.0 * squares.len() as f64)).sqrt()
}

#[test]
fn the_same_seed_makes_the_same_bytes_and_another_seed_makes_others() {
    let scenario = scenario("seed = 3\n[dive]\n[messages]\nlate_share = 0.1");
    let (bytes, _) = log_of(&scenario);
    assert_eq!(bytes, log_of(&scenario).0);
    assert_ne!(bytes, log_of(&DiveScenario { seed: 4, ..scenario }).0);
}

#[test]
fn a_log_holds_the_scenario_that_made_it_and_the_truth_that_it_would_not_know() {
    let mut scenario = scenario("[dive]\n[usbl]\nwild_fixes = 0.2");
    scenario.usbl.silence_s = 100.0;
    let (bytes, dive) = log_of(&scenario);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let index = summary.attachment_indexes.iter().find(|index| index.name == "scenario.toml").unwrap();
    let attachment = mcap::read::attachment(&bytes, index).unwrap();
    let text = std::str::from_utf8(&attachment.data).unwrap();
    assert_eq!(ScenarioFile::from_toml(text).unwrap(), ScenarioFile::Dive(Box::new(scenario)));
    let index = summary.metadata_indexes.iter().find(|index| index.name == "simulation").unwrap();
    let truth = mcap::read::metadata(&bytes, index).unwrap().metadata;
    let [begin_s, end_s] = ["silence_begin_s", "silence_end_s"].map(|key| truth[key].parse::<f64>().unwrap());
    assert!((end_s - begin_s - 100.0).abs() < 1e-6, "{truth:?}");
    assert!(dive.messages.iter().all(|m| m.stamp_s < begin_s || m.stamp_s > end_s));
    assert_eq!(truth["wild_fixes"], dive.record.fixes.iter().filter(|fix| fix.wild).count().to_string());
    assert_eq!(truth["seed"], "1");
}

#[test]
fn fixes_depths_and_the_ship_have_the_noise_asked_for_and_the_reference_none() {
    let scenario = scenario("seed = 2\n[dive]\n[usbl]\nsigma_m = 3.0\n[ship]\nheading_sigma_deg = 2.0");
    let (bytes, dive) = log_of(&scenario);
    let topics = read(&bytes);
    let named: Vec<&str> = topics.keys().map(String::as_str).collect();
    assert_eq!(named, ["/reference/ins", "/ship/navigation", "/usbl/fix", "/vehicle/depth"]);
    let truth = |message: &Read| dive.trajectory.at(message.stamp_s).position;
    let off = |topic: &str| topics[topic].iter().map(|m| m.position() - truth(m)).collect::<Vec<_>>();
    let (fixes, reference) = (off("/usbl/fix"), off("/reference/ins"));
    assert!(fixes.len() > 900 && (rms(&fixes) - 3.0).abs() < 0.15, "{} {}", fixes.len(), rms(&fixes));
    assert!(reference.len() == 1201 && rms(&reference) < 1e-6, "{} {}", reference.len(), rms(&reference));
    let depths = &topics["/vehicle/depth"];
    let squares: f64 = depths.iter().map(|m| (m.number("depth") + truth(m).z).powi(2)).sum();
    let sigma_m = (squares / depths.len() as f64).sqrt();
    assert!((sigma_m - 0.3).abs() < 0.02, "{sigma_m}");
    let ship = &topics["/ship/navigation"];
    let at = |m: &Read| scenario.ship.at(m.stamp_s);
    let moved: Vec<_> = ship.iter().map(|m| m.position() - at(m).position).collect();
    assert!((rms(&moved) - 1.0).abs() < 0.05, "{}", rms(&moved));
    let squares: f64 =
        ship.iter().map(|m| (m.number("heading") - at(m).heading_rad.to_degrees()).powi(2)).sum();
    let sigma_deg = (squares / ship.len() as f64).sqrt();
    assert!((sigma_deg - 2.0).abs() < 0.15, "{sigma_deg}");
}

#[test]
fn the_ship_heads_where_it_goes() {
    let ship = ShipScenario { speed_m_s: 2.0, ..ShipScenario::default() };
    for time_s in [0.0, 77.0, 400.0, 5000.0] {
        let [from, to] = [-0.5, 0.5].map(|d| ship.at(time_s + d).position);
        let (sin, cos) = ship.at(time_s).heading_rad.sin_cos();
        assert!(((to - from) - Vector3::new(2.0 * sin, 2.0 * cos, 0.0)).norm() < 1e-4);
    }
}

#[test]
fn ranges_bearings_and_depressions_lead_back_to_the_truth_within_their_noise() {
    let scenario = scenario(POLAR);
    let (bytes, dive) = log_of(&scenario);
    let topics = read(&bytes);
    assert!(!topics.contains_key("/usbl/fix"));
    let seen = &topics["/usbl/raw"];
    let (mut squares, mut worst_m) = (0.0, 0.0_f64);
    for message in seen {
        let ship = scenario.ship.at(message.stamp_s);
        let carrier = Ship {
            position: ship.position.into(),
            heading_rad: ship.heading_rad,
            position_sigma_m: [0.0; 3],
            heading_sigma_rad: 0.0,
        };
        let angle = |key: &str| message.number(key).to_radians();
        let polar = Polar {
            range_m: message.number("range"),
            bearing_rad: angle("bearing"),
            depression_rad: angle("depression"),
            sigma: [2.0, 0.5_f64.to_radians(), 0.5_f64.to_radians()],
        };
        let (found, covariance) = position(&polar, &carrier);
        let off = Vector3::from(found) - dive.trajectory.at(message.stamp_s).position;
        squares += (Matrix3::from(covariance).try_inverse().unwrap() * off).dot(&off);
        worst_m = worst_m.max(off.norm());
    }
    let per_axis = squares / (3.0 * seen.len() as f64);
    assert!((per_axis - 1.0).abs() < 0.1, "{per_axis}");
    assert!((5.0..30.0).contains(&worst_m), "{worst_m}");
}

#[test]
fn noise_past_straight_down_is_seen_on_the_other_side() {
    let exact = MessagesScenario { range_sigma_m: 0.0, angle_sigma_deg: 0.0, ..MessagesScenario::default() };
    let noisy = MessagesScenario { angle_sigma_deg: 5.0, ..exact.clone() };
    let ship = ShipScenario::default().at(10.0);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let below = ship.position - Vector3::new(0.0, 0.0, 500.0);
    assert!((seen_from(&ship, below, &exact, &mut rng).depression_rad - FRAC_PI_2).abs() < 1e-12);
    for _ in 0..100 {
        let seen = seen_from(&ship, below, &noisy, &mut rng);
        assert!(seen.depression_rad <= FRAC_PI_2 && (0.0..TAU).contains(&seen.bearing_rad), "{seen:?}");
    }
}

#[test]
fn latitudes_longitudes_and_depths_lead_back_to_the_truth() {
    let (bytes, dive) = log_of(&scenario(GEODETIC));
    let zero = Geodetic::from_degrees([-33.9, 18.4, 0.0]);
    let frame = LocalFrame::new(zero);
    let fix = |[latitude, longitude]: [f64; 2], depth_m: f64| {
        above_level(Geodetic::from_degrees([latitude, longitude, -depth_m]), -depth_m, &frame, zero)
    };
    let topics = read(&bytes);
    for message in &topics["/usbl/fix"] {
        let place = ["latitude", "longitude"].map(|key| message.number(key));
        let off =
            Vector3::from(fix(place, message.number("depth"))) - dive.trajectory.at(message.stamp_s).position;
        assert!(off.norm() < 2e-3, "{off}");
    }
    // where the sea's surface is 200 m below the frame's plane
    let far = place_json(&frame, &Vector3::new(4e4, -3e4, -900.0), "depth", 900.0);
    let place = ["latitude", "longitude"].map(|key| far[key].as_f64().unwrap());
    let [east, north, _] = fix(place, 900.0);
    assert!((east - 4e4).hypot(north + 3e4) < 2e-3, "{east} {north}");
    let ship = &topics["/ship/navigation"][0];
    assert!((ship.number("latitude") + 33.9 - 200.0 / 110_900.0).abs() < 5e-5, "{}", ship.said);
    assert!(ship.number("altitude").abs() < 10.0 && ship.said.get("position").is_none());
}

#[test]
fn late_and_repeated_messages_have_their_shares_and_late_ones_stand_behind_younger_ones() {
    let text = "seed = 6\n[dive]\n[messages]\nlate_share = 0.2\nlate_s = [5.0, 20.0]\nrepeated_share = 0.1";
    let (bytes, dive) = log_of(&scenario(text));
    let topics = read(&bytes);
    let fixes = &topics["/usbl/fix"];
    let (count, counts) = (dive.record.fixes.len() as f64, dive.counts());
    let [late, repeated] = [counts.late, counts.repeated].map(|n| n as f64 / count);
    assert!((late - 0.2).abs() < 0.04 && (repeated - 0.1).abs() < 0.03, "{late} {repeated}");
    assert_eq!(fixes.len(), counts.fixes + counts.repeated);
    let mut said: Vec<String> = fixes.iter().map(|m| m.said.to_string()).collect();
    said.sort();
    assert_eq!(said.windows(2).filter(|pair| pair[0] == pair[1]).count(), counts.repeated);
    let held_up = fixes.iter().filter(|m| m.log_s - m.stamp_s > 5.0).count();
    assert!(held_up >= counts.late, "{held_up}");
    assert!(fixes.iter().all(|m| (0.199..21.3).contains(&(m.log_s - m.stamp_s))));
    let overtaken = |i: &usize| fixes[..*i].iter().any(|before| before.stamp_s > fixes[*i].stamp_s);
    let overtaken = (0..fixes.len()).filter(overtaken);
    assert!(overtaken.count() >= counts.late, "late messages stand in the order of their stamps");
}

#[test]
fn a_share_leaves_everything_else_as_it_was() {
    let calm = scenario("[dive]");
    let late = scenario("[dive]\n[messages]\nlate_share = 0.5\nrepeated_share = 0.5");
    let [calm, late] = [calm, late].map(|scenario| simulate_dive(&scenario).unwrap());
    assert_eq!((&calm.record, &calm.ship, &calm.depths), (&late.record, &late.ship, &late.depths));
    let first = |dive: &SimulatedDive| -> Vec<Seen> {
        dive.messages.iter().filter(|m| !m.repeated).map(|m| m.seen).collect()
    };
    assert_eq!(first(&calm), first(&late));
}

#[test]
fn a_dive_ends_where_the_vehicle_is_back_at_the_surface() {
    let mut early = 0;
    for seed in 1..=20 {
        let dive = simulate_dive(&DiveScenario { seed, ..DiveScenario::default() }).unwrap();
        let z_m = dive.trajectory.at(dive.end_s).position.z;
        assert!(z_m < 0.5, "seed {seed}: {z_m} m");
        early += u32::from(dive.end_s < 3600.0);
        assert!((dive.end_s - 3600.0).abs() < 1e-9 || z_m > -1e-9, "seed {seed}: {} s, {z_m} m", dive.end_s);
        assert!(dive.messages.iter().all(|m| m.stamp_s <= dive.end_s));
    }
    assert!((1..20).contains(&early), "{early}");
}

#[test]
fn a_table_given_in_part_keeps_its_own_defaults_and_no_depth_is_no_channel() {
    let scenario =
        DiveScenario::from_toml("[dive]\n[reference]\nrate_hz = 2\n[depth]\nenabled = false").unwrap();
    let mut expected = DiveScenario::default();
    (expected.reference.rate_hz, expected.depth.enabled) = (2.0, false);
    assert_eq!(scenario, expected);
    assert!(!read(&log_of(&scenario).0).contains_key("/vehicle/depth"));
}

#[test]
fn a_scenario_is_a_dive_where_it_has_that_table_and_else_a_climb() {
    let is_dive = |text: &str| matches!(ScenarioFile::from_toml(text).unwrap(), ScenarioFile::Dive(_));
    assert!(is_dive("[dive]") && is_dive("[usbl]\nsigma_m = 2\n[dive]\nduration_s = 600"));
    assert!(!is_dive("") && !is_dive("[climb]\nvary = 0"));
}

#[test]
fn an_unknown_key_is_refused_by_name_and_line() {
    for (text, key, line) in [
        ("[dive]\nduration = 60.0", "`duration`", "line 2"),
        ("[dive]\n\n[usbl]\nfixes_as = \"xyz\"", "`fixes_as`", "line 4"),
        ("[dive]\n[climb]\nvary = 1.0", "`climb`", "line 2"),
        ("[dive]\n[messages]\nfixes_as = \"xy\"", "`xy`", "line 3"),
        ("[usbl]\nsigma_m = 3.0", "`usbl`", "line 1"),
    ] {
        let message = ScenarioFile::from_toml(text).unwrap_err().to_string();
        assert!(message.contains(key) && message.contains(line), "{message}");
    }
}

#[test]
fn nonsense_is_refused_with_the_key_the_value_and_the_range() {
    for (text, expected) in [
        (
            "[dive]\nduration_s = 1e9",
            "scenario key \"dive.duration_s\": got 1000000000, expected 60 to 100000",
        ),
        ("[dive]\nduration_s = nan", "\"dive.duration_s\": got NaN"),
        ("[dive]\nleg_s = [0.0, 300.0]", "\"dive.leg_s[0]\": got 0, expected 10 to 100000"),
        ("[dive]\nturn_deg_s = [1.0, -3.0]", "\"dive.turn_deg_s[1]\": got -3, expected 0.1 to 30"),
        (
            "[dive]\nleg_m_s = [2.0, 1.0]",
            "\"dive.leg_m_s[0]\": got 2, expected at most 1, the value of \"dive.leg_m_s[1]\"",
        ),
        ("[dive]\nlag_s = [0.0, 0.0]", "\"dive.lag_s[0]\": got 0, expected 5 to 600"),
        ("[dive]\nduration_s = 90000.0", "table \"dive\": asks for 22275 m of depth, expected at most 12000"),
        ("[dive]\n[usbl]\ncycle_s = 0.0", "\"usbl.cycle_s\": got 0"),
        ("[dive]\n[usbl]\nfixes = [0, 3]", "\"usbl.fixes[0]\": got 0, expected 1 to 1000"),
        ("[dive]\n[usbl]\nspacing_s = 10.0", "\"usbl.spacing_s\": got 10, expected 0 to 1.66"),
        ("[dive]\n[usbl]\nwild_m = [0.0, 10.0]", "\"usbl.wild_m[0]\": got 0"),
        ("[dive]\n[usbl]\nwild_fixes = 30.0", "\"usbl.wild_fixes\": got 30, expected 0 to 1"),
        (
            "[dive]\n[messages]\nlate_s = [9.0, 1e9]",
            "\"messages.late_s[1]\": got 1000000000, expected 0 to 3600",
        ),
        ("[dive]\n[ship]\nradius_m = 0.0", "\"ship.radius_m\": got 0, expected 1 to 100000"),
        (
            "[dive]\n[depth]\nrate_hz = 1000.0",
            "table \"depth\": asks for 3600000 messages, expected at most 1000000",
        ),
        ("[dive]\n[reference]\nrate_hz = 10000.0", "table \"reference\": asks for 36000000 samples"),
        ("origin = [95.0, 0.0]\n[dive]", "scenario key \"origin[0]\": got 95, expected -90 to 90"),
        ("epoch_ns = 0\n[dive]", "scenario key \"epoch_ns\": got 0"),
    ] {
        let error = DiveScenario::from_toml(text).unwrap_err();
        assert!(!matches!(error, SimulateError::Parse(_)), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn extreme_scenarios_in_range_end_in_numbers() {
    for text in [
        "[dive]\nduration_s = 60",
        "[dive]\nduration_s = 1e5\nvertical_share = [0.05, 0.1]\nleg_s = [10, 10]\nturn_deg = [0, 0]",
        "[dive]\nvertical_share = [0.5, 0.5]\nvertical_m_s = [5, 5]\nlag_s = [5, 5]",
        "[dive]\nduration_s = 100\n[usbl]\nsilence_s = 100\nsilence_margin_s = 0",
        "[dive]\ncurrent_m_s = [2, 2]\ncurrent_s = 10\n[usbl]\nlost_cycles = 1",
        "[dive]\nduration_s = 600\n[usbl]\nwild_fixes = 1\nwild_m = [1e5, 1e5]\n[messages]\nfixes_as = \"polar\"\nangle_sigma_deg = 20",
        "origin = [90, 180]\n[dive]\nduration_s = 600\n[ship]\nradius_m = 1e5\n[messages]\nfixes_as = \"geodetic\"",
        "[dive]\nduration_s = 600\n[reference]\nbegin_s = 599.5",
    ] {
        let scenario = DiveScenario::from_toml(text).unwrap();
        let (_, dive) = log_of(&scenario);
        assert!(dive.trajectory.diverged_s().is_none(), "{text}");
        let finite = |m: &FixMessage| match m.seen {
            Seen::Position(p) => p.iter().all(|v| v.is_finite()),
            Seen::Polar(p) => p.range_m >= 0.0 && p.bearing_rad.is_finite() && p.depression_rad.is_finite(),
        };
        assert!(dive.messages.iter().all(finite), "{text}");
    }
}
