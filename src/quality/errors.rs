//! Errors of one quantity over one stretch, and whether the bands knew of them.

use schemars::JsonSchema;
use serde::Serialize;

use super::BAND_SIGMAS;

/// One error: what the estimate says less what the reference says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Deviation {
    pub(super) time_s: f64,
    pub(super) error: [f64; 3],
    /// The estimate's own standard deviation; NaN where it doesn't say.
    pub(super) sigma: [f64; 3],
}

impl Deviation {
    pub(super) fn norm(&self) -> f64 {
        self.error.iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// The errors over their sigmas, where these are known.
    fn normalised(&self) -> impl Iterator<Item = (usize, f64)> {
        let known = |axis: &usize| self.sigma[*axis] > 0.0 && self.sigma[*axis].is_finite();
        (0..3).filter(known).map(|axis| (axis, self.error[axis] / self.sigma[axis]))
    }
}

/// Errors of positions, m, or velocities, m/s, x y z where there are three.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Errors {
    /// Number of instants.
    pub count: usize,
    /// Root mean square of the 3-D error (Zhang 2025, eq. 12, with N the stretch's instants).
    pub rmse: f64,
    /// The same by axis.
    pub rmse_by_axis: [f64; 3],
    /// Mean by axis: estimate less reference.
    pub mean_by_axis: [f64; 3],
    /// The largest 3-D error.
    pub max: f64,
    /// Whether the estimate knew of them; null where it gives no standard deviations.
    pub bands: Option<Bands>,
}

/// Errors held against the estimate's own standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Bands {
    /// Number of components that have a standard deviation.
    pub count: usize,
    /// Share of the reference's components inside the 95 % bands.
    pub inside: f64,
    /// The same by axis; null where an axis has none.
    pub inside_by_axis: [Option<f64>; 3],
    /// Root mean square of error over standard deviation: 1 where the sigmas are right.
    pub normalised_rmse: f64,
    /// Autocorrelation of error over standard deviation from one instant to the next: near 1, the instants say
    /// the same thing over and over, and one log can't prove the bands.
    pub autocorrelation: Option<f64>,
    /// How long it takes that autocorrelation to fall below 1/e, s; null where it doesn't within the stretch.
    pub correlation_s: Option<f64>,
}

/// Sums up deviations in order of time; `None` of nothing.
pub(super) fn errors(deviations: &[Deviation]) -> Option<Errors> {
    let n = deviations.len() as f64;
    let mean = |f: &dyn Fn(&Deviation) -> f64| deviations.iter().map(f).sum::<f64>() / n;
    (!deviations.is_empty()).then(|| Errors {
        count: deviations.len(),
        rmse: mean(&|d| d.norm().powi(2)).sqrt(), // (12)
        rmse_by_axis: [0, 1, 2].map(|axis| mean(&|d| d.error[axis].powi(2)).sqrt()),
        mean_by_axis: [0, 1, 2].map(|axis| mean(&|d| d.error[axis])),
        max: deviations.iter().map(Deviation::norm).fold(0.0, f64::max),
        bands: bands(deviations),
    })
}

fn bands(deviations: &[Deviation]) -> Option<Bands> {
    let (mut count, mut inside, mut squares) = ([0_usize; 3], [0_usize; 3], 0.0);
    for (axis, e) in deviations.iter().flat_map(Deviation::normalised) {
        count[axis] += 1;
        inside[axis] += usize::from(e.abs() <= BAND_SIGMAS);
        squares += e * e;
    }
    let total: usize = count.iter().sum();
    (total > 0).then(|| Bands {
        count: total,
        inside: inside.iter().sum::<usize>() as f64 / total as f64,
        inside_by_axis: [0, 1, 2]
            .map(|axis| (count[axis] > 0).then(|| inside[axis] as f64 / count[axis] as f64)),
        normalised_rmse: (squares / total as f64).sqrt(),
        autocorrelation: autocorrelation(deviations, 1),
        correlation_s: correlation_s(deviations),
    })
}

/// Of the normalised errors about zero, since a constant error is correlated too; `None` of too few.
fn autocorrelation(deviations: &[Deviation], lag: usize) -> Option<f64> {
    let (mut product, mut squares, mut count) = (0.0, [0.0; 2], 0_usize);
    for (a, b) in deviations.iter().zip(deviations.get(lag..)?) {
        let mut of_b = [None; 3];
        b.normalised().for_each(|(axis, e)| of_b[axis] = Some(e));
        for (axis, e) in a.normalised() {
            let Some(later) = of_b[axis] else { continue };
            product += e * later;
            squares = [squares[0] + e * e, squares[1] + later * later];
            count += 1;
        }
    }
    let norm = (squares[0] * squares[1]).sqrt();
    (count > 8 && norm > 0.0).then(|| product / norm)
}

/// The first of growing lags at which the autocorrelation is below 1/e, s.
fn correlation_s(deviations: &[Deviation]) -> Option<f64> {
    let span_s = deviations.last()?.time_s - deviations.first()?.time_s;
    let step_s = span_s / (deviations.len() - 1).max(1) as f64;
    let mut lag = 1;
    while 2 * lag < deviations.len() {
        if autocorrelation(deviations, lag)? < (-1.0_f64).exp() {
            return Some(lag as f64 * step_s);
        }
        lag += 1 + lag / 4;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviation(i: usize, error: [f64; 3], sigma: f64) -> Deviation {
        Deviation { time_s: 0.1 * i as f64, error, sigma: [sigma; 3] }
    }

    #[test]
    fn root_mean_square_is_of_the_vector_and_of_each_axis() {
        let found = errors(&[deviation(0, [3.0, 0.0, 4.0], 5.0), deviation(1, [-3.0, 0.0, 4.0], 5.0)])
            .expect("errors");
        assert_eq!((found.rmse, found.rmse_by_axis), (5.0, [3.0, 0.0, 4.0]));
        assert_eq!((found.mean_by_axis, found.max), ([0.0, 0.0, 4.0], 5.0));
        let bands = found.bands.expect("sigmas are known");
        assert_eq!((bands.count, bands.inside), (6, 1.0));
        assert!((bands.normalised_rmse - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn an_estimate_without_sigmas_has_no_bands_to_judge() {
        assert_eq!(errors(&[deviation(0, [1.0; 3], f64::NAN)]).expect("errors").bands, None);
        assert_eq!(errors(&[]), None);
    }

    #[test]
    fn a_constant_error_is_correlated_and_an_alternating_one_is_not() {
        let constant: Vec<_> = (0..40).map(|i| deviation(i, [1.0; 3], 1.0)).collect();
        let bands = errors(&constant).and_then(|e| e.bands).expect("bands");
        assert_eq!((bands.autocorrelation, bands.correlation_s), (Some(1.0), None));
        let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let alternating: Vec<_> = (0..40).map(|i| deviation(i, [sign(i); 3], 1.0)).collect();
        let bands = errors(&alternating).and_then(|e| e.bands).expect("bands");
        assert_eq!(bands.autocorrelation, Some(-1.0));
        assert!((bands.correlation_s.expect("at once") - 0.1).abs() < 1e-12);
    }
}
