//! What one exchange may mean: the sets of its fixes that agree with each other.

use std::f64::consts::TAU;
use std::ops::Range;

use super::cycles::MOST_FIXES;
use crate::sample::Sample;

/// Two fixes agree whose squared distance over its variance is below this: 0.1 % of good pairs are farther apart.
pub(super) const AGREE: f64 = 16.0;

/// Wild vectors spread over this many e-foldings of length.
const WILD_FOLDINGS: f64 = 5.0;

/// A wild vector is rarely shorter than this many sigmas.
const WILD_SIGMAS: f64 = 3.0;

/// How often fixes and whole exchanges are wild.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WildShares {
    pub(super) fix: f64,
    pub(super) cycle: f64,
}

/// A set of fixes that agree, taken together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Bit i: the exchange's i-th fix is in it.
    pub(super) members: u32,
    /// Mean time, s, and weighted mean position, m.
    pub(super) time_s: f64,
    pub(super) mean: [f64; 3],
    /// Of the mean, m^2.
    pub(super) variance: [f64; 3],
    /// Log likelihood of the exchange's fixes, given that the vehicle is at the mean.
    pub(super) log_inside: f64,
}

/// One acoustic exchange.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    /// Its fixes, in order of time.
    pub(super) fixes: Range<usize>,
    /// Their mean time, s.
    pub(super) time_s: f64,
    /// The likeliest set first; never empty.
    pub(super) candidates: Range<usize>,
}

/// Log density of being off by a vector of squared length `square_m2` where lengths of `usual_m2` are usual: even in
/// the logarithm of the length beyond that.
pub(super) fn log_off(square_m2: f64, usual_m2: f64) -> f64 {
    -(2.0 * TAU * WILD_FOLDINGS).ln() - 1.5 * (usual_m2 + square_m2).ln()
}

/// The square of the length that a wild vector usually has at least, m^2.
pub(super) fn least_wild_m2(variance: [f64; 3]) -> f64 {
    WILD_SIGMAS * WILD_SIGMAS * variance.iter().sum::<f64>() / 3.0
}

/// Log density of a normal vector.
pub(super) fn log_normal(difference: [f64; 3], variance: [f64; 3]) -> f64 {
    let square: f64 = (0..3).map(|a| difference[a] * difference[a] / variance[a]).sum();
    -0.5 * (square + (variance[0] * variance[1] * variance[2]).ln() + 3.0 * TAU.ln())
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn square(a: [f64; 3]) -> f64 {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

/// The exchanges with all their candidates. `speed_m_s` is what the vehicle does within one: fixes of different times
/// may be so far apart. `common_m2` is the variance of what an exchange's fixes have in common: horizontal, vertical.
pub(super) fn exchanges(
    fixes: &[Sample],
    groups: &[Range<usize>],
    wild: WildShares,
    speed_m_s: f64,
    common_m2: [f64; 2],
) -> (Vec<Exchange>, Vec<Candidate>) {
    let mut candidates = Vec::with_capacity(groups.len() * 2);
    let exchanges = groups
        .iter()
        .map(|group| {
            let own = &fixes[group.clone()];
            let time_s = own.iter().map(|f| f.time_s).sum::<f64>() / own.len() as f64;
            let from = candidates.len();
            of_exchange(own, time_s, wild, speed_m_s, &mut candidates);
            for candidate in &mut candidates[from..] {
                (0..3).for_each(|axis| candidate.variance[axis] += common_m2[axis / 2]);
            }
            candidates[from..].sort_by(|a, b| b.log_inside.total_cmp(&a.log_inside));
            Exchange { fixes: group.clone(), time_s, candidates: from..candidates.len() }
        })
        .collect();
    (exchanges, candidates)
}

fn of_exchange(own: &[Sample], time_s: f64, wild: WildShares, speed_m_s: f64, into: &mut Vec<Candidate>) {
    let mut variances = [[0.0; 3]; MOST_FIXES];
    for (variance, fix) in variances.iter_mut().zip(own) {
        let moved = speed_m_s * (fix.time_s - time_s);
        *variance = fix.sigma.map(|s| s * s + moved * moved);
    }
    let from = into.len();
    let mut covered = 0_u32;
    for seed in 0..own.len() {
        if covered & (1 << seed) != 0 {
            continue;
        }
        let mut members = 1_u32 << seed;
        let (mut mean, mut variance) = (own[seed].value, variances[seed]);
        for _ in 0..3 {
            let near = |i: usize| {
                let apart = minus(own[i].value, mean);
                // the mean's own share in a member is not worth its cost here
                (0..3).map(|a| apart[a] * apart[a] / (variances[i][a] + variance[a])).sum::<f64>() < AGREE
            };
            let found = (0..own.len()).filter(|&i| near(i)).fold(0, |m, i| m | 1 << i);
            if found == 0 || found == members {
                break;
            }
            members = found;
            (mean, variance) = average(own, &variances, members);
        }
        if !into[from..].iter().any(|c| c.members == members) {
            covered |= members;
            into.push(candidate(own, &variances, members, wild));
        }
    }
}

fn average(own: &[Sample], variances: &[[f64; 3]], members: u32) -> ([f64; 3], [f64; 3]) {
    let (mut weight, mut sum) = ([0.0; 3], [0.0; 3]);
    for i in (0..own.len()).filter(|i| members & (1 << i) != 0) {
        for a in 0..3 {
            weight[a] += variances[i][a].recip();
            sum[a] += own[i].value[a] / variances[i][a];
        }
    }
    (std::array::from_fn(|a| sum[a] / weight[a]), weight.map(f64::recip))
}

fn candidate(own: &[Sample], variances: &[[f64; 3]], members: u32, wild: WildShares) -> Candidate {
    let (mean, variance) = average(own, variances, members);
    let mut log_inside = 0.5 * ((variance[0] * variance[1] * variance[2]).ln() + 3.0 * TAU.ln());
    let (mut time_s, mut count) = (0.0, 0.0);
    for (i, fix) in own.iter().enumerate() {
        let apart = minus(fix.value, mean);
        if members & (1 << i) != 0 {
            log_inside += (1.0 - wild.fix).ln() + log_normal(apart, variances[i]);
            time_s += fix.time_s;
            count += 1.0;
        } else {
            log_inside += wild.fix.ln() + log_off(square(apart), least_wild_m2(variances[i]));
        }
    }
    Candidate { members, time_s: time_s / count, mean, variance, log_inside }
}
