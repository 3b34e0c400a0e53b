//! How far the causal method was off the track that all fixes give.

use super::{GROUP, Parts};
use crate::quality::BAND_SIGMAS;
use crate::report::html::data::thin;
use crate::report::html::drawing::{AXES, Drawing, with_borders};
use crate::report::html::{Band, Column, Columns, Ink, Level, Part, Plot, Series, Style, Table, value};
use crate::track::{Curve, Phase, TrackPoint};

/// Most rows that are drawn.
const ROWS: usize = 3000;

/// Columns of the errors: time, three errors, three standard deviations, zero, phase.
const ERROR: usize = 1;
const SIGMA: usize = 4;
const ZERO: usize = 7;
const PHASE: usize = 8;

/// A point of the prediction, and how far it lies from the track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Error {
    pub(super) point: TrackPoint,
    pub(super) off_m: [f64; 3],
}

impl Error {
    /// Over three axes.
    pub(super) fn distance_m(&self) -> f64 {
        self.off_m.iter().map(|v| v * v).sum::<f64>().sqrt()
    }
}

/// Those of the whole prediction, in order of time.
pub(super) fn errors(parts: Parts<'_>) -> Vec<Error> {
    let Parts { dive, origin, .. } = parts;
    let error = |point: &TrackPoint| {
        let track = dive.at(point.time.seconds_since(origin))?;
        let off_m = std::array::from_fn(|i| point.state.position[i] - track.position[i]);
        Some(Error { point: *point, off_m })
    };
    dive.prediction.points.iter().filter_map(error).collect()
}

/// Text, numbers and plots.
pub(super) fn parts(drawing: &mut Drawing<'_>, parts: Parts<'_>, errors: &[Error]) -> Vec<Part> {
    let report = parts.report;
    if errors.is_empty() {
        return vec![Part::Text("There were too few fixes to predict anything.".into())];
    }
    let has_sigma = errors.iter().any(|e| e.point.state.position_sigma.iter().all(|s| s.is_finite()));
    let band = if has_sigma {
        "the grey band is 1.96 of the sigmas that it stated, and holds 95 % of its errors where those are right; a double-click \
         where all the time is shown makes room for it"
    } else {
        "it states no sigma"
    };
    let text = format!(
        "At every instant {} says where the vehicle is, from the fixes that had come by then; of what came late it knows \
         nothing. Lines are how far that was off the track, which knows all fixes; {band}. Extrapolated is where it had \
         heard nothing for longer than two and a half exchanges.",
        report.prediction.method
    );
    let table = add(drawing, errors, report.track.rate_hz, parts);
    let plots = (0..3).map(|axis| plot(table, axis, has_sigma)).collect();
    vec![Part::Text(text), Part::Table(numbers(errors)), Part::Plots(1, plots)]
}

fn add(drawing: &mut Drawing<'_>, errors: &[Error], rate_hz: f64, parts: Parts<'_>) -> usize {
    let off = |axis: usize| move |i: usize| errors[i].off_m[axis];
    let sigma = |axis: usize| move |i: usize| errors[i].point.state.position_sigma[axis];
    let (off, sigma) = ([off(0), off(1), off(2)], [sigma(0), sigma(1), sigma(2)]);
    let time = |i: usize| errors[i].point.time.seconds_since(parts.t0);
    let phase = |i: usize| errors[i].point.phase as usize as f64;
    let points: Vec<TrackPoint> = errors.iter().map(|e| e.point).collect();
    let kept = thin(errors.len(), &[&off[0], &off[1], &off[2]], ROWS);
    let rows = with_borders(&points, kept, 1.5 / rate_hz);
    let zero = |_: usize| 0.0;
    let columns: [&dyn Fn(usize) -> f64; 9] =
        [&time, &off[0], &off[1], &off[2], &sigma[0], &sigma[1], &sigma[2], &zero, &phase];
    drawing.add(Columns::of(&rows, &columns))
}

fn plot(table: usize, axis: usize, has_sigma: bool) -> Plot {
    let line = Series {
        label: "prediction less track".into(),
        table,
        x: 0,
        y: ERROR + axis,
        style: Style::Line,
        ink: Ink::Phases,
        band: None,
        phase: Some(PHASE),
    };
    let band = Series {
        label: "95 % of the prediction".into(),
        y: ZERO,
        style: Style::Band,
        band: Some(Band { sigma: SIGMA + axis, sigmas: BAND_SIGMAS }),
        phase: None,
        ..line.clone()
    };
    Plot {
        title: format!("{}: prediction less track", AXES[axis]),
        x_label: "s since T0",
        y_label: "m".into(),
        series: has_sigma.then_some(band).into_iter().chain([line]).collect(),
        levels: vec![Level { value: 0.0 }],
        group: GROUP,
        ..Plot::default()
    }
}

/// The errors while fixes came and in silence.
fn numbers(errors: &[Error]) -> Table {
    let rows = [(Phase::Single, "while fixes came"), (Phase::Extrapolated, "in silence")];
    let row = |(phase, when): (Phase, &str)| {
        let of: Vec<&Error> = errors.iter().filter(|e| e.point.phase == phase).collect();
        let squares = |axes: &[usize]| {
            let sum: f64 = of.iter().flat_map(|e| axes.iter().map(|&i| e.off_m[i].powi(2))).sum();
            (sum / of.len() as f64).sqrt()
        };
        let worst = of.iter().map(|e| e.distance_m()).reduce(f64::max);
        vec![
            when.to_owned(),
            of.len().to_string(),
            value(squares(&[0, 1]), 1),
            value(squares(&[2]), 1),
            value(worst, 1),
            held(&of).map_or(value(None, 0), |share| format!("{} %", value(100.0 * share, 0))),
        ]
    };
    Table {
        caption: "Prediction less track: root mean square, and the worst".into(),
        columns: vec![
            Column::words("when"),
            Column::numbers("instants"),
            Column::numbers("horizontal m"),
            Column::numbers("vertical m"),
            Column::numbers("worst, 3-D m"),
            Column::numbers("in its 95 % band, by axis"),
        ],
        rows: rows.map(row).into(),
    }
}

/// The share of single axes whose band holds the error, of those with a band.
fn held(errors: &[&Error]) -> Option<f64> {
    let axes =
        errors.iter().flat_map(|e| (0..3).map(|i| (e.off_m[i].abs(), e.point.state.position_sigma[i])));
    let known: Vec<(f64, f64)> = axes.filter(|(_, sigma)| sigma.is_finite()).collect();
    let held = known.iter().filter(|(off, sigma)| *off <= BAND_SIGMAS * sigma).count();
    (!known.is_empty()).then(|| held as f64 / known.len() as f64)
}
