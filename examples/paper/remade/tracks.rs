//! The paper's methods over one trial.

use trackfuse::estimate::Coefficients;
use trackfuse::estimate::moving_average::MovingAverage;
use trackfuse::estimate::polynomial::{self, Polynomial};
use trackfuse::estimate::spline::{self, Settings, Smoothing, Spline};
use trackfuse::sample::Source;
use trackfuse::track::Curve;

use super::trial::{FRAME_S, FRAMES, Trial, Z, time_s};

/// Gaussians over the 185 frames, beside 4 beyond each end; the paper doesn't say how many.
pub(crate) const KNOTS: usize = 12;
/// The paper's moving averages, points.
pub(crate) const WINDOWS: [usize; 3] = [5, 16, 32];

/// One method's heights and vertical speeds at the frames.
pub(crate) struct Track {
    pub(crate) name: &'static str,
    /// m
    pub(crate) z: Vec<f64>,
    /// m/s
    pub(crate) v: Vec<f64>,
}

impl Track {
    pub(crate) fn of(name: &'static str, curve: &dyn Curve) -> Self {
        let states: Vec<_> =
            (0..FRAMES).map(|i| curve.at(time_s(i)).expect("it covers all frames")).collect();
        Self {
            name,
            z: states.iter().map(|s| s.position[Z]).collect(),
            v: states.iter().map(|s| s.velocity[Z]).collect(),
        }
    }
}

/// The methods of Table 1 in its order.
pub(crate) fn tracks(trial: &Trial) -> Vec<Track> {
    let (gdf, fused) = (trial.gdf(), trial.fused());
    let average = |window| {
        let frames = (0..FRAMES).map(time_s);
        MovingAverage::of(&gdf, frames, window, 1.5 * FRAME_S).expect("it covers all frames")
    };
    let pcf = pcf(&fused, 12, Coefficients::Independent);
    vec![
        Track::of("GDF", &gdf),
        Track::of("PCF (12)", &pcf),
        Track::of("SFF", &sff(&fused, Coefficients::Independent)),
        Track::of("moving average, 5 pts", &average(WINDOWS[0])),
        Track::of("moving average, 16 pts", &average(WINDOWS[1])),
        Track::of("moving average, 32 pts", &average(WINDOWS[2])),
    ]
}

/// PCF over all frames, eq. 3-6.
pub(crate) fn pcf(fused: &[Source], order: usize, coefficients: Coefficients) -> Polynomial {
    polynomial::fit(fused, 0.0, time_s(FRAMES - 1), order, coefficients, None).expect("enough samples")
}

/// SFF over all frames, eq. 7-11.
///
/// Nearly without a penalty, as printed. With none at all the coefficients beyond the ends grow until rounding shows in
/// the acceleration; this one holds them, and moves no number of Table 1 by more than 0.02.
pub(crate) fn sff(fused: &[Source], coefficients: Coefficients) -> Spline {
    let to_s = time_s(FRAMES - 1);
    let settings = Settings {
        width: 1.0,
        margin: 4,
        knot_spacing_s: Some(to_s / (KNOTS - 1) as f64),
        smoothing: Smoothing::Fixed(1e-6),
        coefficients,
    };
    spline::fit(fused, 0.0, to_s, &settings).expect("enough samples")
}
