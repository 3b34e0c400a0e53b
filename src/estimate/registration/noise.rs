//! What is left of the samples: noise levels, outliers and correlation, one a series.
//!
//! The squared length of a residual over its sigmas, q, is that of three normal numbers of variance phi, or, for
//! the few that are outliers, of variance 25 phi, or of 10,000 phi and whatever is above: a position in the wrong
//! unit, or a zero for one that is missing, may be off by any amount:
//!
//! ```text
//! gamma_k ~ pi_k s_k^-3 exp(-q / (2 s_k^2 phi)),   weight = sum_k gamma_k / s_k^2                      (1)
//! s = 1, 5, max(100, sqrt(q / (3 phi)))
//! phi     = sum weight q / (3 n - degrees of freedom of the fit)                                       (2)
//! ```
//!
//! For the outliers q is that of the residuals over their own standard deviation, sigma sqrt(1 - h) with h the share of
//! the sample in its own fit: at an end of the track the curve follows a single wild sample.
//!
//! The expectation step of a mixture of scales (Dempster, Laird, Rubin 1977) and the estimate of a variance
//! component by restricted likelihood (Patterson, Thompson 1971).

use super::residuals::Residuals;
use crate::math::robust;

/// Scales of the mixture, in sigmas, for a residual of squared length `q` in these.
fn scales(q: f64) -> [f64; 3] {
    [1.0, 5.0, f64::max(100.0, (q / 3.0).sqrt())]
}

/// Shares that the scales have before anything is known, worth this many samples.
const PRIOR_SHARES: [f64; 3] = [0.98, 0.01, 0.01];
const PRIOR_SAMPLES: f64 = 10.0;

/// Beyond this nobody can tell noise from motion.
const MOST_CORRELATION: f64 = 0.95;

/// Noise this far below what was stated is none.
const SMALLEST_SCALE: f64 = 1e-4;

/// The median of a chi-square variable of three degrees of freedom.
const CHI_SQUARE_3_MEDIAN: f64 = 2.365_973_884_375_338;

/// The noise of one series: positions or velocities of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Standard deviation over the one that was stated.
    pub scale: f64,
    /// Correlation of successive residuals; 0 of white noise.
    pub correlation: f64,
    /// Shares of the mixture's scales.
    pub(super) shares: [f64; 3],
}

impl Default for Level {
    fn default() -> Self {
        Self { scale: 1.0, correlation: 0.0, shares: PRIOR_SHARES }
    }
}

impl Level {
    /// What 1/sigma^2 is multiplied by for a sample of this robust weight: noise that repeats itself tells less.
    pub(super) fn precision(&self) -> f64 {
        let rho = self.correlation;
        (1.0 - rho) / (1.0 + rho) / (self.scale * self.scale)
    }

    /// First weights, of a fit that may be far off: those that minimise absolute values, the scale from the median.
    pub(super) fn first_weights(&mut self, residuals: &Residuals, weights: &mut [f64]) {
        let precision = self.precision();
        let squares: Vec<f64> = weights
            .iter()
            .enumerate()
            .map(|(i, weight)| residuals.predicted_square(i, *weight, precision))
            .collect();
        let Some(median) = robust::median(&mut squares.clone()) else { return };
        self.scale = (median / CHI_SQUARE_3_MEDIAN).sqrt().max(SMALLEST_SCALE);
        for (weight, q) in weights.iter_mut().zip(squares) {
            *weight = (3.0 * self.scale * self.scale / q.max(f64::MIN_POSITIVE)).sqrt().min(1.0);
        }
    }

