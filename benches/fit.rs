//! Cost of SFF a sample, positions and velocities on three axes: the fit with its penalty's weight found and
//! its posterior covariance, and the evaluation of states with their sigmas. Neither should depend on the
//! number of samples. Registration of two sources and cleaning of USBL fixes likewise.

use criterion::{
    BatchSize, BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trackfuse::estimate::registration;
use trackfuse::estimate::spline::{self, Settings};
use trackfuse::estimate::usbl;
use trackfuse::sample::{Sample, Source};
use trackfuse::track::Curve;

/// A source at 100 Hz with noise of 0.1 m and 0.1 m/s.
fn source(samples: usize) -> Source {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut series = |f: fn(f64) -> f64| {
        (0..samples)
            .map(|i| {
                let time_s = i as f64 * 0.01;
                let value = std::array::from_fn(|axis| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    5.0 * f(0.7 * time_s + axis as f64) + 0.1 * noise
                });
                Sample { time_s, value, sigma: [0.1; 3] }
            })
            .collect()
    };
    Source { name: "bench".into(), positions: series(f64::sin), velocities: series(|x| 0.7 * f64::cos(x)) }
}

fn sff(c: &mut Criterion) {
    let mut group = c.benchmark_group("sff");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for samples in [1_000, 10_000, 100_000, 1_000_000] {
        let sources = [source(samples)];
        let end_s = sources[0].span_s().map_or(0.0, |s| s.1);
        let fit = || spline::fit(&sources, 0.0, end_s, &Settings::default()).expect("a good problem");
        group.throughput(Throughput::Elements(samples as u64));
        group.bench_function(BenchmarkId::new("fit", samples), |b| {
            b.iter_batched(|| (), |()| fit(), BatchSize::PerIteration);
        });
        let fitted = fit();
        group.bench_function(BenchmarkId::new("evaluate", samples), |b| {
            b.iter(|| {
                let states = sources[0].positions.iter().filter_map(|s| fitted.at(s.time_s));
                states.map(|s| s.position[2] + s.position_sigma[2]).sum::<f64>()
            });
        });
    }
    group.finish();
}

/// All unknowns of a second source, robust, three axes: cost an instant with a position and a velocity.
fn register(c: &mut Criterion) {
    let mut group = c.benchmark_group("registration");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for samples in [1_000, 10_000, 100_000] {
        let whole = source(samples * 2 / 3);
        let end_s = whole.span_s().map_or(0.0, |s| s.1);
        let mut late = whole.within(0.5 * end_s, end_s);
        for sample in &mut late.positions {
            sample.value = sample.value.map(|v| v + 1.0);
        }
        late.positions.iter_mut().chain(&mut late.velocities).for_each(|s| s.time_s += 0.03);
        let count = whole.len() + late.len();
        let sources = [whole, late];
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("register", count), |b| {
            let settings = registration::Settings::default();
            b.iter(|| {
                registration::register(&sources, 0, &[(0.0, end_s)], &settings).expect("a good problem")
            });
        });
    }
    group.finish();
}

/// Cleaning of a dive, a fifth of its fixes wild: cost a fix, from one dive to 70 days.
fn clean_usbl(c: &mut Criterion) {
    let mut group = c.benchmark_group("usbl");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for count in [1_000, 10_000, 100_000, 1_000_000] {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let fix = |i: usize| {
            let time_s = 20.0 * (i / 4) as f64 + 0.5 * (i % 4) as f64;
            let off = if (i / 4).is_multiple_of(10) || i.is_multiple_of(11) { 60.0 } else { 0.0 };
            let value = std::array::from_fn(|axis| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                300.0 * (time_s / 500.0 + axis as f64).sin() + 3.0 * noise + off
            });
            Sample { time_s, value, sigma: [3.0; 3] }
        };
        let fixes: Vec<Sample> = (0..count).map(fix).collect();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("clean", count), |b| {
            b.iter(|| usbl::clean(&fixes, &[], &usbl::Settings::default()).expect("a good problem"));
        });
    }
    group.finish();
}

criterion_group!(benches, sff, register, clean_usbl);
criterion_main!(benches);
