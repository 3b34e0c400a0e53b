//! Registration over many simulated runs of each family: errors against the truth, and what the bands cover.
//!
//! `cargo run --release --example registration_study -- [RUNS] [FAMILY...]`

use std::thread;
use std::time::Instant;

use trackfuse::estimate::registration::{Registered, Settings, register};
use trackfuse::sample::{Sample, Source};
use trackfuse::simulate::{FAMILIES, Phases, Scenario, Simulation, simulate};
use trackfuse::track::Curve;

/// Errors of one phase: squares, values, and how many lie within 1.96 sigmas, of position and velocity.
#[derive(Clone, Copy, Default)]
struct Sum {
    squares: [f64; 2],
    count: usize,
    inside: [usize; 2],
}

impl Sum {
    fn add(&mut self, other: &Self) {
        for q in 0..2 {
            self.squares[q] += other.squares[q];
            self.inside[q] += other.inside[q];
        }
        self.count += other.count;
    }

    fn rmse(&self, q: usize) -> f64 {
        (3.0 * self.squares[q] / self.count as f64).sqrt()
    }

    fn coverage(&self, q: usize) -> f64 {
        self.inside[q] as f64 / self.count as f64
    }
}

#[derive(Clone, Default)]
struct Outcome {
    /// Phase 1, overlap, phase 2.
    phases: [Sum; 3],
    worst: f64,
    worst_seed: u64,
    seconds: f64,
    iterations: usize,
    unconverged: usize,
    /// Squared errors of the beacon's errors over their sigmas, by unknown.
    errors: [f64; 12],
    z: [f64; 12],
    runs: usize,
    failed: usize,
    turned: usize,
    rejected: usize,
}

fn sources(simulation: &Simulation) -> Vec<Source> {
    let of = |name: &str| {
        let record = simulation.sensor(name)?;
        let sigma = if name == "tether" { 0.10 } else { 0.15 };
        let sample = |time_s, v: &[f64]| Sample { time_s, value: [v[0], v[1], v[2]], sigma: [sigma; 3] };
        let mut samples = record.samples.clone();
        samples.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
        Some(Source {
            name: name.into(),
            positions: samples.iter().map(|s| sample(s.stamp_s, s.position.as_slice())).collect(),
            velocities: samples.iter().map(|s| sample(s.stamp_s, s.velocity.as_slice())).collect(),
        })
    };
    ["tether", "beacon"].into_iter().filter_map(of).collect()
}

fn judge(simulation: &Simulation, registered: &Registered) -> [Sum; 3] {
    let mut sums = [Sum::default(); 3];
    let Phases { overlap_begin_s, overlap_end_s, t2_s, .. } = simulation.phases;
    let (low, high) = (overlap_begin_s.min(overlap_end_s), overlap_begin_s.max(overlap_end_s));
    for point in &simulation.truth {
        if point.t_s > t2_s {
            break;
        }
        let Some(state) = registered.curve.at(point.t_s) else { continue };
        let phase = if point.t_s < low { 0 } else if point.t_s <= high { 1 } else { 2 };
        let sum = &mut sums[phase];
        for axis in 0..3 {
            let errors = [
                state.position[axis] - point.state.position[axis],
                state.velocity[axis] - point.state.velocity[axis],
            ];
            let sigmas = [state.position_sigma[axis], state.velocity_sigma[axis]];
            for q in 0..2 {
                sum.squares[q] += errors[q] * errors[q];
                sum.inside[q] += usize::from(errors[q].abs() <= 1.96 * sigmas[q]);
            }
            sum.count += 1;
        }
    }
    sums
}

