//! `inspect` tells what is in a log, whatever the log.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use mcap::WriteOptions;
use serde_json::{Value, json};

use super::output::validate;
use super::trial::{Trial, assert_says, logs, trackfuse};
use super::trial_log::{EPOCH_NS, Sensor, TrialLog, ns, stamp, two_sensors};

/// Text and JSON of a log whose inspection must end with `code`.
fn inspect(log: impl AsRef<[u8]>, code: i32) -> (String, Value) {
    let trial = Trial::of(log);
    let text = trackfuse(trial.folder(), &["inspect", "in.mcap"]);
    let json = trackfuse(trial.folder(), &["inspect", "in.mcap", "--json", "--quiet"]);
    assert_eq!((text.code, json.code), (code, code), "{text:#?}");
    assert_eq!(text.stderr.is_empty(), code == 0, "{text:#?}");
    let report = serde_json::from_str(&json.stdout).unwrap();
    let schema: Value = serde_json::from_str(include_str!("../../schemas/inspect.schema.json")).unwrap();
    validate(&report, &schema, &schema, "report");
    (text.stdout, report)
}

fn channel<'v>(report: &'v Value, topic: &str) -> &'v Value {
    report["channels"].as_array().unwrap().iter().find(|c| c["topic"] == topic).unwrap()
}

#[test]
fn inspect_shows_the_file_the_sources_and_their_rates() {
    let mut log = TrialLog::new();
    log.json("/imu", 0.0, &json!({"gyro": 1}));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(5.0, 13.0, 2));
    log.sensor("/rov/pose", &Sensor::new(5.0, 13.0, 2));
    log.sensor("/truth", &Sensor::new(0.0, 8.0, 2));
    let (text, report) = inspect(log.finish(), 0);
    assert_says(
        &text,
        &[
            "recorded    2024-11-07 17:20:00.000 .. 17:20:13.000 UTC, 13.00 s",
            "content     645 messages, 5 channels",
            "index       complete",
            "checksums   right: summary, ",
            " chunks; not checked: data section, ",
            "fuse        would run, with tether (datum), beacon",
            "source tether (datum), frame \"enu\": /tether/track.position, /tether/track.velocity\n",
            "could be sources, where a config names them\n  /rov/pose",
            "can't be sources\n  /imu",
            "no position\n",
            "reference\n",
        ],
    );
    let order: Vec<_> = report["channels"].as_array().unwrap().iter().map(|c| &c["topic"]).collect();
    assert_eq!(order, ["/tether/track", "/beacon/track", "/rov/pose", "/imu", "/truth"]);
    let tether = channel(&report, "/tether/track");
    assert_eq!(
        (&tether["messages"], &tether["role"], &tether["source"]),
        (&json!(161), &json!("source"), &json!("tether"))
    );
    assert_eq!(tether["times"]["rate_hz"], 20.0);
    assert_eq!(tether["times"]["span_s"], json!([0.0, 8.0]));
    assert_eq!((&tether["times"]["gaps"], &tether["times"]["out_of_order"]), (&json!(0), &json!(0)));
    assert_eq!(tether["times"]["first_ns"], EPOCH_NS.to_string());
    assert_eq!(channel(&report, "/imu")["unusable"]["reason"], "no position or velocity in gyro");
    assert_eq!(report["fuse"]["refusals"], json!([]));
}

