//! Where the ship was, and how it lay, at the instant of a fix.

use std::f64::consts::{PI, TAU};

use super::geometry::Ship;
use crate::sample::Sample;

/// Between samples farther apart than this the ship counts as unseen, s.
pub const MOST_GAP_S: f64 = 10.0;

/// Before the first, after the last and beside a gap, a sample holds for so long, s.
const HOLDS_S: f64 = 2.0;

/// A ship's positions and headings, each in order of time.
#[derive(Clone, Copy, Debug)]
pub struct ShipTrack<'a> {
    /// Its transducer's positions: east, north, up, m.
    pub positions: &'a [Sample],
    /// Times, s, and headings, clockwise from north, rad.
    pub headings: &'a [(f64, f64)],
    /// Standard deviation of a heading, rad.
    pub heading_sigma_rad: f64,
}

impl ShipTrack<'_> {
    /// Where the transducer was, m, and its standard deviation an axis; `None` where nothing near tells.
    #[must_use]
    pub fn position_at(&self, time_s: f64) -> Option<([f64; 3], [f64; 3])> {
        let (i, share) = between(self.positions, |p| p.time_s, time_s)?;
        let (a, b) = (self.positions.get(i)?, self.positions.get(i + 1).or_else(|| self.positions.get(i))?);
        let mixed = |k: usize| a.value[k] + share * (b.value[k] - a.value[k]);
        Some((std::array::from_fn(mixed), std::array::from_fn(|k| a.sigma[k].max(b.sigma[k]))))
    }

    /// The ship; `None` where no position or no heading near tells.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Option<Ship> {
        let (position, position_sigma_m) = self.position_at(time_s)?;
        let (i, share) = between(self.headings, |h| h.0, time_s)?;
        let (a, b) = (self.headings.get(i)?.1, self.headings.get(i + 1).or_else(|| self.headings.get(i))?.1);
        // the short way round
        let turn = (b - a + PI).rem_euclid(TAU) - PI;
        let heading_rad = a + share * turn;
        Some(Ship { position, heading_rad, position_sigma_m, heading_sigma_rad: self.heading_sigma_rad })
    }
}

/// The sample before `time_s` and the share of the way to the next; one that is near where the other is far.
fn between<T>(samples: &[T], time_of: impl Fn(&T) -> f64, time_s: f64) -> Option<(usize, f64)> {
    let after = samples.partition_point(|s| time_of(s) <= time_s);
    let near = |i: usize| samples.get(i).map(&time_of).filter(|t| (t - time_s).abs() <= HOLDS_S);
    let before = after.checked_sub(1);
    if let (Some(i), Some(next)) = (before, samples.get(after)) {
        let (from_s, to_s) = (time_of(&samples[i]), time_of(next));
        if to_s - from_s <= MOST_GAP_S {
            return Some((i, (time_s - from_s) / (to_s - from_s)));
        }
    }
    let sides = [before, Some(after)].into_iter().flatten();
    let held = sides.filter_map(|i| Some((i, (near(i)? - time_s).abs())));
    held.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| (i, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_s: f64, east: f64) -> Sample {
        Sample { time_s, value: [east, 0.0, -4.0], sigma: [1.0; 3] }
    }

    #[test]
    fn a_ship_goes_straight_between_its_samples_and_turns_the_short_way() {
        let positions = [sample(0.0, 0.0), sample(4.0, 8.0)];
        let headings = [(0.0, 3.0), (4.0, -3.0)];
        let track = ShipTrack { positions: &positions, headings: &headings, heading_sigma_rad: 0.01 };
        let ship = track.at(1.0).expect("seen");
        assert_eq!(ship.position, [2.0, 0.0, -4.0]);
        let expected = 3.0 + 0.25 * (TAU - 6.0);
        assert!((ship.heading_rad - expected).abs() < 1e-12, "{}", ship.heading_rad);
        assert_eq!(track.at(4.0).expect("seen").position[0], 8.0);
    }

    #[test]
    fn where_no_sample_is_near_the_ship_is_nowhere() {
        let positions = [sample(0.0, 0.0), sample(100.0, 8.0)];
        let headings = [(0.0, 0.0), (100.0, 0.0)];
        let track = ShipTrack { positions: &positions, headings: &headings, heading_sigma_rad: 0.01 };
        let east = |t: f64| track.at(t).map(|ship| ship.position[0]);
        assert_eq!(
            [-1.0, 1.5, 50.0, 99.0, 101.0].map(east),
            [Some(0.0), Some(0.0), None, Some(8.0), Some(8.0)]
        );
        assert_eq!([-3.0, 103.0, f64::NAN].map(east), [None; 3]);
    }
}
