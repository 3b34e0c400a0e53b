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
use crate::math::gaussian_basis::{Active, GaussianBasis, MAX_ACTIVE};
use crate::math::scalar;
use crate::math::simd::{Kernel, vectorised};
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

/// No finer by default, s: a vehicle's sharpest moves, a thrust's onset in 0.3 s, are followed at this spacing.
const FINEST_SPACING_S: f64 = 0.08;

/// Fewest sampling instants that a fit takes: a quadratic has three unknowns, its noise needs one more.
pub const MIN_SAMPLES: usize = 4;

/// Order of the difference penalty: the third, jerk.
const PENALTY_ORDER: usize = 3;

/// The ridge that is added, relative to the largest diagonal element, where rounding leaves the matrix not
/// positive definite: data and penalty leave a direction open that the curve doesn't show.
const RIDGE: f64 = 1e-13;

/// The spacing that gives five samples a knot over `[from_s, to_s]`, all sources pooled, but at least 0.08 s.
///
/// The number of knots is so bounded by the number of samples, whatever the times are.
#[must_use]
pub fn default_knot_spacing_s(sources: &[Source], from_s: f64, to_s: f64) -> f64 {
    let samples: usize = sources.iter().map(Source::len).sum();
    ((to_s - from_s) * SAMPLES_PER_KNOT / samples.max(1) as f64).max(FINEST_SPACING_S)
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

fn check(sources: &[Source]) -> Result<(), EstimateError> {
    for source in sources {
        for quantity in Quantity::ALL {
            let good = |s: &Sample| {
                // a sum is finite only where all of its terms are
                let sum: f64 = s.value.iter().chain(&s.sigma).sum::<f64>() + s.time_s;
                sum.is_finite() && s.sigma.iter().all(|v| *v > 0.0)
            };
            if let Some(sample) = source.series(quantity).iter().find(|s| !good(s)) {
                return Err(bad_number(source, quantity, sample));
            }
        }
    }
    Ok(())
}

/// What is wrong with a sample that [`check`] found.
fn bad_number(source: &Source, quantity: Quantity, sample: &Sample) -> EstimateError {
    let infinite = |v: &&f64| !v.is_finite();
    let (value, expected) =
        sample.value.iter().find(infinite).map(|&v| (v, "a finite number")).unwrap_or_else(|| {
            let sigma = sample.sigma.iter().find(|v| !(**v > 0.0 && v.is_finite()));
            sigma.map_or((sample.time_s, "a finite time"), |&v| (v, "a positive sigma"))
        });
    let what = format!("{} of {}", quantity.name(), source.name);
    EstimateError::BadNumber { what, time_s: sample.time_s, value, expected }
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
        // 12 functions at an instant for a width of 1, up to 18 for wider ones
        if basis.half_bandwidth() < 12 {
            vectorised(Assembly::<12> { problem: self, basis })
        } else {
            vectorised(Assembly::<MAX_ACTIVE> { problem: self, basis })
        }
    }
}

/// The sum over all samples, N functions at an instant.
struct Assembly<'a, const N: usize> {
    problem: &'a Problem<'a>,
    basis: &'a GaussianBasis,
}

impl<const N: usize> Kernel for Assembly<'_, N> {
    type Output = Normal;

    #[inline(always)]
    fn run(self) -> Normal {
        let Self { problem, basis } = self;
        let mut normal = Normal {
            gram: Banded::zeros(basis.count(), basis.half_bandwidth()),
            right: vec![[0.0; 3]; basis.count()],
            squares: [0.0; 3],
            rows: 0,
        };
        let [positions, velocities] = Quantity::ALL.map(|q| problem.quantities.contains(&q));
        let (mut patch, mut active) = (Patch::<N>::new(), Active::default());
        for (position, velocity) in problem.sources.iter().flat_map(Source::instants) {
            let (position, velocity) = (position.filter(|_| positions), velocity.filter(|_| velocities));
            let Some(any) = position.or(velocity) else { continue };
            basis.evaluate(any.time_s, &mut active);
            if active.first != patch.first {
                patch.flush(&mut normal);
                patch.first = active.first;
            }
            let [value, slope] = active.padded::<N>();
            let weight = |s: &Sample| s.sigma[problem.weights_of].powi(-2);
            let (p, p_weight) = position.map_or(([0.0; 3], 0.0), |p| {
                (std::array::from_fn(|a| p.value[a] - problem.centre[a]), weight(p))
            });
            let (v, v_weight) = velocity.map_or(([0.0; 3], 0.0), |v| (v.value, weight(v)));
            patch.add([(value, p, p_weight), (slope, v, v_weight)], &mut normal.squares); // (7), (8)
            normal.rows += usize::from(position.is_some()) + usize::from(velocity.is_some());
        }
        patch.flush(&mut normal);
        normal
    }
}

