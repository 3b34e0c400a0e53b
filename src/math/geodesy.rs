//! Places on the earth (WGS 84) as metres east, north and up of one of them, and back.
//!
//! The ways to and from earth-centred coordinates are those of Bowring 1976, "Transformation from spatial to
//! geographical coordinates", Survey Review 23; the turn to a tangent plane is that of any textbook, such as
//! Groves 2013, section 2.4.

/// Half the longer axis of the ellipsoid, m.
const A: f64 = 6_378_137.0;

/// Its flattening.
const F: f64 = 1.0 / 298.257_223_563;

/// The square of its first eccentricity.
const E2: f64 = F * (2.0 - F);

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    /// North of the equator, rad.
    pub latitude_rad: f64,
    /// East of Greenwich, rad.
    pub longitude_rad: f64,
    /// Above the ellipsoid, m.
    pub altitude_m: f64,
}

impl Geodetic {
    /// A place by its latitude and longitude, degrees, and its altitude, m.
    #[must_use]
    pub fn from_degrees([latitude, longitude, altitude_m]: [f64; 3]) -> Self {
        Self { latitude_rad: latitude.to_radians(), longitude_rad: longitude.to_radians(), altitude_m }
    }

    /// Its latitude and longitude, degrees, and its altitude, m.
    #[must_use]
    pub fn to_degrees(self) -> [f64; 3] {
        [self.latitude_rad.to_degrees(), self.longitude_rad.to_degrees(), self.altitude_m]
    }

    /// Earth-centred, earth-fixed coordinates, m.
    #[must_use]
    pub fn to_ecef(self) -> [f64; 3] {
        let (sin, cos) = self.latitude_rad.sin_cos();
        let normal = A / (1.0 - E2 * sin * sin).sqrt();
        let to_axis = (normal + self.altitude_m) * cos;
        [
            to_axis * self.longitude_rad.cos(),
            to_axis * self.longitude_rad.sin(),
            (normal * (1.0 - E2) + self.altitude_m) * sin,
        ]
    }

    /// The place with these earth-centred, earth-fixed coordinates, m; within 1e-6 m from 6000 km below the surface to
    /// 10000 km above it.
    #[must_use]
    pub fn from_ecef([x, y, z]: [f64; 3]) -> Self {
        let to_axis = x.hypot(y);
        // Bowring's iteration on the parametric latitude: near the surface its error shrinks by 1e-5 a step or more
        let mut reduced = z.atan2(to_axis * (1.0 - F));
        let mut latitude_rad = reduced;
        for _ in 0..6 {
            let (sin, cos) = reduced.sin_cos();
            let second_e2 = E2 / (1.0 - E2);
            latitude_rad =
                (z + second_e2 * A * (1.0 - F) * sin.powi(3)).atan2(to_axis - E2 * A * cos.powi(3));
            reduced = ((1.0 - F) * latitude_rad.sin()).atan2(latitude_rad.cos());
        }
        let (sin, cos) = latitude_rad.sin_cos();
        // good at the poles too, where a quotient by the cosine is not
        let altitude_m = to_axis * cos + z * sin - A * (1.0 - E2 * sin * sin).sqrt();
        Self { latitude_rad, longitude_rad: y.atan2(x), altitude_m }
    }
}

/// A frame that touches the earth at its origin: x east, y north, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    origin: [f64; 3],
    /// East, north and up in earth-centred axes.
    axes: [[f64; 3]; 3],
}

