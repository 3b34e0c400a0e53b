//! `export`: the table says what the messages say.

use std::fs;

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
    let refused = run(&["-o", "in.fused.mcap", "--force"]);
    assert_eq!(refused.code, 2, "{refused:#?}");
    assert_says(&refused.stderr, &["is the input itself"]);
    assert!(fs::read(trial.path("in.fused.mcap")).unwrap() == log, "the log is as it was");
    let table: serde_json::Value = serde_json::from_str(&run(&["--json"]).stdout).unwrap();
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
