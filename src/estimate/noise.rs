//! The noise of a series that says nothing of it: how far each sample lies from the cubic through its four
//! neighbours.
//!
//! A smooth motion leaves 1/6 of its fourth derivative times dt^4, white noise of standard deviation sigma
//! leaves `sigma sqrt(1 + sum l_k^2)`, l_k the Lagrange weights at the sample's own irregular times. The
//! median absolute value over all samples and axes makes it indifferent to outliers. Noise that is
//! correlated from sample to sample looks smaller than it is.

use crate::math::robust;
use crate::sample::Sample;

/// Neighbours that lie so unevenly that they amplify noise by more than this tell nothing.
const MAX_AMPLIFICATION: f64 = 20.0;

/// A series of which a larger share repeats its predecessor is held or quantised: its scatter says nothing.
const MOST_HELD: f64 = 0.3;

/// Fewest residuals that make an estimate.
const MIN_RESIDUALS: usize = 12;

/// The standard deviation of the noise of an ordered series, one for all axes; `None` where there are too
/// few samples to tell, or most of them repeat their predecessor.
///
/// Never below 1e-6 of the values' range (or 1e-9), so that noise-free data keep finite weights.
#[must_use]
pub fn estimate_sigma(series: &[Sample]) -> Option<f64> {
    let mut residuals: Vec<f64> = series.windows(5).filter_map(residuals).flatten().collect();
    let held = series.windows(2).filter(|w| w[0].value == w[1].value).count();
    if residuals.len() < MIN_RESIDUALS || held as f64 > MOST_HELD * series.len() as f64 {
        return None;
    }
    let range = (0..3)
        .map(|axis| {
            let values = series.iter().map(|s| s.value[axis]);
            let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            ends.1 - ends.0
        })
        .fold(0.0, f64::max);
    robust::sigma_about_zero(&mut residuals).map(|sigma| sigma.max(1e-6 * range).max(1e-9))
}

/// The middle sample's distance from its neighbours' cubic, by axis, scaled to the noise's sigma.
fn residuals(five: &[Sample]) -> Option<[f64; 3]> {
    let neighbours = [0, 1, 3, 4];
    let t = five[2].time_s;
    let weights = neighbours.map(|k| {
        let others = neighbours.iter().filter(|&&j| j != k);
        others.map(|&j| (t - five[j].time_s) / (five[k].time_s - five[j].time_s)).product::<f64>()
    });
    let amplification = 1.0 + weights.iter().map(|w| w * w).sum::<f64>();
    (amplification < MAX_AMPLIFICATION).then(|| {
        std::array::from_fn(|axis| {
            let cubic: f64 = neighbours.iter().zip(weights).map(|(&k, w)| w * five[k].value[axis]).sum();
            (five[2].value[axis] - cubic) / amplification.sqrt()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A climb-like motion at 50 Hz with jitter, noise of 0.1, and every `wild`-th sample 10 m off.
    fn series(noise: f64, wild: usize) -> Vec<Sample> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        (0..400)
            .map(|i| {
                let jitter: f64 = StandardNormal.sample(&mut rng);
                let t = 0.02 * f64::from(i) + 0.002 * jitter;
                let off = if wild > 0 && (i as usize).is_multiple_of(wild) { 10.0 } else { 0.0 };
                let value = std::array::from_fn(|axis| {
                    let n: f64 = StandardNormal.sample(&mut rng);
                    (t * (axis as f64 + 1.0)).sin() * 5.0 + noise * n + off
                });
                Sample { time_s: t, value, sigma: [1.0; 3] }
            })
            .collect()
    }

    #[test]
    fn white_noise_is_found_within_a_tenth_at_irregular_times() {
        let sigma = estimate_sigma(&series(0.1, 0)).expect("enough");
        assert!((sigma - 0.1).abs() < 0.01, "{sigma}");
    }

    #[test]
    fn one_outlier_in_twenty_moves_it_by_less_than_half() {
        let sigma = estimate_sigma(&series(0.1, 20)).expect("enough");
        assert!((0.09..0.15).contains(&sigma), "{sigma}");
    }

    #[test]
    fn noise_free_data_keep_a_positive_sigma_and_few_data_give_none() {
        let clean = series(0.0, 0);
        let sigma = estimate_sigma(&clean).expect("enough");
        assert!(sigma > 0.0 && sigma < 1e-3, "{sigma}");
        assert_eq!(estimate_sigma(&clean[..7]), None);
    }

    #[test]
    fn held_values_tell_nothing() {
        let mut held = series(0.1, 0);
        for run in held.chunks_mut(10) {
            let first = run[0].value;
            run.iter_mut().for_each(|s| s.value = first);
        }
        assert_eq!(estimate_sigma(&held), None);
    }

    #[test]
    fn equal_times_are_passed_over() {
        let mut doubled = series(0.1, 0);
        for pair in doubled.chunks_mut(2) {
            pair[1].time_s = pair[0].time_s;
        }
        assert_eq!(estimate_sigma(&doubled), None);
    }
}
