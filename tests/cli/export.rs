//! `export`: the table says what the messages say.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};
use trackfuse::math::geodesy::{Geodetic, LocalFrame};

use super::trial::{Output, Trial, assert_says, trackfuse};
use super::trial_log::{EPOCH_NS, two_sensors};

const HEAD: &str = "time_ns,t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,ax_m_s2,ay_m_s2,az_m_s2,x_sigma_m,y_sigma_m,z_sigma_m,\
                    vx_sigma_m_s,vy_sigma_m_s,vz_sigma_m_s,phase,method";

#[test]
fn export_has_a_line_a_point_with_every_value_of_the_message() {
    let t0 = EPOCH_NS + 1_000_000_000;
    let trial = Trial::of(two_sensors()).config(&format!("[output]\nt0_ns = {t0}\n"));
    assert_eq!(trial.fuse(&[]).code, 0);
    let ran = trackfuse(trial.folder(), &["export", "in.fused.mcap", "--topic", "/fused/track"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let mut lines = ran.stdout.lines();
    assert_eq!(lines.next(), Some(HEAD));
    let output = Output::read(&trial.path("in.fused.mcap"));
    assert_eq!(lines.clone().count(), output.track().len());
    for (line, written) in lines.zip(output.track()) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells[0].parse::<u64>().unwrap(), written.log_time);
        let t_s: f64 = cells[1].parse().unwrap();
        assert!((t_s - (written.log_time as i64 - t0 as i64) as f64 * 1e-9).abs() < 1e-9);
        let fields = ["position", "velocity", "acceleration", "position_sigma", "velocity_sigma"];
        for (i, field) in fields.into_iter().enumerate() {
            let values: Vec<f64> = cells[2 + 3 * i..][..3].iter().map(|c| c.parse().unwrap()).collect();
            assert_eq!(values, written.vector(field), "{field}");
        }
        assert_eq!(
            (cells[17], cells[18]),
            (written.value["phase"].as_str().unwrap(), written.value["method"].as_str().unwrap())
        );
    }
}

#[test]
fn export_to_a_file_is_that_of_stdout_and_never_replaces_one_unasked() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let run = |args: &[&str]| trackfuse(trial.folder(), &[&["export", "in.fused.mcap"], args].concat());
    let printed = run(&[]).stdout;
    assert_eq!(run(&["-o", "track.csv"]).code, 0);
    assert_eq!(fs::read_to_string(trial.path("track.csv")).unwrap(), printed);
    fs::write(trial.path("track.csv"), "mine").unwrap();
    let refused = run(&["-o", "track.csv"]);
    assert_eq!((refused.code, fs::read(trial.path("track.csv")).unwrap()), (2, b"mine".to_vec()));
    assert_eq!(run(&["-o", "track.csv", "--force"]).code, 0);
    assert_eq!(fs::read_to_string(trial.path("track.csv")).unwrap(), printed);
    let log = fs::read(trial.path("in.fused.mcap")).unwrap();
    let refused = run(&["-o", "in.fused.mcap", "--force", "--format", "csv"]);
    assert_eq!(refused.code, 2, "{refused:#?}");
    assert_says(&refused.stderr, &["is the input itself"]);
    assert!(fs::read(trial.path("in.fused.mcap")).unwrap() == log, "the log is as it was");
    let table: Value = serde_json::from_str(&run(&["--json"]).stdout).unwrap();
    assert_eq!(table["rows"].as_array().unwrap().len(), printed.lines().count() - 1);
}

