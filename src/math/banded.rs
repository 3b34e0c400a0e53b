//! Symmetric positive definite banded systems: Cholesky, solution, determinant, and the part of the
//! inverse that lies inside the band.
//!
//! A matrix of size n with half-bandwidth w is kept as n rows of at least w + 1 numbers: row i holds
//! `A[i][i], A[i][i+1], ..., A[i][i+w]`, then zeros up to a length of 4, 12 or 20, so that the inner loops have
//! a fixed length and become vector instructions; what lies past the last column is zero too. All costs are linear
//! in n: `n w^2` for the factor, `2 n w` a right side, `2 n w^2` for the selected inverse
//! (Takahashi, Fagan, Chen 1973; Erisman and Tinney 1975).

use super::elimination::{Elimination, NARROW, THIN, WIDE, padded};
use super::simd::vectorised;

/// A symmetric banded matrix, its upper half by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Banded {
    size: usize,
    half_bandwidth: usize,
    /// Length of a row: [`THIN`], [`NARROW`] or [`WIDE`].
    stride: usize,
    data: Vec<f64>,
}

/// The lower Cholesky factor L of a [`Banded`] matrix A = L L'.
#[derive(Clone, Debug)]
pub struct Cholesky {
    /// L by columns: column j holds `L[j][j], L[j+1][j], ..., L[j+w][j]`.
    factor: Banded,
}

impl Banded {
    /// A zero matrix of `size` rows with `half_bandwidth` diagonals beside the main one.
    ///
    /// # Panics
    /// When `half_bandwidth` is above 19.
    #[must_use]
    pub fn zeros(size: usize, half_bandwidth: usize) -> Self {
        let fits = [THIN, NARROW, WIDE].into_iter().find(|&stride| half_bandwidth < stride);
        let stride = fits.expect("a half-bandwidth of at most 19");
        Self { size, half_bandwidth, stride, data: vec![0.0; size * stride] }
    }

