//! A track held against a reference: eq. 12 phase by phase, eq. 13 at characteristic points, the bands, the
//! smoothness of the acceleration, and where it is worst.
//!
//! Errors are taken at the instants of whichever has fewer, the track or the reference; the other is
//! interpolated linearly, and what that costs is stated. Nothing is interpolated across an outage.

use schemars::JsonSchema;
use serde::Serialize;

use super::BAND_SIGMAS;
use super::errors::{Deviation, Errors, errors};
use super::interpolation::{Interpolated, linear_error};
use crate::estimate::characteristic_point::{CharacteristicPoint, Height, first_crossing};
use crate::estimate::coverage::{self, OUTAGE_INTERVALS, interpolate, max_gap_s};
use crate::sample::{Quantity, Sample, Source, slice};
use crate::time::Time;
use crate::track::{Method, Phase, State, Track, TrackPoint};

/// What kind of stretch a point of the track belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Kind {
    /// Its phase.
    pub phase: Phase,
    /// The sources that see it: bit i is the i-th.
    pub seen_by: u32,
}

/// Errors over all stretches of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Its kind; `None` for the whole track.
    pub kind: Option<Kind>,
    /// First and last instant that was compared, s since T0.
    pub span_s: (f64, f64),
    /// Errors of the position, m.
    pub position: Option<Errors>,
    /// Errors of the velocity, m/s.
    pub velocity: Option<Errors>,
}

/// An instant at which the track is far off.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// Seconds since T0.
    pub time_s: f64,
    /// Its kind.
    pub kind: Kind,
    /// Error of the position by axis, m.
    pub error_m: [f64; 3],
    /// The largest error over its standard deviation, of the three axes; `None` where these are unknown.
    pub sigmas: Option<f64>,
}

/// A change of acceleration from one velocity difference to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Jump {
    /// When, s since T0.
    pub time_s: f64,
    /// By how much, m/s^2 in 3-D.
    pub jump_m_s2: f64,
    /// The step over which velocities were differenced, s.
    pub step_s: f64,
}

/// A characteristic point of the track and of the reference.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossingErrors {
    /// The height that is crossed.
    pub height: Height,
    /// The track's crossing; `None` where it doesn't get there.
    pub estimate: Option<CharacteristicPoint>,
    /// The reference's.
    pub reference: Option<CharacteristicPoint>,
    /// `|T^ - T*| / |T*|`, T since T0 (Zhang 2025, eq. 13).
    pub time_error: Option<f64>,
    /// The same of the vertical speed.
    pub speed_error: Option<f64>,
    /// Whether the reference's time lies within the track's 95 % band.
    pub time_inside: Option<bool>,
    /// Whether its vertical speed does.
    pub speed_inside: Option<bool>,
}

/// A track held against a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The whole track.
    pub all: Stretch,
    /// Its kinds of stretches, in order of appearance.
    pub stretches: Vec<Stretch>,
    /// What was interpolated, of position and velocity; `None` where both have the same instants.
    pub interpolated: [Option<Interpolated>; 2],
    /// Points of the track without a reference beside them.
    pub uncompared: usize,
    /// The instants with the largest position errors, worst first, well apart.
    pub worst: Vec<Worst>,
    /// The track's largest jump of the acceleration.
    pub jump: Option<Jump>,
    /// The reference's, at its own rate.
    pub reference_jump: Option<Jump>,
    /// Characteristic points.
    pub crossings: Vec<CrossingErrors>,
}

