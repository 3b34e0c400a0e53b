//! A body that runs free in water: constant force, quadratic drag.
//!
//! ```text
//! v' = g - K v |v|,   K = diag(k_h, k_h, k_v)
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | p, v | position and velocity at the end of the stretch that is fitted | 3, 3 | m, m/s |
//! | g | what pushes, per mass: buoyancy less weight, what is left of a thrust | 3 | m/s^2 |
//! | k_h, k_v | drag per mass, horizontal and vertical | 1, 1 | 1/m |
//!
//! Fitted to positions and velocities by Gauss-Newton; the trajectory by Runge-Kutta of order 4, its derivatives
//! by differences. A stretch of a second hardly tells drag from force, so both have weak priors: g near zero
//! within [`FORCE_SIGMA`], ln k near that of a slender body, `C_d A / 2 V = 0.03`, within a factor of 3.

use nalgebra::{SVector, Vector3};

use super::super::{EstimateError, check};
use crate::math::least_squares::{LeastSquares, Solution};
use crate::sample::{Quantity, Sample, Source};
use crate::track::{Curve, State};

/// p, v, g, ln k_h, ln k_v.
const UNKNOWNS: usize = 11;
type Unknowns = SVector<f64, UNKNOWNS>;

/// Standard deviation of the force's prior by axis, m/s^2: a vehicle is ballasted to be nearly neutral.
const FORCE_SIGMA: [f64; 3] = [0.3, 0.3, 1.0];
/// Median of the drag's prior, 1/m.
const DRAG_MEDIAN: f64 = 0.03;
/// Standard deviation of its logarithm.
const DRAG_LN_SIGMA: f64 = 1.1;
/// Longest step of the integration, s.
const STEP_S: f64 = 0.02;
/// A step that changes no unknown by more than this share of its sigma ends the iteration.
const SMALL: f64 = 1e-3;
/// Most steps: the problem is nearly linear, three or four are usual.
const MAX_STEPS: usize = 20;
/// Most halvings of a step.
const HALVINGS: i32 = 12;

/// Position and velocity.
#[derive(Clone, Copy, Debug)]
struct Motion {
    p: Vector3<f64>,
    v: Vector3<f64>,
}

/// A fitted law, integrated to the end of its reach.
#[derive(Clone, Debug)]
pub(super) struct Drag {
    end_s: f64,
    /// The states from the end of the stretch on, [`STEP_S`] apart.
    states: Vec<State>,
}

/// Fits the law to the samples within `[from_s, end_s]`, and carries it `reach_s` beyond.
///
/// # Errors
/// [`EstimateError::BadNumber`] as [`check`]; [`EstimateError::TooFewSamples`] where there are not more rows than
/// unknowns; [`EstimateError::Undetermined`] without a position, or where the iteration finds no minimum.
pub(super) fn fit(sources: &[Source], from_s: f64, end_s: f64, reach_s: f64) -> Result<Drag, EstimateError> {
    let sources: Vec<Source> = sources.iter().map(|s| s.within(from_s, end_s)).collect();
    check(&sources)?;
    let rows: usize = 3 * sources.iter().map(|s| s.positions.len() + s.velocities.len()).sum::<usize>();
    if rows <= UNKNOWNS {
        return Err(EstimateError::TooFewSamples {
            what: "drag law".into(),
            needed: UNKNOWNS + 1,
            got: rows,
        });
    }
    let undetermined = |why| EstimateError::Undetermined { what: "drag law".into(), why };
    let mut unknowns = start(&sources).ok_or_else(|| undetermined("there is no position"))?;
    let mut misfit = misfits(&sources, end_s, &unknowns);
    for _ in 0..MAX_STEPS {
        if !misfit.iter().all(|m| m.is_finite()) {
            return Err(undetermined("its motion leaves every bound"));
        }
        let solution = linearised(&sources, end_s, &unknowns, &misfit)
            .solve()
            .ok_or_else(|| undetermined("the samples lie at too few instants"))?;
        let step = Unknowns::from_iterator(solution.coefficients.iter().copied());
        let sigma = |i: usize| solution.variance_of(&unit(i)).sqrt();
        let small = (0..UNKNOWNS).all(|i| step[i].abs() <= SMALL * sigma(i));
        // half the step, and again, until it leads downhill; where none does, rounding hides the rest
        let cost = |misfit: &[f64]| misfit.iter().map(|m| m * m).sum::<f64>();
        let shorter = (0..HALVINGS).map(|i| unknowns + step * 0.5_f64.powi(i));
        let mut tried = shorter.map(|u| (u, misfits(&sources, end_s, &u)));
        let lower = tried.find(|(_, m)| cost(m) < cost(&misfit)).filter(|_| !small);
        let Some(lower) = lower else {
            let noise = solution.residual_sum / (solution.rows - UNKNOWNS) as f64;
            let states = carried(&unknowns, &solution, noise.max(1.0), reach_s);
            return Ok(Drag { end_s, states });
        };
        (unknowns, misfit) = lower;
    }
    Err(undetermined("its fit doesn't converge"))
}