fn run(family: &str, seed: u64, correlation: f64) -> Outcome {
    let mut scenario = Scenario { seed, ..Scenario::family(family).expect("a family") };
    scenario.beacon.noise_correlation = correlation;
    if let Ok(share) = std::env::var("OUTLIERS") {
        let share = share.parse().expect("a share");
        (scenario.tether.outlier_share, scenario.beacon.outlier_share) = (share, share);
    }
    let simulation = simulate(&scenario).expect("a good scenario");
    let sources = sources(&simulation);
    let begun = Instant::now();
    let pieces = [(0.0, simulation.phases.t2_s)];
    let mut settings = Settings::default();
    if std::env::var_os("WHITE").is_some() {
        settings.correlated = false;
    }
    settings.knot_spacing_s = std::env::var("SPACING").ok().map(|v| v.parse().expect("s"));
    if let Ok(p) = std::env::var("PRIORS") {
        let v: Vec<f64> = p.split(',').map(|x| x.parse().expect("a number")).collect();
        let p = &mut settings.priors;
        (p.bias_m, p.drift_m_s, p.velocity_bias_m_s, p.clock_offset_s, p.scale) = (v[0], v[1], v[2], v[3], v[4]);
    }
    if std::env::var_os("ALL").is_some() {
        settings.select = false;
    }
    let Ok(registered) = register(&sources, 0, &pieces, &settings) else {
        return Outcome { failed: 1, ..Outcome::default() };
    };
    let seconds = begun.elapsed().as_secs_f64();
    let phases = judge(&simulation, &registered);
    let mut outcome = Outcome {
        phases,
        worst: phases[2].rmse(0),
        worst_seed: seed,
        seconds,
        iterations: registered.iterations,
        unconverged: usize::from(!registered.converged),
        turned: registered.errors.iter().filter(|e| e.rotation_rad != 0.0).count(),
        rejected: registered.rejected.len(),
        runs: 1,
        ..Outcome::default()
    };
    if sources.len() == 2 {
        let truth = &simulation.sensor("beacon").expect("there").errors;
        let (e, s) = (&registered.errors[1], &registered.sigmas[1]);
        for axis in 0..3 {
            for (k, found, true_value, sigma) in [
                (axis, e.bias_m[axis], truth.bias_m[axis], s.bias_m[axis]),
                (3 + axis, e.drift_m_s[axis], truth.drift_m_s[axis], s.drift_m_s[axis]),
                (
                    6 + axis,
                    e.velocity_bias_m_s[axis],
                    truth.velocity_bias_m_s[axis],
                    s.velocity_bias_m_s[axis],
                ),
            ] {
                outcome.errors[k] = (found - true_value).powi(2);
                outcome.z[k] = ((found - true_value) / sigma.max(1e-12)).powi(2);
            }
        }
        outcome.errors[9] = (e.clock_offset_s - truth.clock_offset_s).powi(2);
        outcome.errors[10] = (e.scale - truth.scale).powi(2);
        outcome.z[9] = outcome.errors[9] / s.clock_offset_s.powi(2).max(1e-24);
        outcome.z[10] = outcome.errors[10] / s.scale.powi(2).max(1e-24);
    }
    outcome
}

fn loaded(path: &std::path::Path) -> (Vec<Source>, usize, trackfuse::time::Time) {
    let log = trackfuse::log::Log::open(path).expect("a log");
    let configs = trackfuse::source::recognise(&log, "/fused").expect("sources").sources;
    let (loaded, origin, _) = trackfuse::source::load(&log, &configs, false).expect("samples");
    let configs: Vec<_> = loaded.iter().map(|l| l.config.clone()).collect();
    (loaded.into_iter().map(|l| l.source).collect(), trackfuse::source::datum(&configs), origin)
}

fn flight(path: &std::path::Path) {
    let (sources, datum, origin) = loaded(path);
    let log = trackfuse::log::Log::open(path).expect("a log");
    let config: trackfuse::config::SourceConfig = toml::from_str("name = \"truth\"\nposition = \"/cub1/pose.pose.position\"").expect("config");
    let (truth, other, _) = trackfuse::source::load(&log, &[config], true).expect("truth");
    let shift = other.seconds_since(origin);
    for s in &sources { println!("{} {:?} p {} v {} sigma {:?}", s.name, s.span_s(), s.positions.len(), s.velocities.len(), s.positions.first().map(|p| p.sigma)); }
    let from = sources.iter().filter_map(Source::span_s).map(|s| s.0).fold(f64::INFINITY, f64::min);
    let to = sources.iter().filter_map(Source::span_s).map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
    let begun = Instant::now();
    let found = register(&sources, datum, &[(from, to)], &Settings::default()).expect("fits");
    println!("{:.1?} {} {}", begun.elapsed(), found.iterations, found.converged);
    for i in 0..sources.len() { println!("{:.4?}\n{:.4?}\n{:.3?}", found.errors[i], found.sigmas[i], found.noise[i]); }
    println!("{:.3?} {:?}", found.unknowns, found.lambda);
    let gauge_end = sources[datum].span_s().expect("samples").1;
    let mut sums = [(0.0, 0.0, 0usize, 0usize); 2];
    for p in &truth[0].source.positions {
        let t = p.time_s + shift;
        let Some(state) = found.curve.at(t) else { continue };
        let s = &mut sums[usize::from(t > gauge_end)];
        for a in 0..3 {
            let e = state.position[a] - p.value[a];
            s.0 += e * e;
            s.1 += f64::from(u8::from(e.abs() < 1.96 * state.position_sigma[a]));
            s.2 += 1;
        }
        s.3 += 1;
    }
    for s in sums { println!("rmse {:.4} cover {:.3} n {}", (s.0 / s.3 as f64).sqrt(), s.1 / s.2 as f64, s.3); }
}

