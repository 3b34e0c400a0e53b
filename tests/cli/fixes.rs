//! Latitudes and longitudes become a track in metres, about an origin that the result names.

use std::fs;

use serde_json::{Value, json};
use trackfuse::math::geodesy::{Geodetic, LocalFrame};

use super::trial::{Trial, assert_says, logs, trackfuse};
use super::trial_log::{Sensor, TrialLog, ns, position, stamp, velocity, xyz};

const ORIGIN: [f64; 3] = [59.4, 10.5, 3.0];

/// A fix at the place that lies at `enu` from the origin.
fn fix(t: f64, enu: [f64; 3]) -> Value {
    let place = LocalFrame::new(Geodetic::from_degrees(ORIGIN)).to_geodetic(enu).to_degrees();
    json!({
        "timestamp": stamp(ns(t)), "frame_id": "antenna", "latitude": place[0], "longitude": place[1],
        "altitude": place[2], "position_covariance": [0.04, 0, 0, 0, 0.04, 0, 0, 0, 0.16], "position_covariance_type": 2
    })
}

fn log_of_fixes(change: impl Fn(usize, &mut Value)) -> Vec<u8> {
    let mut log = TrialLog::new();
    let sensor = Sensor { sigma: 0.05, ..Sensor::new(0.0, 8.0, 1) };
    for (i, (t, p, v)) in sensor.samples().into_iter().enumerate() {
        let mut message = fix(t, p);
        change(i, &mut message);
        log.json("/gps/fix", t, &message);
        log.json("/gps/vel", t, &json!({"timestamp": stamp(ns(t)), "velocity": xyz(v)}));
    }
    log.finish()
}

const CONFIG: &str = "[output]\norigin = [59.4, 10.5, 3.0]\n[[source]]\nname = \"gps\"\nposition = \"/gps/fix\"\n\
                      velocity = \"/gps/vel.velocity\"\n";

#[test]
fn fixes_become_metres_about_the_origin_of_the_config() {
    let (report, output) = Trial::of(log_of_fixes(|_, _| {})).config(CONFIG).report(0);
    let (p, expected) = (output.near(4.0).vector("position"), position(4.0));
    assert!((0..3).all(|i| (p[i] - expected[i]).abs() < 0.1), "{p:?}");
    let v = output.near(4.0).vector("velocity");
    assert!((0..3).all(|i| (v[i] - velocity(4.0)[i]).abs() < 0.1), "{v:?}");
    assert_eq!(report["track"]["origin"], json!(ORIGIN));
    assert_eq!(report["track"]["frame_id"], "enu");
    let source = &report["sources"][0];
    assert_eq!(source["position_sigma_from"], "messages");
    assert!((source["position_sigma_m"].as_f64().unwrap() - 0.2).abs() < 1e-9);
}

#[test]
fn fixes_count_from_the_first_by_default_and_the_origin_makes_the_track_again() {
    let config = CONFIG.replace("[output]\norigin = [59.4, 10.5, 3.0]\n", "");
    let trial = Trial::of(log_of_fixes(|_, _| {})).config(&config);
    let (report, output) = trial.report(0);
    let p = output.near(0.0).vector("position");
    assert!(p.iter().all(|v| v.abs() < 0.3), "{p:?}");
    let latitude = report["track"]["origin"][0].as_f64().unwrap();
    assert!((latitude - 59.4).abs() < 1e-4 && latitude != 59.4);
    let again =
        Trial::of(log_of_fixes(|_, _| {})).config(&output.metadata["trackfuse:/fused"]["config"]).report(0).1;
    assert!(again.track().iter().zip(output.track()).all(|(a, b)| a.value == b.value));
    assert_says(
        &trial.fuse(&["--force"]).stdout,
        &["metres east, north and up of latitude 59.39999", "(WGS 84)"],
    );
    // what the track is held to counts from the same origin
    let ran = trackfuse(trial.folder(), &["compare", "in.fused.mcap", "--reference", "/gps/fix", "--json"]);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let rmse = report["all"]["position_m"]["rmse"].as_f64().unwrap();
    assert!(rmse < 0.2, "{}", ran.stdout);
}

