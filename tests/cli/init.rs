//! `init` writes a config that gives the same track, or says what a person must decide.

use std::fs;

use serde_json::{Value, json};

use super::output::validate;
use super::trial::{Output, Trial, assert_says, logs, trackfuse};
use super::trial_log::{Sensor, TrialLog, changed, ns, stamp, two_sensors, xyz};

/// The track of the log without a config and with the one that `init` makes for it; and the exit codes of `init`
/// and the two runs.
fn with_and_without(log: &[u8]) -> ([Vec<Value>; 2], [i32; 3]) {
    let trial = Trial::of(log);
    let made = trackfuse(trial.folder(), &["init", "in.mcap", "-o", "trial.toml"]);
    let with = trial.fuse(&["-o", "with.mcap"]);
    let without = trial.fuse_with(&["in.mcap", "-o", "without.mcap"]);
    let track =
        |name: &str| Output::read(&trial.path(name)).track().iter().map(|w| w.value.clone()).collect();
    (["with.mcap", "without.mcap"].map(track), [made.code, with.code, without.code])
}

#[test]
fn init_makes_a_config_that_gives_the_same_track() {
    let (tracks, codes) = with_and_without(&two_sensors());
    assert_eq!(codes, [0; 3]);
    assert!(tracks[0].len() > 200 && tracks[0] == tracks[1]);
}

#[test]
fn init_leaves_out_what_fuse_leaves_out_and_says_so() {
    // a velocity that never has a value, and a sensor that no message of which can be read
    let mut log = TrialLog::new();
    for (t, mut message) in Sensor::new(0.0, 8.0, 1).messages() {
        message["velocity"] = Value::Null;
        log.json("/tether/track", t, &message);
        log.json("/beacon/status", t, &json!({"quality": 1}));
    }
    let log = log.finish();
    let (tracks, codes) = with_and_without(&log);
    assert_eq!(codes, [3, 0, 3], "what is left out was told once");
    assert!(tracks[0].len() > 100 && tracks[0] == tracks[1]);
    let ran = trackfuse(Trial::of(&log).folder(), &["init", "in.mcap"]);
    assert_says(
        &ran.stderr,
        &["warning: a velocity is left out: ", "warning: /beacon/status looks like a sensor's"],
    );
    assert_says(
        &ran.stdout,
        &["# warning: a velocity is left out: ", "\nposition = \"/tether/track.position\"\n"],
    );
    assert!(!ran.stdout.contains("velocity = "), "{}", ran.stdout);
}

#[test]
fn init_makes_configs_for_real_logs_that_give_the_same_track() {
    let mut paths = logs("climbs");
    paths.retain(|p| p.to_string_lossy().ends_with("_1.mcap"));
    paths.extend(logs("").into_iter().filter(|p| p.ends_with("flight_two_sensors.mcap")));
    for path in paths {
        let (tracks, [made, with, without]) = with_and_without(&fs::read(&path).unwrap());
        assert_eq!((made, with), (0, without), "{}", path.display());
        assert!(tracks[0].len() > 50 && tracks[0] == tracks[1], "{}", path.display());
    }
}

/// The config with the chosen source tables in force, of several paths the first.
fn chosen(config: &str) -> String {
    let mut keys: Vec<&str> = Vec::new();
    let line = |line: &str| {
        let key = line.split([' ', ']']).next().unwrap_or_default().to_owned();
        let wanted = ["#[[source", "#name", "#position", "#velocity", "#datum"].contains(&key.as_str());
        if key == "#[[source" {
            keys.clear();
        }
        if !wanted || line.ends_with("an example") || keys.contains(&&*key) {
            return line.to_owned();
        }
        keys.push(Box::leak(key.into_boxed_str()));
        line[1..].to_owned()
    };
    config.lines().map(line).map(|l| l + "\n").collect()
}

