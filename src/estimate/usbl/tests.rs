mod common;
mod warnings;

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::wiener::{Knowledge, Wiener};
use super::*;
use crate::estimate::EstimateError;
use crate::track::Curve;

/// Where a vehicle is that goes down, turns and goes on.
fn truth(t: f64) -> [f64; 3] {
    let turned = (t - 900.0).max(0.0);
    [0.6 * t.min(900.0) + 20.0 * (t / 300.0).sin(), 0.6 * turned, -0.5 * t]
}

/// 90 exchanges of four fixes, 3 m of noise, `off` added by exchange and fix.
fn fixes(off: impl Fn(usize, usize) -> [f64; 3]) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut all = Vec::new();
    for i in 0..90 {
        for k in 0..4 {
            let time_s = 20.0 * i as f64 + 0.5 * k as f64;
            let value = std::array::from_fn(|a| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                truth(time_s)[a] + 3.0 * noise + off(i, k)[a]
            });
            all.push(Sample { time_s, value, sigma: [3.0; 3] });
        }
    }
    all
}

fn cleaned(fixes: &[Sample]) -> Cleaned {
    clean(fixes, &[], &Settings::default()).expect("a track")
}

/// Root mean square distance from the truth, m.
fn error(track: &Cleaned) -> f64 {
    let square = |t: f64| {
        let state = track.at(t).expect("a state");
        (0..3).map(|a| (state.position[a] - truth(t)[a]).powi(2)).sum::<f64>()
    };
    ((0..178).map(|i| square(10.0 * f64::from(i))).sum::<f64>() / 178.0).sqrt()
}

#[test]
fn the_smoother_equals_dense_batch_least_squares_at_irregular_times() {
    let times = [0.0, 7.0, 7.5, 30.0, 270.0, 271.0, 300.0];
    let density = [0.002, 0.01, 0.001, 0.003, 0.002, 0.02];
    let measured = [(0, 1.0, 0.3), (1, 5.0, 0.0), (2, 4.0, -0.4), (4, 90.0, 0.0), (6, 80.0, 1.0)];
    let mut knowledge = vec![[Knowledge::default(); 3]; times.len()];
    let mut rows = vec![(vec![(1, 1.0)], 0.0, 1.0 / 1.44)];
    for (node, z, dt) in measured {
        (0..3).for_each(|axis| knowledge[node][axis].add(z, 0.25, dt));
        rows.push((vec![(2 * node, 1.0), (2 * node + 1, dt)], z, 0.25));
    }
    for k in 0..6 {
        // the inverse of the covariance of white acceleration over a gap, as rows of its Cholesky factor
        let d: f64 = times[k + 1] - times[k];
        let q = density[k] * nalgebra::Matrix2::new(d.powi(3) / 3.0, d * d / 2.0, d * d / 2.0, d);
        let factor = q.try_inverse().expect("regular").cholesky().expect("positive").l().transpose();
        for r in 0..2 {
            let (a, b) = (factor[(r, 0)], factor[(r, 1)]);
            rows.push((vec![(2 * k, -a), (2 * k + 1, -a * d - b), (2 * k + 2, a), (2 * k + 3, b)], 0.0, 1.0));
        }
    }
    let (mut gram, mut right) = (DMatrix::<f64>::zeros(14, 14), DVector::<f64>::zeros(14));
    for (row, z, w) in &rows {
        for (i, a) in row {
            right[*i] += w * a * z;
            row.iter().for_each(|(j, b)| gram[(*i, *j)] += w * a * b);
        }
    }
    let inverse = gram.try_inverse().expect("regular");
    let expected = &inverse * right;
    let track =
        Wiener::fit(&times, &knowledge, [0, 1, 2].map(|_| density.to_vec()), 1.2).expect("determined");
    for k in 0..times.len() {
        let ([p, v], [pp, pv, vv]) = track.node(1, k);
        for (found, dense) in [
            (p, expected[2 * k]),
            (v, expected[2 * k + 1]),
            (pp, inverse[(2 * k, 2 * k)]),
            (pv, inverse[(2 * k, 2 * k + 1)]),
            (vv, inverse[(2 * k + 1, 2 * k + 1)]),
        ] {
            assert!((found - dense).abs() < 1e-7 * dense.abs().max(1.0), "node {k}: {found} {dense}");
        }
    }
    // a node in the silence that measures nothing has the state that the track has there without it
    let between = track.at(120.0);
    let mut more = times.to_vec();
    more.insert(4, 120.0);
    knowledge.insert(4, [Knowledge::default(); 3]);
    let densities = [0, 1, 2].map(|_| [&density[..4], &density[3..]].concat());
    let with = Wiener::fit(&more, &knowledge, densities, 1.2).expect("determined");
    let ([p, v], [pp, _, vv]) = with.node(2, 4);
    let found =
        [between.position[2], between.velocity[2], between.position_sigma[2], between.velocity_sigma[2]];
    for (found, expected) in found.iter().zip([p, v, pp.sqrt(), vv.sqrt()]) {
        assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0), "{found} {expected}");
    }
}

