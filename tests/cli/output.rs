//! What a run writes, as another reader sees it.

use std::fs;

use serde_json::Value;

use super::trial::{Trial, assert_says};
use super::trial_log::{Sensor, TrialLog, ns, two_sensors};

const POINTS: &str = "[[characteristic_point]]\nname = \"half way\"\nz_m = -30.0\n[[characteristic_point]]\n\
                      name = \"moon\"\nz_m = 1e6\n";

#[test]
fn output_track_has_a_message_per_sample_with_all_its_fields_in_order_of_time() {
    let (report, output) = Trial::of(two_sensors()).report(0);
    let track = output.track();
    assert_eq!(report["track"]["points"], track.len());
    assert_eq!(track.len(), 13 * 20 + 1 + 2 * 20, "13 s and 2 s of extrapolation at 20 Hz");
    assert!(track.is_sorted_by(|a, b| a.log_time < b.log_time));
    for written in track {
        assert_eq!(
            (written.log_time, written.publish_time),
            (written.timestamp_ns() as u64, written.log_time)
        );
        let value = &written.value;
        assert_eq!(value["frame_id"], "enu");
        let [p, v] = ["position", "velocity"].map(|field| written.vector(field));
        let [sigma, lower, upper] =
            ["position_sigma", "position_lower", "position_upper"].map(|field| written.vector(field));
        written.vector("velocity_sigma");
        written.vector("acceleration");
        for axis in 0..3 {
            assert!((upper[axis] - p[axis] - 1.96 * sigma[axis]).abs() < 1e-3 * sigma[axis]);
            assert!((p[axis] - lower[axis] - 1.96 * sigma[axis]).abs() < 1e-3 * sigma[axis]);
        }
        let speed = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((value["speed"].as_f64().unwrap() - speed).abs() < 1e-5);
        assert!((value["depth"].as_f64().unwrap() + p[2]).abs() < 1e-5);
    }
    let at = |t: f64| {
        let value = &output.near(t).value;
        (value["phase"].as_str().unwrap(), value["method"].as_str().unwrap(), value["sources"].to_string())
    };
    assert_eq!(at(1.0), ("single", "sff", "[\"tether\"]".into()));
    assert_eq!(at(6.0), ("overlap", "sff", "[\"tether\",\"beacon\"]".into()));
    assert_eq!(at(12.0), ("single", "sff", "[\"beacon\"]".into()));
    assert_eq!(at(14.5), ("extrapolated", "pcf", "[]".into()));
}

#[test]
fn output_has_the_plain_extrapolation_the_events_and_the_log() {
    let (report, output) = Trial::of(two_sensors()).config(POINTS).report(3);
    let pcf = &output.topics["/fused/pcf"];
    assert_eq!(pcf.len(), 40);
    assert!(pcf.iter().all(|w| w.value["phase"] == "extrapolated" && w.timestamp_ns() > ns(13.0) as i64));
    let events = &output.topics["/fused/events"];
    assert_eq!(events.len(), 1, "the moon is not reached");
    assert_eq!(events[0].value["name"], "half way");
    assert!((events[0].value["time_since_t0"].as_f64().unwrap() - 7.5).abs() < 0.05);
    assert!((events[0].vector("position")[2] + 30.0).abs() < 1e-3);
    let log = &output.topics["/fused/log"];
    assert_eq!(log.len(), 2);
    assert_says(log[0].value["message"].as_str().unwrap(), &["tether (datum)", "half way", "warning: "]);
    assert_eq!((&log[1].value["message"], &log[1].value["level"]), (&report["warnings"][0], &3.into()));
    assert_says(report["warnings"][0].as_str().unwrap(), &["\"moon\"", "never rises"]);
}

