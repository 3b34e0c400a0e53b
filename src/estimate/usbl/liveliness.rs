//! How lively the vehicle is: the density of its acceleration, over the dive and about every instant.
//!
//! With d the deviations of an interval (`wiener`, eq. 1, for q = 1) and g how many of them the data determine, restricted
//! likelihood has its maximum where
//!
//! ```text
//! q = sum d^2 / sum g                                                                                  (1)
//! ```
//!
//! a fixed point (MacKay 1992) that is reached in a few steps. About an instant the sums go over a window, with a few
//! deviations of the whole dive's density added.

use super::wiener::{Liveliness, Wiener};

/// Half the window about an interval, s: half a turn of a heavy vehicle.
const HALF_WINDOW_S: f64 = 30.0;

/// The whole dive's density is worth this many deviations.
const PRIOR_COUNT: f64 = 1.0;

/// Half the window for intervals in which nothing is heard, s: longer than a leg.
const HALF_SILENCE_S: f64 = 600.0;

/// In silence the whole dive's density is worth this long, s.
const SILENCE_PRIOR_S: f64 = 300.0;

/// A mean over the few turns that were heard is unsure, and turns aren't normal numbers: the density is so much higher than
/// the mean for a 95 % band. Chosen on simulated dives (seeds 1001 to 1100).
const UNSURE: f64 = 1.35;

/// An interval is a silence that is this many times the usual one.
const SILENCE: f64 = 4.5;

/// What the density has to be multiplied by: horizontal, vertical.
pub(super) fn factors(track: &Wiener) -> [f64; 2] {
    [0..2, 2..3].map(|axes| {
        let mut sum = Liveliness { squares: 0.1, determined: 0.1 };
        for own in axes.flat_map(|axis| track.liveliness(axis)) {
            sum.squares += own.squares;
            sum.determined += own.determined;
        }
        (sum.squares / sum.determined).clamp(0.01, 100.0)
    })
}

/// The next densities by axis and interval, `overall` being that of the whole dive.
pub(super) fn densities(track: &Wiener, nodes_s: &[f64], heard: &[bool], overall: [f64; 2]) -> [Vec<f64>; 3] {
    let usual_s = super::wiener::usual_gap_s(nodes_s);
    let silent = silences(nodes_s, heard, SILENCE * usual_s);
    let [horizontal, vertical] = [(0..2, 0), (2..3, 1)].map(|(axes, which)| {
        let now = track.density(axes.start);
        // sums of d^2 and g up to each interval
        let mut sums = vec![[0.0; 2]; nodes_s.len()];
        for axis in axes {
            for (k, own) in track.liveliness(axis).enumerate() {
                sums[k + 1][0] += own.squares * now[k];
                sums[k + 1][1] += own.determined;
            }
        }
        for k in 1..sums.len() {
            (0..2).for_each(|j| sums[k][j] += sums[k - 1][j]);
        }
        local(&sums, now, nodes_s, &silent, overall[which], usual_s)
    });
    [horizontal.clone(), horizontal, vertical]
}

fn local(
    sums: &[[f64; 2]],
    now: &[f64],
    nodes_s: &[f64],
    silent: &[bool],
    overall: f64,
    usual_s: f64,
) -> Vec<f64> {
    let mut found: Vec<f64> = (0..now.len())
        .map(|k| {
            let middle = nodes_s[k].midpoint(nodes_s[k + 1]);
            let (from, to) = window(nodes_s, middle, HALF_WINDOW_S.max(usual_s));
            let [squares, determined] = [0, 1].map(|j| sums[to.max(k + 1)][j] - sums[from.min(k)][j]);
            let wanted = (squares + PRIOR_COUNT * overall) / (determined + PRIOR_COUNT);
            // the geometric mean with the last: the window's own density moves at the same time
            (wanted * now[k]).sqrt()
        })
        .collect();
    // what happens unheard is like what happens around: the mean over time, lively moments and all
    let mut energy = vec![[0.0; 2]];
    for k in 0..now.len() {
        let last = energy[k];
        let heard_s = if silent[k] { 0.0 } else { nodes_s[k + 1] - nodes_s[k] };
        energy.push([last[0] + heard_s * found[k], last[1] + heard_s]);
    }
    for k in (0..now.len()).filter(|&k| silent[k]) {
        let middle = nodes_s[k].midpoint(nodes_s[k + 1]);
        let reach = HALF_SILENCE_S + 0.5 * (nodes_s[k + 1] - nodes_s[k]);
        let (from, to) = window(nodes_s, middle, reach);
        let [sum, heard_s] = [0, 1].map(|j| energy[to.max(k + 1)][j] - energy[from.min(k)][j]);
        found[k] = UNSURE * (sum + SILENCE_PRIOR_S * overall) / (heard_s + SILENCE_PRIOR_S);
    }
    found
}

/// The intervals that lie between two nodes at which something was heard that are farther apart than `longest_s`.
fn silences(nodes_s: &[f64], heard: &[bool], longest_s: f64) -> Vec<bool> {
    let mut silent = vec![false; nodes_s.len() - 1];
    let mut last = 0;
    for k in 1..nodes_s.len() {
        if heard[k] || k + 1 == nodes_s.len() {
            silent[last..k].fill(nodes_s[k] - nodes_s[last] > longest_s);
            last = k;
        }
    }
    silent
}

/// The nodes within `half_s` of an instant: first and last.
fn window(nodes_s: &[f64], middle_s: f64, half_s: f64) -> (usize, usize) {
    let from = nodes_s.partition_point(|&t| t < middle_s - half_s);
    let to = nodes_s.partition_point(|&t| t <= middle_s + half_s);
    (from, to.saturating_sub(1))
}
