//! What a sensor makes of the truth.
//!
//! At the true instant t of a sample, with T the middle of the overlap (T1):
//!
//! ```text
//! stamp    = t + tau                                                                                  (1)
//! position = p(t) + b + r (t - T) + c (p(t) - p(T)) + e                                               (2)
//! velocity = (1 + c) v(t) + r + w + f                                                                 (3)
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | tau | clock offset | 1 | s |
//! | b, r | bias at T, and its drift | 3 | m, m/s |
//! | c | scale error | 1 | 1 |
//! | w | velocity bias | 3 | m/s |
//! | e, f | noise, white or AR(1) from sample to sample | 3 | m, m/s |
//!
//! On top come jitter of the sampling, latency of the reception, outliers and dropouts. Each draws from a
//! random stream of its own, so that a change to one leaves the others, and the truth, as they were.

use nalgebra::Vector3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, UnitSphere};

use super::sensor_scenario::{ErrorsScenario, SensorScenario};
use super::trajectory::Trajectory;

/// A sensor's systematic errors, (1) to (3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorErrors {
    /// b, m.
    pub bias_m: Vector3<f64>,
    /// w, m/s.
    pub velocity_bias_m_s: Vector3<f64>,
    /// r, m/s.
    pub drift_m_s: Vector3<f64>,
    /// c, a share.
    pub scale: f64,
    /// tau, s: positive where the stamps are late.
    pub clock_offset_s: f64,
}

impl SensorErrors {
    /// Draws the errors that the scenario leaves open; the fixed ones cost the same draws, and change no
    /// other.
    #[must_use]
    pub fn draw(scenario: &ErrorsScenario, rng: &mut impl Rng) -> Self {
        let mut vector = |fixed: Option<[f64; 3]>, sigma: f64| {
            let drawn = normal(rng) * sigma;
            fixed.map_or(drawn, Vector3::from)
        };
        let bias_m = vector(scenario.bias_m, scenario.bias_sigma_m);
        let velocity_bias_m_s = vector(scenario.velocity_bias_m_s, scenario.velocity_bias_sigma_m_s);
        let drift_m_s = vector(scenario.drift_m_s, scenario.drift_sigma_m_s);
        let deviate: f64 = StandardNormal.sample(rng);
        let share = 2.0 * rng.random::<f64>() - 1.0;
        Self {
            bias_m,
            velocity_bias_m_s,
            drift_m_s,
            scale: scenario.scale.unwrap_or(deviate * scenario.scale_sigma),
            clock_offset_s: scenario.clock_offset_s.unwrap_or(share * scenario.clock_offset_max_s),
        }
    }

    /// Position (m) and velocity (m/s) without noise at the true instant `t_s`, with the middle of the
    /// overlap at `middle_s`.
    #[must_use]
    pub fn observe(&self, truth: &Trajectory, t_s: f64, middle_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (now, middle) = (truth.at(t_s), truth.at(middle_s));
        let drifted = self.drift_m_s * (t_s - middle_s);
        let scaled = (now.position - middle.position) * self.scale;
        let position = now.position + self.bias_m + drifted + scaled; // (2)
        let velocity = now.velocity * (1.0 + self.scale) + self.drift_m_s + self.velocity_bias_m_s; // (3)
        (position, velocity)
    }
}

/// One sample as the recorder got it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSample {
    /// When it was taken, s after release, by the true clock.
    pub true_time_s: f64,
    /// When it says it was taken, s after release, by the sensor's clock.
    pub stamp_s: f64,
    /// When the recorder received it, s after release, by the true clock.
    pub receive_s: f64,
    /// Measured position, ENU, m.
    pub position: Vector3<f64>,
    /// Measured velocity, ENU, m/s.
    pub velocity: Vector3<f64>,
    /// Whether it is off by far more than the noise.
    pub is_outlier: bool,
}

/// All that one sensor delivered, in the order of the sampling.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorRecord {
    /// `tether`, `beacon` or `reference`.
    pub name: String,
    /// Its systematic errors, drawn or fixed.
    pub errors: SensorErrors,
    /// Its samples; lost ones are missing.
    pub samples: Vec<SensorSample>,
}

/// When a sensor sees the vehicle, s after release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The first instant.
    pub begin_s: f64,
    /// The last instant, inclusive.
    pub end_s: f64,
    /// T of (2), where the drift and the scale error are zero.
    pub middle_s: f64,
}

/// What the random streams are for.
#[derive(Clone, Copy)]
enum Purpose {
    Errors,
    Sampling,
    Noise,
    Outliers,
    Dropouts,
}

