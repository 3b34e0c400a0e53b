//! What a person must know of a track.

use super::dive::Dive;
use super::search::Dispute;
use super::switches::Switches;
use super::verdict::Warning;
use super::wiener::Wiener;

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

/// All that is worth one.
pub(super) fn warnings(
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
