//! What every estimator must keep, whatever its method.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trackfuse::estimate::EstimateError;
use trackfuse::estimate::coverage::Coverage;
use trackfuse::estimate::extrapolation::{self, Choice, Law, LawKind};
use trackfuse::estimate::polynomial::Prior;
use trackfuse::estimate::registration;
use trackfuse::estimate::{Coefficients, Estimator};
use trackfuse::fusion::{Fusion, Plan, fuse};
use trackfuse::sample::{Quantity, Sample, Source};
use trackfuse::time::Time;
use trackfuse::track::{Phase, TrackPoint};

const METHODS: [Estimator; 4] = [Estimator::Gdf, Estimator::Pcf, Estimator::Sff, Estimator::MovingAverage];

fn plan(method: Estimator, coefficients: Coefficients) -> Plan {
    Plan {
        origin: Time::from_ns(1_700_000_000_000_000_000),
        frame_id: "enu".into(),
        rate_hz: 50.0,
        datum: 0,
        method,
        coefficients,
        knot_spacing_s: None,
        order: 8,
        window_points: 5,
        registration: None,
        bridge_max_s: 5.0,
        extrapolation: Some(
            extrapolation::Settings { laws: // of an acceleration that stays, as that of the parabola below
            vec![Law {
                kind: LawKind::Polynomial { order: 4, prior: Some(Prior { sigma: 0.5, decay_s: None }) },
                window_s: 1.4,
            }], choice: Choice::First, horizon_s: 0.5 },
        ),
        stop_z_m: None,
        heights: Vec::new(),
    }
}

/// Two sources of one motion at times of their own, with an overlap.
fn sources(noise: f64) -> Vec<Source> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut make = |name: &str, from: f64, to: f64, step: f64| {
        let mut source = Source { name: name.into(), ..Source::default() };
        for i in 0..((to - from) / step) as usize {
            let t = from + i as f64 * step;
            let (position, velocity) = ([2.0 * t, 0.3 * t * t, -60.0 + 8.0 * t], [2.0, 0.6 * t, 8.0]);
            let mut sample = |value: [f64; 3]| {
                let value = value.map(|v| {
                    let n: f64 = StandardNormal.sample(&mut rng);
                    v + noise * n
                });
                Sample { time_s: t, value, sigma: [0.1; 3] }
            };
            source.positions.push(sample(position));
            source.velocities.push(sample(velocity));
        }
        source
    };
    vec![make("tether", 0.0, 2.2, 0.02), make("beacon", 1.6, 4.0, 0.043)]
}

fn run(sources: &[Source], method: Estimator, coefficients: Coefficients) -> Fusion {
    fuse(sources, &plan(method, coefficients)).expect("a good problem")
}

fn each(mut check: impl FnMut(Estimator, Coefficients)) {
    for method in METHODS {
        for coefficients in [Coefficients::Shared, Coefficients::Independent] {
            check(method, coefficients);
        }
    }
}

fn changed(sources: &[Source], mut change: impl FnMut(&mut Sample)) -> Vec<Source> {
    let mut sources = sources.to_vec();
    for source in &mut sources {
        for quantity in Quantity::ALL {
            source.series_mut(quantity).iter_mut().for_each(&mut change);
        }
    }
    sources
}

fn assert_close(a: [f64; 3], b: [f64; 3], tolerance: f64, what: &str) {
    let distance = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    assert!(distance < tolerance, "{what}: {a:?} against {b:?}");
}

/// The penalty's weight is found to a tenth of a decade: where data differ by rounding it may end elsewhere
/// within that.
fn tolerance_m(method: Estimator) -> f64 {
    if method == Estimator::Sff { 5e-3 } else { 1e-6 }
}

fn assert_same_points(a: &[TrackPoint], b: &[TrackPoint], method: Estimator, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (a, b) in a.iter().zip(b) {
        assert_close(a.state.position, b.state.position, tolerance_m(method), what);
        assert_close(a.state.velocity, b.state.velocity, 10.0 * tolerance_m(method), what);
        assert_eq!((a.phase, a.seen_by), (b.phase, b.seen_by), "{what}");
    }
}

