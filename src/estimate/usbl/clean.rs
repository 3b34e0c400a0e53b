//! The robust smoother, from fixes to a track, a verdict for each, and warnings.

use super::candidates::{Candidate, Exchange, WildShares, exchanges};
use super::common;
use super::dive::Dive;
use super::judging::{Judging, LeftOut};
use super::search::{Motion, search};
use super::switches::{Noise, Switches};
use super::verdict::{Judged, Warning};
use super::warnings::{Evidence, warnings};
use super::wiener::{Knowledge, Wiener};
use super::{Height, cycles, liveliness};
use crate::estimate::{EstimateError, check_sample};
use crate::math::robust;
use crate::sample::{Quantity, Sample};
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
const ENOUGH: usize = 120;

/// Most rounds in which switches are looked at anew.
const ROUNDS: usize = 4;

/// Steps to the density of the acceleration, from a first guess.
const FIRST_STEPS: usize = 4;

/// Steps with a liveliness that changes in time.
const LIVELY_STEPS: usize = 5;

/// Those of them after which whole exchanges are looked at once more.
const LIVELY_REVISED: std::ops::Range<usize> = 1..3;

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
    /// Standard deviation of what the fixes of one exchange have in common, m, which is part of that: horizontal, vertical.
    pub common_m: [f64; 2],
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

