//! Latitude, longitude and altitude in a message: `sensor_msgs/NavSatFix`, `foxglove.LocationFix`, and all that has
//! fields of these names, in degrees and metres; a depth in place of the altitude counts downwards from altitude 0.

use super::reading::Fault;
use crate::log::decode::Value;
use crate::math::geodesy::Geodetic;

/// The place that `value` holds; `None` where it is of another kind.
///
/// # Errors
/// [`Fault::NoFix`] where its status says that there is none, [`Fault::NotFinite`], [`Fault::OffEarth`].
pub(super) fn fix(value: &Value) -> Option<Result<Geodetic, Fault>> {
    let field = |name| value.field(name);
    let (altitude, sign) = field("altitude").map(|up| (up, 1.0)).or_else(|| Some((field("depth")?, -1.0)))?;
    let fields = [field("latitude")?, field("longitude")?, altitude];
    // `NavSatStatus`: below 0 the receiver has no fix, whatever it writes for one.
    let status = field("status").and_then(|status| status.field("status")).and_then(Value::as_i64);
    if status.is_some_and(|status| status < 0) {
        return Some(Err(Fault::NoFix));
    }
    let mut numbers = fields.map(|field| field.as_f64().unwrap_or(f64::NAN));
    numbers[2] *= sign;
    Some(if numbers.iter().any(|n| !n.is_finite()) {
        Err(Fault::NotFinite)
    } else if numbers[0].abs() > 90.0 || numbers[1].abs() > 360.0 {
        Err(Fault::OffEarth)
    } else {
        Ok(Geodetic::from_degrees(numbers))
    })
}

/// Whether a message's covariance means nothing: `COVARIANCE_TYPE_UNKNOWN`.
pub(super) fn covariance_is_unknown(value: &Value) -> bool {
    value.field("position_covariance_type").and_then(Value::as_i64) == Some(0)
}