impl LocalFrame {
    /// The frame at `origin`.
    #[must_use]
    pub fn new(origin: Geodetic) -> Self {
        let (sin_lat, cos_lat) = origin.latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = origin.longitude_rad.sin_cos();
        Self {
            origin: origin.to_ecef(),
            axes: [
                [-sin_lon, cos_lon, 0.0],
                [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
                [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
            ],
        }
    }

    /// Where `place` lies in it: m east, north, up.
    #[must_use]
    pub fn to_enu(&self, place: Geodetic) -> [f64; 3] {
        let ecef = place.to_ecef();
        let from: [f64; 3] = std::array::from_fn(|i| ecef[i] - self.origin[i]);
        self.axes.map(|axis| axis.iter().zip(from).map(|(a, d)| a * d).sum())
    }

    /// Which place lies at `enu` in it, m east, north, up.
    #[must_use]
    pub fn to_geodetic(&self, enu: [f64; 3]) -> Geodetic {
        let along = |i: usize| (0..3).map(|axis| self.axes[axis][i] * enu[axis]).sum::<f64>();
        Geodetic::from_ecef(std::array::from_fn(|i| self.origin[i] + along(i)))
    }
}

#[cfg(test)]
#[expect(clippy::unreadable_literal, reason = "as the other program printed them")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// By `tests/geodesy_golden.py`: origin, place, and where that lies.
    const GOLDEN: [([f64; 3], [f64; 3], [f64; 3]); 5] = [
        (
            [42.375812, -71.147394667, 7.3],
            [42.377046167, -71.147322667, -22.5],
            [5.929889576379896, 137.0915266856349, -29.80147924757553],
        ),
        (
            [-33.9, 18.4, 0.0],
            [-33.95, 18.5, 120.0],
            [9244.057006343592, -5550.654928897439, 110.88435076644237],
        ),
        (
            [78.2, 15.6, -40.0],
            [78.3, 15.0, -2000.0],
            [-13583.693746134639, 11230.842346491434, -1984.2847375547776],
        ),
        (
            [0.0, 179.999, 10.0],
            [0.001, -179.999, 20.0],
            [222.63967964316606, 110.57462488194372, 9.995149259953594],
        ),
        (
            [89.9999, 45.0, 0.0],
            [89.9998, -135.0, 5.0],
            [-3.552713678800501e-15, 33.50822004864556, 4.999912276396104],
        ),
    ];

    #[test]
    fn places_lie_where_an_independent_library_has_them_and_back() {
        for (origin, place, expected) in GOLDEN {
            let frame = LocalFrame::new(Geodetic::from_degrees(origin));
            let found = frame.to_enu(Geodetic::from_degrees(place));
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
            let back = frame.to_geodetic(found).to_degrees();
            for (back, place) in back.iter().zip(place) {
                assert!((back - place).abs() < 1e-8, "{back} {place}");
            }
        }
    }

    #[test]
    fn earth_centred_coordinates_are_those_of_an_independent_library() {
        let ecef = Geodetic::from_degrees([42.375812, -71.147394667, 7.3]).to_ecef();
        for (found, expected) in ecef.iter().zip([1524863.2084395734, -4465811.88103649, 4276538.798078785]) {
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
    }

    #[test]
    fn the_origin_is_zero_and_a_second_of_latitude_is_a_meridian_arc() {
        let origin = Geodetic::from_degrees([45.0, 7.0, 0.0]);
        let frame = LocalFrame::new(origin);
        assert_eq!(frame.to_enu(origin), [0.0; 3]);
        // radius of the meridian at 45 degrees, a (1 - e2) / (1 - e2 / 2)^1.5, times one second
        let radius = A * (1.0 - E2) / (1.0 - 0.5 * E2).powf(1.5);
        let second = (1.0_f64 / 3600.0).to_radians();
        let north = frame.to_enu(Geodetic { latitude_rad: origin.latitude_rad + second, ..origin });
        assert!((north[1] - radius * second).abs() < 1e-3, "{}", north[1]);
    }

    proptest! {
        #[test]
        fn every_place_comes_back(
            latitude in -90.0..90.0_f64, longitude in -180.0..180.0_f64, altitude in -12e3..50e3_f64,
        ) {
            let place = Geodetic::from_degrees([latitude, longitude, altitude]);
            let back = Geodetic::from_ecef(place.to_ecef());
            let apart = LocalFrame::new(place).to_enu(back);
            prop_assert!(apart.iter().all(|d| d.abs() < 1e-6), "{apart:?}");
        }
    }
}
