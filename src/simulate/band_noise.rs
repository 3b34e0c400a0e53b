//! Band-limited random accelerations: sums of sinusoids with random phases.
//!
//! With N components whose frequencies are drawn one from each of N equal slices of the band,
//!
//! ```text
//! n(t) = rms sqrt(2/N) sum_k cos(2 pi f_k t + phi_k),   phi_k ~ U(0, 2 pi)
//! ```
//!
//! is smooth, has the given rms on the long run, nothing outside of the band, and is a function of time
//! alone. It is nearly Gaussian, as each value is a sum of N terms of the same size.
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | f_k | frequency of a component | N | Hz |
//! | phi_k | phase of a component | N | rad |

use std::f64::consts::TAU;

use rand::{Rng, RngExt};

/// Components per axis: the least number whose sum looks Gaussian; a guess, twice as many change nothing
/// visible.
const COMPONENTS: usize = 16;

/// One axis of a band-limited random signal, in the unit of its rms.
#[derive(Clone, Debug)]
pub(super) struct BandNoise {
    amplitude: f64,
    /// `(f_k, phi_k)` in Hz and rad.
    components: [(f64, f64); COMPONENTS],
}

impl BandNoise {
    /// Draws a signal of the given rms whose frequencies lie in `low_hz..high_hz`.
    pub(super) fn draw(rng: &mut impl Rng, rms: f64, low_hz: f64, high_hz: f64) -> Self {
        let slice = (high_hz - low_hz) / COMPONENTS as f64;
        let components = std::array::from_fn(|k| {
            let frequency = low_hz + slice * (k as f64 + rng.random::<f64>());
            (frequency, TAU * rng.random::<f64>())
        });
        Self { amplitude: rms * (2.0 / COMPONENTS as f64).sqrt(), components }
    }

    /// The signal at `start_s + i * step_s` for `i` in `0..count`.
    ///
    /// Each component turns by a constant angle a step, so no sine is evaluated in the loop; over 1e5 steps
    /// the rounding errors stay below 1e-10 of the amplitude.
    pub(super) fn table(&self, start_s: f64, step_s: f64, count: usize) -> Vec<f64> {
        let angles = self.components.map(|(frequency, phase)| TAU * frequency * start_s + phase);
        let turns = self.components.map(|(frequency, _)| TAU * frequency * step_s);
        let (mut cos, mut sin) = (angles.map(f64::cos), angles.map(f64::sin));
        let (turn_cos, turn_sin) = (turns.map(f64::cos), turns.map(f64::sin));
        let mut next = || {
            let sum = cos.iter().sum::<f64>();
            for k in 0..COMPONENTS {
                (cos[k], sin[k]) = (
                    cos[k] * turn_cos[k] - sin[k] * turn_sin[k],
                    sin[k] * turn_cos[k] + cos[k] * turn_sin[k],
                );
            }
            self.amplitude * sum
        };
        (0..count).map(|_| next()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_long_run_rms_is_the_one_asked_for() {
        let noise = BandNoise::draw(&mut ChaCha8Rng::seed_from_u64(1), 0.35, 0.25, 1.3);
        let table = noise.table(0.0, 0.05, 100_000);
        let rms = (table.iter().map(|a| a * a).sum::<f64>() / table.len() as f64).sqrt();
        assert!((rms - 0.35).abs() < 0.005, "rms {rms}");
    }

    #[test]
    fn a_table_that_starts_later_continues_the_same_signal() {
        let noise = BandNoise::draw(&mut ChaCha8Rng::seed_from_u64(2), 1.0, 0.1, 2.0);
        let (early, late) = (noise.table(0.0, 0.01, 2001), noise.table(20.0, 0.01, 1));
        assert!((early[2000] - late[0]).abs() < 1e-10);
    }
}
