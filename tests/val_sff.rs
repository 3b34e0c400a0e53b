//! SFF held against a dense solution of the same penalised problem, made without the library's own basis,
//! banded algebra or normal equations.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trackfuse::estimate::Coefficients;
use trackfuse::estimate::spline::{self, Settings, Smoothing};
use trackfuse::sample::{Sample, Source};
use trackfuse::track::Curve;

const SPACING_S: f64 = 0.1;
const FROM_S: f64 = 0.0;
const TO_S: f64 = 3.0;
const MARGIN: usize = 4;
const LAMBDA: f64 = 3.0;

/// A wave of numbers in [-1, 1] without a pattern that a grid could share.
fn wave(i: usize, k: f64) -> f64 {
    (i as f64 * k + 0.3 * (i as f64 * 0.71).sin()).sin()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Two sources at irregular times, positions and velocities at times of their own, one with outages.
fn irregular_sources(anisotropic: bool) -> Vec<Source> {
    let sigma = |base: f64| {
        if anisotropic { [base, 2.0 * base, 0.5 * base] } else { [base; 3] }
    };
    let truth = |t: f64| [3.0 * (1.3 * t).sin(), t * t - 2.0 * t, -60.0 + 8.0 * t];
    let slope = |t: f64| [3.9 * (1.3 * t).cos(), 2.0 * t - 2.0, 8.0];
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let rng = &mut rng;
    let mut make = |n: usize, from: f64, to: f64, seed: f64, noise: f64, value: &dyn Fn(f64) -> [f64; 3]| {
        let mut series: Vec<Sample> = (0..n)
            .map(|i| {
                let u = (i as f64 + 0.4 * wave(i, seed)) / n as f64;
                let time_s = (from + (to - from) * u).clamp(from, to);
                let v = value(time_s);
                let value = std::array::from_fn(|a| v[a] + noise * normal(rng));
                Sample { time_s, value, sigma: sigma(noise) }
            })
            .collect();
        series.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        series
    };
    vec![
        Source {
            name: "tether".into(),
            positions: make(70, 0.0, 1.8, 0.37, 0.1, &truth),
            velocities: make(50, 0.05, 1.7, 0.61, 0.2, &slope),
        },
        Source {
            name: "beacon".into(),
            positions: make(40, 1.5, 3.0, 0.83, 0.15, &truth),
            velocities: make(33, 1.6, 2.9, 0.29, 0.3, &slope),
        },
    ]
}

/// Value and slope of every Gaussian at t, straight from the normal density, cut as documented: at 6 sigma.
fn dense_rows(t: f64, knots: usize) -> (DVector<f64>, DVector<f64>) {
    let x = |k: usize| (t - (FROM_S - MARGIN as f64 * SPACING_S)) / SPACING_S - k as f64;
    let density = |k: usize| {
        let inside = x(k) >= -6.0 && x(k) < 6.0;
        if inside { (-0.5 * x(k).powi(2)).exp() / (2.0 * std::f64::consts::PI).sqrt() } else { 0.0 }
    };
    (
        DVector::from_fn(knots, |k, _| density(k)),
        DVector::from_fn(knots, |k, _| -x(k) / SPACING_S * density(k)),
    )
}

/// The dense answer for one axis: coefficients, posterior covariance of unit noise, noise scale.
fn dense_fit(
    sources: &[Source],
    axis: usize,
    centre: f64,
    knots: usize,
) -> (DVector<f64>, DMatrix<f64>, f64) {
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut right: Vec<f64> = Vec::new();
    for source in sources {
        for sample in &source.positions {
            rows.push(dense_rows(sample.time_s, knots).0 / sample.sigma[axis]);
            right.push((sample.value[axis] - centre) / sample.sigma[axis]);
        }
        for sample in &source.velocities {
            rows.push(dense_rows(sample.time_s, knots).1 / sample.sigma[axis]);
            right.push(sample.value[axis] / sample.sigma[axis]);
        }
    }
    let data = rows.len();
    for k in 0..knots - 3 {
        let mut row = DVector::zeros(knots);
        for (j, d) in [-1.0, 3.0, -3.0, 1.0].into_iter().enumerate() {
            row[k + j] = d * LAMBDA.sqrt();
        }
        rows.push(row);
        right.push(0.0);
    }
    let design = DMatrix::from_fn(rows.len(), knots, |i, j| rows[i][j]);
    let right = DVector::from_vec(right);
    let svd = design.clone().svd(true, true);
    let solution = svd.solve(&right, 0.0).expect("svd has both sides");
    let residual = (&design * &solution - &right).norm_squared();
    let inverse = svd.pseudo_inverse(0.0).expect("svd has both sides");
    (solution, &inverse * inverse.transpose(), residual / (data - 3) as f64)
}

fn assert_equals_dense(anisotropic: bool) {
    let sources = irregular_sources(anisotropic);
    let settings = Settings {
        knot_spacing_s: Some(SPACING_S),
        margin: MARGIN,
        smoothing: Smoothing::Fixed(LAMBDA),
        ..Settings::default()
    };
    let fitted = spline::fit(&sources, FROM_S, TO_S, &settings).expect("a good problem");
    let knots = fitted.knots().0;
    for axis in 0..3 {
        let values: Vec<f64> = sources.iter().flat_map(|s| &s.positions).map(|p| p.value[axis]).collect();
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        let centre = f64::midpoint(low, high);
        let (solution, covariance, scale) = dense_fit(&sources, axis, centre, knots);
        for i in 0..=60 {
            let t = FROM_S + (TO_S - FROM_S) * f64::from(i) / 60.0;
            let state = fitted.at(t).expect("inside");
            let (value, slope) = dense_rows(t, knots);
            let (position, velocity) = (centre + value.dot(&solution), slope.dot(&solution));
            assert!(
                (state.position[axis] - position).abs() < 1e-9 * 60.0,
                "position at {t}, axis {axis}: {} {position}",
                state.position[axis]
            );
            assert!(
                (state.velocity[axis] - velocity).abs() < 1e-9 * 60.0 / SPACING_S,
                "velocity at {t}: {} {velocity}",
                state.velocity[axis]
            );
            let sigma = |b: &DVector<f64>| (scale.max(1.0) * (b.transpose() * &covariance * b)[0]).sqrt();
            assert!((state.position_sigma[axis] / sigma(&value) - 1.0).abs() < 1e-6, "sigma at {t}");
            assert!((state.velocity_sigma[axis] / sigma(&slope) - 1.0).abs() < 1e-6, "velocity sigma at {t}");
        }
    }
}

#[test]
fn shared_weights_give_the_dense_solution_and_its_posterior_sigma() {
    assert_equals_dense(false);
}

#[test]
fn weights_that_differ_by_axis_give_the_dense_solution_too() {
    assert_equals_dense(true);
}

#[test]
fn without_a_penalty_the_fit_is_exact_on_data_that_it_can_represent() {
    let knots = 39; // 3 s in steps of 0.1 s, one more, and four beyond each end
    let coefficients = |axis: usize| DVector::from_fn(knots, |k, _| 5.0 * wave(3 * k + axis, 0.9));
    let exact = |t: f64, axis: usize| {
        let (value, slope) = dense_rows(t, knots);
        (value.dot(&coefficients(axis)), slope.dot(&coefficients(axis)))
    };
    let sample = |time_s: f64, value: [f64; 3]| Sample { time_s, value, sigma: [0.1; 3] };
    let times: Vec<f64> = (0..=300).map(|i| f64::from(i) * 0.01).collect();
    let source = Source {
        name: "exact".into(),
        positions: times.iter().map(|&t| sample(t, std::array::from_fn(|a| exact(t, a).0))).collect(),
        velocities: times.iter().map(|&t| sample(t, std::array::from_fn(|a| exact(t, a).1))).collect(),
    };
    for coefficients in [Coefficients::Shared, Coefficients::Independent] {
        let settings = Settings {
            knot_spacing_s: Some(SPACING_S),
            smoothing: Smoothing::Fixed(0.0),
            coefficients,
            ..Settings::default()
        };
        let fitted =
            spline::fit(std::slice::from_ref(&source), FROM_S, TO_S, &settings).expect("a good problem");
        assert_eq!(fitted.knots().0, knots);
        for i in 0..=100 {
            let t = 0.03 * f64::from(i);
            let state = fitted.at(t).expect("inside");
            for axis in 0..3 {
                let (position, velocity) = exact(t, axis);
                assert!(
                    (state.position[axis] - position).abs() < 1e-8 * 5.0,
                    "position at {t}: {:e}",
                    state.position[axis] - position
                );
                assert!(
                    (state.velocity[axis] - velocity).abs() < 1e-8 * 5.0 / SPACING_S,
                    "velocity at {t}: {:e}",
                    state.velocity[axis] - velocity
                );
            }
        }
    }
}

#[test]
fn the_likelihood_finds_a_penalty_whose_errors_fit_the_bands() {
    let mut inside = 0;
    let mut total = 0;
    let sources = irregular_sources(false);
    let fitted = spline::fit(&sources, FROM_S, TO_S, &Settings::default()).expect("a good problem");
    for i in 0..=60 {
        let t = 0.05 * f64::from(i);
        let state = fitted.at(t).expect("inside");
        let truth = [3.0 * (1.3 * t).sin(), t * t - 2.0 * t, -60.0 + 8.0 * t];
        for axis in 0..3 {
            total += 1;
            inside +=
                usize::from((state.position[axis] - truth[axis]).abs() < 1.96 * state.position_sigma[axis]);
            assert!(state.position_sigma[axis] < 0.2, "{}", state.position_sigma[axis]);
        }
    }
    assert!(inside * 100 > 85 * total, "{inside} of {total} inside the 95 % band");
}

/// Positions alone at the given times, with noise of `sigma`.
fn fixes(times: impl Iterator<Item = f64>, truth: impl Fn(f64) -> f64, sigma: f64) -> Source {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let sample = |t: f64, rng: &mut ChaCha8Rng| Sample {
        time_s: t,
        value: std::array::from_fn(|_| truth(t) + sigma * normal(rng)),
        sigma: [sigma; 3],
    };
    Source {
        name: "fixes".into(),
        positions: times.map(|t| sample(t, &mut rng)).collect(),
        velocities: Vec::new(),
    }
}

#[test]
fn an_hour_of_fixes_every_20_s_is_followed_within_their_noise() {
    let truth = |t: f64| 20.0 * (std::f64::consts::TAU * t / 150.0).sin();
    let source = fixes((0..181).map(|i| 20.0 * f64::from(i)), truth, 0.5);
    let fitted = spline::fit(&[source], 0.0, 3600.0, &Settings::default()).expect("a good problem");
    let (mut squares, mut inside) = (0.0, 0);
    for i in 0..=3600 {
        let state = fitted.at(f64::from(i)).expect("inside");
        let error = state.position[0] - truth(f64::from(i));
        squares += error * error;
        inside += usize::from(error.abs() < 1.96 * state.position_sigma[0]);
    }
    assert!((squares / 3601.0).sqrt() < 0.6, "{}", (squares / 3601.0).sqrt());
    assert!(inside > 3200, "{inside} of 3601 inside the 95 % band");
}

#[test]
fn a_sharp_move_in_an_hour_of_sparse_fixes_is_followed_or_its_misfit_shows() {
    // 4 s at 50 Hz in the middle of an hour at 20 s: up by 60 m
    let truth = |t: f64| 60.0 / (1.0 + (-(t - 1802.0) * 3.0).exp());
    let sparse = (0..181).map(|i| 20.0 * f64::from(i));
    let mut times: Vec<f64> = sparse.chain((0..200).map(|i| 1800.01 + 0.02 * f64::from(i))).collect();
    times.sort_by(f64::total_cmp);
    let source = fixes(times.into_iter(), truth, 0.1);
    let fitted = spline::fit(&[source], 0.0, 3600.0, &Settings::default()).expect("a good problem");
    let errors = (0..400).map(|i| 1800.0 + 0.01 * f64::from(i));
    let squares: f64 = errors.map(|t| (fitted.at(t).expect("inside").position[0] - truth(t)).powi(2)).sum();
    let rmse = (squares / 400.0).sqrt();
    assert!(rmse < 0.3 || fitted.noise_scale()[0] > 2.0, "{rmse} m, scale {:?}", fitted.noise_scale());
    assert!(fitted.knots().0 < 21_000, "{:?}", fitted.knots());
}
