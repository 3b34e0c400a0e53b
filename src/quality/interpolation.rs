//! Which of two series is interpolated to the other's instants, and what that costs.

use schemars::JsonSchema;
use serde::Serialize;

use crate::sample::Sample;

/// What was interpolated, linearly, to the instants of the other.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Interpolated {
    /// `reference`, or `estimate` where the reference has fewer instants.
    pub series: String,
    /// Root mean square 3-D error that the interpolation makes, from the series' second differences, m or m/s.
    /// Noise of the series is in it, so it is rather too large; null where it has too few samples to tell.
    pub error: Option<f64>,
}

/// A straight line between samples h apart is off by h^2 a / 8 in the middle, by sqrt(8/15) of that in the mean
/// square; each sample is off by h^2 a / 2 from the line between its neighbours.
const OF_SECOND_DIFFERENCE: f64 = 0.25 * 0.730_296_743_340_221_5;

/// Root mean square error of linear interpolation within `[from_s, to_s]`, from how far samples lie from the
/// line between their neighbours; samples beside a gap longer than `max_gap_s` don't count.
pub(super) fn linear_error(series: &[Sample], from_s: f64, to_s: f64, max_gap_s: f64) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0_usize);
    for three in series.windows(3) {
        let [a, b, c] = [&three[0], &three[1], &three[2]];
        let (before, after) = (b.time_s - a.time_s, c.time_s - b.time_s);
        let inside = (from_s..=to_s).contains(&b.time_s);
        if !inside || before <= 0.0 || after <= 0.0 || before.max(after) > max_gap_s {
            continue;
        }
        let share = before / (before + after);
        squares += (0..3)
            .map(|i| b.value[i] - (a.value[i] + share * (c.value[i] - a.value[i])))
            .map(|e| e * e)
            .sum::<f64>();
        count += 1;
    }
    (count > 0).then(|| OF_SECOND_DIFFERENCE * (squares / count as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stated_error_is_that_of_a_parabola_and_of_a_sine() {
        let series = |f: &dyn Fn(f64) -> f64| -> Vec<Sample> {
            let sample = |t: f64| Sample { time_s: t, value: [f(t), 0.0, 0.0], sigma: [1.0; 3] };
            (0..=100).map(|i| sample(0.1 * f64::from(i))).collect()
        };
        let functions: [&dyn Fn(f64) -> f64; 2] = [&|t| 3.0 * t * t, &|t| (2.0 * t).sin()];
        for f in functions {
            let series = series(f);
            let stated = linear_error(&series, 0.0, 10.0, 1.0).expect("many samples");
            let errors = (0..10_000).map(|i| {
                let t = 1e-3 * f64::from(i);
                let (i, share) = ((t / 0.1) as usize, t / 0.1 - (t / 0.1).floor());
                series[i].value[0] + share * (series[i + 1].value[0] - series[i].value[0]) - f(t)
            });
            let true_error = (errors.map(|e| e * e).sum::<f64>() / 10_000.0).sqrt();
            assert!((stated / true_error - 1.0).abs() < 0.03, "{stated} {true_error}");
        }
    }
}