/// Cleans a dive: a track, and a verdict for every fix.
///
/// `fixes` and `heights` may come in any order of time.
///
/// # Errors
/// [`EstimateError::BadNumber`] for a value that is not finite or a sigma that is not positive,
/// [`EstimateError::TooFewSamples`] below four fixes in three exchanges, [`EstimateError::OffDepth`] and
/// [`EstimateError::Held`] where it is for the depth sensor or for repeated positions,
/// [`EstimateError::Undetermined`] where too few fixes agree with each other.
pub fn clean(fixes: &[Sample], heights: &[Height], settings: &Settings) -> Result<Cleaned, EstimateError> {
    checked(fixes, heights)?;
    let mut heights = heights.to_vec();
    heights.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let mut judging = Judging::new(fixes, &heights, settings);
    let usable: Vec<Sample> = judging.usable.iter().map(|&i| fixes[i]).collect();
    let times: Vec<f64> = usable.iter().map(|f| f.time_s).collect();
    let gap_s =
        settings.exchange_gap_s.unwrap_or_else(|| cycles::exchange_gap_s(&times)).max(cycles::LEAST_GAP_S);
    let groups = cycles::group(&times, gap_s);
    for (needed, got) in [(MIN_FIXES, usable.len()), (MIN_CYCLES, groups.len())] {
        if got < needed {
            return Err(too_few(needed, got, fixes.len(), &judging.left_out));
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
    let (mut found, mut candidates) =
        exchanges(&scaled([first_scale; 2]), &groups, PRIOR_WILD, within_m_s, [0.0; 2]);
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
        let other = exchanges(&scaled([1.0; 2]), &groups, PRIOR_WILD, within_m_s, [0.0; 2]);
        let as_stated = likeliest(&other.0, &other.1);
        if as_stated.1 > likelihood {
            (found, candidates, density, first_scale) = (other.0, other.1, as_stated.0, 1.0);
        }
    }
    let first = search(&found, &candidates, PRIOR_WILD, motion([density; 2]));

    // what it says of noise, motion and wild shares, then a second one that knows
    let dive = Dive::new(scaled([first_scale; 2]), found, candidates, &heights);
    let mut switches = Switches::new(&dive, &first.chosen, PRIOR_WILD);
    drop(first);
    let usual_m2 = usual_m2(&dive.fixes);
    // something in common to begin with: nothing would stay nothing
    let noise = Noise { scale: [1.0; 2], common_m2: usual_m2.map(|m2| 0.25 * m2) };
    let mut fit = Fit { noise, usual_m2, density: [density; 2], speed_m_s: 0.5 * settings.speed_limit_m_s };
    fit.settle(&dive, &switches, FIRST_STEPS)?;
    let wild = switches.shares(PRIOR_WILD, PRIOR_WORTH);
    let scale = fit.noise.scale.map(|s| s * first_scale);
    drop(dive); // a second one beside it would be the most memory that is ever needed
    let scaled_fixes = scaled(scale);
    let (found, candidates) = exchanges(&scaled_fixes, &groups, wild, within_m_s, fit.noise.common_m2);
    let second = search(&found, &candidates, wild, motion(fit.density));
    let dive = Dive::new(scaled_fixes, found, candidates, &heights);
    switches = Switches::new(&dive, &second.chosen, wild);
    fit.noise.scale = [1.0; 2];

    // every switch against the track without its exchange
    let mut track = fit.settle(&dive, &switches, FIRST_STEPS / 2)?;
    for _ in 0..ROUNDS {
        if !switches.revise(&dive, &track, fit.noise) {
            break;
        }
        track = fit.settle(&dive, &switches, 1)?;
    }
    track = fit.enliven(&dive, &mut switches, track)?;
    let within = [0, 1].map(|i| scale[i] * fit.noise.scale[i]);
    let common_m = fit.noise.common_m2.map(f64::sqrt);
    // a fix is off by both
    let scale = [0, 1].map(|i| {
        let own = within[i];
        let stated_m2 = fit.usual_m2[i] / (first_scale * first_scale);
        (own * own + fit.noise.common_m2[i] / stated_m2).sqrt()
    });
    judging.judge(&dive, &switches, &track, fit.noise);
    let warnings = warnings(&Evidence {
        dive: &dive,
        switches: &switches,
        track: &track,
        disputes: &second.disputes,
        judging: &judging,
        fit_scale: fit.noise.scale,
        common_m,
        noise_scale: scale,
        speed_limit_m_s: settings.speed_limit_m_s,
    });
    Ok(Cleaned {
        track,
        judged: judging.judged,
        cycle_times_s: dive.exchanges.iter().map(|e| e.time_s).collect(),
        wild_cycles: switches.believed.iter().map(|b| !b).collect(),
        noise_scale: scale,
        common_m,
        acceleration_density: fit.density,
        warnings,
    })
}

fn checked(fixes: &[Sample], heights: &[Height]) -> Result<(), EstimateError> {
    let depth = |h: &Height| Sample { time_s: h.time_s, value: [0.0, 0.0, h.z_m], sigma: [h.sigma_m; 3] };
    fixes.iter().try_for_each(|fix| check_sample("the fixes", Quantity::Position, fix))?;
    heights.iter().try_for_each(|h| check_sample("the depth", Quantity::Position, &depth(h)))
}

/// Why so few fixes can't carry a track: what most of the others are.
fn too_few(needed: usize, got: usize, of: usize, left_out: &LeftOut) -> EstimateError {
    let LeftOut { held, with_depth, off_depth, off_m } = *left_out;
    if off_depth > got.max(held) {
        EstimateError::OffDepth { off: off_depth, of: with_depth, median_m: off_m }
    } else if held > got {
        EstimateError::Held { held, of }
    } else {
        EstimateError::TooFewSamples { what: "usbl".into(), needed, got }
    }
}

/// The median variance of fixes, m^2: horizontal, vertical.
fn usual_m2(fixes: &[Sample]) -> [f64; 2] {
    [0, 2].map(|axis| {
        let mut sigmas: Vec<f64> = fixes.iter().map(|f| f.sigma[axis]).collect();
        robust::median(&mut sigmas).unwrap_or(1.0).powi(2)
    })
}

/// What the smoother has found of motion and noise.
struct Fit {
    noise: Noise,
    /// The median variance of the dive's fixes, m^2: horizontal, vertical.
    usual_m2: [f64; 2],
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
            self.noisy(dive, switches, &track);
            if step == steps {
                return Ok(track);
            }
            let factor = liveliness::factors(&track);
            self.density = [0, 1].map(|i| self.density[i] * factor[i]);
        }
        Err(EstimateError::Undetermined { what: "usbl".into(), why: "the fit didn't end" })
    }

    /// A liveliness that changes in time, and fixes one by one.
    fn enliven(
        &mut self,
        dive: &Dive,
        switches: &mut Switches,
        mut track: Wiener,
    ) -> Result<Wiener, EstimateError> {
        for step in 0..LIVELY_STEPS {
            let densities = liveliness::densities(&track, &dive.nodes_s, &switches.heard(dive), self.density);
            track = self.track(dive, switches, densities)?;
            if LIVELY_REVISED.contains(&step) {
                switches.revise(dive, &track, self.noise);
            } else {
                switches.revise_fixes(dive, &track, self.noise);
            }
            self.noisy(dive, switches, &track);
        }
        Ok(track)
    }

    fn track(
        &self,
        dive: &Dive,
        switches: &Switches,
        density: [Vec<f64>; 3],
    ) -> Result<Wiener, EstimateError> {
        let mut knowledge = vec![[Knowledge::default(); 3]; dive.nodes_s.len()];
        for (e, &node) in dive.node_of.iter().enumerate() {
            if !switches.believed[e] {
                continue;
            }
            for axis in 0..3 {
                let (own, common) = switches.told(dive, e, axis, self.noise);
                knowledge[node][axis].join(&common.taken_from(own));
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
    fn noisy(&mut self, dive: &Dive, switches: &Switches, track: &Wiener) {
        /// What was stated is worth this many fixes.
        const WORTH: f64 = 5.0;
        let (mut squares, mut freedom) = ([WORTH; 2], [WORTH; 2]);
        for (e, exchange) in dive.exchanges.iter().enumerate() {
            let node = dive.node_of[e];
            for axis in 0..3 {
                let (state, covariance) = track.node(axis, node);
                let (_, common) = switches.told(dive, e, axis, self.noise);
                for i in exchange.fixes.clone().filter(|&i| switches.used[i]) {
                    let fix = &dive.fixes[i];
                    let dt = fix.time_s - exchange.time_s;
                    let variance = fix.sigma[axis] * fix.sigma[axis];
                    let (expected, known) = common.expected(dt, state, covariance);
                    let left = fix.value[axis] - expected;
                    let share = known / (variance * self.noise.scale[axis / 2].powi(2));
                    squares[axis / 2] += left * left / variance;
                    freedom[axis / 2] += (1.0 - share).max(0.0);
                }
            }
        }
        self.noise = Noise {
            scale: [0, 1].map(|i| (squares[i] / freedom[i]).sqrt().max(1e-3)),
            common_m2: common::next(dive, switches, track, self.noise, self.usual_m2),
        };
    }
}
