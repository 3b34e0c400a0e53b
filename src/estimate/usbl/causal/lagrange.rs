//! Alignment to the cycle: second-order Lagrange interpolation through three successive exchanges.

/// The quadratic through three points of different times, at `time_s` (Liu 2023, eq. 1).
#[must_use]
pub fn quadratic(points: &[(f64, [f64; 3]); 3], time_s: f64) -> [f64; 3] {
    let weight = |k: usize| {
        let others = (0..3).filter(|&j| j != k);
        others.map(|j| (time_s - points[j].0) / (points[k].0 - points[j].0)).product::<f64>()
    };
    let weights = [0, 1, 2].map(weight);
    std::array::from_fn(|axis| (0..3).map(|k| weights[k] * points[k].1[axis]).sum()) // (1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratics_are_reproduced_at_irregular_times() {
        let at = |t: f64| [2.0 - 0.3 * t + 0.01 * t * t, -500.0 - 0.7 * t, 3e-3 * t * t];
        let points = [3.0, 21.7, 60.2].map(|t| (t, at(t)));
        for t in [-10.0, 3.0, 40.0, 60.2, 75.0] {
            for (found, expected) in quadratic(&points, t).iter().zip(at(t)) {
                assert!(
                    (found - expected).abs() < 1e-10 * expected.abs().max(1.0),
                    "{t}: {found} {expected}"
                );
            }
        }
    }
}
