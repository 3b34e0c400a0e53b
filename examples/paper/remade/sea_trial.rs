//! Zhang 2025, fig. 9 and the sea trial's procedure: SFF while somebody sees, order-4 PCF on the last 46 samples
//! carried on over 100, both joined end to end; the characteristic points of eq. 13.

use trackfuse::estimate::Coefficients;
use trackfuse::estimate::characteristic_point::{Height, first_crossing};
use trackfuse::estimate::extrapolation::{self, Extrapolation, Law};
use trackfuse::estimate::polynomial::{self, Polynomial};
use trackfuse::estimate::spline;
use trackfuse::math::robust;
use trackfuse::time::Time;
use trackfuse::track::{Curve, Method, Phase, Track, TrackPoint};

use super::markdown;
use super::tracks::sff;
use super::trial::{FRAME_S, FRAMES, Point, Trial, Z, time_s};

/// Samples that the polynomial is fitted to: 141 to 186 in the print, one more than there are.
const FITTED: usize = 46;
/// Frames that it is carried on: the paper's 100 and half as many again, so that a track that is late gets there too.
pub(crate) const AHEAD: usize = 150;
/// Climbs that the medians are over.
const CLIMBS: u64 = 50;
/// Leads of the third characteristic point after the last sample, s. The paper doesn't give its own.
pub(crate) const LEADS_S: [f64; 3] = [0.5, 1.0, 2.0];

/// The paper's errors of time and of speed at its three points, per cent.
pub(crate) const PAPER_PERCENT: [[f64; 2]; 3] = [[0.46, 1.61], [1.30, 2.33], [2.53, 12.60]];

/// Who makes the track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Maker {
    /// SFF and PCF of order 4 as printed.
    Paper,
    /// This library's defaults: SFF with shared coefficients, a polynomial with a prior on jerk and snap.
    Library,
}

/// PCF on the last 46 samples.
pub(crate) fn tail(trial: &Trial, order: usize) -> Polynomial {
    let (from_s, to_s) = (time_s(FRAMES - FITTED), time_s(FRAMES - 1));
    polynomial::fit(&trial.sources[1..], from_s, to_s, order, Coefficients::Shared, None)
        .expect("enough samples")
}

/// The library's track while somebody sees, and its extrapolation.
pub(crate) fn of_library(trial: &Trial) -> (spline::Spline, Extrapolation) {
    let to_s = time_s(FRAMES - 1);
    let fitted =
        spline::fit(&trial.sources, 0.0, to_s, &spline::Settings::default()).expect("enough samples");
    let carried =
        extrapolation::extrapolate(&trial.sources, &fitted, (0.0, to_s), Law::POLYNOMIAL, time_s(AHEAD));
    (fitted, carried.expect("a track that is long enough"))
}

/// The whole track, frame by frame: the first curve while somebody sees, then the second.
pub(crate) fn joined(trial: &Trial, maker: Maker) -> Track {
    match maker {
        Maker::Paper => end_to_end(&sff(&trial.fused(), Coefficients::Independent), &tail(trial, 4)),
        Maker::Library => {
            let (fitted, carried) = of_library(trial);
            end_to_end(&fitted, &carried)
        }
    }
}

fn end_to_end(seen: &dyn Curve, unseen: &dyn Curve) -> Track {
    let point = |i: usize| {
        let (curve, phase, method) = match i {
            0..FRAMES => (seen, Phase::Single, Method::Spline),
            _ => (unseen, Phase::Extrapolated, Method::Polynomial),
        };
        let state = curve.at(time_s(i))?;
        Some(TrackPoint { time: Time::from_ns(0).plus_seconds(time_s(i)), state, phase, method, seen_by: 1 })
    };
    Track { frame_id: "enu".into(), points: (0..FRAMES + AHEAD).filter_map(point).collect() }
}

/// Errors of time and of speed where the track reaches the height that the truth has at `time_s`, per cent (Zhang
/// 2025, eq. 13); infinite where it never gets there.
pub(crate) fn errors_percent(trial: &Trial, track: &Track, time_s: f64) -> [f64; 2] {
    let Point { z, v, .. } = trial.truth(time_s);
    let height = Height { name: String::new(), z_m: z };
    first_crossing(track, &height, 1.5 * FRAME_S).map_or([f64::INFINITY; 2], |found| {
        let made_s = found.time.seconds_since(Time::from_ns(0));
        [(made_s - time_s) / time_s, (found.state.velocity[Z] - v) / v].map(|e| 100.0 * e.abs()) // (13)
    })
}

