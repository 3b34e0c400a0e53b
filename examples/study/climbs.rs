//! Climbs with their truth: simulated now, or recorded by another simulator.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use serde_json::Value;
use trackfuse::log::Log;
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{Profile, Scenario, write_log};
use trackfuse::source::{self, Loaded};
use trackfuse::time::Time;

/// Families of this study beside the simulator's own, on which no law of drag holds where nobody sees.
pub(crate) const LAWLESS: [&str; 2] = ["braking", "pulsing"];

/// A log's samples.
pub(crate) struct Recording {
    pub(crate) loaded: Vec<Loaded>,
    /// The instant that the samples' times count from.
    pub(crate) origin: Time,
}

impl Recording {
    /// The sources that `trackfuse fuse` finds by itself.
    pub(crate) fn open(log: &Path) -> Self {
        let log = Log::open(log).expect("a log");
        let configs = source::recognise(&log).expect("sources").sources;
        let source::Samples { loaded, origin, .. } =
            source::load(&log, &configs, false, None).expect("samples");
        Self { loaded, origin }
    }
}

/// A recording, and what really happened.
pub(crate) struct Climb {
    pub(crate) recording: Recording,
    /// The release, from which the truth's times count.
    pub(crate) release: Time,
    pub(crate) truth: Source,
    /// Heights of the three characteristic points, m.
    pub(crate) heights_m: [f64; 3],
    /// Begin and end of the overlap, or, where a gap stands in its place, of the gap, s after the release.
    pub(crate) overlap_s: (f64, f64),
    /// When the last sensor stops, and the end of the climb, s after the release.
    pub(crate) unseen_s: (f64, f64),
}

fn sample(time_s: f64, value: [f64; 3]) -> Sample {
    Sample { time_s, value, sigma: [1e-6; 3] }
}

/// `NAME` or `NAME@CORRELATION`, whose noise of the beacon is AR(1).
fn scenario(name: &str) -> Scenario {
    let (family, correlation) = name.split_once('@').unwrap_or((name, "0"));
    let mut scenario = if LAWLESS.contains(&family) {
        let mut scenario = Scenario::family("async").expect("a known family");
        let climb = &mut scenario.climb;
        climb.profile = Profile::Steep;
        if family == "braking" {
            // thrown: no drag, and a constant force against the motion
            (climb.drag_vertical_per_m, climb.drag_horizontal_per_m) = (Some(0.0), Some(0.0));
            climb.buoyancy_m_s2 = Some(-2.0);
        } else {
            // driven to the end by a thrust that goes up and down by half
            (climb.thrust_m_s2, climb.burn_s) = (Some(6.0), Some(30.0));
            (climb.modulation, climb.modulation_hz) = (Some(0.5), Some(0.4));
        }
        scenario
    } else {
        Scenario::family(family).expect("a known family")
    };
    scenario.beacon.noise_correlation = correlation.parse().expect("a number behind the @");
    scenario.recording.bystanders = false;
    scenario
}

/// `runs` climbs of a family, with seeds from `first_seed` on.
pub(crate) fn simulated(family: &str, first_seed: u64, runs: u64) -> Vec<Climb> {
    let seeds: Vec<u64> = (first_seed..first_seed + runs).collect();
    on_all_cores(&seeds, |&seed| {
        let scenario = Scenario { seed, ..scenario(family) };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let log = folder.path().join("climb.mcap");
        let file = fs::File::create(&log).expect("a file");
        let simulation = write_log(&scenario, std::io::BufWriter::new(file)).expect("a simulation");
        let (rows, phases) = (&simulation.truth, &simulation.phases);
        Climb {
            recording: Recording::open(&log),
            release: Time::from_ns(scenario.epoch_ns),
            truth: Source {
                name: "truth".into(),
                positions: rows.iter().map(|r| sample(r.t_s, r.state.position.into())).collect(),
                velocities: rows.iter().map(|r| sample(r.t_s, r.state.velocity.into())).collect(),
            },
            heights_m: simulation.characteristic_points.map(|p| p.z_m),
            overlap_s: in_order(phases.overlap_begin_s, phases.overlap_end_s),
            unseen_s: (phases.t2_s, phases.t3_s),
        }
    })
}

/// The climbs `FAMILY_0`, `FAMILY_1`, ... of a folder.
pub(crate) fn recorded(folder: &Path, family: &str) -> Vec<Climb> {
    let path = |k: usize| folder.join(format!("{family}_{k}.mcap"));
    let logs: Vec<PathBuf> = (0..1000).map(path).take_while(|log| log.exists()).collect();
    on_all_cores(&logs, |log| {
        let json = fs::read_to_string(log.with_extension("truth.json")).expect("a truth.json");
        let json: Value = serde_json::from_str(&json).expect("json");
        let csv = fs::read_to_string(log.with_extension("truth.csv")).expect("a truth.csv");
        let rows: Vec<Vec<f64>> = csv
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|v| v.parse().expect("a number")).collect())
            .collect();
        let number = |v: &Value| v.as_f64().expect("a number");
        let instant = |name: &str| number(&json["phases"][name]);
        let series = |at: usize| rows.iter().map(|r| sample(r[0], [r[at], r[at + 1], r[at + 2]])).collect();
        Climb {
            recording: Recording::open(log),
            release: Time::from_ns(json["epoch_ns"].as_i64().expect("a number")),
            truth: Source { name: "truth".into(), positions: series(1), velocities: series(4) },
            heights_m: [0, 1, 2].map(|i: usize| number(&json["characteristic_points"][i]["z"])),
            overlap_s: in_order(instant("ov0"), instant("ov1")),
            unseen_s: (instant("T2"), instant("T3")),
        }
    })
}

fn in_order(a: f64, b: f64) -> (f64, f64) {
    (a.min(b), a.max(b))
}

/// Each of `items` by itself, in their order.
pub(crate) fn on_all_cores<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let share = items.len().div_ceil(workers).max(1);
    let each = &each;
    thread::scope(|scope| {
        let parts: Vec<_> = items
            .chunks(share)
            .map(|part| scope.spawn(move || part.iter().map(each).collect::<Vec<R>>()))
            .collect();
        parts.into_iter().flat_map(|part| part.join().expect("no run panics")).collect()
    })
}
