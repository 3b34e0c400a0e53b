//! Zhang 2025, segments: order-4 PCF on the rise (A), around the speed peak (B) and on the fall (C).
//!
//! On the samples of one perfect sensor: what doesn't fit is the polynomials' alone.

use trackfuse::estimate::Coefficients;
use trackfuse::estimate::polynomial::{self, Polynomial};
use trackfuse::sample::{Sample, Source};
use trackfuse::track::Curve;

use super::markdown;
use super::table_1::rmse;
use super::trial::{FRAMES, Trial, Z, time_s};

/// Frames on each side of the speed peak that are B's.
const HALF_B: usize = 20;

/// One segment and its polynomial.
pub(crate) struct Segment {
    pub(crate) name: &'static str,
    /// First and last frame; a boundary is in both of its segments.
    pub(crate) frames: [usize; 2],
    pub(crate) fitted: Polynomial,
}

/// How well one segment is fitted.
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// Eq. 12 to the samples, m and m/s.
    pub(crate) rmse: [f64; 2],
    /// The worst vertical speed in the segment's middle half, m/s.
    pub(crate) middle: f64,
    /// The worst vertical speed outside of that, m/s.
    pub(crate) ends: f64,
}

/// What parts two neighbours at their common frame: the later less the earlier.
pub(crate) struct Join {
    pub(crate) name: &'static str,
    /// m
    pub(crate) z: f64,
    /// m/s
    pub(crate) v: f64,
    /// m/s2
    pub(crate) a: f64,
}

/// The trial of this figure: the steep climb, seed 1, without noise.
pub(crate) fn trial() -> Trial {
    Trial::steep(1, 0.0, false)
}

/// A, B and C.
pub(crate) fn segments(trial: &Trial) -> Vec<Segment> {
    let sample =
        |i: usize, value: f64| Sample { time_s: time_s(i), value: [0.0, 0.0, value], sigma: [1.0; 3] };
    let samples = vec![Source {
        name: "perfect".into(),
        positions: (0..FRAMES).map(|i| sample(i, trial.truth(time_s(i)).z)).collect(),
        velocities: (0..FRAMES).map(|i| sample(i, trial.truth(time_s(i)).v)).collect(),
    }];
    let speed = |i: &usize| trial.truth(time_s(*i)).v;
    let peak = (0..FRAMES).max_by(|a, b| speed(a).total_cmp(&speed(b))).unwrap_or(0);
    let bounds = [0, peak - HALF_B, peak + HALF_B, FRAMES - 1];
    let segment = |(name, pair): (&'static str, &[usize])| {
        let (from_s, to_s) = (time_s(pair[0]), time_s(pair[1]));
        let fitted = polynomial::fit(&samples, from_s, to_s, 4, Coefficients::Shared, None);
        Segment { name, frames: [pair[0], pair[1]], fitted: fitted.expect("enough samples") }
    };
    ["A, rising", "B, around the peak", "C, falling"]
        .into_iter()
        .zip(bounds.windows(2))
        .map(segment)
        .collect()
}

/// How well each segment is fitted.
pub(crate) fn rows(trial: &Trial) -> Vec<Row> {
    let row = |segment: &Segment| {
        let [first, last] = segment.frames;
        let errors: Vec<(f64, f64)> = (first..=last)
            .map(|i| {
                let (truth, made) =
                    (trial.truth(time_s(i)), segment.fitted.at(time_s(i)).expect("everywhere"));
                (made.position[Z] - truth.z, made.velocity[Z] - truth.v)
            })
            .collect();
        let quarter = errors.len() / 4;
        let worst = |part: &[(f64, f64)]| part.iter().fold(0.0, |w: f64, e| w.max(e.1.abs()));
        Row {
            name: segment.name,
            from_s: time_s(first),
            to_s: time_s(last),
            rmse: [rmse(errors.iter().map(|e| e.0)), rmse(errors.iter().map(|e| e.1))],
            middle: worst(&errors[quarter..errors.len() - quarter]),
            ends: worst(&errors[..quarter]).max(worst(&errors[errors.len() - quarter..])),
        }
    };
    segments(trial).iter().map(row).collect()
}

/// What parts A from B, and B from C.
pub(crate) fn joins(trial: &Trial) -> Vec<Join> {
    let join = |(name, pair): (&'static str, &[Segment])| {
        let at = |segment: &Segment| segment.fitted.at(time_s(pair[1].frames[0])).expect("everywhere");
        let (before, after) = (at(&pair[0]), at(&pair[1]));
        let a = |s: trackfuse::track::State| s.acceleration.map_or(f64::NAN, |a| a[Z]);
        Join {
            name,
            z: after.position[Z] - before.position[Z],
            v: after.velocity[Z] - before.velocity[Z],
            a: a(after) - a(before),
        }
    };
    ["A to B", "B to C"].into_iter().zip(segments(trial).windows(2)).map(join).collect()
}

/// The page's table of fits.
pub(crate) fn table() -> String {
    let cells = |Row { name, from_s, to_s, rmse, middle, ends }| {
        [
            String::from(name),
            format!("{from_s:.2} to {to_s:.2}"),
            format!("{:.3}", rmse[0]),
            format!("{:.2}", rmse[1]),
            format!("{middle:.2}"),
            format!("{ends:.2}"),
        ]
    };
    let head = [
        "segment",
        "s",
        "RMSE, m",
        "RMSE, m/s",
        "worst in its middle half, m/s",
        "worst in its outer quarters, m/s",
    ];
    markdown::table(head, rows(&trial()).into_iter().map(cells))
}

/// The page's table of steps between neighbours.
pub(crate) fn join_table() -> String {
    let cells = |Join { name, z, v, a }| {
        [String::from(name), format!("{z:+.3}"), format!("{v:+.2}"), format!("{a:+.1}")]
    };
    let head = ["from", "in height, m", "in speed, m/s", "in acceleration, m/s²"];
    markdown::table(head, joins(&trial()).into_iter().map(cells))
}
