//! The weight of the jerk penalty in time: a climb is calm for long and sharp where it turns, and one weight for all
//! of it rounds the turns off and lets noise into the calm.
//!
//! The penalty of axis a is lambda_a sum_k w_k j_k^2, j the third differences of its coefficients. With the same w
//! over a window, the restricted likelihood is greatest where w lambda j^2, summed, is the number of differences
//! that the data determine, sum (1 - w lambda var j) (Wood, Fasiolo 2017, Biometrics 73, 4: the generalised
//! Fellner-Schall step). One w for the three axes: a turn bends them at once, and shows in three times as many
//! differences.

use super::bordered::Posterior;
use super::knots::{JERK, Knots};

/// Half the window, s: a thrust sets in within 0.3 s, which both halves together hold; a wider one rounds it off, a
/// narrower one takes its weight from next to nothing.
const HALF_WINDOW_S: f64 = 0.4;

/// As many differences are put to each window that are as large as lambda has them, one knot's three axes: they hold
/// the weight at 1 where the data say nothing, as in a gap, and keep it from running away where there is no jerk.
const PSEUDO_COUNT: f64 = 3.0;

/// The next weights, one a third difference by its first function, from those of which `posterior` comes: the step's
/// geometric mean with the last, as lambda moves at the same time.
pub(super) fn jerk_weights(knots: &Knots, posterior: &Posterior, lambda: [f64; 3], last: &[f64]) -> Vec<f64> {
    let mut weights = last.to_vec();
    for (rows, spacing_s) in knots.differences() {
        // up to each row: the sum of lambda j^2, and how many differences the data determine
        let mut sums = vec![[0.0; 2]];
        let mut sum = [0.0; 2];
        for row in rows.clone() {
            for (axis, lambda) in lambda.iter().enumerate() {
                let jerk: f64 = (0..4).map(|i| JERK[i] * posterior.coefficients[row + i][axis]).sum();
                let variance = posterior.variance(axis, row, &JERK, 1.0, None);
                sum[0] += lambda * jerk * jerk;
                sum[1] += (1.0 - last[row] * lambda * variance).clamp(0.0, 1.0);
            }
            sums.push(sum);
        }
        let half = (HALF_WINDOW_S / spacing_s).ceil() as usize;
        for (i, row) in rows.clone().enumerate() {
            let (from, to) = (sums[i.saturating_sub(half)], sums[(i + half + 1).min(rows.len())]);
            let [squares, count] = [0, 1].map(|j| to[j] - from[j] + PSEUDO_COUNT);
            weights[row] = (last[row] * count / squares).sqrt();
        }
    }
    weights
}
