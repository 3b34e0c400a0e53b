//! What two sources' axes differ by, before anything is fitted: a first guess of the angle about the vertical, and
//! whether the axes are mirrored, which no angle mends.
//!
//! The rotation that best turns vectors u_i into w_i is that of sum u_i x w_i and sum u_i . w_i (two-dimensional
//! Procrustes problem; Schoenemann 1966), weights by residuals against outliers. The vectors are the positions about
//! their medians where both sources see, and the velocities; where they never meet, the velocities at the two ends
//! that face each other. An error g_i e that all w_i share (a drift, which grows with time, a bias of the velocity)
//! turns them by up to |e| |sum g_i u_i| / sum |u_i|^2: next to nothing where the path comes back.

use super::model::turned;
use super::unknowns::Priors;
use crate::estimate::coverage::{Coverage, interpolate};
use crate::math::robust;
use crate::sample::{Quantity, Sample, Source};

/// An angle is looked into from this many standard deviations on.
const SIGNIFICANT_SIGMAS: f64 = 3.5;

/// Fewest pairs of vectors.
const MIN_PAIRS: usize = 8;

/// Steps of reweighting.
const STEPS: usize = 10;

/// Samples at each of two ends that face each other.
const AT_AN_END: usize = 20;

/// Vectors shorter than this many times what is left of them are noise, and have no direction.
const MOVES: f64 = 1.5;

/// Axes are taken for mirrored that leave less than this share of what they leave as they are: a path that is
/// straight or at rest shows neither.
const MIRRORED: f64 = 0.3;

/// A drift of so many standard deviations is not taken for axes that are mirrored.
const DRIFT_SIGMAS: f64 = 2.0;

/// A turn is clear that leaves less than this share of what none leaves, by more than an angle that a late clock could
/// feign on a curve, rad.
const CLEAR: f64 = 0.3;
const CLEAR_RAD: f64 = 0.5;

/// The median length of two normal numbers of variance 1.
const RAYLEIGH_MEDIAN: f64 = 1.177_410_022_515_474_7;

/// What the datum and another source say of one instant.
#[derive(Clone, Copy)]
struct Pair {
    time_s: f64,
    datum: [f64; 3],
    source: [f64; 3],
}

/// Axes of a source that are no rotation of the datum's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirrored {
    /// North, east, down, taken for east, north, up.
    Ned,
    /// x and y change places, or one of them its sign.
    Level,
    /// z counts the other way.
    Vertical,
}

/// A turned frame: its zero may be anywhere, too.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Frame {
    /// Angle from the datum's frame to it, rad.
    pub(super) angle_rad: f64,
    /// Where the datum's zero lies in it, m; the height is not looked at.
    pub(super) zero_m: [f64; 3],
    /// Standard deviation of what such a frame leaves of the positions, m an axis; `None` where they never meet.
    pub(super) left_m: Option<f64>,
    /// Whether that is so much less than without a turn that nothing else need be tried.
    pub(super) is_clear: bool,
}

impl Frame {
    /// A point of the datum's frame as this one has it.
    pub(super) fn image(&self, point_m: [f64; 3]) -> [f64; 3] {
        let there = turned(point_m, self.angle_rad);
        [0, 1, 2].map(|axis| there[axis] + self.zero_m[axis])
    }

    /// The frame at this angle that `pairs` of positions lie in.
    fn of(pairs: &[Pair], angle_rad: f64) -> Self {
        let unknown = Self { angle_rad, ..Self::default() };
        if pairs.len() < MIN_PAIRS {
            return unknown;
        }
        let (zero_m, left) = apart(pairs, angle_rad);
        let (_, unturned) = apart(pairs, 0.0);
        let is_clear = angle_rad.abs() > CLEAR_RAD && left < CLEAR * unturned;
        let mut heights: Vec<f64> = pairs.iter().map(|p| p.source[2] - p.datum[2]).collect();
        let vertical_m = robust::median(&mut heights).and_then(|middle| {
            heights.iter_mut().for_each(|height| *height -= middle);
            robust::sigma_about_zero(&mut heights)
        });
        let left_m = f64::max(left / RAYLEIGH_MEDIAN, vertical_m.unwrap_or(0.0));
        Self { zero_m, left_m: Some(left_m), is_clear, ..unknown }
    }
}

