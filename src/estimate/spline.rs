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

use super::EstimateError;
use crate::math::banded::{Banded, Cholesky};
use crate::math::gaussian_basis::{Active, GaussianBasis};
use crate::math::scalar;
use crate::sample::{Quantity, Sample, Source};
use crate::track::{Curve, State};

/// Whether the velocity is the derivative of the position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coefficients {
    /// p = q: it is.
    #[default]
    Shared,
    /// Position and velocity are fitted apart, as eq. 8 says literally.
    Independent,
}

impl Coefficients {
    /// The reading's name in configs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Shared => "shared",
            Self::Independent => "independent",
        }
    }
}

/// How the weight of the jerk penalty is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// By restricted maximum likelihood.
    #[default]
    Likelihood,
    /// A given lambda, 1/m^2; 0 for none, which a gap in the data doesn't survive.
    Fixed(f64),
}

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

/// Samples a knot, on average. 5: finer knots change nothing but the time, since the penalty smooths.
const SAMPLES_PER_KNOT: f64 = 5.0;

/// Fewest sampling instants that a fit takes: a quadratic has three unknowns, its noise needs one more.
pub const MIN_SAMPLES: usize = 4;

/// Order of the difference penalty: the third, jerk.
const PENALTY_ORDER: usize = 3;

/// The ridge that is added, relative to the largest diagonal element, where rounding leaves the matrix not
/// positive definite: data and penalty leave a direction open that the curve doesn't show.
const RIDGE: f64 = 1e-13;

/// The spacing that gives five samples a knot over `[from_s, to_s]`, all sources pooled.
///
/// The number of knots is so bounded by the number of samples, whatever the times are.
#[must_use]
pub fn default_knot_spacing_s(sources: &[Source], from_s: f64, to_s: f64) -> f64 {
    let samples: usize = sources.iter().map(Source::len).sum();
    ((to_s - from_s) * SAMPLES_PER_KNOT / samples.max(1) as f64).max(1e-6)
}

/// One least-squares problem and its solution, for those axes whose weights agree.
#[derive(Clone, Debug)]
struct Block {
    /// Coefficients about the centre, one row a knot, one column an axis.
    coefficients: Vec<[f64; 3]>,
    /// The inverse of the penalised normal matrix, inside its band.
    inverse: Banded,
    /// Variance of a row of unit weight, by axis: 1 where the sigmas are right.
    noise_scale: [f64; 3],
    /// The penalty's weight.
    lambda: f64,
}

/// A fitted spline.
#[derive(Clone, Debug)]
pub struct Spline {
    basis: GaussianBasis,
    centre: [f64; 3],
    from_s: f64,
    to_s: f64,
    blocks: Vec<Block>,
    /// Which block holds the position and the velocity of each axis.
    position_block: [usize; 3],
    velocity_block: [usize; 3],
}

/// What is fitted in one block.
#[derive(Clone, Copy)]
struct Problem<'a> {
    sources: &'a [Source],
    quantities: &'a [Quantity],
    /// The axis whose weights are used.
    weights_of: usize,
    /// The axes that are solved for.
    axes: &'a [usize],
    centre: [f64; 3],
}

/// The normal equations of one problem.
struct Normal {
    gram: Banded,
    right: Vec<[f64; 3]>,
    squares: [f64; 3],
    rows: usize,
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
    let spacing = settings.knot_spacing_s.unwrap_or_else(|| default_knot_spacing_s(sources, from_s, to_s));
    let basis = GaussianBasis::covering(from_s, to_s, spacing, settings.margin, settings.width);
    let centre = middle(sources);
    let separate: &[&[Quantity]] = match settings.coefficients {
        Coefficients::Shared => &[&Quantity::ALL],
        Coefficients::Independent => &[&[Quantity::Position], &[Quantity::Velocity]],
    };
    let groups: &[&[usize]] = if axes_agree(sources) { &[&[0, 1, 2]] } else { &[&[0], &[1], &[2]] };

    let mut spline = Spline {
        basis,
        centre,
        from_s,
        to_s,
        blocks: Vec::new(),
        position_block: [0; 3],
        velocity_block: [0; 3],
    };
    for quantities in separate {
        for axes in groups {
            let problem = Problem { sources, quantities, weights_of: axes[0], axes, centre };
            let block = solve(&spline.basis, &problem, settings.smoothing)?;
            for &axis in *axes {
                if quantities.contains(&Quantity::Position) {
                    spline.position_block[axis] = spline.blocks.len();
                }
                if quantities.contains(&Quantity::Velocity) {
                    spline.velocity_block[axis] = spline.blocks.len();
                }
            }
            spline.blocks.push(block);
        }
    }
    Ok(spline)
}

