//! Registration against the truth of simulated climbs; `examples/study` has the whole table.

use trackfuse::estimate::registration::{Registered, Settings, register};
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{Scenario, SensorRecord, Simulation, simulate};
use trackfuse::track::Curve;

/// Seeds a family.
const RUNS: u64 = 12;

fn source(record: &SensorRecord, sigma: f64) -> Source {
    let mut samples = record.samples.clone();
    samples.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
    let sample = |time_s, value| Sample { time_s, value, sigma: [sigma; 3] };
    Source {
        name: record.name.clone(),
        positions: samples.iter().map(|s| sample(s.stamp_s, s.position.into())).collect(),
        velocities: samples.iter().map(|s| sample(s.stamp_s, s.velocity.into())).collect(),
    }
}

fn registered(simulation: &Simulation) -> Registered {
    let sources: Vec<Source> = [("tether", 0.1), ("beacon", 0.15)]
        .into_iter()
        .filter_map(|(name, sigma)| Some(source(simulation.sensor(name)?, sigma)))
        .collect();
    register(&sources, 0, &[(0.0, simulation.phases.t2_s)], &Settings::default()).expect("a climb")
}

/// Of the position in phase 2: 3-D root mean square error, m, share inside the 95 % bands, and the largest error of
/// a run, m.
fn phase_2(family: &str) -> (f64, f64, f64) {
    let (mut squares, mut inside, mut points, mut worst) = (0.0, 0, 0, 0.0_f64);
    for seed in 1..=RUNS {
        let scenario = Scenario { seed, ..Scenario::family(family).expect("a family") };
        let simulation = simulate(&scenario).expect("a good scenario");
        let found = registered(&simulation);
        let phases = &simulation.phases;
        let (mut own, mut count) = (0.0, 0);
        for point in simulation.truth.iter().filter(|p| (phases.overlap_end_s..=phases.t2_s).contains(&p.t_s))
        {
            let state = found.curve.at(point.t_s).expect("inside");
            for axis in 0..3 {
                let error = state.position[axis] - point.state.position[axis];
                own += error * error;
                inside += usize::from(error.abs() <= 1.96 * state.position_sigma[axis]);
            }
            count += 1;
        }
        worst = worst.max((own / f64::from(count)).sqrt());
        squares += own;
        points += count;
    }
    let points = f64::from(points);
    ((squares / points).sqrt(), inside as f64 / (3.0 * points), worst)
}

#[test]
fn a_biased_late_and_drifting_beacon_is_registered_to_decimetres_with_bands_that_hold() {
    for (family, most_m) in [("nominal", 0.11), ("outliers", 0.12), ("bigtau", 0.13)] {
        let (rmse_m, inside, worst_m) = phase_2(family);
        assert!(rmse_m < most_m, "{family}: {rmse_m} m");
        assert!(worst_m < 0.3, "{family}: a run with {worst_m} m");
        assert!(inside > 0.85, "{family}: {inside} inside the bands");
    }
}

#[test]
fn sensors_without_errors_pay_next_to_nothing_for_the_unknowns_that_they_could_have() {
    let (rmse_m, inside, _) = phase_2("no_error");
    assert!(rmse_m < 0.055, "{rmse_m} m"); // 0.04 with the errors known to be none, 0.09 with all of them fitted
    assert!(inside > 0.88, "{inside} inside the bands");
}
