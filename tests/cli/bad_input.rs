//! Logs and messages that are not as they should be.

use std::collections::BTreeSet;
use std::fs;

use mcap::WriteOptions;
use serde_json::{Value, json};

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::{
    Cdr, EPOCH_NS, POSE_STAMPED, Sensor, TrialLog, changed, definition, ns, odometry, odometry_definition,
    position, stamp, two_sensors, xyz,
};

#[test]
fn bad_input_that_is_no_log_is_named_with_what_it_is() {
    assert_says(&Trial::of("").error(1), &["\"in.mcap\" is not an MCAP", "empty", "\nhint: "]);
    assert_says(&Trial::of("#ROSBAG V2.0\n").error(1), &["is not an MCAP", "\nhint: ", "bag"]);
    assert_says(&Trial::of(&two_sensors()[..20]).error(1), &["damaged at offset 8", "\nhint: "]);
    let trial = Trial::of(two_sensors());
    fs::create_dir(trial.path("folder")).unwrap();
    for (args, parts) in [
        (&["none.mcap"][..], &["cannot open \"none.mcap\"", "No such file"][..]),
        (&["folder"], &["cannot open \"folder\"", "a directory"]),
    ] {
        let ran = trial.fuse_with(args);
        assert_eq!(ran.code, 1);
        assert_says(&ran.stderr, parts);
    }
}

