//! Which exchanges to believe, and which of their fixes: a beam of Kalman filters with switches.

use super::candidates::{Candidate, Exchange, WildShares, least_wild_m2, log_normal, log_off, minus, square};
use super::wiener::carried;

/// Histories that are followed at once.
const BEAM: usize = 8;

/// Exchanges of which the first may be all wild.
const LATEST_START: usize = 8;

/// Two histories are one whose states differ by less than this many sigmas.
const SAME_SIGMAS: f64 = 0.7;

/// A history that loses by more than this has no say, as a logarithm.
const RIVAL: f64 = 4.0;

/// Beyond this many exchanges two histories that still differ are not followed back.
const LONGEST_DISPUTE: usize = 200;

/// No history.
const NONE: u32 = u32::MAX;

/// What the search knows of the vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Density of the acceleration by axis, m^2/s^3.
    pub(super) density: [f64; 3],
    /// It is rarely faster, m/s.
    pub(super) speed_limit_m_s: f64,
}

/// What was decided, and how sure that is.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// By exchange: the candidate that is believed, if any.
    pub(super) chosen: Vec<Option<usize>>,
    /// Log likelihood of the fixes, up to a constant.
    pub(super) log_likelihood: f64,
    /// Where another history was nearly as likely.
    pub(super) disputes: Vec<Dispute>,
}

/// Two histories that explain the same exchanges nearly as well.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dispute {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) apart_m: f64,
    pub(super) log_odds: f64,
}

/// A filter's state and its history.
#[derive(Clone, Copy, Debug)]
struct History {
    /// Position and velocity by axis.
    state: [[f64; 2]; 3],
    /// Variance of the position, covariance, variance of the velocity by axis.
    covariance: [[f64; 3]; 3],
    score: f64,
    past: u32,
}

/// One decision of a history.
#[derive(Clone, Copy, Debug)]
struct Step {
    past: u32,
    /// Candidate, or [`NONE`].
    candidate: u32,
    rival: u32,
    rival_log_odds: f32,
    position: [f32; 3],
}

/// A decision that could be taken: whose, which, how good.
#[derive(Clone, Copy, Debug)]
struct Choice {
    history: usize,
    candidate: Option<usize>,
    score: f64,
}

/// The likeliest history of all.
pub(super) fn search(
    exchanges: &[Exchange],
    candidates: &[Candidate],
    wild: WildShares,
    motion: Motion,
) -> Found {
    let mut beam = Beam::new(wild, motion);
    exchanges.iter().for_each(|exchange| beam.step(exchange, candidates));
    beam.found()
}

/// Histories, the likeliest first.
#[derive(Clone, Debug)]
pub(super) struct Beam {
    wild: WildShares,
    motion: Motion,
    histories: Vec<History>,
    steps: Vec<Step>,
    /// The first step of each exchange.
    firsts: Vec<usize>,
    /// Times and likeliest candidates of the first exchanges.
    early: Vec<(f64, Candidate)>,
    now_s: f64,
}

impl Beam {
    pub(super) fn new(wild: WildShares, motion: Motion) -> Self {
        let (histories, steps, firsts, early) = Default::default();
        Self { wild, motion, histories, steps, firsts, early, now_s: f64::NEG_INFINITY }
    }

    /// Takes an exchange in, `candidates` being those that its range means.
    pub(super) fn step(&mut self, exchange: &Exchange, candidates: &[Candidate]) {
        let dt_s = exchange.time_s - self.now_s;
        self.histories.iter_mut().for_each(|h| h.carry(dt_s, self.motion.density));
        self.now_s = exchange.time_s;
        let own = &candidates[exchange.candidates.clone()];
        let mut choices = Vec::with_capacity(self.histories.len() * (1 + own.len()));
        for (i, history) in self.histories.iter().enumerate() {
            let off = history.off(&own[0], self.wild);
            choices.push(Choice { history: i, candidate: None, score: history.score + off });
            for (c, candidate) in own.iter().enumerate() {
                let score = history.score + history.fits(candidate, exchange.time_s, self.wild);
                choices.push(Choice { history: i, candidate: Some(exchange.candidates.start + c), score });
            }
        }
        self.firsts.push(self.steps.len());
        choices.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut next: Vec<History> = Vec::with_capacity(BEAM + own.len());
        for choice in &choices {
            if next.len() == BEAM {
                break;
            }
            let mut history = self.histories[choice.history];
            history.score = choice.score;
            if let Some(c) = choice.candidate {
                history.update(&candidates[c], exchange.time_s);
                history.limit(self.motion.speed_limit_m_s);
            }
            keep(history, choice.candidate, &mut next, &mut self.steps);
        }
        if self.early.len() < LATEST_START {
            for (c, candidate) in own.iter().enumerate() {
                let history = History::start(candidate, exchange.time_s, &self.early, self.wild, self.motion);
                keep(history, Some(exchange.candidates.start + c), &mut next, &mut self.steps);
            }
            self.early.push((exchange.time_s, own[0]));
        }
        next.sort_by(|a, b| b.score.total_cmp(&a.score));
        next.truncate(BEAM);
        self.histories = next;
    }

