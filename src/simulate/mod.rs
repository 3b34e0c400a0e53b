//! Recordings of climbs that never were, with their truth: a point mass, its sensors, and a log that looks
//! like a real one.
//!
//! ```text
//! Scenario -> climb (truth) -> sensors (samples) -> Simulation -> log (MCAP)
//! ```
//!
//! Everything up to [`Simulation`] is pure: the same scenario gives the same numbers, and random numbers come
//! from its seed alone. A simulated log is the same to the byte, as far as the platform's sines and
//! exponentials are.

mod band_noise;
mod bystanders;
mod climb;
mod climb_log;
mod climb_scenario;
mod dive;
mod error;
mod families;
mod log;
mod phases;
mod scenario;
mod scenario_file;
mod sensor_channel;
mod sensor_scenario;
mod sensors;
mod trajectory;
mod validate;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use climb::{ClimbConstants, Start, climb};
pub use climb_log::{write_log, write_simulation};
pub use climb_scenario::{ClimbScenario, Profile};
pub use dive::{
    DepthScenario, DiveConstants, DiveScenario, FixCounts, FixMessage, FixesAs, MessagesScenario, Seen,
    SeenPolar, ShipScenario, ShipState, SimulatedDive, SimulatedFix, UsblConstants, UsblRecord, dive,
    simulate_dive, watch_by_usbl, write_dive, write_dive_log,
};
pub use error::SimulateError;
pub use families::FAMILIES;
pub use phases::{Frames, Phases};
pub use scenario::{RecordingScenario, Scenario};
pub use scenario_file::ScenarioFile;
pub use sensor_channel::SensorEncoding;
pub use sensor_scenario::{ErrorsScenario, SensorScenario};
pub use sensors::{SensorErrors, SensorRecord, SensorSample, Window, watch};
pub use trajectory::{State, Trajectory};

/// Rate of the table of the truth, Hz.
pub const TRUTH_RATE_HZ: f64 = 100.0;

/// A run: what happened, and what the sensors saw of it.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The true track, known at every instant.
    pub trajectory: Trajectory,
    /// The true track at [`TRUTH_RATE_HZ`], from T0 to T3.
    pub truth: Vec<TruthPoint>,
    /// The enabled sensors: tether, beacon, reference.
    pub sensors: Vec<SensorRecord>,
    /// Who sees the vehicle when.
    pub phases: Phases,
    /// The truth at T1, T2 and T3.
    pub characteristic_points: [TruePoint; 3],
}

/// A row of the table of the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthPoint {
    /// Time since release, s.
    pub t_s: f64,
    /// Position, velocity and acceleration, ENU.
    pub state: State,
}

/// When the vehicle passes a height, and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruePoint {
    /// Time since release, s.
    pub t_s: f64,
    /// The height, m.
    pub z_m: f64,
    /// Velocity along Z, m/s.
    pub vz_m_s: f64,
}

impl Simulation {
    /// The sensor of that name, if it is enabled.
    #[must_use]
    pub fn sensor(&self, name: &str) -> Option<&SensorRecord> {
        self.sensors.iter().find(|sensor| sensor.name == name)
    }
}

/// Simulates a scenario: the truth first, then each enabled sensor.
///
/// # Errors
///
/// The errors of [`Scenario::validate`]; [`SimulateError::Diverged`] where the track leaves the range of
/// numbers.
pub fn simulate(scenario: &Scenario) -> Result<Simulation, SimulateError> {
    scenario.validate()?;
    let phases = scenario.climb.phases();
    let trajectory = climb(
        &scenario.climb.constants(),
        &phases,
        scenario.climb.start(),
        scenario.climb.vary,
        &mut ChaCha8Rng::seed_from_u64(scenario.seed),
    );
    if let Some(t_s) = trajectory.diverged_s() {
        return Err(SimulateError::Diverged { t_s });
    }

    let watched = [
        ("tether", &scenario.tether, phases.t0_s, phases.overlap_end_s),
        ("beacon", &scenario.beacon, phases.overlap_begin_s, phases.t2_s),
        ("reference", &scenario.reference, phases.t0_s, phases.t3_s),
    ];
    let sensors = (1..)
        .zip(watched)
        .filter(|(_, (_, sensor, ..))| sensor.enabled)
        .map(|(stream, (name, sensor, begin_s, end_s))| {
            let window = Window {
                begin_s: sensor.begin_s.unwrap_or(begin_s),
                end_s: sensor.end_s.unwrap_or(end_s),
                middle_s: phases.t1_s,
            };
            watch(name, sensor, &trajectory, &window, scenario.seed, stream)
        })
        .collect();

    let rows = (phases.t3_s * TRUTH_RATE_HZ + 1e-6).floor() as u64;
    let truth = (0..=rows)
        .map(|i| i as f64 / TRUTH_RATE_HZ)
        .map(|t_s| TruthPoint { t_s, state: trajectory.at(t_s) })
        .collect();
    let characteristic_points = [phases.t1_s, phases.t2_s, phases.t3_s].map(|t_s| {
        let state = trajectory.at(t_s);
        TruePoint { t_s, z_m: state.position.z, vz_m_s: state.velocity.z }
    });
    Ok(Simulation { trajectory, truth, sensors, phases, characteristic_points })
}

#[cfg(test)]
mod tests;
