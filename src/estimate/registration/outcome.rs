//! What is to be said of a fit that has ended.

use super::curve::RegisteredCurve;
use super::fit::Fit;
use super::separation::{Separation, Unknown, name_of};
use super::unknowns::{Kind, SourceErrors, kind_of};
use super::{REJECTED_WEIGHT, Registered, Rejected};
use crate::sample::Quantity;

impl Fit<'_> {
    /// The outcome, or `None` of a fit that never had a solution.
    pub(super) fn registered(mut self, pieces: &[(f64, f64)]) -> Option<Registered> {
        let posterior = self.posterior.take()?;
        let mut rejected = Vec::new();
        for (source, weights) in self.weights.iter().enumerate() {
            for quantity in Quantity::ALL {
                let (weights, level) = (&weights[quantity as usize], self.levels[source][quantity as usize]);
                if weights.iter().all(|w| *w >= REJECTED_WEIGHT) {
                    continue;
                }
                let residuals = self.residuals(&posterior, source, quantity);
                for (index, weight) in weights.iter().enumerate() {
                    if *weight < REJECTED_WEIGHT {
                        let time_s = self.sources[source].series(quantity)[index].time_s;
                        let q = residuals.predicted_square(index, *weight, level.precision());
                        rejected.push(Rejected {
                            source,
                            quantity,
                            index,
                            time_s,
                            sigmas: q.sqrt() / level.scale,
                        });
                    }
                }
            }
        }
        let mut sigmas = vec![SourceErrors::default(); self.references.len()];
        let mut errors = sigmas.clone();
        let deviations: Vec<f64> =
            (0..self.layout.len()).map(|i| posterior.covariance[(i, i)].max(0.0).sqrt()).collect();
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            sigmas[source] = SourceErrors::of(&deviations, slot);
            errors[source] = SourceErrors::of(&posterior.unknowns, slot);
            let of_frame = self.references[source].frame_bias_m(errors[source].rotation_rad);
            let far_m = of_frame[0].hypot(of_frame[1]);
            for axis in 0..3 {
                errors[source].bias_m[axis] += of_frame[axis];
                let turned_m = if axis < 2 { far_m * sigmas[source].rotation_rad } else { 0.0 };
                sigmas[source].bias_m[axis] = sigmas[source].bias_m[axis].hypot(turned_m);
            }
        }
        let unknown = |(place, &i): (usize, &usize)| {
            let name = name_of(&self.layout, i);
            let found = self.inclusions.iter().find(|g| g.source == name.source && g.kind == name.kind);
            let (is_bias, axis) = (name.kind == Kind::Bias, name.axis.unwrap_or(0));
            let (strongest, separation) =
                self.separations.get(place).copied().unwrap_or((None, Separation::AtPrior));
            Unknown {
                name,
                value: if is_bias { errors[name.source].bias_m[axis] } else { posterior.unknowns[i] },
                sigma: if is_bias { sigmas[name.source].bias_m[axis] } else { deviations[i] },
                prior_sigma: self.settings.priors.of(kind_of(i).0),
                // a turned frame has a zero of its own
                probability: if is_bias && self.frames[name.source].is_some() {
                    1.0
                } else {
                    found.map_or(1.0, |g| g.probability)
                },
                strongest,
                separation,
            }
        };
        Some(Registered {
            unknowns: self.layout.active.iter().enumerate().map(unknown).collect(),
            errors,
            sigmas,
            anchors: self.references.iter().map(|r| r.anchor).collect(),
            noise: self.levels,
            rejected,
            mirrored: Vec::new(),
            knots: self.knots.count(),
            lambda: self.lambda,
            log_evidence: self.log_evidence,
            iterations: self.iterations,
            converged: self.converged,
            curve: RegisteredCurve {
                centre: self.references[0].centre,
                knots: self.knots,
                posterior,
                pieces: pieces.to_vec(),
            },
        })
    }
}
