//! Do two sources agree where both see?
//!
//! Their differences at common instants are noise if they do. A median difference that stands out of that
//! noise is a systematic error of one or both, which plain fusion (GDF, PCF, SFF alike) carries straight
//! into the track. Only the difference is seen, never which of them is wrong.

use super::coverage::{Coverage, interpolate};
use crate::math::robust;
use crate::sample::{Quantity, Sample, Source};

/// Differences are called systematic from this many standard deviations on: with three axes and two
/// quantities, once in 2,600 pairs of honest sources.
const SIGNIFICANT_SIGMAS: f64 = 4.0;

/// How two sources differ in one quantity where both see.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// Indices of the sources; the difference is second less first.
    pub sources: (usize, usize),
    /// What they differ in.
    pub quantity: Quantity,
    /// Median difference by axis, m or m/s.
    pub median: [f64; 3],
    /// Standard deviation of that median by axis.
    pub sigma: [f64; 3],
    /// Number of instants compared.
    pub count: usize,
}

impl Disagreement {
    /// Whether an axis' median stands out of its noise.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        self.median.iter().zip(self.sigma).any(|(m, s)| m.abs() > SIGNIFICANT_SIGMAS * s)
    }

    /// The length of the difference over the three axes, m or m/s.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.median.iter().map(|m| m * m).sum::<f64>().sqrt()
    }
}

/// Compares every two sources, of this `coverage`, in every quantity that both measure in their overlap.
#[must_use]
pub fn compare(sources: &[Source], coverage: &Coverage) -> Vec<Disagreement> {
    let mut found = Vec::new();
    for second in 0..sources.len() {
        for first in 0..second {
            for quantity in Quantity::ALL {
                let (a, b) = (sources[first].series(quantity), sources[second].series(quantity));
                // the denser one is interpolated
                let differences = if a.len() >= b.len() {
                    differences(b, a, coverage.outage_s(first, quantity), 1.0)
                } else {
                    differences(a, b, coverage.outage_s(second, quantity), -1.0)
                };
                found.extend(summarise(&differences, (first, second), quantity));
            }
        }
    }
    found
}

/// `sign` times (sample less the other series) at every sample's instant: value and expected sigma.
fn differences(samples: &[Sample], other: &[Sample], max_gap_s: f64, sign: f64) -> Vec<([f64; 3], [f64; 3])> {
    let difference = |s: &Sample| {
        let there = interpolate(other, s.time_s, max_gap_s)?;
        let value = std::array::from_fn(|i| sign * (s.value[i] - there.value[i]));
        Some((value, std::array::from_fn(|i| s.sigma[i].hypot(there.sigma[i]))))
    };
    samples.iter().filter_map(difference).collect()
}

fn summarise(
    differences: &[([f64; 3], [f64; 3])],
    sources: (usize, usize),
    quantity: Quantity,
) -> Option<Disagreement> {
    let count = differences.len();
    if count == 0 {
        return None;
    }
    let (mut medians, mut sigmas) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let mut values: Vec<f64> = differences.iter().map(|d| d.0[axis]).collect();
        let deviations = |m: f64| differences.iter().map(move |d| d.0[axis] - m);
        let median = robust::median(&mut values)?;
        let spread = robust::sigma_about_zero(&mut deviations(median).collect::<Vec<_>>())?;
        let stated = robust::median(&mut differences.iter().map(|d| d.1[axis]).collect::<Vec<_>>())?;
        if !(spread.is_finite() && median.is_finite()) {
            return None;
        }
        // neighbours that deviate alike count for fewer: n (1 - r) / (1 + r)
        let clipped: Vec<f64> = deviations(median).map(|d| d.clamp(-3.0 * spread, 3.0 * spread)).collect();
        let correlation = lag_one_correlation(&clipped).clamp(0.0, 0.95);
        let effective = (count as f64 * (1.0 - correlation) / (1.0 + correlation)).max(1.0);
        medians[axis] = median;
        sigmas[axis] = 1.2533 * spread.max(stated) / effective.sqrt(); // a median's, of normal noise
    }
    Some(Disagreement { sources, quantity, median: medians, sigma: sigmas, count })
}

