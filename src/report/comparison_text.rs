//! The report of `compare` as text.

use std::fmt::{self, Write};

use super::comparison::{ComparisonReport, Crossing, CrossingReport, PhaseErrors};
use super::text::{short, warnings};
use crate::printable::printable;
use crate::quality::Errors;

/// The comparison as a page of text.
#[must_use]
pub fn render_comparison(report: &ComparisonReport) -> String {
    let mut page = String::new();
    // writing to a String can't fail
    let _ = write_page(&mut page, report);
    page
}

fn write_page(out: &mut String, report: &ComparisonReport) -> fmt::Result {
    head(out, report)?;
    quantity(out, report, "position m", |p| p.position_m.as_ref())?;
    quantity(out, report, "velocity m/s", |p| p.velocity_m_s.as_ref())?;
    if !report.characteristic_points.is_empty() {
        writeln!(out)?;
        crossings(out, &report.characteristic_points)?;
    }
    writeln!(out)?;
    if let Some(jump) = &report.acceleration_jump {
        write!(out, "acceleration jumps by {:.2} m/s2 at most, at {:.2} s", jump.jump_m_s2, jump.time_s)?;
        if let Some(other) = &report.reference_acceleration_jump {
            write!(
                out,
                "; the reference's by {:.2} m/s2, at its own {} Hz",
                other.jump_m_s2,
                short(1.0 / other.step_s)
            )?;
        }
        writeln!(out)?;
    }
    for (i, worst) in report.worst.iter().enumerate() {
        let [x, y, z] = worst.error_m;
        let sigmas = worst.sigmas.map_or(String::new(), |s| format!(", {s:.1} sigmas"));
        let what = if i == 0 { "worst" } else { "then" };
        let phase = phase_name(&worst.phase, &worst.sources);
        writeln!(out, "{what:<5} at {:.2} s ({phase}): ({x:+.3}, {y:+.3}, {z:+.3}) m{sigmas}", worst.time_s)?;
    }
    warnings(out, &report.warnings)
}

fn head(out: &mut String, report: &ComparisonReport) -> fmt::Result {
    let reference = &report.reference;
    let paths: Vec<_> =
        [&reference.position, &reference.velocity].into_iter().flatten().map(|p| printable(p)).collect();
    write!(out, "{}: {} points", printable(&report.estimate), report.points)?;
    if report.uncompared_points > 0 {
        write!(out, ", {} of them without a reference beside them", report.uncompared_points)?;
    }
    writeln!(out, "; errors are track less reference, times count from T0")?;
    write!(out, "{}: ", paths.join(", "))?;
    let mut parts = Vec::new();
    for (count, what, sigma, unit) in [
        (reference.positions, "positions", reference.position_sigma_m, "m"),
        (reference.velocities, "velocities", reference.velocity_sigma_m_s, "m/s"),
    ] {
        let noise = sigma.map_or(" (noise unknown)".into(), |s| format!(" (noise {s:.1e} {unit})"));
        if count > 0 {
            parts.push(format!("{count} {what}{noise}"));
        }
    }
    parts.push(format!("by {}", reference.clock));
    if let Some((from, to)) = reference.span_s {
        parts.push(format!("{from:.2} .. {to:.2} s"));
    }
    writeln!(out, "{}", parts.join(", "))?;
    for (by, unit, what) in [
        (&report.interpolated_position, "m", "positions"),
        (&report.interpolated_velocity, "m/s", "velocities"),
    ] {
        if let Some(by) = by {
            let off = by.error.map_or("nobody knows how far".into(), |e| format!("by {e:.4} {unit} (rms)"));
            writeln!(out, "{what} of the {} are interpolated, which is off {off}", by.series)?;
        }
    }
    Ok(())
}