/// Holds `track` against `reference`, whose samples' times count from `t0`.
///
/// Positions that are missing on either side give no position errors, and so with velocities; where nothing
/// was measured in common, no stretch has errors.
#[must_use]
pub fn compare(track: &Track, t0: Time, reference: &Source, heights: &[Height]) -> Comparison {
    let estimate = as_source(track, t0);
    let mut interpolated = [None, None];
    let mut found: [Vec<(Kind, Deviation)>; 2] = [Vec::new(), Vec::new()];
    for q in Quantity::ALL {
        let (deviations, by) = deviations(estimate.series(q), reference.series(q));
        interpolated[q as usize] = by;
        let kinds = kinds_at(track, t0, &deviations);
        found[q as usize] = kinds.into_iter().zip(deviations).collect();
    }
    let mut kinds: Vec<Kind> = Vec::new();
    for point in &track.points {
        let kind = Kind::of(point);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let stretch = |kind: Option<Kind>| {
        let [position, velocity] = [0, 1].map(|q: usize| -> Vec<Deviation> {
            let wanted = found[q].iter().filter(|(k, _)| kind.is_none_or(|kind| *k == kind));
            wanted.map(|(_, d)| *d).collect()
        });
        let times = || position.iter().chain(&velocity).map(|d| d.time_s);
        Stretch {
            kind,
            span_s: (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)),
            position: errors(&position),
            velocity: errors(&velocity),
        }
    };
    let stretches = kinds.into_iter().map(|kind| stretch(Some(kind)));
    let stretches = stretches.filter(|s| s.position.is_some() || s.velocity.is_some()).collect();
    Comparison {
        all: stretch(None),
        stretches,
        interpolated,
        uncompared: uncompared(&estimate, reference),
        worst: worst(&found[0]),
        jump: largest_jump(&estimate.velocities),
        reference_jump: largest_jump(&reference.velocities),
        crossings: crossings(track, t0, reference, heights),
    }
}

impl Kind {
    fn of(point: &TrackPoint) -> Self {
        Self { phase: point.phase, seen_by: point.seen_by }
    }
}

/// The track's points as series, without those that have no value.
fn as_source(track: &Track, t0: Time) -> Source {
    let series = |value: fn(&State) -> [f64; 3], sigma: fn(&State) -> [f64; 3]| {
        let sample = |p: &TrackPoint| Sample {
            time_s: p.time.seconds_since(t0),
            value: value(&p.state),
            sigma: sigma(&p.state),
        };
        let finite = |s: &Sample| s.value.iter().all(|v| v.is_finite());
        track.points.iter().map(sample).filter(finite).collect()
    };
    Source {
        name: String::new(),
        positions: series(|s| s.position, |s| s.position_sigma),
        velocities: series(|s| s.velocity, |s| s.velocity_sigma),
    }
}

/// What the estimate says less what the reference says, at the instants of the one that has fewer of them.
fn deviations(estimate: &[Sample], reference: &[Sample]) -> (Vec<Deviation>, Option<Interpolated>) {
    let ends = |s: &[Sample]| Some((s.first()?.time_s, s.last()?.time_s));
    let Some(((e0, e1), (r0, r1))) = ends(estimate).zip(ends(reference)) else { return (Vec::new(), None) };
    let (from_s, to_s) = (e0.max(r0), e1.min(r1));
    let (own, its) = (slice(estimate, from_s, to_s), slice(reference, from_s, to_s));
    let at_reference = its.len() < own.len();
    let (instants, dense, name) =
        if at_reference { (its, estimate, "estimate") } else { (own, reference, "reference") };
    let gap_s = max_gap_s(dense);
    let mut exact = true;
    let found = instants.iter().filter_map(|sample| {
        let other = interpolate(dense, sample.time_s, gap_s)?;
        let same = |s: &Sample| (s.time_s - sample.time_s).abs() < 0.5e-9;
        let next = dense.partition_point(|s| s.time_s < sample.time_s);
        exact &= dense[next.saturating_sub(1)..=next].iter().any(same);
        let (e, r) = if at_reference { (&other, sample) } else { (sample, &other) };
        let error = std::array::from_fn(|i| e.value[i] - r.value[i]);
        Some(Deviation { time_s: sample.time_s, error, sigma: e.sigma })
    });
    let found: Vec<Deviation> = found.collect();
    let error = linear_error(dense, from_s, to_s, gap_s);
    let by = (!exact).then(|| Interpolated { series: name.into(), error });
    (found, by)
}