#[test]
fn fixes_of_the_track_lie_where_the_track_does_and_a_map_gets_its_lines_and_points() {
    let config = format!("{CONFIG}[[characteristic_point]]\nname = \"half way\"\nz_m = -40.0\n");
    let trial = Trial::of(log_of_fixes(|_, _| {})).config(&config);
    let (_, output) = trial.report(0);
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN));
    let enu = |latitude: &Value, longitude: &Value, altitude: &Value| {
        let degrees = [latitude, longitude, altitude].map(|v| v.as_f64().unwrap());
        frame.to_enu(Geodetic::from_degrees(degrees))
    };
    let (fixes, track) = (&output.topics["/fused/fix"], output.track());
    assert_eq!(fixes.len(), track.len() / 2 + 1, "10 Hz of 20 Hz, and the last");
    let last = (track.len() % 2 == 0).then(|| track.last().unwrap());
    for (fix, point) in fixes.iter().zip(track.iter().step_by(2).chain(last)) {
        let (p, sigma) = (point.vector("position"), point.vector("position_sigma"));
        let at = enu(&fix.value["latitude"], &fix.value["longitude"], &fix.value["altitude"]);
        assert_eq!(fix.log_time, point.log_time);
        assert!((0..3).all(|i| (at[i] - p[i]).abs() < 2e-3), "{at:?} {p:?}");
        for i in 0..3 {
            let variance = fix.value["position_covariance"][4 * i].as_f64().unwrap();
            assert!((variance - sigma[i] * sigma[i]).abs() < 1e-5 * sigma[i].max(1.0));
        }
        assert_eq!(fix.value["position_covariance_type"], 2, "along the diagonal");
    }
    let [map] = output.topics["/fused/geojson"].as_slice() else { panic!("one message") };
    let map: Value = serde_json::from_str(map.value["geojson"].as_str().unwrap()).unwrap();
    assert_eq!(map["type"], "FeatureCollection");
    let features = map["features"].as_array().unwrap();
    let of = |kind: &str| features.iter().filter(|f| f["geometry"]["type"] == kind).collect::<Vec<_>>();
    let names = of("LineString").iter().map(|f| f["properties"]["name"].clone()).collect::<Vec<_>>();
    assert_eq!(names, ["single", "extrapolated"]);
    let colors: Vec<_> =
        features.iter().map(|f| f["properties"]["style"]["color"].as_str().unwrap()).collect();
    assert_eq!(colors, ["#56b4e9", "#d55e00", "#56b4e9"]);
    let [point] = of("Point")[..] else { panic!("one point") };
    assert_eq!(point["properties"]["name"], "half way");
    let at = &point["geometry"]["coordinates"];
    assert!((enu(&at[1], &at[0], &at[2])[2] + 40.0).abs() < 2e-3, "{at}");
    let first = &of("LineString")[0]["geometry"]["coordinates"][0];
    assert!(
        (0..3)
            .all(|i| (enu(&first[1], &first[0], &first[2])[i] - track[0].vector("position")[i]).abs() < 2e-3)
    );
}

#[test]
fn fixes_on_both_sides_of_the_antimeridian_make_lines_that_end_on_it() {
    // 3 m from it at this latitude
    let config = "[output]\norigin = [59.4, 179.99995, 3.0]\n";
    let (_, output) = Trial::of(super::trial_log::two_sensors()).config(config).report(0);
    let map = output.topics["/fused/geojson"][0].value["geojson"].as_str().unwrap();
    let map: Value = serde_json::from_str(map).unwrap();
    let mut cuts = 0;
    for geometry in map["features"].as_array().unwrap().iter().map(|f| &f["geometry"]) {
        assert_ne!(geometry["type"], "Point");
        let whole = json!([geometry["coordinates"]]);
        let is_cut = geometry["type"] == "MultiLineString";
        cuts += usize::from(is_cut);
        for line in if is_cut { &geometry["coordinates"] } else { &whole }.as_array().unwrap() {
            let longitudes: Vec<f64> =
                line.as_array().unwrap().iter().map(|p| p[0].as_f64().unwrap()).collect();
            assert!(longitudes.windows(2).all(|w| (w[1] - w[0]).abs() < 1.0), "{longitudes:?}");
        }
    }
    assert!(cuts > 0, "the track crosses it");
}

#[test]
fn fixes_are_not_made_up_where_nothing_says_where_the_track_is() {
    let (_, output) = Trial::of(super::trial_log::two_sensors()).report(0);
    assert!(output.topics.keys().all(|topic| topic != "/fused/fix" && topic != "/fused/geojson"));
}

#[test]
fn fixes_without_a_fix_or_off_the_earth_are_no_samples_and_an_unknown_covariance_is_none() {
    let log = log_of_fixes(|i, message| match i {
        10..20 => message["status"] = json!({"status": -1, "service": 1}),
        20 => message["latitude"] = json!(91.0),
        21 => message["altitude"] = Value::Null,
        _ => message["position_covariance_type"] = json!(0),
    });
    let (report, _) = Trial::of(log).config(CONFIG).report(3);
    let source = &report["sources"][0];
    assert_eq!(source["positions"], 149);
    let warnings = report["warnings"].to_string();
    assert_says(
        &warnings,
        &[
            "10 samples are left out: their status is that there is no fix",
            "a latitude beyond 90 degrees",
            "NaN",
        ],
    );
}

