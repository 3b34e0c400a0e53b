//! The truth of a dive: a heavy submersible that goes down, runs survey legs above the bottom and comes up again,
//! in 3-D ENU with Z = 0 at the surface.
//!
//! ```text
//! p' = u + c(t),    u' = (w(t) - u) / T                                                               (1)
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | p | position | 3 | m |
//! | u | velocity through the water | 3 | m/s |
//! | w(t) | velocity that is steered: descent, legs, turns, ascent | 3 | m/s |
//! | c(t) | the water's own motion, a slow Gauss-Markov process | 3 | m/s |
//! | T | how long the vehicle takes to follow | 1 | s |
//!
//! A manned submersible's numbers: it sinks and rises by ballast at 0.6 to 0.75 m/s (36 to 45 m a minute), cruises at
//! 1 to 2 knots, turns at 1 to 3 degrees a second, and follows within half a minute.

mod log;
mod messages;
mod scenario;
mod ship;
mod simulation;
mod usbl;
mod validate;

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::trajectory::{State, Trajectory};

pub use log::{write_dive, write_dive_log};
pub use messages::{FixMessage, Seen};
pub use scenario::{DepthScenario, DiveScenario, FixesAs, MessagesScenario, ShipScenario};
pub use ship::{SeenPolar, ShipState};
pub use simulation::{FixCounts, SimulatedDive, simulate_dive};
pub use usbl::{SimulatedFix, UsblConstants, UsblRecord, watch_by_usbl};

/// Step of the truth's table, s: a tenth of the shortest time in (1).
const STEP_S: f64 = 0.5;

/// The ranges that a dive's numbers are drawn from, evenly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DiveConstants {
    /// How long the whole dive takes, s.
    pub duration_s: f64,
    /// Share of the dive that is descent, and share that is ascent.
    pub vertical_share: [f64; 2],
    /// Speed down and up, m/s.
    pub vertical_m_s: [f64; 2],
    /// Horizontal speed through the water while descending or ascending, m/s.
    pub gliding_m_s: [f64; 2],
    /// Rate of the slow spiral on the way down and up, degrees/s, to either side.
    pub spiral_deg_s: [f64; 2],
    /// Speed on a leg, m/s.
    pub leg_m_s: [f64; 2],
    /// How long a leg takes, s.
    pub leg_s: [f64; 2],
    /// Angle between two legs, degrees, to either side.
    pub turn_deg: [f64; 2],
    /// Rate of a turn, degrees/s.
    pub turn_deg_s: [f64; 2],
    /// Climb or descent along a leg, where the bottom slopes, m/s, to either side.
    pub slope_m_s: [f64; 2],
    /// T, s: horizontal, vertical.
    pub lag_s: [f64; 2],
    /// Standard deviation of the water's motion, m/s: horizontal axes, vertical axis.
    pub current_m_s: [f64; 2],
    /// How long the water's motion remembers, s.
    pub current_s: f64,
}

impl Default for DiveConstants {
    fn default() -> Self {
        Self {
            duration_s: 3600.0,
            vertical_share: [0.25, 0.33],
            vertical_m_s: [0.60, 0.75],
            gliding_m_s: [0.05, 0.25],
            spiral_deg_s: [0.0, 0.004_f64.to_degrees()],
            leg_m_s: [0.5, 1.0],
            leg_s: [180.0, 420.0],
            turn_deg: [30.0, 135.0],
            turn_deg_s: [1.0, 3.0],
            slope_m_s: [0.0, 0.10],
            lag_s: [15.0, 25.0],
            current_m_s: [0.05, 0.015],
            current_s: 600.0,
        }
    }
}

/// A number from a range, evenly.
fn within([low, high]: [f64; 2], rng: &mut impl Rng) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// The same to either side of zero.
fn either_side(range: [f64; 2], rng: &mut impl Rng) -> f64 {
    let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
    sign * within(range, rng)
}

/// A range of angles, in radians.
fn radians(range_deg: [f64; 2]) -> [f64; 2] {
    range_deg.map(f64::to_radians)
}

/// What is steered for a while: speed ahead, rate of turn, speed upwards.
#[expect(clippy::struct_field_names, reason = "units stand in names")]
struct Order {
    until_s: f64,
    ahead_m_s: f64,
    turn_rad_s: f64,
    up_m_s: f64,
}

