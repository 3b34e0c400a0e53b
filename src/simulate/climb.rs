//! The truth: a point mass that climbs through the sea, in 3-D ENU with Z = 0 at the surface.
//!
//! ```text
//! p' = v
//! v' = u(t) d - K v |v| + b k + n(t) + s(t) exp(min(z, 0) / L)                                        (1)
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | p, v | position and velocity; v(0) is the carrier's, horizontal | 3 | m, m/s |
//! | u(t) | thrust pulse: smooth ramp, burn, smooth tail, with a modulation | 1 | m/s2 |
//! | d | thrust axis, tilted from the vertical towards the carrier's heading | 3 | 1 |
//! | K | drag, diagonal: horizontal, horizontal, vertical | 3 x 3 | 1/m |
//! | b | net buoyancy along k, up | 1 | m/s2 |
//! | n(t) | band-limited random acceleration | 3 | m/s2 |
//! | s(t) | random force of the sea's surface, in the last phase only | 3 | m/s2 |
//! | L | depth over which s fades by a factor e | 1 | m |
//!
//! Solved by the classical fourth-order Runge-Kutta method at a fixed step of a twentieth of a frame.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::band_noise::BandNoise;
use super::phases::Phases;
use super::trajectory::{State, Trajectory};

/// Integration steps per frame: 1 ms for the steep climb, 2.5 ms for the oblique one. Against a closed form
/// the speed is right to 1e-9 m/s.
const STEPS_PER_FRAME: f64 = 20.0;
/// One standard deviation of each number from run to run, as a share of it, at `vary` = 1.
const VARIATION: f64 = 0.05;
/// How far the track goes on beyond the last phase, s, for samples stamped late.
const MARGIN_S: f64 = 0.2;

/// The constants of one climb, (1).
#[derive(Clone, Debug, PartialEq)]
pub struct ClimbConstants {
    /// Full thrust over mass, m/s2.
    pub thrust_m_s2: f64,
    /// Time from release to full thrust, s.
    pub ramp_s: f64,
    /// Time from release to the end of full thrust, s.
    pub burn_s: f64,
    /// Time from the end of full thrust to none, s.
    pub tail_s: f64,
    /// Amplitude of the thrust's modulation, a share of the thrust.
    pub modulation: f64,
    /// Frequency of the thrust's modulation, Hz.
    pub modulation_hz: f64,
    /// Drag along Z, 1/m.
    pub drag_vertical_per_m: f64,
    /// Drag along X and Y, 1/m.
    pub drag_horizontal_per_m: f64,
    /// Net buoyancy over mass, upwards, m/s2.
    pub buoyancy_m_s2: f64,
    /// Angle of the thrust axis from the vertical, degrees.
    pub tilt_deg: f64,
    /// The carrier's horizontal speed at release, m/s.
    pub carrier_m_s: f64,
    /// Rms of the random acceleration per axis, m/s2.
    pub random_m_s2: f64,
    /// Low end of the random accelerations' band, Hz.
    pub random_low_hz: f64,
    /// High end of the random accelerations' band, Hz.
    pub random_high_hz: f64,
    /// Rms of the surface's random force over mass per axis, at the surface, m/s2.
    pub surface_m_s2: f64,
    /// Depth over which the surface's force fades by a factor e, m.
    pub surface_depth_m: f64,
}

impl ClimbConstants {
    /// The same constants, each off by a few per cent: N(0, 5 %), cut at two sigmas, times `vary`.
    ///
    /// The shape of the random forces and the carrier's speed stay.
    fn varied(&self, vary: f64, rng: &mut impl Rng) -> Self {
        let mut near = |value: f64| {
            let deviate: f64 = StandardNormal.sample(rng);
            value * (1.0 + vary * VARIATION * deviate.clamp(-2.0, 2.0))
        };
        Self {
            thrust_m_s2: near(self.thrust_m_s2),
            ramp_s: near(self.ramp_s),
            burn_s: near(self.burn_s),
            tail_s: near(self.tail_s),
            modulation_hz: near(self.modulation_hz),
            drag_vertical_per_m: near(self.drag_vertical_per_m),
            drag_horizontal_per_m: near(self.drag_horizontal_per_m),
            buoyancy_m_s2: near(self.buoyancy_m_s2),
            tilt_deg: near(self.tilt_deg),
            ..self.clone()
        }
    }

    /// u(t) without its modulation, as a share of the full thrust.
    fn pulse(&self, t_s: f64) -> f64 {
        smooth_step(t_s / self.ramp_s) * smooth_step(1.0 - (t_s - self.burn_s) / self.tail_s)
    }
}

/// 0 below 0, 1 above 1, and `x^2 (3 - 2 x)` between.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Where a climb begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At this height at release, m (below 0).
    At {
        /// Z at release, m.
        z_m: f64,
    },
    /// As deep as it takes for the highest point up to the end of the last phase to be at this height, m.
    ToReach {
        /// The greatest Z up to T3, m.
        z_m: f64,
    },
}

/// The terms of (1) that depend on time alone, every half step.
struct Forcing {
    step_s: f64,
    /// u d + b k + n.
    free: Vec<Vector3<f64>>,
    /// s, from the half step `surface_from` on, zero before.
    surface: Vec<Vector3<f64>>,
    surface_from: usize,
    /// The diagonal of K, 1/m.
    drag: Vector3<f64>,
    /// 1/L, 1/m.
    fade_per_m: f64,
    /// v(0), m/s.
    velocity: Vector3<f64>,
}

