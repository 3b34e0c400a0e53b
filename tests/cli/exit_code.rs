//! Which code a run ends with, and what it says then.

use std::fs;

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::{Sensor, TrialLog, changed, two_sensors};

#[test]
fn exit_code_0_and_no_word_on_stderr_for_two_honest_sensors() {
    for seed in 0..4 {
        let mut log = TrialLog::new();
        log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 10 + seed));
        log.sensor("/beacon/track", &Sensor { sigma: 0.3, ..Sensor::new(5.01, 13.0, 20 + seed) });
        let ran = Trial::of(log.finish()).fuse(&[]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:#?}");
        assert!(!ran.stdout.contains("warning"), "{}", ran.stdout);
        assert_says(&ran.stdout, &["in.mcap -> in.fused.mcap", "tether (datum)", "overlap: tether + beacon"]);
    }
}

#[test]
fn exit_code_0_for_one_sensor_and_the_summary_says_that_it_is_alone() {
    let ran = Trial::of(changed(|_, _, m| Some(m))).fuse(&[]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:#?}");
    assert_says(&ran.stdout, &["one source only", "single: tether"]);
}

#[test]
fn exit_code_3_for_sensors_that_disagree_unregistered_and_the_warning_says_who_and_by_how_much() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor { bias_m: [2.0, 0.0, 0.0], ..Sensor::new(5.0, 13.0, 2) });
    let log = log.finish();
    let ran = Trial::of(&log).config("[fusion]\nestimate = []\n").fuse(&[]);
    assert_eq!(ran.code, 3);
    assert_says(&ran.stderr, &["warning: ", "beacon", "tether", "disagree in position", "m"]);
    let ran = Trial::of(&log).fuse(&[]);
    assert!(!ran.stderr.contains("disagree"), "registered, they agree: {ran:#?}");
    assert_says(&ran.stdout, &["errors of", "bias", "clock offset"]);
}

#[test]
fn exit_code_3_for_sensors_that_never_meet() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 6.0, 1));
    log.sensor("/beacon/track", &Sensor::new(8.0, 13.0, 2));
    let ran = Trial::of(log.finish()).fuse(&[]);
    assert_eq!(ran.code, 3);
    assert_says(&ran.stderr, &["tether and beacon never measure position at the same time"]);
}

#[test]
fn exit_code_2_for_wrong_usage() {
    let trial = Trial::of(two_sensors());
    for args in [&["in.mcap", "--no-such"][..], &[], &["in.mcap", "--prefix"]] {
        assert_eq!(trial.fuse_with(args).code, 2, "{args:?}");
    }
    assert_eq!(trackfuse(trial.folder(), &["no-such-command"]).code, 2);
    let help = trackfuse(trial.folder(), &["--help"]);
    assert_eq!((help.code, help.stderr.as_str()), (0, ""));
    assert_says(&help.stdout, &["fuse", "simulate"]);
}