fn check(sources: &[Source]) -> Result<(), EstimateError> {
    for source in sources {
        for quantity in Quantity::ALL {
            for sample in source.series(quantity) {
                let bad = |value, expected| EstimateError::BadNumber {
                    what: format!("{} of {}", quantity.name(), source.name),
                    time_s: sample.time_s,
                    value,
                    expected,
                };
                if let Some(&v) = sample.value.iter().find(|v| !v.is_finite()) {
                    return Err(bad(v, "a finite number"));
                }
                if let Some(&v) = sample.sigma.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
                    return Err(bad(v, "a positive sigma"));
                }
                if !sample.time_s.is_finite() {
                    return Err(bad(sample.time_s, "a finite time"));
                }
            }
        }
    }
    Ok(())
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

impl Problem<'_> {
    /// Adds up the normal equations B'WB and B'Wz of eq. 11.
    fn normal(&self, basis: &GaussianBasis) -> Normal {
        let mut normal = Normal {
            gram: Banded::zeros(basis.count(), basis.half_bandwidth()),
            right: vec![[0.0; 3]; basis.count()],
            squares: [0.0; 3],
            rows: 0,
        };
        for &quantity in self.quantities {
            let centre = if quantity == Quantity::Position { self.centre } else { [0.0; 3] };
            for sample in self.sources.iter().flat_map(|s| s.series(quantity)) {
                let active = basis.at(sample.time_s);
                let row = row(&active, quantity);
                let weight = sample.sigma[self.weights_of].powi(-2);
                normal.gram.add_outer(active.first, row, weight);
                let value: [f64; 3] = std::array::from_fn(|a| sample.value[a] - centre[a]);
                for (right, b) in normal.right[active.first..].iter_mut().zip(row) {
                    for (r, v) in right.iter_mut().zip(value) {
                        *r += weight * b * v;
                    }
                }
                for (s, v) in normal.squares.iter_mut().zip(value) {
                    *s += weight * v * v;
                }
                normal.rows += 1;
            }
        }
        normal
    }
}

/// The basis functions whose combination is the quantity: eq. 7 or eq. 8.
fn row(active: &Active, quantity: Quantity) -> &[f64] {
    match quantity {
        Quantity::Position => active.value(), // (7)
        Quantity::Velocity => active.slope(), // (8)
    }
}

/// D3'D3 for n coefficients.
fn jerk_penalty(n: usize) -> Banded {
    let mut penalty = Banded::zeros(n, PENALTY_ORDER);
    for first in 0..n.saturating_sub(PENALTY_ORDER) {
        penalty.add_outer(first, &[-1.0, 3.0, -3.0, 1.0], 1.0);
    }
    penalty
}

/// One trial of the penalty's weight.
struct Trial {
    cholesky: Cholesky,
    /// Penalised residual sum of squares by axis.
    residual: [f64; 3],
}

impl Normal {
    fn factor(&self, penalty: &Banded, lambda: f64) -> Option<Cholesky> {
        let mut matrix = self.gram.clone();
        matrix.add_scaled(lambda, penalty);
        matrix.cholesky().or_else(|| {
            let mut matrix = self.gram.clone();
            matrix.add_scaled(lambda, penalty);
            let largest = (0..matrix.size()).map(|i| matrix.row(i)[0]).fold(0.0, f64::max);
            for i in 0..matrix.size() {
                matrix.row_mut(i)[0] += RIDGE * largest;
            }
            matrix.cholesky()
        })
    }

    fn trial(&self, penalty: &Banded, lambda: f64) -> Option<Trial> {
        let cholesky = self.factor(penalty, lambda)?;
        let mut half = self.right.clone();
        cholesky.forward(&mut half);
        // the least value of the penalised sum is z'Wz - |L^-1 B'Wz|^2; rounding keeps 1e-15 of z'Wz
        let mut residual = self.squares;
        for row in &half {
            for (r, v) in residual.iter_mut().zip(row) {
                *r -= v * v;
            }
        }
        for (r, s) in residual.iter_mut().zip(self.squares) {
            *r = r.max(1e-14 * s).max(f64::MIN_POSITIVE);
        }
        Some(Trial { cholesky, residual })
    }

