//! A verdict for every fix.

use super::dive::{Dive, height_at};
use super::switches::Switches;
use super::verdict::{Judged, Reason, Verdict};
use super::wiener::Wiener;
use super::{Height, Settings, cycles, in_order};
use crate::sample::Sample;

/// The verdicts while they are made.
pub(super) struct Judging {
    pub(super) judged: Vec<Judged>,
    /// Indices of the fixes that are neither repeated nor off in depth, in order of time.
    pub(super) usable: Vec<usize>,
    fixes: Vec<Sample>,
}

impl Judging {
    pub(super) fn new(fixes: &[Sample], heights: &[Height], settings: &Settings) -> Self {
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

    pub(super) fn judge(&mut self, dive: &Dive, switches: &Switches, track: &Wiener, scale: [f64; 2]) {
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
