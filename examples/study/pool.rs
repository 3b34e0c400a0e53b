//! Errors of many runs as one.

use trackfuse::quality::Errors;

/// Where a climb is seen, by the truth: which sensors work, whether or not a burst of their samples is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// By the first sensor alone.
    Phase1,
    /// By both, or, where a gap stands in its place, by neither.
    Overlap,
    /// By the second sensor alone.
    Phase2,
    Unseen,
}

impl Part {
    pub(crate) const ALL: [Self; 4] = [Self::Phase1, Self::Overlap, Self::Phase2, Self::Unseen];

    /// The part of an instant, with the overlap's begin and end, and the end of what is seen, s.
    pub(crate) fn at(time_s: f64, overlap_s: (f64, f64), seen_until_s: f64) -> Self {
        const CLOSE_S: f64 = 1e-6; // a last sample belongs to what it ends
        if time_s < overlap_s.0 - CLOSE_S {
            Self::Phase1
        } else if time_s <= overlap_s.1 + CLOSE_S {
            Self::Overlap
        } else if time_s <= seen_until_s + CLOSE_S {
            Self::Phase2
        } else {
            Self::Unseen
        }
    }
}

/// The median size of a component's error in a run, and the median of its standard deviation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Typical {
    pub(crate) error: f64,
    pub(crate) sigma: f64,
}

/// Squares and hits of one quantity, pooled over runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pool {
    count: usize,
    squares: f64,
    banded: usize,
    inside: f64,
    /// Root mean square error of each run.
    pub(crate) rmses: Vec<f64>,
    /// Of each run the median error and the median standard deviation of a component: horizontal, vertical.
    pub(crate) typical: Vec<[Typical; 2]>,
}

impl Pool {
    /// Adds a run.
    pub(crate) fn add(&mut self, errors: &Errors, typical: [Typical; 2]) {
        self.count += errors.count;
        self.squares += errors.rmse.powi(2) * errors.count as f64;
        self.rmses.push(errors.rmse);
        self.typical.push(typical);
        if let Some(bands) = &errors.bands {
            self.banded += bands.count;
            self.inside += bands.inside * bands.count as f64;
        }
    }

    /// Adds all runs of another.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.squares += other.squares;
        self.banded += other.banded;
        self.inside += other.inside;
        self.rmses.extend(&other.rmses);
        self.typical.extend(&other.typical);
    }

    /// Root mean square over all instants of all runs.
    pub(crate) fn rmse(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    /// Share of the truth inside the 95 % bands.
    pub(crate) fn inside(&self) -> Option<f64> {
        (self.banded > 0).then(|| self.inside / self.banded as f64)
    }

    /// Median over the runs of the standard deviation over that of the error: horizontal, vertical.
    pub(crate) fn sigma_over_error(&self) -> [Option<f64>; 2] {
        [0, 1].map(|direction: usize| {
            let median = |of: fn(&Typical) -> f64| {
                let values: Vec<f64> = self.typical.iter().map(|t| of(&t[direction])).collect();
                quantile(&values, 0.5)
            };
            median(|t| t.sigma).zip(median(|t| t.error)).map(|(sigma, error)| sigma / error)
        })
    }

    /// The largest root mean square error of a run.
    pub(crate) fn worst(&self) -> Option<f64> {
        self.rmses.iter().copied().reduce(f64::max)
    }
}

/// The value that this share of `values` doesn't exceed.
pub(crate) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    trackfuse::math::robust::quantile(&mut values.to_vec(), share)
}
