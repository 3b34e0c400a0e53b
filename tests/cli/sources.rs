//! Which channels become sources, and what their config keys do.

use serde_json::{Value, json};

use super::trial::{Trial, assert_says};
use super::trial_log::{
    Cdr, POSE_STAMPED, Sensor, TWIST_STAMPED, TrialLog, changed, definition, ns, odometry,
    odometry_definition, position, stamp, two_sensors, velocity, xyz,
};

fn names(report: &Value) -> Vec<&str> {
    report["sources"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn sources_are_recognised_by_their_topics_and_the_tether_is_the_datum() {
    let (report, output) = Trial::of(two_sensors()).report(0);
    assert_eq!(names(&report), ["tether", "beacon"]);
    assert_eq!(report["sources"][0]["datum"], true);
    for t in [1.0, 6.5, 12.0] {
        assert!(distance(output.near(t).vector("position"), position(t)) < 0.2, "at {t} s");
        assert!(distance(output.near(t).vector("velocity"), velocity(t)) < 0.3, "at {t} s");
    }
}

#[test]
fn sources_may_be_split_over_a_pose_and_a_velocity_channel_in_cdr() {
    let mut log = TrialLog::new();
    for (topic, name, body) in
        [("/gauge/pose", "PoseStamped", POSE_STAMPED), ("/gauge/velocity", "TwistStamped", TWIST_STAMPED)]
    {
        let name = format!("geometry_msgs/msg/{name}");
        log.channel(topic, "cdr", (&name, "ros2msg", &definition(body)));
    }
    for (t, p, v) in Sensor::new(0.0, 8.0, 1).samples() {
        let pose = Cdr::new().header(ns(t), "map").f64s(&p).f64s(&[0.0, 0.0, 0.0, 1.0]);
        log.raw("/gauge/pose", [ns(t); 2], &pose.done());
        let twist = Cdr::new().header(ns(t), "map").f64s(&v).f64s(&[0.0; 3]);
        log.raw("/gauge/velocity", [ns(t); 2], &twist.done());
    }
    let (report, output) = Trial::of(log.finish()).report(0);
    assert_eq!(names(&report), ["gauge"]);
    assert_eq!(report["sources"][0]["position"], "/gauge/pose.pose.position");
    assert_eq!(report["sources"][0]["velocity"], "/gauge/velocity.twist.linear");
    assert_eq!(report["track"]["frame_id"], "map");
    assert!(distance(output.near(4.0).vector("position"), position(4.0)) < 0.2);
}

#[test]
fn sources_are_never_what_a_topic_calls_truth_reference_ins_or_gt() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    for topic in ["/truth", "/reference/ins", "/gt/beacon", "/truth/tether", "/beaconGt/pose", "/ins/lbl"] {
        log.sensor(topic, &Sensor { bias_m: [50.0; 3], ..Sensor::new(0.0, 8.0, 2) });
    }
    log.sensor("/usv/pose", &Sensor { bias_m: [50.0; 3], ..Sensor::new(0.0, 8.0, 2) });
    let (report, _) = Trial::of(log.finish()).report(0);
    assert_eq!(names(&report), ["tether"]);
    assert_eq!(report["unused_topics"], json!(["/usv/pose"]));
}

#[test]
fn sources_that_nothing_offers_are_an_error_that_says_what_there_is() {
    let mut log = TrialLog::new();
    log.json("/imu", 0.0, &json!({"gyro": 1}));
    log.channel("/odom", "flatbuffer", ("Odometry", "flatbuffer", "?"));
    log.raw("/odom", [ns(0.0); 2], &[0; 8]);
    log.channel("/silent", "json", ("", "", ""));
    let error = Trial::of(log.finish()).error(2);
    assert_says(
        &error,
        &[
            "no channel is recognised",
            "/imu",
            "no position or velocity",
            "/odom",
            "\"flatbuffer\" is not supported",
            "/silent",
            "no messages",
        ],
    );
    assert_says(&Trial::of(TrialLog::new().finish()).error(2), &["no channels"]);
}

fn odometry_log(turn: [f64; 4]) -> Vec<u8> {
    let mut log = TrialLog::new();
    log.channel("/beacon/odom", "cdr", ("nav_msgs/msg/Odometry", "ros2msg", &odometry_definition()));
    for (t, p, _) in (Sensor { sigma: 0.01, ..Sensor::new(0.0, 8.0, 1) }).samples() {
        log.raw("/beacon/odom", [ns(t); 2], &odometry(ns(t), p, turn, velocity(t), [0.04, 0.25]));
    }
    log.finish()
}

#[test]
fn sources_of_odometry_have_their_velocity_turned_by_the_pose_unless_the_config_says_world() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let quarter_left = [0.0, 0.0, half, half];
    let config = "[[source]]\nname = \"beacon\"\nposition = \"/beacon/odom.pose.pose.position\"\n\
                  velocity = \"/beacon/odom.twist.twist.linear\"\nposition_sigma_m = 1000.0\n\
                  velocity_sigma_m_s = 0.001\n";
    let turned = Trial::of(odometry_log(quarter_left)).config(config).report(0).1;
    let world = format!("{config}velocity_frame = \"world\"\n");
    let straight = Trial::of(odometry_log(quarter_left)).config(&world).report(0).1;
    let [x, y, z] = velocity(4.0);
    assert!(distance(turned.near(4.0).vector("velocity"), [-y, x, z]) < 0.05);
    assert!(distance(straight.near(4.0).vector("velocity"), [x, y, z]) < 0.05);
    let json = Trial::of(two_sensors()).config(
        "[[source]]\nname = \"t\"\nposition = \"/tether/track.position\"\nvelocity = \"/tether/track.velocity\"\n\
         velocity_frame = \"body\"\n",
    );
    assert_says(&json.error(2), &["body frame", "orientation", "hint: ", "velocity_frame = \"world\""]);
}