/// Correlation of successive numbers of zero mean; 0 of fewer than two.
fn lag_one_correlation(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|v| v * v).sum();
    let products: f64 = values.windows(2).map(|w| w[0] * w[1]).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// Pairs of sources that both measure `quantity`, but never so that it could be compared.
#[must_use]
pub fn uncompared(
    sources: &[Source],
    disagreements: &[Disagreement],
    quantity: Quantity,
) -> Vec<(usize, usize)> {
    let measures = |i: usize| !sources[i].series(quantity).is_empty();
    let compared = |pair| disagreements.iter().any(|d| d.quantity == quantity && d.sources == pair);
    let pairs = (0..sources.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
    pairs
        .filter(|&(first, second)| measures(first) && measures(second) && !compared((first, second)))
        .collect()
}

/// By axis, the largest difference in `quantity` between any two sources, but no less than that difference's
/// own sigma: a systematic error of this size can't be excluded. What a track's band must be widened by until
/// the sources are registered; 0 where no two were compared.
#[must_use]
pub fn systematic_sigma(disagreements: &[Disagreement], quantity: Quantity) -> [f64; 3] {
    let mut widest = [0.0_f64; 3];
    for d in disagreements.iter().filter(|d| d.quantity == quantity) {
        for axis in 0..3 {
            widest[axis] = widest[axis].max(d.median[axis].abs()).max(d.sigma[axis]);
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn source(seed: u64, bias: f64, from: f64, step: f64) -> Source {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let positions = (0..100)
            .map(|i| {
                let time_s = from + step * f64::from(i);
                let value = std::array::from_fn(|_| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    time_s + 0.1 * noise + bias
                });
                Sample { time_s, value, sigma: [0.1; 3] }
            })
            .collect();
        Source { name: "test".into(), positions, velocities: Vec::new() }
    }

    fn compared(sources: &[Source]) -> Vec<Disagreement> {
        compare(sources, &Coverage::of(sources))
    }

    #[test]
    fn honest_sources_agree_in_all_of_a_hundred_pairs() {
        for seed in 0..100 {
            let found = compared(&[source(seed, 0.0, 0.0, 0.02), source(seed + 1000, 0.0, 1.0, 0.05)]);
            assert_eq!(found.len(), 1);
            assert!(!found[0].is_significant(), "{found:?}");
            let systematic = systematic_sigma(&found, Quantity::Position);
            assert!(systematic.iter().all(|s| (0.01..0.2).contains(s)), "{systematic:?}");
        }
    }

    #[test]
    fn a_bias_of_one_sigma_is_found_with_its_sign() {
        for (first, second, sign) in [(0.0, 0.15, 1.0), (0.15, 0.0, -1.0)] {
            let found = compared(&[source(1, first, 0.0, 0.02), source(2, second, 0.5, 0.02)]);
            assert!(found[0].is_significant());
            assert!((found[0].median[1] - sign * 0.15).abs() < 0.05, "{found:?}");
            assert!(systematic_sigma(&found, Quantity::Position)[1] > 0.1);
        }
    }

    #[test]
    fn sources_that_never_meet_are_not_compared() {
        let found = compared(&[source(1, 0.0, 0.0, 0.02), source(2, 9.0, 5.0, 0.02)]);
        assert!(found.is_empty());
        let apart = [source(1, 0.0, 0.0, 0.02), source(2, 9.0, 5.0, 0.02)];
        assert_eq!(uncompared(&apart, &found, Quantity::Position), [(0, 1)]);
        assert!(uncompared(&apart, &found, Quantity::Velocity).is_empty());
        assert_eq!(systematic_sigma(&found, Quantity::Position), [0.0; 3]);
    }
}
