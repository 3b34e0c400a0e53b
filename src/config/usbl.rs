//! `[usbl]`: which fixes are cleaned, and how.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Axes, TimeChoice};

/// The fixes that `trackfuse usbl` cleans, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Usbl {
    /// Message path of the fixes: an object with x, y, z or an array of three, m; or one with latitude, longitude,
    /// degrees, and depth or altitude, m; or one with range, m, bearing (or azimuth), clockwise from the bow, and depression
    /// (or elevation), of a system that corrects the ship's roll and pitch; default: the one topic with `usbl` in its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/usbl/fix.position")]
    pub fix: Option<String>,
    /// Directions of x, y and z of the fixes and of the ship; of no meaning for latitudes.
    pub axes: Axes,
    /// What counts as a fix's time; default: its stamp, else the publish time, else the log time.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"log")]
    pub time: Option<TimeChoice>,
    /// How long before its time a fix was taken, s.
    pub latency_s: f64,
    /// Standard deviation of a fix an axis, m; default: from the messages, else estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 3.0)]
    pub sigma_m: Option<f64>,
    /// What the noise grows by with the slant range, as a share of it: 0.005 adds 5 m an axis at 1000 m, in squares; needs
    /// `ship`. Of no meaning for ranges and bearings, whose noise is that of the angles.
    pub sigma_of_range: f64,
    /// Message path of the position of the ship's transducer: as the fixes', but for ranges; needed for fixes that are
    /// ranges and bearings.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/ship/navigation.position")]
    pub ship: Option<String>,
    /// Message path of a number: the ship's heading, clockwise from north; needed for fixes that are ranges and bearings.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/ship/navigation.heading")]
    pub heading: Option<String>,
    /// Unit of bearings, depressions and headings whose fields' names don't end in `_deg` or `_rad`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"deg")]
    pub angles: Option<AngleUnit>,
    /// Standard deviation of a range, m.
    pub range_sigma_m: f64,
    /// Standard deviation of a bearing and a depression, degrees.
    pub angle_sigma_deg: f64,
    /// Standard deviation of the ship's heading, degrees.
    pub heading_sigma_deg: f64,
    /// Standard deviation of the ship's position an axis, m; default: from the messages, else estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.0)]
    pub ship_sigma_m: Option<f64>,
    /// Message path of a number: the vehicle's depth below the surface, m, where z = 0 is the surface; default: the
    /// depth is not used.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/vehicle/depth.depth")]
    pub depth: Option<String>,
    /// Standard deviation of the depth, m.
    pub depth_sigma_m: f64,
    /// The vehicle is rarely faster, m/s. Twice what a deep submersible does; towed vehicles need more.
    pub speed_limit_m_s: f64,
    /// The longest silence that is bridged, s; a longer one parts the log into tracks of their own.
    pub bridge_max_s: f64,
    /// Time from one acoustic exchange to the next, s, for the prediction; default: the fixes'.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 20.0)]
    pub cycle_s: Option<f64>,
    /// The causal method whose predictions are written beside the track.
    pub prediction: Causal,
}

impl Default for Usbl {
    fn default() -> Self {
        Self {
            fix: None,
            axes: Axes::Enu,
            time: None,
            latency_s: 0.0,
            sigma_m: None,
            sigma_of_range: 0.0,
            ship: None,
            heading: None,
            angles: None,
            range_sigma_m: 0.5,
            angle_sigma_deg: 0.3,
            heading_sigma_deg: 0.3,
            ship_sigma_m: None,
            depth: None,
            depth_sigma_m: 1.0,
            speed_limit_m_s: 2.5,
            bridge_max_s: 1800.0,
            cycle_s: None,
            prediction: Causal::Improved,
        }
    }
}

/// A unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AngleUnit {
    /// Degrees.
    #[serde(rename = "deg")]
    Degrees,
    /// Radians.
    #[serde(rename = "rad")]
    Radians,
}

impl AngleUnit {
    /// `angle` in radians.
    #[must_use]
    pub fn radians(self, angle: f64) -> f64 {
        match self {
            Self::Degrees => angle.to_radians(),
            Self::Radians => angle,
        }
    }

    /// What a field's name ends in that says so.
    #[must_use]
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Degrees => "_deg",
            Self::Radians => "_rad",
        }
    }

    /// The unit that a field's name says.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        [Self::Degrees, Self::Radians].into_iter().find(|unit| name.ends_with(unit.suffix()))
    }
}

/// A method that knows the past alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Causal {
    /// Several filters of which the likeliest speaks, with its standard deviation.
    #[default]
    Improved,
    /// The paper's recursion on quadratics, as it is printed.
    Paper,
}