#[test]
fn sources_take_their_sigmas_from_the_config_else_the_messages_else_their_scatter() {
    let none = [0.0, 0.0, 0.0, 1.0];
    let (report, _) = Trial::of(odometry_log(none)).report(0);
    let source = &report["sources"][0];
    assert_eq!(
        (&source["position_sigma_m"], &source["position_sigma_from"]),
        (&json!(0.2), &json!("messages"))
    );
    assert_eq!(
        (&source["velocity_sigma_m_s"], &source["velocity_sigma_from"]),
        (&json!(0.5), &json!("messages"))
    );
    let config = "[[source]]\nname = \"beacon\"\nposition = \"/beacon/odom.pose.pose.position\"\n\
                  position_sigma_m = 0.7\n";
    let (report, _) = Trial::of(odometry_log(none)).config(config).report(0);
    let source = &report["sources"][0];
    assert_eq!(
        (&source["position_sigma_m"], &source["position_sigma_from"]),
        (&json!(0.7), &json!("config"))
    );
    assert_eq!(source["velocity"], Value::Null);
    let (report, _) = Trial::of(two_sensors()).report(0);
    assert_eq!(report["sources"][0]["position_sigma_from"], "estimated");
    assert!((report["sources"][0]["position_sigma_m"].as_f64().unwrap() - 0.1).abs() < 0.02);
}

#[test]
fn sources_pull_the_track_towards_them_by_their_sigmas() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor { bias_m: [2.0, 0.0, 0.0], ..Sensor::new(0.0, 8.0, 2) });
    let log = log.finish();
    let x = |tether_m: f64, beacon_m: f64, code: i32| {
        let config = format!(
            "[[source]]\nname = \"tether\"\nposition = \"/tether/track.position\"\nposition_sigma_m = {tether_m:?}\n\
             [[source]]\nname = \"beacon\"\nposition = \"/beacon/track.position\"\nposition_sigma_m = {beacon_m:?}\n\
             [fusion]\nestimate = []\n"
        );
        let output = Trial::of(&log).config(&config).report(code).1;
        output.near(4.0).vector("position")[0] - position(4.0)[0]
    };
    assert!(x(0.1, 10.0, 0).abs() < 0.2);
    assert!((x(10.0, 0.1, 0) - 2.0).abs() < 0.2);
    assert!((x(0.1, 0.1, 3) - 1.0).abs() < 0.2);
}

/// A config of the tether alone, with more keys.
fn tether(keys: &str) -> String {
    format!(
        "[[source]]\nname = \"tether\"\nposition = \"/tether/track.position\"\nvelocity = \
         \"/tether/track.velocity\"\n{keys}\n"
    )
}

#[test]
fn sources_in_north_east_down_become_east_north_up() {
    let ned = changed(|_, _, mut message| {
        for field in ["position", "velocity"] {
            let [x, y, z] = ["x", "y", "z"].map(|axis| message[field][axis].as_f64().unwrap());
            message[field] = xyz([y, x, -z]);
        }
        Some(message)
    });
    let (_, output) = Trial::of(ned).config(&tether("axes = \"ned\"")).report(0);
    let plain = Trial::of(changed(|_, _, m| Some(m))).config(&tether("")).report(0).1;
    assert_eq!(output.near(4.0).value["position"], plain.near(4.0).value["position"]);
    assert_eq!(output.near(4.0).value["velocity"], plain.near(4.0).value["velocity"]);
}

