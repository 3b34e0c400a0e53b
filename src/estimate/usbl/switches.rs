//! The switches, one an exchange and one a fix, each judged by the track without its exchange.

use super::candidates::{WildShares, least_wild_m2, log_normal, log_off, minus, square};
use super::common::Common;
use super::dive::Dive;
use super::wiener::{Knowledge, Wiener};

/// What is found of the noise: horizontal, vertical.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Standard deviation of a fix about its exchange, over that of the dive's fixes.
    pub(super) scale: [f64; 2],
    /// Variance of what an exchange's fixes have in common, m^2.
    pub(super) common_m2: [f64; 2],
}

/// Which exchanges and fixes are believed.
pub(super) struct Switches {
    /// By exchange.
    pub(super) believed: Vec<bool>,
    /// By fix.
    pub(super) used: Vec<bool>,
    wild: WildShares,
}

/// Where the vehicle was at an exchange by all other exchanges: position and velocity by axis, with their covariance.
struct Without {
    state: [[f64; 2]; 3],
    covariance: [[f64; 3]; 3],
}

impl Without {
    /// `None` where nothing else tells.
    fn new(dive: &Dive, switches: &Switches, track: &Wiener, noise: Noise, exchange: usize) -> Option<Self> {
        let (mut state, mut covariance) = ([[0.0; 2]; 3], [[0.0; 3]; 3]);
        for axis in 0..3 {
            let ([p, v], [pp, pv, vv]) = track.node(axis, dive.node_of[exchange]);
            let determinant = pp * vv - pv * pv;
            let mut information = [vv / determinant, -pv / determinant, pp / determinant];
            let mut right =
                [information[0] * p + information[1] * v, information[1] * p + information[2] * v];
            let (own, common) = switches.told(dive, exchange, axis, noise);
            let own = common.taken_from(own);
            (0..3).for_each(|k| information[k] -= own.gram[k]);
            (0..2).for_each(|k| right[k] -= own.right[k]);
            let [a, b, c] = information;
            let determinant = a * c - b * b;
            if !(determinant > 0.0 && a > 0.0) {
                return None;
            }
            covariance[axis] = [c / determinant, -b / determinant, a / determinant];
            let [pp, pv, vv] = covariance[axis];
            state[axis] = [pp * right[0] + pv * right[1], pv * right[0] + vv * right[1]];
        }
        Some(Self { state, covariance })
    }

    /// Position and its variance `dt_s` after the exchange.
    fn at(&self, dt_s: f64) -> ([f64; 3], [f64; 3]) {
        (
            self.state.map(|[p, v]| p + dt_s * v),
            self.covariance.map(|[pp, pv, vv]| pp + 2.0 * dt_s * pv + dt_s * dt_s * vv),
        )
    }
}

impl Switches {
    /// Those of the candidates that are chosen, one an exchange or none.
    pub(super) fn new(dive: &Dive, chosen: &[Option<usize>], wild: WildShares) -> Self {
        let mut switches =
            Self { believed: vec![false; dive.exchanges.len()], used: vec![false; dive.fixes.len()], wild };
        for (e, candidate) in chosen.iter().enumerate() {
            switches.choose(dive, e, *candidate);
        }
        switches
    }

    /// Believes a candidate of an exchange, or none; whether that changed anything.
    fn choose(&mut self, dive: &Dive, exchange: usize, candidate: Option<usize>) -> bool {
        let mut changed = self.believed[exchange] != candidate.is_some();
        self.believed[exchange] = candidate.is_some();
        let members = candidate.map_or(0, |c| dive.candidates[c].members);
        for (bit, i) in dive.exchanges[exchange].fixes.clone().enumerate() {
            let used = members & (1 << bit) != 0;
            changed |= self.used[i] != used;
            self.used[i] = used;
        }
        changed
    }

    /// By node: whether something is believed there.
    pub(super) fn heard(&self, dive: &Dive) -> Vec<bool> {
        let mut heard = vec![false; dive.nodes_s.len()];
        dive.node_of.iter().zip(&self.believed).for_each(|(&node, &believed)| heard[node] = believed);
        heard
    }

