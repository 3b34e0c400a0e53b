//! The robust smoother, from fixes to a track, a verdict for each, and warnings.

use super::candidates::{Candidate, Exchange, WildShares, exchanges};
use super::search::{Dispute, Motion, search};
use super::switches::Switches;
use super::verdict::{Judged, Reason, Verdict, Warning};
use super::wiener::{Knowledge, Wiener};
use super::{Height, cycles, in_order, liveliness};
use crate::estimate::{EstimateError, check};
use crate::sample::{Sample, Source};
use crate::track::{Curve, State};

/// What may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The vehicle is rarely faster, m/s. 2.5: twice what a deep submersible does; towed or torpedo-like ones need more.
    pub speed_limit_m_s: f64,
    /// Gap that parts two acoustic exchanges, s; by default [`cycles::exchange_gap_s`].
    pub exchange_gap_s: Option<f64>,
    /// How far a fix's height may be from the depth sensor's, sigmas. 4.5: one good fix in 150,000 is thrown out.
    pub depth_gate_sigmas: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { speed_limit_m_s: 2.5, exchange_gap_s: None, depth_gate_sigmas: 4.5 }
    }
}

/// Fewest fixes, and fewest exchanges that may carry a track.
const MIN_FIXES: usize = 4;
const MIN_CYCLES: usize = 3;

/// Shares of wild fixes and exchanges before anything is known, and how many fixes or exchanges that knowledge is worth.
const PRIOR_WILD: WildShares = WildShares { fix: 0.1, cycle: 0.1 };
const PRIOR_WORTH: f64 = 20.0;

/// The lowest and highest density of the acceleration that are looked at, over the square of the speed limit, as powers
/// of ten: 1/s; and how many.
const DENSITIES: (f64, f64, usize) = (-5.0, -2.0, 5);

/// So many exchanges tell the density well enough for the first search.
const ENOUGH: usize = 300;

/// Most rounds in which switches are looked at anew.
const ROUNDS: usize = 4;

/// Steps to the density of the acceleration, from a first guess.
const FIRST_STEPS: usize = 4;

/// Steps with a liveliness that changes in time.
const LIVELY_STEPS: usize = 5;

/// Those of them after which whole exchanges are looked at once more.
const LIVELY_REVISED: std::ops::Range<usize> = 1..3;

/// Of more exchanges thrown out than this share nobody can say that the others are right.
const MANY_WILD: f64 = 0.35;

/// Of so many exchanges in a row no more than so many may be thrown out: with three in ten wild by chance it happens in one
/// dive of twelve.
const STRETCHES: [(usize, usize); 2] = [(6, 5), (12, 7)];

/// Another track is worth a warning when it is this likely beside ours, and so many metres and sigmas off.
const RIVAL_ODDS: f64 = 0.05;
const RIVAL_SIGMAS: f64 = 3.0;
const RIVAL_FIX_SIGMAS: f64 = 5.0;

/// A noise that differs by this factor from what was stated is worth a warning.
const NOISE_FACTOR: f64 = 1.5;

/// A dive, cleaned.
#[derive(Clone, Debug)]
pub struct Cleaned {
    track: Wiener,
    /// A verdict for every fix that was given, in the order in which they were given.
    pub judged: Vec<Judged>,
    /// The mean times of the exchanges, s.
    pub cycle_times_s: Vec<f64>,
    /// Which of them were thrown out as a whole.
    pub wild_cycles: Vec<bool>,
    /// Standard deviation of the noise over what was stated: horizontal, vertical.
    pub noise_scale: [f64; 2],
    /// Density of the acceleration over the whole dive, m^2/s^3: horizontal, vertical.
    pub acceleration_density: [f64; 2],
    /// What a person must know.
    pub warnings: Vec<Warning>,
}

impl Curve for Cleaned {
    /// The state at any finite time; before the first and after the last exchange the vehicle goes straight on.
    fn at(&self, time_s: f64) -> Option<State> {
        time_s.is_finite().then(|| self.track.at(time_s))
    }
}

/// The dive on which a track is fitted: fixes in order of time, without those that are out from the beginning.
pub(super) struct Dive {
    pub(super) fixes: Vec<Sample>,
    pub(super) exchanges: Vec<Exchange>,
    pub(super) candidates: Vec<Candidate>,
    /// Times of the nodes, s: the exchanges, and in long gaps some more where a height is known.
    pub(super) nodes_s: Vec<f64>,
    /// The node of each exchange.
    pub(super) node_of: Vec<usize>,
    /// What the depth sensor says at the nodes.
    heights: Vec<Option<(f64, f64)>>,
}