#[test]
fn export_of_a_sensor_leaves_empty_what_it_does_not_say() {
    let trial = Trial::of(two_sensors());
    let ran = trackfuse(trial.folder(), &["export", "in.mcap", "--topic", "/beacon/track"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    let line = ran.stdout.lines().nth(1).unwrap();
    assert!(
        line.ends_with(",,,,,,,,,,,") && line.starts_with(&(EPOCH_NS + 5_000_000_000).to_string()),
        "{line}"
    );
    let missing = trackfuse(trial.folder(), &["export", "in.mcap"]);
    assert_eq!(missing.code, 2);
    assert_says(&missing.stderr, &["/fused/track", "it has:"]);
}

const FORMATS: [&str; 5] = ["csv", "parquet", "geojson", "kml", "tum"];

/// A fused log with an origin, characteristic points and a hostile name, and its track in all formats.
fn exported() -> Trial {
    let config = "[output]\norigin = [59.4, 10.5, 3.0]\n[[characteristic_point]]\nname = \"</name>\\u0001&\\\"\"\n\
                  z_m = -30.0\n";
    let trial = Trial::of(two_sensors()).config(config);
    assert_eq!(trial.fuse(&[]).code, 0);
    for format in FORMATS {
        let ran = trackfuse(trial.folder(), &["export", "in.fused.mcap", "-o", &format!("track.{format}")]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:#?}");
        assert_says(&ran.stdout, &[&format!("track.{format} ({format}, ")]);
    }
    trial
}

#[test]
fn export_in_every_format_is_read_by_the_tools_that_it_is_for_and_says_the_same() {
    let Some(python) = std::env::var_os("TRACKFUSE_TEST_PYTHON") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_PYTHON is not set\n");
        return;
    };
    let trial = exported();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/export_readers.py");
    let ran = Command::new(python).arg(script).arg(trial.folder()).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let read: Value = serde_json::from_slice(&ran.stdout).unwrap();
    let output = Output::read(&trial.path("in.fused.mcap"));
    assert_eq!(read["rows"], output.track().len());
    assert_eq!(read["document"], "/fused/track");
    assert_eq!(read["marks"].as_array().unwrap().len(), 1);
    assert_eq!(read["phases"], json!(["single", "overlap", "single", "extrapolated"]));
    let provenance = &output.metadata["trackfuse:/fused"];
    for key in ["version", "command", "config", "input_size", "input_summary_sha256"] {
        assert_eq!(read["metadata"][key], provenance[key], "{key}");
    }
    let frame = LocalFrame::new(Geodetic::from_degrees([59.4, 10.5, 3.0]));
    let first: Vec<f64> = serde_json::from_value(read["lines"][0][0].clone()).unwrap();
    let enu = frame.to_enu(Geodetic::from_degrees([first[1], first[0], first[2]]));
    let expected = output.track()[0].vector("position");
    assert!((0..3).all(|i| (enu[i] - expected[i]).abs() < 1e-3), "{enu:?} {expected:?}");
}

#[test]
fn export_gives_the_same_bytes_again_on_stdout_and_under_another_name() {
    let trial = exported();
    fs::rename(trial.path("in.fused.mcap"), trial.path("renamed.mcap")).unwrap();
    for format in FORMATS {
        let args = ["export", "renamed.mcap", "--format", format];
        let mut program = Command::new(env!("CARGO_BIN_EXE_trackfuse"));
        let ran = program.args(args).current_dir(trial.folder()).output().unwrap();
        assert!(ran.status.success());
        assert!(ran.stdout == fs::read(trial.path(&format!("track.{format}"))).unwrap(), "{format}");
    }
    let kml = fs::read_to_string(trial.path("track.kml")).unwrap();
    assert_says(&kml, &["<name>&lt;/name&gt;\\u{1}&amp;"]);
}

#[test]
fn export_takes_the_format_that_is_asked_for_before_the_ending() {
    let trial = exported();
    let run = |args: &[&str]| trackfuse(trial.folder(), &[&["export", "in.fused.mcap"], args].concat());
    assert_eq!(run(&["--format", "tum", "-o", "other.csv"]).code, 0);
    assert!(fs::read(trial.path("other.csv")).unwrap() == fs::read(trial.path("track.tum")).unwrap());
    assert_says(&run(&["-o", "other.KML"]).stdout, &["(kml, "]);
    assert_says(&run(&["-o", "other.txt"]).stdout, &["(csv, "]);
    let ran = run(&["--format", "tum", "--json"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["`--json` without an output", "\nhint: `-o FILE`"]);
    let report: Value = serde_json::from_str(&run(&["-o", "x.tum", "--json"]).stdout).unwrap();
    assert_eq!((&report["format"], &report["rows"]), (&json!("tum"), &Value::Null));
}

#[test]
fn export_to_a_map_wants_an_origin_and_takes_the_one_given() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let run = |args: &[&str]| trackfuse(trial.folder(), &[&["export", "in.fused.mcap"], args].concat());
    for format in ["kml", "geojson"] {
        let ran = run(&["--format", format]);
        assert_eq!((ran.code, ran.stdout.as_str()), (2, ""));
        assert_says(
            &ran.stderr,
            &["\"/fused/track\"", "no latitude and longitude", "\nhint: `--origin LAT,LON,ALT`"],
        );
        assert_eq!(run(&["--format", format, "--origin", "-33.9,18.4,0"]).code, 0);
    }
    for wrong in ["91,0,0", "1,2", "here", "nan,0,0"] {
        let ran = run(&["--format", "kml", "--origin", wrong]);
        assert_eq!(ran.code, 2);
        assert_says(&ran.stderr, &["such as 59.4,10.5,0", wrong]);
    }
}

#[test]
fn export_of_a_sensor_to_a_map_has_neither_phases_nor_sigmas() {
    let trial = Trial::of(two_sensors());
    let args = ["export", "in.mcap", "--topic", "/beacon/track", "--format", "geojson", "--origin", "1,2,3"];
    let ran = trackfuse(trial.folder(), &args);
    assert_eq!(ran.code, 0, "{ran:#?}");
    let map: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert!(map["features"][0]["properties"].get("phase").is_none());
    assert_eq!(map["features"][0]["properties"]["x_sigma_max_m"], Value::Null);
}

#[test]
fn export_to_an_ending_that_no_format_has_is_refused_with_the_formats() {
    let trial = exported();
    let run = |args: &[&str]| trackfuse(trial.folder(), &[&["export", "in.fused.mcap"], args].concat());
    for (name, hint) in [("x.gpx", "`--format FORMAT`"), ("x.json", "`x.geojson`")] {
        let ran = run(&["-o", name]);
        assert_eq!(ran.code, 2, "{ran:#?}");
        assert_says(&ran.stderr, &[name, "csv, parquet, geojson, kml or tum", "\nhint: ", hint]);
        assert!(!trial.path(name).exists());
        assert_eq!(run(&["-o", name, "--format", "csv"]).code, 0);
    }
    assert_says(&run(&["-o", "bare"]).stdout, &["(csv, "]);
}

#[test]
fn export_out_of_ros_2_messages_keeps_the_characteristic_points_and_says_what_they_have_no_place_for() {
    let config = "[output]\nencoding = \"cdr\"\norigin = [59.4, 10.5, 3.0]\n[[characteristic_point]]\n\
                  name = \"half way\"\nz_m = -30.0\n";
    let trial = Trial::of(two_sensors()).config(config);
    assert_eq!(trial.fuse(&[]).code, 0);
    let ran = trackfuse(trial.folder(), &["export", "in.fused.mcap", "--format", "geojson"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    assert_says(&ran.stderr, &["no place for phase, method and acceleration"]);
    let map: Value = serde_json::from_str(&ran.stdout).unwrap();
    let features = map["features"].as_array().unwrap();
    let marks: Vec<_> = features.iter().filter_map(|f| f["properties"]["name"].as_str()).collect();
    assert_eq!(marks, ["half way"]);
    let pose = ["export", "in.fused.mcap", "--topic", "/fused/pose", "--format", "geojson"];
    assert!(
        !trackfuse(trial.folder(), &pose).stdout.contains("\"name\":\"half way\""),
        "they are the track's"
    );
}

#[test]
fn export_moves_no_track_whose_place_is_known() {
    let trial = exported();
    let run = |origin: &str| {
        trackfuse(trial.folder(), &["export", "in.fused.mcap", "--format", "kml", "--origin", origin])
    };
    let ran = run("-33.9,18.4,0");
    assert_eq!((ran.code, ran.stdout.as_str()), (2, ""));
    assert_says(
        &ran.stderr,
        &["\"/fused/track\"", "59.4,10.5,3", "-33.9,18.4,0", "\nhint: leave `--origin` out"],
    );
    assert_eq!(run("59.4,10.5,3").code, 0, "the same is no move");
}