impl Forcing {
    fn draw(constants: &ClimbConstants, phases: &Phases, vary: f64, rng: &mut impl Rng) -> Self {
        let c = constants.varied(vary, rng);
        let step_s = phases.frame_s / STEPS_PER_FRAME;
        let count = 2 * ((phases.t3_s + MARGIN_S) / step_s).ceil() as usize + 1;

        let heading = TAU * rng.random::<f64>();
        let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let (sin_tilt, cos_tilt) = c.tilt_deg.to_radians().sin_cos();
        let axis = ahead * sin_tilt + Vector3::z() * cos_tilt;
        let modulation_phase = TAU * rng.random::<f64>();

        let surface_from = 2 * (phases.t2_s / step_s).floor() as usize + 1;
        let mut noise = |rms, from: usize| {
            let axes: [_; 3] = std::array::from_fn(|_| {
                let axis = BandNoise::draw(rng, rms, c.random_low_hz, c.random_high_hz);
                axis.table(0.5 * step_s * from as f64, 0.5 * step_s, count - from)
            });
            (0..count - from).map(|i| Vector3::new(axes[0][i], axes[1][i], axes[2][i])).collect::<Vec<_>>()
        };
        let (mut free, mut surface) = (noise(c.random_m_s2, 0), noise(c.surface_m_s2, surface_from));

        for (i, free) in free.iter_mut().enumerate() {
            let t = 0.5 * step_s * i as f64;
            let modulation = 1.0 + c.modulation * (TAU * c.modulation_hz * t + modulation_phase).sin();
            *free += axis * (c.thrust_m_s2 * c.pulse(t) * modulation) + Vector3::z() * c.buoyancy_m_s2;
        }
        let fade_in_s = 0.25 * (phases.t3_s - phases.t2_s);
        for (i, surface) in (surface_from..).zip(&mut surface) {
            *surface *= smooth_step((0.5 * step_s * i as f64 - phases.t2_s) / fade_in_s);
        }
        Self {
            step_s,
            free,
            surface,
            surface_from,
            drag: Vector3::new(c.drag_horizontal_per_m, c.drag_horizontal_per_m, c.drag_vertical_per_m),
            fade_per_m: 1.0 / c.surface_depth_m,
            velocity: ahead * c.carrier_m_s,
        }
    }

    /// v' at the half step `i`.
    fn acceleration(&self, i: usize, z: f64, v: &Vector3<f64>) -> Vector3<f64> {
        let calm = self.free[i] - self.drag.component_mul(v) * v.norm();
        if i < self.surface_from {
            return calm;
        }
        calm + self.surface[i - self.surface_from] * (z.min(0.0) * self.fade_per_m).exp() // (1)
    }

    /// The track from the height `z_m` at x = y = 0.
    fn integrate(&self, z_m: f64) -> Trajectory {
        let first = State {
            position: Vector3::new(0.0, 0.0, z_m),
            velocity: self.velocity,
            acceleration: self.acceleration(0, z_m, &self.velocity),
        };
        let mut knots = Vec::with_capacity(self.free.len() / 2 + 1);
        knots.push(first);
        self.go_on(&mut knots);
        Trajectory { step_s: self.step_s, knots }
    }

    /// The same track `dz_m` higher: before the last phase, (1) doesn't depend on the height.
    fn lift(&self, trajectory: &mut Trajectory, dz_m: f64) {
        let knots = &mut trajectory.knots;
        knots.truncate((self.surface_from - 1) / 2 + 1);
        for knot in knots.iter_mut() {
            knot.position.z += dz_m;
        }
        self.go_on(knots);
    }

    /// Integrates from the last knot to the end by Runge and Kutta's method.
    fn go_on(&self, knots: &mut Vec<State>) {
        let h = self.step_s;
        while let Some(&State { position: mut p, velocity: mut v, acceleration: a1 }) = knots.last() {
            let i = 2 * (knots.len() - 1);
            if i + 2 >= self.free.len() {
                return;
            }
            let v2 = v + a1 * (0.5 * h);
            let a2 = self.acceleration(i + 1, p.z + 0.5 * h * v.z, &v2);
            let v3 = v + a2 * (0.5 * h);
            let a3 = self.acceleration(i + 1, p.z + 0.5 * h * v2.z, &v3);
            let v4 = v + a3 * h;
            let a4 = self.acceleration(i + 2, p.z + h * v3.z, &v4);
            p += (v + (v2 + v3) * 2.0 + v4) * (h / 6.0);
            v += (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0);
            let a = self.acceleration(i + 2, p.z, &v);
            knots.push(State { position: p, velocity: v, acceleration: a });
        }
    }
}

/// The true track of one run: constants off by some per cent times `vary`, heading and random forces from
/// `rng`.
#[must_use]
pub fn climb(
    constants: &ClimbConstants,
    phases: &Phases,
    start: Start,
    vary: f64,
    rng: &mut impl Rng,
) -> Trajectory {
    /// Runs at most until the depth is found; each leaves a fraction of the error of the one before.
    const RUNS: usize = 12;
    const CLOSE_M: f64 = 1e-3;

    let forcing = Forcing::draw(constants, phases, vary, rng);
    let target_m = match start {
        Start::At { z_m } => return forcing.integrate(z_m),
        Start::ToReach { z_m } => z_m,
    };
    let seen = (phases.t3_s / forcing.step_s).round() as usize + 1;
    let mut trajectory = forcing.integrate(target_m - 60.0);
    for _ in 0..RUNS {
        let top_m =
            trajectory.knots.iter().take(seen).map(|knot| knot.position.z).fold(f64::NEG_INFINITY, f64::max);
        if (top_m - target_m).abs() < CLOSE_M || !top_m.is_finite() {
            break;
        }
        forcing.lift(&mut trajectory, target_m - top_m);
    }
    trajectory
}