/// Cleans a dive: a track, and a verdict for every fix.
///
/// `fixes` and `heights` may come in any order of time.
///
/// # Errors
/// [`EstimateError::BadNumber`] for a value that is not finite or a sigma that is not positive,
/// [`EstimateError::TooFewSamples`] below four fixes in three exchanges, [`EstimateError::Undetermined`] where too few
/// fixes agree with each other.
pub fn clean(fixes: &[Sample], heights: &[Height], settings: &Settings) -> Result<Cleaned, EstimateError> {
    checked(fixes, heights)?;
    let mut judging = Judging::new(fixes, heights, settings);
    let usable: Vec<Sample> = judging.usable.iter().map(|&i| fixes[i]).collect();
    let times: Vec<f64> = usable.iter().map(|f| f.time_s).collect();
    let gap_s =
        settings.exchange_gap_s.unwrap_or_else(|| cycles::exchange_gap_s(&times)).max(cycles::LEAST_GAP_S);
    let groups = cycles::group(&times, gap_s);
    for (needed, got) in [(MIN_FIXES, usable.len()), (MIN_CYCLES, groups.len())] {
        if got < needed {
            return Err(EstimateError::TooFewSamples { what: "usbl".into(), needed, got });
        }
    }
    let mut first_scale = cycles::first_noise_scale(&usable, &groups);
    let scaled = |scale: [f64; 2]| -> Vec<Sample> {
        let by_axis = [scale[0], scale[0], scale[1]];
        let of = |f: &Sample| Sample { sigma: std::array::from_fn(|a| f.sigma[a] * by_axis[a]), ..*f };
        usable.iter().map(of).collect()
    };

    // a first search with a density that suits the dive
    let within_m_s = 0.3 * settings.speed_limit_m_s;
    let (mut found, mut candidates) = exchanges(&scaled([first_scale; 2]), &groups, PRIOR_WILD, within_m_s);
    let motion = |density: [f64; 2]| Motion {
        density: [density[0], density[0], density[1]],
        speed_limit_m_s: settings.speed_limit_m_s,
    };
    let (low, high, count) = DENSITIES;
    let likeliest = |found: &[Exchange], candidates: &[Candidate]| {
        let enough = &found[..found.len().min(ENOUGH)];
        let tried = (0..count).map(|i| {
            let exponent = low + (high - low) * i as f64 / (count - 1) as f64;
            let density = settings.speed_limit_m_s.powi(2) * 10.0_f64.powf(exponent);
            (density, search(enough, candidates, PRIOR_WILD, motion([density; 2])).log_likelihood)
        });
        tried.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((settings.speed_limit_m_s.powi(2), 0.0))
    };
    let (mut density, likelihood) = likeliest(&found, &candidates);
    if first_scale != 1.0 {
        // many wild fixes look like much noise: whichever explains more
        let other = exchanges(&scaled([1.0; 2]), &groups, PRIOR_WILD, within_m_s);
        let as_stated = likeliest(&other.0, &other.1);
        if as_stated.1 > likelihood {
            (found, candidates, density, first_scale) = (other.0, other.1, as_stated.0, 1.0);
        }
    }
    let first = search(&found, &candidates, PRIOR_WILD, motion([density; 2]));

    // what it says of noise, motion and wild shares, then a second one that knows
    let dive = Dive::new(scaled([first_scale; 2]), found, candidates, heights);
    let mut switches = Switches::new(&dive, &first.chosen, PRIOR_WILD);
    let mut fit = Fit { scale: [1.0; 2], density: [density; 2], speed_m_s: 0.5 * settings.speed_limit_m_s };
    fit.settle(&dive, &switches, FIRST_STEPS)?;
    let wild = switches.shares(PRIOR_WILD, PRIOR_WORTH);
    let scale = fit.scale.map(|s| s * first_scale);
    let scaled_fixes = scaled(scale);
    let (found, candidates) = exchanges(&scaled_fixes, &groups, wild, within_m_s);
    let second = search(&found, &candidates, wild, motion(fit.density));
    let dive = Dive::new(scaled_fixes, found, candidates, heights);
    switches = Switches::new(&dive, &second.chosen, wild);
    fit.scale = [1.0; 2];

    // every switch against the track without its exchange
    let mut track = fit.settle(&dive, &switches, FIRST_STEPS / 2)?;
    for _ in 0..ROUNDS {
        if !switches.revise(&dive, &track, fit.scale) {
            break;
        }
        track = fit.settle(&dive, &switches, 1)?;
    }
    // a liveliness that changes in time, and fixes one by one
    for step in 0..LIVELY_STEPS {
        let densities = liveliness::densities(&track, &dive.nodes_s, &switches.heard(&dive), fit.density);
        track = fit.track(&dive, &switches, densities)?;
        if LIVELY_REVISED.contains(&step) {
            switches.revise(&dive, &track, fit.scale);
        } else {
            switches.revise_fixes(&dive, &track, fit.scale);
        }
        fit.noise(&dive, &switches, &track);
    }
    let scale = [scale[0] * fit.scale[0], scale[1] * fit.scale[1]];
    judging.judge(&dive, &switches, &track, fit.scale);
    let warnings = warnings(&dive, &switches, &track, &second.disputes, scale);
    Ok(Cleaned {
        track,
        judged: judging.judged,
        cycle_times_s: dive.exchanges.iter().map(|e| e.time_s).collect(),
        wild_cycles: switches.believed.iter().map(|b| !b).collect(),
        noise_scale: scale,
        acceleration_density: fit.density,
        warnings,
    })
}