#[test]
fn a_wild_start_and_wild_exchanges_are_thrown_out_and_good_fixes_kept() {
    let wild = |i: usize| i < 2 || i % 9 == 4;
    let track = cleaned(&fixes(|i, _| if wild(i) { [40.0, -30.0, 10.0 * i as f64] } else { [0.0; 3] }));
    assert!(error(&track) < 2.0, "{}", error(&track));
    for (n, judged) in track.judged.iter().enumerate() {
        assert_eq!(judged.cycle, n / 4);
        if wild(n / 4) {
            assert_eq!((judged.verdict, judged.reason), (Verdict::Wild, Reason::OffAsCycle), "{n}");
            assert!(judged.residual_sigmas > 5.0, "{judged:?}");
        }
    }
    let lost =
        track.judged.iter().enumerate().filter(|(n, j)| !wild(n / 4) && j.verdict != Verdict::Kept).count();
    assert!(lost <= 4, "{lost}");
    assert!(track.warnings.is_empty(), "{:?}", track.warnings);
}

#[test]
fn a_fix_that_is_wild_by_itself_costs_its_exchange_nothing() {
    let track = cleaned(&fixes(|i, k| if k == i % 3 { [0.0, 60.0, 0.0] } else { [0.0; 3] }));
    assert!(error(&track) < 1.8, "{}", error(&track));
    let (mut by_itself, mut lost) = (0, 0);
    for (n, judged) in track.judged.iter().enumerate() {
        if n % 4 == n / 4 % 3 {
            assert_eq!(judged.verdict, Verdict::Wild, "{n}");
            by_itself += usize::from(judged.reason == Reason::OffByItself);
        } else {
            lost += usize::from(judged.verdict != Verdict::Kept);
        }
    }
    // the vehicle turns on the spot once, and an exchange there is hard to believe
    assert!(by_itself >= 88 && lost <= 9, "{by_itself} {lost}");
}

#[test]
fn duplicates_are_flagged_once_and_late_messages_change_nothing() {
    let given = fixes(|_, _| [0.0; 3]);
    let track = cleaned(&given);
    let mut mixed = given.clone();
    mixed.push(given[17]);
    mixed.swap(40, 44);
    let again = cleaned(&mixed);
    assert_eq!(again.judged[360].reason, Reason::Repeated);
    assert!(again.judged[360].late && again.judged[44].late && !again.judged[45].late);
    assert_eq!(again.judged.iter().filter(|j| j.verdict == Verdict::Duplicate).count(), 1);
    assert_eq!(track.at(777.0), again.at(777.0));
}