#[test]
fn input_that_no_index_can_name_is_added_to_and_readers_scan_as_before() {
    let loose = || WriteOptions::new().use_chunks(false);
    let unindexed = || WriteOptions::new().emit_message_indexes(false).emit_chunk_indexes(false);
    for options in [loose(), unindexed()] {
        let mut log = TrialLog::with(options);
        log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
        let trial = Trial::of(log.finish());
        let ran = trackfuse(trial.folder(), &["fuse", "in.mcap"]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:#?}");
        assert_says(
            &ran.stdout,
            &["note: the log has messages that no index can name", "must scan the output"],
        );
        let output = fs::read(trial.path("in.fused.mcap")).unwrap();
        assert!(mcap::Summary::read(&output).unwrap().unwrap().chunk_indexes.is_empty());
        let topics: BTreeSet<String> = mcap::MessageStream::new(&output)
            .unwrap()
            .map(|message| message.unwrap().channel.topic.clone())
            .collect();
        assert!(["/tether/track", "/fused/track"].iter().all(|topic| topics.contains(*topic)), "{topics:?}");
    }
}

#[test]
fn bad_input_that_is_cut_off_or_damaged_is_used_as_far_as_it_can_be_trusted() {
    let bytes = two_sensors();
    let mut garbage = bytes.clone();
    garbage.extend(b"garbage");
    let mut summary = bytes.clone();
    let at = summary.len() - 100;
    summary[at] ^= 0xff;
    for (input, says) in [
        (&bytes[..bytes.len() * 9 / 10], "the log is cut off"),
        (&garbage, "7 bytes stand behind the log's end"),
        (&summary, "the summary's CRC is"),
    ] {
        let trial = Trial::of(input);
        let strict = trial.fuse(&["--strict"]);
        assert_eq!(strict.code, 1);
        assert_says(
            &strict.stderr,
            &["error: \"in.mcap\" is damaged at offset ", "\nhint: without `--strict`"],
        );
        let ran = trial.fuse(&[]);
        assert_eq!(ran.code, 3, "{ran:#?}");
        assert_says(&ran.stderr, &["warning: \"in.mcap\" is damaged at offset ", says]);
        assert_says(&ran.stdout, &["warning: \"in.mcap\" is damaged at offset ", says]);
        let init = trackfuse(trial.folder(), &["init", "in.mcap"]);
        assert_eq!(init.code, 3);
        assert_says(&init.stderr, &[says]);
        for command in ["export", "compare"] {
            let reference = ["--reference", "/tether/track"];
            let of: &[&str] = if command == "compare" { &reference } else { &[] };
            let whole = trackfuse(trial.folder(), &[&[command, "in.fused.mcap"], of].concat());
            assert!(!whole.stderr.contains("damaged"), "the output of a damaged log is whole: {whole:#?}");
            let topic = if command == "compare" { "--estimate" } else { "--topic" };
            let args = [&[command, "in.mcap", topic, "/beacon/track"], of].concat();
            assert_says(&trackfuse(trial.folder(), &args).stderr, &[says]);
            let strict = trackfuse(trial.folder(), &[&args[..], &["--strict"]].concat());
            assert_eq!(strict.code, 1, "{strict:#?}");
        }
    }
}

fn source(position: &str) -> String {
    format!("[[source]]\nname = \"s\"\nposition = {position:?}\n")
}

#[test]
fn bad_input_topic_that_is_not_there_lists_those_that_are() {
    let trial = Trial::of(two_sensors()).config(&source("/tehter/track.position"));
    assert_says(
        &trial.error(2),
        &[
            "source \"s\"",
            "\"/tehter/track\" is not in the log",
            "/beacon/track",
            "/tether/track",
            "hint: did you mean \"/tether/track\"?",
        ],
    );
}

#[test]
fn bad_input_path_that_does_not_fit_lists_the_fields() {
    let trial = Trial::of(two_sensors()).config(&source("/tether/track.pos"));
    assert_says(&trial.error(2), &["source \"s\"", "no field \"pos\"", "position, velocity"]);
    let trial = Trial::of(two_sensors()).config(&source("/tether/track"));
    assert_says(&trial.error(2), &["/tether/track is an object", "x, y, z", "/tether/track.position"]);
    let mut log = TrialLog::new();
    log.channel("/p", "cdr", ("geometry_msgs/msg/PoseStamped", "ros2msg", &definition(POSE_STAMPED)));
    log.raw("/p", [EPOCH_NS; 2], &Cdr::new().header(EPOCH_NS, "map").f64s(&[0.0; 7]).done());
    let trial = Trial::of(log.finish()).config(&source("/p.pose.positoin"));
    assert_says(&trial.error(2), &["no field \"positoin\" in /p.pose", "position, orientation"]);
}

#[test]
fn bad_input_path_with_wrong_syntax_is_marked_where_it_is_wrong() {
    for (path, says) in [
        ("/tether/track..position", "found '.' at character 15"),
        ("/tether/track.position[", "expected an index"),
        ("", "expected a topic"),
    ] {
        assert_says(&Trial::of(two_sensors()).config(&source(path)).error(2), &["source \"s\"", says]);
    }
}

/// Every tenth message gets `bad` as its position.
fn every_tenth(bad: &Value) -> Vec<u8> {
    changed(|i, _, mut message| {
        if i % 10 == 3 {
            message["position"] = bad.clone();
        }
        Some(message)
    })
}

#[test]
fn bad_input_values_in_json_are_left_out_with_a_warning() {
    for bad in
        [json!(null), json!("NaN"), json!({"x": 1, "y": 2}), json!({"x": null, "y": 2, "z": 3}), json!([])]
    {
        let (report, output) = Trial::of(every_tenth(&bad)).report(3);
        assert_eq!(report["sources"][0]["positions"], 161 - 16, "{bad}");
        assert_says(report["warnings"][0].as_str().unwrap(), &["tether: 16 samples are left out"]);
        assert!(output.track().len() > 150);
        let error = Trial::of(changed(|_, _, mut message| {
            message["position"] = bad.clone();
            Some(message)
        }))
        .config(&source("/tether/track.position"))
        .error(1);
        assert_says(&error, &["source \"s\"", "/tether/track.position", "in all 161 messages"]);
    }
}

#[test]
fn bad_input_values_in_the_first_message_do_not_hide_a_sensor() {
    let log = changed(|i, _, mut message| {
        if i < 5 {
            message["position"] = json!(null);
        }
        Some(message)
    });
    let (report, _) = Trial::of(log).report(3);
    assert_eq!(report["sources"][0]["positions"], 156);
}

#[test]
fn bad_input_nan_and_infinity_in_cdr_are_left_out_with_a_warning() {
    let log = |bad_every: usize, bad: f64| {
        let mut log = TrialLog::new();
        log.channel("/beacon/odom", "cdr", ("nav_msgs/msg/Odometry", "ros2msg", &odometry_definition()));
        for (i, (t, mut p, v)) in Sensor::new(0.0, 8.0, 1).samples().into_iter().enumerate() {
            if i % bad_every == 0 {
                p[1] = bad;
            }
            let message = odometry(ns(t), p, [0.0, 0.0, 0.0, 1.0], v, [0.01, 0.01]);
            log.raw("/beacon/odom", [ns(t); 2], &message);
        }
        log.finish()
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (report, output) = Trial::of(log(20, bad)).report(3);
        assert_eq!(report["warnings"][0], "beacon: 9 samples are left out: NaN or infinite");
        assert!(output.track().iter().all(|w| w.vector("position").iter().all(|v| v.is_finite())));
        assert_says(&Trial::of(log(1, bad)).error(1), &["beacon", "NaN or infinite in all 161 messages"]);
    }
}

#[test]
fn bad_input_of_absurd_size_makes_no_empty_track() {
    for huge in [1e300, 1e154, 1e39] {
        let log = |every: usize| {
            changed(move |i, t, mut message| {
                if i % every == 0 {
                    message["position"] = xyz([huge * t.sin(), 0.0, huge]);
                }
                Some(message)
            })
        };
        for every in [1, 50] {
            let ran = Trial::of(log(every)).fuse(&[]);
            assert!(ran.code == 1 || (ran.code == 3 && ran.stderr.contains("warning")), "{huge}: {ran:#?}");
        }
    }
}

#[test]
fn bad_input_times_that_jump_by_hours_or_years_make_no_points() {
    for jump_s in [3600.0 * 5.0, -3600.0 * 5.0, 86_400.0 * 365.0 * 30.0, -86_400.0 * 365.0 * 30.0, 60.0] {
        let log = changed(|i, t, mut message| {
            if i == 77 {
                message["timestamp"] = stamp(ns(t + jump_s));
            }
            Some(message)
        });
        let (report, output) = Trial::of(log).report(3);
        assert!((150..300).contains(&output.track().len()), "{jump_s}: {}", output.track().len());
        let warnings = report["warnings"].to_string();
        assert_says(&warnings, &["1 sample more than 5 s away"]);
        assert_eq!(output.track()[0].timestamp_ns(), ns(0.0) as i64);
    }
}

#[test]
fn bad_input_times_that_go_back_are_sorted_with_a_warning() {
    let mut messages = Sensor::new(0.0, 8.0, 1).messages();
    messages.rotate_left(80);
    let mut log = TrialLog::new();
    messages.iter().for_each(|(t, m)| log.json("/tether/track", *t, m));
    let (report, output) = Trial::of(log.finish()).report(3);
    assert_says(report["warnings"][0].as_str().unwrap(), &["tether: times go back by up to 8.0 s"]);
    assert!(output.track().is_sorted_by_key(super::trial::Written::timestamp_ns));
}

#[test]
fn bad_input_samples_in_bursts_over_hours_do_not_make_a_huge_track() {
    // three samples a tenth of a millisecond apart, every 4 s for 40 min: the median interval says 10 kHz
    let mut log = TrialLog::new();
    for i in 0..600 {
        for offset in [0.0, 0.0001, 0.0002] {
            let t = 4.0 * f64::from(i) + offset;
            log.json("/tether/track", t, &json!({"timestamp": stamp(ns(t)), "position": xyz(position(t))}));
        }
    }
    let (report, output) = Trial::of(log.finish()).report(3);
    assert!(output.track().len() <= 200_000, "{}", output.track().len());
    assert_says(&report["warnings"].to_string(), &["output.rate_hz"]);
}

#[test]
fn bad_input_rate_that_makes_too_many_points_is_refused() {
    let trial =
        Trial::of(two_sensors()).config("[output]\nrate_hz = 10000\n[extrapolation]\nhorizon_s = 3600\n");
    assert_says(&trial.error(2), &["output.rate_hz is 10000", "points", "hint: "]);
}

#[test]
fn bad_input_of_a_whole_sensor_drops_it_with_a_warning_unless_the_config_names_it() {
    let with = |beacon: &dyn Fn(&mut TrialLog)| {
        let mut log = TrialLog::new();
        log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
        beacon(&mut log);
        log.finish()
    };
    let empty = with(&|log| {
        (0..100).for_each(|i| log.json("/beacon/track", f64::from(i) * 0.1, &json!({"position": null})));
    });
    let unreadable = with(&|log| {
        log.channel("/beacon/track", "protobuf", ("x.Track", "protobuf", "?"));
        log.raw("/beacon/track", [EPOCH_NS; 2], b"?");
    });
    for (log, why) in [(&empty, "null in all 100 messages"), (&unreadable, "protobuf descriptor: ")] {
        let (report, output) = Trial::of(log).report(3);
        assert_eq!(report["sources"].as_array().unwrap().len(), 1);
        assert_says(report["warnings"][0].as_str().unwrap(), &["beacon", why]);
        let again = Trial::of(log).config(&output.metadata["trackfuse:/fused"]["config"]).report(0).1;
        assert!(again.track().iter().zip(output.track()).all(|(a, b)| a.value == b.value));
    }
    let error = Trial::of(&empty).config(&source("/beacon/track.position")).error(1);
    assert_says(&error, &["source \"s\"", "null in all 100 messages"]);
    // a channel that only says how the sensor is, is no loss
    let status = with(&|log| log.json("/tether/tension", 0.0, &json!({"newton": 3})));
    assert_eq!(Trial::of(status).fuse(&[]).code, 0);
}

#[test]
fn bad_input_with_fewer_samples_than_a_fit_needs_says_how_many() {
    for count in 1..4 {
        let log = changed(|i, _, m| (i < count).then_some(m));
        assert_says(&Trial::of(log).error(1), &["need at least 4", &format!("got {count}")]);
    }
    let mut log = TrialLog::new();
    log.channel("/tether/track", "json", ("", "", ""));
    let trial = Trial::of(log.finish()).config(&source("/tether/track.position"));
    assert_says(&trial.error(1), &["source \"s\"", "/tether/track", "no messages"]);
}

#[test]
fn bad_input_all_samples_at_one_instant_is_an_error_that_says_so() {
    let log = changed(|_, _, mut m| {
        m["timestamp"] = stamp(EPOCH_NS);
        Some(m)
    });
    assert_says(
        &Trial::of(log).error(1),
        &["tether", "all 322 samples are of one instant", "\nhint: `time ="],
    );
}

#[test]
fn bad_input_topics_with_hostile_names_are_printed_on_one_line_and_can_be_used() {
    let hostile =
        ["/tether \"a\"\n/b\u{1b}[31m", "/трос/tether \u{202e}x", "/beacon.d [0]{x==1}", "/a\\b'c\0"];
    let mut log = TrialLog::new();
    log.sensor(hostile[0], &Sensor::new(0.0, 8.0, 1));
    log.sensor(hostile[2], &Sensor::new(5.0, 13.0, 2));
    for topic in hostile {
        log.sensor(
            &format!("/other{topic}").replace("tether", "x").replace("beacon", "y"),
            &Sensor::new(0.0, 8.0, 3),
        );
    }
    let log = log.finish();
    let trial = Trial::of(&log);
    let ran = trial.fuse(&[]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    assert!(!ran.stdout.contains('\u{1b}') && !ran.stdout.contains('\0'), "{}", ran.stdout);
    // What the summary says of the sources works as a config.
    let (report, output) = trial.report(0);
    assert_eq!(report["sources"].as_array().unwrap().len(), 2);
    let again = Trial::of(&log).config(&output.metadata["trackfuse:/fused"]["config"]);
    assert_eq!(again.fuse(&[]).code, 0);
    let error = Trial::of(&log).config(&source("/none.position")).error(2);
    assert!(!error.contains('\u{1b}') && error.lines().count() <= 2, "{error}");
}

#[test]
fn bad_input_json_of_any_depth_is_an_error_and_no_crash() {
    let deep = format!("{}{}", "[".repeat(10_000), "]".repeat(10_000));
    let mut log = TrialLog::new();
    log.raw("/tether/track", [EPOCH_NS; 2], deep.as_bytes());
    let log = log.finish();
    assert_says(&Trial::of(&log).error(2), &["no channel", "/tether/track", "recursion"]);
    let error = Trial::of(&log).config(&source("/tether/track.position")).error(2);
    assert_says(&error, &["\"/tether/track\"", "recursion"]);
    // one among good ones is left out
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.raw("/tether/track", [ns(9.0); 2], deep.as_bytes());
    let (report, _) = Trial::of(log.finish()).report(3);
    assert_says(&report["warnings"].to_string(), &["tether: 1 of 162 messages can't be decoded"]);
}

#[test]
fn bad_input_definition_that_contains_itself_is_an_error_and_no_crash() {
    let cyclic = "geometry_msgs/A a\n================\nMSG: geometry_msgs/A\ngeometry_msgs/B b\n================\n\
                  MSG: geometry_msgs/B\ngeometry_msgs/A a\n";
    let mut log = TrialLog::new();
    log.channel("/tether/track", "cdr", ("x/msg/T", "ros2msg", cyclic));
    log.raw("/tether/track", [EPOCH_NS; 2], &[0, 1, 0, 0]);
    let log = log.finish();
    assert_says(&Trial::of(&log).error(2), &["no channel", "/tether/track", "contains itself"]);
    let error = Trial::of(&log).config(&source("/tether/track.position")).error(2);
    assert_says(&error, &["\"/tether/track\"", "contains itself"]);
}

#[test]
fn bad_input_velocity_that_is_nan_throughout_says_how_to_do_without() {
    let mut log = TrialLog::new();
    log.channel("/beacon/odom", "cdr", ("nav_msgs/msg/Odometry", "ros2msg", &odometry_definition()));
    for (t, p, _) in Sensor::new(0.0, 8.0, 1).samples() {
        let message = odometry(ns(t), p, [0.0, 0.0, 0.0, 1.0], [f64::NAN; 3], [0.01, 0.01]);
        log.raw("/beacon/odom", [ns(t); 2], &message);
    }
    let log = log.finish();
    let (report, _) = Trial::of(&log).report(3);
    assert_says(report["warnings"][0].as_str().unwrap(), &["a velocity is left out", "NaN"]);
    let without = "[[source]]\nname = \"beacon\"\nposition = \"/beacon/odom.pose.pose.position\"\n";
    let with = format!("{without}velocity = \"/beacon/odom.twist.twist.linear\"\n");
    assert_says(&Trial::of(&log).config(&with).error(1), &["NaN", "\nhint: leave `velocity` out"]);
    assert_eq!(Trial::of(&log).config(without).fuse(&[]).code, 0);
}

#[test]
fn bad_input_velocities_alone_are_an_error_that_says_what_is_missing() {
    let trial =
        Trial::of(two_sensors()).config("[[source]]\nname = \"s\"\nvelocity = \"/tether/track.velocity\"\n");
    assert_says(&trial.error(1), &["position"]);
}
