//! The normal equations of spline and unknowns: their sum over all samples.

use super::knots::Knots;
use super::model::{COLUMNS, Motion, Reference};
use crate::math::banded::Banded;
use crate::math::gaussian_basis::Active;
use crate::math::simd::{Kernel, vectorised};
use crate::sample::{Quantity, Sample};

/// Functions that are not zero at one instant, for Gaussians of width 1.
const ACTIVE: usize = 12;

/// One quantity of one source, with the weights that its samples have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighted<'a> {
    /// Index of the source.
    pub(super) source: usize,
    /// The block of columns that its rows add to: a source's own, or any other's for the datum, whose columns are
    /// zero but for the value.
    pub(super) block: usize,
    pub(super) quantity: Quantity,
    pub(super) samples: &'a [Sample],
    /// What 1/sigma^2 is multiplied by, one a sample.
    pub(super) weights: &'a [f64],
}

/// The normal equations, axis by axis:
///
/// ```text
/// | A_a   B_a |       A_a = sum w b b'  (banded),   B_a = sum w b d',   D_a = sum w d d'
/// | B_a'  D_a |       b: spline functions times gain,   d: columns of unknowns, and the value
/// ```
#[derive(Clone, Debug)]
pub(super) struct Normal {
    /// A by axis; a single one where the axes' weights agree.
    grams: Vec<Banded>,
    /// B by axis and block.
    pub(super) border: [Vec<Vec<[f64; COLUMNS]>>; 3],
    /// D by axis and block: rows of two sources have no unknowns in common.
    pub(super) corner: [Vec<[[f64; COLUMNS]; COLUMNS]>; 3],
    /// Sum of the logarithms of all rows' weights, 1/sigma^2 included, over the axes.
    pub(super) log_weights: f64,
    /// Number of rows, over the axes.
    pub(super) rows: usize,
}

impl Normal {
    /// A of one axis.
    pub(super) fn gram(&self, axis: usize) -> &Banded {
        &self.grams[axis.min(self.grams.len() - 1)]
    }

    /// Adds up the rows of all `series` on `knots`, linear about the sources' `references` and the curve of
    /// these `coefficients`. No unknown acts while there is no curve.
    pub(super) fn of(
        knots: &Knots,
        series: &[Weighted<'_>],
        references: &[Reference],
        coefficients: &[[f64; 3]],
    ) -> Self {
        vectorised(Assembly { knots, series, references, coefficients })
    }
}

/// The curve's motion, its position about `centre`, from coefficients of the functions `active`.
#[inline(always)]
pub(super) fn motion(coefficients: &[[f64; 3]], active: &Active, centre: [f64; 3]) -> Motion {
    let mut motion = [centre, [0.0; 3], [0.0; 3]];
    let (value, slope, curvature) = (active.value(), active.slope(), active.curvature());
    for (i, c) in coefficients[active.first..].iter().take(value.len()).enumerate() {
        for axis in 0..3 {
            motion[0][axis] += value[i] * c[axis];
            motion[1][axis] += slope[i] * c[axis];
            motion[2][axis] += curvature[i] * c[axis];
        }
    }
    motion
}

struct Assembly<'a> {
    knots: &'a Knots,
    series: &'a [Weighted<'a>],
    references: &'a [Reference],
    coefficients: &'a [[f64; 3]],
}

impl Kernel for Assembly<'_> {
    type Output = Normal;

    #[inline(always)]
    fn run(self) -> Normal {
        let Self { knots, series, references, coefficients } = self;
        let isotropic = |s: &Sample| s.sigma[0] == s.sigma[1] && s.sigma[0] == s.sigma[2];
        let agree = series.iter().all(|s| s.samples.iter().all(isotropic));
        let n = knots.count();
        let blocks = series.iter().map(|s| s.block + 1).max().unwrap_or(0);
        let mut normal = Normal {
            grams: vec![Banded::zeros(n, knots.half_bandwidth()); if agree { 1 } else { 3 }],
            border: std::array::from_fn(|_| vec![vec![[0.0; COLUMNS]; n]; blocks]),
            corner: std::array::from_fn(|_| vec![[[0.0; COLUMNS]; COLUMNS]; blocks]),
            log_weights: 0.0,
            rows: 0,
        };
        let mut active = Active::default();
        let mut patch = Patch::new();
        for part in series {
            let reference = &references[part.source];
            for (sample, &weight) in part.samples.iter().zip(part.weights) {
                knots.evaluate(reference.time_s(sample.time_s), &mut active);
                if active.first != patch.first {
                    patch.flush(&mut normal, part.block);
                    patch.first = active.first;
                }
                let motion = motion(coefficients, &active, reference.centre);
                let row = reference.row(part.quantity, sample, &motion);
                let [value, slope] = active.padded::<ACTIVE>();
                let mut b = if part.quantity == Quantity::Position { *value } else { *slope };
                b.iter_mut().for_each(|b| *b *= row.gain);
                let weights = reference.sigma(sample).map(|s| weight / (s * s));
                patch.add(&b, &row.columns, weights, agree);
                for axis in 0..3 {
                    add_product(&mut normal.corner[axis][part.block], &row.columns[axis], weights[axis]);
                    normal.log_weights += weights[axis].ln();
                }
                normal.rows += 3;
            }
            patch.flush(&mut normal, part.block);
        }
        normal
    }
}

#[inline(always)]
fn add_product(to: &mut [[f64; COLUMNS]; COLUMNS], d: &[f64; COLUMNS], weight: f64) {
    for i in 0..COLUMNS {
        let scaled = weight * d[i];
        for j in 0..COLUMNS {
            to[i][j] += scaled * d[j];
        }
    }
}

/// The part of the equations that successive samples on the same functions add to.
struct Patch {
    first: usize,
    grams: [[[f64; ACTIVE]; ACTIVE]; 3],
    border: [[[f64; COLUMNS]; ACTIVE]; 3],
}

impl Patch {
    fn new() -> Self {
        Self { first: 0, grams: [[[0.0; ACTIVE]; ACTIVE]; 3], border: [[[0.0; COLUMNS]; ACTIVE]; 3] }
    }

    #[inline(always)]
    fn add(&mut self, b: &[f64; ACTIVE], columns: &[[f64; COLUMNS]; 3], weights: [f64; 3], agree: bool) {
        for axis in 0..3 {
            let scaled = b.map(|b| b * weights[axis]);
            if axis == 0 || !agree {
                for i in 0..ACTIVE {
                    for j in 0..ACTIVE {
                        self.grams[axis][i][j] += scaled[i] * b[j];
                    }
                }
            }
            for i in 0..ACTIVE {
                for j in 0..COLUMNS {
                    self.border[axis][i][j] += scaled[i] * columns[axis][j];
                }
            }
        }
    }

    fn flush(&mut self, normal: &mut Normal, block: usize) {
        for (gram, patch) in normal.grams.iter_mut().zip(&mut self.grams) {
            gram.add_block(self.first, patch);
            patch.as_flattened_mut().fill(0.0);
        }
        for (border, patch) in normal.border.iter_mut().zip(&mut self.border) {
            let rows = border[block].iter_mut().skip(self.first);
            for (to, from) in rows.zip(patch.iter()) {
                (0..COLUMNS).for_each(|j| to[j] += from[j]);
            }
            patch.as_flattened_mut().fill(0.0);
        }
    }
}
