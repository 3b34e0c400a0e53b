//! Registration of made-up sources: against a dense solution, planted errors, and what no data can tell.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::bordered::{Layout, eliminate};
use super::knots::Knots;
use super::model::{Anchor, COLUMNS, Reference, VALUE, turned};
use super::normal::{Normal, Weighted, motion};
use super::unknowns::{OF_A_SOURCE, OF_AN_AXIS, index};
use super::*;
use crate::math::gaussian_basis::Active;
use crate::sample::Sample;
use crate::track::Curve;

/// Position and velocity at an instant.
type Path = fn(f64) -> ([f64; 3], [f64; 3]);

/// A climb with turns: speeds up to 9 m/s, accelerations up to 9 m/s2.
fn winding(t: f64) -> ([f64; 3], [f64; 3]) {
    (
        [4.0 * (1.5 * t).sin(), 3.0 * (1.2 * t).cos() + t, -40.0 + 4.0 * t + 3.0 * (1.7 * t).sin()],
        [6.0 * (1.5 * t).cos(), -3.6 * (1.2 * t).sin() + 1.0, 4.0 + 5.1 * (1.7 * t).cos()],
    )
}

/// Straight on at 10 m/s.
fn straight(t: f64) -> ([f64; 3], [f64; 3]) {
    ([6.0 * t, 0.0, -60.0 + 8.0 * t], [6.0, 0.0, 8.0])
}

/// Straight on at 10 m/s, but for a turn by 60 degrees within 0.3 s at 10 s.
fn kinked(t: f64) -> ([f64; 3], [f64; 3]) {
    const WIDTH_S: f64 = 0.1;
    let turned = 0.5 * (1.0 + ((t - 10.0) / WIDTH_S).tanh());
    let since_s = 0.5 * (t - 10.0 + WIDTH_S * (2.0 * ((t - 10.0) / WIDTH_S).cosh()).ln());
    ([8.7 * since_s, 0.0, 10.0 * t - 5.0 * since_s], [8.7 * turned, 0.0, 10.0 - 5.0 * turned])
}

/// What a source with these errors measures of a path, every `step_s`, with noise of `sigma`.
struct Sensor {
    path: Path,
    from_s: f64,
    to_s: f64,
    step_s: f64,
    sigma: f64,
    errors: SourceErrors,
    middle_s: f64,
    seed: u64,
}

impl Sensor {
    fn datum(path: Path, from_s: f64, to_s: f64, seed: u64) -> Self {
        let errors = SourceErrors::default();
        Self { path, from_s, to_s, step_s: 0.02, sigma: 0.1, errors, middle_s: 0.0, seed }
    }

    fn watch(&self, name: &str) -> Source {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut source = Source { name: name.into(), ..Source::default() };
        let count = ((self.to_s - self.from_s) / self.step_s).round() as usize;
        let q = (self.path)(self.middle_s).0;
        for i in 0..count {
            let t = self.from_s + self.step_s * (i as f64 + 0.3 * rng.random::<f64>());
            let (p, v) = (self.path)(t);
            let e = &self.errors;
            let mut noise = || {
                let n: f64 = StandardNormal.sample(&mut rng);
                self.sigma * n
            };
            let moved = std::array::from_fn(|a| {
                (1.0 + e.scale) * (p[a] - q[a]) + e.bias_m[a] + e.drift_m_s[a] * (t - self.middle_s)
            });
            let fast =
                std::array::from_fn(|a| (1.0 + e.scale) * v[a] + e.drift_m_s[a] + e.velocity_bias_m_s[a]);
            let (moved, fast) = (turned(moved, e.rotation_rad), turned(fast, e.rotation_rad));
            let time_s = t + e.clock_offset_s;
            let sample = |value| Sample { time_s, value, sigma: [self.sigma; 3] };
            source.positions.push(sample(std::array::from_fn(|a| q[a] + moved[a] + noise())));
            source.velocities.push(sample(std::array::from_fn(|a| fast[a] + noise())));
        }
        source
    }
}

