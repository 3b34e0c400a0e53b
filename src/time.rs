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

impl Time {
    /// Whether a clock that counts from 1970 may have shown this in a recording: 1990 or later.
    #[must_use]
    pub fn is_date(self) -> bool {
        self.0 >= 631_152_000 * NS_PER_S
    }

    /// Date and time of day in UTC, to the millisecond below, such as `2025-11-13 10:17:20.143`; for clocks
    /// that count from 1970.
    #[must_use]
    pub fn utc(self) -> String {
        let days = self.0.div_euclid(86_400 * NS_PER_S);
        let ms = self.0.rem_euclid(86_400 * NS_PER_S) / 1_000_000;
        let (year, month, day) = civil(days);
        let (s, min, h) = (ms / 1000 % 60, ms / 60_000 % 60, ms / 3_600_000);
        format!("{year:04}-{month:02}-{day:02} {h:02}:{min:02}:{s:02}.{:03}", ms % 1000)
    }
}

/// Year, month and day of the Gregorian calendar, `days` after 1970-01-01.
///
/// After Hinnant, "chrono-compatible low-level date algorithms" (2013): years begin in March, eras of 400
/// years are all alike.
fn civil(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468; // since 0000-03-01
    let (era, day_of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    (400 * era + year_of_era + i64::from(month <= 2), month, day)
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

    #[test]
    fn instants_have_the_dates_that_a_calendar_gives_them() {
        for (s, date) in [
            (0, "1970-01-01 00:00:00.000"),
            (-1, "1969-12-31 23:59:59.000"),
            (951_827_696, "2000-02-29 12:34:56.000"),
            (1_763_029_040, "2025-11-13 10:17:20.000"),
            (4_107_542_400, "2100-03-01 00:00:00.000"),
        ] {
            assert_eq!(Time::from_ns(s * NS_PER_S).utc(), date);
        }
        assert_eq!(Time::from_ns(999_999).utc(), "1970-01-01 00:00:00.000");
        assert_eq!(Time::from_ns(i64::MAX).utc(), "2262-04-11 23:47:16.854");
    }
}
