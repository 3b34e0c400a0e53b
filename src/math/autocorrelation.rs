//! How alike the numbers of a series are to those some places later.

/// The autocorrelation at lags 0 to `lags`, of at most as many as the series has numbers: sum x_i x_(i+k) / sum x_i^2.
///
/// About zero, not about the mean: what is constant is correlated too. Between independent numbers it has the standard
/// deviation 1 / sqrt(n). Empty of a series that is zero throughout.
#[must_use]
pub fn autocorrelation(values: &[f64], lags: usize) -> Vec<f64> {
    let at = |lag: usize| values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let power = at(0);
    if power.is_nan() || power <= 0.0 {
        return Vec::new();
    }
    (0..values.len().min(lags + 1)).map(|lag| at(lag) / power).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_that_turns_its_sign_is_negatively_correlated_at_odd_lags() {
        let turning: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let found = autocorrelation(&turning, 3);
        assert_eq!(found, [1.0, -0.99, 0.98, -0.97]);
    }

    #[test]
    fn a_series_has_no_more_lags_than_numbers_and_none_without_any() {
        assert_eq!(autocorrelation(&[2.0, 2.0], 40), [1.0, 0.5]);
        assert!(autocorrelation(&[], 40).is_empty() && autocorrelation(&[0.0; 9], 40).is_empty());
    }
}