fn errors() -> SourceErrors {
    SourceErrors {
        bias_m: [1.2, -0.7, 2.0],
        drift_m_s: [0.1, -0.05, 0.08],
        velocity_bias_m_s: [-0.2, 0.3, 0.1],
        clock_offset_s: 0.04,
        scale: 0.002,
        rotation_rad: 0.0,
    }
}

/// Two sources of a winding path that overlap from 4 to 6 s.
fn pair(errors: SourceErrors, seed: u64) -> Vec<Source> {
    let first = Sensor::datum(winding, 0.0, 6.0, seed);
    let second = Sensor {
        errors,
        middle_s: 5.0,
        step_s: 0.05,
        sigma: 0.15,
        ..Sensor::datum(winding, 4.0, 10.0, seed + 1000)
    };
    vec![first.watch("first"), second.watch("second")]
}

const PIECE: [(f64, f64); 1] = [(0.0, 10.0)];

fn registered(sources: &[Source]) -> Registered {
    register(sources, 0, &PIECE, &Settings::default()).expect("a good problem")
}

/// Root mean square of the position's 3-D error between two instants.
fn rmse(found: &Registered, path: Path, from_s: f64, to_s: f64) -> f64 {
    let times = (0..=200).map(|i| from_s + (to_s - from_s) * f64::from(i) / 200.0);
    let squares = times.map(|t| {
        let state = found.curve.at(t).expect("inside");
        (0..3).map(|a| (state.position[a] - path(t).0[a]).powi(2)).sum::<f64>()
    });
    (squares.sum::<f64>() / 201.0).sqrt()
}

