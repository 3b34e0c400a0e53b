//! Recursive least squares on quadratics, `x(t) = a t^2 + b t + c` an axis (Liu 2023, eq. 3).
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | H | `[t^2 t 1]` | 1 x 3 | s^2, s, 1 |
//! | X | a, b, c of the three axes | 3 x 3 | m/s^2, m/s, m |
//! | P | covariance of a, b, c for noise of variance 1 | 3 x 3 | |
//! | W | weight of a point | 1 | - |

use nalgebra::{Matrix3, RowVector3, Vector3};

/// The recursion's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rls {
    /// Columns: axes.
    x: Matrix3<f64>,
    p: Matrix3<f64>,
    /// The instant that t counts from, s.
    origin_s: f64,
}

fn row(t: f64) -> RowVector3<f64> {
    RowVector3::new(t * t, t, 1.0)
}

impl Rls {
    /// Starts from the quadratic through three points, t counting from `origin_s`.
    ///
    /// P is what the three points tell, (H'H)^-1, with which the recursion is batch least squares; the paper's is
    /// `large` times the identity instead. `None` where two of the times are equal.
    #[must_use]
    pub fn start(points: &[(f64, [f64; 3]); 3], origin_s: f64, large: Option<f64>) -> Option<Self> {
        let h = Matrix3::from_rows(&points.map(|(t, _)| row(t - origin_s)));
        let inverse = h.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
        let z = Matrix3::from_rows(&points.map(|(_, z)| RowVector3::from(z)));
        let p = large.map_or(inverse * inverse.transpose(), |l| Matrix3::identity() * l);
        Some(Self { x: inverse * z, p, origin_s })
    }

    /// Takes a point in, weight `w`, older ones forgotten by the factor `keep` (1: none).
    pub fn update(&mut self, time_s: f64, z: [f64; 3], w: f64, keep: f64) {
        self.p /= keep;
        self.take(row(time_s - self.origin_s), RowVector3::from(z), w);
    }

    fn take(&mut self, h: RowVector3<f64>, z: RowVector3<f64>, w: f64) {
        let ph: Vector3<f64> = self.p * h.transpose();
        self.p -= ph * ph.transpose() / (w.recip() + (h * ph)[0]); // (3)
        self.p = (self.p + self.p.transpose()) * 0.5;
        let gain = self.p * h.transpose() * w;
        self.x += gain * (z - h * self.x); // (3)
    }

    /// Lets t count from another instant: the same quadratics, and digits that last.
    pub fn count_from(&mut self, origin_s: f64) {
        let d = origin_s - self.origin_s;
        let turn = Matrix3::new(1.0, 0.0, 0.0, 2.0 * d, 1.0, 0.0, d * d, d, 1.0);
        self.x = turn * self.x;
        self.p = turn * self.p * turn.transpose();
        self.origin_s = origin_s;
    }

    /// The instant that t counts from, s.
    #[must_use]
    pub fn origin_s(&self) -> f64 {
        self.origin_s
    }

    /// Position, m, and velocity, m/s, at an instant.
    #[must_use]
    pub fn at(&self, time_s: f64) -> ([f64; 3], [f64; 3]) {
        let t = time_s - self.origin_s;
        let (position, velocity) = (row(t) * self.x, RowVector3::new(2.0 * t, 1.0, 0.0) * self.x);
        (position.transpose().into(), velocity.transpose().into())
    }

