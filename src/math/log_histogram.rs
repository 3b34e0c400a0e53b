//! How whole numbers are spread, over many orders of magnitude and in little memory.

use std::collections::BTreeMap;

/// Values of 11 significant bits or fewer have a bin each; larger ones share theirs with values that differ by
/// less than one part in 1024.
const BITS: u32 = 11;

/// Counts of whole numbers in bins of equal width on a logarithmic scale: at most 56,000 bins, however many values.
///
/// Quantiles are the mean of their bin: exact where all its values are the same, and else within 0.1 %.
/// After HdrHistogram (Tene 2012), which has the bins' middles instead.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogHistogram {
    bins: BTreeMap<u16, Bin>,
    count: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    count: u64,
    sum: u128,
}

impl LogHistogram {
    /// Counts a value in.
    pub fn add(&mut self, value: u64) {
        let bin = self.bins.entry(bin_of(value)).or_default();
        bin.count += 1;
        bin.sum += u128::from(value);
        self.count += 1;
    }

    /// How many values were counted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The quantile at `share` in [0, 1] (nearest rank), or `None` of nothing.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let rank = (share.clamp(0.0, 1.0) * self.count.checked_sub(1)? as f64).round() as u64;
        let mut below = 0;
        let bin = self.bins.values().find(|bin| {
            below += bin.count;
            below > rank
        })?;
        Some(bin.mean())
    }

    /// How many values are greater than `limit`, to within those of its bin.
    #[must_use]
    pub fn count_above(&self, limit: f64) -> u64 {
        self.bins.values().filter(|bin| bin.mean() > limit).map(|bin| bin.count).sum()
    }
}

impl Bin {
    fn mean(&self) -> f64 {
        self.sum as f64 / self.count as f64
    }
}

/// Bins go up with the values.
fn bin_of(value: u64) -> u16 {
    let shift = (u64::BITS - value.leading_zeros()).saturating_sub(BITS);
    ((shift as u16) << (BITS - 1)) + (value >> shift) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_go_up_without_a_hole_to_the_largest_value() {
        let mut last = bin_of(0);
        for value in (0..100_000).chain([u64::MAX / 3, u64::MAX / 2, u64::MAX]) {
            let bin = bin_of(value);
            assert!(bin == last || bin == last + 1 || value > 100_000 && bin > last, "{value}");
            last = bin;
        }
        assert_eq!(bin_of(u64::MAX), 53 * 1024 + 2047);
    }

    #[test]
    fn quantiles_are_within_a_thousandth_of_those_of_the_sorted_values() {
        let values: Vec<u64> = (1..=10_001_u64).map(|i| i * i * i).collect();
        let mut histogram = LogHistogram::default();
        values.iter().rev().for_each(|v| histogram.add(*v));
        for share in [0.0, 0.16, 0.5, 0.84, 1.0] {
            let exact = values[(share * 10_000.0) as usize] as f64;
            let found = histogram.quantile(share).expect("not empty");
            assert!((found / exact - 1.0).abs() < 1e-3, "{share}: {found} for {exact}");
        }
        let above = histogram.count_above(5000.0_f64.powi(3));
        assert!(above.abs_diff(5001) <= 2, "{above}");
        assert_eq!(LogHistogram::default().quantile(0.5), None);
    }

    #[test]
    fn equal_values_keep_every_digit() {
        let mut histogram = LogHistogram::default();
        (0..1000).for_each(|_| histogram.add(20_000_001));
        assert_eq!(histogram.quantile(0.5), Some(20_000_001.0));
        assert_eq!((histogram.count(), histogram.count_above(20_000_001.0)), (1000, 0));
    }
}
