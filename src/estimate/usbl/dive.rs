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
    pub(super) fn new(
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
pub(super) fn height_at(sorted: &[Height], time_s: f64) -> Option<(f64, f64)> {
    let after = sorted.partition_point(|h| h.time_s < time_s);
    let next = sorted.get(after)?;
    let last = if next.time_s <= time_s { next } else { sorted.get(after.checked_sub(1)?)? };
    let gap_s = next.time_s - last.time_s;
    let share = if gap_s > 0.0 { (time_s - last.time_s) / gap_s } else { 0.0 };
    (gap_s <= super::CLOSE_S)
        .then(|| (last.z_m + share * (next.z_m - last.z_m), last.sigma_m.max(next.sigma_m)))
}
