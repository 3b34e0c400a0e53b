//! Latitude, longitude and altitude in a message: `sensor_msgs/NavSatFix`, `foxglove.LocationFix`, and all that has
//! fields of these names, in degrees and metres; a depth in place of the altitude counts downwards from altitude 0.

use super::reading::Fault;
use crate::log::decode::Value;
use crate::math::geodesy::Geodetic;

/// What a place's height was given as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    /// An altitude: the ellipsoid's zero may be a hundred metres off the sea's.
    Altitude,
    /// A depth below the sea's surface.
    Depth,
}

/// The place that `value` holds; `None` where it is of another kind.
///
/// # Errors
/// [`Fault::NoFix`] where its status says that there is none, [`Fault::NotFinite`], [`Fault::OffEarth`].
pub(super) fn fix(value: &Value) -> Option<Result<(Geodetic, Level), Fault>> {
    let field = |name| value.field(name);
    let up = field("altitude").map(|up| (up, Level::Altitude));
    let (altitude, level) = up.or_else(|| Some((field("depth")?, Level::Depth)))?;
    let fields = [field("latitude")?, field("longitude")?, altitude];
    // `NavSatStatus`: below 0 the receiver has no fix, whatever it writes for one.
    let status = field("status").and_then(|status| status.field("status")).and_then(Value::as_i64);
    if status.is_some_and(|status| status < 0) {
        return Some(Err(Fault::NoFix));
    }
    let mut numbers = fields.map(|field| field.as_f64().unwrap_or(f64::NAN));
    if level == Level::Depth {
        numbers[2] = -numbers[2];
    }
    Some(if numbers.iter().any(|n| !n.is_finite()) {
        Err(Fault::NotFinite)
    } else if numbers[0].abs() > 90.0 || numbers[1].abs() > 360.0 {
        Err(Fault::OffEarth)
    } else {
        Ok((Geodetic::from_degrees(numbers), level))
    })
}

/// Whether a message's covariance means nothing: `COVARIANCE_TYPE_UNKNOWN`.
pub(super) fn covariance_is_unknown(value: &Value) -> bool {
    value.field("position_covariance_type").and_then(Value::as_i64) == Some(0)
}
