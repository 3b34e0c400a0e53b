//! A first guess of the angle about the vertical between a source's frame and the datum's.
//!
//! The rotation that best turns vectors u_i into w_i is that of sum u_i x w_i and sum u_i . w_i (two-dimensional
//! Procrustes problem; Schoenemann 1966), weights by residuals against outliers. The vectors are the positions about
//! their medians where both sources see, and the velocities; where they never meet, the velocities at the two ends
//! that face each other.

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

type Pair = ([f64; 2], [f64; 2]);

/// The angles, rad, that `source`, whose stamps are late by about `offset_s`, may be turned by against the datum; none
/// where it seems not to be.
pub(super) fn candidates(
    sources: &[Source],
    datum: usize,
    (source, offset_s): (usize, f64),
    coverage: &Coverage,
    priors: &Priors,
) -> Vec<f64> {
    let mut angles: Vec<f64> = Vec::new();
    for quantity in Quantity::ALL {
        let (from, to) = (sources[datum].series(quantity), sources[source].series(quantity));
        let mut pairs = pairs(from, to, offset_s, coverage.outage_s(datum, quantity));
        let slack = match quantity {
            Quantity::Position => {
                centre(&mut pairs);
                priors.drift_m_s * span_s(to)
            }
            Quantity::Velocity => {
                if pairs.len() < MIN_PAIRS {
                    pairs = facing_ends(from, to);
                }
                priors.velocity_bias_m_s
            }
        };
        if let Some((angle, sigma)) = turn(&pairs, slack)
            && angle.abs() > SIGNIFICANT_SIGMAS * sigma
        {
            angles.push(angle);
        }
    }
    angles
}

fn span_s(series: &[Sample]) -> f64 {
    series.first().zip(series.last()).map_or(0.0, |(a, b)| b.time_s - a.time_s)
}

fn level(v: [f64; 3]) -> [f64; 2] {
    [v[0], v[1]]
}

/// The datum's and the source's vectors at the source's instants.
fn pairs(from: &[Sample], to: &[Sample], offset_s: f64, max_gap_s: f64) -> Vec<Pair> {
    let pair =
        |s: &Sample| Some((level(interpolate(from, s.time_s - offset_s, max_gap_s)?.value), level(s.value)));
    to.iter().filter_map(pair).collect()
}

/// The median vectors of the last and first samples of two series that don't meet.
fn facing_ends(from: &[Sample], to: &[Sample]) -> Vec<Pair> {
    let end = |series: &[Sample], last: bool| -> Option<[f64; 2]> {
        let n = series.len().min(AT_AN_END);
        let part = if last { &series[series.len() - n..] } else { &series[..n] };
        let median =
            |axis: usize| robust::median(&mut part.iter().map(|s| s.value[axis]).collect::<Vec<_>>());
        Some([median(0)?, median(1)?])
    };
    let first = |series: &[Sample]| series.first().map_or(0.0, |s| s.time_s);
    let datum_leads = first(from) <= first(to);
    end(from, datum_leads).zip(end(to, !datum_leads)).into_iter().collect()
}

/// Counts both sides from their medians.
fn centre(pairs: &mut [Pair]) {
    for axis in 0..2 {
        let median = |values: Vec<f64>| robust::median(&mut { values }).unwrap_or(0.0);
        let from = median(pairs.iter().map(|p| p.0[axis]).collect());
        let to = median(pairs.iter().map(|p| p.1[axis]).collect());
        pairs.iter_mut().for_each(|p| (p.0[axis], p.1[axis]) = (p.0[axis] - from, p.1[axis] - to));
    }
}

/// The angle and its standard deviation, the noise from the residuals; `slack` is an error that all vectors may
/// share.
fn turn(pairs: &[Pair], slack: f64) -> Option<(f64, f64)> {
    let mut weights = vec![1.0; pairs.len()];
    let mut found = None;
    for _ in 0..STEPS {
        let (mut cross, mut dot, mut squares) = (0.0, 0.0, 0.0);
        for ((u, w), weight) in pairs.iter().zip(&weights) {
            cross += weight * (u[0] * w[1] - u[1] * w[0]);
            dot += weight * (u[0] * w[0] + u[1] * w[1]);
            squares += weight * (u[0] * u[0] + u[1] * u[1]);
        }
        let angle = cross.atan2(dot);
        let (sin, cos) = angle.sin_cos();
        let left = |(u, w): &Pair| (w[0] - cos * u[0] + sin * u[1]).hypot(w[1] - sin * u[0] - cos * u[1]);
        let lengths: Vec<f64> = pairs.iter().map(left).collect();
        let typical = robust::median(&mut lengths.clone())?;
        let total: f64 = weights.iter().sum();
        let mean_square = squares / total;
        if mean_square <= 0.0 {
            return None;
        }
        let sigma = ((typical * typical / total + slack * slack) / mean_square).sqrt();
        found = Some((angle, sigma));
        for (weight, length) in weights.iter_mut().zip(&lengths) {
            *weight = if *length > typical { typical / length } else { 1.0 };
        }
    }
    found
}
