//! A verdict for every fix.

use super::dive::{Dive, height_at};
use super::switches::{Noise, Switches};
use super::verdict::{Judged, Reason, Verdict};
use super::wiener::Wiener;
use super::{Height, Settings, cycles, in_order};
use crate::math::robust;
use crate::sample::Sample;

/// The verdicts while they are made.
pub(super) struct Judging<'a> {
    pub(super) judged: Vec<Judged>,
    /// Indices of the fixes that are neither repeated nor off in depth, in order of time.
    pub(super) usable: Vec<usize>,
    /// How many are left out, and why.
    pub(super) left_out: LeftOut,
    fixes: &'a [Sample],
}

/// Fixes that are out before there is any track.
#[derive(Clone, Copy, Default)]
pub(super) struct LeftOut {
    /// How many have the position of the one before them at another time.
    pub(super) held: usize,
    /// How many have a height of the depth sensor beside them, how many of these are off, and by how much in the median,
    /// m, above it positive.
    pub(super) with_depth: usize,
    pub(super) off_depth: usize,
    pub(super) off_m: f64,
}

impl<'a> Judging<'a> {
    /// `heights` in order of time.
    pub(super) fn new(fixes: &'a [Sample], heights: &[Height], settings: &Settings) -> Self {
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
        let mut left_out = LeftOut::default();
        let mut off_m = Vec::new();
        let mut before: Option<&Sample> = None;
        for i in in_order(fixes) {
            let fix = &fixes[i];
            let same_time = usable.iter().rev().take_while(|&&j| fixes[j].time_s >= fix.time_s);
            let again = same_time.take(cycles::MOST_FIXES).any(|&j| fixes[j].value == fix.value);
            // noise never gives three equal numbers twice: a system that hears nothing says its last fix again
            let held = before.replace(fix).filter(|before| before.value == fix.value);
            if again || held.is_some() {
                (judged[i].verdict, judged[i].reason) = (Verdict::Duplicate, Reason::Repeated);
                left_out.held += usize::from(held.is_some_and(|before| before.time_s < fix.time_s));
                continue;
            }
            if let Some((z_m, sigma_m)) = height_at(heights, fix.time_s) {
                left_out.with_depth += 1;
                let above_m = fix.value[2] - z_m;
                if above_m.abs() > settings.depth_gate_sigmas * fix.sigma[2].hypot(sigma_m) {
                    off_m.push(above_m);
                    (judged[i].verdict, judged[i].reason) = (Verdict::Wild, Reason::OffDepth);
                    continue;
                }
            }
            usable.push(i);
        }
        left_out.off_depth = off_m.len();
        left_out.off_m = robust::median(&mut off_m).unwrap_or(0.0);
        Self { judged, usable, left_out, fixes }
    }

    pub(super) fn judge(&mut self, dive: &Dive, switches: &Switches, track: &Wiener, found: Noise) {
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
            noise[i] = std::array::from_fn(|a| {
                (fix.sigma[a] * found.scale[a / 2]).hypot(found.common_m2[a / 2].sqrt())
            });
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
