//! Why what was measured of a dive does not fit together.

use std::fmt;

use crate::printable::printable;
use crate::time::Time;

/// Why fixes can't be used with what the config names beside them.
#[derive(Debug, thiserror::Error)]
pub enum DiveError {
    /// Angles of which nothing tells the unit.
    #[error("source {name:?}: the angles at {} may be degrees or radians", printable(path))]
    NoUnit {
        /// The source.
        name: String,
        /// The path.
        path: String,
    },
    /// Angles beyond those that there are.
    #[error(
        "source {name:?}: the angles at {} are beyond a turn, or depressions beyond the vertical, in {beyond} of {count} \
         messages",
        printable(path)
    )]
    NotAngles {
        /// The source.
        name: String,
        /// The path.
        path: String,
        /// Number of messages with such angles.
        beyond: usize,
        /// Number of messages.
        count: usize,
    },
    /// Ranges and bearings, and nothing to count them from.
    #[error(
        "the fixes at {} are ranges, bearings and depressions, expected the ship's position and heading beside them",
        printable(path)
    )]
    NoShip {
        /// The fixes' path.
        path: String,
    },
    /// The ship is known, but never when there is a fix.
    #[error(
        "none of the {} fixes has the ship's {what} beside it, expected samples at most {most_gap_s:.0} s apart about it: \
         fixes {fixes}; {}",
        fixes.count,
        listed(ship)
    )]
    ShipElsewhere {
        /// What of the ship is needed.
        what: &'static str,
        /// When there are fixes.
        fixes: Span,
        /// When what of the ship is known.
        ship: Vec<(&'static str, Span)>,
        /// Between samples farther apart nothing is known, s.
        most_gap_s: f64,
    },
    /// The depth is known, but never when there is a fix.
    #[error(
        "none of the {} fixes has a depth beside it, expected depths at most {most_gap_s:.0} s apart about it: fixes \
         {fixes}; depths {depths}",
        fixes.count
    )]
    DepthElsewhere {
        /// When there are fixes.
        fixes: Span,
        /// When there are depths.
        depths: Span,
        /// Between depths farther apart nothing is known, s.
        most_gap_s: f64,
    },
    /// A clock that counts from another epoch than the fixes'.
    #[error(
        "the fixes' and the {name}'s clocks are of different epochs, {apart_s:.0} s apart, expected one clock"
    )]
    Epochs {
        /// What is timed by it.
        name: &'static str,
        /// How far they are apart, s.
        apart_s: f64,
    },
    /// A range from a ship that is in another frame than the fix.
    #[error(
        "the range of a fix, which `sigma_of_range` asks for, needs the fixes and the ship in one frame: {}",
        if *fixes_are_places {
            "the fixes are latitudes and longitudes, the ship's positions are metres"
        } else {
            "the fixes are metres, the ship's positions are latitudes and longitudes"
        }
    )]
    OtherFrame {
        /// Whether it is the fixes that are latitudes and longitudes.
        fixes_are_places: bool,
    },
    /// Altitudes that don't count from the surface.
    #[error(
        "the fixes' heights, from altitudes, are off the depth sensor's by a median of {offset_m:.1} m at {count} fixes, \
         expected the same zero"
    )]
    SurfaceElsewhere {
        /// The fixes' height less the depth sensor's, m.
        offset_m: f64,
        /// How many fixes have a depth beside them.
        count: usize,
        /// Latitude, longitude, degrees, and the surface's altitude by the depths, m.
        surface: [f64; 3],
    },
}

impl DiveError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::NoUnit { .. } => "`angles = \"deg\"` or `angles = \"rad\"` in `[usbl]` says which".into(),
            Self::NotAngles { .. } => {
                "if they are degrees, `angles = \"deg\"` in `[usbl]` says so, for fields whose names don't end in `_rad`".into()
            }
            Self::NoShip { .. } => {
                "`ship = \"/ship/navigation.position\"` and `heading = \"/ship/navigation.heading\"` in `[usbl]` name them, by \
                 the message paths of your log, and `angles = \"deg\"` or `\"rad\"` the unit of the angles"
                    .into()
            }
            Self::ShipElsewhere { .. } | Self::Epochs { .. } => ONE_CLOCK.into(),
            Self::DepthElsewhere { .. } => {
                format!("{ONE_CLOCK}; leave `depth` out of `[usbl]` to do without it")
            }
            Self::OtherFrame { .. } => {
                "name positions of the fixes' kind with `ship` in `[usbl]`, or leave `sigma_of_range` out".into()
            }
            Self::SurfaceElsewhere { surface: [latitude, longitude, altitude], .. } => format!(
                "`origin = [{latitude:.6}, {longitude:.6}, {altitude:.1}]` in `[output]` puts z = 0 at the surface; depths \
                 count downwards, in metres"
            ),
        }
    }
}

/// What to do where clocks differ.
const ONE_CLOCK: &str = "`time = \"log\"` in `[usbl]` times all of its channels by the log's clock";

/// When there are samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// How many.
    pub count: usize,
    /// The first.
    pub from: Time,
    /// The last.
    pub to: Time,
}

impl Span {
    /// That of times, s since `origin`, in order.
    pub(super) fn of(origin: Time, times_s: impl Iterator<Item = f64> + Clone) -> Self {
        let at = |time_s: Option<f64>| origin.plus_seconds(time_s.unwrap_or(0.0));
        let count = times_s.clone().count();
        Self { count, from: at(times_s.clone().next()), to: at(times_s.last()) }
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "from {} to {}", self.from, self.to)?;
        let steps = self.count.saturating_sub(1);
        if steps > 0 {
            write!(f, ", one every {:.1} s", self.to.seconds_since(self.from) / steps as f64)?;
        }
        Ok(())
    }
}

fn listed(spans: &[(&str, Span)]) -> String {
    let spans: Vec<String> = spans.iter().map(|(what, span)| format!("{what} {span}")).collect();
    spans.join("; ")
}