/// The last position and velocity, no force, the drag of the prior.
fn start(sources: &[Source]) -> Option<Unknowns> {
    let last = |q: Quantity| {
        let all = sources.iter().filter_map(|s| s.series(q).last());
        all.max_by(|a, b| a.time_s.total_cmp(&b.time_s))
    };
    let p = last(Quantity::Position)?.value;
    let v = last(Quantity::Velocity).map_or([0.0; 3], |v| v.value);
    let k = DRAG_MEDIAN.ln();
    Some(Unknowns::from_iterator(p.into_iter().chain(v).chain([0.0, 0.0, 0.0, k, k])))
}

/// What the unknowns leave of samples and priors, each over its sigma.
fn misfits(sources: &[Source], end_s: f64, unknowns: &Unknowns) -> Vec<f64> {
    let mut misfits = Vec::new();
    for source in sources {
        let times: Vec<f64> = source.instants().filter_map(|(p, v)| Some(p.or(v)?.time_s)).collect();
        let fitted = motions(unknowns, end_s, &times);
        for ((position, velocity), motion) in source.instants().zip(fitted) {
            for (sample, made) in [(position, motion.p), (velocity, motion.v)] {
                let off = |s: &Sample, axis: usize| (s.value[axis] - made[axis]) / s.sigma[axis];
                misfits.extend(sample.iter().flat_map(|s| [0, 1, 2].map(|axis| off(s, axis))));
            }
        }
    }
    misfits.extend((6..).zip(FORCE_SIGMA).map(|(i, sigma)| -unknowns[i] / sigma));
    misfits.extend([9, 10].map(|i| (DRAG_MEDIAN.ln() - unknowns[i]) / DRAG_LN_SIGMA));
    misfits
}

/// The problem of a Gauss-Newton step: the misfits by their derivatives.
fn linearised(sources: &[Source], end_s: f64, unknowns: &Unknowns, misfit: &[f64]) -> LeastSquares {
    let moved: [Vec<f64>; UNKNOWNS] =
        std::array::from_fn(|i| misfits(sources, end_s, &(unknowns + DIFFERENCE * unit_vector(i))));
    let mut problem = LeastSquares::new(UNKNOWNS);
    for (j, &m) in misfit.iter().enumerate() {
        let row: [f64; UNKNOWNS] = std::array::from_fn(|i| (m - moved[i][j]) / DIFFERENCE);
        problem.push(&row, m);
    }
    problem
}

/// Step of the derivatives by differences, in each unknown's unit.
const DIFFERENCE: f64 = 1e-5;

fn unit(i: usize) -> [f64; UNKNOWNS] {
    std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 })
}

fn unit_vector(i: usize) -> Unknowns {
    Unknowns::from(unit(i))
}

fn acceleration(unknowns: &Unknowns, v: Vector3<f64>) -> Vector3<f64> {
    let (k_h, k_v) = (unknowns[9].exp(), unknowns[10].exp());
    let force = Vector3::new(unknowns[6], unknowns[7], unknowns[8]);
    force - Vector3::new(k_h, k_h, k_v).component_mul(&v) * v.norm()
}

/// One Runge-Kutta step of `h` seconds, which may be negative.
fn step(unknowns: &Unknowns, from: Motion, h: f64) -> Motion {
    let a = |v: Vector3<f64>| acceleration(unknowns, v);
    let (v1, a1) = (from.v, a(from.v));
    let (v2, a2) = (from.v + 0.5 * h * a1, a(from.v + 0.5 * h * a1));
    let (v3, a3) = (from.v + 0.5 * h * a2, a(from.v + 0.5 * h * a2));
    let (v4, a4) = (from.v + h * a3, a(from.v + h * a3));
    Motion {
        p: from.p + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4),
        v: from.v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
    }
}

fn at_end(unknowns: &Unknowns) -> Motion {
    let part = |from: usize| Vector3::new(unknowns[from], unknowns[from + 1], unknowns[from + 2]);
    Motion { p: part(0), v: part(3) }
}

/// The motion at instants in ascending order up to the end, integrated backwards from there.
fn motions(unknowns: &Unknowns, end_s: f64, times: &[f64]) -> Vec<Motion> {
    let (mut motion, mut now_s) = (at_end(unknowns), end_s);
    let mut found: Vec<Motion> = Vec::with_capacity(times.len());
    for &time_s in times.iter().rev() {
        let steps = ((now_s - time_s) / STEP_S).ceil().max(1.0);
        for _ in 0..steps as usize {
            motion = step(unknowns, motion, (time_s - now_s) / steps);
        }
        now_s = time_s;
        found.push(motion);
    }
    found.reverse();
    found
}

