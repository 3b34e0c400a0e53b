//! Zhang 2025, fig. 7: the differences of the velocity jump at the overlap's ends, or don't.

use trackfuse::sample::Source;

use super::markdown;
use super::tracks::tracks;
use super::trial::{FRAME_S, Trial, Z, frame};

/// Frames on both sides of an end of the overlap that are looked at: a kink of the widest moving average lies 16 off.
const NEAR: usize = 20;

/// One method's accelerations around the overlap's ends.
pub(crate) struct Row {
    pub(crate) method: &'static str,
    /// Largest change from one frame to the next, m/s2.
    pub(crate) jump: f64,
    /// Farthest from what a sensor of that instant feels, m/s2.
    pub(crate) off: f64,
}

/// Differences of a velocity, m/s2, each with the frame it begins at; `first` is the velocity's first frame.
pub(crate) fn accelerations(first: usize, v: &[f64]) -> Vec<(usize, f64)> {
    v.windows(2).enumerate().map(|(i, pair)| (first + i, (pair[1] - pair[0]) / FRAME_S)).collect()
}

/// What a sensor feels: the differences of its own velocity.
pub(crate) fn of_sensor(source: &Source) -> Vec<(usize, f64)> {
    let first = source.velocities.first().map_or(0, |sample| frame(sample.time_s));
    accelerations(first, &source.velocities.iter().map(|sample| sample.value[Z]).collect::<Vec<_>>())
}

/// The sensors, then every method.
pub(crate) fn rows(trial: &Trial) -> Vec<Row> {
    let near = |i: usize| trial.overlap.iter().any(|&end| i.abs_diff(end) <= NEAR);
    let jump = |a: &[(usize, f64)]| {
        let jumps = a.windows(2).filter(|pair| near(pair[0].0)).map(|pair| (pair[1].1 - pair[0].1).abs());
        jumps.fold(0.0, f64::max)
    };
    let sensors: Vec<_> = trial.sources.iter().map(of_sensor).collect();
    let off = |a: &[(usize, f64)]| {
        let nearest = |&(i, a): &(usize, f64)| {
            let felt = sensors.iter().flatten().filter(|(frame, _)| *frame == i);
            felt.map(|(_, felt)| (a - felt).abs()).fold(f64::INFINITY, f64::min)
        };
        a.iter().filter(|(i, _)| near(*i)).map(nearest).fold(0.0, f64::max)
    };
    let of_sensors = sensors.iter().map(|a| jump(a)).fold(0.0, f64::max);
    let mut rows = vec![Row { method: "the sensors themselves", jump: of_sensors, off: 0.0 }];
    rows.extend(tracks(trial).iter().map(|track| {
        let a = accelerations(0, &track.v);
        Row { method: track.name, jump: jump(&a), off: off(&a) }
    }));
    rows
}

/// The page's table.
pub(crate) fn table() -> String {
    let rows = rows(&Trial::of_table_1()).into_iter();
    markdown::table(
        ["", "largest jump from one frame to the next, m/s²", "farthest from what a sensor feels, m/s²"],
        rows.map(|Row { method, jump, off }| [method.into(), format!("{jump:.1}"), format!("{off:.1}")]),
    )
}