/// The median of what turned positions differ by, and the median length of what that leaves.
fn apart(pairs: &[Pair], angle_rad: f64) -> ([f64; 3], f64) {
    let differences: Vec<[f64; 2]> = pairs
        .iter()
        .map(|pair| {
            let there = turned(pair.datum, angle_rad);
            [pair.source[0] - there[0], pair.source[1] - there[1]]
        })
        .collect();
    let median = |values: Vec<f64>| robust::median(&mut { values }).unwrap_or(0.0);
    let [x, y] = [0, 1].map(|axis| median(differences.iter().map(|d| d[axis]).collect()));
    ([x, y, 0.0], median(differences.iter().map(|d| (d[0] - x).hypot(d[1] - y)).collect()))
}

/// The frames that `source`, whose stamps are late by about `offset_s`, may be in against the datum's; none where it
/// seems not to be turned.
pub(super) fn candidates(
    sources: &[Source],
    datum: usize,
    (source, offset_s): (usize, f64),
    coverage: &Coverage,
    priors: &Priors,
) -> Vec<Frame> {
    let mut angles: Vec<f64> = Vec::new();
    let places = {
        let (from, to) = (&sources[datum].positions, &sources[source].positions);
        pairs(from, to, offset_s, coverage.outage_s(datum, Quantity::Position))
    };
    for quantity in Quantity::ALL {
        let (from, to) = (sources[datum].series(quantity), sources[source].series(quantity));
        let mut pairs = pairs(from, to, offset_s, coverage.outage_s(datum, quantity));
        let found = match quantity {
            Quantity::Position => {
                centre(&mut pairs);
                let middle_s = pairs.iter().map(|p| p.time_s).sum::<f64>() / pairs.len().max(1) as f64;
                turn(&pairs, priors.drift_m_s, |pair| pair.time_s - middle_s)
            }
            Quantity::Velocity => {
                if pairs.len() < MIN_PAIRS {
                    pairs = facing_ends(from, to);
                }
                turn(&pairs, priors.velocity_bias_m_s, |_| 1.0)
            }
        };
        let clear = |t: &Turn| t.moves && t.angle_rad.abs() > SIGNIFICANT_SIGMAS * t.sigma_rad;
        angles.extend(found.filter(clear).map(|t| t.angle_rad));
    }
    angles.into_iter().map(|angle_rad| Frame::of(&places, angle_rad)).collect()
}

/// Whether the axes of `source` are mirrored against the datum's: its positions then fit far better than by any angle,
/// with stamps that are late by about `offset_s` or not at all: a height that counts the other way feigns an offset.
pub(super) fn mirrored(
    sources: &[Source],
    datum: usize,
    (source, offset_s): (usize, f64),
    coverage: &Coverage,
    priors: &Priors,
) -> Option<Mirrored> {
    let (from, to) = (&sources[datum].positions, &sources[source].positions);
    let max_gap_s = coverage.outage_s(datum, Quantity::Position);
    // of the level and the height, what is left as they are, and mirrored
    let (mut level, mut vertical) = ([f64::INFINITY; 2], [f64::INFINITY; 2]);
    // what a drift may put between axes that are the same, where a path is slow or straight
    let mut drifted_m = 0.0;
    for offset_s in [0.0, offset_s] {
        let mut pairs = pairs(from, to, offset_s, max_gap_s);
        if pairs.len() < MIN_PAIRS {
            continue;
        }
        centre(&mut pairs);
        let middle_s = pairs.iter().map(|p| p.time_s).sum::<f64>() / pairs.len() as f64;
        let away_s =
            robust::median(&mut pairs.iter().map(|p| (p.time_s - middle_s).abs()).collect::<Vec<_>>());
        drifted_m = f64::max(drifted_m, DRIFT_SIGMAS * priors.drift_m_s * away_s.unwrap_or(0.0));
        let swapped: Vec<Pair> =
            pairs.iter().map(|p| Pair { source: [p.source[1], p.source[0], p.source[2]], ..*p }).collect();
        for (i, (pairs, sign)) in [(&pairs, 1.0), (&swapped, -1.0)].into_iter().enumerate() {
            let height = |p: &Pair| (p.source[2] - sign * p.datum[2]).abs();
            let left = turn(pairs, 0.0, |_| 0.0).map(|turn| turn.left_m);
            level[i] = level[i].min(left.unwrap_or(f64::INFINITY));
            let left = robust::median(&mut pairs.iter().map(height).collect::<Vec<_>>());
            vertical[i] = vertical[i].min(left.unwrap_or(f64::INFINITY));
        }
    }
    let is_mirrored =
        |[plain, mirrored]: [f64; 2]| mirrored < MIRRORED * (plain - drifted_m) && plain.is_finite();
    match (is_mirrored(level), is_mirrored(vertical)) {
        (true, true) => Some(Mirrored::Ned),
        (true, false) => Some(Mirrored::Level),
        (false, true) => Some(Mirrored::Vertical),
        (false, false) => None,
    }
}

