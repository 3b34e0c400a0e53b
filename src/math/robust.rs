//! Location and scale that a few wild values don't move.

/// The factor that makes the median absolute deviation of normal numbers their standard deviation.
pub const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// The median (mean of the middle two for an even count), or `None` of nothing. Reorders `values`.
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| even);
    Some(lower.map_or(upper, |l| l.midpoint(upper)))
}

/// The quantile at `share` in [0, 1] (nearest rank), or `None` of nothing. Reorders `values`.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let rank = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Standard deviation about zero by the median absolute value, or `None` of nothing. Reorders `values`.
pub fn sigma_about_zero(values: &mut [f64]) -> Option<f64> {
    for v in values.iter_mut() {
        *v = v.abs();
    }
    median(values).map(|m| m * MAD_TO_SIGMA)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_odd_and_even_counts() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0]), Some(3.0));
        assert_eq!(median(&mut [5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(2.5));
    }

    #[test]
    fn quantiles_are_the_nearest_ranks() {
        let mut values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        assert_eq!(quantile(&mut values, 0.95), Some(95.0));
        assert_eq!(quantile(&mut values, 0.0), Some(0.0));
        assert_eq!(quantile(&mut [], 0.5), None);
    }

    #[test]
    fn a_third_of_wild_values_moves_the_scale_by_less_than_one_half() {
        let mut values: Vec<f64> = (1..=66).map(|i| f64::from(i) / 66.0).collect();
        let clean = sigma_about_zero(&mut values.clone()).expect("not empty");
        values.extend([1e9; 22]);
        let soiled = sigma_about_zero(&mut values).expect("not empty");
        assert!(soiled < 1.5 * clean, "{soiled} against {clean}");
    }
}
