//! What a run writes for viewers: the scene, the moving point, the residuals.

use serde_json::{Value, json};

use super::trial::{Output, Trial};
use super::trial_log::{EPOCH_NS, Sensor, TrialLog, changed, ns, position, stamp, two_sensors, xyz};

/// The scene, and its log time less [`EPOCH_NS`], ns.
fn scene(output: &Output) -> (&Value, i64) {
    let [scene] = output.topics["/fused/scene"].as_slice() else { panic!("not one scene") };
    (&scene.value, scene.log_time as i64 - EPOCH_NS as i64)
}

fn entity<'v>(scene: &'v Value, id: &str) -> &'v Value {
    let found = scene["entities"].as_array().unwrap().iter().find(|e| e["id"] == id);
    found.unwrap_or_else(|| panic!("no entity {id}"))
}

fn point(value: &Value) -> [f64; 3] {
    ["x", "y", "z"].map(|axis| value[axis].as_f64().unwrap())
}

/// The points of an entity's lines, where they are in the frame.
fn lines(entity: &Value) -> Vec<Vec<[f64; 3]>> {
    let of_line = |line: &Value| {
        let anchor = point(&line["pose"]["position"]);
        let points = line["points"].as_array().unwrap().iter().map(point);
        points.map(|p| std::array::from_fn(|i| p[i] + anchor[i])).collect()
    };
    entity["lines"].as_array().unwrap().iter().map(of_line).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn viewer_scene_shows_track_sources_points_and_uncertainty_where_they_are() {
    let config = "[[characteristic_point]]\nname = \"half way\"\nz_m = -30.0\n";
    let (_, output) = Trial::of(two_sensors()).config(config).report(0);
    let (scene, _) = scene(&output);
    let track = lines(entity(scene, "track"));
    assert_eq!(track.len(), 4, "tether, both, beacon, extrapolated");
    let colors: Vec<_> =
        entity(scene, "track")["lines"].as_array().unwrap().iter().map(|l| &l["color"]).collect();
    assert!(colors[0] == colors[2] && colors[0] != colors[1] && colors[1] != colors[3]);
    for pair in track.windows(2) {
        assert_eq!(pair[0].last(), pair[1].first(), "no gap where the phase changes");
    }
    let drawn: Vec<[f64; 3]> = track.concat();
    let published = output.track();
    assert_eq!(drawn.len(), published.len() + 3);
    assert!(distance(drawn[0], published[0].vector("position")) < 2e-3);
    assert!(distance(*drawn.last().unwrap(), published.last().unwrap().vector("position")) < 2e-3);
    for (name, sensor) in [("tether", Sensor::new(0.0, 8.0, 1)), ("beacon", Sensor::new(5.0, 13.0, 2))] {
        let source = entity(scene, &format!("source/{name}"));
        let samples = sensor.samples();
        assert_eq!(source["texts"][0]["text"], name);
        let [line] = lines(source).try_into().unwrap();
        assert_eq!(line.len(), samples.len());
        assert!(
            line.iter().zip(&samples).all(|(drawn, (_, measured, _))| distance(*drawn, *measured) < 2e-3)
        );
        assert!(
            source["lines"][0]["thickness"].as_f64()
                < entity(scene, "track")["lines"][0]["thickness"].as_f64()
        );
    }
    let marks = entity(scene, "characteristic points");
    assert_eq!(marks["texts"][0]["text"], "half way");
    let at = point(&marks["spheres"][0]["pose"]["position"]);
    assert!(distance(at, position(7.5)) < 0.3 && (at[2] + 30.0).abs() < 1e-3, "{at:?}");
    let around = entity(scene, "95 % uncertainty")["spheres"].as_array().unwrap();
    assert_eq!(around.len(), 2, "the characteristic point and the track's end");
    let sigma = output.near(7.5).vector("position_sigma");
    let size = point(&around[0]["size"]);
    assert!(
        (0..3).all(|i| (size[i] - 2.0 * 1.96 * sigma[i]).abs() < 2e-3),
        "{size:?} around, sigma {sigma:?}"
    );
    assert!(around.iter().all(|sphere| sphere["color"]["a"].as_f64() < Some(0.5)));
}

#[test]
fn viewer_scene_stands_where_the_log_begins_and_never_before_all_else() {
    // (time of a bystander's message, of the scene), ns after the release
    let minute = 60_000_000_000;
    for (bystander, expected) in [(-minute, -minute), (minute, 0), (-(EPOCH_NS as i64), 0)] {
        let mut log = TrialLog::new();
        log.raw("/ship/heading", [EPOCH_NS.wrapping_add_signed(bystander); 2], b"{}");
        log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
        let (_, output) = Trial::of(log.finish()).report(0);
        assert_eq!(scene(&output).1, expected, "{bystander}");
    }
    // a recorder that began to log late: the track's start is earlier
    let mut log = TrialLog::new();
    for (t, message) in Sensor::new(0.0, 8.0, 1).messages() {
        log.json("/tether/track", t + 2.0, &message);
    }
    let (_, output) = Trial::of(log.finish()).report(0);
    assert_eq!(scene(&output).1, 0);
}

#[test]
fn viewer_topics_follow_stamps_of_another_epoch_with_all_others() {
    let mut log = TrialLog::new();
    log.json("/ship/heading", -5.0, &json!({}));
    for (t, mut message) in Sensor::new(0.0, 8.0, 1).messages() {
        message["timestamp"] = stamp(ns(t) - EPOCH_NS + 1_000_000_000);
        log.json("/tether/track", t, &message);
    }
    let (_, output) = Trial::of(log.finish()).report(3);
    let (scene, log_time) = scene(&output);
    assert_eq!(log_time, -1_000_000_000, "where the stamps begin, since none is below zero");
    assert_eq!(scene["entities"][0]["timestamp"], json!({"sec": 0, "nsec": 0}));
    let (pose, point) = (&output.topics["/fused/pose"][9], &output.track()[9]);
    assert_eq!((pose.log_time, pose.timestamp_ns()), (point.log_time, point.timestamp_ns()));
}

#[test]
fn viewer_topics_have_a_frame_where_the_log_names_none_and_the_track_has_none() {
    let log = changed(|_, _, mut message| {
        message.as_object_mut().unwrap().remove("frame_id");
        Some(message)
    });
    let frames = |output: &Output| {
        let first = |topic: &str| output.topics[topic][0].value.clone();
        let scene = first("/fused/scene")["entities"][0]["frame_id"].clone();
        [scene, first("/fused/pose")["frame_id"].clone(), first("/fused/track")["frame_id"].clone()]
    };
    let (_, output) = Trial::of(&log).report(0);
    assert_eq!(frames(&output), ["unnamed", "unnamed", ""]);
    let (_, output) = Trial::of(&log).config("[output]\nframe_id = \"map\"\n").report(0);
    assert_eq!(frames(&output), ["map"; 3]);
}

#[test]
fn viewer_pose_moves_along_the_track() {
    let (_, output) = Trial::of(two_sensors()).report(0);
    let poses = &output.topics["/fused/pose"];
    assert_eq!(poses.len(), output.track().len());
    for (pose, point_of_track) in poses.iter().zip(output.track()) {
        assert_eq!(pose.log_time, point_of_track.log_time);
        assert_eq!(pose.value["pose"]["position"], point_of_track.value["position"]);
        assert_eq!(pose.value["pose"]["orientation"], json!({"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}));
    }
}

#[test]
fn viewer_residuals_are_samples_less_track() {
    let (_, output) = Trial::of(two_sensors()).report(0);
    let residuals = &output.topics["/fused/residuals"];
    assert!(residuals.is_sorted_by_key(|r| r.log_time));
    for (name, sensor) in [("tether", Sensor::new(0.0, 8.0, 1)), ("beacon", Sensor::new(5.0, 13.0, 2))] {
        let own: Vec<_> = residuals.iter().filter(|r| r.value["source"] == name).collect();
        let samples = sensor.samples();
        assert_eq!(own.len(), samples.len());
        let mut sums = [0.0; 2];
        for (residual, (t, p, v)) in own.iter().zip(&samples) {
            assert!((residual.timestamp_ns() - ns(*t) as i64).abs() < 1_000_000, "but for the clock offset");
            let point = output.near(*t);
            for (i, (field, measured)) in [("position", p), ("velocity", v)].into_iter().enumerate() {
                let expected: [f64; 3] = std::array::from_fn(|k| measured[k] - point.vector(field)[k]);
                let found = residual.vector(&format!("{field}_residual"));
                // honest sensors have next to no errors that the registration takes off
                assert!(distance(found, expected) < 0.02, "{name} at {t}: {found:?}, expected {expected:?}");
                sums[i] += residual.value[format!("{field}_normalised")].as_f64().unwrap().powi(2);
            }
            let phase = if (5.0..=8.0).contains(t) { "overlap" } else { "single" };
            assert_eq!(residual.value["phase"], phase, "{name} at {t}");
        }
        let rms = sums.map(|sum| (sum / samples.len() as f64).sqrt());
        assert!(rms.iter().all(|r| (r - 1.0).abs() < 0.15), "{name}: {rms:?} of honest sensors");
    }
}

#[test]
fn viewer_residuals_leave_out_what_was_not_measured() {
    let config = "[[source]]\nname = \"tether\"\nposition = \"/tether/track.position\"\n";
    let (_, output) = Trial::of(two_sensors()).config(config).report(0);
    let residual = &output.topics["/fused/residuals"][0].value;
    assert!(residual["position_residual"].is_object() && residual.get("velocity_residual").is_none());
    assert!(residual.get("velocity_normalised").is_none());
}

#[test]
fn viewer_scene_draws_no_line_across_a_silence() {
    let mut log = TrialLog::new();
    // 20 s that are not bridged, and one second that GDF has no value in
    for (topic, from_s, to_s) in
        [("/tether/track", 0.0, 3.0), ("/tether/track", 4.0, 8.0), ("/tether/track", 28.0, 32.0)]
    {
        log.sensor(topic, &Sensor::new(from_s, to_s, 1));
    }
    let log = log.finish();
    for (method, pieces) in
        [("sff", vec![[0.0, 8.0], [28.0, 34.0]]), ("gdf", vec![[0.0, 3.0], [4.0, 8.0], [28.0, 34.0]])]
    {
        let config = format!("[fusion]\nmethod = \"{method}\"\n");
        let (_, output) = Trial::of(&log).config(&config).report(3);
        let (scene, _) = scene(&output);
        // z tells the time: 4 m/s
        let mut ends: Vec<[f64; 2]> = Vec::new();
        for line in lines(entity(scene, "track")) {
            let [from, to] = [line[0][2], line[line.len() - 1][2]].map(|z| (z + 60.0) / 4.0);
            match ends.last_mut() {
                Some(last) if (last[1] - from).abs() < 1e-9 => last[1] = to,
                _ => ends.push([from, to]),
            }
        }
        assert_eq!(ends.len(), pieces.len(), "{method}: {ends:?}");
        for (found, expected) in ends.iter().flatten().zip(pieces.iter().flatten()) {
            assert!((found - expected).abs() < 0.3, "{method}: {ends:?}");
        }
        let samples = lines(entity(scene, "source/tether"));
        assert_eq!(samples.len(), 3, "{method}");
    }
}

#[test]
fn viewer_scene_of_a_long_log_is_thinned_without_changing_its_shape() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor { rate_hz: 2000.0, ..Sensor::new(0.0, 8.0, 1) });
    log.sensor("/beacon/track", &Sensor { rate_hz: 2000.0, ..Sensor::new(5.0, 13.0, 2) });
    let (report, output) = Trial::of(log.finish()).report(0);
    let (scene, _) = scene(&output);
    assert_eq!(report["track"]["points"], 30_001);
    let track = lines(entity(scene, "track")).concat();
    assert!(track.len() > 9_000 && track.len() <= 10_000, "{}", track.len());
    for point in output.track().iter().step_by(111) {
        let at = point.vector("position");
        let nearest = track.iter().map(|p| distance(*p, at)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.05, "{at:?} is {nearest} m from the line's next vertex");
    }
    for name in ["tether", "beacon"] {
        assert_eq!(lines(entity(scene, &format!("source/{name}"))).concat().len(), 4_500);
    }
}

#[test]
fn viewer_scene_far_from_the_origin_keeps_its_millimetres_in_32_bits() {
    let far = [500_000.0, 6_040_000.0, 0.0];
    let log = changed(|_, _, mut message| {
        let at: [f64; 3] = std::array::from_fn(|i| point(&message["position"])[i] + far[i]);
        message["position"] = xyz(at);
        Some(message)
    });
    let (_, output) = Trial::of(log).report(0);
    let (scene, _) = scene(&output);
    let line = &entity(scene, "track")["lines"][0];
    let anchor = point(&line["pose"]["position"]);
    for (drawn, published) in line["points"].as_array().unwrap().iter().zip(output.track()) {
        let as_viewer: [f64; 3] = std::array::from_fn(|i| f64::from(point(drawn)[i] as f32) + anchor[i]);
        assert!(distance(as_viewer, published.vector("position")) < 2e-3);
    }
}
