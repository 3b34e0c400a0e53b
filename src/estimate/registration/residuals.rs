//! What a fit leaves of the samples.

use super::bordered::Posterior;
use super::knots::Knots;
use super::model::Reference;
use super::normal::motion;
use crate::math::gaussian_basis::Active;
use crate::math::simd::{Kernel, vectorised};
use crate::sample::{Quantity, Sample};

/// What rounding leaves of 1 - h.
const SMALLEST_REST: f64 = 1e-6;

/// What the fit left of one series.
#[derive(Clone, Debug, Default)]
pub(super) struct Residuals {
    /// By axis, in stated sigmas.
    pub(super) scaled: Vec<[f64; 3]>,
    /// The fit's variance at each sample by axis, in stated sigmas.
    pub(super) leverage: Vec<[f64; 3]>,
}

impl Residuals {
    /// Their squared lengths.
    pub(super) fn squares(&self) -> impl Iterator<Item = f64> {
        self.scaled.iter().map(|r| r.iter().map(|x| x * x).sum())
    }

    /// The squared length of one of them over its own standard deviation, in a fit that gave its sample `weight` times
    /// the precision of one that is no outlier: e^2 / (1 + V), with e the residual and V the variance of the fit
    /// without this sample, in units of the noise's; with h its share in its own fit, e = r / (1 - h) and
    /// V = (h / weight) / (1 - h).
    pub(super) fn predicted_square(&self, i: usize, weight: f64, precision: f64) -> f64 {
        let own = |axis: usize| {
            let variance = precision * self.leverage[i][axis];
            let rest = (1.0 - weight * variance).max(SMALLEST_REST);
            self.scaled[i][axis].powi(2) / (rest * (rest + variance))
        };
        own(0) + own(1) + own(2)
    }

    /// Those of one series of the source in `slot`, `None` for the datum.
    pub(super) fn of(
        knots: &Knots,
        posterior: &Posterior,
        reference: &Reference,
        slot: Option<usize>,
        quantity: Quantity,
        samples: &[Sample],
    ) -> Self {
        vectorised(ResidualsOf { knots, posterior, reference, slot, quantity, samples })
    }
}

struct ResidualsOf<'a> {
    knots: &'a Knots,
    posterior: &'a Posterior,
    reference: &'a Reference,
    slot: Option<usize>,
    quantity: Quantity,
    samples: &'a [Sample],
}

impl Kernel for ResidualsOf<'_> {
    type Output = Residuals;

    #[inline(always)]
    fn run(self) -> Residuals {
        let Self { knots, posterior, reference, slot, quantity, samples } = self;
        let mut residuals = Residuals::default();
        let mut active = Active::default();
        for sample in samples {
            knots.evaluate(reference.time_s(sample.time_s), &mut active);
            let motion = motion(&posterior.coefficients, &active, reference.centre);
            let left = reference.residual(quantity, sample, &motion);
            let sigma = reference.sigma(sample);
            residuals.scaled.push(std::array::from_fn(|axis| left[axis] / sigma[axis]));
            let row = reference.row(quantity, sample, &motion);
            let b = match quantity {
                Quantity::Position => active.value(),
                Quantity::Velocity => active.slope(),
            };
            let mut leverage = [0.0; 3];
            for axis in 0..3 {
                let own = slot.map(|slot| (slot, &row.columns[axis]));
                let variance = posterior.variance(axis, active.first, b, row.gain, own);
                leverage[axis] = variance / (sigma[axis] * sigma[axis]);
            }
            residuals.leverage.push(leverage);
        }
        residuals
    }
}