/// The orders of one dive, one after the other.
fn orders(constants: &DiveConstants, rng: &mut impl Rng) -> Vec<Order> {
    let c = constants;
    let [down_s, up_s] = [0, 1].map(|_| c.duration_s * within(c.vertical_share, rng));
    let mut vertical = |until_s, sign: f64| Order {
        until_s,
        ahead_m_s: within(c.gliding_m_s, rng),
        turn_rad_s: either_side(radians(c.spiral_deg_s), rng),
        up_m_s: sign * within(c.vertical_m_s, rng),
    };
    let (down, up) = (vertical(down_s, -1.0), vertical(c.duration_s, 1.0));
    let mut orders = vec![down];
    let (mut now_s, survey_end_s) = (down_s, c.duration_s - up_s);
    while now_s < survey_end_s {
        let (ahead_m_s, up_m_s) = (within(c.leg_m_s, rng), either_side(c.slope_m_s, rng));
        now_s += within(c.leg_s, rng);
        orders.push(Order { until_s: now_s.min(survey_end_s), ahead_m_s, turn_rad_s: 0.0, up_m_s });
        let (angle, rate) = (either_side(radians(c.turn_deg), rng), within(radians(c.turn_deg_s), rng));
        now_s += angle.abs() / rate;
        let turn_rad_s = rate.copysign(angle);
        orders.push(Order { until_s: now_s.min(survey_end_s), ahead_m_s, turn_rad_s, up_m_s: 0.0 });
    }
    orders.push(up);
    orders
}

/// The true track of one dive from x = y = z = 0 on, every number of it from `rng`.
#[must_use]
pub fn dive(constants: &DiveConstants, rng: &mut impl Rng) -> Trajectory {
    let c = constants;
    let orders = orders(c, rng);
    let lags = [0, 1].map(|_| within(c.lag_s, rng));
    let lag = Vector3::new(lags[0], lags[0], lags[1]);
    let rms = Vector3::new(c.current_m_s[0], c.current_m_s[0], c.current_m_s[1]);
    let mut heading_rad = TAU * rng.random::<f64>();
    let mut normal = || Vector3::from_fn(|_, _| StandardNormal.sample(rng));
    let keep = (-STEP_S / c.current_s).exp();
    let fresh = rms * (1.0 - keep * keep).sqrt();
    let mut current: Vector3<f64> = rms.component_mul(&normal());
    let mut through_water = Vector3::zeros();
    // the process is smoothed over the vehicle's own lag: p' has a derivative
    let mut drifting = current;
    let (mut position, mut order) = (Vector3::zeros(), 0);
    let steps = (c.duration_s / STEP_S).ceil() as usize;
    let mut knots = Vec::with_capacity(steps + 1);
    for i in 0..=steps {
        while orders[order].until_s <= i as f64 * STEP_S && order + 1 < orders.len() {
            order += 1;
        }
        let steered = &orders[order];
        let (sin, cos) = heading_rad.sin_cos();
        let wanted = Vector3::new(cos * steered.ahead_m_s, sin * steered.ahead_m_s, steered.up_m_s);
        let force = (wanted - through_water).component_div(&lag);
        let drift = (current - drifting).component_div(&lag);
        knots.push(State { position, velocity: through_water + drifting, acceleration: force + drift });
        let velocity = through_water + drifting;
        through_water += force * STEP_S;
        drifting += drift * STEP_S;
        // the trapezoid, so that the table's velocity is the derivative of its position
        position += (velocity + through_water + drifting) * (0.5 * STEP_S);
        heading_rad += steered.turn_rad_s * STEP_S;
        current = current * keep + fresh.component_mul(&normal());
    }
    Trajectory { step_s: STEP_S, knots }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn example(seed: u64) -> Trajectory {
        dive(&DiveConstants::default(), &mut ChaCha8Rng::seed_from_u64(seed))
    }

    #[test]
    fn a_dive_goes_down_works_and_comes_up_at_a_submersibles_speeds() {
        for seed in 0..20 {
            let dive = example(seed);
            let states: Vec<State> = (0..3600).map(|t| dive.at(f64::from(t))).collect();
            let deepest = states.iter().map(|s| s.position.z).fold(0.0, f64::min);
            assert!((-1100.0..-400.0).contains(&deepest), "{deepest}");
            assert!(states.iter().all(|s| s.velocity.norm() < 1.4 && s.velocity.z.abs() < 0.85));
            assert!(states.iter().all(|s| s.acceleration.norm() < 0.15));
            assert!(states[3599].position.z > -350.0);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_dive_and_another_seed_another() {
        let at = |seed| example(seed).at(1800.0).position;
        assert_eq!(at(1), at(1));
        assert!((at(1) - at(2)).norm() > 10.0);
    }

    #[test]
    fn the_velocity_is_the_derivative_of_the_position() {
        let dive = example(3);
        for t in [10.0, 800.3, 1500.7, 3000.1] {
            let [before, after] = [-0.01, 0.01].map(|d| dive.at(t + d).position);
            let slope = (after - before) / 0.02;
            assert!((slope - dive.at(t).velocity).norm() < 1e-4);
        }
    }
}
