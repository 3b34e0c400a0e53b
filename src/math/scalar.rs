//! One-dimensional minimisation.

/// Where a one-dimensional search ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum {
    /// The argument.
    pub x: f64,
    /// The function's value there.
    pub value: f64,
}

/// The minimum of `f` on `[low, high]`, to within `tolerance` of its argument.
///
/// A grid of `cells` intervals finds the right valley, Brent's parabolic steps (Brent 1973, ch. 5) its
/// bottom. A value of `f` that is not finite counts as infinite. About `cells + 6` evaluations.
pub fn minimise(low: f64, high: f64, cells: usize, tolerance: f64, mut f: impl FnMut(f64) -> f64) -> Minimum {
    let mut f = move |x: f64| Some(f(x)).filter(|v| v.is_finite()).unwrap_or(f64::INFINITY);
    let step = (high - low) / cells as f64;
    let grid: Vec<f64> = (0..=cells).map(|i| f(low + step * i as f64)).collect();
    let best = (0..=cells).min_by(|&i, &j| grid[i].total_cmp(&grid[j])).unwrap_or(0);
    let centre = low + step * best as f64;
    let (a, b) = ((centre - step).max(low), (centre + step).min(high));
    let (x, value) = brent(a, b, centre, grid[best], tolerance, f);
    Minimum { x, value }
}

/// Brent's minimiser on `[a, b]`, from a first guess `x` of value `fx`.
fn brent(
    mut a: f64,
    mut b: f64,
    mut x: f64,
    mut fx: f64,
    tolerance: f64,
    mut f: impl FnMut(f64) -> f64,
) -> (f64, f64) {
    const GOLDEN: f64 = 0.381_966_011_250_105;
    let (mut w, mut v, mut fw, mut fv) = (x, x, fx, fx);
    let (mut step, mut before_last) = (0.0_f64, 0.0_f64);
    for _ in 0..60 {
        let middle = a.midpoint(b);
        if (x - middle).abs() <= 2.0 * tolerance - 0.5 * (b - a) {
            break;
        }
        // a parabola through x, w and v, taken when it falls inside and shrinks fast enough
        let r = (x - w) * (fx - fv);
        let q = (x - v) * (fx - fw);
        let (p, q) = ((x - v) * q - (x - w) * r, 2.0 * (q - r));
        let (p, q) = if q > 0.0 { (-p, q) } else { (p, -q) };
        let parabolic = p.abs() < (0.5 * q * before_last).abs() && p > q * (a - x) && p < q * (b - x);
        (before_last, step) = if parabolic {
            (step, p / q)
        } else {
            let side = if x < middle { b - x } else { a - x };
            (side, GOLDEN * side)
        };
        let u = x + if step.abs() >= tolerance { step } else { tolerance.copysign(step) };
        let fu = f(u);
        if fu <= fx {
            if u < x {
                b = x;
            } else {
                a = x;
            }
            (v, fv, w, fw, x, fx) = (w, fw, x, fx, u, fu);
        } else {
            if u < x {
                a = u;
            } else {
                b = u;
            }
            if fu <= fw || w.total_cmp(&x).is_eq() {
                (v, fv, w, fw) = (w, fw, u, fu);
            } else if fu <= fv || v.total_cmp(&x).is_eq() || v.total_cmp(&w).is_eq() {
                (v, fv) = (u, fu);
            }
        }
    }
    (x, fx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_deeper_of_two_valleys() {
        let f = |x: f64| (x * x - 4.0).powi(2) + x;
        let found = minimise(-5.0, 5.0, 10, 1e-6, f);
        assert!((4.0 * found.x.powi(3) - 16.0 * found.x + 1.0).abs() < 1e-4, "{found:?}"); // f' = 0
        assert!(found.x < 0.0);
    }

    #[test]
    fn a_minimum_at_the_end_is_found() {
        let found = minimise(0.0, 1.0, 4, 1e-3, |x| x);
        assert!(found.x < 3e-3, "{found:?}");
    }

    #[test]
    fn values_that_are_not_numbers_are_avoided() {
        let found = minimise(-1.0, 2.0, 6, 1e-4, |x| if x < 0.2 { f64::NAN } else { (x - 1.0).powi(2) });
        assert!((found.x - 1.0).abs() < 1e-3, "{found:?}");
    }
}
