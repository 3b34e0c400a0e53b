//! What the fixes of an exchange have in common is found, and not averaged away.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::estimate::usbl::{Cleaned, Settings, clean};
use crate::sample::Sample;
use crate::track::Curve;

/// 120 exchanges of four fixes of a vehicle that sinks evenly, with 1 m of noise of their own and `common_m` in common.
fn cleaned(common_m: f64) -> Cleaned {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut fixes = Vec::new();
    for i in 0..120 {
        let common: [f64; 3] = std::array::from_fn(|_| common_m * normal());
        for k in 0..4 {
            let time_s = 20.0 * f64::from(i) + 0.5 * f64::from(k);
            let value = std::array::from_fn(|a| place(time_s)[a] + common[a] + normal());
            fixes.push(Sample { time_s, value, sigma: [common_m.hypot(1.0); 3] });
        }
    }
    clean(&fixes, &[], &Settings::default()).expect("a track")
}

fn place(time_s: f64) -> [f64; 3] {
    [0.4 * time_s, 30.0 * (time_s / 300.0).sin(), -0.6 * time_s]
}

/// The mean square of errors over sigmas.
fn normalised(track: &Cleaned) -> f64 {
    let times = (20..2360).step_by(5).map(f64::from);
    let squares = times.flat_map(|t| {
        let state = track.at(t).expect("inside");
        [0, 1, 2].map(|a| ((state.position[a] - place(t)[a]) / state.position_sigma[a]).powi(2))
    });
    let squares: Vec<f64> = squares.collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

#[test]
fn noise_that_an_exchange_has_in_common_widens_the_bands() {
    let track = cleaned(4.0);
    let share = normalised(&track);
    assert!((0.3..1.8).contains(&share), "{share}");
    assert!(track.common_m.iter().all(|c| (3.0..5.0).contains(c)), "{:?}", track.common_m);
    assert!(track.noise_scale.iter().all(|s| (0.8..1.2).contains(s)), "{:?}", track.noise_scale);
}

#[test]
fn where_nothing_is_in_common_next_to_nothing_is_found() {
    let track = cleaned(0.0);
    assert!(track.common_m.iter().all(|c| *c < 0.3), "{:?}", track.common_m);
    let share = normalised(&track);
    assert!((0.3..1.8).contains(&share), "{share}");
}