/// The kind of the track's point that is nearest to each deviation.
fn kinds_at(track: &Track, t0: Time, deviations: &[Deviation]) -> Vec<Kind> {
    let time_s = |i: usize| track.points[i].time.seconds_since(t0);
    let mut next = 0;
    let nearest = |d: &Deviation| {
        while next + 1 < track.points.len() && time_s(next) < d.time_s {
            next += 1;
        }
        let before = next.saturating_sub(1);
        let closer = d.time_s - time_s(before) < time_s(next) - d.time_s;
        Kind::of(&track.points[if closer { before } else { next }])
    };
    deviations.iter().map(nearest).collect()
}

fn uncompared(estimate: &Source, reference: &Source) -> usize {
    let lonely = |q: Quantity| {
        let series = reference.series(q);
        let gap_s = max_gap_s(series);
        let alone = |s: &&Sample| interpolate(series, s.time_s, gap_s).is_none();
        estimate.series(q).iter().filter(alone).count()
    };
    if reference.positions.is_empty() { lonely(Quantity::Velocity) } else { lonely(Quantity::Position) }
}

/// The largest of the deviations, each at least a twentieth of the whole away from those before.
fn worst(found: &[(Kind, Deviation)]) -> Vec<Worst> {
    const SHOWN: usize = 3;
    let span_s = found.last().map_or(0.0, |l| l.1.time_s) - found.first().map_or(0.0, |f| f.1.time_s);
    let mut order: Vec<&(Kind, Deviation)> = found.iter().collect();
    order.sort_by(|a, b| b.1.norm().total_cmp(&a.1.norm()));
    let mut worst: Vec<Worst> = Vec::new();
    for (kind, d) in order {
        if worst.len() == SHOWN {
            break;
        }
        if worst.iter().all(|w| (w.time_s - d.time_s).abs() >= span_s / 20.0) {
            let ratios = (0..3).map(|i| d.error[i].abs() / d.sigma[i]).filter(|r| r.is_finite());
            let sigmas = ratios.reduce(f64::max);
            worst.push(Worst { time_s: d.time_s, kind: *kind, error_m: d.error, sigmas });
        }
    }
    worst
}

/// The largest change of the acceleration, as the difference of successive velocities, from one step to the
/// next (Zhang 2025, fig. 7); steps longer than 1.5 median ones don't count.
#[must_use]
pub fn largest_jump(velocities: &[Sample]) -> Option<Jump> {
    let step_s = coverage::median_step_s(velocities)?;
    let difference = |a: &Sample, b: &Sample| {
        let dt = b.time_s - a.time_s;
        let slope: [f64; 3] = std::array::from_fn(|i| (b.value[i] - a.value[i]) / dt);
        (dt > 0.5 * step_s && dt < 1.5 * step_s).then_some(slope)
    };
    let jumps = velocities.windows(3).filter_map(|three| {
        let (a, b) = (difference(&three[0], &three[1])?, difference(&three[1], &three[2])?);
        let jump_m_s2 = (0..3).map(|i| (b[i] - a[i]).powi(2)).sum::<f64>().sqrt();
        Some(Jump { time_s: three[1].time_s, jump_m_s2, step_s })
    });
    jumps.reduce(|most, jump| if jump.jump_m_s2 > most.jump_m_s2 { jump } else { most })
}