#[test]
#[allow(clippy::too_many_lines)] // one problem, written down twice
fn solution_and_covariance_equal_those_of_the_dense_stacked_problem() {
    let sources = pair(errors(), 1);
    let knots = Knots::covering(&PIECE, 0.25, 0.2);
    let jerk_weights: Vec<f64> = (0..knots.count()).map(|k| 1.5 + (0.7 * k as f64).sin()).collect();
    let penalty = knots.jerk_penalty(&jerk_weights);
    let centre = [0.5, 1.0, -20.0];
    let anchor = Anchor { time_s: 5.0, point_m: winding(5.0).0 };
    let reference = |is_datum| Reference {
        anchor,
        image_m: anchor.point_m,
        errors: SourceErrors::default(),
        is_datum,
        centre,
    };
    let mut references = [reference(true), reference(false)];
    references[1].errors =
        SourceErrors { clock_offset_s: 0.03, scale: 0.001, rotation_rad: 0.02, ..errors() };
    let n = knots.count();
    // any smooth curve will do to be linear about
    let about: Vec<[f64; 3]> = (0..n)
        .map(|k| {
            let t = -1.2 + 0.25 * k as f64;
            std::array::from_fn(|a| winding(t).0[a] - centre[a])
        })
        .collect();
    let weights: Vec<[Vec<f64>; 2]> = sources
        .iter()
        .map(|s| [0, 1].map(|q| (0..s.positions.len()).map(|i| 1.0 - 0.1 * ((i + q) % 3) as f64).collect()))
        .collect();
    let series: Vec<Weighted<'_>> = (0..2)
        .flat_map(|s| Quantity::ALL.map(|q| (s, q)))
        .map(|(s, quantity)| Weighted {
            source: s,
            block: 0,
            quantity,
            samples: sources[s].series(quantity),
            weights: &weights[s][quantity as usize],
        })
        .collect();
    let normal = Normal::of(&knots, &series, &references, &about);
    let lambda = [3.0, 10.0, 30.0];
    let layout = Layout { slots: vec![1], active: (0..OF_A_SOURCE).collect() };
    let priors = Priors::default();
    let variances: Vec<f64> =
        layout.active.iter().map(|&i| priors.of(unknowns::kind_of(i).0).powi(2)).collect();
    let eliminated = eliminate(&normal, &penalty, lambda, &layout).expect("determined");
    let estimate = eliminated.information.with_prior(&variances).expect("regular");
    let posterior = eliminated.posterior(&layout, &estimate);

    // every row of every axis, the penalty's and the priors', stacked
    let unknowns = 3 * n + OF_A_SOURCE;
    let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
    let mut active = Active::default();
    for part in &series {
        let r = &references[part.source];
        for (sample, weight) in part.samples.iter().zip(part.weights) {
            knots.evaluate(r.time_s(sample.time_s), &mut active);
            let row = r.row(part.quantity, sample, &motion(&about, &active, centre));
            let b = if part.quantity == Quantity::Position { active.value() } else { active.slope() };
            for axis in 0..3 {
                let root = weight.sqrt() / sample.sigma[axis];
                let mut full = DVector::zeros(unknowns);
                b.iter().enumerate().for_each(|(i, b)| full[axis * n + active.first + i] = row.gain * b);
                for column in 0..OF_AN_AXIS {
                    full[3 * n + index(0, Kind::ALL[column], axis)] += row.columns[axis][column];
                }
                rows.push((full * root, row.columns[axis][VALUE] * root));
            }
        }
    }
    for axis in 0..3 {
        for k in 0..n - 3 {
            let mut full = DVector::zeros(unknowns);
            let differences = [-1.0, 3.0, -3.0, 1.0];
            differences.iter().enumerate().for_each(|(i, d)| full[axis * n + k + i] = *d);
            rows.push((full * (lambda[axis] * jerk_weights[k]).sqrt(), 0.0));
        }
    }
    for (i, variance) in variances.iter().enumerate() {
        let mut full = DVector::zeros(unknowns);
        full[3 * n + i] = 1.0 / variance.sqrt();
        rows.push((full, 0.0));
    }
    let matrix = DMatrix::from_fn(rows.len(), unknowns, |i, j| rows[i].0[j]);
    let right = DVector::from_fn(rows.len(), |i, _| rows[i].1);
    let qr = matrix.clone().qr();
    let dense = qr.r().solve_upper_triangular(&(qr.q().transpose() * right)).expect("full rank");
    let triangle = qr.r().try_inverse().expect("full rank");
    let covariance = &triangle * triangle.transpose();

    for axis in 0..3 {
        for k in 6..n - 6 {
            let difference = posterior.coefficients[k][axis] - dense[axis * n + k];
            assert!(difference.abs() < 1e-9, "coefficient {k} of axis {axis}: {difference}");
        }
    }
    for i in 0..OF_A_SOURCE {
        let sigma = covariance[(3 * n + i, 3 * n + i)].sqrt();
        assert!((posterior.unknowns[i] - dense[3 * n + i]).abs() < 1e-9, "unknown {i}");
        assert!((posterior.covariance[(i, i)].sqrt() / sigma - 1.0).abs() < 1e-6, "sigma {i}");
    }
    // of the curve, and of a sample of the second source
    let d: [f64; COLUMNS] = [1.0, 0.4, 0.7, -3.0, 2.0, 1.5, 0.0, 0.0];
    for t in [0.3, 3.9, 5.0, 8.2, 9.9] {
        knots.evaluate(t, &mut active);
        for axis in 0..3 {
            let mut full = DVector::zeros(unknowns);
            active.value().iter().enumerate().for_each(|(i, b)| full[axis * n + active.first + i] = 1.1 * b);
            let of_curve = (full.transpose() * &covariance * &full)[0];
            let ours = posterior.variance(axis, active.first, active.value(), 1.1, None);
            assert!((ours / of_curve - 1.0).abs() < 1e-6, "{ours} against {of_curve}");
            (0..OF_AN_AXIS).for_each(|j| full[3 * n + index(0, Kind::ALL[j], axis)] += d[j]);
            let of_sample = (full.transpose() * &covariance * &full)[0];
            let ours = posterior.variance(axis, active.first, active.value(), 1.1, Some((0, &d)));
            assert!((ours / of_sample - 1.0).abs() < 1e-6, "{ours} against {of_sample}");
        }
    }
}

