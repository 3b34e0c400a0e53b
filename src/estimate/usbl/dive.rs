//! A dive as the smoother sees it: exchanges, nodes, and what a depth sensor says.

use super::candidates::{Candidate, Exchange};
use super::{Height, cycles};
use crate::sample::Sample;

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
    pub(super) heights: Vec<Option<(f64, f64)>>,
}

impl Dive {
    /// `heights` in order of time.
    pub(super) fn new(
        fixes: Vec<Sample>,
        exchanges: Vec<Exchange>,
        candidates: Vec<Candidate>,
        heights: &[Height],
    ) -> Self {
        let centres: Vec<f64> = exchanges.iter().map(|e| e.time_s).collect();
        let usual_s = cycles::cycle_time_s(&centres).unwrap_or(1.0).max(cycles::LEAST_GAP_S);
        let (mut nodes_s, mut node_of): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
        for time_s in centres {
            if let Some(&last) = nodes_s.last() {
                between(last, time_s, usual_s, heights, &mut nodes_s);
            }
            let after = nodes_s.last().map_or(f64::NEG_INFINITY, |last| last + 0.05 * cycles::LEAST_GAP_S);
            node_of.push(nodes_s.len());
            nodes_s.push(time_s.max(after));
        }
        let heights = nodes_s.iter().map(|&t| height_at(heights, t)).collect();
        Self { fixes, exchanges, candidates, nodes_s, node_of, heights }
    }
}

/// Adds nodes at the times of heights between two nodes, `usual_s` apart: no more than there are heights, however long
/// the silence is.
fn between(last_s: f64, next_s: f64, usual_s: f64, heights: &[Height], nodes_s: &mut Vec<f64>) {
    if next_s - last_s < 2.0 * usual_s {
        return;
    }
    let mut due_s = last_s + usual_s;
    let from = heights.partition_point(|h| h.time_s < due_s);
    for height in heights[from..].iter().take_while(|h| h.time_s < next_s - 0.5 * usual_s) {
        if height.time_s >= due_s {
            nodes_s.push(height.time_s);
            due_s = height.time_s + usual_s;
        }
    }
}

/// What the depth sensor says at an instant: height and its sigma, between two samples that are close.
/// `sorted` is in order of time.
pub(super) fn height_at(sorted: &[Height], time_s: f64) -> Option<(f64, f64)> {
    let after = sorted.partition_point(|h| h.time_s < time_s);
    let next = sorted.get(after)?;
    let last = if next.time_s <= time_s { next } else { sorted.get(after.checked_sub(1)?)? };
    let gap_s = next.time_s - last.time_s;
    let share = if gap_s > 0.0 { (time_s - last.time_s) / gap_s } else { 0.0 };
    (gap_s <= super::CLOSE_S)
        .then(|| (last.z_m + share * (next.z_m - last.z_m), last.sigma_m.max(next.sigma_m)))
}
