//! Instants in whole nanoseconds, so that nothing is lost between a log and its track.

use std::fmt;

const NS_PER_S: i64 = 1_000_000_000;

/// An instant: nanoseconds since the epoch of the clock that stamped it (Unix time, as a rule).
///
/// Signed, since a clock offset may carry an instant below zero; it spans the years 1677 to 2262.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(i64);

impl Time {
    /// The instant `ns` nanoseconds after the epoch.
    #[must_use]
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// The instant of an MCAP time field, or `None` past the year 2262.
    #[must_use]
    pub fn from_log(ns: u64) -> Option<Self> {
        i64::try_from(ns).ok().map(Self)
    }

    /// The instant of a `{sec, nsec}` stamp, or `None` where it doesn't fit.
    #[must_use]
    pub fn from_stamp(sec: i64, nsec: i64) -> Option<Self> {
        sec.checked_mul(NS_PER_S)?.checked_add(nsec).map(Self)
    }

    /// Nanoseconds since the epoch.
    #[must_use]
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// The value of an MCAP time field; instants before the epoch become 0, which a log can't tell apart.
    #[must_use]
    pub fn to_log(self) -> u64 {
        u64::try_from(self.0).unwrap_or(0)
    }

    /// The parts of a `{sec, nsec}` stamp, `0 <= nsec < 1e9`.
    #[must_use]
    pub fn to_stamp(self) -> (i64, u32) {
        (self.0.div_euclid(NS_PER_S), self.0.rem_euclid(NS_PER_S) as u32)
    }

    /// Seconds from `origin` to this instant.
    ///
    /// The difference is taken in integers, so a track of an hour keeps a resolution of 1e-12 s.
    #[must_use]
    pub fn seconds_since(self, origin: Self) -> f64 {
        (i128::from(self.0) - i128::from(origin.0)) as f64 * 1e-9
    }

    /// The instant `seconds` after this one, to the nearest nanosecond; saturates at the ends.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * 1e9).round() as i64))
    }
}

impl fmt::Display for Time {
    /// Seconds with nine decimals, exact.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let ns = self.0.unsigned_abs();
        write!(f, "{sign}{}.{:09} s", ns / 1_000_000_000, ns % 1_000_000_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_before_the_epoch_keeps_a_positive_nsec() {
        let t = Time::from_ns(-1);
        assert_eq!(t.to_stamp(), (-1, 999_999_999));
        assert_eq!(Time::from_stamp(-1, 999_999_999), Some(t));
        assert_eq!(t.to_string(), "-0.000000001 s");
    }

    #[test]
    fn differences_of_present_day_instants_keep_every_nanosecond() {
        let origin = Time::from_ns(1_731_000_000_000_000_000);
        let t = Time::from_ns(1_731_000_003_600_000_001);
        assert_eq!((t.seconds_since(origin) * 1e9).round() as i64, 3_600_000_001);
        assert_eq!(origin.plus_seconds(t.seconds_since(origin)), t);
    }

    #[test]
    fn times_that_do_not_fit_are_refused() {
        assert_eq!(Time::from_log(u64::MAX), None);
        assert_eq!(Time::from_stamp(i64::MAX, 0), None);
    }
}
