//! Samples as they would be without the errors of their source: the model solved for the track.

use super::model::turned;
use super::{Anchor, Registered, SourceErrors};
use crate::sample::{Quantity, Sample, Source};

impl Registered {
    /// The sources with their errors taken off, without rejected samples and mirrored axes, their sigmas as the noise was
    /// found to be.
    ///
    /// `sources` are those that were registered.
    #[must_use]
    pub fn corrected(&self, sources: &[Source]) -> Vec<Source> {
        let mut rejected = self.rejected.iter().peekable();
        let mut corrected = Vec::with_capacity(sources.len());
        for (s, source) in sources.iter().enumerate() {
            let mut kept = Source { name: source.name.clone(), ..Source::default() };
            if self.mirrored[s].is_some() {
                corrected.push(kept);
                continue;
            }
            for quantity in Quantity::ALL {
                let scale = self.noise[s][quantity as usize].scale;
                for (index, sample) in source.series(quantity).iter().enumerate() {
                    // they stand in this very order
                    let this = |r: &&super::Rejected| (r.source, r.quantity, r.index) == (s, quantity, index);
                    if rejected.next_if(this).is_none() {
                        let sample = corrected_sample(&self.errors[s], &self.anchors[s], quantity, sample);
                        let sigma = sample.sigma.map(|sigma| scale * sigma);
                        kept.series_mut(quantity).push(Sample { sigma, ..sample });
                    }
                }
            }
            corrected.push(kept);
        }
        corrected
    }
}

fn corrected_sample(errors: &SourceErrors, anchor: &Anchor, quantity: Quantity, sample: &Sample) -> Sample {
    let time_s = sample.time_s - errors.clock_offset_s;
    let gain = 1.0 + errors.scale;
    let (origin, error) = match quantity {
        Quantity::Position => {
            let since = time_s - anchor.time_s;
            (anchor.point_m, [0, 1, 2].map(|i| errors.bias_m[i] + errors.drift_m_s[i] * since))
        }
        Quantity::Velocity => {
            ([0.0; 3], [0, 1, 2].map(|i| errors.drift_m_s[i] + errors.velocity_bias_m_s[i]))
        }
    };
    let back = turned([0, 1, 2].map(|i| sample.value[i] - origin[i]), -errors.rotation_rad);
    let value = [0, 1, 2].map(|i| origin[i] + (back[i] - error[i]) / gain);
    let [x, y, z] = sample.sigma.map(|sigma| sigma / gain);
    let level = (0.5 * (x * x + y * y)).sqrt();
    let sigma = if errors.rotation_rad == 0.0 { [x, y, z] } else { [level, level, z] };
    Sample { time_s, value, sigma }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_model_adds_is_taken_off_again() {
        let errors = SourceErrors {
            bias_m: [2.0, -1.0, 0.5],
            drift_m_s: [0.1, 0.0, -0.2],
            velocity_bias_m_s: [0.3, 0.1, 0.0],
            clock_offset_s: 0.05,
            scale: 0.01,
            rotation_rad: 2.0,
        };
        let anchor = Anchor { time_s: 4.0, point_m: [10.0, 20.0, -30.0] };
        let (t, p, v) = (6.0, [15.0, 18.0, -10.0], [1.0, -0.5, 9.0]);
        let u = [0, 1, 2].map(|i| p[i] - anchor.point_m[i]);
        let moved = [0, 1, 2]
            .map(|i| (1.0 + errors.scale) * u[i] + errors.bias_m[i] + errors.drift_m_s[i] * (t - 4.0));
        let turned_position = turned(moved, errors.rotation_rad);
        let position = [0, 1, 2].map(|i| anchor.point_m[i] + turned_position[i]);
        let velocity = turned(
            [0, 1, 2]
                .map(|i| (1.0 + errors.scale) * v[i] + errors.drift_m_s[i] + errors.velocity_bias_m_s[i]),
            errors.rotation_rad,
        );
        for (quantity, value, truth) in [(Quantity::Position, position, p), (Quantity::Velocity, velocity, v)]
        {
            let sample = Sample { time_s: t + errors.clock_offset_s, value, sigma: [0.1; 3] };
            let found = corrected_sample(&errors, &anchor, quantity, &sample);
            assert!((found.time_s - t).abs() < 1e-12);
            assert!((0..3).all(|i| (found.value[i] - truth[i]).abs() < 1e-12), "{quantity:?}: {found:?}");
        }
    }
}