    /// Number of rows.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of diagonals beside the main one.
    #[must_use]
    pub fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    /// Row `i` from the diagonal on: `A[i][i..=i+w]`, and zeros.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.stride..(i + 1) * self.stride]
    }

    /// Row `i` from the diagonal on, to write.
    fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.stride..(i + 1) * self.stride]
    }

    /// The element in row `i`, column `j`; zero outside the band.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (low, high) = if i <= j { (i, j) } else { (j, i) };
        if high - low <= self.half_bandwidth { self.row(low)[high - low] } else { 0.0 }
    }

    /// All rows, B being the stride.
    #[inline(always)]
    fn rows<const B: usize>(&self) -> &[[f64; B]] {
        self.data.as_chunks().0
    }

    /// Adds `value` to the i-th element of the diagonal.
    pub fn add_to_diagonal(&mut self, i: usize, value: f64) {
        self.row_mut(i)[0] += value;
    }

    /// Sum of the diagonal.
    #[must_use]
    pub fn trace(&self) -> f64 {
        (0..self.size).map(|i| self.row(i)[0]).sum()
    }

    /// Adds `scale` times `other`, whose band is at most as wide.
    ///
    /// # Panics
    /// When the sizes differ or `other` has the wider band.
    pub fn add_scaled(&mut self, scale: f64, other: &Self) {
        assert!(self.size == other.size && self.half_bandwidth >= other.half_bandwidth);
        for i in 0..self.size {
            for (a, b) in self.row_mut(i).iter_mut().zip(other.row(i)) {
                *a += scale * b;
            }
        }
    }

    /// Adds a symmetric block, its rows full, whose first row and column are `first`; what lies past the
    /// matrix's end must be zero, and is left out.
    pub fn add_block<const B: usize>(&mut self, first: usize, block: &[[f64; B]; B]) {
        for i in 0..B.min(self.size.saturating_sub(first)) {
            let row = self.row_mut(first + i);
            for (a, b) in row.iter_mut().zip(&block[i][i..]) {
                *a += b;
            }
        }
    }

    /// Adds `weight * b b'` for a row vector b whose entries stand from column `first` on.
    ///
    /// # Panics
    /// When b reaches past the band or the matrix.
    pub fn add_outer(&mut self, first: usize, b: &[f64], weight: f64) {
        for (i, &bi) in b.iter().enumerate() {
            let row = &mut self.row_mut(first + i)[..b.len() - i];
            for (a, &bj) in row.iter_mut().zip(&b[i..]) {
                *a += weight * bi * bj;
            }
        }
    }

    /// `b' A b` for a vector b whose entries stand from column `first` on, within the band.
    ///
    /// # Panics
    /// When b reaches past the band or the matrix.
    #[must_use]
    #[inline(always)]
    pub fn quadratic_form(&self, first: usize, b: &[f64]) -> f64 {
        assert!(b.len() <= self.half_bandwidth + 1 && first + b.len() <= self.size);
        match self.stride {
            THIN => self.form::<THIN>(first, b),
            NARROW => self.form::<NARROW>(first, b),
            _ => self.form::<WIDE>(first, b),
        }
    }

    #[inline(always)]
    fn form<const B: usize>(&self, first: usize, b: &[f64]) -> f64 {
        let long = padded(b);
        let (mut lanes, mut diagonal) = ([0.0; 4], 0.0);
        for (i, row) in self.rows::<B>()[first..first + b.len()].iter().enumerate() {
            let beside: &[f64; B] = long[i..].first_chunk().unwrap_or(row);
            let mut dot = [0.0; 4];
            for (four, with) in row.as_chunks::<4>().0.iter().zip(beside.as_chunks::<4>().0) {
                for k in 0..4 {
                    dot[k] += four[k] * with[k];
                }
            }
            for k in 0..4 {
                lanes[k] += long[i] * dot[k];
            }
            diagonal += row[0] * long[i] * long[i];
        }
        2.0 * lanes.iter().sum::<f64>() - diagonal
    }

    /// Factors the matrix, or `None` where it is not positive definite to working precision.
    #[must_use]
    pub fn cholesky(self) -> Option<Cholesky> {
        match self.stride {
            THIN => self.factor::<THIN>(),
            NARROW => self.factor::<NARROW>(),
            _ => self.factor::<WIDE>(),
        }
    }

    fn factor<const B: usize>(self) -> Option<Cholesky> {
        let mut factor = Self::zeros(self.size, self.half_bandwidth);
        let columns = factor.data.as_chunks_mut::<B>().0;
        let emit = |j: usize, column: &[f64; B], _: &[f64; 0]| columns[j] = *column;
        let right = vec![[]; self.size];
        vectorised(Elimination { rows: self.rows::<B>(), added: None, right: &right, emit })?;
        Some(Cholesky { factor })
    }

    /// Factors A = `self + scale * other` in passing, without keeping the factor: the logarithm of A's
    /// determinant, and by column `b' A^-1 b` of the right sides b (n rows, R columns). `None` where A is
    /// not positive definite.
    ///
    /// # Panics
    /// When the sizes differ or `other` has the wider band.
    #[must_use]
    pub fn log_determinant_and_forms<const R: usize>(
        &self,
        scale: f64,
        other: &Self,
        b: &[[f64; R]],
    ) -> Option<(f64, [f64; R])> {
        assert!(self.size == other.size && b.len() == self.size && self.stride >= other.stride);
        match self.stride {
            THIN => self.forms::<THIN, R>(scale, other, b),
            NARROW => self.forms::<NARROW, R>(scale, other, b),
            _ => self.forms::<WIDE, R>(scale, other, b),
        }
    }

    fn forms<const B: usize, const R: usize>(
        &self,
        scale: f64,
        other: &Self,
        b: &[[f64; R]],
    ) -> Option<(f64, [f64; R])> {
        let mut determinant = LogProduct::default();
        let mut forms = [0.0; R];
        let emit = |_: usize, column: &[f64; B], half: &[f64; R]| {
            determinant.multiply(column[0]);
            for r in 0..R {
                forms[r] += half[r] * half[r];
            }
        };
        vectorised(Elimination { rows: self.rows::<B>(), added: Some((scale, other)), right: b, emit })?;
        Some((2.0 * determinant.ln(), forms))
    }
}

/// The logarithm of a product, one call of ln for many factors.
struct LogProduct {
    sum: f64,
    product: f64,
}

impl Default for LogProduct {
    fn default() -> Self {
        Self { sum: 0.0, product: 1.0 }
    }
}

impl LogProduct {
    fn multiply(&mut self, factor: f64) {
        self.product *= factor;
        if !(1e-100..1e100).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    fn ln(&self) -> f64 {
        self.sum + self.product.ln()
    }
}

impl Cholesky {
    /// Overwrites the right sides b (n rows, R columns) by `L^-1 b`, whose products among each other are those
    /// of `b' A^-1 b`.
    ///
    /// # Panics
    /// When b has fewer rows than the matrix.
    pub fn forward<const R: usize>(&self, b: &mut [[f64; R]]) {
        let n = self.factor.size;
        for j in 0..n {
            let column = self.factor.row(j);
            let inverse = 1.0 / column[0];
            let (head, tail) = b[j..n].split_at_mut(1);
            for x in &mut head[0] {
                *x *= inverse;
            }
            for (l, row) in column[1..=self.factor.half_bandwidth].iter().zip(tail) {
                for r in 0..R {
                    row[r] -= l * head[0][r];
                }
            }
        }
    }

    /// Overwrites the right sides b (n rows, R columns) by `A^-1 b`.
    ///
    /// # Panics
    /// When b has fewer rows than the matrix.
    pub fn solve<const R: usize>(&self, b: &mut [[f64; R]]) {
        self.forward(b);
        let n = self.factor.size;
        for j in (0..n).rev() {
            let column = self.factor.row(j);
            let (head, tail) = b[j..n].split_at_mut(1);
            for (l, row) in column[1..=self.factor.half_bandwidth].iter().zip(&*tail) {
                for r in 0..R {
                    head[0][r] -= l * row[r];
                }
            }
            for x in &mut head[0] {
                *x /= column[0];
            }
        }
    }

