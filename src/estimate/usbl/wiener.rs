//! A track driven by white acceleration, given what is known at some instants: a cubic smoothing spline as a banded
//! system.
//!
//! The state at node k is position and velocity, x_k = (p_k, v_k). Between two nodes D apart, white acceleration of
//! density q costs
//!
//! ```text
//! 12 / (q D^3) (p' - p - D (v + v') / 2)^2 + 1 / (q D) (v' - v)^2                                      (1)
//! ```
//!
//! which makes a matrix of half-bandwidth 3. Between nodes the track is the cubic through both states, with the
//! variance that (1) leaves between them: nothing is approximated.

use std::sync::Arc;

use crate::estimate::EstimateError;
use crate::math::banded::{Banded, Cholesky};
use crate::math::robust;
use crate::track::State;

/// What was measured of one axis near a node: the normal equations of `p + dt v = z`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Knowledge {
    /// Sums of w, w dt, w dt^2.
    pub(super) gram: [f64; 3],
    /// Sums of w z, w dt z.
    pub(super) right: [f64; 2],
}

impl Knowledge {
    /// Adds what `other` knows.
    pub(super) fn join(&mut self, other: &Self) {
        (0..3).for_each(|k| self.gram[k] += other.gram[k]);
        (0..2).for_each(|k| self.right[k] += other.right[k]);
    }

    /// Adds a position `z` of variance 1/`weight`, `dt_s` after the node.
    pub(super) fn add(&mut self, z: f64, weight: f64, dt_s: f64) {
        self.gram[0] += weight;
        self.gram[1] += weight * dt_s;
        self.gram[2] += weight * dt_s * dt_s;
        self.right[0] += weight * z;
        self.right[1] += weight * dt_s * z;
    }
}

/// One axis of the track at the nodes.
#[derive(Clone, Debug)]
struct Axis {
    /// p_k, v_k one after the other.
    states: Vec<[f64; 1]>,
    /// Shared by axes that were measured alike.
    covariance: Arc<Banded>,
    /// q between node k and the next, m^2/s^3.
    density: Vec<f64>,
}

/// The track.
#[derive(Clone, Debug)]
pub(super) struct Wiener {
    times_s: Vec<f64>,
    axes: [Axis; 3],
}

/// How much of (1) the data use: sums over intervals.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Liveliness {
    /// Of the squared deviations over q.
    pub(super) squares: f64,
    /// Of how many of them the data determine.
    pub(super) determined: f64,
}

/// The two deviations of (1) as rows over (p, v, p', v'), for q = 1.
fn deviations(gap_s: f64) -> [[f64; 4]; 2] {
    let (a, b) = ((12.0 / gap_s.powi(3)).sqrt(), gap_s.recip().sqrt());
    [[-a, -0.5 * a * gap_s, a, -0.5 * a * gap_s], [0.0, -b, 0.0, b]]
}

impl Wiener {
    /// The likeliest track with its covariance.
    ///
    /// `knowledge` is by node and axis, `density` by axis and interval, `speed_m_s` the standard deviation of the
    /// velocity before anything is known.
    ///
    /// # Errors
    /// [`EstimateError::Undetermined`] where the data leave an axis open.
    pub(super) fn fit(
        times_s: &[f64],
        knowledge: &[[Knowledge; 3]],
        density: [Vec<f64>; 3],
        speed_m_s: f64,
    ) -> Result<Self, EstimateError> {
        let open =
            EstimateError::Undetermined { what: "usbl".into(), why: "too few fixes agree with each other" };
        let [x_density, y_density, z_density] = density;
        let alike = x_density == y_density && knowledge.iter().all(|[x, y, _]| x.gram == y.gram);
        let of = |axis: usize| knowledge.iter().map(move |k| &k[axis]);
        let z = fit_axis(times_s, of(2), z_density, speed_m_s, None).ok_or_else(|| open.clone())?;
        let x = fit_axis(times_s, of(0), x_density, speed_m_s, None).ok_or_else(|| open.clone())?;
        let known = alike.then_some((&x.1, &x.0.covariance));
        let y = fit_axis(times_s, of(1), y_density, speed_m_s, known).ok_or(open)?;
        let (x, y, z) = (x.0, y.0, z.0);
        Ok(Self { times_s: times_s.to_vec(), axes: [x, y, z] })
    }

    /// Position and velocity at node `k`, and the covariance: var p, cov, var v.
    pub(super) fn node(&self, axis: usize, k: usize) -> ([f64; 2], [f64; 3]) {
        let Axis { states, covariance, .. } = &self.axes[axis];
        let i = 2 * k;
        (
            [states[i][0], states[i + 1][0]],
            [covariance.get(i, i), covariance.get(i, i + 1), covariance.get(i + 1, i + 1)],
        )
    }

    /// q by interval.
    pub(super) fn density(&self, axis: usize) -> &[f64] {
        &self.axes[axis].density
    }

    /// What the intervals say of q, one after the other.
    pub(super) fn liveliness(&self, axis: usize) -> impl Iterator<Item = Liveliness> {
        let Axis { states, covariance, density } = &self.axes[axis];
        self.times_s.windows(2).zip(density).enumerate().map(move |(k, (pair, q))| {
            let mut sum = Liveliness::default();
            for row in deviations(pair[1] - pair[0]) {
                let deviation: f64 = (0..4).map(|j| row[j] * states[2 * k + j][0]).sum();
                sum.squares += deviation * deviation / q;
                sum.determined += (1.0 - covariance.quadratic_form(2 * k, &row) / q).clamp(0.0, 1.0);
            }
            sum
        })
    }