#[test]
fn positions_that_a_system_holds_are_taken_once() {
    let given = fixes(|_, k| if k == 3 { [0.0, 0.0, 80.0] } else { [0.0; 3] });
    let again = given.iter().flat_map(|f| [0.0, 0.1, 0.2].map(|s| Sample { time_s: f.time_s + s, ..*f }));
    // the last one is held until the next exchange
    let held: Vec<Sample> = again
        .chain(
            given
                .iter()
                .skip(3)
                .step_by(4)
                .flat_map(|f| (1..17).map(|s| Sample { time_s: f.time_s + f64::from(s), ..*f })),
        )
        .collect();
    let (track, once) = (cleaned(&held), cleaned(&given));
    let repeated = track.judged.iter().filter(|j| j.reason == Reason::Repeated).count();
    assert_eq!(repeated, held.len() - given.len());
    assert_eq!(track.at(777.0), once.at(777.0));
    let told = Warning::Held { held: repeated, of: held.len() };
    assert!(
        track.warnings.contains(&told) && !once.warnings.iter().any(|w| matches!(w, Warning::Held { .. }))
    );
    let one: Vec<Sample> = given.iter().map(|f| Sample { value: given[0].value, ..*f }).collect();
    let error = clean(&one, &[], &Settings::default()).expect_err("nothing moves");
    assert_eq!(error, EstimateError::Held { held: 359, of: 360 });
}

#[test]
fn bursts_of_one_instant_and_long_silences_come_to_an_end() {
    let at = |i: usize| 20.0 * i as f64 + if i > 30 { 1e6 } else { 0.0 };
    let burst = |i: usize| {
        let value = truth(20.0 * i as f64);
        (0..64).map(move |k| Sample {
            time_s: at(i),
            value: value.map(|v| v + f64::from(k % 7)),
            sigma: [3.0; 3],
        })
    };
    let given: Vec<Sample> = (0..60).flat_map(burst).collect();
    let heights: Vec<Height> = (0..60)
        .map(|i| Height { time_s: at(i), z_m: truth(20.0 * i as f64)[2] + 3.0, sigma_m: 1.0 })
        .collect();
    for heights in [&heights[..], &[]] {
        let state =
            clean(&given, heights, &Settings::default()).expect("a track").at(400.0).expect("a state");
        assert!((0..3).all(|a| (state.position[a] - truth(400.0)[a] - 3.0).abs() < 2.0), "{state:?}");
    }
}

#[test]
fn a_depth_sensor_throws_out_what_has_another_height_and_carries_the_height_through_silence() {
    let heights: Vec<Height> = (0..1800)
        .map(f64::from)
        .map(|time_s| Height { time_s, z_m: truth(time_s)[2], sigma_m: 0.5 })
        .collect();
    let heard: Vec<Sample> = fixes(|i, _| if i % 10 == 3 { [0.0, 0.0, 25.0] } else { [0.0; 3] })
        .into_iter()
        .filter(|f| !(800.0..1100.0).contains(&f.time_s))
        .collect();
    let track = clean(&heard, &heights, &Settings::default()).expect("a track");
    assert!(track.judged.iter().any(|j| j.reason == Reason::OffDepth));
    let middle = track.at(950.0).expect("a state");
    assert!(
        (middle.position[2] - truth(950.0)[2]).abs() < 1.0 && middle.position_sigma[2] < 1.0,
        "{middle:?}"
    );
    assert!(middle.position_sigma[0] > 3.0, "{middle:?}");
}

#[test]
fn a_wrong_stated_noise_is_found_and_told() {
    for factor in [0.25, 0.5, 3.0] {
        let mut given = fixes(|_, _| [0.0; 3]);
        given.iter_mut().for_each(|f| f.sigma = [3.0 * factor; 3]);
        let track = cleaned(&given);
        assert!(track.noise_scale.iter().all(|s| (s * factor - 1.0).abs() < 0.15), "{:?}", track.noise_scale);
        assert!(track.warnings.iter().any(|w| matches!(w, Warning::Noise { .. })));
        assert!(error(&track) < 1.8, "{factor}: {}", error(&track));
    }
}

