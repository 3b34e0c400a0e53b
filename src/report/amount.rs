//! Amounts as people read them: with the digits that matter and the unit that suits.

/// Rates, 1/s: four digits at most.
pub(super) fn rate(hz: f64) -> String {
    let digits = match hz {
        hz if hz >= 1e6 => return format!("{hz:.1e}"),
        hz if hz >= 1000.0 => 0,
        hz if hz >= 100.0 => 1,
        hz if hz >= 1.0 => 2,
        hz if hz >= 0.01 => 3,
        _ => return format!("{hz:.1e}"),
    };
    let text = format!("{hz:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Seconds.
pub(super) fn brief(s: f64) -> String {
    match s {
        s if s < 0.1 => format!("{s:.4}"),
        s if s < 100.0 => format!("{s:.2}"),
        s => format!("{s:.0}"),
    }
}

/// Milliseconds, of seconds; days where it is more than that.
pub(super) fn milliseconds(s: f64) -> String {
    const DAY_S: f64 = 86_400.0;
    match s.abs() {
        size if size < 1.0 => format!("{:.1}", 1e3 * s),
        size if size < DAY_S => format!("{:.0}", 1e3 * s),
        _ => format!("{:.0} days", s / DAY_S),
    }
}

/// Bytes.
pub(super) fn bytes(n: u64) -> String {
    let n = n as f64;
    match n {
        n if n < 1e3 => format!("{n} bytes"),
        n if n < 1e6 => format!("{:.1} kB", n / 1e3),
        n if n < 1e9 => format!("{:.1} MB", n / 1e6),
        n => format!("{:.1} GB", n / 1e9),
    }
}

/// So many of a thing.
pub(super) fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// A length of time: `33.27 s`, `3 min 20 s`, `2 h 05 min`, `12 days`.
pub(super) fn clock_time(s: f64) -> String {
    let whole = s.round() as u64;
    match s {
        s if s < 100.0 => format!("{s:.2} s"),
        s if s < 7200.0 => format!("{} min {:02} s", whole / 60, whole % 60),
        s if s < 172_800.0 => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
        _ => format!("{} days", whole / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_have_the_digits_that_matter() {
        let rates = [0.0042, 0.25, 9.93, 99.88, 100.0, 321.43, 6634.2, 5e8].map(rate);
        assert_eq!(rates, ["4.2e-3", "0.25", "9.93", "99.88", "100", "321.4", "6634", "5.0e8"]);
        assert_eq!([0.0123, 2.4, 1311.2].map(brief), ["0.0123", "2.40", "1311"]);
        assert_eq!([0.0027, -12.0, 1.763e9].map(milliseconds), ["2.7", "-12000", "20405 days"]);
        assert_eq!([999, 4_128, 52_300_000_000].map(bytes), ["999 bytes", "4.1 kB", "52.3 GB"]);
        assert_eq!([1, 2].map(|n| counted(n, "chunk")), ["1 chunk", "2 chunks"]);
        assert_eq!(
            [33.266, 200.2, 7500.0, 1e6].map(clock_time),
            ["33.27 s", "3 min 20 s", "2 h 05 min", "11 days"]
        );
    }
}