fn climbs(folder: &std::path::Path, only: &[String]) {
    let mut pooled = Sum::default();
    for family in FAMILIES.iter().filter(|f| only.is_empty() || only.iter().any(|o| o == *f)) {
        let mut phases = [Sum::default(); 3];
        let mut worst = 0.0_f64;
        for run in 0..4 {
            let stem = folder.join(format!("{family}_{run}"));
            let (sources, datum, origin) = loaded(&stem.with_extension("mcap"));
            let json: serde_json::Value =
                serde_json::from_slice(&std::fs::read(stem.with_extension("truth.json")).expect("truth")).expect("json");
            let zero_s = trackfuse::time::Time::from_ns(json["epoch_ns"].as_i64().expect("ns")).seconds_since(origin);
            let at = |k: &str| json["phases"][k].as_f64().expect("s");
            let (low, high, t2) = (at("ov0").min(at("ov1")), at("ov0").max(at("ov1")), at("T2"));
            let spans: Vec<_> = sources.iter().filter_map(Source::span_s).collect();
            let from = spans.iter().map(|s| s.0).fold(f64::INFINITY, f64::min).min(zero_s);
            let to = spans.iter().map(|s| s.1).fold(0.0, f64::max).max(zero_s + t2);
            let found = register(&sources, datum, &[(from, to)], &Settings::default()).expect("fits");
            if std::env::var_os("UNKNOWNS").is_some() {
                for (i, s) in sources.iter().enumerate() {
                    println!("  {} {:?} {:.2?} {:.3?} conv {} {}", s.name, s.positions.first().map(|p| p.sigma[0]), found.noise[i].map(|l| l.scale), found.noise[i].map(|l| l.correlation), found.converged, found.iterations);
                    if i != datum { println!("    {:.3?}\n    {:.3?} truth {}", found.errors[i], found.sigmas[i], json["config"]["beacon"]); }
                }
            }
            let mut own = Sum::default();
            for line in std::fs::read_to_string(stem.with_extension("truth.csv")).expect("truth").lines().skip(1) {
                let v: Vec<f64> = line.split(',').map(|x| x.parse().expect("a number")).collect();
                if v[0] > t2 { break; }
                let Some(state) = found.curve.at(zero_s + v[0]) else { continue };
                let phase = if v[0] < low { 0 } else if v[0] <= high { 1 } else { 2 };
                for sum in [&mut phases[phase], &mut own] {
                    for axis in 0..3 {
                        let errors = [state.position[axis] - v[1 + axis], state.velocity[axis] - v[4 + axis]];
                        let sigmas = [state.position_sigma[axis], state.velocity_sigma[axis]];
                        for q in 0..2 {
                            sum.squares[q] += errors[q] * errors[q];
                            sum.inside[q] += usize::from(errors[q].abs() <= 1.96 * sigmas[q]);
                        }
                        sum.count += 1;
                    }
                }
            }
            worst = worst.max(own.rmse(0));
        }
        let [a, b, c] = &phases;
        phases.iter().for_each(|p| pooled.add(p));
        println!(
            "{family:9} {:.4} {:.4} {:.4} | {:.3} {:.3} {:.3} | {:.3} {:.3} {:.3} | {:.3} {:.3} {:.3} | {worst:.3}",
            a.rmse(0), b.rmse(0), c.rmse(0), a.rmse(1), b.rmse(1), c.rmse(1),
            a.coverage(0), b.coverage(0), c.coverage(0), a.coverage(1), b.coverage(1), c.coverage(1),
        );
    }
    println!("pooled coverage p {:.3} v {:.3}", pooled.coverage(0), pooled.coverage(1));
}