#[test]
fn inspect_finds_gaps_jitter_and_the_delay_of_stamps() {
    let mut log = TrialLog::new();
    for (i, (t, message)) in Sensor::new(0.0, 40.0, 1).messages().into_iter().enumerate() {
        // Logged 100 ms late, a quarter of them 8 ms more and a quarter less; two silences.
        let late_s = 0.1 + [0.0, 0.008, 0.0, -0.008][i % 4];
        if !(10.0..12.0).contains(&t) && !(20.0..25.0).contains(&t) {
            log.raw("/tether/track", [ns(t + late_s); 2], message.to_string().as_bytes());
        }
    }
    let (text, report) = inspect(log.finish(), 0);
    let tether = channel(&report, "/tether/track");
    let number = |part: &str, name: &str| tether[part][name].as_f64().unwrap();
    assert_eq!(tether["times"]["gaps"], 2);
    assert!((number("times", "longest_gap_s") - 5.05).abs() < 0.02);
    assert!((number("times", "longest_gap_at_s") - 19.95).abs() < 0.02);
    assert!((number("times", "jitter_s") - 0.008).abs() < 1e-6);
    assert!((number("clock", "delay_s") - 0.1).abs() < 1e-9);
    assert!((number("clock", "delay_spread_s") - 0.008).abs() < 1e-9);
    assert_eq!((&tether["clock"]["clock"], &tether["clock"]["frame_id"]), (&json!("stamp"), &json!("enu")));
    assert_says(
        &text,
        &["2, 5.0", "100.0 ± 8.0", "note: /tether/track: the longest gap is 5.1 s from 19.94 s"],
    );
}

#[test]
fn inspect_notices_clocks_that_differ_drift_or_go_back() {
    let late = |delay_s: fn(f64) -> f64| {
        let mut log = TrialLog::new();
        for (t, message) in Sensor::new(0.0, 40.0, 1).messages() {
            log.raw("/tether/track", [ns(t + delay_s(t)); 2], message.to_string().as_bytes());
        }
        log.finish()
    };
    let (text, _) = inspect(late(|_| -0.25), 0);
    assert_says(&text, &["note: /tether/track: stamps are 250.0 ms ahead of the log's times"]);
    let (text, _) = inspect(late(|t| 0.1 + 0.01 * t), 0);
    assert_says(&text, &["note: /tether/track: log time less stamp grows by 26", "a clock drifts"]);

    let mut back = TrialLog::new();
    let mut epoch = TrialLog::new();
    for (t, mut message) in Sensor::new(0.0, 8.0, 1).messages() {
        message["timestamp"] = stamp(ns(if t > 4.0 { t - 3.0 } else { t }));
        back.json("/tether/track", t, &message);
        message["timestamp"] = stamp((1e9 * t) as u64 + 1);
        epoch.json("/tether/track", t, &message);
        message["timestamp"] = stamp(ns(t));
        epoch.json("/beacon/track", t, &message);
    }
    let (text, _) = inspect(back.finish(), 3);
    assert_says(&text, &["warning: /tether/track: times go back by up to 3.0 s"]);
    let (text, _) = inspect(epoch.finish(), 3);
    assert_says(&text, &["fuse        would refuse: ", "clocks are of different epochs", "20035 days ± 0.0"]);
}

#[test]
fn inspect_notices_sources_that_never_meet_and_those_that_come_in_bursts() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 4.0, 1));
    log.sensor("/beacon/track", &Sensor::new(6.0, 10.0, 2));
    let (text, _) = inspect(log.finish(), 0);
    assert_says(&text, &["note: tether and beacon are never recorded at the same time"]);
    let mut log = TrialLog::new();
    for (i, (_, message)) in Sensor::new(0.0, 40.0, 1).messages().into_iter().enumerate() {
        // ten at a time, twice a second
        log.json("/tether/track", (i / 10) as f64 * 0.5 + (i % 10) as f64 * 0.001, &message);
    }
    let (text, _) = inspect(log.finish(), 0);
    assert_says(&text, &["note: /tether/track: recorded in bursts: 1000.000 Hz by the median interval, 20."]);
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 4.0, 1));
    log.sensor("/beacon/track", &Sensor::new(2.0, 10.0, 2));
    assert!(!inspect(log.finish(), 0).0.contains("note: "));
}

#[test]
fn inspect_warns_of_a_summary_that_counts_wrong() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    let mut bytes = log.finish();
    // The statistics end with a map of one channel: its length in bytes, id, count.
    let is_map = |w: &[u8]| w[..4] == 10_u32.to_le_bytes() && w[6..] == 161_u64.to_le_bytes();
    let at = bytes.windows(14).rposition(is_map).unwrap();
    bytes[at + 6] = 160;
    let crc = bytes.len() - 12;
    bytes[crc..crc + 4].fill(0);
    let (text, report) = inspect(bytes, 3);
    assert_says(
        &text,
        &[
            "warning: there are other numbers of messages than the summary says: /tether/track: 161, not 160\n",
        ],
    );
    assert_says(&text, &["checksums   right: "]);
    assert_eq!(report["checksums"]["summary"], "none");
}

