//! The bordered system of spline and unknowns, solved by the Schur complement of its banded blocks.
//!
//! With x_a an axis' coefficients, u all unknowns, P their prior precision, lambda_a the jerk's weight:
//!
//! ```text
//! | A_x + lambda_x Q                                      B_x |  | x_x |   | f_x |
//! |                   A_y + lambda_y Q                    B_y |  | x_y | = | f_y |
//! |                                     A_z + lambda_z Q  B_z |  | x_z |   | f_z |
//! | B_x'              B_y'              B_z'          D + P   |  | u   |   | d   |
//!
//! S = sum_a (D_a - B_a' A_a^-1 B_a),   s = sum_a (d_a - B_a' A_a^-1 f_a)         what the data say of u
//! C = (S + P)^-1,   u = C s,   x_a = A_a^-1 f_a - G_a u,   G_a = A_a^-1 B_a
//! cov x_a = A_a^-1 + G_a C G_a'                                                   the border included
//! ```
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | A, Q | Gram matrix of the spline's rows, penalty | M x M, banded |
//! | B | rows of spline times columns of unknowns | M x 6 a source |
//! | S, s | information on the unknowns, the spline eliminated | k x k, k |
//! | C | posterior covariance of the unknowns | k x k |

use nalgebra::{Cholesky as Dense, DMatrix, DVector, Dyn};

use super::knots::Penalty;
use super::model::{COLUMNS, VALUE};
use super::normal::Normal;
use super::unknowns::{Kind, OF_A_SOURCE, OF_AN_AXIS, index};
use crate::math::banded::{Banded, Cholesky};
use crate::math::simd::{Kernel, vectorised};

/// The ridge that is added, relative to the largest diagonal element, where rounding leaves the matrix not
/// positive definite: data and penalty leave a direction open that the curve doesn't show.
const RIDGE: f64 = 1e-13;

/// Which sources have unknowns, and which of these act.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Sources beside the datum, in order.
    pub(super) slots: Vec<usize>,
    /// Indices of the unknowns that act, in order, among [`OF_A_SOURCE`] a slot.
    pub(super) active: Vec<usize>,
}

impl Layout {
    /// Number of unknowns, acting or not.
    pub(super) fn len(&self) -> usize {
        self.slots.len() * OF_A_SOURCE
    }

    /// Where each unknown stands among the acting ones.
    fn places(&self) -> Vec<Option<usize>> {
        let mut places = vec![None; self.len()];
        self.active.iter().enumerate().for_each(|(place, &i)| places[i] = Some(place));
        places
    }
}

/// What the data alone say of the acting unknowns: a normal distribution's information.
#[derive(Clone, Debug)]
pub(super) struct Information {
    /// S.
    pub(super) matrix: DMatrix<f64>,
    /// s.
    pub(super) vector: DVector<f64>,
}

/// The system with the spline eliminated.
#[derive(Clone, Debug)]
pub(super) struct Eliminated {
    factors: [Cholesky; 3],
    /// `A^-1 [B f]` by axis and block; f in column [`VALUE`], a block's own share of it.
    solved: [Vec<Vec<[f64; COLUMNS]>>; 3],
    pub(super) information: Information,
    /// -2 log of the likelihood at u = 0, without the constant.
    pub(super) deviance_at_zero: f64,
}

/// `gram + lambda * penalty`, factored.
pub(super) fn factor(gram: &Banded, penalty: &Banded, lambda: f64) -> Option<Cholesky> {
    let penalised = || {
        let mut matrix = gram.clone();
        matrix.add_scaled(lambda, penalty);
        matrix
    };
    penalised().cholesky().or_else(|| {
        let mut matrix = penalised();
        let largest = (0..matrix.size()).map(|i| matrix.row(i)[0]).fold(0.0, f64::max);
        (0..matrix.size()).for_each(|i| matrix.add_to_diagonal(i, RIDGE * largest));
        matrix.cholesky()
    })
}

/// `D - B' A^-1 B` of one axis for two blocks, from what `a' b` makes of their borders: `D` is zero unless they are
/// the same.
pub(super) fn complement(
    corner: Option<&[[f64; COLUMNS]; COLUMNS]>,
    a: &[[f64; COLUMNS]],
    b: &[[f64; COLUMNS]],
) -> [[f64; COLUMNS]; COLUMNS] {
    let products = products(a, b);
    std::array::from_fn(|i| std::array::from_fn(|j| corner.map_or(0.0, |d| d[i][j]) - products[i][j]))
}

