//! A first guess of a clock that is far off.
//!
//! Gauss-Newton finds a clock offset that is small against the path's turns; further off it ends in another valley. So
//! the speeds of two sources are held against each other, the source's shifted by so many seconds: that level and the
//! one upwards, which no rotation about the vertical changes; where velocities are missing, positions.

use super::unknowns::Priors;
use crate::estimate::coverage::{Coverage, interpolate};
use crate::math::robust;
use crate::sample::{Quantity, Sample, Source};

/// Offsets up to this one are looked at, this far apart, s.
const FARTHEST_S: f64 = 5.0;
const STEP_S: f64 = 0.1;

/// Offsets within so many sigmas of the prior are found without help.
const NEAR_SIGMAS: f64 = 5.0;

/// An offset is begun with that leaves less than this share of the difference that none leaves.
const BETTER: f64 = 0.5;

/// At most so many samples of the source are compared, and at least so many, whatever the offset.
const MOST_PAIRS: usize = 100;
const MIN_PAIRS: usize = 12;

/// How late the stamps of `source` seem to be against those of the datum, s; 0 where nothing speaks for more than a
/// little.
pub(super) fn first_offset_s(
    sources: &[Source],
    datum: usize,
    source: usize,
    coverage: &Coverage,
    priors: &Priors,
) -> f64 {
    for quantity in [Quantity::Velocity, Quantity::Position] {
        let (from, to) = (sources[datum].series(quantity), sources[source].series(quantity));
        let gap_s = coverage.outage_s(datum, quantity);
        let Some((first, last)) = from.first().zip(from.last()) else { continue };
        let seen: Vec<&Sample> =
            to.iter().filter(|s| (first.time_s..=last.time_s).contains(&s.time_s)).collect();
        let thin = seen.len().div_ceil(MOST_PAIRS).max(1);
        let compared: Vec<&Sample> = seen.into_iter().step_by(thin).collect();
        let left = |offset_s: f64| difference(from, &compared, offset_s, quantity, gap_s);
        let Some(none) = left(0.0) else { continue };
        let count = (FARTHEST_S / STEP_S) as i32;
        let offsets = (-count..=count).map(|k| f64::from(k) * STEP_S);
        let tried = offsets.filter_map(|offset_s| Some((offset_s, left(offset_s)?)));
        let best = tried.min_by(|a, b| a.1.total_cmp(&b.1));
        return best.map_or(0.0, |(offset_s, least)| {
            let far = offset_s.abs() > NEAR_SIGMAS * priors.clock_offset_s;
            if far && least < BETTER * none { offset_s } else { 0.0 }
        });
    }
    0.0
}

/// The median distance of what two series measure, the second's stamps late by `offset_s`, but for a constant.
fn difference(
    from: &[Sample],
    compared: &[&Sample],
    offset_s: f64,
    quantity: Quantity,
    gap_s: f64,
) -> Option<f64> {
    let seen = |value: [f64; 3]| match quantity {
        Quantity::Velocity => [value[0].hypot(value[1]), value[2], 0.0],
        Quantity::Position => value,
    };
    let apart = |s: &&Sample| {
        let (a, b) = (seen(interpolate(from, s.time_s - offset_s, gap_s)?.value), seen(s.value));
        Some([b[0] - a[0], b[1] - a[1], b[2] - a[2]])
    };
    let differences: Vec<[f64; 3]> = compared.iter().filter_map(apart).collect();
    if differences.len() < MIN_PAIRS.max(compared.len() / 3) {
        return None;
    }
    let mut total = 0.0;
    for axis in 0..3 {
        let mut values: Vec<f64> = differences.iter().map(|d| d[axis]).collect();
        let middle = robust::median(&mut values)?;
        values.iter_mut().for_each(|v| *v = (*v - middle).abs());
        total += robust::median(&mut values)?.powi(2);
    }
    Some(total.sqrt())
}
