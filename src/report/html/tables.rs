//! Tables that every track's page has: its phases, its sources, where it comes from.

use super::table::NONE;
use super::{Column, Part, Table, plus_minus, value};
use crate::report::{PhaseReport, SourceReport};

/// The track phase by phase.
pub(super) fn phases(phases: &[PhaseReport]) -> Table {
    let rows = phases.iter().map(|p| {
        let name =
            if p.stretches > 1 { format!("{} ({} parts)", p.phase, p.stretches) } else { p.phase.clone() };
        vec![
            name,
            if p.sources.is_empty() { NONE.into() } else { p.sources.join(" + ") },
            span(Some(p.span_s)),
            p.points.to_string(),
            value(p.position_sigma_m, 3),
            value(p.velocity_sigma_m_s, 3),
            value(p.position_rmse_m, 3),
            value(p.velocity_rmse_m_s, 3),
        ]
    });
    Table {
        caption: "Phases: 1 sigma of the track, and how far the samples lie from it (root mean square), over three axes".into(),
        columns: vec![
            Column::words("phase"),
            Column::words("seen by"),
            Column::numbers("from .. to s"),
            Column::numbers("points"),
            Column::numbers("1 sigma m"),
            Column::numbers("1 sigma m/s"),
            Column::numbers("samples off m"),
            Column::numbers("samples off m/s"),
        ],
        rows: rows.collect(),
    }
}

fn span(span_s: Option<(f64, f64)>) -> String {
    span_s.map_or(NONE.into(), |(from, to)| format!("{} .. {}", value(from, 2), value(to, 2)))
}

/// The sources.
pub(super) fn sources(sources: &[SourceReport]) -> Table {
    let rows = sources.iter().map(|s| {
        let sigma = |sigma: Option<f64>, from: &Option<String>| {
            from.as_ref().map_or(value(sigma, 3), |from| format!("{} ({from})", value(sigma, 3)))
        };
        let paths: Vec<&str> = [&s.position, &s.velocity].into_iter().flatten().map(String::as_str).collect();
        vec![
            if s.datum { format!("{} (datum)", s.name) } else { s.name.clone() },
            paths.join(", "),
            format!("{}, {}", s.positions, s.velocities),
            value(s.rate_hz, 2),
            span(s.span_s),
            s.clock.clone(),
            plus_minus(1e3 * s.delay_s, 1e3 * s.delay_spread_s, 1),
            sigma(s.position_sigma_m, &s.position_sigma_from),
            sigma(s.velocity_sigma_m_s, &s.velocity_sigma_from),
        ]
    });
    Table {
        caption: "Sources".into(),
        columns: vec![
            Column::words("source"),
            Column::words("message paths"),
            Column::numbers("positions, velocities"),
            Column::numbers("Hz"),
            Column::numbers("from .. to s"),
            Column::words("clock"),
            Column::numbers("log - sample ms"),
            Column::numbers("noise m"),
            Column::numbers("noise m/s"),
        ],
        rows: rows.collect(),
    }
}

/// Such that a sigma has two significant digits.
pub(super) fn decimals(sigma: f64) -> usize {
    if sigma > 0.0 && sigma.is_finite() { (1.0 - sigma.log10().floor()).clamp(0.0, 6.0) as usize } else { 3 }
}

/// What was said of what, for [`again`].
pub(super) fn said(what: &str, value: &str) -> (String, String) {
    (what.to_owned(), value.to_owned())
}

/// The frame of the coordinates, and where their zero is.
pub(super) fn place(frame_id: &str, origin: Option<[f64; 3]>) -> Vec<(String, String)> {
    let mut place = vec![said("frame", if frame_id.is_empty() { "not named" } else { frame_id })];
    if let Some([latitude, longitude, altitude]) = origin {
        let zero =
            format!("latitude {latitude:.7}°, longitude {longitude:.7}° (WGS 84), altitude {altitude:.2} m");
        place.push(said("zero of the coordinates", &zero));
    }
    place
}

/// What made the page, of what, and the config that makes the track again.
pub(super) fn again(said: Vec<(String, String)>, config: &str) -> Vec<Part> {
    let table = Table {
        caption: "The same input, config, version and platform give the same track".into(),
        columns: vec![Column::words("what"), Column::words("value")],
        rows: said.into_iter().map(|(what, value)| vec![what, value]).collect(),
    };
    vec![
        Part::Table(table),
        Part::Text("The config that makes this track again:".into()),
        Part::Code(config.to_owned()),
    ]
}