#[test]
fn noise_free_data_of_a_parabola_are_met_exactly_but_for_interpolation_and_averaging() {
    each(|method, coefficients| {
        let found = run(&sources(0.0), method, coefficients);
        // straight lines between samples 43 ms apart, and 5 points of a parabola
        let tolerance = match method {
            Estimator::Pcf => 1e-7,
            Estimator::Sff => 1e-4,
            Estimator::Gdf | Estimator::MovingAverage => 5e-2,
        };
        for point in found.track.points {
            let t = point.time.seconds_since(Time::from_ns(1_700_000_000_000_000_000));
            let truth = [2.0 * t, 0.3 * t * t, -60.0 + 8.0 * t];
            assert_close(point.state.position, truth, tolerance, &format!("{method:?} at {t}"));
        }
    });
}

#[test]
fn a_shift_of_all_times_shifts_the_track() {
    let original = sources(0.1);
    // a power of two, so that the shifted times are exact
    let shifted = changed(&original, |s| s.time_s += 1024.0);
    each(|method, coefficients| {
        let (a, b) = (run(&original, method, coefficients), run(&shifted, method, coefficients));
        assert_same_points(&a.track.points, &b.track.points, method, &format!("{method:?} {coefficients:?}"));
    });
}

#[test]
fn turned_sources_give_the_turned_track() {
    let (sine, cosine) = 0.7_f64.sin_cos();
    let turn = |v: [f64; 3]| [cosine * v[0] - sine * v[1], sine * v[0] + cosine * v[1], v[2]];
    let original = sources(0.1);
    let turned = changed(&original, |s| s.value = turn(s.value));
    each(|method, coefficients| {
        let (a, b) = (run(&original, method, coefficients), run(&turned, method, coefficients));
        let what = format!("{method:?} {coefficients:?}");
        assert_eq!(a.track.points.len(), b.track.points.len(), "{what}");
        for (a, b) in a.track.points.iter().zip(&b.track.points) {
            assert_close(turn(a.state.position), b.state.position, tolerance_m(method), &what);
        }
    });
}

#[test]
fn the_order_of_samples_of_one_instant_does_not_matter() {
    let mut doubled = sources(0.1);
    for source in &mut doubled {
        for quantity in Quantity::ALL {
            let series = source.series_mut(quantity);
            for pair in series.chunks_exact_mut(2) {
                pair[1].time_s = pair[0].time_s;
            }
        }
    }
    let mut swapped = doubled.clone();
    for source in &mut swapped {
        for quantity in Quantity::ALL {
            source.series_mut(quantity).chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
        }
    }
    // the weighted mean takes one of two samples of an instant, by their order
    for method in [Estimator::Sff, Estimator::Pcf] {
        let (a, b) =
            (run(&doubled, method, Coefficients::Shared), run(&swapped, method, Coefficients::Shared));
        assert_same_points(&a.track.points, &b.track.points, method, &format!("{method:?}"));
    }
}

#[test]
fn numbers_that_are_no_numbers_are_refused_by_name() {
    each(|method, coefficients| {
        for (bad, expected) in [(0, "a finite number"), (1, "a positive sigma"), (2, "a finite time")] {
            let mut soiled = sources(0.1);
            let sample = &mut soiled[1].velocities[7];
            match bad {
                0 => sample.value[1] = f64::NAN,
                1 => sample.sigma[2] = 0.0,
                _ => sample.time_s = f64::INFINITY,
            }
            let error = fuse(&soiled, &plan(method, coefficients)).expect_err("a bad number");
            let EstimateError::BadNumber { what, expected: wanted, .. } = error else {
                panic!("{method:?}: {error}");
            };
            assert_eq!((what.as_str(), wanted), ("velocity of beacon", expected));
        }
    });
}

#[test]
fn sigmas_are_positive_and_grow_after_the_last_sample() {
    each(|method, coefficients| {
        let found = run(&sources(0.1), method, coefficients);
        for point in &found.track.points {
            let sigmas = point.state.position_sigma.iter().chain(&point.state.velocity_sigma);
            assert!(sigmas.into_iter().all(|s| s.is_finite() && *s > 0.0), "{method:?}: {point:?}");
        }
        let beyond: Vec<f64> =
            found.track.points.iter().filter(|p| p.seen_by == 0).map(|p| p.state.position_sigma[2]).collect();
        assert!(beyond.len() > 20 && beyond.windows(2).all(|w| w[0] < w[1]), "{method:?}: {beyond:?}");
    });
}

