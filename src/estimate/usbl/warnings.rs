//! What a person must know of a track.

use super::candidates::square;
use super::dive::Dive;
use super::judging::{Judging, LeftOut};
use super::search::Dispute;
use super::switches::Switches;
use super::verdict::Warning;
use super::wiener::Wiener;
use super::{another, cycles};

/// Of more exchanges thrown out than this share nobody can say that the others are right.
const MANY_WILD: f64 = 0.35;

/// The same of fixes: three in ten that are wild by themselves are usual, and half of an exchange outvotes nobody.
const MANY_WILD_FIXES: f64 = 0.45;

/// More fixes off the depth sensor's depth than this share may be the sensor's own fault.
const MANY_OFF_DEPTH: f64 = 0.35;

/// More positions held than this share are a system's habit, and no chance.
const MANY_HELD: f64 = 0.1;

/// Of so many exchanges in a row no more than so many may be thrown out: with three in ten wild by chance it happens in one
/// dive of twelve.
const STRETCHES: [(usize, usize); 2] = [(6, 5), (12, 7)];

/// Another track is worth a warning when it is this likely beside ours, and so many metres and sigmas off.
const RIVAL_ODDS: f64 = 0.05;
const RIVAL_SIGMAS: f64 = 3.0;
const RIVAL_FIX_SIGMAS: f64 = 5.0;

/// Most stretches in which another track is allowed that are told one by one.
pub(super) const MOST_AMBIGUOUS: usize = 10;

/// More exchanges at which the vehicle is surely too fast are no accident.
const FEW_FAST: usize = 3;
const SURE_SIGMAS: f64 = 2.0;

/// A noise that differs by this factor from what was stated is worth a warning.
const NOISE_FACTOR: f64 = 1.5;

/// So is one that is this many times that of the nearest fixes of one exchange.
const NOISE_WITHIN: f64 = 3.0;

/// All that warnings are made of.
pub(super) struct Evidence<'a> {
    pub(super) dive: &'a Dive,
    pub(super) switches: &'a Switches,
    pub(super) track: &'a Wiener,
    pub(super) disputes: &'a [Dispute],
    pub(super) judging: &'a Judging<'a>,
    /// The noise that was found over that of the dive's fixes, and over what was stated.
    pub(super) fit_scale: [f64; 2],
    /// What the fixes of an exchange have in common.
    pub(super) common_m: [f64; 2],
    pub(super) noise_scale: [f64; 2],
    pub(super) speed_limit_m_s: f64,
}

/// All that is worth one.
pub(super) fn warnings(evidence: &Evidence) -> Vec<Warning> {
    let &Evidence { dive, switches, judging, .. } = evidence;
    let mut warnings = left_out(judging);
    let (rejected, of) = (switches.believed.iter().filter(|b| !**b).count(), dive.exchanges.len());
    let (wild, fixes) = (switches.used.iter().filter(|u| !**u).count(), dive.fixes.len());
    if rejected as f64 > MANY_WILD * of as f64 {
        warnings.push(Warning::ManyWildCycles { rejected, of });
    } else if wild as f64 > MANY_WILD_FIXES * fixes as f64 {
        warnings.push(Warning::ManyWildFixes { rejected: wild, of: fixes });
    }
    warnings.extend(another::track(evidence));
    warnings.extend(wild_stretches(dive, switches));
    warnings.extend(ambiguous(evidence));
    warnings.extend(too_fast(evidence));
    let [h, z] = evidence.fit_scale;
    let found = ((2.0 * h * h + z * z) / 3.0).sqrt();
    if let Some(within) =
        cycles::noise_scale_within(&dive.fixes, dive.exchanges.iter().map(|e| e.fixes.clone()))
            .filter(|within| found > NOISE_WITHIN * within)
    {
        warnings.push(Warning::NoiseWithin { factor: found / within });
    }
    let stated = NOISE_FACTOR.recip()..=NOISE_FACTOR;
    warnings.extend(
        evidence.noise_scale.into_iter().find(|s| !stated.contains(s)).map(|scale| Warning::Noise { scale }),
    );
    warnings
}