    /// The state at any instant; beyond the ends the vehicle goes straight on.
    pub(super) fn at(&self, time_s: f64) -> State {
        let last = self.times_s.len() - 1;
        let k = self.times_s.partition_point(|t| *t <= time_s).saturating_sub(1);
        let mut state = State { acceleration: Some([0.0; 3]), ..State::default() };
        for axis in 0..3 {
            let (position, velocity, acceleration) = if k == last || time_s < self.times_s[0] {
                let ([p, v], covariance) = self.node(axis, k);
                let dt = time_s - self.times_s[k];
                let q = self.axes[axis].density.get(k.min(last.saturating_sub(1))).copied().unwrap_or(0.0);
                let [pp, _, vv] = carried(covariance, dt, q);
                ([p + dt * v, pp], [v, vv], 0.0)
            } else {
                self.between(axis, k, time_s)
            };
            [state.position[axis], state.position_sigma[axis]] = [position[0], position[1].max(0.0).sqrt()];
            [state.velocity[axis], state.velocity_sigma[axis]] = [velocity[0], velocity[1].max(0.0).sqrt()];
            if let Some(a) = state.acceleration.as_mut() {
                a[axis] = acceleration;
            }
        }
        state
    }

    /// Position and velocity with their variances, and the acceleration, between node `k` and the next.
    fn between(&self, axis: usize, k: usize, time_s: f64) -> ([f64; 2], [f64; 2], f64) {
        let Axis { states, covariance, density } = &self.axes[axis];
        let gap = self.times_s[k + 1] - self.times_s[k];
        let (a, b) = (time_s - self.times_s[k], self.times_s[k + 1] - time_s);
        let s = a / gap;
        let position = [
            (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s),
            a * (1.0 - s) * (1.0 - s),
            s * s * (3.0 - 2.0 * s),
            -a * s * (1.0 - s),
        ];
        let velocity = [
            -6.0 * s * (1.0 - s) / gap,
            (1.0 - s) * (1.0 - 3.0 * s),
            6.0 * s * (1.0 - s) / gap,
            s * (3.0 * s - 2.0),
        ];
        let bend = [
            (12.0 * s - 6.0) / (gap * gap),
            (6.0 * s - 4.0) / gap,
            (6.0 - 12.0 * s) / (gap * gap),
            (6.0 * s - 2.0) / gap,
        ];
        let value = |row: &[f64; 4]| (0..4).map(|j| row[j] * states[2 * k + j][0]).sum::<f64>();
        let [free_p, free_v] = bridge(density[k], a, b);
        let variance = |row: &[f64; 4]| covariance.quadratic_form(2 * k, row);
        (
            [value(&position), variance(&position) + free_p],
            [value(&velocity), variance(&velocity) + free_v],
            value(&bend),
        )
    }
}

/// The covariance (var p, cov, var v) `dt_s` later.
pub(super) fn carried([pp, pv, vv]: [f64; 3], dt_s: f64, q: f64) -> [f64; 3] {
    let size = dt_s.abs();
    [
        pp + 2.0 * dt_s * pv + dt_s * dt_s * vv + q * size.powi(3) / 3.0,
        pv + dt_s * vv + 0.5 * q * size * dt_s,
        vv + q * size,
    ]
}

/// Variances of position and velocity `a` seconds after one known state and `b` before another.
fn bridge(q: f64, a: f64, b: f64) -> [f64; 2] {
    if a <= 0.0 || b <= 0.0 {
        return [0.0; 2];
    }
    let (pp, pv, vv) =
        (12.0 * (a.powi(-3) + b.powi(-3)), 6.0 * (b.powi(-2) - a.powi(-2)), 4.0 * (a.recip() + b.recip()));
    let determinant = pp * vv - pv * pv;
    [q * vv / determinant, q * pp / determinant]
}

/// One axis, with its factor; `known` are factor and covariance of an axis that was measured alike.
fn fit_axis<'a>(
    times_s: &[f64],
    knowledge: impl Iterator<Item = &'a Knowledge> + Clone,
    density: Vec<f64>,
    speed_m_s: f64,
    known: Option<(&Arc<Cholesky>, &Arc<Banded>)>,
) -> Option<(Axis, Arc<Cholesky>)> {
    let n = times_s.len();
    let mut states = vec![[0.0]; 2 * n];
    for (k, known) in knowledge.clone().enumerate() {
        states[2 * k][0] = known.right[0];
        states[2 * k + 1][0] = known.right[1];
    }
    let (cholesky, covariance) = if let Some((cholesky, covariance)) = known {
        (Arc::clone(cholesky), Arc::clone(covariance))
    } else {
        let cholesky = Arc::new(normal_equations(times_s, knowledge, &density, speed_m_s).cholesky()?);
        let covariance = Arc::new(cholesky.selected_inverse());
        (cholesky, covariance)
    };
    cholesky.solve(&mut states);
    Some((Axis { states, covariance, density }, cholesky))
}

fn normal_equations<'a>(
    times_s: &[f64],
    knowledge: impl Iterator<Item = &'a Knowledge>,
    density: &[f64],
    speed_m_s: f64,
) -> Banded {
    let mut gram = Banded::zeros(2 * times_s.len(), 3);
    for (k, known) in knowledge.enumerate() {
        let [w, wt, wtt] = known.gram;
        gram.add_block(2 * k, &[[w, wt], [wt, wtt]]);
    }
    gram.add_to_diagonal(1, speed_m_s.powi(-2));
    for (k, pair) in times_s.windows(2).enumerate() {
        for row in deviations(pair[1] - pair[0]) {
            gram.add_outer(2 * k, &row, density[k].recip());
        }
    }
    gram
}

/// The median time between nodes, s.
pub(super) fn usual_gap_s(times_s: &[f64]) -> f64 {
    robust::median(&mut times_s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>()).unwrap_or(1.0)
}
