//! `fuse` held against the truth of climbs that another simulator made: nine families, four runs each.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

mod viewer_rules;

/// Truth at 100 Hz: time since the log's zero, position, velocity.
struct Truth {
    epoch_ns: i64,
    rows: Vec<Vec<f64>>,
}

impl Truth {
    fn read(stem: &Path) -> Self {
        let json: Value =
            serde_json::from_slice(&fs::read(stem.with_extension("truth.json")).expect("truth"))
                .expect("json");
        let csv = fs::read_to_string(stem.with_extension("truth.csv")).expect("truth");
        let row = |line: &str| line.split(',').map(|v| v.parse().expect("a number")).collect();
        Self {
            epoch_ns: json["epoch_ns"].as_i64().expect("a number"),
            rows: csv.lines().skip(1).map(row).collect(),
        }
    }

    fn position(&self, t_s: f64) -> Option<[f64; 3]> {
        let next = self.rows.partition_point(|r| r[0] < t_s);
        let (a, b) = (self.rows.get(next.checked_sub(1)?)?, self.rows.get(next)?);
        let share = (t_s - a[0]) / (b[0] - a[0]);
        Some(std::array::from_fn(|i| a[1 + i] + share * (b[1 + i] - a[1 + i])))
    }
}

/// What one kind of phase adds up to over a family.
#[derive(Default)]
struct Sum {
    squares: f64,
    points: usize,
    inside: usize,
    /// Numbers that the track says how sure it is of.
    banded: usize,
}

impl Sum {
    fn rmse_m(&self) -> f64 {
        (self.squares / self.points as f64).sqrt()
    }

    fn coverage(&self) -> f64 {
        self.inside as f64 / self.banded as f64
    }
}

fn vector(value: &Value) -> Option<[f64; 3]> {
    Some([value["x"].as_f64()?, value["y"].as_f64()?, value["z"].as_f64()?])
}

/// Seen and unseen parts of the four runs of a family, and the runs' exit codes.
fn judge(data: &Path, family: &str) -> ([Sum; 2], Vec<i32>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut sums, mut codes) = ([Sum::default(), Sum::default()], Vec::new());
    for run in 0..4 {
        let stem: PathBuf = data.join(format!("climbs/{family}_{run}"));
        let output = folder.path().join(format!("{run}.mcap"));
        let ran = Command::new(env!("CARGO_BIN_EXE_trackfuse"))
            .args(["fuse", "--quiet"])
            .arg(stem.with_extension("mcap"))
            .arg("-o")
            .arg(&output)
            .output()
            .expect("the program runs");
        codes.push(ran.status.code().expect("it ends by itself"));
        viewer_rules::assert_shown(&output);
        let truth = Truth::read(&stem);
        for message in mcap::MessageStream::new(&fs::read(&output).expect("an output")).expect("an MCAP") {
            let message = message.expect("a message");
            if message.channel.topic != "/fused/track" {
                continue;
            }
            let point: Value = serde_json::from_slice(&message.data).expect("json");
            let t_s = (message.log_time as i64 - truth.epoch_ns) as f64 * 1e-9;
            let Some(expected) = truth.position(t_s) else { continue };
            let position = vector(&point["position"]).expect("a position");
            let sum = &mut sums[usize::from(point["phase"] == "extrapolated")];
            sum.points += 1;
            for axis in 0..3 {
                let error = position[axis] - expected[axis];
                sum.squares += error * error;
                if let Some(sigma) = vector(&point["position_sigma"]) {
                    sum.banded += 1;
                    sum.inside += usize::from(error.abs() < 1.96 * sigma[axis]);
                }
            }
        }
    }
    (sums, codes)
}

#[test]
fn honest_sensors_give_centimetres_and_no_warning_and_biased_ones_a_warning_and_bands_that_hold() {
    let Some(data) = std::env::var_os("TRACKFUSE_TEST_DATA").map(PathBuf::from) else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
        return;
    };
    for family in ["single", "no_error"] {
        let ([seen, unseen], codes) = judge(&data, family);
        assert_eq!(codes, [0; 4], "{family}");
        assert!(seen.rmse_m() < 0.045, "{family}: {} m", seen.rmse_m());
        assert!(unseen.rmse_m() < 1.0, "{family} unseen: {} m", unseen.rmse_m());
        assert!(seen.coverage() > 0.93 && unseen.coverage() > 0.93, "{family}: {}", seen.coverage());
    }
    for family in ["nominal", "async", "outliers", "dropout", "gap", "bigtau", "drift"] {
        let ([seen, unseen], codes) = judge(&data, family);
        // of the runs with dropouts, one happens to have a bias below its noise
        let silent = codes.iter().filter(|&&code| code == 0).count();
        assert!(silent <= usize::from(family == "dropout"), "{family}: {codes:?}");
        assert!(codes.iter().all(|code| [0, 3].contains(code)), "{family}: {codes:?}");
        assert!(seen.rmse_m() < 2.0, "{family}: {} m", seen.rmse_m());
        assert!(seen.coverage() > 0.85, "{family}: {} inside the bands", seen.coverage());
        assert!(unseen.banded == 0 || unseen.coverage() > 0.9, "{family} unseen: {}", unseen.coverage());
    }
}