fn checked(fixes: &[Sample], heights: &[Height]) -> Result<(), EstimateError> {
    let depths = |h: &Height| Sample { time_s: h.time_s, value: [0.0, 0.0, h.z_m], sigma: [h.sigma_m; 3] };
    let source = |name: &str, positions| Source { name: name.into(), positions, velocities: Vec::new() };
    check(&[source("the fixes", fixes.to_vec()), source("the depth", heights.iter().map(depths).collect())])
}

/// What the smoother has found of motion and noise.
struct Fit {
    /// Standard deviation of the noise over that of the dive's fixes: horizontal, vertical.
    scale: [f64; 2],
    /// Horizontal, vertical.
    density: [f64; 2],
    speed_m_s: f64,
}

impl Fit {
    /// Fits with one density for the whole dive, found by restricted likelihood.
    fn settle(&mut self, dive: &Dive, switches: &Switches, steps: usize) -> Result<Wiener, EstimateError> {
        let intervals = dive.nodes_s.len() - 1;
        for step in 0.. {
            let [h, z] = self.density;
            let track = self.track(dive, switches, [h, h, z].map(|q| vec![q; intervals]))?;
            self.noise(dive, switches, &track);
            if step == steps {
                return Ok(track);
            }
            let factor = liveliness::factors(&track);
            self.density = [0, 1].map(|i| self.density[i] * factor[i]);
        }
        Err(EstimateError::Undetermined { what: "usbl".into(), why: "the fit didn't end" })
    }

    fn track(
        &self,
        dive: &Dive,
        switches: &Switches,
        density: [Vec<f64>; 3],
    ) -> Result<Wiener, EstimateError> {
        let mut knowledge = vec![[Knowledge::default(); 3]; dive.nodes_s.len()];
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            let node = dive.node_of[e];
            for i in exchange.fixes.clone().filter(|&i| switches.used[i]) {
                let fix = &dive.fixes[i];
                for axis in 0..3 {
                    let weight = (fix.sigma[axis] * self.scale[axis / 2]).powi(-2);
                    knowledge[node][axis].add(fix.value[axis], weight, fix.time_s - exchange.time_s);
                }
            }
        }
        for (known, height) in knowledge.iter_mut().zip(&dive.heights) {
            if let Some((z_m, sigma_m)) = height {
                known[2].add(*z_m, sigma_m.powi(-2), 0.0);
            }
        }
        Wiener::fit(&dive.nodes_s, &knowledge, density, self.speed_m_s)
    }

    /// The noise's scale from what is left of the fixes, the track's own share taken out.
    fn noise(&mut self, dive: &Dive, switches: &Switches, track: &Wiener) {
        /// What was stated is worth this many fixes.
        const WORTH: f64 = 5.0;
        let (mut squares, mut freedom) = ([WORTH; 2], [WORTH; 2]);
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            let node = dive.node_of[e];
            for axis in 0..3 {
                let ([p, v], [pp, pv, vv]) = track.node(axis, node);
                for i in exchange.fixes.clone().filter(|&i| switches.used[i]) {
                    let fix = &dive.fixes[i];
                    let dt = fix.time_s - exchange.time_s;
                    let variance = fix.sigma[axis] * fix.sigma[axis];
                    let left = fix.value[axis] - p - dt * v;
                    let share =
                        (pp + 2.0 * dt * pv + dt * dt * vv) / (variance * self.scale[axis / 2].powi(2));
                    squares[axis / 2] += left * left / variance;
                    freedom[axis / 2] += (1.0 - share).max(0.0);
                }
            }
        }
        self.scale = [0, 1].map(|i| (squares[i] / freedom[i]).sqrt().max(1e-3));
    }
}

