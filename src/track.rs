//! The one thing that every estimator makes: a track.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::time::Time;

/// A curve's state at one instant, as an estimator knows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Position, m.
    pub position: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Acceleration, m/s2, where the method has one of its own.
    pub acceleration: Option<[f64; 3]>,
    /// Standard deviation of the position, m.
    pub position_sigma: [f64; 3],
    /// Standard deviation of the velocity, m/s.
    pub velocity_sigma: [f64; 3],
}

impl State {
    /// Whether position and velocity are numbers; a sigma may be unknown.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position.iter().chain(&self.velocity).all(|v| v.is_finite())
    }

    /// The state at `share` of the way from this one to `other`, by linear interpolation.
    #[must_use]
    pub fn mixed(&self, other: &Self, share: f64) -> Self {
        let mix = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
        Self {
            position: mix(self.position, other.position),
            velocity: mix(self.velocity, other.velocity),
            acceleration: self.acceleration.zip(other.acceleration).map(|(a, b)| mix(a, b)),
            position_sigma: mix(self.position_sigma, other.position_sigma),
            velocity_sigma: mix(self.velocity_sigma, other.velocity_sigma),
        }
    }
}

/// A fitted curve that can be asked for its state.
pub trait Curve {
    /// The state at `time_s` seconds since the track's origin, or `None` where the method doesn't reach.
    fn at(&self, time_s: f64) -> Option<State>;
}

/// What sees an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// One source.
    Single,
    /// Two or more.
    Overlap,
    /// None, but sources stand before and after.
    Bridged,
    /// None, and none comes after.
    Extrapolated,
}

impl Phase {
    /// The phase's name in logs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Overlap => "overlap",
            Self::Bridged => "bridged",
            Self::Extrapolated => "extrapolated",
        }
    }
}

/// How a point was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub enum Method {
    /// General data fusion, the weighted mean.
    #[serde(rename = "gdf")]
    WeightedMean,
    /// Polynomial constraint fusion.
    #[serde(rename = "pcf")]
    Polynomial,
    /// Spline function fusion.
    #[default]
    #[serde(rename = "sff")]
    Spline,
    /// Moving average over the weighted mean.
    #[serde(rename = "moving-average")]
    MovingAverage,
    /// Constant force and quadratic drag, for extrapolation only.
    #[serde(rename = "drag")]
    Drag,
    /// The robust smoother of USBL fixes.
    #[serde(rename = "usbl")]
    Usbl,
    /// USBL fixes by the past alone, improved.
    #[serde(rename = "usbl-causal")]
    UsblCausal,
    /// The same as the paper prints it.
    #[serde(rename = "usbl-paper")]
    UsblPaper,
}

impl Method {
    /// The method's name in configs, logs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::WeightedMean => "gdf",
            Self::Polynomial => "pcf",
            Self::Spline => "sff",
            Self::MovingAverage => "moving-average",
            Self::Drag => "drag",
            Self::Usbl => "usbl",
            Self::UsblCausal => "usbl-causal",
            Self::UsblPaper => "usbl-paper",
        }
    }
}

/// The track at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// The instant, on the datum's clock.
    pub time: Time,
    /// What the curve says.
    pub state: State,
    /// What sees this instant.
    pub phase: Phase,
    /// How the point was made.
    pub method: Method,
    /// The sources that see this instant: bit i is the i-th.
    pub seen_by: u32,
}

/// A track: points in order of time in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// The frame that the coordinates are in; empty where the log doesn't say.
    pub frame_id: String,
    /// The points.
    pub points: Vec<TrackPoint>,
}
