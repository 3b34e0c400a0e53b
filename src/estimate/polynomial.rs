//! PCF, polynomial constraint fusion: one polynomial an axis, its derivative the velocity.
//!
//! Zhang 2025, eq. 3-6: with order m, coefficients C by least squares on stacked positions and velocities,
//!
//! ```text
//! [ t^m ... t 1 ; m t^(m-1) ... 1 0 ] C = [ Z ; Zdot ]                                  (4)-(5)
//! ```
//!
//! Where we depart from the print, and why:
//! - Not in powers of raw time (condition 5e27 at m = 12, so most of the oscillation that the paper shows
//!   at m = 48 is rounding), but in Chebyshev polynomials of time scaled to [-1, 1] (condition 3); solved
//!   by QR, not by the normal equations of eq. 6.
//! - Rows are weighted by 1/sigma, and every sample keeps its own time. The paper fits the samples after
//!   GDF; where two sources sample at the same instants the weighted rows amount to that.
//! - [`Prior`]: the constraint that makes it extrapolate, small derivatives from the third on.

use nalgebra::DVector;

use super::{EstimateError, check};
use crate::estimate::Coefficients;
use crate::math::chebyshev;
use crate::math::least_squares::{LeastSquares, Solution};
use crate::sample::{Quantity, Source};
use crate::track::{Curve, State};

/// Highest order: the paper's own highest.
pub const MAX_ORDER: usize = 48;

/// At the end of the interval the acceleration dies away as exp(-t / tau), or stays: each derivative from the third
/// on is that of this decay, within a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Standard deviation of the derivatives of order 3 and up, m/s^3, m/s^4, ...
    pub sigma: f64,
    /// tau, s; `None` for an acceleration that stays.
    pub decay_s: Option<f64>,
}

/// A fitted polynomial.
#[derive(Clone, Debug)]
pub struct Polynomial {
    order: usize,
    middle_s: f64,
    half_s: f64,
    centre: [f64; 3],
    /// By axis: the solution for positions and the one for velocities, the same where they share.
    position: [Axis; 3],
    velocity: [Axis; 3],
}

#[derive(Clone, Debug)]
struct Axis {
    coefficients: DVector<f64>,
    /// Columns that the solution leaves out: 1 where a velocity's fit has no constant.
    skipped: usize,
    solution: Solution,
    noise_scale: f64,
}

/// The Chebyshev polynomials at one instant, as functions of time in s.
struct Row {
    value: Vec<f64>,
    slope: Vec<f64>,
    curvature: Vec<f64>,
}

/// Fits a polynomial of `order` to all samples of `sources` within `[from_s, to_s]`.
///
/// # Errors
/// [`EstimateError::BadNumber`] as [`check`]; [`EstimateError::TooFewSamples`] where there are not more rows
/// than unknowns,
/// [`EstimateError::Undetermined`] where they lie at too few instants or hold no position.
///
/// # Panics
/// When `order` is 0 or above [`MAX_ORDER`].
pub fn fit(
    sources: &[Source],
    from_s: f64,
    to_s: f64,
    order: usize,
    coefficients: Coefficients,
    prior: Option<Prior>,
) -> Result<Polynomial, EstimateError> {
    assert!((1..=MAX_ORDER).contains(&order));
    let sources: Vec<Source> = sources.iter().map(|s| s.within(from_s, to_s)).collect();
    check(&sources)?;
    let polynomial =
        Scale { order, middle_s: from_s.midpoint(to_s), half_s: (0.5 * (to_s - from_s)).max(1e-9) };
    let first = sources.iter().flat_map(|s| &s.positions).next();
    let centre = first.map(|p| p.value).ok_or_else(|| undetermined(order, "there is no position"))?;
    let solve =
        |quantities: &[Quantity], axis| polynomial.solve(&sources, quantities, axis, centre[axis], prior);
    let (position, velocity) = match coefficients {
        Coefficients::Shared => {
            let shared = all_axes(|axis| solve(&Quantity::ALL, axis))?;
            (shared.clone(), shared)
        }
        Coefficients::Independent => (
            all_axes(|axis| solve(&[Quantity::Position], axis))?,
            all_axes(|axis| solve(&[Quantity::Velocity], axis))?,
        ),
    };
    let Scale { order, middle_s, half_s } = polynomial;
    Ok(Polynomial { order, middle_s, half_s, centre, position, velocity })
}