#[test]
fn inspect_notices_log_times_that_repeat_go_back_or_are_no_dates() {
    let mut log = TrialLog::new();
    for t in [0.0, 1.0, 2.0, 1.5, 2.0, 3.0, 3.0, 3.0] {
        log.json("/a", t, &json!({}));
    }
    let (text, report) = inspect(log.finish(), 0);
    assert_says(
        &text,
        &[
            "note: messages out of the order of log time: /a: 1, by up to 500.0 ms\n",
            "note: messages with the log time of the one before: /a: 3\n",
        ],
    );
    assert_eq!(channel(&report, "/a")["messages"], 8);
    let mut log = TrialLog::new();
    log.raw("/early", [5, 5], b"{}");
    log.json("/a", 1.0, &json!({}));
    let (text, _) = inspect(log.finish(), 3);
    assert_says(&text, &["warning: some log times are dates and others can't be: those of /early\n"]);
    let mut log = TrialLog::new();
    log.raw("/early", [5, 5], b"{}");
    assert_says(
        &inspect(log.finish(), 0).0,
        &["recorded    0.000000005 s .. 0.000000005 s, which are no dates"],
    );
}

#[test]
fn inspect_says_what_is_not_clear_and_names_the_init_line() {
    for topics in
        [&["/rov/pose", "/ship/pose"][..], &["/usbl/pose", "/lbl/pose"], &["/beacon/a", "/beacon/b"]]
    {
        let mut log = TrialLog::new();
        topics.iter().for_each(|topic| log.sensor(topic, &Sensor::new(0.0, 8.0, 1)));
        let (text, report) = inspect(log.finish(), 0);
        assert_says(
            &text,
            &["fuse        would refuse: ", "\nhint: `trackfuse init in.mcap -o in.toml` writes"],
        );
        assert_eq!(report["fuse"]["sources"], json!([]));
        for topic in topics {
            assert_eq!(channel(&report, topic)["role"], "candidate");
        }
    }
    let (text, report) = inspect(TrialLog::new().finish(), 0);
    assert_says(&text, &["recorded    nothing", "content     0 messages, 0 channels"]);
    assert_eq!(report["fuse"]["hint"], Value::Null);
}

#[test]
fn inspect_says_how_readers_find_messages_and_what_stands_against_adding_channels() {
    for (options, says) in [
        (WriteOptions::new().use_chunks(false), "readers must scan the output"),
        (WriteOptions::new().emit_message_indexes(false), "as before"),
    ] {
        let mut log = TrialLog::with(options);
        log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
        let (text, report) = inspect(log.finish(), 0);
        assert_says(&text, &["would run, with tether", "note: the log has messages that ", says]);
        assert_eq!(channel(&report, "/tether/track")["times"]["rate_hz"], 20.0);
    }
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let (text, report) = inspect(fs::read(trial.path("in.fused.mcap")).unwrap(), 0);
    assert_says(&text, &["results     ", "/fused/track", "/fused/track is in the log already: `--prefix`"]);
    assert_eq!(channel(&report, "/fused/track")["unusable"]["short"], "by trackfuse");
}

#[test]
fn inspect_tells_the_rest_of_a_log_with_a_damaged_chunk() {
    let mut bytes = two_sensors();
    let at = bytes.windows(11).position(|w| w == b"\x06\0\0\0\0\0\0\0\0\0\0").unwrap_or(400);
    // Somewhere within the first chunk.
    bytes[at.min(600)] ^= 0xff;
    let (text, report) = inspect(&bytes, 3);
    assert_says(&text, &["warning: \"in.mcap\" is damaged at offset"]);
    assert_eq!(text.matches("is damaged at").count(), 1, "{text}");
    assert_eq!(channel(&report, "/beacon/track")["messages"], 161);
    assert_eq!(channel(&report, "/tether/track")["role"], "source");
}

