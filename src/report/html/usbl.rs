//! The page of `usbl`: the track, what was thrown out and why, and what the causal method said.

use super::drawing::{Drawing, Drawn};
use super::fusion::{file_name, section, tables};
use super::{Column, Page, Part, Table, value};
use crate::estimate::usbl::Verdict;
use crate::fusion::usbl::Dive;
use crate::report::UsblReport;
use crate::sample::Sample;
use crate::time::Time;

/// What the page is made of.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// What `--json` prints.
    pub report: &'a UsblReport,
    /// The tracks and what became of the fixes.
    pub dive: &'a Dive,
    /// The fixes as they were read.
    pub fixes: &'a [Sample],
    /// The instant that fixes count from.
    pub origin: Time,
    /// T0, from which the page's times count.
    pub t0: Time,
}

/// The page; `provenance` tells where the track comes from, what and its value, and `config` makes it again, TOML.
#[must_use]
pub fn page(parts: Parts<'_>, provenance: &[(String, String)], config: &str) -> Page {
    let Parts { report, dive, origin, t0, .. } = parts;
    let wild: Vec<Sample> = thrown_out(parts);
    let sources = std::slice::from_ref(&dive.kept);
    let rejected = [&wild[..], &[]];
    let rate_hz = report.track.rate_hz;
    let drawing = Drawing::new(Drawn { fusion: &dive.fusion, sources, rejected, rate_hz, origin, t0 });
    let mut motion = drawing.motion();
    let of_source = std::slice::from_ref(&report.source);
    motion.extend([tables::phases(&report.phases), tables::sources(of_source)].map(Part::Table));
    let sections = vec![
        section("space", "Track in space", drawing.in_space()),
        section("motion", "Position, velocity, acceleration", motion),
        section("fixes", "Fixes", vec![Part::Table(fixes(report))]),
        section("prediction", "Prediction by the past alone", vec![Part::Text(prediction(report))]),
        section("provenance", "Provenance", where_from(report, provenance, config)),
    ];
    Page {
        title: file_name(&report.input).into(),
        made_by: format!("trackfuse {}, usbl", report.version),
        answer: vec![answer(report)],
        warnings: report.warnings.clone(),
        notes: report.notes.clone(),
        sections,
        tables: drawing.into_tables(),
        json: serde_json::to_value(report).unwrap_or_default(),
    }
}

/// The fixes that were thrown out, in order of time.
fn thrown_out(parts: Parts<'_>) -> Vec<Sample> {
    let judged = parts.fixes.iter().zip(&parts.dive.cleaned.judged);
    judged.filter(|(_, judged)| judged.verdict == Verdict::Wild).map(|(fix, _)| *fix).collect()
}

fn answer(report: &UsblReport) -> String {
    let (track, fixes) = (&report.track, &report.fixes);
    let wild = fixes.off_by_itself + fixes.off_as_cycle + fixes.off_depth;
    let known = report.phases.iter().filter_map(|p| Some((p.phase.as_str(), p.position_sigma_m?)));
    let known: Vec<String> = known
        .map(|(phase, sigma_m)| {
            let place = if phase == "bridged" { "through silence" } else { "where fixes come" };
            format!("{} m {place}", value(sigma_m, 2))
        })
        .collect();
    format!(
        "{} s of track from {} fixes, of which {wild} were thrown out as wild: 1 sigma of the position, over three axes, is {}.",
        value(track.span_s.1 - track.span_s.0, 0),
        report.source.positions,
        if known.is_empty() { "not known".into() } else { known.join(", ") }
    )
}

fn fixes(report: &UsblReport) -> Table {
    let (fixes, exchanges) = (&report.fixes, &report.exchanges);
    let row = |what: &str, count: usize| vec![what.to_owned(), count.to_string()];
    Table {
        caption: format!(
            "What became of the fixes, which came in {} exchanges {} s apart",
            exchanges.count,
            value(exchanges.cycle_s, 1)
        ),
        columns: vec![Column::words("fixes"), Column::numbers("number")],
        rows: vec![
            row("kept", fixes.kept),
            row("thrown out: each off by itself", fixes.off_by_itself),
            row("thrown out with their whole exchange", fixes.off_as_cycle),
            row("thrown out: not at the depth sensor's depth", fixes.off_depth),
            row("repeat another one", fixes.repeated),
            row("came late (of all these)", fixes.late),
            row("exchanges thrown out as a whole", exchanges.thrown_out),
        ],
    }
}

fn prediction(report: &UsblReport) -> String {
    let prediction = &report.prediction;
    format!(
        "{} said at {} instants where the vehicle was, knowing only the fixes that had come by then: {} m off the track \
         while fixes came, {} m in silence (root mean square, over three axes).",
        prediction.method,
        prediction.points,
        value(prediction.rmse_m, 2),
        value(prediction.silent_rmse_m, 2)
    )
}

fn where_from(report: &UsblReport, known: &[(String, String)], config: &str) -> Vec<Part> {
    let own = [("input", &report.input), ("output", &report.output), ("T0, ns", &report.t0_ns)];
    let own = own.into_iter().map(|(what, value)| vec![what.to_owned(), value.clone()]);
    let known = known.iter().map(|(what, value)| vec![what.clone(), value.clone()]);
    let table = Table {
        caption: "The same input, config, version and platform give the same track".into(),
        columns: vec![Column::words("what"), Column::words("value")],
        rows: own.chain(known).collect(),
    };
    let again = Part::Text("The config that makes this track again:".into());
    vec![Part::Table(table), again, Part::Code(config.to_owned())]
}