#[test]
fn output_metadata_tell_the_input_and_hold_a_config_that_makes_the_same_track_again() {
    let trial = Trial::of(two_sensors());
    let (_, output) = trial.report(0);
    let metadata = &output.metadata["trackfuse:/fused"];
    assert_eq!(metadata["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(metadata["command"], "fuse");
    assert_eq!(metadata["input_size"], fs::metadata(trial.path("in.mcap")).unwrap().len().to_string());
    assert_eq!(metadata["input_data_section_crc"].len(), 8);
    assert_eq!(metadata["input_summary_sha256"].len(), 64);
    assert_says(
        &metadata["config"],
        &["name = \"tether\"", "position = \"/beacon/track.position\"", "datum = true"],
    );
    let again = Trial::of(two_sensors()).config(&metadata["config"]).report(0).1;
    assert_eq!(again.track().len(), output.track().len());
    assert!(again.track().iter().zip(output.track()).all(|(a, b)| a.value == b.value));
    assert_eq!(&again.metadata["trackfuse:/fused"]["config"], &metadata["config"]);
}

#[test]
fn output_bytes_depend_on_the_input_and_the_config_and_not_on_names() {
    let trial = Trial::of(two_sensors()).config(POINTS);
    assert_eq!(trial.fuse(&[]).code, 3);
    assert_eq!(trial.fuse(&["-o", "another name.mcap"]).code, 3);
    let bytes = |name: &str| fs::read(trial.path(name)).unwrap();
    assert!(bytes("in.fused.mcap") == bytes("another name.mcap"));
    fs::copy(trial.path("in.mcap"), trial.path("renamed.mcap")).unwrap();
    assert_eq!(trial.fuse_with(&["renamed.mcap", "--config", "trial.toml", "--json"]).code, 3);
    assert!(bytes("in.fused.mcap") == bytes("renamed.fused.mcap"));
}

#[test]
fn output_begins_with_the_data_section_of_the_input() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&[]).code, 0);
    let (input, output) =
        (fs::read(trial.path("in.mcap")).unwrap(), fs::read(trial.path("in.fused.mcap")).unwrap());
    let summary = mcap::read::footer(&input).unwrap().summary_start as usize;
    let data_end = 9 + 4;
    assert!(output.starts_with(&input[..summary - data_end]));
}

#[test]
fn output_goes_beside_the_log_unless_told_otherwise_and_a_log_without_suffix_is_fine() {
    let trial = Trial::of(two_sensors());
    fs::create_dir(trial.path("day 1")).unwrap();
    fs::copy(trial.path("in.mcap"), trial.path("day 1/dive.2.mcap")).unwrap();
    fs::copy(trial.path("in.mcap"), trial.path("bare")).unwrap();
    assert_eq!(trial.fuse_with(&["day 1/dive.2.mcap"]).code, 0);
    assert!(trial.path("day 1/dive.2.fused.mcap").exists());
    assert_eq!(trial.fuse_with(&["bare"]).code, 0);
    assert!(trial.path("bare.fused.mcap").exists());
}

#[test]
fn output_prefix_names_topics_and_metadata() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&["--prefix", "/a/b"]).code, 0);
    let output = super::trial::Output::read(&trial.path("in.fused.mcap"));
    assert!(output.topics.contains_key("/a/b/track") && output.metadata.contains_key("trackfuse:/a/b"));
    for prefix in ["", "a", "/", "/a/", "/a b", "/a\n"] {
        let ran = trial.fuse(&["--prefix", prefix, "--force"]);
        assert_eq!(ran.code, 2, "{prefix:?}");
        assert_says(&ran.stderr, &["output.prefix is"]);
    }
}