/// `a' b` of two blocks of columns.
fn products(a: &[[f64; COLUMNS]], b: &[[f64; COLUMNS]]) -> [[f64; COLUMNS]; COLUMNS] {
    vectorised(Products { a, b })
}

struct Products<'a> {
    a: &'a [[f64; COLUMNS]],
    b: &'a [[f64; COLUMNS]],
}

impl Kernel for Products<'_> {
    type Output = [[f64; COLUMNS]; COLUMNS];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut sum = [[0.0; COLUMNS]; COLUMNS];
        for (a, b) in self.a.iter().zip(self.b) {
            for i in 0..COLUMNS {
                for j in 0..COLUMNS {
                    sum[i][j] += a[i] * b[j];
                }
            }
        }
        sum
    }
}

/// Eliminates the spline, or `None` where the data and the penalty leave it open.
pub(super) fn eliminate(
    normal: &Normal,
    penalty: &Penalty,
    lambda: [f64; 3],
    layout: &Layout,
) -> Option<Eliminated> {
    let places = layout.places();
    let k = layout.active.len();
    let mut information = Information { matrix: DMatrix::zeros(k, k), vector: DVector::zeros(k) };
    let mut deviance = -normal.log_weights;
    let mut factors = Vec::with_capacity(3);
    let mut solved = std::array::from_fn(|_| Vec::new());
    for axis in 0..3 {
        let cholesky = factor(normal.gram(axis), &penalty.matrix, lambda[axis])?;
        let of_penalty = penalty.rank as f64 * lambda[axis].ln() + penalty.log_weights;
        deviance += cholesky.log_determinant() - of_penalty;
        let columns = normal.border[axis].iter().map(|border| {
            let mut columns = border.clone();
            cholesky.solve(&mut columns);
            columns
        });
        solved[axis] = columns.collect::<Vec<_>>();
        let blocks = solved[axis].len();
        let place =
            |slot: usize, column: usize| places.get(index(slot, Kind::ALL[column], axis)).copied().flatten();
        for i in 0..blocks {
            for j in 0..blocks {
                let corner = (i == j).then_some(&normal.corner[axis][i]);
                let complement = complement(corner, &normal.border[axis][i], &solved[axis][j]);
                deviance += complement[VALUE][VALUE];
                for a in 0..OF_AN_AXIS {
                    let Some(row) = place(i, a) else { continue };
                    information.vector[row] += complement[a][VALUE];
                    for b in 0..OF_AN_AXIS {
                        let Some(column) = place(j, b) else { continue };
                        information.matrix[(row, column)] += complement[a][b];
                    }
                }
            }
        }
        factors.push(cholesky);
    }
    let factors = factors.try_into().ok()?;
    information.matrix = 0.5 * (&information.matrix + information.matrix.transpose());
    Some(Eliminated { factors, solved, information, deviance_at_zero: deviance })
}

/// The unknowns' distribution under a normal prior of zero mean.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    pub(super) mean: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Log of the evidence relative to that of no unknowns.
    pub(super) log_evidence: f64,
}

impl Information {
    /// Combines the data with a prior of these variances; an unknown of variance 0 is none.
    pub(super) fn with_prior(&self, variances: &[f64]) -> Option<Estimate> {
        let used: Vec<usize> = (0..variances.len()).filter(|&i| variances[i] > 0.0).collect();
        let k = used.len();
        // in units of the prior's sigma: well conditioned whatever the units are
        let sigma = |i: usize| variances[used[i]].sqrt();
        let scaled = DMatrix::from_fn(k, k, |i, j| {
            self.matrix[(used[i], used[j])] * sigma(i) * sigma(j) + f64::from(u8::from(i == j))
        });
        let score = DVector::from_fn(k, |i, _| self.vector[used[i]] * sigma(i));
        let factor: Dense<f64, Dyn> = scaled.cholesky()?;
        let solution = factor.solve(&score);
        let determinant: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let inverse = factor.inverse();
        let mut mean = DVector::zeros(variances.len());
        let mut covariance = DMatrix::zeros(variances.len(), variances.len());
        for i in 0..k {
            mean[used[i]] = solution[i] * sigma(i);
            for j in 0..k {
                covariance[(used[i], used[j])] = inverse[(i, j)] * sigma(i) * sigma(j);
            }
        }
        Some(Estimate { mean, covariance, log_evidence: 0.5 * score.dot(&solution) - determinant })
    }
}

