//! Characteristic points: when the vehicle reaches a given height, and how fast it is there.
//!
//! Zhang 2025, eq. 13: the first upward crossing of the height, by linear interpolation between the two
//! points around it. The time's standard deviation is that of the height over the vertical speed; the
//! speed's holds its own, and the acceleration times the time's.

use crate::time::Time;
use crate::track::{Phase, State, Track, TrackPoint};

/// A height to look for.
#[derive(Clone, Debug, PartialEq)]
pub struct Height {
    /// What the user calls it.
    pub name: String,
    /// Height, m, Z up.
    pub z_m: f64,
}

/// A height that was reached.
#[derive(Clone, Debug, PartialEq)]
pub struct CharacteristicPoint {
    /// What the user calls it.
    pub name: String,
    /// When.
    pub time: Time,
    /// Standard deviation of that time, s; `None` where the vertical speed can't be told from zero.
    pub time_sigma_s: Option<f64>,
    /// The state there; its velocity's standard deviation holds the time's.
    pub state: State,
    /// What sees it.
    pub phase: Phase,
}

/// The first upward crossing of `height` between two points at most `max_gap_s` apart, or `None` where there
/// is none: what happens in a hole of the track nobody knows.
#[must_use]
pub fn first_crossing(track: &Track, height: &Height, max_gap_s: f64) -> Option<CharacteristicPoint> {
    let z = |p: &TrackPoint| p.state.position[2];
    let (before, after, gap_s) = track.points.windows(2).find_map(|pair| {
        let gap_s = pair[1].time.seconds_since(pair[0].time);
        let crosses = z(&pair[0]) < height.z_m && z(&pair[1]) >= height.z_m && gap_s <= max_gap_s;
        crosses.then_some((&pair[0], &pair[1], gap_s))
    })?;
    let share = (height.z_m - z(before)) / (z(after) - z(before));
    let mut state = before.state.mixed(&after.state, share);
    let speed = state.velocity[2];
    // NaN where nobody knows the height's sigma, and then nobody knows the rest either
    let time_sigma_s = (speed > state.velocity_sigma[2]).then(|| state.position_sigma[2] / speed);
    let acceleration = state.acceleration.unwrap_or_default();
    for axis in 0..3 {
        let from_time = acceleration[axis] * time_sigma_s.unwrap_or(0.0);
        state.velocity_sigma[axis] = state.velocity_sigma[axis].hypot(from_time);
    }
    let time_sigma_s = time_sigma_s.filter(|s| s.is_finite());
    Some(CharacteristicPoint {
        name: height.name.clone(),
        time: before.time.plus_seconds(share * gap_s),
        time_sigma_s,
        state,
        phase: after.phase,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Method;

    fn track(heights: &[f64]) -> Track {
        let point = |(i, &z): (usize, &f64)| TrackPoint {
            time: Time::from_ns(i as i64 * 1_000_000_000),
            state: State {
                position: [0.0, 0.0, z],
                velocity: [0.0, 0.0, 2.0],
                acceleration: Some([0.0, 0.0, 3.0]),
                position_sigma: [0.4; 3],
                velocity_sigma: [0.3; 3],
            },
            phase: Phase::Single,
            method: Method::Spline,
            seen_by: 1,
        };
        Track { frame_id: String::new(), points: heights.iter().enumerate().map(point).collect() }
    }

    fn at(z_m: f64) -> Height {
        Height { name: "exit".into(), z_m }
    }

    #[test]
    fn the_first_upward_crossing_counts_with_its_uncertainty() {
        let found = first_crossing(&track(&[-1.0, -3.0, -2.0, 0.0, 2.0, -5.0, 5.0]), &at(-0.5), 1.5)
            .expect("crossed");
        assert_eq!(found.time, Time::from_ns(2_750_000_000));
        assert_eq!(found.time_sigma_s, Some(0.2)); // 0.4 m at 2 m/s
        assert!((found.state.velocity_sigma[2] - 0.3_f64.hypot(0.6)).abs() < 1e-12);
    }

    #[test]
    fn a_height_that_is_never_reached_or_only_left_is_no_point() {
        assert_eq!(first_crossing(&track(&[-3.0, -2.0, -1.0]), &at(0.0), 1.5), None);
        assert_eq!(first_crossing(&track(&[3.0, 2.0, -1.0]), &at(0.0), 1.5), None);
    }

    #[test]
    fn a_crossing_in_a_hole_of_the_track_is_no_point() {
        assert!(first_crossing(&track(&[-1.0, 1.0]), &at(0.0), 1.5).is_some());
        assert_eq!(first_crossing(&track(&[-1.0, 1.0]), &at(0.0), 0.5), None);
    }
}
