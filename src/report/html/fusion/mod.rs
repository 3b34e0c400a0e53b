//! The page of `fuse`: what was done, then what it rests on.

mod answer;
mod drawing;
mod overlap;
mod residuals;
mod tables;

use super::{Page, Part, Section};
use crate::fusion::Fusion;
use crate::report::Report;
use crate::sample::Source;
use crate::time::Time;

use drawing::Drawing;

/// What the page is made of.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// What `--json` prints.
    pub report: &'a Report,
    /// The track.
    pub fusion: &'a Fusion,
    /// The sources as they were read, in the order of their bits.
    pub sources: &'a [Source],
    /// The instant that samples count from.
    pub origin: Time,
    /// T0, from which the page's times count.
    pub t0: Time,
}

impl Parts<'_> {
    /// Seconds since T0 of seconds since the origin.
    fn since_t0(&self, time_s: f64) -> f64 {
        time_s + self.origin.seconds_since(self.t0)
    }
}

/// The page; `provenance` tells where the track comes from, what and its value, and `config` makes it again, TOML.
#[must_use]
pub fn page(parts: Parts<'_>, provenance: &[(String, String)], config: &str) -> Page {
    let report = parts.report;
    let mut drawing = Drawing::new(parts);
    let sections = vec![
        section("space", "Track in space", drawing.in_space()),
        section("motion", "Position, velocity, acceleration", {
            let mut shown = drawing.motion();
            shown.extend([tables::phases(report), tables::sources(report)].map(Part::Table));
            shown.extend(tables::remarks(report).into_iter().map(Part::Text));
            shown
        }),
        section("overlap", "Overlap of the sources", overlap::parts(&mut drawing)),
        section("residuals", "Residuals", residuals::parts(&mut drawing)),
        section("errors", "Estimated errors", tables::errors(report)),
        section("points", "Characteristic points", vec![tables::characteristic_points(report)]),
        section("extrapolation", "Hold-out of the extrapolation", tables::holdout(report)),
        section("provenance", "Provenance", tables::provenance(report, provenance, config)),
    ];
    Page {
        title: file_name(&report.input).into(),
        made_by: format!("trackfuse {}, fuse", report.version),
        answer: answer::sentences(report, parts.t0),
        warnings: report.warnings.clone(),
        notes: report.notes.clone(),
        sections,
        tables: drawing.into_tables(),
        json: serde_json::to_value(report).unwrap_or_default(),
    }
}

fn section(id: &'static str, title: &'static str, parts: Vec<Part>) -> Section {
    Section { id, title, parts }
}

/// The last part of a path, whatever system it is of.
fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}