#[test]
fn fixes_and_odometry_of_a_real_robot_are_chosen_on_the_command_line_and_never_fused_in_silence() {
    let Some(path) = logs("others").into_iter().find(|p| p.ends_with("husky_gps_odom_ros1.mcap")) else {
        return;
    };
    let trial = Trial::of(fs::read(path).unwrap());
    assert_says(
        &trial.error(2),
        &["/fix (position)", "/husky_velocity_controller/odom (position and velocity)", "--source TOPIC"],
    );
    let odom = "/husky_velocity_controller/odom";
    let made = trackfuse(
        trial.folder(),
        &["init", "in.mcap", "--source", "/fix", "--source", odom, "-o", "trial.toml"],
    );
    assert_eq!(made.code, 0, "{made:#?}");
    assert_says(&made.stdout, &["in.mcap -> trial.toml: fix (datum), husky_velocity_controller"]);
    // a Procrustes fit of the level positions by numpy turns the fixes by -128.2 degrees into the odometry, which drifts
    let (report, output) = trial.report(3);
    let unknowns = report["registration"]["unknowns"].as_array().unwrap();
    let rotation = unknowns.iter().find(|u| u["kind"] == "rotation").unwrap();
    let (value, sigma) = (rotation["value"].as_f64().unwrap(), rotation["sigma"].as_f64().unwrap());
    assert!((value.to_degrees() + 128.2).abs() < 3.0 * sigma.to_degrees() && sigma < 0.05, "{rotation}");
    assert_says(&report["warnings"].to_string(), &["still disagree in position after registration"]);
    let degrees = format!("{:+.3} ± {:.1} ", value.to_degrees(), sigma.to_degrees());
    assert_says(&trial.fuse(&["--force"]).stdout, &["rotation", &degrees, " deg "]);
    // the way that the fixes span is 58 m by 146 m
    let span = |axis: usize| {
        let all = || output.track().iter().map(|w| w.vector("position")[axis]);
        all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
    };
    assert!((span(0) - 58.0).abs() < 15.0 && (span(1) - 146.0).abs() < 15.0, "{} {}", span(0), span(1));
    let config = fs::read_to_string(trial.path("trial.toml")).unwrap();
    let trial = trial.config(&config.replace("#estimate = \"auto\"", "estimate = []"));
    let (report, _) = trial.report(3);
    assert_eq!(report["sources"][0]["positions"], 989);
    assert_eq!(report["sources"][1]["positions"], 3952);
    assert!((report["track"]["origin"][0].as_f64().unwrap() - 42.375_812).abs() < 1e-4);
    let unknown = trackfuse(trial.folder(), &["init", "in.mcap", "--source", "/fax"]);
    assert_eq!(unknown.code, 2, "{unknown:#?}");
    assert_says(&unknown.stderr, &["\"/fax\" is not in the log", "did you mean \"/fix\"?"]);
}

/// By `tests/geodesy_golden.py`: 13 fixes, 0.5 s apart, of what moves by (4, 3, -2) m/s from (100, -50, 0) m east, north
/// and up of the origin.
#[expect(clippy::unreadable_literal, reason = "as the script prints them")]
const MOVING: [[f64; 3]; 13] = [
    [59.39955116347169, 10.501760313652504, 3.0009778175208672],
    [59.3995646276642, 10.501795520918572, 2.0009978360003853],
    [59.39957809185141, 10.501830728223585, 1.0010188325224403],
    [59.3995915560333, 10.50186593556754, 0.0010408062852410437],
    [59.399605020209876, 10.501901142950437, -0.9989362411081287],
    [59.399618484381165, 10.501936350372276, -1.998912309894877],
    [59.39963194854714, 10.501971557833057, -2.9988874014413764],
    [59.39964541270781, 10.502006765332785, -3.998861514709125],
    [59.39965887686318, 10.502041972871453, -4.998834649607792],
    [59.39967234101324, 10.502077180449065, -5.9988068064650815],
    [59.399685805158015, 10.502112388065617, -6.998777985371656],
    [59.399699269297464, 10.502147595721116, -7.998748186474229],
    [59.39971273343161, 10.502182803415556, -8.998717408734297],
];

#[test]
fn fixes_lie_where_another_program_puts_them() {
    let mut log = TrialLog::new();
    for (t, place) in (0..).map(|k| 0.5 * f64::from(k)).zip(MOVING) {
        let [latitude, longitude, altitude] = place;
        let message = json!({"latitude": latitude, "longitude": longitude, "altitude": altitude});
        log.json("/gps/fix", t, &message);
    }
    let config = "[output]\norigin = [59.4, 10.5, 3.0]\nrate_hz = 10.0\n[[source]]\nname = \"gps\"\nposition = \"/gps/fix\"\n";
    let output = Trial::of(log.finish()).config(config).report(0).1;
    for t in [0.0, 3.0, 6.0] {
        let (p, expected) = (output.near(t).vector("position"), [100.0 + 4.0 * t, -50.0 + 3.0 * t, -2.0 * t]);
        assert!((0..3).all(|i| (p[i] - expected[i]).abs() < 1e-3), "{t} s: {p:?}");
    }
}
