//! The page's figures.

use plotters::prelude::*;
use trackfuse::sample::Quantity;
use trackfuse::track::Curve;

use super::chart::{Line, Panel, draw};
use super::remade::acceleration::{accelerations, of_sensor};
use super::remade::orders::{FITS, errors};
use super::remade::sea_trial::{Maker, joined, of_library};
use super::remade::segments::{self, segments};
use super::remade::tracks::{Track, tracks};
use super::remade::trial::{FRAME_S, FRAMES, Trial, Z, time_s};

// Okabe and Ito's colours, which the colour-blind can tell apart.
const INK: RGBColor = RGBColor(0, 0, 0);
const GREY: RGBColor = RGBColor(150, 150, 150);
const ORANGE: RGBColor = RGBColor(230, 159, 0);
const SKY: RGBColor = RGBColor(86, 180, 233);
const GREEN: RGBColor = RGBColor(0, 158, 115);
const BLUE: RGBColor = RGBColor(0, 114, 178);
const RED: RGBColor = RGBColor(213, 94, 0);
const PINK: RGBColor = RGBColor(204, 121, 167);

/// A climb whose errors lie near the medians of the page's tables.
const TYPICAL: u64 = 32;
/// The colours of the methods of Table 1, in its order.
const METHODS: [RGBColor; 6] = [GREY, GREEN, RED, SKY, BLUE, ORANGE];

