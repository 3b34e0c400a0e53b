//! PCF held against Zhang 2025: how far an order-4 polynomial extrapolates, and how an order-12 one fails.

use trackfuse::estimate::Coefficients;
use trackfuse::estimate::polynomial;
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{Scenario, Simulation, simulate};
use trackfuse::track::Curve;

/// The steep climb as the paper has it: 185 samples at 50 Hz, sensors without systematic errors.
fn steep_climb(seed: u64) -> Simulation {
    let mut scenario = Scenario::family("nominal").expect("a family");
    scenario.seed = seed;
    let errors = &mut scenario.beacon.errors;
    errors.bias_sigma_m = 0.0;
    errors.velocity_bias_sigma_m_s = 0.0;
    errors.drift_sigma_m_s = 0.0;
    errors.scale_sigma = 0.0;
    errors.clock_offset_max_s = 0.0;
    simulate(&scenario).expect("a good scenario")
}

fn beacon(simulation: &Simulation) -> Source {
    let record = simulation.sensor("beacon").expect("the climb has a beacon");
    let series = |velocity: bool| {
        record
            .samples
            .iter()
            .map(|s| Sample {
                time_s: s.stamp_s,
                value: if velocity { s.velocity.into() } else { s.position.into() },
                sigma: [0.15; 3],
            })
            .collect()
    };
    Source { name: "beacon".into(), positions: series(false), velocities: series(true) }
}

/// The largest vertical error, m, over the 40 frames after the last of the 46 samples that are fitted.
fn worst_miss_m(seed: u64, order: usize) -> f64 {
    let simulation = steep_climb(seed);
    let source = beacon(&simulation);
    let n = source.positions.len();
    let (from, to) = (source.positions[n - 46].time_s, source.positions[n - 1].time_s);
    let fitted = polynomial::fit(&[source], from, to, order, Coefficients::Shared, None).expect("92 rows");
    (1..=40)
        .map(|i| to + 0.02 * f64::from(i))
        .map(|t| {
            let z = fitted.at(t).expect("everywhere").position[2];
            (z - simulation.trajectory.at(t).position.z).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn order_4_extrapolates_forty_samples_within_5_m_where_order_12_misses_by_more_than_20() {
    for seed in 1..=20 {
        let (sane, wild) = (worst_miss_m(seed, 4), worst_miss_m(seed, 12));
        assert!(sane < 5.0, "seed {seed}: order 4 misses by {sane} m");
        assert!(wild > 20.0, "seed {seed}: order 12 misses by {wild} m");
    }
}
