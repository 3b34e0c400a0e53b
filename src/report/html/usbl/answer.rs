//! The answer in a few sentences.

use crate::report::html::value;
use crate::report::{PredictionReport, UsblReport};
use crate::time::Time;
use crate::track::Phase;

/// How well the place is known, of what fixes, and how well the past alone would have said it.
pub(super) fn sentences(report: &UsblReport, t0: Time) -> Vec<String> {
    let zero = if t0.is_date() { format!("T0, {} UTC", t0.utc()) } else { "T0".into() };
    let (track, fixes) = (&report.track, &report.fixes);
    let wild = fixes.off_by_itself + fixes.off_as_cycle + fixes.off_depth;
    let share = 100.0 * wild as f64 / report.source.positions.max(1) as f64;
    vec![
        format!(
            "{} of track: the position is known to {} (1 sigma, over three axes).",
            duration(track.span_s.1 - track.span_s.0),
            known(report)
        ),
        format!(
            "Of {} fixes {wild} ({} %) were thrown out as wild; {} of {} exchanges were thrown out as a whole. {} Times \
             count from {zero}.",
            report.source.positions,
            value(share, 0),
            report.exchanges.thrown_out,
            report.exchanges.count,
            predicted(&report.prediction)
        ),
    ]
}

/// Seconds, and minutes where there are many.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 300.0 { format!("{} s", value(seconds, 0)) } else { format!("{} min", value(seconds / 60.0, 1)) }
}

fn known(report: &UsblReport) -> String {
    let of_phase = |p: &crate::report::PhaseReport| {
        let sigma_m = value(p.position_sigma_m?, 1);
        let place = if p.phase == Phase::Bridged.name() {
            let seconds = p.points as f64 / report.track.rate_hz;
            format!("{sigma_m} m in {} of silence", duration(seconds))
        } else {
            format!("{sigma_m} m where fixes come")
        };
        Some(format!("± {place}"))
    };
    let known: Vec<String> = report.phases.iter().filter_map(of_phase).collect();
    if known.is_empty() { "nobody knows what".into() } else { known.join(", ") }
}

fn predicted(prediction: &PredictionReport) -> String {
    let while_seen = prediction.rmse_m.map(|m| format!("{} m off while fixes came", value(m, 1)));
    let silent = prediction.silent_rmse_m.map(|m| format!("{} m in silence", value(m, 1)));
    let off: Vec<String> = while_seen.into_iter().chain(silent).collect();
    if off.is_empty() {
        return String::new();
    }
    format!("Whoever knew the past alone was {} (root mean square).", off.join(" and "))
}