fn study(family: &str, runs: u64, correlation: f64) -> Outcome {
    const THREADS: u64 = 2;
    let parts = thread::scope(|scope| {
        let handles: Vec<_> = (0..THREADS)
            .map(|part| {
                scope.spawn(move || {
                    let seeds = (1..=runs).filter(|seed| seed % THREADS == part);
                    seeds.map(|seed| run(family, seed, correlation)).collect::<Vec<_>>()
                })
            })
            .collect();
        handles.into_iter().flat_map(|h| h.join().expect("no panic")).collect::<Vec<_>>()
    });
    let mut all = Outcome::default();
    for one in parts {
        (0..3).for_each(|p| all.phases[p].add(&one.phases[p]));
        if one.worst > all.worst {
            (all.worst, all.worst_seed) = (one.worst, one.worst_seed);
        }
        all.seconds += one.seconds;
        all.iterations += one.iterations;
        all.unconverged += one.unconverged;
        all.runs += one.runs;
        all.failed += one.failed;
        all.turned += one.turned;
        all.rejected += one.rejected;
        (0..12).for_each(|k| all.errors[k] += one.errors[k]);
        (0..12).for_each(|k| all.z[k] += one.z[k]);
    }
    all
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    if let Ok(seed) = std::env::var("SEED") {
        let family = arguments.nth(1).expect("a family");
        let seed = seed.parse().expect("a seed");
        let simulation = simulate(&Scenario { seed, ..Scenario::family(&family).expect("a family") }).expect("good");
        let sources = sources(&simulation);
        let found = register(&sources, 0, &[(0.0, simulation.phases.t2_s)], &Settings::default()).expect("fits");
        println!("{:?}", simulation.sensor("beacon").map(|s| s.errors));
        println!("{:?}\n{:?}\n{:?}\n{:?} {:?} {} {}", found.errors[1], found.sigmas[1], found.unknowns, found.noise, found.lambda, found.iterations, found.converged);
        for s in judge(&simulation, &found) {
            println!("{:.4} {:.4} {:.3} {:.3}", s.rmse(0), s.rmse(1), s.coverage(0), s.coverage(1));
        }
        return;
    }
    if std::env::var_os("COST").is_some() {
        for n in [3_000usize, 30_000, 100_000] {
            let make = |from: f64, count: usize, step: f64, b: f64| {
                let mut x = 1u64;
                let mut noise = || { x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); 0.2 * ((x >> 11) as f64 / (1u64 << 53) as f64 - 0.5) };
                let mut s = Source::default();
                for i in 0..count {
                    let t = from + step * i as f64;
                    let p = std::array::from_fn(|a| 20.0 * (0.5 * t + a as f64).sin() + b + noise());
                    let v = std::array::from_fn(|a| 10.0 * (0.5 * t + a as f64).cos() + noise());
                    s.positions.push(Sample { time_s: t + b * 0.02, value: p, sigma: [0.06; 3] });
                    s.velocities.push(Sample { time_s: t + b * 0.02, value: v, sigma: [0.06; 3] });
                }
                s
            };
            let end = n as f64 / 2.0 * 0.01;
            let sources = [make(0.0, n / 2, 0.01, 0.0), make(end / 2.0, n / 2, 0.01, 1.0)];
            let begun = Instant::now();
            let found = register(&sources, 0, &[(0.0, 1.5 * end)], &Settings::default()).expect("fits");
            let took = begun.elapsed().as_secs_f64();
            println!("{n} instants: {:.2} s, {:.1} us a sample, {} knots, {} steps, {} rejected, {:?}", took, 1e6 * took / n as f64, found.knots, found.iterations, found.rejected.len(), found.errors[1]);
        }
        return;
    }
    if let Ok(path) = std::env::var("FLIGHT") {
        flight(std::path::Path::new(&path));
        return;
    }
    if let Ok(folder) = std::env::var("CLIMBS") {
        climbs(std::path::Path::new(&folder), &arguments.skip(1).collect::<Vec<_>>());
        return;
    }
    let runs: u64 = arguments.next().map_or(40, |a| a.parse().expect("a number of runs"));
    let asked: Vec<String> = arguments.collect();
    let families: Vec<(String, f64)> = if asked.is_empty() {
        FAMILIES.iter().map(|f| ((*f).to_owned(), 0.0)).collect()
    } else {
        asked
            .iter()
            .map(|f| match f.split_once('@') {
                Some((name, rho)) => (name.to_owned(), rho.parse().expect("a correlation")),
                None => (f.clone(), 0.0),
            })
            .collect()
    };
    println!(
        "family     rmse p 1/ov/2           v 1/ov/2          cover p            cover v            worst     it  ms fail"
    );
    let mut pooled = Sum::default();
    for (family, correlation) in &families {
        let all = study(family, runs, *correlation);
        let [a, b, c] = &all.phases;
        all.phases.iter().for_each(|p| pooled.add(p));
        println!(
            "{family:9} {:.4} {:.4} {:.4} | {:.3} {:.3} {:.3} | {:.3} {:.3} {:.3} | {:.3} {:.3} {:.3} | {:.2}@{} {:.1} {:.1} {}+{} turned {} rejected {:.1}",
            a.rmse(0),
            b.rmse(0),
            c.rmse(0),
            a.rmse(1),
            b.rmse(1),
            c.rmse(1),
            a.coverage(0),
            b.coverage(0),
            c.coverage(0),
            a.coverage(1),
            b.coverage(1),
            c.coverage(1),
            all.worst,
            all.worst_seed,
            all.iterations as f64 / all.runs as f64,
            1e3 * all.seconds / all.runs as f64,
            all.unconverged,
            all.failed,
            all.turned,
            all.rejected as f64 / all.runs as f64,
        );
        if std::env::var_os("UNKNOWNS").is_some() {
            let show = |v: &[f64; 12]| v.iter().take(11).map(|e| format!("{:.4}", (e / all.runs as f64).sqrt())).collect::<Vec<_>>().join(" ");
            println!("  rms  {}\n  z    {}", show(&all.errors), show(&all.z));
        }
    }
    println!("pooled coverage p {:.3} v {:.3}", pooled.coverage(0), pooled.coverage(1));
}