/// Errors over many climbs.
pub(crate) struct Row {
    pub(crate) maker: Maker,
    /// Whether the beacon has systematic errors.
    pub(crate) errors: bool,
    /// At T1, at the last sample, and at each lead: medians of time's and speed's errors, per cent.
    pub(crate) percent: [[f64; 2]; 5],
    /// At each of them the climbs whose track never gets there, of 50.
    pub(crate) never: [usize; 5],
}

/// Both makers, with and without systematic errors of the beacon.
pub(crate) fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for errors in [false, true] {
        let trials: Vec<Trial> = (1..=CLIMBS).map(|seed| Trial::steep(seed, 1.0, errors)).collect();
        for maker in [Maker::Paper, Maker::Library] {
            let runs: Vec<[[f64; 2]; 5]> = trials.iter().map(|trial| points(trial, maker)).collect();
            let median = |i: usize, k: usize| {
                robust::median(&mut runs.iter().map(|run| run[i][k]).collect::<Vec<_>>()).unwrap_or(f64::NAN)
            };
            let percent = std::array::from_fn(|i| [median(i, 0), median(i, 1)]);
            let never = std::array::from_fn(|i| runs.iter().filter(|run| run[i][0].is_infinite()).count());
            rows.push(Row { maker, errors, percent, never });
        }
    }
    rows
}

fn points(trial: &Trial, maker: Maker) -> [[f64; 2]; 5] {
    let track = joined(trial, maker);
    let phases = trial.simulation.phases;
    let leads = LEADS_S.map(|lead_s| phases.t2_s + lead_s);
    let instants = [phases.t1_s, phases.t2_s, leads[0], leads[1], leads[2]];
    instants.map(|time_s| errors_percent(trial, &track, time_s))
}

/// The height's worst error within 40 frames of the last sample: medians over the climbs at orders 4 and 12, m.
pub(crate) fn forty_ahead_m() -> [f64; 2] {
    [4, 12].map(|order| {
        let mut worst: Vec<f64> = (1..=CLIMBS)
            .map(|seed| {
                let trial = Trial::steep(seed, 1.0, false);
                let carried = tail(&trial, order);
                let miss =
                    |i| carried.at(time_s(i)).expect("everywhere").position[Z] - trial.truth(time_s(i)).z;
                (FRAMES..FRAMES + 40).map(|i| f64::abs(miss(i))).fold(0.0, f64::max)
            })
            .collect();
        robust::median(&mut worst).unwrap_or(f64::NAN)
    })
}

/// The page's table of characteristic points.
pub(crate) fn table() -> String {
    let [first, second, third] = PAPER_PERCENT.map(|[time, speed]| format!("{time:.2} / {speed:.2}"));
    let third = format!("{third}, at a lead not given");
    let paper = ["paper, one sea trial", "unknown", &first, &second, &third, "", ""].map(String::from);
    let ours = rows().into_iter().map(|Row { maker, errors, percent, never }| {
        let maker = match maker {
            Maker::Paper => "SFF 12, then PCF 4",
            Maker::Library => "`trackfuse`'s default",
        };
        let errors = if errors { "the simulator's" } else { "none" };
        let [a, b, c, d, e] = std::array::from_fn(|i| cell(percent[i], never[i]));
        [maker.into(), errors.into(), a, b, c, d, e]
    });
    let head = [
        "track",
        "beacon's errors",
        "T1, in the overlap",
        "T2, the last sample",
        "0.5 s later",
        "1 s later",
        "2 s later",
    ];
    markdown::table(head, std::iter::once(paper).chain(ours))
}

fn cell([time, speed]: [f64; 2], never: usize) -> String {
    let reached = if time.is_finite() { format!("{time:.2} / {speed:.2}") } else { "-".into() };
    if never == 0 { reached } else { format!("{reached} ({never} never)") }
}

/// The page's table of orders 4 and 12.
pub(crate) fn forty_ahead_table() -> String {
    let [fourth, twelfth] = forty_ahead_m();
    let rows = [["4".into(), format!("{fourth:.1}")], ["12".into(), format!("{twelfth:.0e}")]];
    markdown::table(["order", "worst error of the height, m"], rows)
}
