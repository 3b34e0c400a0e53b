//! The elimination behind every banded factor, in fixed lengths that become vector instructions.

use super::banded::Banded;
use super::simd::Kernel;

/// Lengths of a banded matrix' row, multiples of four.
pub(super) const THIN: usize = 4;
pub(super) const NARROW: usize = 12;
pub(super) const WIDE: usize = 20;

/// A row in groups of four.
#[inline(always)]
fn fours<const B: usize>(row: &mut [f64; B]) -> &mut [[f64; 4]] {
    const { assert!(B.is_multiple_of(4)) };
    row.as_chunks_mut::<4>().0
}

/// A vector of at most [`WIDE`] numbers with zeros behind it, so that a loop over a part of it can have a fixed
/// length.
#[inline(always)]
pub(super) fn padded(v: &[f64]) -> [f64; 2 * WIDE] {
    let mut long = [0.0; 2 * WIDE];
    for (to, from) in long.iter_mut().zip(v) {
        *to = *from;
    }
    long
}

/// Gaussian elimination of a symmetric banded matrix with R right sides, in a window that stays in cache.
pub(super) struct Elimination<'a, const B: usize, const R: usize, E> {
    /// The matrix, its upper half by rows.
    pub(super) rows: &'a [[f64; B]],
    /// A matrix, of no wider a band, that is added to it, and its factor.
    pub(super) added: Option<(f64, &'a Banded)>,
    /// The right sides.
    pub(super) right: &'a [[f64; R]],
    /// Receives j, column j of L from the diagonal down, and row j of `L^-1 b`.
    pub(super) emit: E,
}

impl<const B: usize, const R: usize, E: FnMut(usize, &[f64; B], &[f64; R])> Elimination<'_, B, R, E> {
    /// Row j of the matrix and of the right sides; zeros behind the last.
    #[inline(always)]
    fn load(&self, j: usize) -> ([f64; B], [f64; R]) {
        let (Some(&row), Some(&right)) = (self.rows.get(j), self.right.get(j)) else {
            return ([0.0; B], [0.0; R]);
        };
        let mut row = row;
        if let Some((scale, added)) = self.added {
            for (a, o) in row.iter_mut().zip(added.row(j)) {
                *a += scale * o;
            }
        }
        (row, right)
    }
}

impl<const B: usize, const R: usize, E: FnMut(usize, &[f64; B], &[f64; R])> Kernel
    for Elimination<'_, B, R, E>
{
    /// `None` at the first pivot that is not positive.
    type Output = Option<()>;

    #[inline(always)]
    fn run(mut self) -> Option<()> {
        let n = self.rows.len();
        // B columns at a time: rows 0..B of the window are eliminated, rows B..2B receive what spills over
        let mut window = vec![[0.0; B]; 2 * B];
        let mut right = vec![[0.0; R]; 2 * B];
        for i in 0..B {
            (window[i], right[i]) = self.load(i);
        }
        for start in (0..n).step_by(B) {
            for i in 0..B {
                (window[B + i], right[B + i]) = self.load(start + B + i);
            }
            for i in 0..B.min(n - start) {
                let (head, below) = window[i..].split_at_mut(1);
                let column = &mut head[0];
                let pivot = column[0];
                if !(pivot > 0.0 && pivot.is_finite()) {
                    return None;
                }
                let root = pivot.sqrt();
                let inverse = 1.0 / root;
                for l in column.iter_mut() {
                    *l *= inverse;
                }
                column[0] = root;
                let (head, right_below) = right[i..].split_at_mut(1);
                let half = &mut head[0];
                half.iter_mut().for_each(|x| *x *= inverse);
                let long = padded(column);
                for (d, (row, right)) in (1..B).zip(below.iter_mut().zip(right_below)) {
                    // the B - d numbers that are left, rounded up to fours: what is too much is zero
                    for (four, beside) in
                        fours(row).iter_mut().zip(long[d..].as_chunks::<4>().0).take((B - d).div_ceil(4))
                    {
                        for k in 0..4 {
                            four[k] -= column[d] * beside[k];
                        }
                    }
                    for r in 0..R {
                        right[r] -= column[d] * half[r];
                    }
                }
                (self.emit)(start + i, column, half);
            }
            window.copy_within(B.., 0);
            right.copy_within(B.., 0);
        }
        Some(())
    }
}
