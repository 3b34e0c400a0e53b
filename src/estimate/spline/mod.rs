//! SFF, spline function fusion: Gaussian splines fitted to positions and velocities of all sources at once.
//!
//! Zhang 2025, eq. 7-11. For each axis, with `B_k` the probability spline on M equally spaced knots,
//!
//! ```text
//! z(t) = sum_k p_k B_k(t),    zdot(t) = sum_k q_k B_k'(t)                            (7)-(8)
//! minimise  sum_i w_i (z(t_i) - Z_i)^2 + sum_j w_j (zdot(t_j) - Zdot_j)^2 + lambda |D3 p|^2
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | p, q | coefficients of position and velocity | M | m |
//! | s | width of a Gaussian, in knot spacings | 1 | - |
//! | h | knot spacing | 1 | s |
//! | w | weights, 1/sigma^2 of each sample | - | 1/m^2, s^2/m^2 |
//! | D3 | third differences: jerk, times h^3 | (M-3) x M | - |
//! | lambda | weight of the jerk penalty | 1 | 1/m^2 |
//!
//! Where we depart from the print, and why:
//! - p = q by default (*shared*): the velocity is the derivative of the position, which is what the
//!   method is for. Eq. 8 taken literally (*independent*) is there to compare with the paper.
//! - The derivative carries the factor 1/h that eq. 8 doesn't show.
//! - The jerk penalty is ours: without it a gap of twelve knots gives errors of 1e6 m. Its weight is
//!   found by restricted maximum likelihood (Patterson and Thompson 1971), the noise's scale with it.
//! - Knots stand beyond both ends of the interval (the print says nothing of the ends).
//! - Rows are weighted by the sensors' own sigmas, and every sample keeps its own time.
//!
//! The normal matrix is banded; its Cholesky factor gives the coefficients and, by the selected inverse,
//! the posterior covariance. Axes whose weights agree share one factor. Unknowns beside the spline
//! (biases, clock offsets) border this matrix, and are eliminated by its Schur complement.

mod normal;

pub use normal::Smoothing;

use normal::{Block, Problem, solve};

use super::{Coefficients, EstimateError, check, coverage};
use crate::math::gaussian_basis::{Active, GaussianBasis};
use crate::math::simd::{Kernel, vectorised};
use crate::sample::{Quantity, Sample, Source};
use crate::track::{Curve, State};

/// What may be chosen about the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Width of a Gaussian in knot spacings. 1: the paper doesn't say; below 0.8 a constant ripples, above
    /// 1.5 the equations degenerate.
    pub width: f64,
    /// Knots beyond each end. 4: the edge error falls below 1e-6 of the signal.
    pub margin: usize,
    /// Knot spacing, s; by default [`default_knot_spacing_s`].
    pub knot_spacing_s: Option<f64>,
    /// The penalty's weight.
    pub smoothing: Smoothing,
    /// Whether position and velocity share coefficients.
    pub coefficients: Coefficients,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1.0,
            margin: 4,
            knot_spacing_s: None,
            smoothing: Smoothing::Likelihood,
            coefficients: Coefficients::Shared,
        }
    }
}

/// No finer by default, s: a vehicle's sharpest moves, a thrust's onset in 0.3 s, are followed at this spacing.
const FINEST_SPACING_S: f64 = 0.08;

/// Fewest sampling instants that a fit takes: a quadratic has three unknowns, its noise needs one more.
pub const MIN_SAMPLES: usize = 4;

/// The fastest source's median interval, but no finer than 0.08 s.
///
/// The number of knots is bounded by that of the samples, or by 20,000 where those are fewer, whatever the
/// times are: samples that come in dense runs need more knots than their mean density has.
#[must_use]
pub fn default_knot_spacing_s(sources: &[Source], from_s: f64, to_s: f64) -> f64 {
    let fastest = sources.iter().filter_map(coverage::median_interval_s).fold(f64::INFINITY, f64::min);
    let wanted = if fastest.is_finite() { fastest.max(FINEST_SPACING_S) } else { FINEST_SPACING_S };
    wanted.max(finest_affordable_s(sources, from_s, to_s))
}

/// The spacing below which there would be more knots than samples, and than 20,000, which cost 20 ms.
#[must_use]
pub fn finest_affordable_s(sources: &[Source], from_s: f64, to_s: f64) -> f64 {
    const CHEAP_KNOTS: usize = 20_000;
    let samples: usize = sources.iter().map(Source::len).sum();
    (to_s - from_s) / samples.max(CHEAP_KNOTS) as f64
}

/// A fitted spline.
#[derive(Clone, Debug)]
pub struct Spline {
    basis: GaussianBasis,
    centre: [f64; 3],
    from_s: f64,
    to_s: f64,
    parts: Vec<Part>,
}

/// The axes whose weights agree, and what was fitted for them.
#[derive(Clone, Debug)]
struct Part {
    axes: &'static [usize],
    position: Block,
    /// `None` where the velocity is the position's derivative.
    velocity: Option<Block>,
}