    /// The likeliest history's decisions.
    fn found(&self) -> Found {
        let Some(best) = self.histories.first() else {
            return Found { chosen: Vec::new(), log_likelihood: f64::NEG_INFINITY, disputes: Vec::new() };
        };
        let mut found = trace(best, &self.steps, &self.firsts);
        for rival in &self.histories[1..] {
            let log_odds = rival.score - best.score;
            if log_odds > -RIVAL {
                found.disputes.push(dispute(best.past, rival.past, log_odds, &self.steps, &self.firsts));
            }
        }
        found
    }

    /// Forgets the decisions, which only [`search`] needs, and counts the likelihood from here on; returns what it was.
    pub(super) fn forget(&mut self) -> f64 {
        self.steps.clear();
        self.firsts.clear();
        let best = self.histories.first().map_or(0.0, |h| h.score);
        for history in &mut self.histories {
            history.past = NONE;
            history.score -= best;
        }
        best
    }

    /// Position and velocity with their variances by axis at a later instant, all histories taken together.
    pub(super) fn at(&self, time_s: f64) -> Option<[[[f64; 2]; 2]; 3]> {
        let best = self.histories.first()?.score;
        let dt_s = (time_s - self.now_s).max(0.0);
        let mut sums = [[[0.0; 2]; 2]; 3];
        let mut total = 0.0;
        for history in &self.histories {
            let weight = (history.score - best).exp();
            let mut history = *history;
            history.carry(dt_s, self.motion.density);
            total += weight;
            for axis in 0..3 {
                let [pp, _, vv] = history.covariance[axis];
                for (k, variance) in [pp, vv].into_iter().enumerate() {
                    let value = history.state[axis][k];
                    // about the likeliest history's, or the squares would lose their digits
                    let apart = value - self.histories[0].ahead(axis, dt_s)[k];
                    sums[axis][k][0] += weight * apart;
                    sums[axis][k][1] += weight * (variance + apart * apart);
                }
            }
        }
        for (axis, sum) in sums.iter_mut().enumerate() {
            let ahead = self.histories[0].ahead(axis, dt_s);
            for (k, [mean, square]) in sum.iter_mut().enumerate() {
                let apart = *mean / total;
                *square = *square / total - apart * apart;
                *mean = ahead[k] + apart;
            }
        }
        Some(sums)
    }
}

/// Keeps a history, or has it as the rival of one that is now the same.
fn keep(mut history: History, candidate: Option<usize>, next: &mut Vec<History>, steps: &mut Vec<Step>) {
    let step = Step {
        past: history.past,
        candidate: candidate.map_or(NONE, |c| c as u32),
        rival: NONE,
        rival_log_odds: f32::NEG_INFINITY,
        position: history.state.map(|s| s[0] as f32),
    };
    history.past = steps.len() as u32;
    if let Some(same) = next.iter_mut().find(|other| other.same(&history)) {
        let log_odds = (history.score - same.score) as f32;
        if log_odds > 0.0 {
            let rival = same.past;
            *same = history;
            steps.push(Step { rival, rival_log_odds: -log_odds, ..step });
        } else if f64::from(log_odds) > -RIVAL && log_odds > steps[same.past as usize].rival_log_odds {
            steps.push(step);
            steps[same.past as usize].rival = history.past;
            steps[same.past as usize].rival_log_odds = log_odds;
        }
        return;
    }
    steps.push(step);
    next.push(history);
}

/// The decisions of a history, and its rivals on the way.
fn trace(best: &History, steps: &[Step], firsts: &[usize]) -> Found {
    let mut chosen = vec![None; firsts.len()];
    let mut disputes = Vec::new();
    let mut at = best.past;
    while at != NONE {
        let step = &steps[at as usize];
        let exchange = exchange_of(at, firsts);
        chosen[exchange] = (step.candidate != NONE).then_some(step.candidate as usize);
        if step.rival != NONE {
            disputes.push(dispute(at, step.rival, f64::from(step.rival_log_odds), steps, firsts));
        }
        at = step.past;
    }
    Found { chosen, log_likelihood: best.score, disputes }
}

fn exchange_of(step: u32, firsts: &[usize]) -> usize {
    firsts.partition_point(|&first| first <= step as usize) - 1
}

