//! GDF, general data fusion: where two sources see, their mean weighted by accuracy.
//!
//! Zhang 2025, eq. 1-2: `z = r_1 z_1 + r_2 z_2`, `zdot` alike, `r_i = s_i^-2 / (s_1^-2 + s_2^-2)`; here
//! for any number of sources. Outside the overlap the one sensor is taken as it is, so the curve jumps at
//! both ends of the overlap when the sources disagree.
//!
//! Between samples each source is interpolated linearly. It has no acceleration of its own: the paper
//! differences its velocities, and so does [`fusion`](crate::fusion).

use super::coverage::{Coverage, interpolate};
use crate::sample::{Quantity, Sample, Source};
use crate::track::{Curve, State};

/// The weighted mean of all sources that see an instant.
#[derive(Clone, Debug)]
pub struct WeightedMean {
    sources: Vec<Source>,
    coverage: Coverage,
}

/// The weighted mean of one axis, and its standard deviation; `None` of nothing.
#[must_use]
pub fn weighted_mean(values: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    let (sum, weights) = values.fold((0.0, 0.0), |(sum, weights), (value, sigma)| {
        let weight = sigma.powi(-2); // (2), up to the common factor
        (sum + weight * value, weights + weight)
    });
    (weights > 0.0).then(|| (sum / weights, weights.sqrt().recip())) // (1)
}

impl WeightedMean {
    /// The mean of `sources`.
    #[must_use]
    pub fn new(sources: Vec<Source>) -> Self {
        let coverage = Coverage::of(&sources);
        Self { sources, coverage }
    }

    fn mean(&self, quantity: Quantity, time_s: f64) -> Option<([f64; 3], [f64; 3])> {
        let seen: Vec<Sample> = self
            .sources
            .iter()
            .enumerate()
            .filter_map(|(i, s)| interpolate(s.series(quantity), time_s, self.coverage.outage_s(i, quantity)))
            .collect();
        let (mut value, mut sigma) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let terms = seen.iter().map(|s| (s.value[axis], s.sigma[axis]));
            (value[axis], sigma[axis]) = weighted_mean(terms)?;
        }
        Some((value, sigma))
    }

    /// The slope of the mean position across `time_s`, for sources that measure no velocity.
    fn slope(&self, time_s: f64) -> Option<([f64; 3], [f64; 3])> {
        let step = (0..self.sources.len())
            .map(|i| self.coverage.outage_s(i, Quantity::Position))
            .fold(0.0, f64::max)
            / 10.0;
        let end = |t: f64| self.mean(Quantity::Position, t).map(|(p, s)| (t, p, s));
        let here = end(time_s)?;
        let (a, b) = (end(time_s - step).unwrap_or(here), end(time_s + step).unwrap_or(here));
        let dt = b.0 - a.0;
        (dt > 0.0).then(|| {
            let slope = std::array::from_fn(|i| (b.1[i] - a.1[i]) / dt);
            (slope, std::array::from_fn(|i| a.2[i].hypot(b.2[i]) / dt))
        })
    }
}

impl Curve for WeightedMean {
    fn at(&self, time_s: f64) -> Option<State> {
        let (position, position_sigma) = self.mean(Quantity::Position, time_s)?;
        let (velocity, velocity_sigma) =
            self.mean(Quantity::Velocity, time_s).or_else(|| self.slope(time_s))?;
        Some(State { position, velocity, acceleration: None, position_sigma, velocity_sigma })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(value: f64, sigma: f64, from: i32, to: i32) -> Source {
        let samples = |v: f64| {
            (from..=to)
                .map(|i| Sample { time_s: 0.02 * f64::from(i), value: [v; 3], sigma: [sigma; 3] })
                .collect()
        };
        Source { name: "test".into(), positions: samples(value), velocities: samples(2.0 * value) }
    }

    #[test]
    fn sigmas_of_two_to_three_give_weights_of_069_and_031() {
        let (mean, sigma) = weighted_mean([(1.0, 2.0), (0.0, 3.0)].into_iter()).expect("two values");
        assert!((mean - 0.692_307_692_307_692_3).abs() < 1e-15);
        assert!((sigma - (1.0_f64 / (0.25 + 1.0 / 9.0)).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn it_takes_one_sensor_as_it_is_and_jumps_at_the_ends_of_the_overlap() {
        let gdf = WeightedMean::new(vec![source(1.0, 2.0, 0, 100), source(0.0, 3.0, 80, 200)]);
        let z = |t| gdf.at(t).map(|s| (s.position[2], s.velocity[2]));
        assert_eq!(z(1.0), Some((1.0, 2.0)));
        let (position, velocity) = z(1.8).expect("seen by both");
        assert!((position - 9.0 / 13.0).abs() < 1e-12 && (velocity - 18.0 / 13.0).abs() < 1e-12);
        assert_eq!(z(3.0), Some((0.0, 0.0)));
        assert_eq!(z(4.1), None);
    }

    #[test]
    fn without_velocities_the_slope_of_the_positions_serves() {
        let mut ramp = super::super::coverage::tests::source_at((0..50).map(|i| 0.1 * f64::from(i)));
        ramp.velocities.clear();
        let gdf = WeightedMean::new(vec![ramp]);
        for t in [0.0, 2.02, 4.9] {
            assert!((gdf.at(t).expect("seen").velocity[0] - 1.0).abs() < 1e-9);
        }
    }
}
