//! How regularly a channel's messages were recorded, in memory that doesn't grow with their number.

use crate::estimate::coverage::OUTAGE_INTERVALS;
use crate::math::log_histogram::LogHistogram;

/// A channel's log times, ns, as they come. Takes 16 bytes a chunk, and some kB for the intervals.
#[derive(Clone, Debug, Default)]
pub(super) struct Rhythm {
    count: u64,
    /// Intervals between successive distinct times of a chunk, ns.
    steps: LogHistogram,
    /// The longest of them, and where it begins.
    longest: (u64, u64),
    /// First and last time of each chunk.
    runs: Vec<(u64, u64)>,
    equal: u64,
    newest: u64,
    behind: u64,
    farthest_behind: u64,
}

/// What a channel's log times tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    /// Number of messages.
    pub(super) count: u64,
    /// The earliest log time and the latest, ns.
    pub(super) span: (u64, u64),
    /// Median interval between successive distinct times, s.
    pub(super) interval_s: Option<f64>,
    /// Half the width of the middle 68 % of the intervals, s.
    pub(super) jitter_s: Option<f64>,
    /// Number of intervals longer than ten median ones: outages.
    pub(super) gaps: u64,
    /// The longest outage, s, and where it begins, ns.
    pub(super) longest_gap: Option<(f64, u64)>,
    /// Messages with the time of the one before them.
    pub(super) equal: u64,
    /// Messages that stand behind a later one, and by how much at most, s.
    pub(super) behind: (u64, f64),
}

impl Rhythm {
    /// Takes in the times of the next chunk, in file order.
    pub(super) fn add(&mut self, times: &[u64]) {
        for &time in times {
            self.behind += u64::from(time < self.newest);
            self.farthest_behind = self.farthest_behind.max(self.newest.saturating_sub(time));
            self.newest = self.newest.max(time);
        }
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        for pair in sorted.windows(2) {
            self.step(pair[0], pair[1]);
        }
        self.runs.extend(sorted.first().copied().zip(sorted.last().copied()));
        self.count += times.len() as u64;
    }

    fn step(&mut self, from: u64, to: u64) {
        if to == from {
            self.equal += 1;
            return;
        }
        self.steps.add(to - from);
        if to - from > self.longest.0 {
            self.longest = (to - from, from);
        }
    }

    /// What all of it tells.
    pub(super) fn told(mut self) -> Told {
        // Chunks need not follow one another in time; where they overlap, no interval lies between them.
        let mut runs = std::mem::take(&mut self.runs);
        runs.sort_unstable();
        let first = runs.first().map_or(0, |run| run.0);
        let mut last = first;
        for (i, run) in runs.iter().enumerate() {
            if i > 0 && run.0 >= last {
                self.step(last, run.0);
            }
            last = last.max(run.1);
        }
        let seconds = |ns: f64| 1e-9 * ns;
        let interval = self.steps.quantile(0.5);
        let limit = interval.map_or(f64::INFINITY, |ns| OUTAGE_INTERVALS * ns);
        let width = self.steps.quantile(0.84).zip(self.steps.quantile(0.16)).map(|(b, a)| b - a);
        let gaps = self.steps.count_above(limit);
        Told {
            count: self.count,
            span: (first, last),
            interval_s: interval.map(seconds),
            jitter_s: width.filter(|_| self.steps.count() > 1).map(|w| 0.5 * seconds(w)),
            gaps,
            longest_gap: (gaps > 0).then(|| (seconds(self.longest.0 as f64), self.longest.1)),
            equal: self.equal,
            behind: (self.behind, seconds(self.farthest_behind as f64)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(chunks: &[&[u64]]) -> Told {
        let mut rhythm = Rhythm::default();
        chunks.iter().for_each(|times| rhythm.add(times));
        rhythm.told()
    }

    #[test]
    fn a_regular_channel_has_its_rate_and_no_gap_wherever_chunks_end() {
        let times: Vec<u64> = (0..1000).map(|i| 5 + i * 20_000_000).collect();
        let whole = told(&[&times]);
        assert_eq!((whole.count, whole.interval_s, whole.jitter_s), (1000, Some(0.02), Some(0.0)));
        assert_eq!((whole.gaps, whole.equal, whole.behind), (0, 0, (0, 0.0)));
        assert_eq!(whole.span, (5, 5 + 999 * 20_000_000));
        let (a, b) = times.split_at(333);
        assert_eq!(told(&[a, b]), whole);
    }

    #[test]
    fn a_silence_of_more_than_ten_intervals_is_a_gap() {
        let mut times: Vec<u64> = (0..100).map(|i| i * 1_000).collect();
        times.extend((0..50).map(|i| 109_000 + i * 1_000)); // ten intervals: none
        times.extend((0..50).map(|i| 170_000 + i * 1_000));
        let told = told(&[&times]);
        assert_eq!(told.gaps, 1);
        let (length_s, from) = told.longest_gap.expect("a gap");
        assert_eq!((length_s, from), (12_000e-9, 158_000));
    }

    #[test]
    fn times_out_of_order_and_equal_ones_are_counted_and_make_no_gap() {
        let told = told(&[&[10, 30, 20, 20, 40], &[35, 50, 60]]);
        assert_eq!((told.count, told.equal), (8, 1));
        assert_eq!(told.behind, (3, 10e-9));
        assert_eq!((told.gaps, told.interval_s), (0, Some(10e-9)));
    }

    #[test]
    fn chunks_may_stand_in_any_order() {
        let times: Vec<u64> = (0..1000).map(|i| 5 + i * 20_000_000).collect();
        let whole = told(&[&times]);
        let parts: Vec<&[u64]> = times.chunks(100).collect();
        let shuffled: Vec<&[u64]> = (0..10).map(|i| parts[i * 3 % 10]).collect();
        let told = told(&shuffled);
        assert!(told.behind.0 > 0);
        assert_eq!(Told { behind: (0, 0.0), ..told }, whole);
    }

    #[test]
    fn few_messages_tell_little() {
        let one = told(&[&[7]]);
        assert_eq!((one.count, one.span, one.interval_s, one.jitter_s), (1, (7, 7), None, None));
        assert_eq!(told(&[&[7, 9]]).jitter_s, None);
    }
}
