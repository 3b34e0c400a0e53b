//! PCF as Zhang 2025 prints it: powers of raw time, and the inverse of the normal matrix.

use nalgebra::DMatrix;
use trackfuse::math::chebyshev;
use trackfuse::sample::Source;

use super::trial::{FRAMES, Z, time_s};

/// The coefficients C = (T'T)^-1 T'S of eq. 6 on Z, the constant first; time in s since the start.
pub(crate) fn fit(fused: &Source, order: usize) -> Vec<f64> {
    let n = order + 1;
    let mut normal = vec![vec![0.0; 2 * n]; n];
    let mut right = vec![0.0; n];
    let rows = fused.positions.iter().map(|s| (powers(s.time_s, n), s.value[Z])).chain(
        fused.velocities.iter().map(|s| (slopes(s.time_s, n), s.value[Z])), // (5)
    );
    for (row, value) in rows {
        for i in 0..n {
            for j in 0..n {
                normal[i][j] += row[i] * row[j];
            }
            right[i] += row[i] * value;
        }
    }
    (0..n).for_each(|i| normal[i][n + i] = 1.0);
    invert(&mut normal);
    (0..n).map(|i| (0..n).map(|j| normal[i][n + j] * right[j]).sum()).collect() // (6)
}

/// Value and derivative of a polynomial, the constant first.
pub(crate) fn at(coefficients: &[f64], t: f64) -> (f64, f64) {
    let combine = |row: &[f64]| row.iter().zip(coefficients).map(|(b, c)| b * c).sum();
    (combine(&powers(t, coefficients.len())), combine(&slopes(t, coefficients.len())))
}

/// 1, t, t^2, ...
fn powers(t: f64, n: usize) -> Vec<f64> {
    std::iter::successors(Some(1.0), |p| Some(p * t)).take(n).collect()
}

/// 0, 1, 2 t, ...
fn slopes(t: f64, n: usize) -> Vec<f64> {
    std::iter::once(0.0).chain(powers(t, n - 1).into_iter().zip(1..).map(|(p, k)| f64::from(k) * p)).collect()
}

/// [A | I] to [I | A^-1] by Gauss and Jordan's elimination with row pivots.
fn invert(rows: &mut [Vec<f64>]) {
    for c in 0..rows.len() {
        let larger = |&i: &usize, &j: &usize| rows[i][c].abs().total_cmp(&rows[j][c].abs());
        let pivot = (c..rows.len()).max_by(larger).unwrap_or(c);
        rows.swap(c, pivot);
        let scale = rows[c][c].recip();
        rows[c].iter_mut().for_each(|x| *x *= scale);
        let pivot_row = rows[c].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != c) {
            let factor = row[c];
            row.iter_mut().zip(&pivot_row).for_each(|(x, p)| *x -= factor * p);
        }
    }
}

/// Condition numbers of the matrix T of eq. 4-5 on all frames.
pub(crate) struct Conditions {
    /// In powers of time in s.
    pub(crate) raw: f64,
    /// In Chebyshev polynomials of time scaled to [-1, 1].
    pub(crate) chebyshev: f64,
}

/// Conditions far beyond 1e16 too: with M the powers' coefficients of the Chebyshev polynomials,
/// `T_raw = T_cheb M^-1`, so that `|T_raw^+| = |M T_cheb^+|`, where nothing is inverted that is near singular.
pub(crate) fn conditions(order: usize) -> Conditions {
    let n = order + 1;
    let half_s = 0.5 * time_s(FRAMES - 1);
    let stacked = |row: &dyn Fn(f64) -> [Vec<f64>; 2]| {
        let rows: Vec<[Vec<f64>; 2]> = (0..FRAMES).map(|i| row(time_s(i))).collect();
        DMatrix::from_fn(2 * FRAMES, n, |i, j| rows[i / 2][i % 2][j])
    };
    let raw = stacked(&|t| [powers(t, n), slopes(t, n)]);
    let sound = stacked(&|t| {
        let (mut value, mut slope, mut curvature) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        chebyshev::evaluate(t / half_s - 1.0, &mut value, &mut slope, &mut curvature);
        [value, slope.iter().map(|d| d / half_s).collect()]
    });
    let singular = sound.clone().singular_values();
    let inverse = sound.pseudo_inverse(0.0).unwrap_or_else(|_| DMatrix::zeros(n, 2 * FRAMES));
    let raw_inverse = chebyshev_in_powers(n, half_s) * inverse;
    Conditions {
        raw: raw.singular_values().max() * raw_inverse.singular_values().max(),
        chebyshev: singular.max() / singular.min(),
    }
}

/// Column k: the coefficients of `T_k(t / half - 1)` in powers of t.
fn chebyshev_in_powers(n: usize, half_s: f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(n, n);
    matrix[(0, 0)] = 1.0;
    for k in 1..n {
        let factor = if k == 1 { 1.0 } else { 2.0 };
        for i in 0..=k {
            let raised = if i > 0 { matrix[(i - 1, k - 1)] / half_s } else { 0.0 };
            let before = if k > 1 { matrix[(i, k - 2)] } else { 0.0 };
            matrix[(i, k)] = factor * (raised - matrix[(i, k - 1)]) - before;
        }
    }
    matrix
}