#[test]
fn another_origin_of_time_and_place_moves_the_track_along() {
    let given = fixes(|i, k| if (i + k) % 5 == 0 { [50.0, 0.0, 20.0] } else { [0.0; 3] });
    let track = cleaned(&given);
    let moved: Vec<Sample> = given
        .iter()
        .map(|f| Sample { time_s: f.time_s + 4096.0, value: f.value.map(|v| v + 1024.0), ..*f })
        .collect();
    let other = cleaned(&moved);
    for t in [5.0, 500.0, 1234.0] {
        let (a, b) = (track.at(t).expect("a state"), other.at(t + 4096.0).expect("a state"));
        for axis in 0..3 {
            assert!((a.position[axis] + 1024.0 - b.position[axis]).abs() < 1e-5);
            assert!((a.position_sigma[axis] - b.position_sigma[axis]).abs() < 1e-6);
        }
    }
}

#[test]
fn data_that_cannot_carry_a_track_are_told_by_an_error_or_a_warning() {
    let nan = vec![Sample { time_s: 0.0, value: [f64::NAN; 3], sigma: [1.0; 3] }; 9];
    assert!(matches!(clean(&nan, &[], &Settings::default()), Err(EstimateError::BadNumber { .. })));
    let few = &fixes(|_, _| [0.0; 3])[..6];
    assert!(matches!(clean(few, &[], &Settings::default()), Err(EstimateError::TooFewSamples { .. })));
    assert!(clean(&[], &[], &Settings::default()).is_err());
    // half of the exchanges are elsewhere, and agree with each other
    let split = cleaned(&fixes(|i, _| if i % 2 == 0 { [0.0; 3] } else { [80.0, 0.0, 0.0] }));
    assert!(
        split.warnings.iter().any(|w| matches!(w, Warning::ManyWildCycles { .. })),
        "{:?}",
        split.warnings
    );
    // nothing agrees with anything
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    let chaos: Vec<Sample> = (0..200)
        .map(|i| Sample {
            time_s: 20.0 * f64::from(i),
            value: [0; 3].map(|_| 400.0 * noise()),
            sigma: [3.0; 3],
        })
        .collect();
    assert!(clean(&chaos, &[], &Settings::default()).map_or(true, |track| !track.warnings.is_empty()));
}

#[test]
fn many_fixes_at_one_instant_are_no_trouble() {
    let mut given = fixes(|_, _| [0.0; 3]);
    given.extend((0..50).map(|k| Sample {
        time_s: 400.0,
        value: truth(400.0).map(|v| v + f64::from(k % 5)),
        sigma: [3.0; 3],
    }));
    let state = cleaned(&given).at(400.0).expect("a state");
    assert!((0..3).all(|a| (state.position[a] - truth(400.0)[a]).abs() < 5.0 && state.position_sigma[a].is_finite()));
}

#[test]
fn noise_grows_with_range_from_what_it_is_close_by() {
    assert_eq!(sigma_at_range(3.0, 0.01, 0.0), 3.0);
    assert!((sigma_at_range(3.0, 0.01, 400.0) - 5.0).abs() < 1e-12);
}

#[test]
fn a_lower_speed_limit_makes_a_leap_wild() {
    // for two minutes the fixes are where a vehicle would have to fly to
    let given = fixes(|i, _| if (30..36).contains(&i) { [150.0, 0.0, 0.0] } else { [0.0; 3] });
    let wild = |speed_limit_m_s: f64| {
        let settings = Settings { speed_limit_m_s, ..Settings::default() };
        let track = clean(&given, &[], &settings).expect("a track");
        track.judged[120..144].iter().filter(|j| j.verdict == Verdict::Wild).count()
    };
    assert!(wild(1.5) == 24 && wild(40.0) < 12, "{} {}", wild(1.5), wild(40.0));
}
