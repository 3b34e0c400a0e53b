//! The weight of the jerk penalty by axis, by restricted maximum likelihood.
//!
//! -2 log L(lambda) = log|A + lambda Q| - rank(Q) log lambda + log|S + P| + z'Wz - fitted, everything of one axis
//! with its own border: the unknowns that the axes share are taken as each axis' own, which the search forgives
//! (Wood 2011, J. R. Stat. Soc. B 73, 3, has the joint form).

use nalgebra::{DMatrix, DVector};

use super::bordered::{Layout, complement, factor};
use super::knots::Penalty;
use super::model::{COLUMNS, VALUE};
use super::normal::Normal;
use super::unknowns::{Kind, OF_AN_AXIS, index};
use crate::math::scalar;

/// Decades about the ratio of the traces: beyond, the penalty would leave too few digits to the data.
const LARGEST: f64 = 8.0;

/// The lambda of greatest restricted likelihood on `axis`, with unknowns of these prior `variances` (one an
/// acting unknown); looked for `about` one, to within so many
/// decades, or everywhere.
pub(super) fn likeliest_lambda(
    normal: &Normal,
    penalty: &Penalty,
    layout: &Layout,
    variances: &[f64],
    axis: usize,
    about: Option<(f64, f64)>,
) -> f64 {
    let unit = normal.gram(axis).trace() / penalty.matrix.trace();
    let own = own_unknowns(layout, variances, axis);
    let (low, high, cells) = match about {
        Some((last, decades)) => {
            let middle = (last / unit).log10();
            (f64::max(middle - decades, -LARGEST), f64::min(middle + decades, LARGEST), 2)
        }
        None => (-LARGEST, LARGEST, 8),
    };
    let found = scalar::minimise(low, high, cells, 0.05, |exponent| {
        let lambda = unit * 10.0_f64.powf(exponent);
        deviance(normal, penalty, &own, axis, lambda).unwrap_or(f64::INFINITY)
    });
    unit * 10.0_f64.powf(found.x)
}

/// Block, column and prior sigma of each unknown that acts on `axis`.
fn own_unknowns(layout: &Layout, variances: &[f64], axis: usize) -> Vec<(usize, usize, f64)> {
    let mut own = Vec::new();
    for slot in 0..layout.slots.len() {
        for column in 0..OF_AN_AXIS {
            let wanted = index(slot, Kind::ALL[column], axis);
            if let Ok(place) = layout.active.binary_search(&wanted) {
                own.push((slot, column, variances[place].sqrt()));
            }
        }
    }
    own
}

fn deviance(
    normal: &Normal,
    penalty: &Penalty,
    own: &[(usize, usize, f64)],
    axis: usize,
    lambda: f64,
) -> Option<f64> {
    let cholesky = factor(normal.gram(axis), &penalty.matrix, lambda)?;
    let halves: Vec<Vec<[f64; COLUMNS]>> = normal.border[axis]
        .iter()
        .map(|border| {
            let mut half = border.clone();
            cholesky.forward(&mut half);
            half
        })
        .collect();
    let count = halves.len();
    let mut blocks = vec![vec![[[0.0; COLUMNS]; COLUMNS]; count]; count];
    for i in 0..count {
        for j in i..count {
            let corner = (i == j).then_some(&normal.corner[axis][i]);
            blocks[i][j] = complement(corner, &halves[i], &halves[j]);
            blocks[j][i] = std::array::from_fn(|a| std::array::from_fn(|b| blocks[i][j][b][a]));
        }
    }
    let k = own.len();
    let precision = DMatrix::from_fn(k, k, |i, j| {
        let ((s, a, p), (t, b, q)) = (own[i], own[j]);
        blocks[s][t][a][b] * p * q + f64::from(u8::from(i == j))
    });
    let score = DVector::from_fn(k, |i, _| {
        let (s, a, p) = own[i];
        p * (0..count).map(|t| blocks[s][t][a][VALUE]).sum::<f64>()
    });
    let residual: f64 = blocks.iter().flatten().map(|block| block[VALUE][VALUE]).sum();
    let border = precision.cholesky()?;
    let explained = score.dot(&border.solve(&score));
    let determinant: f64 = border.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
    let spline = cholesky.log_determinant() - penalty.rank as f64 * lambda.ln();
    Some(spline + determinant + residual - explained)
}
