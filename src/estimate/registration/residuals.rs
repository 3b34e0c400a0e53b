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

    /// The squared length of one of them over its own standard deviation, in a fit that gave its sample so many times
    /// the stated weight: r^2 / (1 - h).
    pub(super) fn predicted_square(&self, i: usize, weight: f64) -> f64 {
        let (left, leverage) = (self.scaled[i], self.leverage[i]);
        (0..3).map(|a| left[a] * left[a] / (1.0 - weight * leverage[a]).max(SMALLEST_REST)).sum()
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
