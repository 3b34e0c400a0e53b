//! The moving average over the weighted mean: the paper's third rival (Zhang 2025, Table 1).
//!
//! The mean of the points around each point, as many before as after it: a straight line stays what it is, at
//! the ends too. An even window therefore has one point less, and towards the ends of a stretch the window
//! shrinks to what fits on both sides. The paper doesn't say how it treats either; with windows that are cut off
//! on one side its Table 1 can't be remade, with these (those of MATLAB's `smooth`, whose default is the paper's
//! 5) it can. The band is the weighted mean's own: averaging lowers the noise, but flattens bends, which the
//! band knows nothing of.

use super::EstimateError;
use crate::track::{Curve, State};

/// Averages of a curve's points, joined by straight lines.
#[derive(Clone, Debug)]
pub struct MovingAverage {
    points: Vec<(f64, State)>,
    max_gap_s: f64,
}

impl MovingAverage {
    /// Averages `curve` over `window` points around each of the ordered `times_s`, where it has a value;
    /// gaps longer than `max_gap_s` are neither averaged over nor bridged.
    ///
    /// # Errors
    /// [`EstimateError::TooFewSamples`] when the curve has no value at any of the times, or the window is 0.
    pub fn of(
        curve: &impl Curve,
        times_s: impl Iterator<Item = f64>,
        window: usize,
        max_gap_s: f64,
    ) -> Result<Self, EstimateError> {
        let raw: Vec<(f64, State)> = times_s.filter_map(|t| Some((t, curve.at(t)?))).collect();
        if raw.is_empty() || window == 0 {
            return Err(EstimateError::TooFewSamples {
                what: "moving-average".into(),
                needed: window.max(1),
                got: raw.len(),
            });
        }
        let mut points = Vec::with_capacity(raw.len());
        for stretch in raw.chunk_by(|a, b| b.0 - a.0 <= max_gap_s) {
            let sums = running_sums(stretch);
            for (i, &(time, mut state)) in stretch.iter().enumerate() {
                let each_side = ((window - 1) / 2).min(i).min(stretch.len() - 1 - i);
                let (from, to) = (i - each_side, i + each_side + 1);
                let count = (to - from) as f64;
                for axis in 0..3 {
                    state.position[axis] = (sums[to].0[axis] - sums[from].0[axis]) / count;
                    state.velocity[axis] = (sums[to].1[axis] - sums[from].1[axis]) / count;
                }
                points.push((time, state));
            }
        }
        Ok(Self { points, max_gap_s })
    }
}

/// Sums of positions and velocities of the points before each.
fn running_sums(points: &[(f64, State)]) -> Vec<([f64; 3], [f64; 3])> {
    let mut sums = vec![([0.0; 3], [0.0; 3])];
    for (i, (_, state)) in points.iter().enumerate() {
        let (mut p, mut v) = sums[i];
        for axis in 0..3 {
            p[axis] += state.position[axis];
            v[axis] += state.velocity[axis];
        }
        sums.push((p, v));
    }
    sums
}

impl Curve for MovingAverage {
    fn at(&self, time_s: f64) -> Option<State> {
        let next = self.points.partition_point(|p| p.0 < time_s);
        let (after_s, after) = self.points.get(next)?;
        if *after_s <= time_s {
            return Some(*after);
        }
        let (before_s, before) = self.points.get(next.checked_sub(1)?)?;
        let gap = after_s - before_s;
        let share = (time_s - before_s) / gap;
        (gap <= self.max_gap_s).then(|| before.mixed(after, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// z = t^2 with velocity 2 t.
    struct Parabola;
    impl Curve for Parabola {
        fn at(&self, t: f64) -> Option<State> {
            let state =
                State { position: [0.0, 0.0, t * t], velocity: [0.0, 0.0, 2.0 * t], ..State::default() };
            (t >= 0.0).then_some(state)
        }
    }

    #[test]
    fn five_points_of_a_parabola_average_to_the_parabola_and_twice_the_step_squared() {
        let times = (0..=20).map(|i| 0.5 * f64::from(i));
        let average = MovingAverage::of(&Parabola, times, 5, 1.0).expect("points");
        let state = average.at(4.0).expect("inside");
        assert!((state.position[2] - 16.5).abs() < 1e-12); // 16 + 2 * 0.25
        assert!((state.velocity[2] - 8.0).abs() < 1e-12);
    }

    #[test]
    fn windows_shrink_towards_the_ends_and_an_even_one_has_a_point_less() {
        let average = |window| {
            let times = (0..=20).map(|i| 0.5 * f64::from(i));
            MovingAverage::of(&Parabola, times, window, 1.0).expect("points")
        };
        let z = |window, t| average(window).at(t).expect("inside").position[2];
        assert_eq!(z(5, 0.0), 0.0);
        assert!((z(5, 0.5) - (0.0 + 0.25 + 1.0) / 3.0).abs() < 1e-12);
        assert_eq!(z(5, 10.0), 100.0);
        for t in [0.0, 0.5, 4.0, 9.5, 10.0] {
            assert_eq!(z(6, t), z(5, t));
            assert!((average(16).at(t).expect("inside").velocity[2] - 2.0 * t).abs() < 1e-12); // a straight line
        }
    }

    #[test]
    fn a_window_of_one_is_the_curve_itself_and_a_gap_is_not_bridged() {
        let times = (0..=20).map(f64::from).filter(|t| !(5.0..9.0).contains(t));
        let average = MovingAverage::of(&Parabola, times, 1, 2.0).expect("points");
        assert_eq!(average.at(3.0).map(|s| s.position[2]), Some(9.0));
        assert_eq!(average.at(6.0), None);
        assert!(MovingAverage::of(&Parabola, [-1.0].into_iter(), 5, 1.0).is_err());
    }
}