#[test]
fn planted_errors_are_found_within_three_sigmas_on_ten_seeds() {
    for seed in 0..10 {
        let found = registered(&pair(errors(), seed));
        assert!(found.converged, "seed {seed}");
        let (e, s, truth) = (&found.errors[1], &found.sigmas[1], errors());
        for axis in 0..3 {
            for (e, s, truth) in [
                (e.bias_m, s.bias_m, truth.bias_m),
                (e.drift_m_s, s.drift_m_s, truth.drift_m_s),
                (e.velocity_bias_m_s, s.velocity_bias_m_s, truth.velocity_bias_m_s),
            ] {
                assert!((e[axis] - truth[axis]).abs() < 3.5 * s[axis], "seed {seed}: {e:?} +- {s:?}");
            }
        }
        assert!((e.clock_offset_s - truth.clock_offset_s).abs() < 3.0 * s.clock_offset_s);
        assert!(s.clock_offset_s < 0.01 && s.bias_m[0] < 0.1, "seed {seed}: {s:?}");
        assert!(rmse(&found, winding, 6.0, 10.0) < 0.25, "seed {seed}");
    }
}

#[test]
fn errors_that_are_not_there_shrink_to_nothing() {
    for seed in 20..25 {
        let found = registered(&pair(SourceErrors::default(), seed));
        let clock = found.unknowns.iter().find(|u| u.name.kind == Kind::ClockOffset).expect("acts");
        let bias = found.unknowns.iter().find(|u| u.name.kind == Kind::Bias).expect("acts");
        assert!(clock.probability < 0.3 && bias.probability < 0.05, "seed {seed}: {:?}", found.unknowns);
        assert!(rmse(&found, winding, 6.0, 10.0) < 0.08, "seed {seed}");
    }
}

#[test]
fn large_errors_carry() {
    let large = SourceErrors {
        bias_m: [5.0, -5.0, 4.0],
        drift_m_s: [0.3, -0.3, 0.2],
        velocity_bias_m_s: [0.5, -0.5, 0.5],
        clock_offset_s: 0.2,
        scale: 0.005,
        rotation_rad: 0.0,
    };
    for sign in [1.0, -1.0] {
        let errors = SourceErrors { clock_offset_s: sign * large.clock_offset_s, ..large };
        let found = registered(&pair(errors, 3));
        assert!(found.converged);
        assert!(
            (found.errors[1].clock_offset_s - errors.clock_offset_s).abs() < 0.02,
            "{:?} {:?}",
            found.errors[1],
            found.sigmas[1]
        );
        assert!(rmse(&found, winding, 6.0, 10.0) < 0.4, "{}", rmse(&found, winding, 6.0, 10.0));
    }
}

#[test]
fn a_clock_that_is_early_by_more_than_the_first_knots_reach_loses_no_samples() {
    let errors = SourceErrors { clock_offset_s: -0.7, ..SourceErrors::default() };
    let sources = pair(errors, 21);
    let found = register(&sources, 0, &[(0.0, 9.3)], &Settings::default()).expect("a good problem");
    assert!((found.errors[1].clock_offset_s + 0.7).abs() < 0.05, "{:?} {:?}", found.errors[1], found.noise);
    assert!(found.rejected.len() < 3, "{}", found.rejected.len());
}

#[test]
fn a_clock_that_is_off_by_a_third_of_a_turn_does_not_end_in_the_wrong_valley() {
    for offset_s in [1.3, -1.6] {
        let found = registered(&pair(SourceErrors { clock_offset_s: offset_s, ..errors() }, 22));
        let (e, s) = (&found.errors[1], &found.sigmas[1]);
        assert!((e.clock_offset_s - offset_s).abs() < 3.0 * s.clock_offset_s, "{e:?} +- {s:?}");
        assert!(s.clock_offset_s < 0.02 && e.rotation_rad.abs() < f64::MIN_POSITIVE, "{e:?} +- {s:?}");
    }
}

