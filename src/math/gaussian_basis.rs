//! The *probability spline* of Zhang 2025, eq. 7: normal densities on equally spaced knots.
//!
//! `B_k(t) = exp(-x^2 / 2 s^2) / (s sqrt(2 pi))`, x = (t - t_k) / h, with h the knot spacing and s the
//! width in knot spacings. Derivatives to t carry 1/h and 1/h^2, which the print doesn't show. The sum
//! of all `B_k` is 1 but for a ripple of 2 exp(-2 pi^2 s^2), 5e-9 at s = 1, so a coefficient is close
//! to the curve's value at its knot.

/// Widths in knot spacings that the basis takes: below, a constant ripples; above, the equations degenerate.
pub const WIDTHS: std::ops::RangeInclusive<f64> = 0.8..=1.5;

/// A function is cut where it has fallen to exp(-18) of its peak: at 6 s.
const SUPPORT_SIGMAS: f64 = 6.0;

/// Most functions that can be non-zero at one instant.
pub const MAX_ACTIVE: usize = 18;

/// Gaussians on equally spaced knots.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianBasis {
    first_knot_s: f64,
    spacing_s: f64,
    count: usize,
    width: f64,
    /// Functions on each side of an instant that are not zero there.
    reach: usize,
    /// `exp(-j^2 / 2 s^2) / (s sqrt(2 pi))` for j = -(reach - 1) ..= reach.
    table: Vec<f64>,
}

/// The functions that are not zero at one instant, with two derivatives to time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Active {
    /// Index of the first of them.
    pub first: usize,
    count: usize,
    value: [f64; MAX_ACTIVE],
    slope: [f64; MAX_ACTIVE],
    curvature: [f64; MAX_ACTIVE],
}

impl Active {
    /// Values and first derivatives, the first N of them (at most [`MAX_ACTIVE`]), zeros behind the last.
    #[must_use]
    #[inline(always)]
    pub fn padded<const N: usize>(&self) -> [&[f64; N]; 2] {
        const { assert!(N <= MAX_ACTIVE) };
        [&self.value, &self.slope].map(|all| all.first_chunk().unwrap_or(&[0.0; N]))
    }

    /// Values of the functions `first ..`.
    #[must_use]
    #[inline(always)]
    pub fn value(&self) -> &[f64] {
        &self.value[..self.count]
    }

    /// Their first derivatives, 1/s.
    #[must_use]
    #[inline(always)]
    pub fn slope(&self) -> &[f64] {
        &self.slope[..self.count]
    }

    /// Their second derivatives, 1/s^2.
    #[must_use]
    #[inline(always)]
    pub fn curvature(&self) -> &[f64] {
        &self.curvature[..self.count]
    }
}

impl GaussianBasis {
    /// Knots `spacing_s` apart over `[from_s, to_s]` and `margin` spacings beyond both ends.
    ///
    /// # Panics
    /// When the width is outside [`WIDTHS`], the spacing is not positive, or the interval is reversed.
    #[must_use]
    pub fn covering(from_s: f64, to_s: f64, spacing_s: f64, margin: usize, width: f64) -> Self {
        assert!(WIDTHS.contains(&width) && spacing_s > 0.0 && to_s >= from_s);
        let reach = (SUPPORT_SIGMAS * width - 1e-9).ceil() as usize;
        let peak = 1.0 / (width * (2.0 * std::f64::consts::PI).sqrt());
        let table = (0..2 * reach)
            .map(|i| {
                let j = i as f64 - (reach as f64 - 1.0);
                peak * (-0.5 * (j / width).powi(2)).exp()
            })
            .collect();
        let inside = ((to_s - from_s) / spacing_s).ceil().max(1.0) as usize;
        let first_knot_s = from_s - margin as f64 * spacing_s;
        Self { first_knot_s, spacing_s, count: inside + 1 + 2 * margin, width, reach, table }
    }

    /// Number of functions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Knot spacing, s.
    #[must_use]
    pub fn spacing_s(&self) -> f64 {
        self.spacing_s
    }

    /// Half-bandwidth of a Gram matrix of these functions.
    #[must_use]
    pub fn half_bandwidth(&self) -> usize {
        2 * self.reach - 1
    }

