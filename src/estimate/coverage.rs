//! Who sees what when: runs of samples, phases, and the pieces that a long silence cuts a log into.

use crate::math::robust;
use crate::sample::{Quantity, Sample, Source};
use crate::track::Phase;

/// A source has stopped seeing when it misses this many of its usual intervals in a row.
///
/// 10: bursts of about five lost samples are usual with acoustics and are no change of phase. A guess.
pub const OUTAGE_INTERVALS: f64 = 10.0;

/// When each source sees the vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// For each source its runs of samples, `(from, to)` in s, in order.
    runs: Vec<Vec<(f64, f64)>>,
    /// For each source the longest interval between two of its samples that is no outage, s: of its positions,
    /// of its velocities.
    outage_s: Vec<[f64; 2]>,
}

/// The median interval between successive distinct times of a source's denser series, s.
#[must_use]
pub fn median_interval_s(source: &Source) -> Option<f64> {
    median_step_s(Quantity::ALL.map(|q| source.series(q)).into_iter().max_by_key(|s| s.len())?)
}

/// The median interval between successive distinct times of a series, s.
#[must_use]
pub fn median_step_s(series: &[Sample]) -> Option<f64> {
    let mut steps: Vec<f64> =
        series.windows(2).map(|w| w[1].time_s - w[0].time_s).filter(|d| *d > 0.0).collect();
    robust::median(&mut steps)
}

/// The longest step of a series that is no outage, across which it may be interpolated, s; 0 of too few samples.
#[must_use]
pub fn max_gap_s(series: &[Sample]) -> f64 {
    median_step_s(series).map_or(0.0, |step| OUTAGE_INTERVALS * step)
}

impl Coverage {
    /// The runs of each source; a longer silence than ten median intervals ends one.
    #[must_use]
    pub fn of(sources: &[Source]) -> Self {
        let outage_s: Vec<[f64; 2]> =
            sources.iter().map(|s| Quantity::ALL.map(|q| max_gap_s(s.series(q)))).collect();
        let runs =
            sources.iter().zip(&outage_s).map(|(source, outage)| runs(source, densest(outage))).collect();
        Self { runs, outage_s }
    }

    /// The sources that see `time_s`: bit i is the i-th.
    #[must_use]
    pub fn seen_by(&self, time_s: f64) -> u32 {
        let sees = |runs: &[(f64, f64)]| {
            let next = runs.partition_point(|run| run.1 < time_s);
            runs.get(next).is_some_and(|run| run.0 <= time_s)
        };
        self.runs.iter().enumerate().filter(|(_, runs)| sees(runs)).fold(0, |bits, (i, _)| bits | 1 << i)
    }

    /// The phase of an instant that the sources `seen_by` see, before the last sample.
    #[must_use]
    pub fn phase(seen_by: u32) -> Phase {
        match seen_by.count_ones() {
            0 => Phase::Bridged,
            1 => Phase::Single,
            _ => Phase::Overlap,
        }
    }

    /// The longest interval between two samples of `quantity` of source `index` that is no outage, s.
    #[must_use]
    pub fn outage_s(&self, index: usize, quantity: Quantity) -> f64 {
        self.outage_s[index][quantity as usize]
    }

    /// The runs of source `index`, `(from, to)` in s.
    #[must_use]
    pub fn runs(&self, index: usize) -> &[(f64, f64)] {
        &self.runs[index]
    }

    /// The stretches of all sources together, cut where nobody sees anything for more than `bridge_max_s`
    /// and for longer than an outage of the source that goes silent.
    #[must_use]
    pub fn pieces(&self, bridge_max_s: f64) -> Vec<(f64, f64)> {
        let mut runs: Vec<((f64, f64), f64)> = self
            .runs
            .iter()
            .zip(&self.outage_s)
            .flat_map(|(runs, outage)| runs.iter().map(move |&run| (run, densest(outage))))
            .collect();
        runs.sort_by(|a, b| a.0.0.total_cmp(&b.0.0));
        let mut pieces: Vec<((f64, f64), f64)> = Vec::new();
        for (run, outage) in runs {
            match pieces.last_mut() {
                Some((piece, limit)) if run.0 - piece.1 <= limit.max(bridge_max_s) => {
                    if run.1 > piece.1 {
                        (piece.1, *limit) = (run.1, outage);
                    }
                }
                _ => pieces.push((run, outage)),
            }
        }
        pieces.into_iter().map(|(piece, _)| piece).collect()
    }
}

