//! Comma-separated values: one line a point, empty where there is no value.

use std::io::{self, Write};

use crate::source::Recorded;
use crate::time::Time;
use crate::track::TrackPoint;

/// The columns' names, each with its unit.
pub const COLUMNS: [&str; 19] = [
    "time_ns",
    "t_s",
    "x_m",
    "y_m",
    "z_m",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "ax_m_s2",
    "ay_m_s2",
    "az_m_s2",
    "x_sigma_m",
    "y_sigma_m",
    "z_sigma_m",
    "vx_sigma_m_s",
    "vy_sigma_m_s",
    "vz_sigma_m_s",
    "phase",
    "method",
];

/// Writes the track as CSV; `t_s` counts from `t0`.
///
/// # Errors
/// That of the writer.
pub fn write_csv(recorded: &Recorded, t0: Time, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for row in rows(recorded, t0) {
        writeln!(out, "{}", row.join(","))?;
    }
    Ok(())
}

/// The table's rows as text, in the order of [`COLUMNS`].
pub fn rows(recorded: &Recorded, t0: Time) -> impl Iterator<Item = Vec<String>> + '_ {
    recorded.track.points.iter().map(move |point| {
        let ns = i128::from(point.time.ns()) - i128::from(t0.ns());
        let mut row = vec![point.time.ns().to_string(), seconds(ns)];
        row.extend(numbers(point).iter().map(|v| if v.is_finite() { v.to_string() } else { String::new() }));
        let labels = [point.phase.name(), point.method.name()];
        row.extend(labels.map(|l| if recorded.has_phases { l.to_owned() } else { String::new() }));
        row
    })
}

/// The values of the columns from `x_m` to `vz_sigma_m_s`; not finite where there is none.
pub(super) fn numbers(point: &TrackPoint) -> [f64; 15] {
    let s = &point.state;
    let acceleration = s.acceleration.unwrap_or([f64::NAN; 3]);
    let vectors = [s.position, s.velocity, acceleration, s.position_sigma, s.velocity_sigma];
    std::array::from_fn(|i| vectors[i / 3][i % 3])
}

/// Nanoseconds as seconds, exactly.
fn seconds(ns: i128) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    let ns = ns.unsigned_abs();
    format!("{sign}{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    #[test]
    fn seconds_are_exact_on_both_sides_of_zero() {
        assert_eq!(super::seconds(-1), "-0.000000001");
        assert_eq!(super::seconds(1_500_000_000), "1.500000000");
    }
}
