//! Dense linear least squares by QR, for a few unknowns and any number of rows in flat memory.

use nalgebra::{DMatrix, DVector};

/// Rows of a problem min |A x - b|, folded into a triangle a block at a time (sequential TSQR; Demmel et
/// al. 2012): memory is that of one block, and the condition is that of A, not of A'A.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    unknowns: usize,
    /// Upper triangle of the QR of [A | b] so far, below it the rows that wait.
    stack: DMatrix<f64>,
    /// Rows of the stack in use.
    filled: usize,
    rows: usize,
}

/// The minimiser, with what its covariance needs.
#[derive(Clone, Debug)]
pub struct Solution {
    /// x, one an unknown.
    pub coefficients: DVector<f64>,
    /// |A x - b|^2.
    pub residual_sum: f64,
    /// Number of rows that were given.
    pub rows: usize,
    triangle: DMatrix<f64>,
}

impl LeastSquares {
    /// A problem of `unknowns` columns, no rows yet.
    #[must_use]
    pub fn new(unknowns: usize) -> Self {
        let stack = DMatrix::zeros(unknowns + 1 + 256, unknowns + 1);
        Self { unknowns, stack, filled: 0, rows: 0 }
    }

    /// Adds the row `a x = b`.
    ///
    /// # Panics
    /// When `a` hasn't one number for each unknown.
    pub fn push(&mut self, a: &[f64], b: f64) {
        assert_eq!(a.len(), self.unknowns);
        if self.filled == self.stack.nrows() {
            self.fold();
        }
        for (j, &v) in a.iter().enumerate() {
            self.stack[(self.filled, j)] = v;
        }
        self.stack[(self.filled, self.unknowns)] = b;
        self.filled += 1;
        self.rows += 1;
    }

    fn fold(&mut self) {
        let triangle = self.stack.rows(0, self.filled).into_owned().qr().r();
        self.filled = triangle.nrows();
        self.stack.rows_mut(0, self.filled).copy_from(&triangle);
    }

    /// Solves, or `None` where the rows don't determine every unknown.
    #[must_use]
    pub fn solve(mut self) -> Option<Solution> {
        let n = self.unknowns;
        if self.rows < n {
            return None;
        }
        self.fold();
        let triangle = self.stack.view((0, 0), (n, n)).into_owned();
        let largest = triangle.diagonal().amax();
        if !triangle.diagonal().iter().all(|d| d.abs() > 1e-13 * largest) {
            return None;
        }
        let right = self.stack.view((0, n), (n, 1)).column(0).into_owned();
        let coefficients = triangle.solve_upper_triangular(&right)?;
        let residual = if self.filled > n { self.stack[(n, n)] } else { 0.0 };
        Some(Solution { coefficients, residual_sum: residual * residual, rows: self.rows, triangle })
    }
}

impl Solution {
    /// `b' (A'A)^-1 b`: the variance of `b' x` for rows of unit variance.
    #[must_use]
    pub fn variance_of(&self, b: &[f64]) -> f64 {
        let b = DVector::from_column_slice(b);
        self.triangle.tr_solve_upper_triangular(&b).map_or(f64::INFINITY, |v| v.norm_squared())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_rows_give_the_normal_equations_answer_and_covariance() {
        let mut problem = LeastSquares::new(3);
        let (mut gram, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
        let mut squares = 0.0;
        for i in 0..1000 {
            let t = f64::from(i) * 1e-3;
            let (a, b) = ([1.0, t, t * t], (7.0 * t).sin());
            problem.push(&a, b);
            let row = nalgebra::Vector3::from(a);
            gram += row * row.transpose();
            right += row * b;
            squares += b * b;
        }
        let solution = problem.solve().expect("determined");
        let inverse = gram.try_inverse().expect("regular");
        let expected = inverse * right;
        assert!(
            (solution.coefficients.clone() - DVector::from_column_slice(expected.as_slice())).norm() < 1e-10
        );
        assert!((solution.residual_sum - (squares - right.dot(&expected))).abs() < 1e-9);
        let b = nalgebra::Vector3::new(1.0, 0.3, 2.0);
        let variance = (b.transpose() * inverse * b)[0];
        assert!((solution.variance_of(b.as_slice()) / variance - 1.0).abs() < 1e-9);
    }

    #[test]
    fn rows_that_leave_an_unknown_open_have_no_solution() {
        let mut problem = LeastSquares::new(2);
        problem.push(&[1.0, 1.0], 1.0);
        assert!(problem.clone().solve().is_none());
        problem.push(&[2.0, 2.0], 2.0);
        assert!(problem.solve().is_none());
    }
}