#[test]
fn a_source_that_the_others_contradict_is_not_believed_where_it_sees_alone() {
    let mut sources = pair(errors(), 23);
    for q in Quantity::ALL {
        sources[1].series_mut(q).iter_mut().for_each(|s| s.value[2] = -s.value[2]);
    }
    let found = registered(&sources);
    assert_eq!(found.mirrored[1], Some(Mirrored::Vertical));
    for t in [6.5, 7.5, 8.5, 9.5] {
        let state = found.curve.at(t).expect("inside");
        assert!(
            (state.position[2] - winding(t).0[2]).abs() < 4.0 * state.position_sigma[2],
            "{t} s: {state:?}"
        );
    }
}

#[test]
fn frames_that_are_turned_by_128_degrees_are_registered_with_and_without_an_overlap() {
    let angle = 128.0_f64.to_radians();
    for (begin, seed) in [(4.0, 5), (6.3, 6)] {
        let turned = Sensor {
            errors: SourceErrors { rotation_rad: angle, ..errors() },
            middle_s: 5.0,
            ..Sensor::datum(winding, begin, 10.0, seed)
        };
        let sources = [Sensor::datum(winding, 0.0, 6.0, 7).watch("first"), turned.watch("second")];
        let found = registered(&sources);
        let (e, s) = (found.errors[1].rotation_rad, found.sigmas[1].rotation_rad);
        assert!((e - angle).abs() < 3.0 * s && s < 0.1, "begin {begin}: {e} +- {s}, {}", found.log_evidence);
        for t in [6.5, 7.0, 8.0, 9.0, 9.9] {
            let state = found.curve.at(t).expect("inside");
            for axis in 0..3 {
                let error = state.position[axis] - winding(t).0[axis];
                assert!(error.abs() < 3.5 * state.position_sigma[axis], "{t} s: {error} of {state:?}");
                assert!(state.position_sigma[axis] < 1.5);
            }
        }
    }
}

#[test]
fn a_frame_turned_by_any_angle_is_registered_also_where_its_zero_is_far_from_the_datums() {
    for (seed, degrees) in (40..).zip([30.0_f64, 90.0, 128.0, 180.0, -150.0]) {
        let angle = degrees.to_radians();
        // counted from another place: turned about the datum's zero, not about the anchor
        for zero_m in [0.0, 60.0] {
            let errors = SourceErrors { rotation_rad: angle, ..errors() };
            let mut sources = pair(errors, seed);
            sources[1].positions.iter_mut().for_each(|s| s.value = [0, 1, 2].map(|a| s.value[a] + zero_m));
            let found = registered(&sources);
            let (e, s) = (found.errors[1].rotation_rad, found.sigmas[1].rotation_rad);
            let off = (e - angle).sin().atan2((e - angle).cos()).abs();
            assert!(off < 3.0 * s && s < 0.03, "{degrees} deg, {zero_m} m: {e} +- {s}");
            assert!(found.converged && rmse(&found, winding, 6.0, 10.0) < 0.4, "{degrees} deg, {zero_m} m");
        }
    }
}

#[test]
fn a_source_at_rest_shows_no_rotation() {
    for seed in 50..55 {
        let rest: Path = |_| ([3.0, -2.0, -10.0], [0.0; 3]);
        let first = Sensor::datum(rest, 0.0, 6.0, seed);
        let second = Sensor { errors: errors(), middle_s: 5.0, ..Sensor::datum(rest, 4.0, 10.0, seed + 100) };
        let found = registered(&[first.watch("first"), second.watch("second")]);
        assert!(found.errors[1].rotation_rad.abs() < f64::MIN_POSITIVE, "seed {seed}: {:?}", found.errors[1]);
    }
}

#[test]
fn a_straight_line_at_constant_speed_shows_the_heading_alone() {
    let angle = 128.0_f64.to_radians();
    let first = Sensor::datum(straight, 0.0, 6.0, 8);
    for (rotation_rad, seed) in [(0.0, 9), (angle, 10)] {
        let errors = SourceErrors { rotation_rad, ..errors() };
        let second = Sensor { errors, middle_s: 5.0, ..Sensor::datum(straight, 4.0, 10.0, seed) };
        let found = registered(&[first.watch("first"), second.watch("second")]);
        let (e, s) = (found.errors[1].rotation_rad, found.sigmas[1].rotation_rad);
        assert!((e - rotation_rad).abs() < 3.0 * s + f64::MIN_POSITIVE, "{rotation_rad}: {e} +- {s}");
    }
}

