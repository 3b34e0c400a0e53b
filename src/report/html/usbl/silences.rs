//! The silences: how long, how well the track bridges them, how far the prediction strayed.

use super::prediction::Error;
use crate::report::html::{Column, Table, value};
use crate::report::usbl::duration;
use crate::time::Time;
use crate::track::{Phase, Track};

/// Rows of the table: the longest silences.
const MOST: usize = 20;

/// A silence between two exchanges.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Silence {
    /// Its first and last instant on the track.
    span: (Time, Time),
    /// The track's greatest standard deviation in it, over three axes, m; NaN where nobody knows it.
    sigma_m: f64,
}

/// The longest silences in order of time; `None` without any.
pub(super) fn table(track: &Track, errors: &[Error], t0: Time) -> Option<Table> {
    let mut silences = silences(track);
    let count = silences.len();
    let length_s = |s: &Silence| s.span.1.seconds_since(s.span.0);
    silences.sort_by(|a, b| length_s(b).total_cmp(&length_s(a)));
    silences.truncate(MOST);
    silences.sort_by_key(|s| s.span.0);
    let row = |s: &Silence| {
        vec![
            value(s.span.0.seconds_since(t0), 0),
            value(s.span.1.seconds_since(t0), 0),
            duration(length_s(s)),
            value(s.sigma_m, 1),
            value(strayed_m(errors, s.span), 1),
        ]
    };
    let which =
        if count > MOST { format!("The {MOST} longest of {count} silences") } else { "Silences".into() };
    (count > 0).then(|| Table {
        caption: format!("{which}: how well the track is known where it is worst, and how far the prediction was off at most"),
        columns: vec![
            Column::numbers("from s"),
            Column::numbers("to s"),
            Column::numbers("length"),
            Column::numbers("1 sigma m"),
            Column::numbers("prediction off m"),
        ],
        rows: silences.iter().map(row).collect(),
    })
}

fn silences(track: &Track) -> Vec<Silence> {
    let stretches = track.points.chunk_by(|a, b| a.phase == b.phase);
    let silent = stretches.filter(|points| points[0].phase == Phase::Bridged);
    let of = |points: &[crate::track::TrackPoint]| Silence {
        span: (points[0].time, points[points.len() - 1].time),
        sigma_m: points.iter().map(|p| length(p.state.position_sigma)).fold(f64::NAN, f64::max),
    };
    silent.map(of).collect()
}

/// The greatest distance of the prediction from the track between two instants.
fn strayed_m(errors: &[Error], (from, to): (Time, Time)) -> Option<f64> {
    let within = errors.iter().filter(|e| e.point.time >= from && e.point.time <= to);
    within.map(Error::distance_m).reduce(f64::max)
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
