//! The report as a page of text that is read in ten seconds.

use std::fmt::{self, Write};

use super::{ExtrapolationReport, PhaseReport, Report, registration};
use crate::printable::printable;

/// The report as text. It doesn't name the files, which may change without the track changing.
#[must_use]
pub fn render(report: &Report) -> String {
    let mut page = String::new();
    // writing to a String can't fail
    let _ = write_page(&mut page, report);
    page
}

fn write_page(out: &mut String, report: &Report) -> fmt::Result {
    let track = &report.track;
    sources(out, report)?;
    writeln!(out)?;
    let duration = track.span_s.1 - track.span_s.0;
    write!(
        out,
        "track   {} ({}), {} points at {} Hz over {duration:.2} s",
        track.method.to_uppercase(),
        track.coefficients,
        track.points,
        short(track.rate_hz)
    )?;
    if track.pieces > 1 {
        write!(out, ", in {} pieces", track.pieces)?;
    }
    if !track.frame_id.is_empty() {
        write!(out, ", frame {:?}", track.frame_id)?;
    }
    writeln!(out)?;
    origin(out, track.origin)?;
    if let Some(registration) = &report.registration {
        let what = if report.sources.len() > 1 { "registered to the datum" } else { "smoothed" };
        writeln!(out, "        {what} in {} steps, {} knots", registration.iterations, registration.knots)?;
    }
    if let Some(spline) = &report.spline {
        let [x, y, z] = spline.noise_scale;
        writeln!(
            out,
            "        {} knots, {:.3} s apart; residuals / sigmas: {x:.2} {y:.2} {z:.2} (x y z)",
            spline.knots, spline.knot_spacing_s
        )?;
    }
    if let Some(e) = &report.extrapolation {
        extrapolation(out, e, track.rate_hz)?;
    }
    writeln!(out)?;
    if let Some(found) = &report.registration {
        registration::write(out, found)?;
        writeln!(out)?;
    }
    phases(out, &report.phases)?;
    if !report.characteristic_points.is_empty() {
        writeln!(out)?;
        events(out, report)?;
    }
    notes(out, &report.notes)?;
    warnings(out, &report.warnings)
}

/// Where the zero of the coordinates is on the earth.
pub(super) fn origin(out: &mut String, origin: Option<[f64; 3]>) -> fmt::Result {
    let Some([latitude, longitude, altitude]) = origin else { return Ok(()) };
    writeln!(
        out,
        "        metres east, north and up of latitude {latitude:.7}, longitude {longitude:.7} (WGS 84), altitude \
         {altitude:.2} m"
    )
}

/// The notes, a line each, behind an empty one.
pub(super) fn notes(out: &mut String, notes: &[String]) -> fmt::Result {
    if !notes.is_empty() {
        writeln!(out)?;
    }
    notes.iter().try_for_each(|note| writeln!(out, "note: {}", printable(note)))
}

/// The warnings, a line each, behind an empty one.
pub(super) fn warnings(out: &mut String, warnings: &[String]) -> fmt::Result {
    if !warnings.is_empty() {
        writeln!(out)?;
    }
    warnings.iter().try_for_each(|warning| writeln!(out, "warning: {}", printable(warning)))
}

fn extrapolation(out: &mut String, e: &ExtrapolationReport, rate_hz: f64) -> fmt::Result {
    let early = if e.length_s + 1.5 / rate_hz < e.horizon_s { " (to the height where it stops)" } else { "" };
    write!(out, "        carried on {:.2} s{early}", e.length_s)?;
    for (i, law) in e.laws.iter().enumerate() {
        let name = match (law.order, law.prior) {
            (None, _) => "the law of drag".to_owned(),
            (Some(order), true) => format!("PCF of order {order} with a prior"),
            (Some(order), false) => format!("PCF of order {order}"),
        };
        let by = if i == 0 { " by" } else { ";\n        not by" };
        write!(
            out,
            "{by} {name}, fitted to the last {:.2} s: {:.2} m, {:.2} m/s off in {} trials {:.2} s ahead",
            law.window_s,
            law.holdout_position_m,
            law.holdout_velocity_m_s,
            law.holdout_trials,
            law.holdout_lead_s
        )?;
        if law.clearly_better {
            write!(out, "\n        which would have been clearly better: [extrapolation] {}", law.asked())?;
        }
    }
    writeln!(out)
}