#[test]
fn init_lists_what_is_not_clear_and_the_config_runs_only_when_a_person_has_chosen() {
    let logs: [(&[&str], &str); 4] = [
        (&["/rov/pose", "/rov/odom", "/ship/pose"], "no topic's name says that it is a sensor's"),
        (&["/beacon/fix", "/beacon/pose", "/tether/track"], "several channels hold a position of beacon"),
        (&["/usbl/pose", "/lbl/pose"], "it is not clear which source is the datum"),
        (&["/\"quoted\" \u{7}/pose", "/ünï.cødé/pose", "/", ""], "no topic's name says"),
    ];
    for (topics, problem) in logs {
        let mut log = TrialLog::new();
        topics.iter().for_each(|topic| log.sensor(topic, &Sensor::new(0.0, 8.0, 1)));
        let log = log.finish();
        let error = Trial::of(&log).error(2);
        assert_says(
            &error,
            &["these would fit: ", "\nhint: `trackfuse init in.mcap -o in.toml` writes", "--config"],
        );

        let trial = Trial::of(&log);
        let made = trackfuse(trial.folder(), &["init", "in.mcap", "-o", "trial.toml"]);
        assert_eq!(made.code, 3, "{made:#?}");
        assert_says(&made.stdout, &["in.mcap -> trial.toml: no source yet\nwarning: "]);
        assert_says(
            &made.stderr,
            &["warning: the config names no source yet, and `fuse` refuses it", problem],
        );
        let config = fs::read_to_string(trial.path("trial.toml")).unwrap();
        assert!(!config.lines().any(|l| l.starts_with("[[source]]")), "{config}");
        assert_says(&trial.error(2), &[problem.split(' ').next().unwrap(), "these would fit: ", "hint: "]);
        let ran = Trial::of(&log).config(&chosen(&config)).fuse(&[]);
        assert_eq!(ran.code, 0, "{}\n{ran:#?}", chosen(&config));
    }
}

#[test]
fn init_says_so_where_nothing_can_be_a_source() {
    let mut log = TrialLog::new();
    log.json("/imu", 0.0, &json!({"gyro": 1}));
    let trial = Trial::of(log.finish());
    let made = trackfuse(trial.folder(), &["init", "in.mcap", "-o", "trial.toml"]);
    assert_eq!(made.code, 3, "{made:#?}");
    assert_says(&made.stderr, &["no channel holds a position or velocity that can be read"]);
    assert_says(&trial.error(2), &["no channel is recognised as a source"]);
}

#[test]
fn init_comments_the_channels_that_are_not_used_and_they_can_be() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/tether2", &Sensor::new(0.0, 8.0, 3));
    log.sensor("/rov/pose", &Sensor::new(4.0, 12.0, 2));
    // two tethers: no clear datum
    assert_eq!(trackfuse(Trial::of(log.finish()).folder(), &["init", "in.mcap"]).code, 3);
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/rov/pose", &Sensor::new(4.0, 12.0, 2));
    let log = log.finish();
    let made = trackfuse(Trial::of(&log).folder(), &["init", "in.mcap"]);
    assert_eq!((made.code, made.stderr.as_str()), (0, ""), "{made:#?}");
    assert_says(&made.stdout, &["\n#[[source]]\n#name = \"rov\"\n#position = \"/rov/pose.position\"\n"]);
    let (report, _) = Trial::of(log).config(&chosen(&made.stdout)).report(0);
    let names: Vec<_> = report["sources"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, ["tether", "rov"]);
}

/// A vehicle's positions and velocities on topics of their own, without a word of a sensor in their names.
fn split(topics: [&str; 2]) -> Trial {
    let mut log = TrialLog::new();
    for (t, p, v) in Sensor::new(0.0, 8.0, 1).samples() {
        log.json(topics[0], t, &json!({"timestamp": stamp(ns(t)), "position": xyz(p)}));
        log.json(topics[1], t, &json!({"timestamp": stamp(ns(t)), "velocity": xyz(v)}));
    }
    Trial::of(log.finish())
}