/// Any series that a log may hold: times in clusters, repeated, far apart; values and sigmas of any size.
fn any_series() -> impl Strategy<Value = Vec<Sample>> {
    let time = prop_oneof![0.0..5.0_f64, (0..20).prop_map(|i| f64::from(i) * 0.1), -1e6..1e9_f64];
    let value = || prop_oneof![-100.0..100.0_f64, Just(0.0), -1e12..1e12_f64];
    let sigma = || prop_oneof![0.01..1.0_f64, Just(0.1), 1e-9..1e9_f64];
    let sample = (time, [value(), value(), value()], [sigma(), sigma(), sigma()])
        .prop_map(|(time_s, value, sigma)| Sample { time_s, value, sigma });
    proptest::collection::vec(sample, 0..40).prop_map(|mut series| {
        series.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        series
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_samples_there_is_a_track_of_numbers_or_an_error(
        series in proptest::collection::vec((any_series(), any_series()), 1..4),
        method in 0..4_usize,
        independent in any::<bool>(),
        horizon_s in prop_oneof![Just(0.5), Just(30.0)],
        stop in proptest::option::of(-50.0..50.0_f64),
    ) {
        let sources: Vec<Source> = series
            .into_iter()
            .enumerate()
            .map(|(i, (positions, velocities))| Source { name: i.to_string(), positions, velocities })
            .collect();
        let coefficients = if independent { Coefficients::Independent } else { Coefficients::Shared };
        let mut plan = plan(METHODS[method], coefficients);
        // a track of a size that can be read, as the program sees to
        let seen_s: f64 = Coverage::of(&sources).pieces(plan.bridge_max_s).iter().map(|p| p.1 - p.0).sum();
        plan.rate_hz = (2_000.0 / (seen_s + horizon_s)).min(50.0);
        plan.stop_z_m = stop;
        plan.extrapolation.as_mut().expect("there is one").horizon_s = horizon_s;
        if let Ok(found) = fuse(&sources, &plan) {
            for point in found.track.points {
                let numbers = point.state.position.iter().chain(&point.state.velocity);
                prop_assert!(numbers.into_iter().all(|v| v.is_finite()), "{:?}", point);
            }
        }
    }
}

#[test]
fn the_extrapolation_goes_on_where_the_track_ends_with_its_band() {
    for registration in [None, Some(registration::Settings::default())] {
        let plan = Plan { registration, rate_hz: 1000.0, ..plan(Estimator::Sff, Coefficients::Shared) };
        let points = fuse(&sources(0.1), &plan).expect("a good problem").track.points;
        let first = points.iter().position(|p| p.phase == Phase::Extrapolated).expect("carried on");
        let (a, b) = (&points[first - 1].state, &points[first].state);
        for axis in 0..3 {
            let step = b.position[axis] - a.position[axis] - 1e-3 * a.velocity[axis];
            assert!(step.abs() < 1e-4, "{step} m");
            assert!((b.velocity[axis] - a.velocity[axis]).abs() < 0.02, "{:?} {:?}", a.velocity, b.velocity);
            let wider = b.position_sigma[axis] / a.position_sigma[axis];
            assert!((0.99..1.05).contains(&wider), "{:?} {:?}", a.position_sigma, b.position_sigma);
            let wider = b.velocity_sigma[axis] / a.velocity_sigma[axis];
            assert!((0.99..1.05).contains(&wider), "{:?} {:?}", a.velocity_sigma, b.velocity_sigma);
        }
    }
}

#[test]
fn velocities_that_outlast_the_positions_by_an_interval_carry_the_track_on() {
    let mut both = sources(0.0);
    both.truncate(1);
    let mut velocities = both[0].clone();
    velocities.positions.clear();
    both[0].velocities.clear();
    both[0].positions = both[0].positions.iter().step_by(10).copied().collect();
    assert!(both[0].span_s().expect("positions").1 < velocities.span_s().expect("velocities").1);
    both.push(velocities);
    let found = run(&both, Estimator::Sff, Coefficients::Shared);
    assert!(found.track.points.iter().any(|p| p.phase == Phase::Extrapolated), "{:?}", found.warnings);
}

#[test]
fn a_track_that_ends_above_the_stop_is_not_carried_on() {
    let carried = |stop_z_m| {
        let plan = Plan { stop_z_m: Some(stop_z_m), ..plan(Estimator::Sff, Coefficients::Shared) };
        let points = fuse(&sources(0.0), &plan).expect("a good problem").track.points;
        points.iter().filter(|p| p.phase == Phase::Extrapolated).count()
    };
    let all = carried(1e9);
    assert!((20..30).contains(&all), "a stop that is never reached stops nothing: {all}");
    assert_eq!(carried(-40.0), 0);
    assert!((1..all).contains(&carried(-27.0)));
}