/// Fails unless `value` is as `schema` says: types, required keys, no key that it doesn't name.
pub(crate) fn validate(value: &Value, schema: &Value, root: &Value, at: &str) {
    if let Some(reference) = schema["$ref"].as_str() {
        return validate(value, &root["$defs"][reference.trim_start_matches("#/$defs/")], root, at);
    }
    if let Some(options) = schema["anyOf"].as_array() {
        let option = options.iter().find(|o| (o["type"] == "null") == value.is_null());
        return validate(value, option.unwrap_or_else(|| panic!("{at}: {value}")), root, at);
    }
    if let Some(words) = schema["oneOf"].as_array() {
        return assert!(words.iter().any(|word| word["const"] == *value), "{at}: {value}");
    }
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(n) if n.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let fits = |t: &Value| t == kind || (t == "number" && kind == "integer");
    let types = &schema["type"];
    assert!(
        types.as_array().map_or_else(|| fits(types), |t| t.iter().any(fits)),
        "{at}: {value} is no {types}"
    );
    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
        let tuple = schema["prefixItems"].as_array().and_then(|items| items.get(i));
        validate(item, tuple.unwrap_or(&schema["items"]), root, &format!("{at}[{i}]"));
    }
    let Some(object) = value.as_object() else { return };
    for required in schema["required"].as_array().into_iter().flatten() {
        assert!(object.contains_key(required.as_str().unwrap()), "{at}.{required} is missing");
    }
    for (key, field) in object {
        let known =
            schema["properties"].get(key).unwrap_or_else(|| panic!("{at}.{key} is not in the schema"));
        validate(field, known, root, &format!("{at}.{key}"));
    }
}

#[test]
fn output_on_stdout_is_one_json_object_as_its_schema_says_when_asked_for() {
    let schema: Value = serde_json::from_str(include_str!("../../schemas/fuse.schema.json")).unwrap();
    let mut one = TrialLog::new();
    one.sensor("/beacon/track", &Sensor::new(0.0, 8.0, 1));
    for (log, config, code) in [
        (two_sensors(), POINTS, 3),
        (two_sensors(), "[fusion]\nmethod = \"gdf\"\n[extrapolation]\nhorizon_s = 0\n", 0),
        (one.finish(), "", 0),
    ] {
        let (report, _) = Trial::of(log).config(config).report(code);
        validate(&report, &schema, &schema, "report");
        for key in ["t0_ns", "input", "output"] {
            assert!(report[key].is_string(), "{key}");
        }
    }
}

#[test]
fn output_warnings_stand_on_stderr_unless_quiet() {
    let trial = Trial::of(two_sensors()).config(POINTS);
    for (args, on_stdout, on_stderr) in [
        (&[][..], true, true),
        (&["--quiet"], true, false),
        (&["-q"], true, false),
        (&["--json"], false, true),
        (&["--json", "--quiet"], false, false),
    ] {
        let ran = trial.fuse(&[args, &["--force"]].concat());
        assert_eq!(ran.code, 3);
        assert_eq!(ran.stdout.contains("\nwarning: characteristic point"), on_stdout, "{args:?}");
        assert_eq!(ran.stderr.starts_with("warning: characteristic point"), on_stderr, "{args:?}");
    }
    let ran = trial.fuse(&["--quiet"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["error: "]);
}

#[test]
fn output_holds_the_old_messages_for_an_independent_reader() {
    let Some(python) = std::env::var_os("TRACKFUSE_TEST_PYTHON") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_PYTHON is not set\n");
        return;
    };
    let mut logs = vec![two_sensors()];
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs");
    logs.push(fs::read(samples.join("oblique_climb.mcap")).unwrap());
    if let Some(data) = std::env::var_os("TRACKFUSE_TEST_DATA") {
        logs.push(fs::read(std::path::Path::new(&data).join("flight_two_sensors.mcap")).unwrap());
    }
    for log in logs {
        let trial = Trial::of(log);
        let ran = trial.fuse(&[]);
        assert!(matches!(ran.code, 0 | 3), "{ran:#?}");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/independent_reader.py");
        let done = std::process::Command::new(&python)
            .arg(script)
            .args([trial.path("in.mcap"), trial.path("in.fused.mcap")])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        assert!(done.status.success() && said.ends_with("same\n"), "{said}");
    }
}