#[test]
fn inspect_of_a_log_that_is_cut_off_tells_what_is_left() {
    let mut bytes = two_sensors();
    bytes.truncate(bytes.len() / 2);
    let (text, report) = inspect(&bytes, 3);
    assert_says(
        &text,
        &[
            "index       no summary",
            "not checked: summary",
            "would run",
            "warning: \"in.mcap\" is damaged at offset ",
            "the log is cut off",
        ],
    );
    assert_eq!(report["checksums"]["summary"], "not used");
    assert!(channel(&report, "/tether/track")["messages"].as_u64() > Some(20));
    let ran = trackfuse(Trial::of("no log").folder(), &["inspect", "in.mcap"]);
    assert_eq!(ran.code, 1);
    assert_says(&ran.stderr, &["is not an MCAP"]);
}

#[test]
fn inspect_of_many_channels_stays_readable_and_shows_sources_first() {
    let mut log = TrialLog::new();
    for i in 0..150 {
        let topic = format!("/vehicle/subsystem_{i:03}/{}", "a_long_name/".repeat(i % 4));
        log.channel(
            &topic,
            "json",
            (&format!("some_vendor_msgs/msg/SomethingQuiteLong{i}"), "jsonschema", "{}"),
        );
        for k in 0..(i % 5) {
            log.json(&topic, k as f64 * 0.5, &json!({"v": 1}));
        }
    }
    log.json("/evil\u{1b}[31m\n/x", 0.0, &json!({}));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    let (text, report) = inspect(log.finish(), 0);
    for (topic, schema) in
        [("", "a_very_long_name/".repeat(9)), ("/a/long/name".repeat(9).as_str(), "x".into())]
    {
        let mut log = TrialLog::new();
        log.channel(topic, "json", (&schema, "jsonschema", "{}"));
        log.json(topic, 0.0, &json!({}));
        assert!(inspect(log.finish(), 0).0.lines().all(|l| l.chars().count() <= 120));
    }
    assert_eq!(report["channels"].as_array().unwrap().len(), 152);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.len() < 110, "{} lines", lines.len());
    for line in &lines {
        assert!(line.chars().count() <= 120, "{line}");
        assert!(!line.contains('\u{1b}'));
    }
    assert!(lines[8].starts_with("source tether"), "{text}");
    assert_says(&text, &["and ", " more, see `--json`", "without messages: "]);
}

#[test]
fn inspect_has_an_answer_or_an_error_wherever_a_byte_is_wrong() {
    let bytes = two_sensors();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.mcap");
    let mut opened = 0;
    for at in (0..bytes.len()).step_by(31) {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x55;
        fs::write(&path, &bytes).unwrap();
        if let Ok(log) = trackfuse::log::Log::open(&path) {
            opened += 1;
            let inspection = trackfuse::inspect::inspect(&log);
            assert!(trackfuse::report::render_inspection(&inspection).contains("in.mcap"));
        }
    }
    assert!(opened > 100, "{opened}");
}

#[cfg(target_os = "linux")]
#[test]
fn inspect_and_init_that_cannot_print_their_result_fail() {
    let trial = Trial::of(two_sensors());
    for command in ["inspect", "init"] {
        let mut run = std::process::Command::new(env!("CARGO_BIN_EXE_trackfuse"));
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let done = run.args([command, "in.mcap"]).current_dir(trial.folder()).stdout(full).output().unwrap();
        assert_eq!(done.status.code(), Some(1));
        assert_says(&String::from_utf8(done.stderr).unwrap(), &["error: the result can't be printed: "]);
    }
}