/// The limit of the series that is sampled faster.
fn densest(outage_s: &[f64; 2]) -> f64 {
    outage_s.iter().copied().filter(|s| *s > 0.0).reduce(f64::min).unwrap_or(0.0)
}

fn runs(source: &Source, outage_s: f64) -> Vec<(f64, f64)> {
    let times = |series: &[Sample]| series.iter().map(|s| s.time_s).collect::<Vec<_>>();
    let mut all = times(&source.positions);
    all.extend(times(&source.velocities));
    all.sort_by(f64::total_cmp);
    let mut runs: Vec<(f64, f64)> = Vec::new();
    for t in all {
        match runs.last_mut() {
            Some(run) if t - run.1 <= outage_s => run.1 = t,
            _ => runs.push((t, t)),
        }
    }
    runs
}

/// The value of an ordered series at `time_s` by linear interpolation, or `None` outside it or where the
/// samples beside are more than `max_gap_s` apart.
#[must_use]
pub fn interpolate(series: &[Sample], time_s: f64, max_gap_s: f64) -> Option<Sample> {
    let next = series.partition_point(|s| s.time_s < time_s);
    let after = series.get(next)?;
    if after.time_s <= time_s {
        return Some(*after);
    }
    let before = series.get(next.checked_sub(1)?)?;
    let gap = after.time_s - before.time_s;
    if gap > max_gap_s {
        return None;
    }
    let share = (time_s - before.time_s) / gap;
    let mix = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
    Some(Sample { time_s, value: mix(before.value, after.value), sigma: mix(before.sigma, after.sigma) })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A source that samples positions `t` on each axis at the given times.
    pub(crate) fn source_at(times: impl IntoIterator<Item = f64>) -> Source {
        let positions =
            times.into_iter().map(|t| Sample { time_s: t, value: [t; 3], sigma: [0.1; 3] }).collect();
        Source { name: "test".into(), positions, velocities: Vec::new() }
    }

    fn every(step: f64, from: f64, to: f64) -> impl Iterator<Item = f64> {
        (0..=((to - from) / step).round() as usize).map(move |i| from + step * i as f64)
    }

    #[test]
    fn phases_follow_who_sees() {
        let sources = [source_at(every(0.02, 0.0, 2.0)), source_at(every(0.1, 1.5, 4.0))];
        let coverage = Coverage::of(&sources);
        assert_eq!(coverage.seen_by(1.0), 0b01);
        assert_eq!(coverage.seen_by(1.7), 0b11);
        assert_eq!(coverage.seen_by(3.0), 0b10);
        assert_eq!(coverage.seen_by(4.5), 0);
        assert_eq!(Coverage::phase(0b11), Phase::Overlap);
        assert_eq!(coverage.pieces(5.0), [(0.0, 4.0)]);
    }

    #[test]
    fn a_stray_stamp_becomes_a_piece_of_its_own() {
        let mut times: Vec<f64> = every(0.02, 0.0, 2.0).collect();
        times.push(7200.0);
        let coverage = Coverage::of(&[source_at(times)]);
        assert_eq!(coverage.pieces(5.0), [(0.0, 2.0), (7200.0, 7200.0)]);
    }

    #[test]
    fn a_slow_source_is_not_cut_at_every_interval() {
        let coverage = Coverage::of(&[source_at(every(20.0, 0.0, 600.0))]);
        assert_eq!(coverage.pieces(5.0), [(0.0, 600.0)]);
    }

    #[test]
    fn interpolation_stops_at_gaps_and_ends() {
        let source = source_at([0.0, 1.0, 5.0]);
        let at = |t| interpolate(&source.positions, t, 2.0).map(|s| s.value[0]);
        assert_eq!(at(0.25), Some(0.25));
        assert_eq!(at(1.0), Some(1.0));
        assert_eq!(at(3.0), None);
        assert_eq!(at(5.0), Some(5.0));
        assert_eq!(at(-0.1), None);
        assert_eq!(at(5.1), None);
    }
}
