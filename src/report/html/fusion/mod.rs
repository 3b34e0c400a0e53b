//! The page of `fuse`: what was done, then what it rests on.

mod answer;
mod overlap;
mod residuals;
mod tables;

use super::drawing::{Drawing, Drawn, Rejected};
use super::page::file_name;
use super::tables as shared;
use super::{Ink, Page, Part, Section, Style};
use crate::fusion::Fusion;
use crate::report::Report;
use crate::sample::{Quantity, Sample, Source};
use crate::time::Time;

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
    /// What the registration found to be outliers, in order of time.
    fn rejected(&self, quantity: Quantity) -> Vec<Sample> {
        let found = self.fusion.registered.iter().flat_map(|found| &found.rejected);
        let mut rejected: Vec<Sample> = found
            .filter(|r| r.quantity == quantity)
            .filter_map(|r| {
                let series = self.sources[r.source].series(quantity);
                series.get(series.partition_point(|s| s.time_s < r.time_s)).copied()
            })
            .collect();
        rejected.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        rejected
    }
}

/// The page; `provenance` tells where the track comes from, what and its value, and `config` makes it again, TOML.
#[must_use]
pub fn page(parts: Parts<'_>, provenance: &[(String, String)], config: &str) -> Page {
    let report = parts.report;
    let Parts { fusion, sources, origin, t0, .. } = parts;
    let rejected = Quantity::ALL.map(|quantity| Rejected {
        label: "rejected",
        quantity,
        samples: parts.rejected(quantity),
        style: Style::Dots,
        ink: Ink::Plain,
    });
    let rate_hz = report.track.rate_hz;
    let mut drawing = Drawing::new(Drawn { fusion, sources, rejected: &rejected, rate_hz, origin, t0 });
    let sections = vec![
        Section::new("space", "Track in space", drawing.in_space()),
        Section::new("motion", "Position, velocity, acceleration", {
            let mut shown = drawing.motion(3, "dots are the sources' samples as they were read.");
            shown.extend([shared::phases(&report.phases), shared::sources(&report.sources)].map(Part::Table));
            shown.extend(tables::remarks(report).into_iter().map(Part::Text));
            shown
        }),
        Section::new("overlap", "Overlap of the sources", overlap::parts(&mut drawing, report)),
        Section::new("residuals", "Residuals", residuals::parts(&mut drawing, report)),
        Section::new("errors", "Estimated errors", tables::errors(report)),
        Section::new("points", "Characteristic points", vec![tables::characteristic_points(report)]),
        Section::new("extrapolation", "Hold-out of the extrapolation", tables::holdout(report)),
        Section::new("provenance", "Provenance", tables::provenance(report, provenance, config)),
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