/// What is done to every vector of a source.
type Change = fn([f64; 3]) -> [f64; 3];

/// Two sources that overlap from 0.5 to 6 s, the second's vectors `changed`.
fn with_second(seed: u64, changed: Change) -> Vec<Source> {
    let second =
        Sensor { errors: errors(), middle_s: 3.25, ..Sensor::datum(winding, 0.5, 10.0, seed + 1000) };
    let mut sources = vec![Sensor::datum(winding, 0.0, 6.0, seed).watch("first"), second.watch("second")];
    for q in Quantity::ALL {
        sources[1].series_mut(q).iter_mut().for_each(|s| s.value = changed(s.value));
    }
    sources
}

#[test]
fn mirrored_axes_are_told_and_never_registered_as_a_rotation() {
    let cases: [(Change, Option<Mirrored>); 5] = [
        (|[x, y, z]| [y, x, -z], Some(Mirrored::Ned)),
        (|[x, y, z]| [-x, y, z], Some(Mirrored::Level)),
        (|[x, y, z]| [y, x, z], Some(Mirrored::Level)),
        (|[x, y, z]| [x, y, -z], Some(Mirrored::Vertical)),
        (|[x, y, z]| [-y, x, z], None),
    ];
    for (seed, (changed, mirrored)) in (60..).zip(cases) {
        let sources = with_second(seed, changed);
        let found = registered(&sources);
        assert_eq!(found.mirrored, [None, mirrored], "seed {seed}");
        if mirrored.is_some() {
            assert!(found.errors[1].rotation_rad.abs() < f64::MIN_POSITIVE, "seed {seed}");
            assert!(found.corrected(&sources)[1].is_empty() && found.unknowns.is_empty(), "seed {seed}");
        }
        for t in if mirrored.is_some() { [1.0, 2.0, 4.0, 5.5] } else { [6.5, 7.5, 8.5, 9.5] } {
            let state = found.curve.at(t).expect("inside");
            for axis in 0..3 {
                let error = state.position[axis] - winding(t).0[axis];
                assert!(
                    error.abs() < 4.0 * state.position_sigma[axis],
                    "seed {seed}, {t} s: {error}, {state:?}"
                );
            }
        }
    }
}

#[test]
fn frames_that_agree_are_not_turned() {
    for seed in 30..35 {
        let found = registered(&pair(errors(), seed));
        assert!(found.errors[1].rotation_rad.abs() < f64::MIN_POSITIVE, "seed {seed}");
    }
}

#[test]
fn an_overlap_at_constant_velocity_does_not_separate_bias_and_clock_offset() {
    let first = Sensor::datum(straight, 0.0, 6.0, 8);
    let second = Sensor { errors: errors(), middle_s: 5.0, ..Sensor::datum(straight, 4.0, 10.0, 9) };
    let found = registered(&[first.watch("first"), second.watch("second")]);
    let unknown = |kind, axis| {
        *found.unknowns.iter().find(|u| u.name.kind == kind && u.name.axis == axis).expect("acts")
    };
    let (clock, along, across) =
        (unknown(Kind::ClockOffset, None), unknown(Kind::Bias, Some(2)), unknown(Kind::Bias, Some(1)));
    assert_ne!(clock.separation, Separation::Separate, "{clock:?}");
    assert_ne!(along.separation, Separation::Separate, "{along:?}");
    assert_eq!(across.separation, Separation::Separate, "{across:?}");
    // their sum along the track is known, and so is the track: it is 8 m/s times the clock's sigma that isn't
    assert!((along.value - 8.0 * clock.value - (2.0 - 8.0 * 0.04)).abs() < 0.25, "{along:?} {clock:?}");
    assert!((along.value - 2.0).abs() < 3.0 * along.sigma, "{along:?}");
    // a winding path does separate them
    let found = registered(&pair(errors(), 1));
    assert!(
        found
            .unknowns
            .iter()
            .filter(|u| u.name.kind == Kind::Bias)
            .all(|u| u.separation == Separation::Separate)
    );
}