/// The states ahead, their sigmas from the fit's covariance by the trajectory's derivatives.
fn carried(unknowns: &Unknowns, solution: &Solution, noise: f64, reach_s: f64) -> Vec<State> {
    let mut motion = at_end(unknowns);
    let changed: [Unknowns; UNKNOWNS] = std::array::from_fn(|i| unknowns + DIFFERENCE * unit_vector(i));
    let mut moved = changed.map(|u| at_end(&u));
    let count = (reach_s / STEP_S).ceil() as usize + 1;
    let mut states = Vec::with_capacity(count + 1);
    for _ in 0..=count {
        let sigma = |of: fn(&Motion) -> &Vector3<f64>| {
            std::array::from_fn(|axis| {
                let row: [f64; UNKNOWNS] =
                    std::array::from_fn(|i| (of(&moved[i])[axis] - of(&motion)[axis]) / DIFFERENCE);
                (noise * solution.variance_of(&row)).sqrt()
            })
        };
        states.push(State {
            position: motion.p.into(),
            velocity: motion.v.into(),
            acceleration: Some(acceleration(unknowns, motion.v).into()),
            position_sigma: sigma(|m| &m.p),
            velocity_sigma: sigma(|m| &m.v),
        });
        motion = step(unknowns, motion, STEP_S);
        for (m, u) in moved.iter_mut().zip(&changed) {
            *m = step(u, *m, STEP_S);
        }
    }
    states
}

impl Curve for Drag {
    /// The state from the end of the stretch up to the reach, between the integration's steps linearly.
    fn at(&self, time_s: f64) -> Option<State> {
        let steps = (time_s - self.end_s) / STEP_S;
        if steps < -1e-9 {
            return None;
        }
        let before = steps.max(0.0) as usize;
        let (a, b) = (self.states.get(before)?, self.states.get(before + 1)?);
        Some(a.mixed(b, steps.max(0.0) - before as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that was pushed up at 15 m/s, with force and drag known, sampled at 50 Hz; by steps of 1 ms.
    fn truth() -> impl Fn(f64) -> Motion {
        let unknowns = Unknowns::from([0.0, 0.0, -50.0, 3.0, -1.0, 15.0, 0.1, 0.0, 0.3, -3.5, -3.9]);
        move |t: f64| {
            let steps = (t / 1e-3).round() as usize;
            (0..steps).fold(at_end(&unknowns), |m, _| step(&unknowns, m, 1e-3))
        }
    }

    fn sampled(end_s: f64) -> Source {
        let truth = truth();
        let times = || (0..=(end_s * 50.0) as usize).map(|i| i as f64 / 50.0);
        let sample = |time_s, value: Vector3<f64>| Sample { time_s, value: value.into(), sigma: [0.01; 3] };
        Source {
            name: "test".into(),
            positions: times().map(|t| sample(t, truth(t).p)).collect(),
            velocities: times().map(|t| sample(t, truth(t).v)).collect(),
        }
    }

    #[test]
    fn a_body_under_drag_is_carried_on_closer_than_its_band() {
        let fitted = fit(&[sampled(2.0)], 0.5, 2.0, 2.0).expect("converges");
        for lead in [0.0, 0.5, 1.3, 2.0] {
            let (state, truth) = (fitted.at(2.0 + lead).expect("within reach"), truth()(2.0 + lead));
            for axis in 0..3 {
                let error = (state.position[axis] - truth.p[axis]).abs();
                assert!(error < 2.0 * state.position_sigma[axis] + 1e-4, "{lead}, {axis}: {error}");
                let error = (state.velocity[axis] - truth.v[axis]).abs();
                assert!(error < 2.0 * state.velocity_sigma[axis] + 1e-3, "{lead}, {axis}: {error}");
            }
            assert!(state.position_sigma[2] < 0.01 + 0.2 * lead, "{}", state.position_sigma[2]);
        }
        assert!(fitted.at(1.9).is_none() && fitted.at(4.5).is_none());
    }

    #[test]
    fn a_motion_beyond_every_number_is_an_error() {
        let mut wild = sampled(1.0);
        wild.velocities.iter_mut().for_each(|v| v.value = [1e9; 3]);
        let found = fit(&[wild], 0.0, 1.0, 2.0);
        assert!(matches!(found, Err(EstimateError::Undetermined { .. })), "{found:?}");
    }

    #[test]
    fn a_wild_or_empty_stretch_is_an_error_and_no_hang() {
        let mut wild = sampled(1.0);
        wild.velocities.iter_mut().for_each(|v| v.value = v.value.map(|x| -1e6 * x));
        if let Ok(drag) = fit(&[wild], 0.0, 1.0, 2.0) {
            assert!(drag.at(1.5).is_none_or(|s| s.position_sigma[0] > 1.0));
        }
        assert!(matches!(fit(&[sampled(1.0)], 5.0, 6.0, 1.0), Err(EstimateError::TooFewSamples { .. })));
    }
}