fn crossings(track: &Track, t0: Time, reference: &Source, heights: &[Height]) -> Vec<CrossingErrors> {
    let reference = as_track(reference, t0);
    let crossing = |of: &Track, height: &Height| {
        let steps = of.points.windows(2).map(|w| w[1].time.seconds_since(w[0].time)).filter(|d| *d > 0.0);
        let median = crate::math::robust::median(&mut steps.collect::<Vec<f64>>())?;
        first_crossing(of, height, OUTAGE_INTERVALS * median)
    };
    let errors = |height: &Height| {
        let (estimate, truth) = (crossing(track, height), crossing(&reference, height));
        let both = estimate.as_ref().zip(truth.as_ref());
        let relative = |a: f64, b: f64| Some(((a - b) / b).abs()).filter(|e| e.is_finite()); // (13)
        let inside = |a: f64, b: f64, sigma: Option<f64>| {
            sigma.filter(|s| s.is_finite()).map(|s| (a - b).abs() <= BAND_SIGMAS * s)
        };
        let time = |p: &CharacteristicPoint| p.time.seconds_since(t0);
        let speed = |p: &CharacteristicPoint| p.state.velocity[2];
        CrossingErrors {
            height: height.clone(),
            time_error: both.and_then(|(e, r)| relative(time(e), time(r))),
            speed_error: both.and_then(|(e, r)| relative(speed(e), speed(r))),
            time_inside: both.and_then(|(e, r)| inside(time(e), time(r), e.time_sigma_s)),
            speed_inside: both
                .filter(|(_, r)| speed(r).is_finite())
                .and_then(|(e, r)| inside(speed(e), speed(r), Some(e.state.velocity_sigma[2]))),
            estimate,
            reference: truth,
        }
    };
    heights.iter().map(errors).collect()
}

