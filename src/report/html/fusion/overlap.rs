//! Where sources overlap: how they differ before and after the registration.

use super::super::drawing::{AXES, Drawing};
use crate::estimate::agreement::{self, Disagreement};
use crate::estimate::coverage::Coverage;
use crate::quality::Residual;
use crate::report::Report;
use crate::report::html::{Column, Ink, Level, Part, Plot, Series, Table, plus_minus};
use crate::sample::{Quantity, Sample, slice};
use crate::time::Time;
use crate::track::{Phase, State, TrackPoint};

/// Most rows of all series together.
const ROWS: usize = 8000;

/// What is shown beside the overlap, of its length.
const MARGIN: f64 = 0.1;

/// Text, medians and plots.
pub(super) fn parts(drawing: &mut Drawing<'_>, report: &Report) -> Vec<Part> {
    let p = drawing.parts;
    let overlaps = p.fusion.phases.iter().filter(|s| s.phase == Phase::Overlap).map(|s| s.span_s);
    let Some((from_s, to_s)) = overlaps.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
        return vec![Part::Text(
            "At no instant do two sources see the vehicle: nothing can be compared.".into(),
        )];
    };
    let margin = MARGIN * (to_s - from_s);
    let (from_s, to_s) = (from_s - margin, to_s + margin);
    let registered = p.fusion.registered.is_some();
    let text = if registered {
        "How far the sources' samples lie from the track, as they were read (before), and with the errors that were estimated \
         for them taken off (after). Before and after have the same scale."
    } else {
        "How far the sources' samples lie from the track, as they were read: they were not registered to each other."
    };
    let mut parts = vec![Part::Text(text.into()), Part::Table(medians(drawing, report))];
    for quantity in Quantity::ALL {
        let mut stages = vec![before(drawing, quantity, (from_s, to_s))];
        if registered {
            stages.push(after(drawing, quantity, (from_s, to_s)));
        }
        if stages.iter().any(|s| s.tables.len() > 1) {
            let range = (p.since_t0(from_s), p.since_t0(to_s));
            parts.push(Part::Plots(stages.len(), plots(quantity, &stages, range)));
        }
    }
    parts
}

/// What is drawn of one quantity, before or after.
struct Stage {
    /// Index and name of the source, and its table.
    tables: Vec<(usize, String, usize)>,
    /// The least and the greatest value by axis.
    extent: [(f64, f64); 3],
}

fn stage(drawing: &mut Drawing<'_>, of_source: impl Fn(usize) -> Vec<Sample>) -> Stage {
    let mut stage = Stage { tables: Vec::new(), extent: [(0.0, 0.0); 3] };
    for (i, source) in drawing.parts.sources.iter().enumerate() {
        let samples = of_source(i);
        for sample in &samples {
            for (axis, (low, high)) in stage.extent.iter_mut().enumerate() {
                (*low, *high) = (low.min(sample.value[axis]), high.max(sample.value[axis]));
            }
        }
        let table = drawing.add_samples(&samples, ROWS);
        stage.tables.extend(table.map(|table| (i, source.name.clone(), table)));
    }
    stage
}

fn before(drawing: &mut Drawing<'_>, quantity: Quantity, (from_s, to_s): (f64, f64)) -> Stage {
    let p = drawing.parts;
    let points = &p.fusion.track.points;
    stage(drawing, |source| {
        let samples = slice(p.sources[source].series(quantity), from_s, to_s);
        let less_track = |s: &Sample| {
            let state = at(points, p.origin.plus_seconds(s.time_s))?;
            let track = if quantity == Quantity::Position { state.position } else { state.velocity };
            Some(Sample { value: [0, 1, 2].map(|axis| s.value[axis] - track[axis]), ..*s })
        };
        samples.iter().filter_map(less_track).collect()
    })
}

fn after(drawing: &mut Drawing<'_>, quantity: Quantity, (from_s, to_s): (f64, f64)) -> Stage {
    let p = drawing.parts;
    stage(drawing, |source| {
        let all = misfits(&p.fusion.residuals, p.origin, source, quantity);
        all.filter(|s| (from_s..=to_s).contains(&s.time_s)).collect()
    })
}