#[test]
fn outliers_are_listed_and_do_no_harm() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut sources = pair(errors(), 11);
    let clean = rmse(&registered(&sources), winding, 0.0, 10.0);
    let mut planted = 0;
    for sample in sources.iter_mut().flat_map(|s| &mut s.positions) {
        if rng.random::<f64>() < 0.1 {
            sample.value[planted % 3] += 2.0 + 18.0 * rng.random::<f64>();
            planted += 1;
        }
    }
    let found = registered(&sources);
    let harmed = rmse(&found, winding, 0.0, 10.0);
    assert!(harmed < 1.5 * clean + 0.02, "{harmed} m against {clean} m");
    assert!(found.rejected.len() >= planted && found.rejected.len() <= planted + 5, "{planted}");
    assert!(found.rejected.iter().all(|r| r.sigmas > 3.0), "{:?}", found.rejected);
}

#[test]
fn a_shift_in_time_a_turn_of_everything_and_the_order_of_equal_times_change_nothing() {
    let sources = pair(errors(), 12);
    let settings = Settings { kinds: Kind::ALL[..5].to_vec(), ..Settings::default() };
    let base = register(&sources, 0, &PIECE, &settings).expect("a good problem");
    let expected = base.curve.at(8.0).expect("inside");

    let mut later = sources.clone();
    for source in &mut later {
        Quantity::ALL.iter().for_each(|&q| source.series_mut(q).iter_mut().for_each(|s| s.time_s += 500.0));
    }
    let found = register(&later, 0, &[(500.0, 510.0)], &settings).expect("a good problem");
    let state = found.curve.at(508.0).expect("inside");
    for axis in 0..3 {
        assert!((state.position[axis] - expected.position[axis]).abs() < 1e-4);
        assert!((state.position_sigma[axis] / expected.position_sigma[axis] - 1.0).abs() < 0.01);
    }

    let mut mirrored = sources.clone();
    for source in &mut mirrored {
        for q in Quantity::ALL {
            source.series_mut(q).iter_mut().for_each(|s| s.value = [-s.value[1], s.value[0], s.value[2]]);
        }
    }
    let found = register(&mirrored, 0, &PIECE, &settings).expect("a good problem");
    let state = found.curve.at(8.0).expect("inside");
    assert!((state.position[0] + expected.position[1]).abs() < 1e-6);
    assert!((state.velocity[1] - expected.velocity[0]).abs() < 1e-6);

    let mut doubled = sources.clone();
    for pair in doubled[0].positions.chunks_exact_mut(2) {
        pair[1].time_s = pair[0].time_s;
    }
    let one = register(&doubled, 0, &PIECE, &settings).expect("a good problem");
    doubled[0].positions.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
    // the noise's correlation is that of neighbours, which the order does change a little
    let other = register(&doubled, 0, &PIECE, &settings).expect("a good problem");
    let (one, other) = (one.curve.at(3.0).expect("inside"), other.curve.at(3.0).expect("inside"));
    (0..3).for_each(|a| assert!((one.position[a] - other.position[a]).abs() < 2e-3));
}

#[test]
fn correlated_noise_is_seen_and_widens_the_bands() {
    let mut sources = pair(errors(), 13);
    let plain = registered(&sources);
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    for q in Quantity::ALL {
        let mut last = [0.0; 3];
        for sample in sources[1].series_mut(q) {
            for axis in 0..3 {
                let fresh: f64 = StandardNormal.sample(&mut rng);
                last[axis] = 0.8 * last[axis] + 0.6 * 0.3 * fresh;
                sample.value[axis] += last[axis];
            }
        }
    }
    let found = registered(&sources);
    assert!(plain.noise[1][0].correlation < 0.2, "{:?}", plain.noise);
    assert!(found.noise[1][0].correlation > 0.4, "{:?}", found.noise);
    let sigma = |r: &Registered| r.curve.at(8.0).expect("inside").position_sigma[0];
    assert!(sigma(&found) > 1.5 * sigma(&plain));
}

