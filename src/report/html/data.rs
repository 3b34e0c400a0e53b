//! What plots draw: columns of numbers, thinned and rounded to what an eye can see.

use serde::ser::{Serialize, SerializeSeq, Serializer};

/// Columns of equal length; `None` where there is no number, which breaks a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns(Vec<Vec<Option<f64>>>);

impl Columns {
    /// The `columns` at the rows `kept`; a `None` among them is a row of gaps, but for the first column, which goes on.
    #[must_use]
    pub fn of(kept: &[Option<usize>], columns: &[&dyn Fn(usize) -> f64]) -> Self {
        let finite = |v: f64| Some(v).filter(|v| v.is_finite());
        let mut made: Vec<Vec<Option<f64>>> =
            columns.iter().map(|column| kept.iter().map(|row| finite(column((*row)?))).collect()).collect();
        if let Some(first) = made.first_mut() {
            for i in 1..first.len() {
                if kept[i].is_none() {
                    let next = first.get(i + 1).copied().flatten();
                    first[i] = first[i - 1].zip(next).map(|(a, b)| 0.5 * (a + b)).or(first[i - 1]);
                }
            }
        }
        Self(made)
    }

    /// Rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.first().map_or(0, Vec::len)
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Steps of the rounding within a column's range.
const STEPS: f64 = 1e5;

impl Serialize for Columns {
    /// A list of lists, each rounded to a hundred-thousandth of its range, but never coarser than 0.001.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut list = serializer.serialize_seq(Some(self.0.len()))?;
        for column in &self.0 {
            let finite = || column.iter().flatten();
            let (low, high) = finite().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
            let range = high - low;
            let decimals = if range > 0.0 { (STEPS / range).log10().ceil().clamp(3.0, 9.0) } else { 6.0 };
            let scale = 10_f64.powf(decimals);
            // the sum turns -0 into 0; what is too large to be rounded stays
            let rounded =
                |v: f64| Some((v * scale).round() / scale + 0.0).filter(|r| r.is_finite()).unwrap_or(v);
            list.serialize_element(&column.iter().map(|v| v.map(rounded)).collect::<Vec<_>>())?;
        }
        list.end()
    }
}

/// At most `budget` of `count` rows, or a few more: the first, the last, and from stretches of equal length those with the
/// least and the greatest number in each of the `columns`, so that no outlier is lost.
#[must_use]
pub(super) fn thin(count: usize, columns: &[&dyn Fn(usize) -> f64], budget: usize) -> Vec<usize> {
    if count <= budget {
        return (0..count).collect();
    }
    // where the columns rise and fall together, a stretch takes few rows, and there is room for more stretches
    let mut stretches = (budget / 2).max(1);
    loop {
        let kept = extremes(count, columns, stretches);
        if kept.len() <= budget || stretches == 1 {
            return kept;
        }
        stretches /= 2;
    }
}

fn extremes(count: usize, columns: &[&dyn Fn(usize) -> f64], stretches: usize) -> Vec<usize> {
    let mut kept = vec![0, count - 1];
    for stretch in 0..stretches {
        let (from, to) = (count * stretch / stretches, count * (stretch + 1) / stretches);
        for column in columns {
            let by = |a: &usize, b: &usize| column(*a).total_cmp(&column(*b));
            kept.extend((from..to).min_by(by));
            kept.extend((from..to).max_by(by));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_rows_keep_both_ends_and_every_outlier_within_the_budget() {
        let outlier = |i: usize| if i == 77_777 { 50.0 } else { (i as f64).sin() };
        let ramp = |i: usize| i as f64;
        let kept = thin(100_000, &[&outlier, &ramp], 400);
        assert!((150..=400).contains(&kept.len()) && kept.is_sorted_by(|a, b| a < b), "{}", kept.len());
        assert!(kept.contains(&0) && kept.contains(&77_777) && kept.contains(&99_999));
        assert!(thin(100_000, &[&ramp, &ramp, &ramp], 400).len() > 300, "what moves alike has room for more");
        assert_eq!(thin(5, &[&ramp], 400), [0, 1, 2, 3, 4]);
        assert!(thin(0, &[&ramp], 400).is_empty());
    }

    #[test]
    fn columns_are_rounded_within_their_range_and_gaps_are_null() {
        let rows = [Some(0), Some(1), None, Some(2)];
        let (time, value) = ([0.0, 0.02, 0.06], [60.123_456_789, f64::NAN, -0.000_000_1]);
        let columns = Columns::of(&rows, &[&|i| time[i], &|i| value[i]]);
        let json = serde_json::to_string(&columns).expect("JSON");
        assert_eq!(json, "[[0.0,0.02,0.04,0.06],[60.1235,null,null,0.0]]");
    }

    #[test]
    fn numbers_too_large_to_be_rounded_stay_as_they_are() {
        let huge = [1e300, -1e300];
        let columns = Columns::of(&[Some(0), Some(1)], &[&|i| huge[i]]);
        assert_eq!(serde_json::to_string(&columns).expect("JSON"), "[[1e+300,-1e+300]]");
    }
}
