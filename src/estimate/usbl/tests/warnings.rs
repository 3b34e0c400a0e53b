//! What is told of a track, and what isn't.

use super::super::search::Dispute;
use super::super::warnings::{MOST_AMBIGUOUS, merged};
use super::*;

/// Offsets of wild fixes by exchange and fix, which agree with nothing: none, or up to 200 m.
fn wild(share: f64) -> impl Fn(usize, usize) -> [f64; 3] {
    move |i, k| {
        let mut rng = ChaCha8Rng::seed_from_u64((4 * i + k) as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let off = [0; 3].map(|_| 100.0 * normal());
        let quantile = 0.5 * (1.0 + (normal() / 1.6).tanh());
        if quantile < share { off } else { [0.0; 3] }
    }
}

/// Another vehicle half of the time.
fn shared(_: usize, k: usize) -> [f64; 3] {
    if k.is_multiple_of(2) { [200.0, -100.0, 30.0] } else { [0.0; 3] }
}

fn stated(sigma_m: f64, mut fixes: Vec<Sample>) -> Cleaned {
    fixes.iter_mut().for_each(|f| f.sigma = [sigma_m; 3]);
    cleaned(&fixes)
}

#[test]
fn three_in_ten_wild_fixes_are_usual_and_six_in_ten_are_told() {
    let usual = cleaned(&fixes(wild(0.3)));
    assert!(usual.warnings.is_empty(), "{:?}", usual.warnings);
    let many = cleaned(&fixes(wild(0.6)));
    let told = |w: &Warning| matches!(w, Warning::ManyWildFixes { rejected, of: 360 } if *rejected > 162);
    assert!(many.warnings.iter().any(told), "{:?}", many.warnings);
}

#[test]
fn another_vehicle_among_the_fixes_is_told_and_wild_fixes_are_none() {
    let told = |track: &Cleaned| track.warnings.iter().any(|w| matches!(w, Warning::AnotherTrack { .. }));
    for share in [0.1, 0.3, 0.5] {
        assert!(!told(&cleaned(&fixes(wild(share)))), "{share}");
    }
    let both = cleaned(&fixes(shared));
    let many = both.warnings.iter().any(|w| matches!(w, Warning::ManyWildFixes { .. }));
    assert!(told(&both) && many, "{:?}", both.warnings);
    // one that is seldom heard, and moves on its own
    let seldom = |i: usize, k: usize| if k == i % 8 { [80.0 + 3.0 * i as f64, -60.0, 0.0] } else { [0.0; 3] };
    let track = cleaned(&fixes(seldom));
    assert!(told(&track) && error(&track) < 1.8, "{:?}", track.warnings);
}

#[test]
fn noise_that_is_not_that_within_exchanges_is_told_whatever_was_stated() {
    let told = |track: &Cleaned| track.warnings.iter().any(|w| matches!(w, Warning::NoiseWithin { .. }));
    let both = stated(120.0, fixes(shared));
    assert!(told(&both), "{:?}", both.warnings);
    for sigma_m in [3.0, 15.0, 50.0, 120.0] {
        let track = stated(sigma_m, fixes(wild(0.5)));
        let many = track.warnings.iter().any(|w| matches!(w, Warning::ManyWildFixes { .. }));
        assert!(many || told(&track), "{sigma_m}: {:?}", track.warnings);
    }
    for sigma_m in [1.0, 3.0, 30.0] {
        let track = stated(sigma_m, fixes(|_, _| [0.0; 3]));
        assert!(!told(&track), "{sigma_m}: {:?}", track.warnings);
    }
}

#[test]
fn a_depth_sensor_that_most_fixes_contradict_is_told_and_one_that_all_contradict_is_an_error() {
    let off = |from_s: f64, by_m: f64| {
        let height = |time_s: f64| {
            let z_m = truth(time_s)[2] - if time_s > from_s { by_m } else { 0.0 };
            Height { time_s, z_m, sigma_m: 0.5 }
        };
        clean(
            &fixes(|_, _| [0.0; 3]),
            &(0..1800).map(f64::from).map(height).collect::<Vec<_>>(),
            &Settings::default(),
        )
    };
    let told = |from_s: f64| {
        let told = |w: &Warning| match w {
            Warning::OffDepth { off, of: 360, median_m } => *off > 126 && (median_m - 40.0).abs() < 1.0,
            _ => false,
        };
        off(from_s, 40.0).expect("a track").warnings.iter().any(told)
    };
    assert!(told(900.0) && !told(1500.0));
    let error = off(-1.0, 40.0).expect_err("no fix is left");
    assert!(
        error
            .to_string()
            .starts_with("360 of 360 fixes are not at the depth sensor's depth (median: 40 m above it)")
    );
    assert_eq!(error.hint().as_deref(), Some("check sign, unit and zero of `usbl.depth`"));
}

#[test]
fn a_vehicle_above_its_speed_limit_is_told_with_the_key_to_set() {
    let towed = |_: usize, _: usize| [0.0; 3];
    let mut fast = fixes(towed);
    fast.iter_mut().for_each(|f| f.value[1] += 4.0 * f.time_s);
    let told = |limit: f64| {
        let settings = Settings { speed_limit_m_s: limit, ..Settings::default() };
        let warnings = clean(&fast, &[], &settings).expect("a track").warnings;
        warnings.into_iter().find(|w| matches!(w, Warning::Fast { .. })).map(|w| w.to_string())
    };
    let text = told(2.5).expect("a warning");
    assert!(text.starts_with("the track is faster than `usbl.speed_limit_m_s` = 2.5 at "), "{text}");
    assert_eq!(told(6.0), None);
}

#[test]
fn stretches_that_overlap_are_one_and_the_worst_are_told_in_order_of_time() {
    let dispute =
        |from: usize, to: usize, apart_m: f64, log_odds: f64| Dispute { from, to, apart_m, log_odds };
    let one = merged(vec![dispute(5, 9, 40.0, -1.0), dispute(30, 40, 9.0, -2.0), dispute(2, 6, 20.0, -0.5)]);
    let found: Vec<_> = one.iter().map(|d| (d.from, d.to, d.apart_m, d.log_odds)).collect();
    assert_eq!(found, [(2, 9, 40.0, -0.5), (30, 40, 9.0, -2.0)]);
    let many = merged((0..50).rev().map(|i| dispute(4 * i, 4 * i + 2, 30.0, -0.01 * i as f64)).collect());
    assert_eq!(many.iter().map(|d| d.from / 4).collect::<Vec<_>>(), (0..MOST_AMBIGUOUS).collect::<Vec<_>>());
    let early = Warning::Ambiguous { from_s: -0.4, to_s: 60.0, apart_m: 30.0, odds: 0.2 }.to_string();
    assert!(early.starts_with("from 0 s to 60 s "), "{early}");
}