impl Dive {
    fn new(
        fixes: Vec<Sample>,
        exchanges: Vec<Exchange>,
        candidates: Vec<Candidate>,
        heights: &[Height],
    ) -> Self {
        let mut sorted = heights.to_vec();
        sorted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let centres: Vec<f64> = exchanges.iter().map(|e| e.time_s).collect();
        let usual_s = cycles::cycle_time_s(&centres).unwrap_or(1.0);
        let (mut nodes_s, mut node_of): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
        for time_s in centres {
            if let Some(&last) = nodes_s.last() {
                let between = ((time_s - last) / usual_s) as usize;
                for k in 1..between {
                    let t = last + (time_s - last) * k as f64 / between as f64;
                    if height_at(&sorted, t).is_some() {
                        nodes_s.push(t);
                    }
                }
            }
            let after = nodes_s.last().map_or(f64::NEG_INFINITY, |last| last + 0.05 * cycles::LEAST_GAP_S);
            node_of.push(nodes_s.len());
            nodes_s.push(time_s.max(after));
        }
        let heights = nodes_s.iter().map(|&t| height_at(&sorted, t)).collect();
        Self { fixes, exchanges, candidates, nodes_s, node_of, heights }
    }
}

/// What the depth sensor says at an instant: height and its sigma, between two samples that are close.
fn height_at(sorted: &[Height], time_s: f64) -> Option<(f64, f64)> {
    /// The vehicle sinks evenly for so long.
    const CLOSE_S: f64 = 10.0;
    let after = sorted.partition_point(|h| h.time_s < time_s);
    let next = sorted.get(after)?;
    let last = if next.time_s <= time_s { next } else { sorted.get(after.checked_sub(1)?)? };
    let gap_s = next.time_s - last.time_s;
    let share = if gap_s > 0.0 { (time_s - last.time_s) / gap_s } else { 0.0 };
    (gap_s <= CLOSE_S).then(|| (last.z_m + share * (next.z_m - last.z_m), last.sigma_m.max(next.sigma_m)))
}

/// The verdicts while they are made.
struct Judging {
    judged: Vec<Judged>,
    /// Indices of the fixes that are neither repeated nor off in depth, in order of time.
    usable: Vec<usize>,
    fixes: Vec<Sample>,
}

impl Judging {
    fn new(fixes: &[Sample], heights: &[Height], settings: &Settings) -> Self {
        let mut sorted = heights.to_vec();
        sorted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let unjudged = Judged {
            verdict: Verdict::Kept,
            reason: Reason::Fits,
            late: false,
            cycle: 0,
            residual_m: [0.0; 3],
            residual_sigmas: 0.0,
        };
        let mut judged = vec![unjudged; fixes.len()];
        let mut newest = f64::NEG_INFINITY;
        for (fix, judged) in fixes.iter().zip(&mut judged) {
            judged.late = fix.time_s < newest;
            newest = newest.max(fix.time_s);
        }
        let mut usable: Vec<usize> = Vec::with_capacity(fixes.len());
        for i in in_order(fixes) {
            let fix = &fixes[i];
            let same_time = usable.iter().rev().take_while(|&&j| fixes[j].time_s >= fix.time_s);
            if same_time.take(cycles::MOST_FIXES).any(|&j| fixes[j].value == fix.value) {
                (judged[i].verdict, judged[i].reason) = (Verdict::Duplicate, Reason::Repeated);
                continue;
            }
            let off = height_at(&sorted, fix.time_s).is_some_and(|(z_m, sigma_m)| {
                (fix.value[2] - z_m).abs() > settings.depth_gate_sigmas * fix.sigma[2].hypot(sigma_m)
            });
            if off {
                (judged[i].verdict, judged[i].reason) = (Verdict::Wild, Reason::OffDepth);
                continue;
            }
            usable.push(i);
        }
        Self { judged, usable, fixes: fixes.to_vec() }
    }