    /// One step of (1) and (2); `weights` are the robust ones.
    pub(super) fn step(&mut self, residuals: &Residuals, weights: &mut [f64], robust: bool) {
        let n = weights.len() as f64;
        if weights.is_empty() {
            return;
        }
        let (variance, precision) = (self.scale * self.scale, self.precision());
        if robust {
            let mut counts = PRIOR_SHARES.map(|share| share * PRIOR_SAMPLES);
            for (i, weight) in weights.iter_mut().enumerate() {
                let q = residuals.predicted_square(i, *weight, precision);
                let gamma = responsibilities(self.shares, q / variance);
                let scales = scales(q / variance);
                *weight = (0..3).map(|k| gamma[k] / (scales[k] * scales[k])).sum(); // (1)
                (0..3).for_each(|k| counts[k] += gamma[k]);
            }
            self.shares = counts.map(|c| c / (n + PRIOR_SAMPLES));
        }
        let leverages = residuals.leverage.iter().map(|l| l.iter().sum::<f64>());
        let freedom: f64 = weights.iter().zip(leverages).map(|(w, l)| w * l * precision).sum();
        let sum: f64 = weights.iter().zip(residuals.squares()).map(|(w, q)| w * q).sum();
        // one sample's worth of the stated sigma, so that two samples don't claim to be exact
        let left = (3.0 * n - freedom).max(0.3 * n);
        self.scale = ((sum + 1.0) / (left + 1.0)).sqrt().max(SMALLEST_SCALE); // (2)
    }

    /// The correlation of successive residuals, the fit's own share taken out and shrunk where it is no more than
    /// chance.
    pub(super) fn correlate(&mut self, residuals: &Residuals, weights: &[f64]) {
        let (mut products, mut squares, mut pairs) = (0.0, 0.0, 0.0);
        for i in 1..weights.len() {
            let both = (weights[i] * weights[i - 1]).sqrt();
            for axis in 0..3 {
                let (a, b) = (residuals.scaled[i - 1][axis], residuals.scaled[i][axis]);
                products += both * a * b;
                squares += 0.5 * both * (a * a + b * b);
            }
            // a fit leaves neighbours with minus its variance in common
            let shared: f64 =
                (0..3).map(|a| both * residuals.leverage[i][a].midpoint(residuals.leverage[i - 1][a])).sum();
            products += shared;
            squares += shared;
            pairs += 3.0 * both;
        }
        let found = if squares > 0.0 { (products / squares).clamp(0.0, MOST_CORRELATION) } else { 0.0 };
        let chance = 1.0 / f64::max(pairs, 1.0);
        self.correlation = found * found * found / (found * found + chance);
    }
}

fn responsibilities(shares: [f64; 3], q: f64) -> [f64; 3] {
    let scales = scales(q);
    let logs: [f64; 3] = std::array::from_fn(|k| {
        let s = scales[k];
        shares[k].ln() - 3.0 * s.ln() - 0.5 * q / (s * s)
    });
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let parts = logs.map(|l| (l - largest).exp());
    let sum: f64 = parts.iter().sum();
    parts.map(|p| p / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_was_given_no_weight_is_judged_by_the_track_without_it() {
        // one number, known to a variance of 4 before, and a sample of it that is 3 off and has next to no weight
        for weight in [1.0, 0.1, 1e-4] {
            let share = 4.0 / (4.0 + 1.0 / weight);
            let residuals = Residuals {
                scaled: vec![[3.0 * (1.0 - share); 3]],
                leverage: vec![[4.0 * (1.0 - share); 3]],
            };
            let found = residuals.predicted_square(0, weight, 1.0);
            assert!((found - 3.0 * 9.0 / 5.0).abs() < 1e-9, "{weight}: {found}");
        }
    }

    #[test]
    fn a_tenth_of_samples_that_are_off_by_a_million_does_not_change_the_noise() {
        let scaled = |i: usize| if i.is_multiple_of(10) { [1e6; 3] } else { [[1.0; 3], [-1.0; 3]][i % 2] };
        let residuals = Residuals { scaled: (0..200).map(scaled).collect(), leverage: vec![[0.0; 3]; 200] };
        let (mut level, mut weights) = (Level::default(), vec![1.0; 200]);
        level.first_weights(&residuals, &mut weights);
        for _ in 0..20 {
            level.step(&residuals, &mut weights, true);
        }
        assert!((level.scale - 1.0).abs() < 0.05, "{level:?}");
        assert!(weights.iter().step_by(10).all(|w| *w < 1e-9), "{weights:?}");
    }
}