/// A file of the page, and how it is drawn.
type Figure = (&'static str, fn() -> Result<String, Box<dyn std::error::Error>>);

/// All figures with their files' names.
pub(crate) const FIGURES: [Figure; 5] = [
    ("table_1_tracks.svg", || draw(&table_1_tracks())),
    ("accelerations.svg", || draw(&acceleration())),
    ("orders.svg", || draw(&orders())),
    ("segments.svg", || draw(&abc())),
    ("extrapolation.svg", || draw(&extrapolation())),
];

fn line(name: &str, points: impl IntoIterator<Item = (f64, f64)>, colour: RGBColor) -> Line {
    Line { name: name.into(), points: points.into_iter().collect(), colour, width_px: 4, dashed: false }
}

fn wide(line: Line) -> Line {
    Line { width_px: 8, ..line }
}

fn dashed(line: Line) -> Line {
    Line { dashed: true, ..line }
}

/// First and last frame of the overlap.
fn overlap_s(trial: &Trial) -> Vec<(f64, &'static str)> {
    let [first, after] = trial.overlap;
    vec![(time_s(first), "overlap begins"), (time_s(after - 1), "overlap ends")]
}

fn colour_of(track: &Track, all: &[Track]) -> RGBColor {
    METHODS[all.iter().position(|t| t.name == track.name).unwrap_or(0)]
}

/// Table 1's tracks around the overlap: heights above the truth, speeds.
fn table_1_tracks() -> Vec<Panel> {
    let trial = Trial::of_table_1();
    let all = tracks(&trial);
    let samples = |source: usize, quantity: Quantity| {
        let series = trial.sources[source].series(quantity).iter().map(|s| (s.time_s, s.value[Z]));
        series.collect::<Vec<_>>()
    };
    let above_truth = |points: Vec<(f64, f64)>| points.into_iter().map(|(t, z)| (t, z - trial.truth(t).z));
    let frames = |values: &[f64]| values.iter().enumerate().map(|(i, &x)| (time_s(i), x)).collect::<Vec<_>>();
    let (mut heights, mut speeds) = (Vec::new(), Vec::new());
    for (source, (name, colour)) in [("tether gauge", INK), ("beacon", PINK)].into_iter().enumerate() {
        heights.push(dashed(line(name, above_truth(samples(source, Quantity::Position)), colour)));
        speeds.push(dashed(line(name, samples(source, Quantity::Velocity), colour)));
    }
    for track in &all {
        heights.push(line(track.name, above_truth(frames(&track.z)), colour_of(track, &all)));
        speeds.push(line(track.name, frames(&track.v), colour_of(track, &all)));
    }
    let panel = |y_label, y, lines| Panel {
        y_label,
        x: 0.8..2.4,
        y,
        lines,
        marks_s: overlap_s(&trial),
        legend: SeriesLabelPosition::LowerRight,
    };
    vec![
        panel("height above the tether gauge's, m", -0.5..3.0, heights),
        panel("vertical speed, m/s", 6.0..20.0, speeds),
    ]
}

/// Fig. 7: accelerations as differences of velocities.
fn acceleration() -> Vec<Panel> {
    let trial = Trial::of_table_1();
    let all = tracks(&trial);
    let drawn =
        |a: Vec<(usize, f64)>| a.into_iter().map(|(i, a)| (time_s(i) + 0.5 * FRAME_S, a)).collect::<Vec<_>>();
    let lines = |skip: usize| {
        let mut lines = vec![
            wide(dashed(line("tether gauge itself", drawn(of_sensor(&trial.sources[0])), INK))),
            wide(dashed(line("beacon itself", drawn(of_sensor(&trial.sources[1])), PINK))),
        ];
        let methods = all.iter().skip(skip);
        lines.extend(methods.map(|t| line(t.name, drawn(accelerations(0, &t.v)), colour_of(t, &all))));
        lines
    };
    let panel = |y, lines, legend| Panel {
        y_label: "vertical acceleration, m/s²",
        x: 0.8..2.4,
        y,
        lines,
        marks_s: overlap_s(&trial),
        legend,
    };
    vec![
        panel(-20.0..70.0, lines(0), SeriesLabelPosition::UpperMiddle),
        panel(-15.0..20.0, lines(1), SeriesLabelPosition::LowerLeft),
    ]
}

/// Figures 3-5: errors of PCF by order.
fn orders() -> Vec<Panel> {
    let trial = Trial::steep(TYPICAL, 1.0, false);
    let of = |name: &str, colour| {
        let fit = FITS.iter().find(|fit| fit.name == name);
        let errors = fit.map(|fit| errors(fit, &trial)).unwrap_or_default();
        line(name, errors.into_iter().step_by(2).map(|e| (e.0, e.1)), colour)
    };
    let panel = |y, lines| Panel {
        y_label: "error of the height, m",
        x: 0.0..time_s(FRAMES - 1) + 1e-9,
        y,
        lines,
        marks_s: Vec::new(),
        legend: SeriesLabelPosition::LowerLeft,
    };
    let printed = "order 48, eq. 6 as printed";
    vec![
        panel(-0.5..0.5, vec![of("order 3", GREY), of("order 5", SKY), of("order 12", RED)]),
        panel(
            -1.5..1.5,
            vec![
                of("order 48, position and velocity apart", BLUE),
                of("order 48", ORANGE),
                of("order 12", RED),
            ],
        ),
        panel(-5000.0..5000.0, vec![of(printed, PINK)]),
    ]
}

/// Order-4 PCF on the segments A, B and C.
fn abc() -> Vec<Panel> {
    let trial = segments::trial();
    let parts = segments(&trial);
    let bounds = [&parts[1], &parts[2]].map(|part| time_s(part.frames[0]));
    let truth = |f: &dyn Fn(f64) -> f64| (0..FRAMES).map(|i| (time_s(i), f(time_s(i)))).collect::<Vec<_>>();
    let panel = |y_label, y, legend, truth: Vec<(f64, f64)>, value: &dyn Fn(&dyn Curve, f64) -> f64| {
        let mut lines = vec![wide(line("truth", truth, GREY))];
        for (part, colour) in parts.iter().zip([BLUE, RED, GREEN]) {
            // a little beyond its ends, where the next one should go on
            let frames = part.frames[0].saturating_sub(8)..=(part.frames[1] + 8).min(FRAMES - 1);
            let all = |frames: std::ops::RangeInclusive<usize>| {
                frames.map(|i| (time_s(i), value(&part.fitted, time_s(i)))).collect::<Vec<_>>()
            };
            lines.push(line(part.name, all(part.frames[0]..=part.frames[1]), colour));
            lines.push(dashed(line("", all(frames), colour)));
        }
        Panel {
            y_label,
            x: 0.0..time_s(FRAMES - 1) + 1e-9,
            y,
            lines,
            marks_s: vec![(bounds[0], "A to B"), (bounds[1], "B to C")],
            legend,
        }
    };
    vec![
        panel(
            "vertical speed, m/s",
            0.0..20.0,
            SeriesLabelPosition::LowerRight,
            truth(&|t| trial.truth(t).v),
            &|curve, t| curve.at(t).map_or(f64::NAN, |s| s.velocity[Z]),
        ),
        panel(
            "vertical acceleration, m/s²",
            -15.0..15.0,
            SeriesLabelPosition::UpperRight,
            truth(&|t| trial.truth(t).a),
            &|curve, t| curve.at(t).and_then(|s| s.acceleration).map_or(f64::NAN, |a| a[Z]),
        ),
    ]
}

/// Fig. 9: the track while somebody sees, and what carries it on.
fn extrapolation() -> Vec<Panel> {
    let trial = Trial::steep(TYPICAL, 1.0, false);
    let end_s = time_s(FRAMES - 1);
    let last = FRAMES + 100;
    let printed = joined(&trial, Maker::Paper);
    let (_, carried) = of_library(&trial);
    let truth = |f: &dyn Fn(f64) -> f64| (0..last).map(|i| (time_s(i), f(time_s(i)))).collect::<Vec<_>>();
    let panel = |y_label, y, truth: Vec<(f64, f64)>, value: &dyn Fn(&trackfuse::track::State) -> [f64; 2]| {
        let points = printed.points.iter().take(last).enumerate();
        let paper: Vec<(f64, f64)> = points.map(|(i, p)| (time_s(i), value(&p.state)[0])).collect();
        let ours = |k: f64| {
            let states = (FRAMES - 1..last).filter_map(|i| Some((time_s(i), carried.at(time_s(i))?)));
            states.map(|(t, s)| (t, value(&s)[0] + k * value(&s)[1])).collect::<Vec<_>>()
        };
        Panel {
            y_label,
            x: 2.0..time_s(last - 1),
            y,
            lines: vec![
                wide(line("truth", truth, GREY)),
                line("SFF on 185 samples", paper[..FRAMES].to_vec(), RED),
                line("PCF of order 4 on the last 46, carried on", paper[FRAMES - 1..].to_vec(), BLUE),
                line("trackfuse's, with its 95 % band", ours(0.0), GREEN),
                dashed(line("", ours(1.96), GREEN)),
                dashed(line("", ours(-1.96), GREEN)),
            ],
            marks_s: vec![(end_s, "last sample")],
            legend: SeriesLabelPosition::LowerLeft,
        }
    };
    vec![
        panel("height, m", -70.0..10.0, truth(&|t| trial.truth(t).z), &|s| {
            [s.position[Z], s.position_sigma[Z]]
        }),
        panel("vertical speed, m/s", -5.0..25.0, truth(&|t| trial.truth(t).v), &|s| {
            [s.velocity[Z], s.velocity_sigma[Z]]
        }),
    ]
}