    /// What the believed fixes of an exchange say of its node, as if they had nothing in common, and what they have.
    pub(super) fn told(
        &self,
        dive: &Dive,
        exchange: usize,
        axis: usize,
        noise: Noise,
    ) -> (Knowledge, Common) {
        let own = &dive.exchanges[exchange];
        let mut known = Knowledge::default();
        for i in own.fixes.clone().filter(|&i| self.used[i]) {
            let fix = &dive.fixes[i];
            let weight = (fix.sigma[axis] * noise.scale[axis / 2]).powi(-2);
            known.add(fix.value[axis], weight, fix.time_s - own.time_s);
        }
        let common = Common::of(&known, noise.common_m2[axis / 2]);
        (known, common)
    }

    /// Shares of what is wild, with a prior worth so many fixes or exchanges.
    pub(super) fn shares(&self, prior: WildShares, worth: f64) -> WildShares {
        let cycles = self.believed.len() as f64;
        let wild_cycles = self.believed.iter().filter(|b| !**b).count() as f64;
        let used = self.used.iter().filter(|u| **u).count() as f64;
        let in_believed = self.used.len() as f64 * (1.0 - wild_cycles / cycles);
        WildShares {
            fix: ((in_believed - used).max(0.0) + prior.fix * worth) / (in_believed + worth),
            cycle: (wild_cycles + prior.cycle * worth) / (cycles + worth),
        }
    }

    /// Looks at every exchange anew; whether any switch changed.
    pub(super) fn revise(&mut self, dive: &Dive, track: &Wiener, noise: Noise) -> bool {
        let wild = self.wild;
        let mut choices = Vec::new();
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            let Some(without) = Without::new(dive, self, track, noise, e) else { continue };
            let likeliest = &dive.candidates[exchange.candidates.start];
            let (position, variance) = without.at(likeliest.time_s - exchange.time_s);
            let usual = least_wild_m2(likeliest.variance) + variance.iter().sum::<f64>();
            let off = wild.cycle.ln()
                + likeliest.log_inside
                + log_off(square(minus(likeliest.mean, position)), usual);
            let mut best = (None, off);
            for c in exchange.candidates.clone() {
                let candidate = &dive.candidates[c];
                let (position, variance) = without.at(candidate.time_s - exchange.time_s);
                let total = std::array::from_fn(|a| variance[a] + candidate.variance[a]);
                let fits = (1.0 - wild.cycle).ln()
                    + candidate.log_inside
                    + log_normal(minus(candidate.mean, position), total);
                if fits > best.1 {
                    best = (Some(c), fits);
                }
            }
            choices.push((e, best.0));
        }
        let mut changed = false;
        for (e, candidate) in choices {
            changed |= self.choose(dive, e, candidate);
        }
        changed
    }

    /// Looks at every fix of a believed exchange anew.
    pub(super) fn revise_fixes(&mut self, dive: &Dive, track: &Wiener, found: Noise) {
        let wild = self.wild;
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            if !self.believed[e] {
                continue;
            }
            let common: [Common; 3] = std::array::from_fn(|a| self.told(dive, e, a, found).1);
            for i in exchange.fixes.clone() {
                let fix = &dive.fixes[i];
                let dt = fix.time_s - exchange.time_s;
                let noise: [f64; 3] = std::array::from_fn(|a| (fix.sigma[a] * found.scale[a / 2]).powi(2));
                let (mut predicted, mut variance) = ([0.0; 3], [0.0; 3]);
                for a in 0..3 {
                    let (state, covariance) = track.node(a, dive.node_of[e]);
                    let (expected, known) = common[a].expected(dt, state, covariance);
                    // a used fix has pulled the track towards itself
                    let share = if self.used[i] { (known / noise[a]).min(0.9) } else { 0.0 };
                    predicted[a] = (fix.value[a] - expected) / (1.0 - share);
                    variance[a] = noise[a] + known / (1.0 - share);
                }
                let fits = (1.0 - wild.fix).ln() + log_normal(predicted, variance);
                let off = wild.fix.ln() + log_off(square(predicted), least_wild_m2(noise));
                self.used[i] = fits > off;
            }
            self.believed[e] = exchange.fixes.clone().any(|i| self.used[i]);
        }
    }
}