/// A reference as a track, its velocities at the instants of its positions; NaN where it has none.
fn as_track(reference: &Source, t0: Time) -> Track {
    let gap_s = max_gap_s(&reference.velocities);
    let point = |p: &Sample| TrackPoint {
        time: t0.plus_seconds(p.time_s),
        state: State {
            position: p.value,
            velocity: interpolate(&reference.velocities, p.time_s, gap_s).map_or([f64::NAN; 3], |v| v.value),
            acceleration: None,
            position_sigma: p.sigma,
            velocity_sigma: [f64::NAN; 3],
        },
        phase: Phase::Single,
        method: Method::default(),
        seen_by: 1,
    };
    Track { frame_id: String::new(), points: reference.positions.iter().map(point).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T0: Time = Time::from_ns(1_731_000_000_000_000_000);

    /// A straight climb at 2 m/s from -10 m, off by `error` at each time, seen by one source and then by two.
    fn track(rate_hz: f64, error: impl Fn(f64) -> f64) -> Track {
        let point = |i: usize| {
            let t = i as f64 / rate_hz;
            let overlap = t > 5.0;
            TrackPoint {
                time: T0.plus_seconds(t),
                state: State {
                    position: [error(t), 0.0, -10.0 + 2.0 * t],
                    velocity: [0.0, 0.0, 2.0 + error(t)],
                    acceleration: None,
                    position_sigma: [0.5; 3],
                    velocity_sigma: [0.1; 3],
                },
                phase: if overlap { Phase::Overlap } else { Phase::Single },
                method: Method::Spline,
                seen_by: if overlap { 0b11 } else { 0b01 },
            }
        };
        Track { frame_id: "enu".into(), points: (0..=(10.0 * rate_hz) as usize).map(point).collect() }
    }

    fn truth(times: impl Iterator<Item = f64>) -> Source {
        let sample = |time_s, value| Sample { time_s, value, sigma: [1e-3; 3] };
        let times: Vec<f64> = times.collect();
        Source {
            name: "truth".into(),
            positions: times.iter().map(|&t| sample(t, [0.0, 0.0, -10.0 + 2.0 * t])).collect(),
            velocities: times.iter().map(|&t| sample(t, [0.0, 0.0, 2.0])).collect(),
        }
    }

    fn every(step_s: f64, from_s: f64, to_s: f64) -> impl Iterator<Item = f64> {
        (0..=((to_s - from_s) / step_s).round() as usize).map(move |i| from_s + step_s * i as f64)
    }

    fn at(z_m: f64) -> Height {
        Height { name: "point".into(), z_m }
    }

    #[test]
    fn planted_errors_are_found_phase_by_phase_inside_the_bands_or_not() {
        let track = track(20.0, |t| if t > 5.0 { 2.0 } else { 0.3 });
        let found = compare(&track, T0, &truth(every(0.013, -1.0, 11.0)), &[]);
        assert_eq!(found.stretches.len(), 2);
        let by_phase: Vec<&Errors> = found.stretches.iter().filter_map(|s| s.position.as_ref()).collect();
        assert!((by_phase[0].rmse - 0.3).abs() < 1e-9 && (by_phase[1].rmse - 2.0).abs() < 1e-9);
        assert_eq!((by_phase[0].count, by_phase[1].count), (101, 100));
        let bands = |i: usize| by_phase[i].bands.as_ref().expect("sigmas are known");
        assert_eq!(bands(0).inside_by_axis, [Some(1.0); 3]);
        assert_eq!(bands(1).inside_by_axis, [Some(0.0), Some(1.0), Some(1.0)]);
        let by = found.interpolated[0].as_ref().expect("the instants differ");
        assert_eq!(by.series, "reference");
        let error = by.error.expect("many samples");
        assert!(error < 1e-9, "a straight line costs nothing: {error}");
        assert_eq!(found.uncompared, 0);
        assert!(found.worst[0].time_s > 5.0 && (found.worst[0].sigmas.expect("known") - 4.0).abs() < 1e-9);
    }

    #[test]
    fn a_slow_reference_is_met_at_its_own_instants() {
        let found = compare(&track(50.0, |_| 0.1), T0, &truth(every(1.0, 0.513, 9.513)), &[]);
        assert_eq!(found.all.position.expect("errors").count, 10);
        assert_eq!(found.interpolated[0].as_ref().expect("interpolated").series, "estimate");
    }

    #[test]
    fn equal_instants_are_not_interpolated() {
        let found = compare(&track(16.0, |_| 0.1), T0, &truth(every(0.0625, 0.0, 10.0)), &[]);
        assert_eq!(found.interpolated, [None, None]);
        assert_eq!(found.all.position.expect("errors").count, 161);
    }

    #[test]
    fn nothing_is_compared_across_an_outage_of_the_reference() {
        let holed = truth(every(0.05, 0.0, 3.0).chain(every(0.05, 6.0, 8.0)));
        let found = compare(&track(50.0, |_| 0.1), T0, &holed, &[]);
        let errors = found.all.position.expect("errors");
        assert!((95..=105).contains(&errors.count), "{}: at the reference's instants", errors.count);
        assert_eq!(found.uncompared, 149 + 100, "between 3 and 6 s, and behind 8 s");
        let nothing = compare(&track(50.0, |_| 0.1), T0, &truth(every(0.05, 20.0, 30.0)), &[]);
        assert_eq!((nothing.all.position, nothing.stretches.len()), (None, 0));
    }

    #[test]
    fn characteristic_points_are_off_by_what_was_planted() {
        // late by 0.1 s at 2 m/s
        let mut track = track(20.0, |_| 0.2);
        track.points.iter_mut().for_each(|p| p.time = p.time.plus_seconds(0.1));
        let found = compare(&track, T0, &truth(every(0.02, 0.0, 10.0)), &[at(-6.0), at(50.0)]);
        let [reached, never] = &found.crossings[..] else { panic!("two points") };
        assert!((reached.time_error.expect("reached") - 0.1 / 2.0).abs() < 1e-9);
        assert!((reached.speed_error.expect("reached") - 0.2 / 2.0).abs() < 1e-9);
        assert_eq!((reached.time_inside, reached.speed_inside), (Some(true), Some(false)));
        assert_eq!((never.time_error, never.reference.is_some()), (None, false));
    }

    #[test]
    fn a_kink_of_the_velocity_is_a_jump_of_the_acceleration() {
        let sample =
            |t: f64| Sample { time_s: t, value: [0.0, 0.0, 3.0 * (t - 1.0).max(0.0)], sigma: [1.0; 3] };
        let velocities: Vec<Sample> = every(0.02, 0.0, 2.0).map(sample).collect();
        let jump = largest_jump(&velocities).expect("a jump");
        assert!((jump.jump_m_s2 - 3.0).abs() < 1e-9 && (jump.time_s - 1.0).abs() < 0.011, "{jump:?}");
        assert_eq!(largest_jump(&velocities[..2]), None);
    }
}