/// Fits all samples of all sources over `[from_s, to_s]`.
///
/// # Errors
/// [`EstimateError::TooFewSamples`] below four sampling instants, [`EstimateError::BadNumber`] for a value
/// that is not finite or a sigma that is not positive, [`EstimateError::Undetermined`] where even with the
/// penalty the data leave the curve open (no positions, say).
pub fn fit(sources: &[Source], from_s: f64, to_s: f64, settings: &Settings) -> Result<Spline, EstimateError> {
    check(sources)?;
    let positions: usize = sources.iter().map(|s| s.positions.len()).sum();
    let got: usize = sources.iter().map(Source::len).sum();
    if got < MIN_SAMPLES {
        return Err(EstimateError::TooFewSamples { what: "sff".into(), needed: MIN_SAMPLES, got });
    }
    if positions == 0 {
        return Err(EstimateError::Undetermined { what: "sff".into(), why: "there is no position" });
    }
    let spacing = settings.knot_spacing_s.map_or_else(
        || default_knot_spacing_s(sources, from_s, to_s),
        |asked| asked.max(finest_affordable_s(sources, from_s, to_s)),
    );
    let basis = GaussianBasis::covering(from_s, to_s, spacing, settings.margin, settings.width);
    let centre = middle(sources);
    let groups: &[&'static [usize]] = if axes_agree(sources) { &[&[0, 1, 2]] } else { &[&[0], &[1], &[2]] };
    let parts = groups.iter().map(|&axes| {
        let solve = |quantities| {
            let problem = Problem { sources, quantities, weights_of: axes[0], axes, centre };
            solve(&basis, &problem, settings.smoothing)
        };
        Ok(match settings.coefficients {
            Coefficients::Shared => Part { axes, position: solve(&Quantity::ALL)?, velocity: None },
            Coefficients::Independent => Part {
                axes,
                position: solve(&[Quantity::Position])?,
                velocity: Some(solve(&[Quantity::Velocity])?),
            },
        })
    });
    let parts = parts.collect::<Result<_, EstimateError>>()?;
    Ok(Spline { basis, centre, from_s, to_s, parts })
}

/// The middle of the positions' range: coefficients about it are small, and so are rounding and ripple.
fn middle(sources: &[Source]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let values = sources.iter().flat_map(|s| &s.positions).map(|p| p.value[axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        low.midpoint(high)
    })
}

/// Whether every sample has one sigma for all axes.
fn axes_agree(sources: &[Source]) -> bool {
    let same =
        |s: &Sample| s.sigma[0].total_cmp(&s.sigma[1]).is_eq() && s.sigma[0].total_cmp(&s.sigma[2]).is_eq();
    sources.iter().all(|s| s.positions.iter().all(same) && s.velocities.iter().all(same))
}

impl Spline {
    /// Number of knots and their spacing, s.
    #[must_use]
    pub fn knots(&self) -> (usize, f64) {
        (self.basis.count(), self.basis.spacing_s())
    }

    /// The noise's scale by axis of the positions' fit: 1 where the sigmas that were given are right.
    #[must_use]
    pub fn noise_scale(&self) -> [f64; 3] {
        self.by_axis(|part, axis| part.position.noise_scale[axis].sqrt())
    }

    /// The weight of the jerk penalty by axis, 1/m^2.
    #[must_use]
    pub fn lambda(&self) -> [f64; 3] {
        self.by_axis(|part, _| part.position.lambda)
    }

    fn by_axis(&self, f: impl Fn(&Part, usize) -> f64) -> [f64; 3] {
        let mut values = [0.0; 3];
        for part in &self.parts {
            part.axes.iter().for_each(|&axis| values[axis] = f(part, axis));
        }
        values
    }
}

impl Block {
    /// The combination of the functions `row`, from `first` on, by axis.
    #[inline(always)]
    fn combine(&self, first: usize, row: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (c, b) in self.coefficients[first..].iter().zip(row) {
            (0..3).for_each(|axis| sum[axis] += c[axis] * b);
        }
        sum
    }

    /// Its standard deviation by axis. Sigmas that turn out too small are scaled up, but none down: the user may
    /// know of errors that the scatter doesn't show.
    #[inline(always)]
    fn sigma(&self, first: usize, row: &[f64]) -> [f64; 3] {
        let unit = self.inverse.quadratic_form(first, row).max(0.0);
        self.noise_scale.map(|scale| (scale.max(1.0) * unit).sqrt())
    }
}

impl Curve for Spline {
    fn at(&self, time_s: f64) -> Option<State> {
        (self.from_s..=self.to_s).contains(&time_s).then(|| vectorised(StateAt { spline: self, time_s }))
    }
}

/// The state of a spline at an instant within its span.
struct StateAt<'a> {
    spline: &'a Spline,
    time_s: f64,
}

impl Kernel for StateAt<'_> {
    type Output = State;

    #[inline(always)]
    fn run(self) -> State {
        let Self { spline, time_s } = self;
        let mut active = Active::default();
        spline.basis.evaluate(time_s, &mut active);
        let (first, value, slope) = (active.first, active.value(), active.slope());
        let mut state = State::default();
        let mut acceleration = [0.0; 3];
        for Part { axes, position, velocity } in &spline.parts {
            let velocity = velocity.as_ref().unwrap_or(position);
            let (p, p_sigma) = (position.combine(first, value), position.sigma(first, value)); // (7)
            let (v, v_sigma) = (velocity.combine(first, slope), velocity.sigma(first, slope)); // (8)
            let a = velocity.combine(first, active.curvature());
            for &axis in *axes {
                state.position[axis] = spline.centre[axis] + p[axis];
                state.velocity[axis] = v[axis];
                acceleration[axis] = a[axis];
                state.position_sigma[axis] = p_sigma[axis];
                state.velocity_sigma[axis] = v_sigma[axis];
            }
        }
        state.acceleration = Some(acceleration);
        state
    }
}