#[test]
fn init_makes_one_source_of_a_position_and_a_velocity_that_are_of_one_sensor() {
    let cases: [([&str; 2], &[&str], usize); 4] = [
        // their names say so
        (["/gps/pose", "/gps/twist"], &["--source", "/gps/pose", "--source", "/gps/twist"], 1),
        (["/gps/pose", "/gps/twist"], &["--source", "/gps/twist", "--source", "/gps/pose"], 1),
        // the user says so
        (["/usbl_p", "/dvl_v"], &["--source", "/dvl_v,/usbl_p"], 1),
        // nobody does
        (["/usbl_p", "/dvl_v"], &["--source", "/usbl_p", "--source", "/dvl_v"], 2),
    ];
    for (topics, args, count) in cases {
        let trial = split(topics);
        let made = trackfuse(trial.folder(), &[&["init", "in.mcap", "-o", "trial.toml"], args].concat());
        assert_eq!((made.code, made.stderr.as_str()), (0, ""), "{args:?}: {made:#?}");
        let (report, _) = trial.report(0);
        let sources = report["sources"].as_array().unwrap();
        assert_eq!(sources.len(), count, "{args:?}");
        if count == 1 {
            assert_eq!(sources[0]["position"], format!("{}.position", topics[0]));
            assert_eq!(sources[0]["velocity"], format!("{}.velocity", topics[1]));
        }
    }
    let trial = split(["/usbl_p", "/dvl_v"]);
    let refused = trackfuse(trial.folder(), &["init", "in.mcap", "--source", "/usbl_p,/usbl_p"]);
    assert_eq!(refused.code, 2, "{refused:#?}");
    assert_says(
        &refused.stderr,
        &["/usbl_p (position) and /usbl_p (position) are not one source", "one with a velocity"],
    );
    let unknown = trackfuse(trial.folder(), &["init", "in.mcap", "--source", "/usbl_p,/dvl"]);
    assert_says(&unknown.stderr, &["\"/dvl\" is not in the log", "hint: did you mean \"/dvl_v\"?"]);
}

#[test]
fn init_prints_what_it_writes_and_replaces_a_file_only_when_told() {
    let trial = Trial::of(two_sensors());
    let run = |args: &[&str]| trackfuse(trial.folder(), &[&["init", "in.mcap"], args].concat());
    let printed = run(&[]);
    assert_eq!((printed.code, printed.stderr.as_str()), (0, ""));
    let written = run(&["-o", "made.toml"]);
    assert_eq!(
        (written.code, written.stdout.as_str()),
        (0, "in.mcap -> made.toml: tether (datum), beacon\n")
    );
    let file = fs::read_to_string(trial.path("made.toml")).unwrap();
    assert_eq!(file, printed.stdout.replace("--config CONFIG", "--config made.toml"));

    fs::write(trial.path("made.toml"), "somebody's").unwrap();
    let refused = run(&["-o", "made.toml"]);
    assert_eq!((refused.code, refused.stdout.as_str()), (2, ""));
    assert_says(&refused.stderr, &["error: \"made.toml\" exists", "hint: `--force`"]);
    assert_eq!(fs::read_to_string(trial.path("made.toml")).unwrap(), "somebody's");
    assert_eq!(run(&["-o", "made.toml", "--force"]).code, 0);
    assert_eq!(fs::read_to_string(trial.path("made.toml")).unwrap(), file);

    let before = fs::read(trial.path("in.mcap")).unwrap();
    let itself = run(&["-o", "in.mcap", "--force"]);
    assert_eq!(itself.code, 2);
    assert_says(&itself.stderr, &["is the input itself"]);
    assert!(before == fs::read(trial.path("in.mcap")).unwrap());
    assert_eq!(run(&["-o", "no/such/made.toml"]).code, 1);
}

#[test]
fn init_as_json_is_one_object_with_the_config_in_it() {
    let trial = Trial::of(changed(|_, _, m| Some(m)));
    let ran = trackfuse(trial.folder(), &["init", "in.mcap", "--json", "-o", "made.toml"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["config"].as_str().unwrap(), fs::read_to_string(trial.path("made.toml")).unwrap());
    assert_eq!(report["output"], "made.toml");
    assert_eq!(report["undecided"], Value::Null);
    let source = json!({
        "name": "tether", "datum": true,
        "position": "/tether/track.position", "velocity": "/tether/track.velocity"
    });
    assert_eq!(report["sources"], json!([source]));
    let schema: Value = serde_json::from_str(include_str!("../../schemas/init.schema.json")).unwrap();
    validate(&report, &schema, &schema, "report");
}