/// The residuals of one series, as samples without a sigma.
pub(super) fn misfits(
    residuals: &[Residual],
    origin: Time,
    source: usize,
    quantity: Quantity,
) -> impl Iterator<Item = Sample> + '_ {
    residuals.iter().filter(move |r| r.source == source).filter_map(move |r| {
        let misfit = r.misfits[quantity as usize]?;
        Some(Sample { time_s: r.time.seconds_since(origin), value: misfit.vector, sigma: [f64::NAN; 3] })
    })
}

/// The track between two of its points.
fn at(points: &[TrackPoint], time: Time) -> Option<State> {
    let next = points.partition_point(|p| p.time < time);
    let after = points.get(next)?;
    let before = points.get(next.saturating_sub(1))?;
    let step_s = after.time.seconds_since(before.time);
    if step_s <= 0.0 {
        return (after.time == time).then_some(after.state);
    }
    Some(before.state.mixed(&after.state, time.seconds_since(before.time) / step_s))
}

fn plots(quantity: Quantity, stages: &[Stage], range: (f64, f64)) -> Vec<Plot> {
    let mut plots = Vec::new();
    for (axis, name) in AXES.iter().enumerate() {
        let (low, high) = stages
            .iter()
            .map(|s| s.extent[axis])
            .fold((0.0, 0.0), |(a, b): (f64, f64), (low, high)| (a.min(low), b.max(high)));
        let room = 0.05 * (high - low).max(1e-9);
        for (stage, when) in stages.iter().zip([" before", " after"]) {
            let when = if stages.len() > 1 { when } else { "" };
            let series = |(i, label, table): &(usize, String, usize)| -> Series {
                Drawing::dots(label, *table, axis, Ink::Source(*i))
            };
            plots.push(Plot {
                title: format!("{name} {}{when}: sample less track", quantity.name()),
                x_label: "s since T0",
                y_label: quantity.unit().into(),
                series: stage.tables.iter().map(series).collect(),
                levels: vec![Level { value: 0.0 }],
                range: Some(range),
                y_range: Some((low - room, high + room)),
                group: "overlap",
                ..Plot::default()
            });
        }
    }
    plots
}

/// Median differences before, and those of the report, which are after where there was a registration.
fn medians(drawing: &Drawing<'_>, report: &Report) -> Table {
    let p = drawing.parts;
    let mut rows = Vec::new();
    let words = |significant: bool| if significant { "more than noise" } else { "noise" };
    if p.fusion.registered.is_some() {
        for d in agreement::compare(p.sources, &Coverage::of(p.sources)) {
            let Disagreement { sources: (first, second), quantity, median, sigma, count } = d;
            let names = [second, first].map(|i| p.sources[i].name.clone());
            rows.push(row(
                "before",
                &names,
                quantity.name(),
                (median, sigma),
                count,
                words(d.is_significant()),
            ));
        }
    }
    let when = if p.fusion.registered.is_some() { "after" } else { "–" };
    for d in &report.disagreements {
        let names = [d.second.clone(), d.first.clone()];
        rows.push(row(when, &names, &d.quantity, (d.median, d.sigma), d.count, words(d.significant)));
    }
    Table {
        caption: "Median difference of two sources where both see, ± 1 sigma of the median".into(),
        columns: vec![
            Column::words("registration"),
            Column::words("difference"),
            Column::words("of"),
            Column::numbers("x m, m/s"),
            Column::numbers("y m, m/s"),
            Column::numbers("z m, m/s"),
            Column::numbers("instants"),
            Column::words("is"),
        ],
        rows,
    }
}

fn row(
    when: &str,
    [minuend, subtrahend]: &[String; 2],
    quantity: &str,
    (median, sigma): ([f64; 3], [f64; 3]),
    count: usize,
    is: &str,
) -> Vec<String> {
    let mut row = vec![when.to_owned(), format!("{minuend} less {subtrahend}"), quantity.to_owned()];
    row.extend((0..3).map(|axis| plus_minus(median[axis], sigma[axis], 3)));
    row.extend([count.to_string(), is.to_owned()]);
    row
}