/// The joint posterior of spline and unknowns.
#[derive(Clone, Debug)]
pub(super) struct Posterior {
    /// Coefficients about the centre, one row a knot, one column an axis.
    pub(super) coefficients: Vec<[f64; 3]>,
    /// `A^-1` inside its band, by axis.
    inverse: [Banded; 3],
    /// G by axis and slot.
    response: [Vec<Vec<[f64; OF_AN_AXIS]>>; 3],
    /// The covariance of the unknowns that act on an axis, by axis, row by row.
    local: [Vec<f64>; 3],
    /// All unknowns, acting or not.
    pub(super) unknowns: Vec<f64>,
    /// Their covariance; zero where they don't act.
    pub(super) covariance: DMatrix<f64>,
}

impl Eliminated {
    /// Puts the unknowns back in.
    pub(super) fn posterior(&self, layout: &Layout, estimate: &Estimate) -> Posterior {
        let mut unknowns = vec![0.0; layout.len()];
        let mut covariance = DMatrix::zeros(layout.len(), layout.len());
        for (i, &row) in layout.active.iter().enumerate() {
            unknowns[row] = estimate.mean[i];
            for (j, &column) in layout.active.iter().enumerate() {
                covariance[(row, column)] = estimate.covariance[(i, j)];
            }
        }
        let count = self.solved[0].first().map_or(0, Vec::len);
        let mut coefficients = vec![[0.0; 3]; count];
        for axis in 0..3 {
            for columns in &self.solved[axis] {
                coefficients.iter_mut().zip(columns).for_each(|(c, from)| c[axis] += from[VALUE]);
            }
            for slot in 0..layout.slots.len() {
                let of_axis = |j: usize| unknowns[index(slot, Kind::ALL[j], axis)];
                let u: [f64; OF_AN_AXIS] = std::array::from_fn(of_axis);
                for (c, g) in coefficients.iter_mut().zip(&self.solved[axis][slot]) {
                    c[axis] -= (0..OF_AN_AXIS).map(|j| g[j] * u[j]).sum::<f64>();
                }
            }
        }
        let slots = layout.slots.len();
        let local = std::array::from_fn(|axis| {
            let at = |i: usize| index(i / OF_AN_AXIS, Kind::ALL[i % OF_AN_AXIS], axis);
            let size = slots * OF_AN_AXIS;
            (0..size * size).map(|ij| covariance[(at(ij / size), at(ij % size))]).collect()
        });
        let response = std::array::from_fn(|axis| {
            let of =
                |slot: usize| self.solved[axis][slot].iter().map(|g| std::array::from_fn(|j| g[j])).collect();
            (0..slots).map(of).collect()
        });
        let inverse = std::array::from_fn(|axis| self.factors[axis].selected_inverse());
        Posterior { coefficients, inverse, response, local, unknowns, covariance }
    }
}

impl Posterior {
    /// The variance of `gain * b' x + d' u` on one axis, b's entries from function `first` on, d those of the
    /// `slot`-th source, if any.
    #[inline(always)]
    pub(super) fn variance(
        &self,
        axis: usize,
        first: usize,
        b: &[f64],
        gain: f64,
        own: Option<(usize, &[f64; COLUMNS])>,
    ) -> f64 {
        let slots = &self.response[axis];
        let size = slots.len() * OF_AN_AXIS;
        let banded = gain * gain * self.inverse[axis].quadratic_form(first, b);
        // gain b' x + d' u = gain b' A^-1 f + (d - gain G' b)' u
        let mut sum = 0.0;
        let vector = |slot: usize| -> [f64; OF_AN_AXIS] {
            let mut v = match own {
                Some((own, d)) if own == slot => std::array::from_fn(|j| d[j]),
                _ => [0.0; OF_AN_AXIS],
            };
            for (g, b) in slots[slot][first..].iter().zip(b) {
                (0..OF_AN_AXIS).for_each(|j| v[j] -= gain * b * g[j]);
            }
            v
        };
        for i in 0..slots.len() {
            let vi = vector(i);
            for j in 0..slots.len() {
                let vj = if i == j { vi } else { vector(j) };
                for a in 0..OF_AN_AXIS {
                    let row = &self.local[axis][(i * OF_AN_AXIS + a) * size + j * OF_AN_AXIS..];
                    sum += vi[a] * (0..OF_AN_AXIS).map(|b| row[b] * vj[b]).sum::<f64>();
                }
            }
        }
        (banded + sum).max(0.0)
    }
}