    /// Degrees of freedom of the noise: rows less the unpenalised quadratic.
    fn freedom(&self) -> f64 {
        self.rows.saturating_sub(PENALTY_ORDER).max(1) as f64
    }
}

fn solve(basis: &GaussianBasis, problem: &Problem<'_>, smoothing: Smoothing) -> Result<Block, EstimateError> {
    let normal = problem.normal(basis);
    let penalty = jerk_penalty(basis.count());
    let lambda = match smoothing {
        Smoothing::Fixed(lambda) => lambda,
        Smoothing::Likelihood => likeliest_lambda(&normal, &penalty, problem.axes),
    };
    let trial = normal.trial(&penalty, lambda).ok_or(EstimateError::Undetermined {
        what: "sff".into(),
        why: "too few of them, or at too few instants",
    })?;
    let noise_scale = trial.residual.map(|r| r / normal.freedom());
    let mut coefficients = normal.right;
    trial.cholesky.solve(&mut coefficients);
    Ok(Block { coefficients, inverse: trial.cholesky.selected_inverse(), noise_scale, lambda })
}

/// The lambda of greatest restricted likelihood, the noise's scale profiled out by axis.
///
/// -2 log L = sum over axes (n - 3) log R(lambda) + log|A + lambda D'D| - (M - 3) log lambda, R the
/// penalised residual sum; searched in log10(lambda tr(D'D) / tr(A)), so that units don't matter.
fn likeliest_lambda(normal: &Normal, penalty: &Banded, axes: &[usize]) -> f64 {
    let unit = normal.gram.trace() / penalty.trace();
    let rank = (penalty.size() - PENALTY_ORDER) as f64;
    let freedom = normal.freedom();
    let found = scalar::minimise(-8.0, 8.0, 6, 0.05, |exponent| {
        let lambda = unit * 10.0_f64.powf(exponent);
        let Some(trial) = normal.trial(penalty, lambda) else { return f64::INFINITY };
        let determinant = trial.cholesky.log_determinant() - rank * lambda.ln();
        axes.iter().map(|&a| freedom * trial.residual[a].ln() + determinant).sum()
    });
    unit * 10.0_f64.powf(found.x)
}

impl Spline {
    /// The interval that the knots were laid for, s.
    #[must_use]
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.to_s)
    }

    /// Number of knots and their spacing, s.
    #[must_use]
    pub fn knots(&self) -> (usize, f64) {
        (self.basis.count(), self.basis.spacing_s())
    }

    /// The noise's scale by axis of the positions' fit: 1 where the sigmas that were given are right.
    #[must_use]
    pub fn noise_scale(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.blocks[self.position_block[axis]].noise_scale[axis].sqrt())
    }

    /// The weight of the jerk penalty by axis, 1/m^2.
    #[must_use]
    pub fn lambda(&self) -> [f64; 3] {
        self.position_block.map(|b| self.blocks[b].lambda)
    }
}

impl Curve for Spline {
    fn at(&self, time_s: f64) -> Option<State> {
        if !(self.from_s..=self.to_s).contains(&time_s) {
            return None;
        }
        let active = self.basis.at(time_s);
        let combine = |block: usize, row: &[f64], axis: usize| -> f64 {
            let rows = self.blocks[block].coefficients[active.first..].iter();
            rows.zip(row).map(|(c, b)| c[axis] * b).sum()
        };
        let mut variances = (usize::MAX, 0.0, 0.0); // of the block last asked, for unit noise
        let mut state = State::default();
        let mut acceleration = [0.0; 3];
        for axis in 0..3 {
            let (p, v) = (self.position_block[axis], self.velocity_block[axis]);
            state.position[axis] = self.centre[axis] + combine(p, active.value(), axis); // (7)
            state.velocity[axis] = combine(v, active.slope(), axis); // (8)
            acceleration[axis] = combine(v, active.curvature(), axis);
            let (pb, vb) = (&self.blocks[p], &self.blocks[v]);
            if variances.0 != p {
                let position = pb.inverse.quadratic_form(active.first, active.value());
                let velocity = vb.inverse.quadratic_form(active.first, active.slope());
                variances = (p, position.max(0.0), velocity.max(0.0));
            }
            state.position_sigma[axis] = (pb.noise_scale[axis] * variances.1).sqrt();
            state.velocity_sigma[axis] = (vb.noise_scale[axis] * variances.2).sqrt();
        }
        state.acceleration = Some(acceleration);
        Some(state)
    }
}