    /// Variances of position and velocity at an instant for noise of variance 1.
    #[must_use]
    pub fn variance(&self, time_s: f64) -> [f64; 2] {
        let t = time_s - self.origin_s;
        let form = |h: RowVector3<f64>| (h * self.p * h.transpose())[0].max(0.0);
        [form(row(t)), form(RowVector3::new(2.0 * t, 1.0, 0.0))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::least_squares::LeastSquares;

    /// Points on a wavy track, at irregular times.
    fn points() -> Vec<(f64, [f64; 3])> {
        (0..40)
            .map(|i| {
                let t = 20.0 * f64::from(i) + 3.0 * f64::from(i * i % 7);
                (t, [(0.01 * t).sin() * 90.0, 0.5 * t + (f64::from(i) * 2.4).cos(), -0.7 * t])
            })
            .collect()
    }

    #[test]
    fn the_recursion_equals_batch_least_squares_from_the_same_start() {
        let points = points();
        let origin_s = points[20].0;
        let first = points.first_chunk().expect("three");
        let mut rls = Rls::start(first, origin_s, None).expect("different times");
        for &(t, z) in &points[3..] {
            rls.update(t, z, 1.0, 1.0);
        }
        for axis in 0..3 {
            let mut batch = LeastSquares::new(3);
            for (t, z) in &points {
                let t = t - origin_s;
                batch.push(&[t * t, t, 1.0], z[axis]);
            }
            let batch = batch.solve().expect("determined");
            for (found, expected) in rls.x.column(axis).iter().zip(batch.coefficients.iter()) {
                assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found} {expected}");
            }
            let variance = batch.variance_of(&[100.0, 10.0, 1.0]);
            assert!((rls.variance(origin_s + 10.0)[0] / variance - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_papers_start_equals_batch_least_squares_with_its_prior() {
        let large = 1e6_f64;
        // a dive of an hour, t counting from its begin as in the paper
        let points: Vec<_> = (0..180)
            .map(|i| 20.0 * f64::from(i))
            .map(|t| (t, [(0.002 * t).sin() * 90.0, 0.5 * t + (0.12 * t).cos(), -0.7 * t]))
            .collect();
        let first = points.first_chunk().expect("three");
        let mut rls = Rls::start(first, 0.0, Some(large)).expect("different times");
        let start = rls.x;
        for &(t, z) in &points[3..] {
            rls.update(t, z, 1.0, 1.0);
        }
        for axis in 0..3 {
            let mut batch = LeastSquares::new(3);
            let weight = large.sqrt().recip();
            for k in 0..3 {
                let mut prior = [0.0; 3];
                prior[k] = weight;
                batch.push(&prior, weight * start[(k, axis)]);
            }
            for (t, z) in &points[3..] {
                batch.push(&[t * t, *t, 1.0], z[axis]);
            }
            let batch = batch.solve().expect("determined");
            for t in [3600.0, 3780.0_f64] {
                let h = [t * t, t, 1.0];
                let expected: f64 = (0..3).map(|k| h[k] * batch.coefficients[k]).sum();
                let found = rls.at(t).0[axis];
                // millimetres are what the digits of a prior so large leave
                assert!((found - expected).abs() < 2e-3, "{axis} {t}: {found} {expected}");
                let variance = batch.variance_of(&h);
                assert!(
                    (rls.variance(t)[0] / variance - 1.0).abs() < 1e-2,
                    "{axis} {t}: {:?} {variance}",
                    rls.variance(t)
                );
            }
        }
    }

    #[test]
    fn another_origin_of_time_changes_nothing_but_digits() {
        let points = points();
        let mut rls = Rls::start(points.first_chunk().expect("three"), 0.0, None).expect("different times");
        rls.update(points[3].0, points[3].1, 1.0, 0.8);
        let mut moved = rls;
        moved.count_from(70.0);
        let (here, there) = (rls.at(120.0), moved.at(120.0));
        for axis in 0..3 {
            assert!(
                (here.0[axis] - there.0[axis]).abs() < 1e-9 && (here.1[axis] - there.1[axis]).abs() < 1e-10
            );
        }
        assert!((rls.variance(120.0)[0] / moved.variance(120.0)[0] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn forgetting_follows_a_turn_that_no_one_quadratic_does() {
        let track = |t: f64| if t < 400.0 { [t, 0.0, 0.0] } else { [400.0, t - 400.0, 0.0] };
        let points: Vec<_> = (0..40).map(|i| 20.0 * f64::from(i)).map(|t| (t, track(t))).collect();
        let error = |keep: f64| {
            let mut rls = Rls::start(points.first_chunk().expect("three"), 0.0, None).expect("a start");
            points[3..].iter().for_each(|&(t, z)| rls.update(t, z, 1.0, keep));
            (rls.at(780.0).0[1] - 380.0).abs()
        };
        assert!(error(0.7) < 1.0 && error(1.0) > 5.0, "{} {}", error(0.7), error(1.0));
    }

    #[test]
    fn points_at_one_time_start_nothing() {
        assert!(Rls::start(&[(1.0, [0.0; 3]), (1.0, [1.0; 3]), (2.0, [0.0; 3])], 0.0, None).is_none());
    }
}
