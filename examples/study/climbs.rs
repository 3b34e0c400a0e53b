//! Climbs with their truth: simulated now, or recorded by another simulator.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{Scenario, write_log};
use trackfuse::time::Time;

/// A log, and what really happened.
pub(crate) struct Climb {
    pub(crate) log: PathBuf,
    /// The release, from which the truth's times count.
    pub(crate) release: Time,
    pub(crate) truth: Source,
    /// Heights of the three characteristic points, m.
    pub(crate) heights_m: [f64; 3],
    /// How long nobody sees the vehicle at the end, s.
    pub(crate) unseen_s: f64,
    /// Where the log was written for this study; removed with it.
    _folder: Option<tempfile::TempDir>,
}

fn sample(time_s: f64, value: [f64; 3]) -> Sample {
    Sample { time_s, value, sigma: [1e-6; 3] }
}

/// `runs` climbs of a family, with seeds from `first_seed` on.
pub(crate) fn simulated(family: &str, first_seed: u64, runs: u64) -> impl Iterator<Item = Climb> {
    let family = family.to_owned();
    (first_seed..first_seed + runs).map(move |seed| {
        let mut scenario = Scenario::family(&family).expect("a known family");
        scenario.seed = seed;
        scenario.recording.bystanders = false;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let log = folder.path().join("climb.mcap");
        let file = fs::File::create(&log).expect("a file");
        let simulation = write_log(&scenario, std::io::BufWriter::new(file)).expect("a simulation");
        let rows = &simulation.truth;
        Climb {
            log,
            release: Time::from_ns(scenario.epoch_ns),
            truth: Source {
                name: "truth".into(),
                positions: rows.iter().map(|r| sample(r.t_s, r.state.position.into())).collect(),
                velocities: rows.iter().map(|r| sample(r.t_s, r.state.velocity.into())).collect(),
            },
            heights_m: simulation.characteristic_points.map(|p| p.z_m),
            unseen_s: simulation.phases.t3_s - simulation.phases.t2_s,
            _folder: Some(folder),
        }
    })
}

/// The climbs `FAMILY_0`, `FAMILY_1`, ... of a folder.
pub(crate) fn recorded(folder: &Path, family: &str) -> impl Iterator<Item = Climb> {
    let stem = folder.join(family).display().to_string();
    (0..).map(move |k| PathBuf::from(format!("{stem}_{k}.mcap"))).take_while(|log| log.exists()).map(|log| {
        let json = fs::read_to_string(log.with_extension("truth.json")).expect("a truth.json");
        let json: Value = serde_json::from_str(&json).expect("json");
        let csv = fs::read_to_string(log.with_extension("truth.csv")).expect("a truth.csv");
        let rows: Vec<Vec<f64>> = csv
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|v| v.parse().expect("a number")).collect())
            .collect();
        let number = |v: &Value| v.as_f64().expect("a number");
        let series = |at: usize| rows.iter().map(|r| sample(r[0], [r[at], r[at + 1], r[at + 2]])).collect();
        Climb {
            log,
            release: Time::from_ns(json["epoch_ns"].as_i64().expect("a number")),
            truth: Source { name: "truth".into(), positions: series(1), velocities: series(4) },
            heights_m: [0, 1, 2].map(|i: usize| number(&json["characteristic_points"][i]["z"])),
            unseen_s: number(&json["phases"]["T3"]) - number(&json["phases"]["T2"]),
            _folder: None,
        }
    })
}
