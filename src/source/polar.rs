//! What a USBL system measures, in a message: range, bearing and depression.

use super::reading::Fault;
use crate::config::AngleUnit;
use crate::log::decode::Value;

/// Names of the fields, without their units; an elevation is a depression upwards.
const RANGE: [&str; 4] = ["range", "slant_range", "range_m", "slant_range_m"];
const BEARING: [&str; 2] = ["bearing", "azimuth"];
const DEPRESSION: [&str; 1] = ["depression"];
const ELEVATION: [&str; 1] = ["elevation"];

/// Whether `value` has the fields of a range, a bearing and a depression.
pub(super) fn is_polar(value: &Value) -> bool {
    parts(value).is_some()
}

/// The range, m, the bearing and the depression, rad, that `value` holds; angles whose names don't end in `_deg` or
/// `_rad` are in `unit`. `None` where it is of another kind.
///
/// # Errors
/// [`Fault::NotFinite`]; [`Fault::NoUnit`] for angles of which nothing tells the unit; [`Fault::NoRange`] for a range
/// that is not positive; [`Fault::NoAngle`] for more than a full turn of bearing or an upright of depression.
pub(super) fn polar(value: &Value, unit: Option<AngleUnit>) -> Option<Result<[f64; 3], Fault>> {
    let (range, bearing, depression, sign) = parts(value)?;
    let read = || {
        let number = |value: &Value| value.as_f64().filter(|n| n.is_finite()).ok_or(Fault::NotFinite);
        let radians = |(value, own): (&Value, Option<AngleUnit>)| {
            Ok(own.or(unit).ok_or(Fault::NoUnit)?.radians(number(value)?))
        };
        let (range_m, bearing, depression) = (number(range)?, radians(bearing)?, sign * radians(depression)?);
        if range_m <= 0.0 {
            return Err(Fault::NoRange);
        }
        // a little more than it can be: noise, and a turn that was not wrapped
        let is_angle = bearing.abs() <= 6.5 && depression.abs() <= 1.6;
        if is_angle { Ok([range_m, bearing, depression]) } else { Err(Fault::NoAngle) }
    };
    Some(read())
}

type Angle<'a> = (&'a Value, Option<AngleUnit>);

/// The fields, and whether the last of them counts downwards (1) or upwards (-1).
fn parts(value: &Value) -> Option<(&Value, Angle<'_>, Angle<'_>, f64)> {
    let range = RANGE.iter().find_map(|name| value.field(name))?;
    let angle = |names: &[&str]| names.iter().find_map(|name| angle(value, name));
    let down = angle(&DEPRESSION).map(|found| (found, 1.0));
    let (depression, sign) = down.or_else(|| Some((angle(&ELEVATION)?, -1.0)))?;
    Some((range, angle(&BEARING)?, depression, sign))
}

/// The field of that name, or with a unit behind it.
fn angle<'a>(value: &'a Value, name: &str) -> Option<Angle<'a>> {
    let with = |unit: AngleUnit| Some((value.field(&format!("{name}{}", unit.suffix()))?, Some(unit)));
    let plain = || Some((value.field(name)?, None));
    plain().or_else(|| with(AngleUnit::Degrees)).or_else(|| with(AngleUnit::Radians))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn object(fields: &[(&str, f64)]) -> Value {
        Value::Object(fields.iter().map(|(name, v)| ((*name).into(), Value::Float(*v))).collect())
    }

    fn read(fields: &[(&str, f64)], unit: Option<AngleUnit>) -> Option<Result<[f64; 3], &'static str>> {
        let found = polar(&object(fields), unit);
        found.map(|found| found.map_err(|fault| fault.description().unwrap_or_default()))
    }

    #[test]
    fn a_name_says_the_unit_and_else_the_config_does() {
        let plain = [("range", 100.0), ("bearing", 90.0), ("depression", 45.0)];
        let expected = Some(Ok([100.0, FRAC_PI_2, FRAC_PI_2 / 2.0]));
        assert_eq!(read(&plain, Some(AngleUnit::Degrees)), expected);
        let named = [("slant_range_m", 100.0), ("azimuth_deg", 90.0), ("elevation_rad", -FRAC_PI_2 / 2.0)];
        assert_eq!(read(&named, None), expected);
        assert!(read(&plain, None).is_some_and(|found| found.is_err()), "nothing tells the unit");
    }

    #[test]
    fn what_can_not_be_a_measurement_is_a_fault_and_no_position() {
        let fault = |range, bearing, depression| {
            let fields = [("range", range), ("bearing", bearing), ("depression", depression)];
            read(&fields, Some(AngleUnit::Radians)).is_some_and(|found| found.is_err())
        };
        assert!(!fault(10.0, 1.0, 1.0));
        assert!(fault(0.0, 1.0, 1.0) && fault(10.0, f64::NAN, 1.0), "no range, no bearing");
        assert!(fault(10.0, 90.0, 1.0) && fault(10.0, 1.0, 45.0), "degrees taken for radians");
        assert_eq!(read(&[("range", 1.0), ("bearing", 1.0)], None), None);
    }
}
