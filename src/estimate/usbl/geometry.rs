//! Positions from what a USBL system measures: range, bearing and depression, seen from a ship.
//!
//! ```text
//! p = s + r (cos d sin(h + b), cos d cos(h + b), -sin d)                                              (1)
//! P = J diag(sr^2, sb^2 + sh^2, sd^2) J' + diag(ss^2)                                                 (2)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s, ss | ship's position (its transducer's), east, north, up, and its standard deviation an axis | m |
//! | h, sh | ship's heading, clockwise from north | rad |
//! | r, sr | slant range | m |
//! | b, sb | bearing, clockwise from the bow | rad |
//! | d, sd | depression, downwards from the horizontal | rad |
//! | J | derivative of (1) by r, b, d | |

use nalgebra::{Matrix3, Vector3};

use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::sample::Sample;

/// What was measured of the vehicle from the ship. Standard deviations are those of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polar {
    /// Slant range, m.
    pub range_m: f64,
    /// Clockwise from the bow, rad.
    pub bearing_rad: f64,
    /// Downwards from the horizontal, rad.
    pub depression_rad: f64,
    /// Of range, m; bearing, rad; depression, rad.
    pub sigma: [f64; 3],
}

/// The ship while it measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ship {
    /// Where its transducer is: east, north, up, m.
    pub position: [f64; 3],
    /// Clockwise from north, rad.
    pub heading_rad: f64,
    /// Of the position an axis, m.
    pub position_sigma_m: [f64; 3],
    /// Of the heading, rad.
    pub heading_sigma_rad: f64,
}

/// The vehicle's position, m, (1), and its covariance by rows, m^2, (2).
#[must_use]
pub fn position(seen: &Polar, ship: &Ship) -> ([f64; 3], [[f64; 3]; 3]) {
    let (sin_b, cos_b) = (ship.heading_rad + seen.bearing_rad).sin_cos();
    let (sin_d, cos_d) = seen.depression_rad.sin_cos();
    let r = seen.range_m;
    let ahead = Vector3::new(cos_d * sin_b, cos_d * cos_b, -sin_d);
    let position = Vector3::from(ship.position) + ahead * r; // (1)
    let jacobian = Matrix3::from_columns(&[
        ahead,
        Vector3::new(r * cos_d * cos_b, -r * cos_d * sin_b, 0.0),
        Vector3::new(-r * sin_d * sin_b, -r * sin_d * cos_b, -r * cos_d),
    ]);
    let [range, bearing, depression] = seen.sigma;
    let variances = Vector3::new(range, bearing.hypot(ship.heading_sigma_rad), depression).map(|s| s * s);
    let own = Vector3::from(ship.position_sigma_m).map(|s| s * s);
    let covariance =
        jacobian * Matrix3::from_diagonal(&variances) * jacobian.transpose() + Matrix3::from_diagonal(&own); // (2)
    (position.into(), covariance.into())
}

/// The fix of a measurement. The estimators keep one standard deviation an axis: what two axes have in common is left
/// out, which makes a fix look no better than it is.
#[must_use]
pub fn fix(time_s: f64, seen: &Polar, ship: &Ship) -> Sample {
    let (value, covariance) = position(seen, ship);
    Sample { time_s, value, sigma: std::array::from_fn(|a| covariance[a][a].sqrt()) }
}

/// Where `place` lies, m: east and north of the frame's `zero`, and `height_m` above the level surface through it, whatever
/// the place's own altitude. That surface, from which a depth counts, bends away from the frame's plane: by 31 m at 20 km.
#[must_use]
pub fn above_level(place: Geodetic, height_m: f64, frame: &LocalFrame, zero: Geodetic) -> [f64; 3] {
    let [east, north, _] = frame.to_enu(Geodetic { altitude_m: zero.altitude_m + height_m, ..place });
    [east, north, height_m]
}

/// How far the level surface lies below the frame's plane so far from its origin, m.
#[must_use]
pub fn bend_m(distance_m: f64) -> f64 {
    const EARTH_RADIUS_M: f64 = 6_371_000.0;
    distance_m * distance_m / (2.0 * EARTH_RADIUS_M)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn ship(heading_rad: f64) -> Ship {
        Ship {
            position: [10.0, 20.0, -5.0],
            heading_rad,
            position_sigma_m: [0.5; 3],
            heading_sigma_rad: 0.004,
        }
    }

    fn polar(range_m: f64, bearing_rad: f64, depression_rad: f64) -> Polar {
        Polar { range_m, bearing_rad, depression_rad, sigma: [0.4, 0.005, 0.006] }
    }

    #[test]
    fn plain_directions_are_where_a_sailor_expects_them() {
        let at =
            |bearing, depression, heading| position(&polar(100.0, bearing, depression), &ship(heading)).0;
        let near = |found: [f64; 3], expected: [f64; 3]| {
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-12), "{found:?} {expected:?}");
        };
        near(at(0.0, 0.0, 0.0), [10.0, 120.0, -5.0]); // ahead, heading north
        near(at(FRAC_PI_2, 0.0, 0.0), [110.0, 20.0, -5.0]); // to starboard
        near(at(0.0, 0.0, FRAC_PI_2), [110.0, 20.0, -5.0]); // ahead, heading east
        near(at(1.0, FRAC_PI_2, 2.0), [10.0, 20.0, -105.0]); // below
    }

    #[test]
    fn the_covariance_is_that_of_many_noisy_measurements() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let (seen, carrier) = (polar(900.0, 0.7, 1.0), ship(-0.4));
        let (centre, covariance) = position(&seen, &carrier);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut sum, count) = (Matrix3::zeros(), 40_000);
        for _ in 0..count {
            let noisy = Polar {
                range_m: seen.range_m + 0.4 * normal(),
                bearing_rad: seen.bearing_rad + 0.005 * normal(),
                depression_rad: seen.depression_rad + 0.006 * normal(),
                ..seen
            };
            let moved = Ship {
                position: carrier.position.map(|p| p + 0.5 * normal()),
                heading_rad: carrier.heading_rad + 0.004 * normal(),
                ..carrier
            };
            let apart = Vector3::from(position(&noisy, &moved).0) - Vector3::from(centre);
            sum += apart * apart.transpose() / f64::from(count);
        }
        for i in 0..3 {
            for j in 0..3 {
                let scale = (covariance[i][i] * covariance[j][j]).sqrt();
                assert!(
                    (sum[(i, j)] - covariance[i][j]).abs() < 0.03 * scale,
                    "{i} {j}: {sum} {covariance:?}"
                );
            }
        }
    }

    #[test]
    fn a_depth_counts_from_the_level_through_the_frames_origin() {
        let zero = Geodetic::from_degrees([10.0, 140.0, 45.0]);
        let place = Geodetic::from_degrees([10.18, 140.0, -4000.0]);
        let frame = LocalFrame::new(zero);
        let found = above_level(place, -4000.0, &frame, zero);
        assert!(found[2] == -4000.0 && (found[1] - 19_896.0).abs() < 10.0, "{found:?}");
        let up = frame.to_enu(Geodetic { altitude_m: -3955.0, ..place })[2];
        assert!((found[2] - up - bend_m(found[1])).abs() < 0.5, "the plane is not level: {up}");
    }
}