fn sources(out: &mut String, report: &Report) -> fmt::Result {
    writeln!(
        out,
        "{:<22} {:>9} {:>8} {:>17}  {:<8} {:<18} sigma m, m/s",
        "source", "samples", "Hz", "from .. to s", "clock", "log - sample ms"
    )?;
    for source in &report.sources {
        let name = printable(&source.name);
        let name = if source.datum { format!("{name} (datum)") } else { name.into_owned() };
        let span = source.span_s.map_or("-".into(), |(a, b)| format!("{a:.2} .. {b:.2}"));
        let delay = format!("{:.1} ± {:.1}", 1e3 * source.delay_s, 1e3 * source.delay_spread_s);
        let sigma = [
            (source.position_sigma_m, &source.position_sigma_from),
            (source.velocity_sigma_m_s, &source.velocity_sigma_from),
        ];
        let sigma = sigma.map(|(sigma, from)| {
            sigma.zip(from.as_ref()).map_or("-".into(), |(s, from)| format!("{s:.3} ({from})"))
        });
        let samples = source.positions.max(source.velocities);
        let rate = source.rate_hz.map_or("-".into(), short);
        writeln!(
            out,
            "{name:<22} {samples:>9} {rate:>8} {span:>17}  {:<8} {delay:<18} {}",
            source.clock,
            sigma.join(", ")
        )?;
        let paths: Vec<_> =
            [&source.position, &source.velocity].into_iter().flatten().map(|p| printable(p)).collect();
        writeln!(out, "  {}", paths.join(", "))?;
    }
    if let Some(datum) = report.sources.iter().find(|s| s.datum) {
        writeln!(
            out,
            "errors of the datum itself ({}) can't be seen by anyone: they pass into the track 1:1",
            datum.name
        )?;
    }
    if report.sources.len() == 1 {
        writeln!(out, "one source only: it is smoothed and carried on, and nothing checks it")?;
    }
    if report.unchecked_chunks > 0 {
        let chunks = report.unchecked_chunks;
        writeln!(
            out,
            "not checked: the checksums of {chunks} uncompressed chunks, read by message index (--check-chunks checks)"
        )?;
    }
    if !report.unused_topics.is_empty() {
        let topics: Vec<_> = report.unused_topics.iter().map(|t| printable(t)).collect();
        writeln!(out, "not used: {}", topics.join(", "))?;
    }
    Ok(())
}

pub(super) fn phases(out: &mut String, phases: &[PhaseReport]) -> fmt::Result {
    writeln!(
        out,
        "{:<34} {:>17} {:>8}   {:<21} 1 sigma of the track",
        "phase", "from .. to s", "points", "rmse to the samples"
    )?;
    for phase in phases {
        let name = if phase.sources.is_empty() {
            phase.phase.clone()
        } else {
            format!("{}: {}", phase.phase, printable(&phase.sources.join(" + ")))
        };
        let name = if phase.stretches > 1 { format!("{name} ({} parts)", phase.stretches) } else { name };
        let span = format!("{:.2} .. {:.2}", phase.span_s.0, phase.span_s.1);
        let sigma = |v: Option<f64>, unit: &str| v.map_or("unknown".into(), |v| format!("{v:.3} {unit}"));
        let rmse = |v: Option<f64>, unit: &str| v.map_or("-".into(), |v| format!("{v:.3} {unit}"));
        let rmse = match (phase.position_rmse_m, phase.velocity_rmse_m_s) {
            (None, None) => "-".to_owned(),
            (p, v) => format!("{}, {}", rmse(p, "m"), rmse(v, "m/s")),
        };
        writeln!(
            out,
            "{name:<34} {span:>17} {:>8}   {rmse:<21} {}, {}",
            phase.points,
            sigma(phase.position_sigma_m, "m"),
            sigma(phase.velocity_sigma_m_s, "m/s")
        )?;
    }
    Ok(())
}

fn events(out: &mut String, report: &Report) -> fmt::Result {
    writeln!(
        out,
        "{:<34} {:>20} {:>12} {:>24}   phase",
        "characteristic point", "time s", "z m", "vertical speed m/s"
    )?;
    for event in &report.characteristic_points {
        let time = event
            .time_sigma_s
            .map_or(format!("{:.3} ± ?", event.time_s), |s| format!("{:.3} ± {s:.3}", event.time_s));
        let sigma = event.velocity_sigma_m_s.map_or("?".into(), |s| format!("{:.2}", s[2]));
        let speed = format!("{:.2} ± {sigma}", event.velocity_m_s[2]);
        writeln!(
            out,
            "{:<34} {time:>20} {:>12.2} {speed:>24}   {}",
            printable(&event.name),
            event.position_m[2],
            event.phase
        )?;
    }
    Ok(())
}

/// A number without needless digits.
pub(super) fn short(v: f64) -> String {
    // below 0.1 two digits that count
    let decimals = if v == 0.0 || v.abs() >= 0.1 { 2.0 } else { 1.0 - v.abs().log10().floor() };
    let text = format!("{v:.*}", (decimals as usize).min(12));
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::LawReport;

    #[test]
    fn a_low_rate_is_not_printed_as_none() {
        assert_eq!([0.001, 0.0213, 0.1, 20.0, 0.0].map(short), ["0.001", "0.021", "0.1", "20", "0"]);
    }

    #[test]
    fn a_law_that_would_clearly_have_been_better_is_named_with_what_to_ask_for() {
        let law = |method: &str, order, clearly_better| LawReport {
            method: method.into(),
            order,
            prior: order.is_some(),
            window_s: 1.4,
            holdout_position_m: 0.3,
            holdout_velocity_m_s: 0.2,
            holdout_lead_s: 0.8,
            holdout_trials: 6,
            clearly_better,
        };
        let page = |clearly_better| {
            let laws = vec![law("pcf", Some(4), false), law("drag", None, clearly_better)];
            let report = ExtrapolationReport { horizon_s: 2.0, length_s: 2.0, laws };
            let mut out = String::new();
            extrapolation(&mut out, &report, 50.0).expect("a String takes everything");
            out
        };
        let said = "which would have been clearly better: [extrapolation] method = \"drag\"";
        assert!(page(true).contains(said), "{}", page(true));
        assert!(!page(false).contains("better"), "{}", page(false));
    }
}
