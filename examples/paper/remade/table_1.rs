//! Zhang 2025, Table 1: how far the methods' tracks lie from the samples on Z, phase by phase.

use trackfuse::estimate::Coefficients;
use trackfuse::math::robust;
use trackfuse::sample::Quantity;

use super::markdown;
use super::tracks::{Track, sff, tracks};
use super::trial::Trial;

/// A row: position (m) in phase 1 alone, in the overlap, in phase 2 alone; velocity (m/s) likewise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) method: &'static str,
    pub(crate) rmse: [f64; 6],
}

/// The paper's rows.
pub(crate) const PAPER: [Row; 6] = [
    Row { method: "GDF", rmse: [0.0, 1.163, 0.0, 0.0, 1.107, 0.0] },
    Row { method: "PCF (12)", rmse: [0.066, 1.190, 0.171, 0.048, 1.119, 0.171] },
    Row { method: "SFF", rmse: [0.081, 1.166, 0.135, 0.079, 1.114, 0.109] },
    Row { method: "moving average, 5 pts", rmse: [0.031, 1.163, 0.076, 0.227, 1.111, 0.181] },
    Row { method: "moving average, 16 pts", rmse: [0.065, 1.157, 0.133, 0.103, 1.119, 0.148] },
    Row { method: "moving average, 32 pts", rmse: [0.154, 1.141, 0.189, 0.262, 1.141, 0.353] },
];

/// Climbs that nothing was searched for.
const CLIMBS: u64 = 50;

/// E = sqrt(sum e^2 / N) of the errors e (Zhang 2025, eq. 12); NaN of none.
pub(crate) fn rmse(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = errors.fold((0.0, 0), |(sum, count), e| (sum + e * e, count + 1));
    (sum / f64::from(count)).sqrt()
}

/// All methods on one trial.
pub(crate) fn rows(trial: &Trial) -> Vec<Row> {
    tracks(trial).iter().map(|track| row(trial, track)).collect()
}

fn row(trial: &Trial, track: &Track) -> Row {
    let rmse = std::array::from_fn(|i| phase_rmse(trial, track, Quantity::ALL[i / 3], i % 3));
    Row { method: track.name, rmse }
}

/// Eq. 12 with N the samples of the phase; in the overlap those of both classes.
fn phase_rmse(trial: &Trial, track: &Track, quantity: Quantity, phase: usize) -> f64 {
    let made = match quantity {
        Quantity::Position => &track.z,
        Quantity::Velocity => &track.v,
    };
    let phase_of = |frame: usize| trial.overlap.iter().filter(|&&first| frame >= first).count();
    let inside = trial.observed(quantity).filter(|(frame, _)| phase_of(*frame) == phase);
    rmse(inside.map(|(frame, value)| made[frame] - value)) // (12)
}

/// SFF with p = q, which the paper's text means and its table can't have: the velocity is the position's derivative.
pub(crate) fn row_shared(trial: &Trial) -> Row {
    let track = Track::of("SFF, velocity its derivative", &sff(&trial.fused(), Coefficients::Shared));
    row(trial, &track)
}

/// Medians over climbs that nothing was searched for.
pub(crate) fn rows_not_searched() -> Vec<Row> {
    let runs: Vec<Vec<Row>> = (1..=CLIMBS).map(|seed| rows(&Trial::not_searched(seed))).collect();
    let median = |method: usize, i: usize| {
        let mut values: Vec<f64> = runs.iter().map(|rows| rows[method].rmse[i]).collect();
        robust::median(&mut values).expect("there are climbs")
    };
    let row = |(i, row): (usize, &Row)| Row { rmse: std::array::from_fn(|k| median(i, k)), ..*row };
    runs[0].iter().enumerate().map(row).collect()
}

/// The page's table.
pub(crate) fn table() -> String {
    let trial = Trial::of_table_1();
    let cells = |method: &str, whose: &str, row: &Row| {
        let [a, b, c, d, e, f] = row.rmse.map(|e| format!("{e:.3}"));
        [method.into(), whose.into(), a, b, c, d, e, f]
    };
    let mut table = Vec::new();
    for ((ours, not_searched), paper) in rows(&trial).iter().zip(&rows_not_searched()).zip(&PAPER) {
        table.push(cells(&format!("**{}**", paper.method), "paper", paper));
        table.push(cells("", "**here**", ours));
        table.push(cells("", "not searched", not_searched));
    }
    let shared = row_shared(&trial);
    table.push(cells(&format!("**{}**", shared.method), "**here**", &shared));
    let head = [
        "method",
        "whose",
        "position, m: phase 1",
        "overlap",
        "phase 2",
        "velocity, m/s: phase 1",
        "overlap",
        "phase 2",
    ];
    markdown::table(head, table)
}