    /// The logarithm of A's determinant.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        let mut determinant = LogProduct::default();
        (0..self.factor.size).for_each(|j| determinant.multiply(self.factor.row(j)[0]));
        2.0 * determinant.ln()
    }

    /// The elements of `A^-1` inside the band of A.
    #[must_use]
    pub fn selected_inverse(&self) -> Banded {
        let (n, stride) = (self.factor.size, self.factor.half_bandwidth + 1);
        let mut inverse = Banded::zeros(n, stride - 1);
        let mut scaled = vec![0.0; stride];
        let mut sums = vec![0.0; stride];
        for i in (0..n).rev() {
            let column = self.factor.row(i);
            let below = (n - i).min(stride);
            let root = 1.0 / column[0];
            for d in 1..below {
                scaled[d] = column[d] * root;
                sums[d] = 0.0;
            }
            // sums = Z[i+1.., i+1..] * scaled, Z symmetric and kept by its upper half
            for d in 1..below {
                let row = &inverse.row(i + d)[..below - d];
                let (factor, mut dot) = (scaled[d], row[0] * scaled[d]);
                for ((z, s), l) in row[1..].iter().zip(&mut sums[d + 1..below]).zip(&scaled[d + 1..below]) {
                    *s += factor * z;
                    dot += l * z;
                }
                sums[d] += dot;
            }
            let row = inverse.row_mut(i);
            let mut diagonal = root * root;
            for d in 1..below {
                row[d] = -sums[d];
                diagonal += scaled[d] * sums[d];
            }
            row[0] = diagonal;
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// A diagonally dominant matrix with no pattern in it.
    fn example(n: usize, w: usize) -> (Banded, DMatrix<f64>) {
        let mut a = Banded::zeros(n, w);
        for i in 0..n {
            for d in 0..=w.min(n - 1 - i) {
                let wave = ((7 * i + 3 * d) as f64).sin();
                a.row_mut(i)[d] = if d == 0 { 2.0 * w as f64 + 2.0 + wave } else { wave };
            }
        }
        let dense = DMatrix::from_fn(n, n, |i, j| a.get(i, j));
        (a, dense)
    }

    #[test]
    fn factor_solution_determinant_and_inverse_match_the_dense_ones() {
        for (n, w) in [(1, 0), (3, 5), (40, 1), (57, 11), (24, 11), (61, 17), (30, 3)] {
            let (a, dense) = example(n, w);
            let cholesky = a.clone().cholesky().expect("dominant");
            let half = a.clone();
            let b: Vec<[f64; 1]> = (0..n).map(|i| [(i as f64).cos()]).collect();
            let (log_determinant, forms) =
                half.log_determinant_and_forms(-0.1, &a, &b).expect("still dominant");
            assert!((log_determinant - (0.9 * &dense).determinant().ln()).abs() < 1e-10);
            let inverse = dense.clone().try_inverse().expect("regular");
            let column = DMatrix::from_fn(n, 1, |i, _| b[i][0]);
            let expected = (column.transpose() * &inverse * column)[(0, 0)] / 0.9;
            assert!((forms[0] - expected).abs() < 1e-12 * expected.abs().max(1.0));
            let mut b: Vec<[f64; 2]> = (0..n).map(|i| [i as f64, 1.0]).collect();
            let expected = &inverse * DMatrix::from_fn(n, 2, |i, j| b[i][j]);
            cholesky.solve(&mut b);
            let selected = cholesky.selected_inverse();
            for i in 0..n {
                assert!((b[i][0] - expected[(i, 0)]).abs() < 1e-12);
                assert!((b[i][1] - expected[(i, 1)]).abs() < 1e-12);
                for j in i..n.min(i + w + 1) {
                    assert!((selected.get(j, i) - inverse[(i, j)]).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn forms_equal_their_dense_products() {
        let (a, dense) = example(20, 6);
        let (first, x) = (5, [1.0, -2.0, 0.5, 3.0]);
        let embed =
            |v: &[f64]| DMatrix::from_fn(20, 1, |i, _| if (5..9).contains(&i) { v[i - 5] } else { 0.0 });
        let expected = (embed(&x).transpose() * &dense * embed(&x))[(0, 0)];
        assert!((a.quadratic_form(first, &x) - expected).abs() < 1e-12);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let mut a = Banded::zeros(3, 1);
        assert!(a.clone().cholesky().is_none());
        for (i, row) in [[1.0, 2.0], [1.0, 0.0], [1.0, 0.0]].iter().enumerate() {
            a.row_mut(i)[..2].copy_from_slice(row);
        }
        assert!(a.clone().cholesky().is_none());
        a.row_mut(0)[0] = f64::NAN;
        assert!(a.cholesky().is_none());
    }
}