    /// The functions that are not zero at `t_s`; none outside the knots' reach.
    #[must_use]
    pub fn at(&self, t_s: f64) -> Active {
        let mut active = Active::default();
        self.evaluate(t_s, &mut active);
        active
    }

    /// As [`Self::at`], into what an earlier evaluation left: many of them need not clear and move memory.
    #[inline(always)]
    pub fn evaluate(&self, t_s: f64, active: &mut Active) {
        let before = active.count;
        let u = (t_s - self.first_knot_s) / self.spacing_s;
        let below = u.floor();
        let leading = below as i64 - (self.reach as i64 - 1);
        let skip = usize::try_from(-leading).unwrap_or(0).min(2 * self.reach);
        active.first = usize::try_from(leading).unwrap_or(0).min(self.count);
        active.count = (2 * self.reach - skip).min(self.count - active.first);
        // exp(-(f - j)^2 / 2 s^2) = exp(-f^2 / 2 s^2) exp(f / s^2)^j exp(-j^2 / 2 s^2): two calls of exp
        let f = u - below;
        let per_square = 1.0 / (self.width * self.width);
        let ratio = (f * per_square).exp();
        let start = skip as f64 - (self.reach as f64 - 1.0);
        let mut power = (f * per_square * (start - 0.5 * f)).exp();
        let (per_h, per_h2) = (per_square / self.spacing_s, per_square / self.spacing_s.powi(2));
        let n = active.count;
        let (value, slope, curvature) =
            (&mut active.value[..n], &mut active.slope[..n], &mut active.curvature[..n]);
        for (b, peak) in value.iter_mut().zip(&self.table[skip..]) {
            *b = power * peak;
            power *= ratio;
        }
        for i in 0..n {
            let x = f - start - f64::from(i as i32);
            slope[i] = -x * per_h * value[i];
            curvature[i] = (x * x * per_square - 1.0) * per_h2 * value[i];
        }
        for i in active.count..before {
            (active.value[i], active.slope[i], active.curvature[i]) = (0.0, 0.0, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum_at(basis: &GaussianBasis, t: f64) -> (f64, f64, f64) {
        let a = basis.at(t);
        (a.value().iter().sum(), a.slope().iter().sum(), a.curvature().iter().sum())
    }

    #[test]
    fn each_function_is_the_normal_density_of_equation_7() {
        let basis = GaussianBasis::covering(2.0, 5.0, 0.3, 4, 1.2);
        let t = 3.456;
        let a = basis.at(t);
        for (i, b) in a.value().iter().enumerate() {
            let x = (t - (2.0 - 4.0 * 0.3 + 0.3 * (a.first + i) as f64)) / 0.3;
            let density = (-0.5 * (x / 1.2_f64).powi(2)).exp() / (1.2 * (2.0 * std::f64::consts::PI).sqrt());
            assert!((b - density).abs() < 1e-14);
        }
    }

    #[test]
    fn a_constant_ripples_by_5e_9_at_width_one() {
        let basis = GaussianBasis::covering(0.0, 10.0, 0.5, 6, 1.0);
        for i in 0..200 {
            let (value, _, _) = sum_at(&basis, 0.05 * f64::from(i));
            assert!((value - 1.0).abs() < 2e-8, "{value}");
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let basis = GaussianBasis::covering(0.0, 3.0, 0.1, 4, 1.0);
        let (t, step) = (1.234, 1e-5);
        let (here, before, after) = (basis.at(t), basis.at(t - step), basis.at(t + step));
        for i in 0..here.value().len() {
            let slope = (after.value()[i] - before.value()[i]) / (2.0 * step);
            let curvature = (after.slope()[i] - before.slope()[i]) / (2.0 * step);
            assert!((here.slope()[i] - slope).abs() < 1e-6);
            assert!((here.curvature()[i] - curvature).abs() < 1e-4);
        }
    }

    #[test]
    fn far_from_all_knots_nothing_is_active() {
        let basis = GaussianBasis::covering(0.0, 1.0, 0.1, 4, 1.0);
        for t in [-1e12, -2.0, 3.0, 1e12] {
            assert!(basis.at(t).value().is_empty());
        }
        assert!(!basis.at(-0.3).value().is_empty());
    }
}