fn all_axes(mut f: impl FnMut(usize) -> Result<Axis, EstimateError>) -> Result<[Axis; 3], EstimateError> {
    Ok([f(0)?, f(1)?, f(2)?])
}

fn undetermined(order: usize, why: &'static str) -> EstimateError {
    EstimateError::Undetermined { what: format!("pcf of order {order}"), why }
}

/// Order, and the time that is -1..1.
#[derive(Clone, Copy)]
struct Scale {
    order: usize,
    middle_s: f64,
    half_s: f64,
}

impl Scale {
    fn row(self, time_s: f64) -> Row {
        let n = self.order + 1;
        let mut row = Row { value: vec![0.0; n], slope: vec![0.0; n], curvature: vec![0.0; n] };
        let x = (time_s - self.middle_s) / self.half_s;
        chebyshev::evaluate(x, &mut row.value, &mut row.slope, &mut row.curvature);
        row.slope.iter_mut().for_each(|v| *v /= self.half_s);
        row.curvature.iter_mut().for_each(|v| *v /= self.half_s.powi(2));
        row
    }

    fn solve(
        self,
        sources: &[Source],
        quantities: &[Quantity],
        axis: usize,
        centre: f64,
        prior: Option<Prior>,
    ) -> Result<Axis, EstimateError> {
        // velocities alone say nothing of the constant
        let skipped = usize::from(!quantities.contains(&Quantity::Position));
        let unknowns = self.order + 1 - skipped;
        let mut problem = LeastSquares::new(unknowns);
        let mut data = 0;
        for &quantity in quantities {
            for sample in sources.iter().flat_map(|s| s.series(quantity)) {
                let row = self.row(sample.time_s);
                let (row, value) = match quantity {
                    Quantity::Position => (row.value, sample.value[axis] - centre), // (4)
                    Quantity::Velocity => (row.slope, sample.value[axis]),          // (5)
                };
                let weight = sample.sigma[axis].recip();
                let row: Vec<f64> = row[skipped..].iter().map(|b| weight * b).collect();
                problem.push(&row, weight * value);
                data += 1;
            }
        }
        if let Some(Prior { sigma, decay_s }) = prior {
            let at_end = |n, derivative: i32| end_derivative(n, derivative) / self.half_s.powi(derivative);
            for derivative in 3..=self.order as i32 {
                // the derivative of a exp(-t / tau), a the acceleration: a (-1 / tau)^(derivative - 2)
                let share = decay_s.map_or(0.0, |tau| (-1.0 / tau).powi(derivative - 2));
                let row: Vec<f64> = (skipped..=self.order)
                    .map(|n| (at_end(n, derivative) - share * at_end(n, 2)) / sigma)
                    .collect();
                problem.push(&row, 0.0);
            }
        }
        if data <= unknowns {
            let what = format!("pcf of order {}", self.order);
            return Err(EstimateError::TooFewSamples { what, needed: unknowns + 1, got: data });
        }
        let solution =
            problem.solve().ok_or_else(|| undetermined(self.order, "they lie at too few instants"))?;
        let noise_scale = solution.residual_sum / (solution.rows - unknowns) as f64;
        Ok(Axis { coefficients: solution.coefficients.clone(), skipped, solution, noise_scale })
    }
}

/// The derivative of `T_n` of the given order at x = 1: the product of (n^2 - j^2) / (2 j + 1), j below it.
fn end_derivative(n: usize, derivative: i32) -> f64 {
    let n = n as f64;
    (0..derivative).map(f64::from).map(|j| (n * n - j * j) / (2.0 * j + 1.0)).product()
}

impl Axis {
    fn combine(&self, row: &[f64]) -> f64 {
        row[self.skipped..].iter().zip(&self.coefficients).map(|(b, c)| b * c).sum()
    }

    fn sigma(&self, row: &[f64]) -> f64 {
        // as SFF: scaled up where the sigmas are too small, never down
        (self.noise_scale.max(1.0) * self.solution.variance_of(&row[self.skipped..])).sqrt()
    }
}