/// The datum's and the source's vectors at the source's instants.
fn pairs(from: &[Sample], to: &[Sample], offset_s: f64, max_gap_s: f64) -> Vec<Pair> {
    let pair = |s: &Sample| {
        let time_s = s.time_s - offset_s;
        Some(Pair { time_s, datum: interpolate(from, time_s, max_gap_s)?.value, source: s.value })
    };
    to.iter().filter_map(pair).collect()
}

/// The median vectors of the last and first samples of two series that don't meet.
fn facing_ends(from: &[Sample], to: &[Sample]) -> Vec<Pair> {
    let end = |series: &[Sample], last: bool| -> Option<[f64; 3]> {
        let n = series.len().min(AT_AN_END);
        let part = if last { &series[series.len() - n..] } else { &series[..n] };
        let median =
            |axis: usize| robust::median(&mut part.iter().map(|s| s.value[axis]).collect::<Vec<_>>());
        Some([median(0)?, median(1)?, median(2)?])
    };
    let first = |series: &[Sample]| series.first().map_or(0.0, |s| s.time_s);
    let datum_leads = first(from) <= first(to);
    let ends = end(from, datum_leads).zip(end(to, !datum_leads));
    ends.map(|(datum, source)| Pair { time_s: 0.0, datum, source }).into_iter().collect()
}

/// Counts both sides from their medians.
fn centre(pairs: &mut [Pair]) {
    for axis in 0..3 {
        let median = |values: Vec<f64>| robust::median(&mut { values }).unwrap_or(0.0);
        let datum = median(pairs.iter().map(|p| p.datum[axis]).collect());
        let source = median(pairs.iter().map(|p| p.source[axis]).collect());
        for pair in pairs.iter_mut() {
            (pair.datum[axis], pair.source[axis]) = (pair.datum[axis] - datum, pair.source[axis] - source);
        }
    }
}

/// An angle that turns the datum's vectors into a source's.
struct Turn {
    angle_rad: f64,
    sigma_rad: f64,
    /// The median length of what it leaves.
    left_m: f64,
    /// Whether the vectors are more than noise.
    moves: bool,
}

/// The angle that turns `pairs` best, its noise from the residuals; `slack` times `growth` is an error that all may
/// share.
fn turn(pairs: &[Pair], slack: f64, growth: impl Fn(&Pair) -> f64) -> Option<Turn> {
    let mut weights = vec![1.0; pairs.len()];
    let mut found = None;
    for _ in 0..STEPS {
        let (mut cross, mut dot, mut squares, mut grown) = (0.0, 0.0, 0.0, [0.0; 2]);
        for (pair, weight) in pairs.iter().zip(&weights) {
            let ([ux, uy, _], [wx, wy, _]) = (pair.datum, pair.source);
            cross += weight * (ux * wy - uy * wx);
            dot += weight * (ux * wx + uy * wy);
            squares += weight * (ux * ux + uy * uy);
            let growth = weight * growth(pair);
            grown = [grown[0] + growth * ux, grown[1] + growth * uy];
        }
        let angle_rad = cross.atan2(dot);
        let (sin, cos) = angle_rad.sin_cos();
        let left = |Pair { datum: [ux, uy, _], source: [wx, wy, _], .. }: &Pair| {
            (wx - cos * ux + sin * uy).hypot(wy - sin * ux - cos * uy)
        };
        let lengths: Vec<f64> = pairs.iter().map(left).collect();
        let typical = robust::median(&mut lengths.clone())?;
        if squares <= 0.0 {
            return None;
        }
        let of_noise = typical * typical / squares;
        let shared = slack * grown[0].hypot(grown[1]) / squares;
        let total: f64 = weights.iter().sum();
        found = Some(Turn {
            angle_rad,
            sigma_rad: (of_noise + shared * shared).sqrt(),
            left_m: typical,
            moves: squares > (MOVES * typical).powi(2) * total,
        });
        for (weight, length) in weights.iter_mut().zip(&lengths) {
            *weight = if *length > typical { typical / length } else { 1.0 };
        }
    }
    found
}
