//! Logs with their truth.

use std::fs;
use std::path::Path;

use serde_json::Value;
use trackfuse::config::SourceConfig;
use trackfuse::estimate::registration::{Registered, Settings, register};
use trackfuse::log::Log;
use trackfuse::sample::Source;
use trackfuse::simulate::FAMILIES;
use trackfuse::source;
use trackfuse::time::Time;
use trackfuse::track::Curve;

use crate::tally::{Sum, Tally, print_head, print_pooled, print_row};

/// A log's sources, the datum's index, and the instant that the samples' seconds count from.
fn load(log: &Log) -> (Vec<Source>, usize, Time) {
    let configs = source::recognise(log, "/fused").expect("a log with sources").sources;
    let (loaded, origin, _) = source::load(log, &configs, false, None).expect("samples");
    let configs: Vec<SourceConfig> = loaded.iter().map(|l| l.config.clone()).collect();
    (loaded.into_iter().map(|l| l.source).collect(), source::datum(&configs), origin)
}

/// The sources on one piece, from the first to the last of their samples, and over `[from_s, to_s]`.
fn registered(sources: &[Source], datum: usize, (from_s, to_s): (f64, f64)) -> Registered {
    let spans = sources.iter().filter_map(Source::span_s);
    let piece = spans.fold((from_s, to_s), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    register(sources, datum, &[piece], &Settings::default()).expect("a log that can be registered")
}

/// `FAMILY_K.mcap` with `FAMILY_K.truth.csv` and `.truth.json`, four of each family.
pub(crate) fn climbs(folder: &Path) {
    let mut all = Tally::default();
    print_head();
    for family in FAMILIES {
        let (mut tally, mut worst) = (Tally::default(), 0.0_f64);
        for run in 0..4 {
            let own = climb(&folder.join(format!("{family}_{run}")));
            worst = worst.max(own.0[2].rmse(0));
            tally.merge(&own);
        }
        all.merge(&tally);
        print_row(family, &tally, &format!("worst {worst:.2} m"));
    }
    print_pooled(&all);
}

fn climb(stem: &Path) -> Tally {
    let log = Log::open(stem.with_extension("mcap")).expect("a log");
    let (sources, datum, origin) = load(&log);
    let text = fs::read(stem.with_extension("truth.json")).expect("the truth's phases");
    let truth: Value = serde_json::from_slice(&text).expect("JSON");
    let zero = Time::from_ns(truth["epoch_ns"].as_i64().expect("an instant"));
    let zero_s = zero.seconds_since(origin);
    let phase = |name: &str| truth["phases"][name].as_f64().expect("an instant");
    let found = registered(&sources, datum, (zero_s, zero_s + phase("T2")));
    let mut tally = Tally::default();
    let rows = fs::read_to_string(stem.with_extension("truth.csv")).expect("the truth");
    for row in rows.lines().skip(1) {
        let row: Vec<f64> = row.split(',').map(|v| v.parse().expect("a number")).collect();
        if row[0] > phase("T2") {
            break;
        }
        let state = found.curve.at(zero_s + row[0]).expect("inside the piece");
        let vector = |at: usize| [row[at], row[at + 1], row[at + 2]];
        tally.add((row[0], (phase("ov0"), phase("ov1"))), &state, vector(1), vector(4));
    }
    tally
}

/// A log that holds the true positions itself.
pub(crate) fn flight(path: &Path, truth: &str) {
    let log = Log::open(path).expect("a log");
    let (sources, datum, origin) = load(&log);
    let config =
        SourceConfig { name: "truth".into(), position: Some(truth.into()), ..SourceConfig::default() };
    let (truth, truth_origin, _) = source::load(&log, &[config], true, None).expect("the truth");
    let shift_s = truth_origin.seconds_since(origin);
    let found = registered(&sources, datum, (f64::INFINITY, f64::NEG_INFINITY));
    for unknown in &found.unknowns {
        let axis = unknown.name.axis.map_or("", |axis| ["x", "y", "z"][axis]);
        println!(
            "{:9} {:13} {axis:1} {:8.4} +- {:.4} {:3}  there: {:.2}  {:?}",
            sources[unknown.name.source].name,
            unknown.name.kind.name(),
            unknown.value,
            unknown.sigma,
            unknown.name.kind.unit(),
            unknown.probability,
            unknown.separation,
        );
    }
    let seen_s = sources[datum].span_s().expect("samples").1;
    let mut sums = [Sum::default(); 2];
    for sample in &truth[0].source.positions {
        let time_s = sample.time_s + shift_s;
        if let Some(state) = found.curve.at(time_s) {
            sums[usize::from(time_s > seen_s)].add(&state, sample.value, state.velocity);
        }
    }
    for (sum, what) in sums.iter().zip(["seen by the datum", "after it"]) {
        println!("{what}: {:.4} m, {:.3} inside", sum.rmse(0), sum.coverage(0));
    }
}
