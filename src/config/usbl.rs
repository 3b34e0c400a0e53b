//! `[usbl]`: which fixes are cleaned, and how.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Axes, TimeChoice};

/// The fixes that `trackfuse usbl` cleans, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Usbl {
    /// Message path of the fixes: an object with x, y, z or an array of three, m, or one with latitude, longitude,
    /// degrees, and depth or altitude, m; default: the one topic with `usbl` in its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/usbl/fix.position")]
    pub fix: Option<String>,
    /// Directions of x, y and z of the fixes; of no meaning for latitudes.
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
    /// Message path of a number: the vehicle's depth below the surface, m, where z = 0 is the surface; default: the
    /// depth is not used.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"/ctd.depth")]
    pub depth: Option<String>,
    /// Standard deviation of the depth, m.
    pub depth_sigma_m: f64,
    /// The vehicle is rarely faster, m/s. Twice what a deep submersible does; towed vehicles need more.
    pub speed_limit_m_s: f64,
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
            depth: None,
            depth_sigma_m: 1.0,
            speed_limit_m_s: 2.5,
            cycle_s: None,
            prediction: Causal::Improved,
        }
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