#[test]
fn sources_are_moved_by_offset_m_and_taken_earlier_by_latency_s() {
    let log = || changed(|_, _, m| Some(m));
    let plain = Trial::of(log()).config(&tether("")).report(0).1;
    let moved = Trial::of(log()).config(&tether("offset_m = [1.0, -2.0, 3.0]")).report(0).1;
    let [a, b] = [&plain, &moved].map(|o| o.near(4.0).vector("position"));
    assert!(distance(b, [a[0] + 1.0, a[1] - 2.0, a[2] + 3.0]) < 1e-3);
    let late = Trial::of(log()).config(&tether("latency_s = 0.25")).report(0).1;
    assert_eq!(late.track()[0].timestamp_ns(), ns(-0.25) as i64);
    assert_eq!(late.track()[0].value["position"], plain.track()[0].value["position"]);
}

/// Messages stamped at t, published 0.1 s and logged 0.3 s later.
fn three_clocks(stamped: impl Fn(f64) -> Option<u64>, published: bool) -> Vec<u8> {
    let mut log = TrialLog::new();
    for (t, mut message) in Sensor::new(0.0, 8.0, 1).messages() {
        match stamped(t) {
            Some(ns) => message["timestamp"] = stamp(ns),
            None => drop(message.as_object_mut().unwrap().remove("timestamp")),
        }
        let publish_time = if published { ns(t + 0.1) } else { 0 };
        log.raw("/tether/track", [ns(t + 0.3), publish_time], message.to_string().as_bytes());
    }
    log.finish()
}

#[test]
fn sources_are_timed_by_stamp_else_publish_time_else_log_time_where_0_counts_as_absent() {
    let stamped = |t: f64| Some(ns(t));
    for (log, key, clock, first_s) in [
        (three_clocks(stamped, true), "", "stamp", 0.0),
        (three_clocks(|_| Some(0), true), "", "publish", 0.1),
        (three_clocks(|_| None, true), "", "publish", 0.1),
        (three_clocks(|_| Some(0), false), "", "log", 0.3),
        (three_clocks(stamped, true), "time = \"publish\"", "publish", 0.1),
        (three_clocks(stamped, true), "time = \"log\"", "log", 0.3),
        (three_clocks(stamped, true), "time = \"stamp\"", "stamp", 0.0),
    ] {
        let (report, output) = Trial::of(log).config(&tether(key)).report(0);
        assert_eq!(report["sources"][0]["clock"], clock, "{key}");
        assert_eq!(output.track()[0].timestamp_ns(), ns(first_s) as i64, "{key} {clock}");
        let delay = report["sources"][0]["delay_s"].as_f64().unwrap();
        assert!((delay - (0.3 - first_s)).abs() < 1e-6, "{delay}");
    }
    // asked for, but absent
    for (log, key) in [
        (three_clocks(|_| None, true), "time = \"stamp\""),
        (three_clocks(stamped, false), "time = \"publish\""),
    ] {
        assert_says(&Trial::of(log).config(&tether(key)).error(1), &["tether", key]);
    }
}

#[test]
fn sources_with_some_stamps_missing_are_warned_of() {
    let log = three_clocks(|t| Some(if t < 1.0 { 0 } else { ns(t) }), true);
    let (report, _) = Trial::of(log).report(3);
    assert_says(
        &report["warnings"].to_string(),
        &["141 samples are timed by stamp, 20 by publish time", "`time`"],
    );
}

#[test]
fn sources_stamped_in_another_epoch_than_the_log_keep_their_stamps_and_shift_the_log_time() {
    let since_boot = |t: f64| Some(1_000_000_000 + (t * 1e9) as u64);
    let (report, output) = Trial::of(three_clocks(since_boot, true)).report(3);
    assert_says(&report["warnings"].to_string(), &["of different epochs", "log times are"]);
    let first = &output.track()[0];
    assert_eq!(first.timestamp_ns(), 1_000_000_000);
    let shift = first.log_time as i64 - first.timestamp_ns();
    assert!((shift - (ns(0.3) as i64 - 1_000_000_000)).abs() < 1_000_000, "{shift}");
    for written in output.track() {
        assert_eq!(written.log_time, written.publish_time);
        assert!((written.log_time as i64 - written.timestamp_ns() - shift).abs() < 1000);
    }
}

#[test]
fn sources_on_clocks_of_different_epochs_are_refused_by_name() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    for (t, mut message) in Sensor::new(5.0, 13.0, 2).messages() {
        message["timestamp"] = stamp((t * 1e9) as u64);
        log.json("/beacon/track", t, &message);
    }
    let error = Trial::of(log.finish()).error(2);
    assert_says(
        &error,
        &["tether's and beacon's clocks are of different epochs", "hint: set `time = \"log\"`"],
    );
}
