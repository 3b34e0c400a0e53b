//! The answer in two sentences.

use crate::report::html::tables::decimals;
use crate::report::html::{plus_minus, value};
use crate::report::{PhaseReport, Report, SourceReport};
use crate::time::Time;
use crate::track::Phase;

/// Characteristic points that are named; the table has all.
const NAMED: usize = 4;

/// How long the track is, from what, how sure; then the characteristic points.
pub(super) fn sentences(report: &Report, t0: Time) -> Vec<String> {
    vec![of_track(report), of_points(report, t0)]
}

fn of_track(report: &Report) -> String {
    let track = &report.track;
    let sources: Vec<String> = report.sources.iter().map(named).collect();
    let from = match &sources[..] {
        [only] => format!("{only} alone, which nothing checks"),
        _ => format!("{}{}", sources.join(" and "), registered(report)),
    };
    let known = [Phase::Overlap, Phase::Single, Phase::Bridged, Phase::Extrapolated]
        .iter()
        .filter_map(|phase| sigma(*phase, &report.phases));
    let known: Vec<String> = known.collect();
    format!(
        "{} s of track by {} from {from}: 1 sigma of the position is {}.",
        value(track.span_s.1 - track.span_s.0, 2),
        track.method.to_uppercase(),
        if known.is_empty() { "not known".into() } else { known.join(", ") }
    )
}

fn named(source: &SourceReport) -> String {
    if source.datum { format!("{} (datum)", source.name) } else { source.name.clone() }
}

fn registered(report: &Report) -> &'static str {
    if report.registration.is_some() { ", registered to the datum" } else { ", not registered" }
}

/// To the millimetre, and what is less to two digits.
fn metres(v: f64) -> String {
    value(v, if v < 1e-3 { decimals(v) } else { 3 })
}

/// From the smallest to the largest of the stretches of this phase.
fn sigma(phase: Phase, phases: &[PhaseReport]) -> Option<String> {
    let of_phase = || phases.iter().filter(|p| p.phase == phase.name());
    let sigmas = || of_phase().filter_map(|p| p.position_sigma_m);
    let (low, high) = sigmas().fold((f64::MAX, f64::MIN), |(a, b), s| (a.min(s), b.max(s)));
    let range = match () {
        () if low > high && of_phase().next().is_none() => return None,
        () if low > high => "unknown".into(),
        () if metres(low) == metres(high) => format!("{} m", metres(low)),
        () => format!("{} to {} m", metres(low), metres(high)),
    };
    let place = match phase {
        Phase::Single => "where one source sees",
        Phase::Overlap => "where several see",
        Phase::Bridged => "where none sees in between",
        Phase::Extrapolated => "where it is extrapolated",
    };
    Some(format!("{range} {place}"))
}

fn of_points(report: &Report, t0: Time) -> String {
    let points = &report.characteristic_points;
    let zero = if t0.is_date() { format!("T0, {} UTC", t0.utc()) } else { "T0".into() };
    if points.is_empty() {
        return format!(
            "No characteristic point was reached, or none was asked for. Times count from {zero}."
        );
    }
    let passed = points.iter().take(NAMED).map(|p| {
        let beyond = if p.phase == Phase::Extrapolated.name() { ", extrapolated" } else { "" };
        format!(
            "{} (z = {} m{beyond}) after {} s at {} m/s upward",
            p.name,
            value(p.position_m[2], 2),
            plus_minus(p.time_s, p.time_sigma_s, 3),
            plus_minus(p.velocity_m_s[2], p.velocity_sigma_m_s.map(|s| s[2]), 2)
        )
    });
    let mut passed: Vec<String> = passed.collect();
    if points.len() > NAMED {
        passed.push(format!("and {} more", points.len() - NAMED));
    }
    format!("It rises through {}; times count from {zero}.", passed.join("; "))
}