/// Watches the truth through a sensor whose random streams are `8 * sensor` and the seven after it.
#[must_use]
pub fn watch(
    name: &str,
    scenario: &SensorScenario,
    truth: &Trajectory,
    window: &Window,
    seed: u64,
    sensor: u64,
) -> SensorRecord {
    let stream = |purpose: Purpose| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(8 * sensor + purpose as u64);
        rng
    };
    let errors = SensorErrors::draw(&scenario.errors, &mut stream(Purpose::Errors));
    let (mut sampling, mut outliers) = (stream(Purpose::Sampling), stream(Purpose::Outliers));
    let mut noise = Noise::start(scenario.noise_correlation, stream(Purpose::Noise));
    let mut dropouts = Dropouts::start(scenario, stream(Purpose::Dropouts));

    // A millionth of a period, so that a window's last frame isn't lost to rounding.
    let count = ((window.end_s - window.begin_s) * scenario.rate_hz - scenario.phase + 1e-6).floor() + 1.0;
    let mut samples = Vec::with_capacity(count.max(0.0) as usize);
    for k in 0..count.max(0.0) as u64 {
        let period_s = 1.0 / scenario.rate_hz;
        let jitter: f64 = StandardNormal.sample(&mut sampling);
        // Below half a period, so that samples stay in order.
        let jitter_s = (jitter * scenario.jitter_s).clamp(-0.45 * period_s, 0.45 * period_s);
        let true_time_s = window.begin_s + (k as f64 + scenario.phase) * period_s + jitter_s;
        let late: f64 = StandardNormal.sample(&mut sampling);
        let receive_s = true_time_s + scenario.latency_s + scenario.latency_jitter_s * late.abs();

        let (mut position, mut velocity) = errors.observe(truth, true_time_s, window.middle_s);
        let (e, f) = noise.next();
        position += e * scenario.position_sigma_m;
        velocity += f * scenario.velocity_sigma_m_s;
        let outlier = draw_outlier(scenario, &mut outliers);
        if let Some((position_error, velocity_error)) = outlier {
            position += position_error;
            velocity += velocity_error;
        }
        if dropouts.next_is_lost() {
            continue;
        }
        samples.push(SensorSample {
            true_time_s,
            stamp_s: true_time_s + errors.clock_offset_s, // (1)
            receive_s,
            position,
            velocity,
            is_outlier: outlier.is_some(),
        });
    }
    SensorRecord { name: name.to_owned(), errors, samples }
}

/// Three independent standard normal deviates.
fn normal(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// Noise of unit variance: `x_k = a x_(k-1) + sqrt(1 - a^2) w_k`, started in its steady state.
struct Noise {
    correlation: f64,
    last: Option<(Vector3<f64>, Vector3<f64>)>,
    rng: ChaCha8Rng,
}

impl Noise {
    fn start(correlation: f64, rng: ChaCha8Rng) -> Self {
        Self { correlation, last: None, rng }
    }

    /// The next noise of position and velocity, in sigmas.
    fn next(&mut self) -> (Vector3<f64>, Vector3<f64>) {
        let fresh = (normal(&mut self.rng), normal(&mut self.rng));
        let a = self.correlation;
        let share = (1.0 - a * a).sqrt();
        let mix = |old: Vector3<f64>, new: Vector3<f64>| old * a + new * share;
        let now = self.last.map_or(fresh, |(e, f)| (mix(e, fresh.0), mix(f, fresh.1)));
        self.last = Some(now);
        now
    }
}

/// Whether this sample is an outlier, and by how much: position (m), velocity (m/s).
fn draw_outlier(scenario: &SensorScenario, rng: &mut impl Rng) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mut gross = || {
        let span = scenario.outlier_max_m - scenario.outlier_min_m;
        let direction: [f64; 3] = UnitSphere.sample(rng);
        let chance = rng.random::<f64>();
        (Vector3::from(direction) * (scenario.outlier_min_m + span * rng.random::<f64>()), chance)
    };
    let (position, chance) = gross();
    let (velocity, velocity_chance) = gross();
    (chance < scenario.outlier_share).then(|| {
        let wild = velocity_chance < scenario.outlier_velocity_share;
        (position, if wild { velocity } else { Vector3::zeros() })
    })
}

/// A two-state chain: bursts of lost samples with a geometric length, started in its steady state.
struct Dropouts {
    lost: bool,
    /// Chance that a burst begins at the next sample, and that it ends.
    begin: f64,
    end: f64,
    rng: ChaCha8Rng,
}

impl Dropouts {
    fn start(scenario: &SensorScenario, mut rng: ChaCha8Rng) -> Self {
        let (share, end) = (scenario.dropout_share, 1.0 / scenario.dropout_burst);
        let lost = rng.random::<f64>() < share;
        Self { lost, begin: (end * share / (1.0 - share)).min(1.0), end, rng }
    }

    fn next_is_lost(&mut self) -> bool {
        let lost = self.lost;
        let chance = self.rng.random::<f64>();
        self.lost = if lost { chance >= self.end } else { chance < self.begin };
        lost
    }
}
