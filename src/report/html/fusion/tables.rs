//! The report's numbers as tables: those of `--json`, for people.

use crate::report::html::tables::{self, decimals};
use crate::report::html::{Column, Part, Table, plus_minus, value};
use crate::report::text::short;
use crate::report::{LawReport, Report, UnknownReport};

/// What the tables of sources and phases don't say.
pub(super) fn remarks(report: &Report) -> Vec<String> {
    let mut remarks = Vec::new();
    if let Some(datum) = report.sources.iter().find(|s| s.datum) {
        remarks.push(format!(
            "Errors of the datum itself ({}), and those that all sources share, can't be seen by anyone: they pass into the \
             track, and are in no band.",
            datum.name
        ));
    }
    if !report.unused_topics.is_empty() {
        remarks.push(format!("Not used: {}.", report.unused_topics.join(", ")));
    }
    if report.unchecked_chunks > 0 {
        remarks.push(format!(
            "Not checked: the checksums of {} uncompressed chunks, read by message index.",
            report.unchecked_chunks
        ));
    }
    remarks
}

/// The sources' errors, and their noise.
pub(super) fn errors(report: &Report) -> Vec<Part> {
    let Some(found) = &report.registration else {
        return vec![Part::Text(
            "No error of a source was estimated: the method has no registration, or the config turns it off."
                .into(),
        )];
    };
    let mut parts = Vec::new();
    if found.unknowns.is_empty() {
        parts.push(Part::Text(
            "There is no source but the datum, against which errors could be estimated.".into(),
        ));
    } else {
        parts.push(Part::Table(unknowns(&found.unknowns)));
    }
    let noise = found.noise.iter().map(|n| {
        vec![
            n.source.clone(),
            n.quantity.clone(),
            value(n.scale, 2),
            value(n.correlation, 2),
            n.rejected.to_string(),
            n.samples.to_string(),
        ]
    });
    parts.push(Part::Table(Table {
        caption: "Noise that was found, over the sigma in the table of sources".into(),
        columns: vec![
            Column::words("source"),
            Column::words("of"),
            Column::numbers("noise / sigma"),
            Column::numbers("correlation of successive samples"),
            Column::numbers("rejected"),
            Column::numbers("samples"),
        ],
        rows: noise.collect(),
    }));
    parts
}

fn unknowns(unknowns: &[UnknownReport]) -> Table {
    let row = |u: &UnknownReport| {
        let tells = match (u.separation.as_str(), &u.strongest) {
            ("at-prior", _) => "next to nothing".to_owned(),
            ("only-together", Some(with)) => {
                let r = u.correlation.map_or(String::new(), |r| format!(" ({r:+.2})"));
                format!("it only together with {with}{r}")
            }
            _ => "it".to_owned(),
        };
        vec![
            u.source.clone(),
            u.kind.name().to_owned(),
            u.axis.clone().unwrap_or_default(),
            plus_minus(u.value, u.sigma, decimals(u.sigma)),
            u.unit.clone(),
            value(100.0 * u.probability, 0),
            tells,
        ]
    };
    Table {
        caption: "Errors against the datum, ± 1 sigma; a bias is that in the middle of the overlap, a clock offset above zero \
                  means late stamps"
            .into(),
        columns: vec![
            Column::words("source"),
            Column::words("error"),
            Column::words("axis"),
            Column::numbers("value ± sigma"),
            Column::words("unit"),
            Column::numbers("is there, %"),
            Column::words("the data tell"),
        ],
        rows: unknowns.iter().map(row).collect(),
    }
}

/// The characteristic points that were reached.
pub(super) fn characteristic_points(report: &Report) -> Part {
    let points = &report.characteristic_points;
    if points.is_empty() {
        return Part::Text(
            "None was reached, or none was asked for: [[characteristic_point]] in the config.".into(),
        );
    }
    let rows = points.iter().map(|p| {
        let sigma = |axis: usize| p.velocity_sigma_m_s.map(|s| s[axis]);
        let mut row = vec![p.name.clone(), plus_minus(p.time_s, p.time_sigma_s, 3)];
        row.extend(p.position_m.map(|v| value(v, 2)));
        row.extend((0..3).map(|axis| plus_minus(p.velocity_m_s[axis], sigma(axis), 2)));
        row.push(p.phase.clone());
        row
    });
    Part::Table(Table {
        caption: "First upward crossings of the heights in the config, ± 1 sigma".into(),
        columns: vec![
            Column::words("point"),
            Column::numbers("time s"),
            Column::numbers("x m"),
            Column::numbers("y m"),
            Column::numbers("z m"),
            Column::numbers("vx m/s"),
            Column::numbers("vy m/s"),
            Column::numbers("vz m/s"),
            Column::words("phase"),
        ],
        rows: rows.collect(),
    })
}

/// How the laws did that the track could be carried on by.
pub(super) fn holdout(report: &Report) -> Vec<Part> {
    let Some(e) = &report.extrapolation else {
        return vec![Part::Text("The track ends with the last sample: it was not carried on.".into())];
    };
    let row = |(i, law): (usize, &LawReport)| {
        let name = match (law.order, law.prior) {
            (None, _) => "the law of drag".to_owned(),
            (Some(order), true) => format!("PCF of order {order} with a prior"),
            (Some(order), false) => format!("PCF of order {order}"),
        };
        let taken = match (i, law.clearly_better) {
            (0, _) => "taken".to_owned(),
            (_, true) => format!("would have been clearly better: {}", law.asked()),
            (_, false) => "not taken".to_owned(),
        };
        vec![
            name,
            value(law.window_s, 2),
            law.holdout_trials.to_string(),
            value(law.holdout_lead_s, 2),
            value(law.holdout_position_m, 2),
            value(law.holdout_velocity_m_s, 2),
            taken,
        ]
    };
    let text = format!(
        "The track was carried on by {} s of {} s that were asked for. Each law was also carried on from earlier instants of \
         this log, and held against the track that the later samples gave.",
        value(e.length_s, 2),
        value(e.horizon_s, 2)
    );
    let table = Table {
        caption: "Root mean square errors of those trials, over three axes".into(),
        columns: vec![
            Column::words("law"),
            Column::numbers("fitted to the last s"),
            Column::numbers("trials"),
            Column::numbers("s ahead"),
            Column::numbers("off m"),
            Column::numbers("off m/s"),
            Column::words("was"),
        ],
        rows: e.laws.iter().enumerate().map(row).collect(),
    };
    vec![Part::Text(text), Part::Table(table)]
}

/// What made the page, of what.
pub(super) fn provenance(report: &Report, known: &[(String, String)], config: &str) -> Vec<Part> {
    let track = &report.track;
    let mut said = vec![tables::said("input", &report.input), tables::said("output", &report.output)];
    said.extend_from_slice(known);
    said.push(tables::said("T0, ns", &report.t0_ns));
    let rate = short(track.rate_hz);
    let made = format!("{} ({}), {} points at {rate} Hz", track.method, track.coefficients, track.points);
    said.push(tables::said("track", &made));
    said.extend(tables::place(&track.frame_id, track.origin));
    if let Some(found) = &report.registration {
        let converged = if found.converged { "converged" } else { "not converged" };
        let how = format!("{converged} in {} steps, {} knots", found.iterations, found.knots);
        said.push(tables::said("registration", &how));
    }
    tables::again(said, config)
}
