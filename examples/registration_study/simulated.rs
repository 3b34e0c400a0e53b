//! Runs of our own simulator.

use std::thread;
use std::time::Instant;

use trackfuse::estimate::registration::{Settings, register};
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{FAMILIES, Scenario, SensorSample, Simulation, simulate};
use trackfuse::track::Curve;

use crate::tally::{Tally, print_head, print_pooled, print_row};

const THREADS: u64 = 2;

/// What a family's runs came to.
#[derive(Default)]
struct Outcome {
    tally: Tally,
    runs: usize,
    /// The largest 3-D root mean square error of a run in phase 2, m, and its seed.
    worst: (f64, u64),
    seconds: f64,
    steps: usize,
    unsettled: usize,
    turned: usize,
    rejected: usize,
}

impl Outcome {
    fn merge(&mut self, other: &Self) {
        self.tally.merge(&other.tally);
        self.runs += other.runs;
        if other.worst.0 > self.worst.0 {
            self.worst = other.worst;
        }
        self.seconds += other.seconds;
        self.steps += other.steps;
        self.unsettled += other.unsettled;
        self.turned += other.turned;
        self.rejected += other.rejected;
    }
}

pub(crate) fn study(runs: u64, families: &[&str]) {
    let families: &[&str] = if families.is_empty() { &FAMILIES } else { families };
    let mut all = Tally::default();
    print_head();
    for family in families {
        let outcome = family_of(family, runs);
        all.merge(&outcome.tally);
        let per_run = |n: usize| n as f64 / outcome.runs as f64;
        let rest = format!(
            "worst {:.2} m (seed {}), {:.0} ms, {:.1} steps, {} unsettled, {} turned, {:.1} rejected a run",
            outcome.worst.0,
            outcome.worst.1,
            1e3 * outcome.seconds / outcome.runs as f64,
            per_run(outcome.steps),
            outcome.unsettled,
            outcome.turned,
            per_run(outcome.rejected),
        );
        print_row(family, &outcome.tally, &rest);
    }
    print_pooled(&all);
}

fn family_of(family: &str, runs: u64) -> Outcome {
    let parts = thread::scope(|scope| {
        let part = |part| {
            let mut sum = Outcome::default();
            for seed in (1..=runs).filter(|seed| seed % THREADS == part) {
                sum.merge(&run(family, seed));
            }
            sum
        };
        let handles: Vec<_> = (0..THREADS).map(|k| scope.spawn(move || part(k))).collect();
        handles.into_iter().map(|h| h.join().expect("no panic")).collect::<Vec<_>>()
    });
    let mut all = Outcome::default();
    parts.iter().for_each(|part| all.merge(part));
    all
}

fn run(family: &str, seed: u64) -> Outcome {
    let (family, correlation) = family.split_once('@').unwrap_or((family, "0"));
    let mut scenario = Scenario { seed, ..Scenario::family(family).expect("a family's name") };
    scenario.beacon.noise_correlation = correlation.parse().expect("a number behind the @");
    let simulation = simulate(&scenario).expect("a family can be simulated");
    let sources = sources(&simulation);
    let phases = &simulation.phases;
    let begun = Instant::now();
    let found = register(&sources, 0, &[(phases.t0_s, phases.t2_s)], &Settings::default())
        .expect("a climb can be registered");
    let seconds = begun.elapsed().as_secs_f64();
    let mut tally = Tally::default();
    for point in simulation.truth.iter().filter(|p| p.t_s <= phases.t2_s) {
        let state = found.curve.at(point.t_s).expect("inside the piece");
        let overlap = (phases.overlap_begin_s, phases.overlap_end_s);
        tally.add((point.t_s, overlap), &state, point.state.position.into(), point.state.velocity.into());
    }
    Outcome {
        tally,
        runs: 1,
        worst: (tally.0[2].rmse(0), seed),
        seconds,
        steps: found.iterations,
        unsettled: usize::from(!found.converged),
        turned: found.errors.iter().filter(|e| e.rotation_rad.abs() > 0.0).count(),
        rejected: found.rejected.len(),
    }
}

/// The tether and the beacon by their stamps, with the sigmas that the simulator has by default.
fn sources(simulation: &Simulation) -> Vec<Source> {
    let of = |(name, sigma): (&str, f64)| {
        let mut samples = simulation.sensor(name)?.samples.clone();
        samples.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
        let series = |value: fn(&SensorSample) -> [f64; 3]| {
            let sample = |s: &SensorSample| Sample { time_s: s.stamp_s, value: value(s), sigma: [sigma; 3] };
            samples.iter().map(sample).collect()
        };
        Some(Source {
            name: name.into(),
            positions: series(|s| s.position.into()),
            velocities: series(|s| s.velocity.into()),
        })
    };
    [("tether", 0.10), ("beacon", 0.15)].into_iter().filter_map(of).collect()
}
