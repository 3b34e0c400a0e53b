//! The page of `usbl`: the track, what was thrown out and why, and what the causal method said.

mod answer;
mod fixes;
mod prediction;
mod silences;

use super::drawing::{Drawing, Drawn};
use super::page::file_name;
use super::tables;
use super::{Page, Part, Section};
use crate::fusion::usbl::Dive;
use crate::report::UsblReport;
use crate::report::text::short;
use crate::sample::Source;
use crate::time::Time;

/// What the page is made of.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// What `--json` prints.
    pub report: &'a UsblReport,
    /// The tracks and what became of the fixes.
    pub dive: &'a Dive,
    /// The instant that fixes count from.
    pub origin: Time,
    /// T0, from which the page's times count.
    pub t0: Time,
}

/// What the plots over time draw beside the track.
const BESIDE: &str = "dots are the fixes that were kept, signs those that were thrown out. The plots have the scale of the \
                      track and of the fixes that were kept: what was thrown out beyond it stands as an arrow at the edge, \
                      and a double-click where all the time is shown makes room for it, or takes that room away. Single \
                      is where fixes come, bridged the silence between two.";

/// Plots with this name share their cursor and zoom: all those over time.
const GROUP: &str = "motion";

/// The page; `provenance` tells where the track comes from, what and its value, and `config` makes it again, TOML.
#[must_use]
pub fn page(parts: Parts<'_>, provenance: &[(String, String)], config: &str) -> Page {
    let Parts { report, dive, origin, t0, .. } = parts;
    let rejected = fixes::thrown_out(parts);
    let kept = Source { name: "kept".into(), ..dive.kept.clone() };
    let drawn = Drawn {
        fusion: &dive.fusion,
        sources: std::slice::from_ref(&kept),
        rejected: &rejected,
        rate_hz: report.track.rate_hz,
        origin,
        t0,
    };
    let mut drawing = Drawing::new(drawn);
    let mut motion = drawing.motion(2, BESIDE);
    motion.push(Part::Table(tables::phases(&report.phases)));
    let errors = prediction::errors(parts);
    motion.extend(silences::table(&dive.fusion.track, &errors, t0).map(Part::Table));
    let predicted = prediction::parts(&mut drawing, parts, &errors);
    let judged = fixes::parts(&mut drawing, parts);
    let sections = vec![
        Section::new("space", "Track in space", drawing.in_space()),
        Section::new("motion", "Position and velocity", motion),
        Section::new("fixes", "Fixes: kept and thrown out", judged),
        Section::new("prediction", "Prediction by the past alone", predicted),
        Section::new("provenance", "Provenance", where_from(report, provenance, config)),
    ];
    Page {
        title: file_name(&report.input).into(),
        made_by: format!("trackfuse {}, usbl", report.version),
        answer: answer::sentences(report, t0),
        warnings: report.warnings.clone(),
        notes: report.notes.clone(),
        sections,
        tables: drawing.into_tables(),
        json: serde_json::to_value(report).unwrap_or_default(),
    }
}

fn where_from(report: &UsblReport, known: &[(String, String)], config: &str) -> Vec<Part> {
    let track = &report.track;
    let mut said = vec![tables::said("input", &report.input), tables::said("output", &report.output)];
    said.extend_from_slice(known);
    said.push(tables::said("T0, ns", &report.t0_ns));
    let made = format!("{} points at {} Hz", track.points, short(track.rate_hz));
    said.push(tables::said("track", &made));
    said.extend(tables::place(&track.frame_id, track.origin));
    tables::again(said, config)
}

#[cfg(test)]
mod tests;