/// Where many fixes are out before there is any track.
fn left_out(judging: &Judging) -> Vec<Warning> {
    let LeftOut { held, with_depth, off_depth, off_m } = judging.left_out;
    let mut warnings = Vec::new();
    if off_depth as f64 > MANY_OFF_DEPTH * with_depth as f64 {
        warnings.push(Warning::OffDepth { off: off_depth, of: with_depth, median_m: off_m });
    }
    let of = judging.judged.len();
    if held as f64 > MANY_HELD * of as f64 {
        warnings.push(Warning::Held { held, of });
    }
    warnings
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

/// Where another history of what was wild is nearly as likely.
fn ambiguous(evidence: &Evidence) -> Vec<Warning> {
    let worth = evidence.disputes.iter().filter(|dispute| is_worth_telling(dispute, evidence)).copied();
    let told = |dispute: Dispute| {
        let [from_s, to_s] = [dispute.from, dispute.to].map(|e| evidence.dive.exchanges[e].time_s);
        Warning::Ambiguous { from_s, to_s, apart_m: dispute.apart_m, odds: dispute.log_odds.exp() }
    };
    merged(worth.collect()).into_iter().map(told).collect()
}

/// Those that overlap as one with the worst of each: the likeliest, in order of time.
pub(super) fn merged(mut disputes: Vec<Dispute>) -> Vec<Dispute> {
    disputes.sort_by_key(|dispute| (dispute.from, dispute.to));
    disputes.dedup_by(|next, last| {
        let overlaps = next.from <= last.to;
        if overlaps {
            last.to = last.to.max(next.to);
            last.apart_m = last.apart_m.max(next.apart_m);
            last.log_odds = last.log_odds.max(next.log_odds);
        }
        overlaps
    });
    disputes.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    disputes.truncate(MOST_AMBIGUOUS);
    disputes.sort_by_key(|dispute| dispute.from);
    disputes
}

fn is_worth_telling(dispute: &Dispute, evidence: &Evidence) -> bool {
    let &Evidence { dive, track, common_m: [across, down], .. } = evidence;
    let largest = |sigma: [f64; 3]| sigma.into_iter().fold(0.0, f64::max);
    let fix = &dive.fixes[dive.exchanges[dispute.to].fixes.start];
    // what an exchange has in common is noise of a fix too
    let noise_m = largest(fix.sigma).hypot(across.max(down));
    let sigma_at = |e: usize| largest(track.at(dive.exchanges[e].time_s).position_sigma);
    // what costs most comes last
    dispute.log_odds.exp() > RIVAL_ODDS
        && dispute.apart_m > RIVAL_FIX_SIGMAS * noise_m
        && (dispute.from..=dispute.to).all(|e| dispute.apart_m > RIVAL_SIGMAS * sigma_at(e))
}

/// Where the vehicle is faster than it should be.
fn too_fast(evidence: &Evidence) -> Option<Warning> {
    let &Evidence { dive, switches, track, speed_limit_m_s: limit_m_s, .. } = evidence;
    let (mut exchanges, mut of, mut highest) = (0, 0, 0.0_f64);
    for (&node, _) in dive.node_of.iter().zip(&switches.believed).filter(|(_, believed)| **believed) {
        let axes = [0, 1, 2].map(|axis| track.node(axis, node));
        let speed = square(axes.map(|([_, v], _)| v)).sqrt();
        let sigma = axes.iter().map(|(_, [_, _, vv])| vv.max(0.0)).fold(0.0, f64::max).sqrt();
        of += 1;
        if speed - SURE_SIGMAS * sigma > limit_m_s {
            exchanges += 1;
            highest = highest.max(speed);
        }
    }
    (exchanges > FEW_FAST).then_some(Warning::Fast { exchanges, of, speed_m_s: highest, limit_m_s })
}