/// A line a phase and one for the whole track, where there is anything of this quantity.
fn quantity<'r>(
    out: &mut String,
    report: &'r ComparisonReport,
    title: &str,
    errors: impl Fn(&'r PhaseErrors) -> Option<&'r Errors>,
) -> fmt::Result {
    let phases = report.phases.iter().chain([&report.all]);
    let rows: Vec<(String, &Errors)> =
        phases.filter_map(|p| Some((phase_name(&p.phase, &p.sources), errors(p)?))).collect();
    if rows.is_empty() {
        return Ok(());
    }
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max(30);
    writeln!(out)?;
    writeln!(
        out,
        "{title:<width$} {:>8} {:>9} {:>26} {:>26} {:>8} {:>7} {:>9} {:>12}",
        "instants", "rmse 3-D", "rmse x y z", "mean x y z", "max", "inside", "err/sigma", "correlated s"
    )?;
    for (name, e) in &rows {
        let [x, y, z] = e.rmse_by_axis;
        let [mx, my, mz] = e.mean_by_axis;
        write!(
            out,
            "{name:<width$} {:>8} {:>9.3} {x:>8.3} {y:>8.3} {z:>8.3} {mx:>+8.3} {my:>+8.3} {mz:>+8.3} {:>8.3}",
            e.count, e.rmse, e.max
        )?;
        if let Some(bands) = &e.bands {
            let correlated = match (bands.autocorrelation, bands.correlation_s) {
                (None, _) => "-".into(),
                (Some(_), Some(s)) => format!("{s:.2}"),
                (Some(_), None) => "throughout".into(),
            };
            write!(out, " {:>6.1}% {:>9.2} {correlated:>12}", 100.0 * bands.inside, bands.normalised_rmse)?;
        } else {
            write!(out, " {:>7} {:>9} {:>12}", "-", "-", "-")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn crossings(out: &mut String, points: &[CrossingReport]) -> fmt::Result {
    writeln!(
        out,
        "{:<22} {:>8}   {:<18} {:>9} {:>8} {:>7}   {:<16} {:>9} {:>8} {:>7}",
        "characteristic point",
        "z m",
        "time s",
        "reference",
        "error",
        "inside",
        "speed m/s",
        "reference",
        "error",
        "inside"
    )?;
    for point in points {
        let value = |c: &Option<Crossing>, pick: fn(&Crossing) -> Option<f64>, digits: usize| {
            c.as_ref().and_then(pick).map_or("-".into(), |v| format!("{v:.digits$}"))
        };
        let with_sigma = |value: String, sigma: Option<f64>, digits: usize| {
            sigma.map_or(value.clone(), |s| format!("{value} ± {s:.digits$}"))
        };
        let (track, reference) = (&point.estimate, &point.reference);
        let time = value(track, |c| Some(c.time_s), 3);
        let time = with_sigma(time, track.as_ref().and_then(|c| c.time_sigma_s), 3);
        let speed = value(track, |c| c.vertical_speed_m_s, 2);
        let speed = with_sigma(speed, track.as_ref().and_then(|c| c.vertical_speed_sigma_m_s), 2);
        let percent = |e: Option<f64>| e.map_or("-".into(), |e| format!("{:.2} %", 100.0 * e));
        let inside = |i: Option<bool>| i.map_or("-", |i| if i { "yes" } else { "no" });
        writeln!(
            out,
            "{:<22} {:>8.2}   {time:<18} {:>9} {:>8} {:>7}   {speed:<16} {:>9} {:>8} {:>7}",
            printable(&point.name),
            point.z_m,
            value(reference, |c| Some(c.time_s), 3),
            percent(point.time_error),
            inside(point.time_inside),
            value(reference, |c| c.vertical_speed_m_s, 2),
            percent(point.speed_error),
            inside(point.speed_inside)
        )?;
    }
    Ok(())
}

/// `overlap: tether + beacon`; the topic alone where it has no phases.
fn phase_name(phase: &str, sources: &[String]) -> String {
    let sources = printable(&sources.join(" + ")).into_owned();
    match phase {
        "unlabelled" => sources,
        _ if sources.is_empty() => phase.to_owned(),
        _ => format!("{phase}: {sources}"),
    }
}
