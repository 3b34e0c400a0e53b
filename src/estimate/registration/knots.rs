//! The knots of a track in one or several pieces, as one set of functions.

use std::ops::Range;

use crate::math::banded::Banded;
use crate::math::gaussian_basis::{Active, GaussianBasis};

/// Order of the difference penalty: the third, jerk.
const PENALTY_ORDER: usize = 3;

/// That difference.
pub(super) const JERK: [f64; PENALTY_ORDER + 1] = [-1.0, 3.0, -3.0, 1.0];

/// Knots beyond both ends of a piece: the edge error falls below 1e-6 of the signal.
const MARGIN: usize = 4;

/// Width of a Gaussian in knot spacings: a quintic B-spline gives the same to four digits.
const WIDTH: f64 = 1.0;

/// Gaussian functions over the pieces of a track, those of one piece behind those of the one before.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    pieces: Vec<Piece>,
    count: usize,
}

#[derive(Clone, Debug)]
struct Piece {
    /// Where the next piece takes over, s.
    until_s: f64,
    basis: GaussianBasis,
    offset: usize,
}

impl Knots {
    /// Knots `spacing_s` apart over each of `pieces`, at least one, and over `pad_s` beyond both of its ends.
    pub(super) fn covering(pieces: &[(f64, f64)], spacing_s: f64, pad_s: f64) -> Self {
        let (mut made, mut count) = (Vec::with_capacity(pieces.len()), 0);
        for (i, &(from_s, to_s)) in pieces.iter().enumerate() {
            let basis = GaussianBasis::covering(from_s - pad_s, to_s + pad_s, spacing_s, MARGIN, WIDTH);
            let until_s = pieces.get(i + 1).map_or(f64::INFINITY, |next| to_s.midpoint(next.0));
            made.push(Piece { until_s, offset: count, basis });
            count += made[i].basis.count();
        }
        Self { pieces: made, count }
    }

    /// Number of functions.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Half-bandwidth of a Gram matrix of these functions.
    pub(super) fn half_bandwidth(&self) -> usize {
        self.pieces.first().map_or(0, |p| p.basis.half_bandwidth())
    }

    /// The functions that are not zero at `t_s`, into what an earlier evaluation left.
    #[inline(always)]
    pub(super) fn evaluate(&self, t_s: f64, active: &mut Active) {
        let at = if self.pieces.len() > 1 { self.pieces.partition_point(|p| p.until_s < t_s) } else { 0 };
        if let Some(piece) = self.pieces.get(at) {
            piece.basis.evaluate(t_s, active);
            active.first += piece.offset;
        }
    }

    /// The third differences by their first functions, piece by piece, and the piece's knot spacing, s.
    pub(super) fn differences(&self) -> impl Iterator<Item = (Range<usize>, f64)> {
        self.pieces.iter().map(|piece| {
            let rows = piece.basis.count().saturating_sub(PENALTY_ORDER);
            (piece.offset..piece.offset + rows, piece.basis.spacing_s())
        })
    }

    /// The jerk penalty D3' W D3, piece by piece, W by the differences' first functions.
    pub(super) fn jerk_penalty(&self, weights: &[f64]) -> Penalty {
        let matrix = Banded::zeros(self.count, PENALTY_ORDER);
        let mut penalty = Penalty { matrix, rank: 0, log_weights: 0.0 };
        for row in self.differences().flat_map(|(rows, _)| rows) {
            penalty.matrix.add_outer(row, &JERK, weights[row]);
            penalty.rank += 1;
            penalty.log_weights += weights[row].ln();
        }
        penalty
    }
}

/// The quadratic form of the jerk.
#[derive(Clone, Debug)]
pub(super) struct Penalty {
    pub(super) matrix: Banded,
    pub(super) rank: usize,
    /// The logarithm of its determinant, but for a constant: the sum of the weights'.
    pub(super) log_weights: f64,
}
