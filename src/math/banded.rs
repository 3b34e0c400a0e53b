//! Symmetric positive definite banded systems: Cholesky, solution, determinant, and the part of the
//! inverse that lies inside the band.
//!
//! A matrix of size n with half-bandwidth w is kept as n rows of w + 1 numbers: row i holds
//! `A[i][i], A[i][i+1], ..., A[i][i+w]`; what lies past the last column is zero. All costs are linear
//! in n: `n w^2` for the factor, `2 n w` a right side, `2 n w^2` for the selected inverse
//! (Takahashi, Fagan, Chen 1973; Erisman and Tinney 1975).

/// A symmetric banded matrix, its upper half by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Banded {
    size: usize,
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
    #[must_use]
    pub fn zeros(size: usize, half_bandwidth: usize) -> Self {
        let stride = half_bandwidth + 1;
        Self { size, stride, data: vec![0.0; size * stride] }
    }

    /// Number of rows.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of diagonals beside the main one.
    #[must_use]
    pub fn half_bandwidth(&self) -> usize {
        self.stride - 1
    }

    /// Row `i` from the diagonal on: `A[i][i..=i+w]`.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.stride..(i + 1) * self.stride]
    }

    /// Row `i` from the diagonal on, to write.
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.stride..(i + 1) * self.stride]
    }

    /// The element in row `i`, column `j`; zero outside the band.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (low, high) = if i <= j { (i, j) } else { (j, i) };
        if high - low < self.stride { self.row(low)[high - low] } else { 0.0 }
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
        assert!(self.size == other.size && self.stride >= other.stride);
        for i in 0..self.size {
            for (a, b) in self.row_mut(i).iter_mut().zip(other.row(i)) {
                *a += scale * b;
            }
        }
    }

    /// Adds `weight * b b'` for a row vector b whose entries stand from column `first` on.
    ///
    /// # Panics
    /// When b reaches past the band or the matrix.
    #[inline]
    pub fn add_outer(&mut self, first: usize, b: &[f64], weight: f64) {
        for (i, &bi) in b.iter().enumerate() {
            let scaled = weight * bi;
            let row = &mut self.row_mut(first + i)[..b.len() - i];
            for (a, &bj) in row.iter_mut().zip(&b[i..]) {
                *a += scaled * bj;
            }
        }
    }

    /// `b' A b` for a vector b whose entries stand from column `first` on, within the band.
    ///
    /// # Panics
    /// When b reaches past the band or the matrix.
    #[must_use]
    pub fn quadratic_form(&self, first: usize, b: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, &bi) in b.iter().enumerate() {
            let row = &self.row(first + i)[..b.len() - i];
            let beside: f64 = row.iter().zip(&b[i..]).skip(1).map(|(a, bj)| a * bj).sum();
            sum += bi * (row[0] * bi + 2.0 * beside);
        }
        sum
    }

    /// `a' A b` for two vectors that stand on the same columns, from `first` on, within the band.
    ///
    /// # Panics
    /// When the lengths differ, or the vectors reach past the band or the matrix.
    #[must_use]
    pub fn bilinear_form(&self, first: usize, a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        let mut sum = 0.0;
        for i in 0..a.len() {
            let row = &self.row(first + i)[..b.len() - i];
            sum += a[i] * row[0] * b[i];
            for (d, &m) in row.iter().enumerate().skip(1) {
                sum += m * (a[i] * b[i + d] + a[i + d] * b[i]);
            }
        }
        sum
    }

    /// Factors the matrix, or `None` where it is not positive definite to working precision.
    #[must_use]
    pub fn cholesky(mut self) -> Option<Cholesky> {
        let (n, stride) = (self.size, self.stride);
        for j in 0..n {
            let (head, tail) = self.data[j * stride..].split_at_mut(stride);
            let pivot = head[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let root = pivot.sqrt();
            let inverse = 1.0 / root;
            head[0] = root;
            for l in &mut head[1..] {
                *l *= inverse;
            }
            let below = (n - j).min(stride);
            for d in 1..below {
                let l = head[d];
                let row = &mut tail[(d - 1) * stride..][..below - d];
                for (a, &m) in row.iter_mut().zip(&head[d..below]) {
                    *a -= l * m;
                }
            }
        }
        Some(Cholesky { factor: self })
    }
}

impl Cholesky {
    /// The natural logarithm of the determinant of A.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        // The logarithm of a product of many pivots costs one call where the product can't overflow.
        let mut sum = 0.0;
        let mut product = 1.0_f64;
        for j in 0..self.factor.size {
            product *= self.factor.row(j)[0];
            if !(1e-100..1e100).contains(&product) {
                sum += product.ln();
                product = 1.0;
            }
        }
        2.0 * (sum + product.ln())
    }

    /// Overwrites the right sides b (n rows, R columns) by `L^-1 b`.
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
            for (l, row) in column[1..].iter().zip(tail) {
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
            for (l, row) in column[1..].iter().zip(&*tail) {
                for r in 0..R {
                    head[0][r] -= l * row[r];
                }
            }
            for x in &mut head[0] {
                *x /= column[0];
            }
        }
    }

    /// The elements of `A^-1` inside the band of A.
    #[must_use]
    pub fn selected_inverse(&self) -> Banded {
        let (n, stride) = (self.factor.size, self.factor.stride);
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
        for (n, w) in [(1, 0), (3, 5), (40, 1), (57, 11)] {
            let (a, dense) = example(n, w);
            let cholesky = a.clone().cholesky().expect("dominant");
            let inverse = dense.clone().try_inverse().expect("regular");
            assert!((cholesky.log_determinant() - dense.determinant().ln()).abs() < 1e-10);
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
        let (first, x, y) = (5, [1.0, -2.0, 0.5, 3.0], [0.3, 0.0, -1.0, 2.0]);
        let embed =
            |v: &[f64]| DMatrix::from_fn(20, 1, |i, _| if (5..9).contains(&i) { v[i - 5] } else { 0.0 });
        let expected = (embed(&x).transpose() * &dense * embed(&y))[(0, 0)];
        assert!((a.bilinear_form(first, &x, &y) - expected).abs() < 1e-12);
        let expected = (embed(&x).transpose() * &dense * embed(&x))[(0, 0)];
        assert!((a.quadratic_form(first, &x) - expected).abs() < 1e-12);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let mut a = Banded::zeros(3, 1);
        assert!(a.clone().cholesky().is_none());
        for (i, row) in [[1.0, 2.0], [1.0, 0.0], [1.0, 0.0]].iter().enumerate() {
            a.row_mut(i).copy_from_slice(row);
        }
        assert!(a.clone().cholesky().is_none());
        a.row_mut(0)[0] = f64::NAN;
        assert!(a.cholesky().is_none());
    }
}