#[test]
fn exit_code_2_for_an_existing_output_until_force_replaces_it() {
    let trial = Trial::of(two_sensors());
    fs::write(trial.path("out.mcap"), "somebody's").unwrap();
    let ran = trial.fuse(&["-o", "out.mcap"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["error: \"out.mcap\" exists", "\nhint: `--force` replaces it"]);
    assert_eq!(trial.fuse(&["-o", "out.mcap", "--force"]).code, 0);
    assert!(fs::read(trial.path("out.mcap")).unwrap().starts_with(b"\x89MCAP0"));
}

#[test]
fn exit_code_2_for_an_output_that_is_the_input_by_whatever_name() {
    let trial = Trial::of(two_sensors());
    fs::hard_link(trial.path("in.mcap"), trial.path("hard.mcap")).unwrap();
    let mut names = vec!["in.mcap", "./in.mcap", "hard.mcap"];
    if cfg!(unix) {
        #[cfg(unix)]
        std::os::unix::fs::symlink("in.mcap", trial.path("soft.mcap")).unwrap();
        names.push("soft.mcap");
    }
    for name in names {
        for force in [&[][..], &["--force"]] {
            let ran = trial.fuse(&[&["-o", name], force].concat());
            assert_eq!(ran.code, 2, "{ran:#?}");
            assert_says(&ran.stderr, &["is the input itself", "\nhint: `-o` names another"]);
        }
    }
}

#[test]
fn exit_code_2_for_a_config_that_is_wrong_and_the_message_says_where() {
    let cases = [
        (
            "[output]\nrate = 5\n",
            &["trial.toml: line 2: unknown field `rate`", "hint: did you mean `rate_hz`?"][..],
        ),
        ("[output\n", &["trial.toml: line 1"]),
        ("[output]\nrate_hz = \"fast\"\n", &["trial.toml: line 2", "expected a number"]),
        ("[fusion]\norder = 0\n", &["fusion.order is 0, expected 1 to 48"]),
        ("[output]\nprefix = \"fused\"\n", &["output.prefix is \"fused\", expected \"/name\""]),
        ("[source]\nname = \"a\"\n", &["trial.toml: line 1", "list of tables", "hint: two brackets"]),
        ("[fusion]\nestimate = \"al\"\n", &["trial.toml: line 2: expected \"auto\", [], or a list"]),
    ];
    for (text, parts) in cases {
        assert_says(&Trial::of(two_sensors()).config(text).error(2), parts);
    }
    let trial = Trial::of(two_sensors());
    let ran = trial.fuse(&["--config", "no-such.toml"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["config no-such.toml: "]);
    fs::write(trial.path("binary.toml"), [0xff, 0xfe, 0]).unwrap();
    assert_eq!(trial.fuse(&["--config", "binary.toml"]).code, 2);
    assert_eq!(trial.fuse(&["--config", "in.mcap"]).code, 2, "arguments in the wrong order");
}

#[test]
fn exit_code_2_for_a_log_that_was_fused_before_and_another_prefix_works() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let again = Trial::of(fs::read(trial.path("in.fused.mcap")).unwrap());
    assert_says(&again.error(2), &["already has the topic \"/fused/track\"", "\nhint: ", "`--prefix`"]);
    // The earlier track is no sensor, whatever it is called.
    assert_eq!(again.fuse(&["--prefix", "/beacon_fused", "-o", "second.mcap"]).code, 0);
    let third = Trial::of(fs::read(again.path("second.mcap")).unwrap());
    let ran = third.fuse(&["--prefix", "/third"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    assert!(!ran.stdout.contains("not used"), "an own track is no candidate: {}", ran.stdout);
}

#[test]
fn exit_code_1_for_an_output_that_cannot_be_written() {
    let trial = Trial::of(two_sensors());
    fs::create_dir(trial.path("folder")).unwrap();
    for (name, says) in [
        ("no/such/out.mcap", "no folder no/such"),
        ("folder", "is a directory"),
        ("in.mcap/out.mcap", "no folder in.mcap"),
    ] {
        for force in [&[][..], &["--force"]] {
            let ran = trial.fuse(&[&["-o", name], force].concat());
            assert_eq!(ran.code, 1, "{ran:#?}");
            assert_says(&ran.stderr, &["cannot write", name, says]);
        }
    }
}

#[cfg(unix)]
#[test]
fn exit_code_1_for_an_output_that_is_a_device_which_force_must_not_replace() {
    let trial = Trial::of(two_sensors());
    let _listening = std::os::unix::net::UnixListener::bind(trial.path("socket")).unwrap();
    for force in [&[][..], &["--force"]] {
        let ran = trial.fuse(&[&["-o", "socket"], force].concat());
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(&ran.stderr, &["cannot write \"socket\": it is no regular file"]);
    }
    assert!(!trial.path("socket").is_file());
}

#[test]
fn exit_code_of_simulate_is_0_for_a_log_2_for_a_bad_scenario_and_for_an_existing_output() {
    let trial = Trial::of("not read");
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs");
    let scenario = samples.join("steep_climb.scenario.toml").display().to_string();
    let ran = trackfuse(trial.folder(), &["simulate", &scenario, "-o", "made.mcap"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let stored = fs::read(samples.join("steep_climb.mcap")).unwrap();
    assert!(fs::read(trial.path("made.mcap")).unwrap() == stored, "the stored sample log differs");

    let ran = trackfuse(trial.folder(), &["simulate", &scenario, "-o", "made.mcap"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["error: \"made.mcap\" exists", "hint: `--force`"]);
    fs::write(trial.path("bad.toml"), "[beacon]\nrate_hz = -1.0\n").unwrap();
    fs::write(trial.path("typo.toml"), "[becon]\nrate_hz = 1.0\n").unwrap();
    for (bad, says) in [("bad.toml", "rate_hz"), ("typo.toml", "becon"), ("none.toml", "none.toml")] {
        let ran = trackfuse(trial.folder(), &["simulate", bad, "-o", "other.mcap"]);
        assert_eq!(ran.code, 2, "{ran:#?}");
        assert_says(&ran.stderr, &["error: ", bad, says]);
        assert!(!trial.path("other.mcap").exists());
    }
}

#[test]
fn exit_code_3_for_an_overlap_at_constant_velocity_that_does_not_separate_bias_and_clock_offset() {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor { bias_m: [2.0, 1.0, -1.0], ..Sensor::new(5.0, 13.0, 2) });
    let ran = Trial::of(log.finish()).fuse(&[]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stderr, &["warning: ", "don't separate the bias of beacon from its clock offset"]);
    assert_says(&ran.stdout, &["z only together with beacon's clock offset"]);
}

#[test]
fn an_error_of_a_user_in_a_hurry_has_a_hint() {
    let trial = Trial::of(two_sensors());
    let hint = |args: &[&str], code: i32, hint: &str| {
        let ran = trackfuse(trial.folder(), args);
        assert_eq!(ran.code, code, "{ran:#?}");
        assert!(ran.stderr.starts_with("error: "), "{ran:#?}");
        assert_says(&ran.stderr, &[&format!("\nhint: {hint}")]);
    };
    fs::create_dir(trial.path("folder")).unwrap();
    fs::copy(trial.path("in.mcap"), trial.path("folder/dive.mcap")).unwrap();
    fs::write(trial.path("empty.mcap"), "").unwrap();
    fs::write(trial.path("path.toml"), "[[source]]\nname = \"a\"\nposition = \"/tether/track.positon\"\n")
        .unwrap();
    hint(&["fuse", "inn.mcap"], 1, "did you mean in.mcap?");
    hint(&["fuse", "folder"], 1, "it holds folder/dive.mcap");
    hint(&["inspect", "no/such.mcap"], 1, "there is no folder no");
    hint(&["fuse", "empty.mcap"], 1, "its recording, or its copy, never began");
    hint(&["fuse", "path.toml"], 1, "the log comes first; a config goes behind `--config`");
    hint(&["fuse", "in.mcap", "-c", "none.toml"], 2, "a config is a TOML file: `trackfuse init");
    hint(&["fuse", "in.mcap", "-c", "in.mcap"], 2, "a config is a TOML file: `trackfuse init");
    hint(&["fuse", "in.mcap", "-c", "path.toml"], 2, "did you mean `position`?");
    hint(&["fuse", "in.mcap", "-o", "no/such/out.mcap"], 1, "`mkdir -p no/such` makes it");
    hint(&["fuse", "in.mcap", "-o", "folder"], 1, "`-o` names a file");
    hint(&["export", "in.mcap"], 2, "`trackfuse fuse LOG` writes it");
    hint(&["simulate", "none.toml", "-o", "x.mcap"], 2, "a scenario is a TOML file");
}

#[test]
fn what_is_no_terminal_sees_no_colours_and_the_version_names_the_commit_if_any() {
    let trial = Trial::of(two_sensors());
    let ran = trackfuse(trial.folder(), &["fuse", "none.mcap"]);
    assert!(!ran.stderr.contains('\x1b'), "{ran:#?}");
    let version = trackfuse(trial.folder(), &["--version"]).stdout;
    let rest = version.strip_prefix(concat!("trackfuse ", env!("CARGO_PKG_VERSION"))).unwrap().trim_end();
    let commit = rest.strip_prefix(" (").and_then(|r| r.strip_suffix(')')).map(|c| c.trim_end_matches('+'));
    assert!(rest.is_empty() || commit.is_some_and(|c| c.chars().all(|c| c.is_ascii_hexdigit())), "{version}");
}

#[test]
fn every_command_has_examples_in_its_help_a_manual_page_and_completions() {
    let trial = Trial::of(two_sensors());
    let help = trackfuse(trial.folder(), &["--help"]).stdout;
    let listed = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let name = |line: &str| {
        line.strip_prefix("  ")
            .filter(|l| !l.starts_with(' '))
            .map(|l| l.split(' ').next().unwrap().to_owned())
    };
    let names: Vec<String> = listed.lines().filter_map(name).filter(|name| name != "help").collect();
    assert!(names.len() > 8, "{names:?}");
    fs::create_dir(trial.path("man")).unwrap();
    assert_eq!(trackfuse(trial.folder(), &["man", "-o", "man"]).code, 0);
    let completions = trackfuse(trial.folder(), &["completions", "bash"]).stdout;
    for name in names {
        let help = trackfuse(trial.folder(), &[&name, "--help"]).stdout;
        assert_says(&help, &["Examples:\n", &format!("trackfuse {name}")]);
        let page = fs::read_to_string(trial.path(&format!("man/trackfuse-{name}.1"))).unwrap();
        assert_says(&page, &[".SH SYNOPSIS", "Examples:"]);
        assert_says(&completions, &[&name]);
    }
    assert!(
        trackfuse(trial.folder(), &["man"]).stdout
            == fs::read_to_string(trial.path("man/trackfuse.1")).unwrap()
    );
    assert_eq!(
        trackfuse(trial.folder(), &["man", "-o", "man"]).code,
        2,
        "pages that are there are not replaced unasked"
    );
}
