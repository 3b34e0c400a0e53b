//! What a USBL system says of a dive: a few fixes from every acoustic exchange, some of them wild.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::sample::Sample;
use crate::simulate::trajectory::Trajectory;

/// How a dive is watched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UsblConstants {
    /// Time from exchange to exchange, s.
    pub cycle_s: f64,
    /// Standard deviation of an exchange's instant about its due time, s.
    pub jitter_s: f64,
    /// Fewest and most fixes of one exchange.
    pub fixes: [u32; 2],
    /// Time from one fix of an exchange to the next, s.
    pub spacing_s: f64,
    /// Standard deviation of the noise an axis, m.
    pub sigma_m: f64,
    /// Standard deviation of what all fixes of an exchange are off by beside that, m.
    pub common_sigma_m: f64,
    /// Share of fixes that are wild by themselves.
    pub wild_fixes: f64,
    /// Share of exchanges that are wild as a whole: all their fixes off by the same vector.
    pub wild_cycles: f64,
    /// How far off a wild fix or exchange is before its noise, m; evenly in the logarithm, any direction.
    pub wild_m: [f64; 2],
    /// Share of exchanges that are lost.
    pub lost_cycles: f64,
    /// How long nothing is heard, once in the dive, s; 0: never.
    pub silence_s: f64,
    /// The silence lies at least so far from the dive's begin and end, s.
    pub silence_margin_s: f64,
}

impl Default for UsblConstants {
    fn default() -> Self {
        Self {
            cycle_s: 20.0,
            jitter_s: 0.3,
            fixes: [3, 6],
            spacing_s: 0.5,
            sigma_m: 3.0,
            common_sigma_m: 0.0,
            wild_fixes: 0.0,
            wild_cycles: 0.0,
            wild_m: [15.0, 300.0],
            lost_cycles: 0.0,
            silence_s: 240.0,
            silence_margin_s: 300.0,
        }
    }
}

/// A fix, and whether it is wild.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedFix {
    /// The fix with its stated noise.
    pub sample: Sample,
    /// Whether more than noise moved it.
    pub wild: bool,
}

/// All that was heard in a dive.
#[derive(Clone, Debug, PartialEq)]
pub struct UsblRecord {
    /// The fixes in order of time.
    pub fixes: Vec<SimulatedFix>,
    /// Begin and end of the silence, s.
    pub silence_s: Option<[f64; 2]>,
}

/// A vector of any direction whose length is even in the logarithm.
fn offset([least, most]: [f64; 2], rng: &mut impl Rng) -> Vector3<f64> {
    let up = 2.0 * rng.random::<f64>() - 1.0;
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let level = (1.0 - up * up).sqrt();
    Vector3::new(level * cos, level * sin, up) * (least * (most / least).powf(rng.random::<f64>()))
}

/// What is heard of the dive between 0 and `duration_s`; everything random from `rng`.
#[must_use]
pub fn watch_by_usbl(
    trajectory: &Trajectory,
    duration_s: f64,
    constants: &UsblConstants,
    rng: &mut impl Rng,
) -> UsblRecord {
    let c = constants;
    let room_s = duration_s - c.silence_s - 2.0 * c.silence_margin_s;
    let begin_s = c.silence_margin_s + room_s.max(0.0) * rng.random::<f64>();
    let silence_s = (c.silence_s > 0.0).then_some([begin_s, begin_s + c.silence_s]);
    let heard = |t: f64| (0.0..=duration_s).contains(&t) && silence_s.is_none_or(|[a, b]| t < a || t > b);
    let mut fixes = Vec::new();
    for cycle in 0..(duration_s / c.cycle_s) as u32 {
        let late: f64 = StandardNormal.sample(rng);
        let at_s = (f64::from(cycle) + 0.25) * c.cycle_s + c.jitter_s * late.clamp(-3.0, 3.0);
        let lost = rng.random::<f64>() < c.lost_cycles;
        let wild = (rng.random::<f64>() < c.wild_cycles).then(|| offset(c.wild_m, rng));
        let mut common = Vector3::zeros();
        if c.common_sigma_m > 0.0 {
            common = Vector3::from_fn(|_, _| StandardNormal.sample(rng)) * c.common_sigma_m;
        }
        for k in 0..rng.random_range(c.fixes[0]..=c.fixes[1]) {
            let time_s = at_s + f64::from(k) * c.spacing_s;
            let own = (rng.random::<f64>() < c.wild_fixes).then(|| offset(c.wild_m, rng));
            let noise = Vector3::from_fn(|_, _| StandardNormal.sample(rng)) * c.sigma_m;
            if lost || !heard(time_s) {
                continue;
            }
            let off = wild.or(own);
            let value = trajectory.at(time_s).position + common + noise + off.unwrap_or_default();
            let sample =
                Sample { time_s, value: value.into(), sigma: [c.sigma_m.hypot(c.common_sigma_m); 3] };
            fixes.push(SimulatedFix { sample, wild: off.is_some() });
        }
    }
    UsblRecord { fixes, silence_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{DiveConstants, dive};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_record_has_the_noise_the_wild_share_and_the_silence_that_were_asked_for() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth = dive(&DiveConstants::default(), &mut rng);
        let asked = UsblConstants { wild_fixes: 0.3, ..UsblConstants::default() };
        let record = watch_by_usbl(&truth, 3600.0, &asked, &mut rng);
        let [from, to] = record.silence_s.expect("one");
        assert!((to - from - 240.0).abs() < 1e-9);
        assert!(record.fixes.iter().all(|f| f.sample.time_s <= from || f.sample.time_s >= to));
        let (wild, good): (Vec<SimulatedFix>, Vec<SimulatedFix>) =
            record.fixes.iter().copied().partition(|f| f.wild);
        let share = wild.len() as f64 / record.fixes.len() as f64;
        assert!((share - 0.3).abs() < 0.05, "{share}");
        let squares: f64 = good
            .iter()
            .map(|f| (truth.at(f.sample.time_s).position - Vector3::from(f.sample.value)).norm_squared())
            .sum();
        let sigma = (squares / (3.0 * good.len() as f64)).sqrt();
        assert!((sigma - 3.0).abs() < 0.2, "{sigma}");
        let per_cycle = record.fixes.len() as f64 / 168.0;
        assert!((per_cycle - 4.5).abs() < 0.3, "{per_cycle}");
    }
}