impl Curve for Polynomial {
    /// The state at any time, also outside the interval of the fit: this is how PCF extrapolates.
    fn at(&self, time_s: f64) -> Option<State> {
        let scale = Scale { order: self.order, middle_s: self.middle_s, half_s: self.half_s };
        let row = scale.row(time_s);
        let axes = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        Some(State {
            position: axes(&|a| self.centre[a] + self.position[a].combine(&row.value)),
            velocity: axes(&|a| self.velocity[a].combine(&row.slope)),
            acceleration: Some(axes(&|a| self.velocity[a].combine(&row.curvature))),
            position_sigma: axes(&|a| self.position[a].sigma(&row.value)),
            velocity_sigma: axes(&|a| self.velocity[a].sigma(&row.slope)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Sample;

    /// z = 3 - 2 t + 0.5 t^2 - 0.1 t^3, noise-free, with its velocity.
    fn cubic() -> Source {
        let at = |time_s: f64, v: f64| Sample { time_s, value: [v, -v, 2.0 * v], sigma: [0.1; 3] };
        let times = || (0..40).map(|i| 100.0 + 0.05 * f64::from(i) + 0.01 * f64::from(i % 3));
        let z = |t: f64| 3.0 - 2.0 * t + 0.5 * t * t - 0.1 * t.powi(3);
        let v = |t: f64| -2.0 + t - 0.3 * t * t;
        Source {
            name: "cubic".into(),
            positions: times().map(|t| at(t, z(t - 100.0))).collect(),
            velocities: times().map(|t| at(t, v(t - 100.0))).collect(),
        }
    }

    #[test]
    fn a_cubic_is_found_exactly_and_carried_on_by_both_readings() {
        for coefficients in [Coefficients::Shared, Coefficients::Independent] {
            let fitted = fit(&[cubic()], 100.0, 102.0, 5, coefficients, None).expect("a good problem");
            for t in [0.0_f64, 1.0, 1.9, 4.0] {
                let state = fitted.at(100.0 + t).expect("everywhere");
                assert!(
                    (state.position[2] - 2.0 * (3.0 - 2.0 * t + 0.5 * t * t - 0.1 * t.powi(3))).abs() < 1e-8
                );
                assert!((state.velocity[0] - (-2.0 + t - 0.3 * t * t)).abs() < 1e-8);
                assert!(
                    (state.acceleration.expect("a polynomial has one")[1] - (-1.0 + 0.6 * t)).abs() < 1e-7
                );
            }
        }
    }

    const FLAT: Prior = Prior { sigma: 1e-9, decay_s: None };

    #[test]
    fn an_acceleration_dies_away_as_the_prior_says() {
        let dying = Prior { sigma: 1e-9, decay_s: Some(2.0) };
        let fitted =
            fit(&[cubic()], 100.0, 102.0, 4, Coefficients::Shared, Some(dying)).expect("a good problem");
        let acceleration = |t| fitted.at(t).and_then(|s| s.acceleration).expect("a polynomial has one")[0];
        let jerk = (acceleration(102.0 + 1e-4) - acceleration(102.0 - 1e-4)) / 2e-4;
        assert!((jerk / acceleration(102.0) + 0.5).abs() < 1e-4, "{jerk}");
    }

    #[test]
    fn a_tight_prior_leaves_a_parabola() {
        let fitted = fit(&[cubic()], 100.0, 102.0, 4, Coefficients::Shared, Some(FLAT));
        let fitted = fitted.expect("a good problem");
        let acceleration = |t| fitted.at(t).and_then(|s| s.acceleration).expect("a polynomial has one")[0];
        assert!((acceleration(100.0) - acceleration(104.0)).abs() < 1e-6);
    }

    #[test]
    fn order_48_stays_finite_and_close() {
        let fitted =
            fit(&[cubic()], 100.0, 102.0, 48, Coefficients::Shared, None).expect("80 rows, 49 unknowns");
        let state = fitted.at(101.0).expect("everywhere");
        assert!((state.position[0] - 1.4).abs() < 1e-6, "{}", state.position[0]);
    }

    #[test]
    fn too_few_samples_and_too_few_instants_are_told_apart() {
        let mut few = cubic();
        few.positions.truncate(2);
        few.velocities.truncate(2);
        let error = fit(&[few], 100.0, 102.0, 4, Coefficients::Shared, None).expect_err("4 rows");
        assert_eq!(error, EstimateError::TooFewSamples { what: "pcf of order 4".into(), needed: 6, got: 4 });
        let mut still = cubic();
        still.positions.iter_mut().for_each(|s| s.time_s = 100.5);
        still.velocities.clear();
        let error = fit(&[still], 100.0, 102.0, 4, Coefficients::Shared, None).expect_err("one instant");
        assert!(matches!(error, EstimateError::Undetermined { .. }), "{error}");
    }
}
