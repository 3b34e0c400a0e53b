//! The answer in a few sentences.

use crate::report::UsblReport;
use crate::report::html::value;
use crate::report::usbl::{duration, known, off};
use crate::time::Time;

/// How well the place is known, of what fixes, and how well the past alone would have said it.
pub(super) fn sentences(report: &UsblReport, t0: Time) -> Vec<String> {
    let zero = if t0.is_date() { format!("T0, {} UTC", t0.utc()) } else { "T0".into() };
    let (track, fixes) = (&report.track, &report.fixes);
    let wild = fixes.off_by_itself + fixes.off_as_cycle + fixes.off_depth;
    let share = 100.0 * wild as f64 / report.source.positions.max(1) as f64;
    let predicted = off(&report.prediction).map_or(String::new(), |off| {
        format!("A prediction by the past alone was off by {off} (root mean square). ")
    });
    vec![
        format!(
            "{} of track: the position is known to {} (1 sigma, over three axes).",
            duration(track.span_s.1 - track.span_s.0),
            known(report)
        ),
        format!(
            "Of {} fixes {wild} ({} %) were thrown out as wild; {} of {} exchanges were thrown out as a whole. {predicted}Times \
             count from {zero}.",
            report.source.positions,
            value(share, 0),
            report.exchanges.thrown_out,
            report.exchanges.count
        ),
    ]
}
