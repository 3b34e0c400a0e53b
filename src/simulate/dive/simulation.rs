//! A dive and all that its log says of it.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::messages::{FixMessage, messages};
use super::scenario::{DiveScenario, FixesAs};
use super::ship::ShipState;
use super::{UsblConstants, UsblRecord, dive, watch_by_usbl};
use crate::simulate::error::SimulateError;
use crate::simulate::sensors::{SensorRecord, Window, watch};
use crate::simulate::trajectory::Trajectory;

/// How deep a vehicle has been, m, that comes up and not just bobs at its release.
const SUBMERGED_M: f64 = 10.0;

/// A run: what happened, and what was recorded of it.
#[derive(Clone, Debug)]
pub struct SimulatedDive {
    /// The true track, known at every instant.
    pub trajectory: Trajectory,
    /// When the recording ends, s: where the vehicle is back at the surface, at most the scenario's duration.
    pub end_s: f64,
    /// The fixes, and when nothing is heard; those of polar messages are without noise.
    pub record: UsblRecord,
    /// What the log gets of the fixes, in the order of their stamps.
    pub messages: Vec<FixMessage>,
    /// What the ship says of itself.
    pub ship: Vec<ShipState>,
    /// What the depth sensor says: s and m.
    pub depths: Vec<[f64; 2]>,
    /// The reference, if it is enabled.
    pub reference: Option<SensorRecord>,
}

/// How many fixes there are, and how many of them are out of the ordinary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixCounts {
    /// All fixes, each once.
    pub fixes: usize,
    /// Those that more than noise moved.
    pub wild: usize,
    /// Those that were held up.
    pub late: usize,
    /// Those that were received twice.
    pub repeated: usize,
}

impl SimulatedDive {
    /// How many fixes there are, and how many of them are out of the ordinary.
    #[must_use]
    pub fn counts(&self) -> FixCounts {
        let count = |which: fn(&FixMessage) -> bool| self.messages.iter().filter(|m| which(m)).count();
        FixCounts {
            fixes: count(|m| !m.repeated),
            wild: count(|m| m.wild && !m.repeated),
            late: count(|m| m.late && !m.repeated),
            repeated: count(|m| m.repeated),
        }
    }

    /// The greatest depth, m.
    #[must_use]
    pub fn deepest_m(&self) -> f64 {
        self.trajectory.knots.iter().map(|knot| -knot.position.z).fold(0.0, f64::max)
    }
}

/// What the random streams are for. The reference has those from 24 on.
#[derive(Clone, Copy)]
enum Purpose {
    Dive,
    Arrival,
    PolarNoise,
    Ship,
    Depth,
}

/// The sensor number of the reference: see [`watch`].
const REFERENCE: u64 = 3;

/// Simulates a dive: the truth first, then what is heard and said of it.
///
/// # Errors
///
/// The errors of [`DiveScenario::validate`].
pub fn simulate_dive(scenario: &DiveScenario) -> Result<SimulatedDive, SimulateError> {
    scenario.validate()?;
    let stream = |purpose: Purpose| {
        let mut rng = ChaCha8Rng::seed_from_u64(scenario.seed);
        rng.set_stream(purpose as u64);
        rng
    };
    let mut rng = stream(Purpose::Dive);
    let trajectory = dive(&scenario.dive, &mut rng);
    let end_s = surfaced_s(&trajectory).unwrap_or(scenario.dive.duration_s);

    let mut heard = scenario.usbl.clone();
    if scenario.messages.fixes_as == FixesAs::Polar {
        heard = UsblConstants { sigma_m: 0.0, common_sigma_m: 0.0, ..heard }; // the noise is then of range and angles
    }
    let mut record = watch_by_usbl(&trajectory, end_s, &heard, &mut rng);
    let silence_s = record.silence_s.map(|silence_s| silence_s.map(|t| t.min(end_s)));
    record.silence_s = silence_s.filter(|[begin_s, silent_until_s]| begin_s < silent_until_s);
    let messages =
        messages(&record, scenario, &mut stream(Purpose::Arrival), &mut stream(Purpose::PolarNoise));
    let ship = scenario.ship.navigation(end_s, &mut stream(Purpose::Ship));
    let depths = depths(scenario, &trajectory, end_s, &mut stream(Purpose::Depth));

    let sensor = &scenario.reference;
    let reference = sensor.enabled.then(|| {
        let window = Window {
            begin_s: sensor.begin_s.unwrap_or(0.0),
            end_s: sensor.end_s.unwrap_or(end_s).min(end_s),
            middle_s: 0.5 * end_s,
        };
        watch("reference", sensor, &trajectory, &window, scenario.seed, REFERENCE)
    });
    Ok(SimulatedDive { trajectory, end_s, record, messages, ship, depths, reference })
}

/// When the vehicle is back at the surface, if it gets there.
fn surfaced_s(trajectory: &Trajectory) -> Option<f64> {
    let heights = trajectory.knots.iter().map(|knot| knot.position.z);
    let mut later = heights.enumerate().skip_while(|(_, z)| *z > -SUBMERGED_M);
    later.find(|(_, z)| *z >= 0.0).map(|(i, _)| i as f64 * trajectory.step_s)
}

fn depths(
    scenario: &DiveScenario,
    trajectory: &Trajectory,
    end_s: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<[f64; 2]> {
    let sensor = &scenario.depth;
    if !sensor.enabled {
        return Vec::new();
    }
    let mut measured = |time_s: f64| {
        let noise: f64 = StandardNormal.sample(rng);
        [time_s, sensor.sigma_m * noise - trajectory.at(time_s).position.z]
    };
    (0..=(end_s * sensor.rate_hz) as u64).map(|k| measured(k as f64 / sensor.rate_hz)).collect()
}