/// Where two histories part, and how far they are apart.
fn dispute(mut a: u32, mut b: u32, log_odds: f64, steps: &[Step], firsts: &[usize]) -> Dispute {
    let to = exchange_of(a, firsts);
    let mut found = Dispute { from: to, to, apart_m: 0.0, log_odds };
    for _ in 0..LONGEST_DISPUTE {
        if a == b || a == NONE || b == NONE {
            break;
        }
        let (ea, eb) = (exchange_of(a, firsts), exchange_of(b, firsts));
        let (step_a, step_b) = (&steps[a as usize], &steps[b as usize]);
        if ea == eb {
            let apart = minus(step_a.position.map(f64::from), step_b.position.map(f64::from));
            found.apart_m = found.apart_m.max(square(apart).sqrt());
            found.from = ea;
        }
        if ea >= eb {
            a = step_a.past;
        }
        if eb >= ea {
            b = step_b.past;
        }
    }
    found
}

impl History {
    /// One that believes `first` and nothing before.
    fn start(
        first: &Candidate,
        time_s: f64,
        early: &[(f64, Candidate)],
        wild: WildShares,
        motion: Motion,
    ) -> Self {
        let speed = 0.5 * motion.speed_limit_m_s;
        let mut score = (1.0 - wild.cycle).ln() + first.log_inside;
        for (other_s, other) in early {
            let far = motion.speed_limit_m_s * (time_s - other_s);
            let usual = least_wild_m2(other.variance) + far * far;
            score +=
                wild.cycle.ln() + other.log_inside + log_off(square(minus(other.mean, first.mean)), usual);
        }
        Self {
            state: first.mean.map(|p| [p, 0.0]),
            covariance: first.variance.map(|v| [v, 0.0, speed * speed]),
            score,
            past: NONE,
        }
    }

    /// Position and velocity of an axis `dt_s` later.
    fn ahead(&self, axis: usize, dt_s: f64) -> [f64; 2] {
        let [p, v] = self.state[axis];
        [p + dt_s * v, v]
    }

    fn carry(&mut self, dt_s: f64, density: [f64; 3]) {
        for axis in 0..3 {
            self.state[axis] = self.ahead(axis, dt_s);
            self.covariance[axis] = carried(self.covariance[axis], dt_s, density[axis]);
        }
    }

    fn position_variance(&self) -> [f64; 3] {
        self.covariance.map(|c| c[0])
    }

    /// Log likelihood of an exchange that is off as a whole.
    fn off(&self, likeliest: &Candidate, wild: WildShares) -> f64 {
        let apart = minus(likeliest.mean, self.state.map(|s| s[0]));
        let known: f64 = self.position_variance().iter().sum();
        let usual = least_wild_m2(likeliest.variance) + known;
        wild.cycle.ln() + likeliest.log_inside + log_off(square(apart), usual)
    }

    /// Log likelihood of an exchange whose fixes in `candidate` are right.
    fn fits(&self, candidate: &Candidate, time_s: f64, wild: WildShares) -> f64 {
        let dt = candidate.time_s - time_s;
        let apart = std::array::from_fn(|a| candidate.mean[a] - self.state[a][0] - dt * self.state[a][1]);
        let variance = std::array::from_fn(|a| self.covariance[a][0] + candidate.variance[a]);
        (1.0 - wild.cycle).ln() + candidate.log_inside + log_normal(apart, variance)
    }

    fn update(&mut self, candidate: &Candidate, time_s: f64) {
        let dt = candidate.time_s - time_s;
        for axis in 0..3 {
            let [p, v] = &mut self.state[axis];
            let [pp, pv, vv] = &mut self.covariance[axis];
            let (gain_p, gain_v) = (*pp + dt * *pv, *pv + dt * *vv);
            let total = candidate.variance[axis] + gain_p + dt * gain_v;
            let innovation = candidate.mean[axis] - *p - dt * *v;
            *p += gain_p / total * innovation;
            *v += gain_v / total * innovation;
            *pp -= gain_p * gain_p / total;
            *pv -= gain_p * gain_v / total;
            *vv -= gain_v * gain_v / total;
        }
    }

    /// Takes the likelihood of a history that is faster than the vehicle can be.
    fn limit(&mut self, limit_m_s: f64) {
        let speed = square(self.state.map(|s| s[1])).sqrt();
        let excess = (speed - limit_m_s).max(0.0);
        let variance =
            self.covariance.iter().map(|c| c[2]).fold(0.0, f64::max) + 0.01 * limit_m_s * limit_m_s;
        self.score -= 0.5 * excess * excess / variance;
    }

    fn same(&self, other: &Self) -> bool {
        (0..3).all(|axis| {
            let (a, b) = (&self.state[axis], &other.state[axis]);
            let (ca, cb) = (&self.covariance[axis], &other.covariance[axis]);
            let near = |d: f64, variance: f64| d * d < SAME_SIGMAS * SAME_SIGMAS * variance;
            near(a[0] - b[0], ca[0].min(cb[0])) && near(a[1] - b[1], ca[2].min(cb[2]))
        })
    }
}