#[test]
fn inspect_warns_of_what_a_source_lacks_and_shows_the_rest() {
    let mut log = TrialLog::new();
    for (t, mut message) in Sensor::new(0.0, 8.0, 1).messages() {
        message["velocity"] = Value::Null;
        if t < 1.0 {
            message["position"]["x"] = Value::Null;
        }
        log.json("/tether/track", t, &message);
        log.json("/beacon/status", t, &json!({"quality": 1}));
    }
    let (text, report) = inspect(log.finish(), 3);
    assert_says(
        &text,
        &[
            "warning: source \"/tether/track\": /tether/track.velocity is null in all 161 messages",
            "warning: /tether/track: 181 samples are left out: no vector at the path\n",
            "warning: /beacon/status looks like a sensor's and is not used: no position or velocity in quality\n",
            "0.0 ± 0.0",
        ],
    );
    assert_eq!(report["fuse"]["refusals"], json!([]));
}

fn everything() -> Vec<PathBuf> {
    let folders = ["", "climbs", "others", "rosbag2"].map(String::from);
    let conformance =
        ["NoData", "OneAttachment", "OneMessage", "OneMetadata", "OneSchemalessMessage", "TenMessages"]
            .map(|name| format!("mcap-conformance/{name}"));
    folders.iter().chain(&conformance).flat_map(|folder| logs(folder)).collect()
}

/// Count, first and last log time of each channel, ns, by the mcap crate's reader.
fn counted(path: &Path) -> BTreeMap<u64, (u64, u64, u64)> {
    let bytes = fs::read(path).unwrap();
    let mut counts = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let time = message.log_time;
        let (count, first, last) = counts.entry(u64::from(message.channel.id)).or_insert((0, time, time));
        (*count, *first, *last) = (*count + 1, time.min(*first), time.max(*last));
    }
    counts
}

/// The same as `inspect` has it.
fn told(report: &Value) -> BTreeMap<u64, (u64, u64, u64)> {
    let ns = |v: &Value| v.as_str().unwrap().parse().unwrap();
    let channels = report["channels"].as_array().unwrap().iter().filter(|c| c["messages"] != 0);
    let of = |c: &Value| {
        (c["messages"].as_u64().unwrap(), ns(&c["times"]["first_ns"]), ns(&c["times"]["last_ns"]))
    };
    channels.map(|c| (c["id"].as_u64().unwrap(), of(c))).collect()
}

#[test]
fn inspect_has_an_answer_for_every_real_log_and_its_counts_are_right() {
    let folder = tempfile::tempdir().unwrap();
    for path in everything() {
        let name = path.display().to_string();
        let text = trackfuse(folder.path(), &["inspect", &name]);
        assert!(matches!(text.code, 0 | 3), "{text:#?}");
        let json = trackfuse(folder.path(), &["inspect", &name, "--json"]);
        let report: Value = serde_json::from_str(&json.stdout).unwrap();
        assert_eq!(told(&report), counted(&path), "{name}");
        assert_eq!(report["warnings"].as_array().unwrap().is_empty(), text.code == 0, "{name}");
        let made = trackfuse(folder.path(), &["init", &name]);
        assert!(matches!(made.code, 0 | 3), "{made:#?}");
        assert_eq!(made.code == 3, made.stdout.contains("# warning: "), "{name}");
    }
}

#[test]
fn inspect_counts_as_an_independent_reader_does() {
    let Some(python) = std::env::var_os("TRACKFUSE_TEST_PYTHON") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_PYTHON is not set\n");
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/independent_counts.py");
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs/steep_climb.mcap");
    let chosen = ["husky_gps_odom_ros1.mcap", "ais_solent.mcap", "talker.mcap", "OneMessage-ch-mx.mcap"];
    let mut paths = everything();
    paths.retain(|p| chosen.iter().any(|name| p.ends_with(name)));
    paths.push(samples);
    for path in paths {
        let done = std::process::Command::new(&python).arg(&script).arg(&path).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let counts: BTreeMap<String, (u64, String, String)> = serde_json::from_slice(&done.stdout).unwrap();
        let number = |text: &str| text.parse::<u64>().unwrap();
        let counts =
            counts.iter().map(|(id, (n, first, last))| (number(id), (*n, number(first), number(last))));
        let json = trackfuse(Path::new("."), &["inspect", &path.display().to_string(), "--json"]);
        assert_eq!(
            told(&serde_json::from_str(&json.stdout).unwrap()),
            counts.collect(),
            "{}",
            path.display()
        );
    }
}
