//! How far each sample lies from the track.

use super::phases::norm_squared;
use crate::estimate::coverage::Coverage;
use crate::sample::{Sample, Source};
use crate::time::Time;
use crate::track::Curve;

/// How far one sample lies from the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Sample less track, m or m/s.
    pub vector: [f64; 3],
    /// The same over the sample's standard deviations, root mean square of the three axes.
    pub normalised: f64,
}

/// How far what a source measured at one instant lies from the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// The instant.
    pub time: Time,
    /// Index of the source.
    pub source: usize,
    /// Of its position and of its velocity, where it measured one and the track reaches.
    pub misfits: [Option<Misfit>; 2],
    /// The sources that see this instant: bit i is the i-th.
    pub seen_by: u32,
}

/// The residuals of all samples of the fitted pieces, in order of time and then of sources.
#[must_use]
pub fn residuals(pieces: &[(&[Source], &dyn Curve)], origin: Time, coverage: &Coverage) -> Vec<Residual> {
    let mut residuals = Vec::new();
    for (sources, curve) in pieces {
        for (source, samples) in sources.iter().enumerate() {
            for (position, velocity) in samples.instants() {
                let Some(time_s) = position.or(velocity).map(|s| s.time_s) else { continue };
                let Some(state) = curve.at(time_s) else { continue };
                residuals.push(Residual {
                    time: origin.plus_seconds(time_s),
                    source,
                    misfits: [
                        position.map(|sample| misfit(sample, state.position)),
                        velocity.map(|sample| misfit(sample, state.velocity)),
                    ],
                    seen_by: coverage.seen_by(time_s),
                });
            }
        }
    }
    residuals.sort_by_key(|r| (r.time, r.source));
    residuals
}

fn misfit(sample: &Sample, fitted: [f64; 3]) -> Misfit {
    let vector: [f64; 3] = std::array::from_fn(|i| sample.value[i] - fitted[i]);
    let in_sigmas: [f64; 3] = std::array::from_fn(|i| vector[i] / sample.sigma[i]);
    Misfit { vector, normalised: (norm_squared(in_sigmas) / 3.0).sqrt() }
}
