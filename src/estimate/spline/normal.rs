//! The penalised normal equations of SFF: their sum over the samples, the penalty's weight, the solution.

use crate::estimate::EstimateError;
use crate::math::banded::{Banded, Cholesky};
use crate::math::gaussian_basis::{Active, GaussianBasis, MAX_ACTIVE};
use crate::math::scalar;
use crate::math::simd::{Kernel, vectorised};
use crate::sample::{Quantity, Sample, Source};

/// How the weight of the jerk penalty is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// By restricted maximum likelihood.
    #[default]
    Likelihood,
    /// A given lambda, 1/m^2; 0 for none, which a gap in the data doesn't survive.
    Fixed(f64),
}

/// Order of the difference penalty: the third, jerk.
const PENALTY_ORDER: usize = 3;

/// The ridge that is added, relative to the largest diagonal element, where rounding leaves the matrix not
/// positive definite: data and penalty leave a direction open that the curve doesn't show.
const RIDGE: f64 = 1e-13;

/// One least-squares problem and its solution, for those axes whose weights agree.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Coefficients about the centre, one row a knot, one column an axis.
    pub(super) coefficients: Vec<[f64; 3]>,
    /// The inverse of the penalised normal matrix, inside its band.
    pub(super) inverse: Banded,
    /// Variance of a row of unit weight, by axis: 1 where the sigmas are right.
    pub(super) noise_scale: [f64; 3],
    /// The penalty's weight.
    pub(super) lambda: f64,
}

/// What is fitted in one block.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub(super) sources: &'a [Source],
    pub(super) quantities: &'a [Quantity],
    /// The axis whose weights are used.
    pub(super) weights_of: usize,
    /// The axes that are solved for.
    pub(super) axes: &'a [usize],
    pub(super) centre: [f64; 3],
}

/// The normal equations of one problem.
struct Normal {
    gram: Banded,
    right: Vec<[f64; 3]>,
    squares: [f64; 3],
    rows: usize,
    /// Directions that the penalty leaves open and the rows see: those of a quadratic.
    open: usize,
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
            open: PENALTY_ORDER,
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

    /// Degrees of freedom of the noise: rows less what the penalty leaves open to them.
    fn freedom(&self) -> f64 {
        self.rows.saturating_sub(self.open).max(1) as f64
    }
}

/// Solves one problem on the knots of `basis`.
pub(super) fn solve(
    basis: &GaussianBasis,
    problem: &Problem<'_>,
    smoothing: Smoothing,
) -> Result<Block, EstimateError> {
    let mut normal = problem.normal(basis);
    if problem.quantities == [Quantity::Velocity] && smoothing != Smoothing::Fixed(0.0) {
        // velocities leave the height open but for a faint hold at the ends, which a penalty drowns in
        // rounding: tie the middle coefficient to the centre
        let weight = normal.gram.trace() / basis.count() as f64;
        normal.gram.add_to_diagonal(basis.count() / 2, weight);
        normal.open = PENALTY_ORDER - 1;
    }
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
    // beyond 1e8 the penalty would leave too few digits to the data
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
