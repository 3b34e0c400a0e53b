//! The last piece carried on beyond its last sample, and once more the paper's plain way.

use super::bands::Bands;
use super::pieces::Piece;
use super::{Plan, TriedLaw, grid};
use crate::estimate::coverage::{Coverage, median_interval_s};
use crate::estimate::extrapolation::{self, Choice, Extrapolation, Law, LawKind};
use crate::sample::Source;
use crate::track::{Curve, Phase, TrackPoint};

/// Order of the extrapolation that `/fused/pcf` shows, and the number of last instants it is fitted to:
/// Zhang 2025's sea trial (order 4, samples 141 to 186).
const PLAIN_PCF: (usize, usize) = (4, 46);

/// What comes after the last sample.
#[derive(Default)]
pub(super) struct Carried {
    pub(super) points: Vec<TrackPoint>,
    /// By the paper's plain polynomial.
    pub(super) plain: Vec<TrackPoint>,
    /// The laws that could be tried; the one that was taken stands first.
    pub(super) laws: Vec<TriedLaw>,
}

/// Carries `piece` on, on the grid that its last point, at `last_s`, is on.
pub(super) fn carry_on(
    piece: &Piece,
    settings: &extrapolation::Settings,
    last_s: f64,
    coverage: &Coverage,
    bands: &Bands<'_>,
    plan: &Plan,
    warnings: &mut Vec<String>,
) -> Carried {
    let (from_s, to_s, horizon_s) = (piece.from_s, piece.to_s, settings.horizon_s);
    if horizon_s > to_s - from_s {
        warnings.push(format!(
            "the track is carried on {horizon_s} s from {:.2} s that were seen: look at its band before you use it",
            to_s - from_s
        ));
    }
    let last = seeing_the_end(piece);
    let seen_by = coverage.seen_by(to_s);
    let points = |made: &Extrapolation| points(made, last_s, to_s + horizon_s, seen_by, bands, plan);
    let extrapolate = |law| extrapolation::extrapolate(&last, &*piece.curve, (from_s, to_s), law, horizon_s);
    let as_printed = Law {
        kind: LawKind::Polynomial { order: PLAIN_PCF.0, prior: None },
        window_s: last_instants_s(&last, to_s, PLAIN_PCF.1),
    };
    let plain = extrapolate(as_printed).as_ref().map_or(Vec::new(), points);
    let (mut made, mut failed) = (Vec::new(), Vec::new());
    for (i, &law) in settings.laws.iter().enumerate() {
        match extrapolate(law) {
            Ok(extrapolation) => made.push(extrapolation),
            Err(error) if settings.choice == Choice::Best || i == 0 => {
                failed.push(format!("{}: {error}", law.kind.name()));
            }
            Err(_) => {}
        }
    }
    let taken = match settings.choice {
        Choice::First => made.first().filter(|e| settings.laws.first() == Some(&e.law)),
        Choice::Best => extrapolation::best(&made),
    };
    let Some(taken) = taken else {
        warnings.push(format!("the track is not extrapolated: {}", failed.join("; ")));
        return Carried { plain, ..Carried::default() };
    };
    let others = made.iter().filter(|e| e.law != taken.law);
    let tried = |e: &Extrapolation| TriedLaw {
        law: e.law,
        holdout: e.holdout,
        clearly_better: e.holdout.clearly_better_than(&taken.holdout),
    };
    let laws = std::iter::once(taken).chain(others).map(tried).collect();
    Carried { points: points(taken), plain, laws }
}

/// The points after `last_s` up to `end_s`; `seen_by` are the sources that saw the last instant.
fn points(
    made: &Extrapolation,
    last_s: f64,
    end_s: f64,
    seen_by: u32,
    bands: &Bands<'_>,
    plan: &Plan,
) -> Vec<TrackPoint> {
    // the registered spline's own last state holds what the registration leaves open
    let is_whole = made.is_joined() && plan.is_registered_spline();
    let point = |time_s| {
        let state = made.at(time_s)?;
        Some(TrackPoint {
            time: plan.origin.plus_seconds(time_s),
            state: if is_whole { state } else { bands.widen(state, time_s, seen_by, Phase::Extrapolated) },
            phase: Phase::Extrapolated,
            method: made.law.kind.method(),
            seen_by: 0,
        })
    };
    // up to the first point at or above the stop, so that a height at the stop is reached; none from above it
    let is_above = |z_m: f64| plan.stop_z_m.is_some_and(|stop_z_m| z_m >= stop_z_m);
    let mut above = made.at(made.from_s).is_some_and(|s| is_above(s.position[2]));
    let below = |p: &TrackPoint| {
        let go_on = !above;
        above = is_above(p.state.position[2]);
        go_on
    };
    grid(last_s, end_s, plan.rate_hz).skip(1).map_while(point).take_while(below).collect()
}

/// The sources that see a piece's end, give or take two of their own intervals: one that stopped earlier may disagree
/// with them. All of them where those have no position.
fn seeing_the_end(piece: &Piece) -> Vec<Source> {
    let sees = |s: &&Source| {
        let late_s = median_interval_s(s).map_or(0.0, |interval_s| 2.0 * interval_s);
        s.span_s().is_some_and(|span| span.1 + late_s >= piece.to_s)
    };
    let last: Vec<Source> = piece.sources.iter().filter(sees).cloned().collect();
    if last.iter().all(|s| s.positions.is_empty()) { piece.sources.clone() } else { last }
}

/// The length of the stretch before `to_s` that holds the last `count` instants with a position, s.
fn last_instants_s(sources: &[Source], to_s: f64, count: usize) -> f64 {
    let mut times: Vec<f64> = sources.iter().flat_map(|s| &s.positions).map(|p| p.time_s).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let first = times.len().saturating_sub(count);
    times.get(first).map_or(0.0, |t| to_s - t + 1e-9) // so that rounding doesn't lose the first
}