    fn judge(&mut self, dive: &Dive, switches: &Switches, track: &Wiener, scale: [f64; 2]) {
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            for i in exchange.fixes.clone().filter(|&i| !switches.used[i]) {
                let reason = if switches.believed[e] { Reason::OffByItself } else { Reason::OffAsCycle };
                (self.judged[self.usable[i]].verdict, self.judged[self.usable[i]].reason) =
                    (Verdict::Wild, reason);
            }
        }
        // noise is that of the dive's fixes where there is one, which is what was stated times what was found
        let mut noise: Vec<[f64; 3]> = self.fixes.iter().map(|f| f.sigma).collect();
        for (fix, &i) in dive.fixes.iter().zip(&self.usable) {
            noise[i] = std::array::from_fn(|a| fix.sigma[a] * scale[a / 2]);
        }
        let centres: Vec<f64> = dive.exchanges.iter().map(|e| e.time_s).collect();
        for ((fix, judged), noise) in self.fixes.iter().zip(&mut self.judged).zip(noise) {
            let after = centres.partition_point(|&t| t < fix.time_s);
            let nearer = |&k: &usize| (centres[k] - fix.time_s).abs();
            let near = [after.saturating_sub(1), after.min(centres.len() - 1)];
            judged.cycle = near.into_iter().min_by(|a, b| nearer(a).total_cmp(&nearer(b))).unwrap_or(0);
            let state = track.at(fix.time_s);
            let mut square = 0.0;
            for a in 0..3 {
                judged.residual_m[a] = fix.value[a] - state.position[a];
                let track_variance = state.position_sigma[a].powi(2);
                // a fix that the track rests on has pulled it: its residual is smaller than its noise
                let sign = if judged.verdict == Verdict::Kept { -1.0 } else { 1.0 };
                let variance = noise[a] * noise[a] + sign * track_variance;
                square += judged.residual_m[a].powi(2) / variance.max(1e-3 * noise[a] * noise[a]);
            }
            judged.residual_sigmas = square.sqrt();
        }
    }
}

/// Where hardly any exchange is believed.
fn wild_stretches(dive: &Dive, switches: &Switches) -> Vec<Warning> {
    let wild: Vec<bool> = switches.believed.iter().map(|b| !b).collect();
    let mut within = vec![false; wild.len()];
    for (length, most) in STRETCHES {
        for (begin, window) in wild.windows(length).enumerate() {
            if window.iter().filter(|w| **w).count() > most {
                within[begin..begin + length].fill(true);
            }
        }
    }
    let mut stretches = Vec::new();
    let mut at = 0;
    for run in within.chunk_by(|a, b| a == b) {
        let of = run.len();
        if run[0] {
            let [from_s, to_s] = [at, at + of - 1].map(|e| dive.exchanges[e].time_s);
            let rejected = wild[at..at + of].iter().filter(|w| **w).count();
            stretches.push(Warning::WildStretch { from_s, to_s, rejected, of });
        }
        at += of;
    }
    stretches
}

fn warnings(
    dive: &Dive,
    switches: &Switches,
    track: &Wiener,
    disputes: &[Dispute],
    noise_scale: [f64; 2],
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let (rejected, of) = (switches.believed.iter().filter(|b| !**b).count(), dive.exchanges.len());
    if rejected as f64 > MANY_WILD * of as f64 {
        warnings.push(Warning::ManyWildCycles { rejected, of });
    }
    warnings.extend(wild_stretches(dive, switches));
    for dispute in disputes {
        let [from_s, to_s] = [dispute.from, dispute.to].map(|e| dive.exchanges[e].time_s);
        let sigma = |e: usize| {
            track.at(dive.exchanges[e].time_s).position_sigma.iter().fold(0.0, |s: f64, v| s.max(*v))
        };
        let sigma = (dispute.from..=dispute.to).map(sigma).fold(0.0, f64::max);
        let odds = dispute.log_odds.exp();
        let fix_sigma =
            dive.fixes[dive.exchanges[dispute.to].fixes.start].sigma.iter().fold(0.0, |s: f64, v| s.max(*v));
        if odds > RIVAL_ODDS
            && dispute.apart_m > RIVAL_SIGMAS * sigma
            && dispute.apart_m > RIVAL_FIX_SIGMAS * fix_sigma
        {
            warnings.push(Warning::Ambiguous { from_s, to_s, apart_m: dispute.apart_m, odds });
        }
    }
    for scale in noise_scale {
        if !(NOISE_FACTOR.recip()..=NOISE_FACTOR).contains(&scale) {
            warnings.push(Warning::Noise { scale });
            break;
        }
    }
    warnings
}