#[test]
fn sources_that_never_meet_have_wide_bands_and_three_sources_are_registered_each_by_itself() {
    let first = Sensor::datum(winding, 0.0, 3.0, 15).watch("first");
    let errors_far = SourceErrors { bias_m: [2.0; 3], ..SourceErrors::default() };
    let far = Sensor { errors: errors_far, middle_s: 18.0, ..Sensor::datum(winding, 33.0, 36.0, 16) };
    let found =
        register(&[first, far.watch("far")], 0, &[(0.0, 36.0)], &Settings::default()).expect("solved");
    let state = found.curve.at(35.0).expect("inside");
    assert!(state.position_sigma.iter().all(|s| *s > 0.8), "{state:?}");

    let mut three = pair(errors(), 17);
    let other = SourceErrors { bias_m: [-1.0, 1.0, 0.5], clock_offset_s: -0.05, ..SourceErrors::default() };
    let third = Sensor { errors: other, middle_s: 4.0, ..Sensor::datum(winding, 2.0, 9.0, 18) };
    three.push(third.watch("third"));
    let found = registered(&three);
    for (e, s, truth) in
        [(found.errors[1], found.sigmas[1], errors()), (found.errors[2], found.sigmas[2], other)]
    {
        assert!((e.clock_offset_s - truth.clock_offset_s).abs() < 3.0 * s.clock_offset_s, "{e:?} {s:?}");
        assert!((e.bias_m[1] - truth.bias_m[1]).abs() < 3.5 * s.bias_m[1], "{e:?} {s:?}");
    }
}

#[test]
fn a_sharp_turn_of_a_calm_path_is_followed_and_the_calm_stays_calm() {
    let (mut sharp, mut calm) = (0.0, 0.0);
    for seed in 0..10 {
        let mut source = Sensor::datum(kinked, 0.0, 20.0, seed).watch("one");
        source.velocities.clear();
        let found = register(&[source], 0, &[(0.0, 20.0)], &Settings::default()).expect("a good problem");
        sharp += rmse(&found, kinked, 9.6, 10.4).powi(2) / 10.0;
        calm += rmse(&found, kinked, 1.0, 9.0).powi(2) / 10.0;
    }
    // with one weight for all of it 0.111 m and 0.030 m
    assert!(sharp.sqrt() < 0.09, "{} m at the turn", sharp.sqrt());
    assert!(calm.sqrt() < 0.026, "{} m before", calm.sqrt());
}

#[test]
fn sources_of_one_quantity_have_the_unknowns_that_can_act() {
    let mut sources = pair(errors(), 19);
    sources[1].velocities.clear();
    let found = registered(&sources);
    assert!(found.unknowns.iter().all(|u| u.name.kind != Kind::VelocityBias));
    assert!(found.unknowns.iter().any(|u| u.name.kind == Kind::Bias));
    let mut sources = pair(errors(), 19);
    sources[1].positions.clear();
    let found = registered(&sources);
    assert!(found.unknowns.iter().all(|u| u.name.kind != Kind::Bias && u.name.kind != Kind::Drift));
    // nobody knows the position where nobody measures it
    assert!(found.curve.at(9.5).expect("inside").position_sigma[0] > 0.05);
}

#[test]
fn one_source_is_smoothed_and_what_is_no_number_refused() {
    let alone = [Sensor::datum(winding, 0.0, 10.0, 20).watch("alone")];
    let found = registered(&alone);
    assert!(rmse(&found, winding, 0.0, 10.0) < 0.06);
    assert!(found.unknowns.is_empty());
    let mut bad = alone.clone();
    bad[0].positions[3].value[1] = f64::NAN;
    let error = register(&bad, 0, &PIECE, &Settings::default()).expect_err("refused");
    assert!(matches!(error, EstimateError::BadNumber { .. }), "{error}");
    let mut blind = alone;
    blind[0].positions.clear();
    let error = register(&blind, 0, &PIECE, &Settings::default()).expect_err("refused");
    assert!(matches!(error, EstimateError::Undetermined { .. }), "{error}");
}
