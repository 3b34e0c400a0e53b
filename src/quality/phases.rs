//! How far the samples lie from the track, phase by phase, and how sure the track is of itself.

use super::residuals::Residual;
use crate::estimate::coverage::Coverage;
use crate::time::Time;
use crate::track::{Phase, Track, TrackPoint};

/// One kind of stretch of the track, summed over the log.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseSummary {
    /// The phase.
    pub phase: Phase,
    /// The sources that see it: bit i is the i-th.
    pub seen_by: u32,
    /// First and last point, s since the origin.
    pub span_s: (f64, f64),
    /// Number of points of the track.
    pub points: usize,
    /// Root mean square distance of the samples from the track (Zhang 2025, eq. 12, over three axes), m and
    /// m/s; `None` where nothing was measured.
    pub rmse: [Option<f64>; 2],
    /// Root mean square of the points' 3-D standard deviation, m and m/s; NaN where nobody knows it.
    pub sigma: [f64; 2],
    /// Number of separate stretches.
    pub stretches: usize,
}

/// Sums up the track and the residuals, phase by phase, in order of first appearance.
#[must_use]
pub fn phases(track: &Track, origin: Time, residuals: &[Residual]) -> Vec<PhaseSummary> {
    let mut summaries: Vec<PhaseSummary> = Vec::new();
    for stretch in track.points.chunk_by(|a, b| (a.phase, a.seen_by) == (b.phase, b.seen_by)) {
        let TrackPoint { phase, seen_by, time: from, .. } = stretch[0];
        let (from_s, to_s) =
            (from.seconds_since(origin), stretch[stretch.len() - 1].time.seconds_since(origin));
        let known = summaries.iter().position(|s| (s.phase, s.seen_by) == (phase, seen_by));
        let index = known.unwrap_or_else(|| {
            let (rmse, sigma) = ([None; 2], [0.0; 2]);
            summaries.push(PhaseSummary {
                phase,
                seen_by,
                span_s: (from_s, to_s),
                points: 0,
                stretches: 0,
                rmse,
                sigma,
            });
            summaries.len() - 1
        });
        let summary = &mut summaries[index];
        summary.span_s.1 = to_s;
        summary.points += stretch.len();
        summary.stretches += 1;
        for point in stretch {
            summary.sigma[0] += norm_squared(point.state.position_sigma);
            summary.sigma[1] += norm_squared(point.state.velocity_sigma);
        }
    }
    let mut sums = vec![[(0.0, 0_usize); 2]; summaries.len()];
    for residual in residuals {
        let (phase, seen_by) = (Coverage::phase(residual.seen_by), residual.seen_by);
        let Some(index) = summaries.iter().position(|s| (s.phase, s.seen_by) == (phase, seen_by)) else {
            continue;
        };
        for (sum, misfit) in sums[index].iter_mut().zip(residual.misfits) {
            if let Some(misfit) = misfit {
                sum.0 += norm_squared(misfit.vector); // (12)
                sum.1 += 1;
            }
        }
    }
    for (summary, sums) in summaries.iter_mut().zip(sums) {
        summary.rmse = sums.map(|(sum, count)| (count > 0).then(|| (sum / count as f64).sqrt()));
        summary.sigma = summary.sigma.map(|s| (s / summary.points.max(1) as f64).sqrt());
    }
    summaries
}

pub(super) fn norm_squared(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum()
}