/// The part of the normal equations that successive samples on the same N functions add to.
struct Patch<const N: usize> {
    first: usize,
    gram: [[f64; N]; N],
    right: [[f64; 3]; N],
}

impl<const N: usize> Patch<N> {
    fn new() -> Self {
        Self { first: 0, gram: [[0.0; N]; N], right: [[0.0; 3]; N] }
    }

    /// Adds the rows `b c = value` of the given weights, those of weight 0 in vain.
    #[inline(always)]
    fn add(&mut self, rows: [(&[f64; N], [f64; 3], f64); 2], squares: &mut [f64; 3]) {
        let [(b, p, bw), (d, v, dw)] = rows;
        for i in 0..N {
            let (bi, di) = (bw * b[i], dw * d[i]);
            // the lower half too: a fixed length makes vector instructions
            for j in 0..N {
                self.gram[i][j] += bi * b[j] + di * d[j];
            }
            for axis in 0..3 {
                self.right[i][axis] += bi * p[axis] + di * v[axis];
            }
        }
        for axis in 0..3 {
            squares[axis] += bw * p[axis] * p[axis] + dw * v[axis] * v[axis];
        }
    }

    fn flush(&mut self, normal: &mut Normal) {
        normal.gram.add_block(self.first, &self.gram);
        for (to, from) in normal.right[self.first..].iter_mut().zip(&self.right) {
            (0..3).for_each(|axis| to[axis] += from[axis]);
        }
        self.gram.as_flattened_mut().fill(0.0);
        self.right.as_flattened_mut().fill(0.0);
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

impl Normal {
    fn factor(&self, penalty: &Banded, lambda: f64) -> Option<Cholesky> {
        let penalised = || {
            let mut matrix = self.gram.clone();
            matrix.add_scaled(lambda, penalty);
            matrix
        };
        penalised().cholesky().or_else(|| {
            let mut matrix = penalised();
            let largest = (0..matrix.size()).map(|i| matrix.row(i)[0]).fold(0.0, f64::max);
            for i in 0..matrix.size() {
                matrix.add_to_diagonal(i, RIDGE * largest);
            }
            matrix.cholesky()
        })
    }

    /// The penalised residual sum of squares by axis, `z'Wz - b' A^-1 b`, of which rounding keeps 1e-14 of
    /// z'Wz; `forms` is the second term.
    fn residual(&self, forms: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| {
            let floor = (1e-14 * self.squares[a]).max(f64::MIN_POSITIVE);
            (self.squares[a] - forms[a]).max(floor)
        })
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
    let cholesky = normal.factor(&penalty, lambda).ok_or(EstimateError::Undetermined {
        what: "sff".into(),
        why: "too few of them, or at too few instants",
    })?;
    let mut coefficients = normal.right.clone();
    cholesky.solve(&mut coefficients);
    let mut forms = [0.0; 3];
    for (c, b) in coefficients.iter().zip(&normal.right) {
        (0..3).for_each(|a| forms[a] += c[a] * b[a]);
    }
    let noise_scale = normal.residual(forms).map(|r| r / normal.freedom());
    Ok(Block { coefficients, inverse: cholesky.selected_inverse(), noise_scale, lambda })
}

/// The lambda of greatest restricted likelihood, the noise's scale profiled out by axis.
///
/// -2 log L = sum over axes (n - 3) log R(lambda) + log|A + lambda D'D| - (M - 3) log lambda, R the
/// penalised residual sum; searched in log10(lambda tr(D'D) / tr(A)), so that units don't matter.
fn likeliest_lambda(normal: &Normal, penalty: &Banded, axes: &[usize]) -> f64 {
    let unit = normal.gram.trace() / penalty.trace();
    let rank = (penalty.size() - PENALTY_ORDER) as f64;
    let freedom = normal.freedom();
    let found = scalar::minimise(-8.0, 8.0, 5, 0.1, |exponent| {
        let lambda = unit * 10.0_f64.powf(exponent);
        let tried = normal.gram.log_determinant_and_forms(lambda, penalty, &normal.right);
        let Some((log_determinant, forms)) = tried else { return f64::INFINITY };
        let residual = normal.residual(forms);
        let determinant = log_determinant - rank * lambda.ln();
        axes.iter().map(|&a| freedom * residual[a].ln() + determinant).sum()
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
