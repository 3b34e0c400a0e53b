//! Fixes grouped by acoustic exchange.

use std::ops::Range;

use crate::math::robust;
use crate::sample::Sample;

/// Most fixes that are taken as one exchange.
pub const MOST_FIXES: usize = 16;

/// Fixes that are closer in time than this belong together, s.
pub(super) const LEAST_GAP_S: f64 = 0.2;

/// Gaps between exchanges are this many times those within, or there are no groups.
const LEAST_CONTRAST: f64 = 3.0;

/// An exchange has so many fixes at most on average, or what looks like exchanges is one stream with pauses.
const MOST_MEAN: f64 = 20.0;

/// The gap that parts two exchanges, s: the valley between gaps within and gaps between; 0 where there is none and
/// every fix stands for itself. `times_s` ascends.
///
/// The valley is where the logarithms of the gaps fall into the two groups that are tightest (Otsu 1979), so that it
/// needs no cycle time: jitter, lost cycles and a cycle time that changes leave it where it is.
#[must_use]
pub fn exchange_gap_s(times_s: &[f64]) -> f64 {
    let mut logs: Vec<f64> =
        times_s.windows(2).map(|w| w[1] - w[0]).filter(|&gap| gap > 0.0).map(f64::ln).collect();
    if logs.len() < 2 {
        return 0.0;
    }
    logs.sort_by(f64::total_cmp);
    // a silence is no other group than a lost cycle
    let cap = logs[logs.len() * 9 / 10];
    logs.iter_mut().for_each(|l| *l = l.min(cap));
    let total: f64 = logs.iter().sum();
    let (mut best, mut valley, mut below) = (0.0, 0.0, 0.0);
    let n = logs.len() as f64;
    for (i, pair) in logs.windows(2).enumerate() {
        below += pair[0];
        let count = (i + 1) as f64;
        let apart = (total - below) / (n - count) - below / count;
        let between = count * (n - count) * apart * apart;
        if between > best && pair[1] - pair[0] > 0.0 {
            let contrast = ((total - below) / (n - count) - below / count).exp();
            let mean_size = n / (n - count);
            best = between;
            valley = if contrast >= LEAST_CONTRAST && mean_size <= MOST_MEAN {
                pair[0].midpoint(pair[1]).exp()
            } else {
                0.0
            };
        }
    }
    valley
}

/// The exchanges: ranges of indices into `times_s`, which ascends, parted where the gap is above `gap_s`, and where
/// more than [`MOST_FIXES`] would come together.
#[must_use]
pub fn group(times_s: &[f64], gap_s: f64) -> Vec<Range<usize>> {
    let mut groups = Vec::new();
    let mut begin = 0;
    for i in 1..=times_s.len() {
        let ends = i == times_s.len() || times_s[i] - times_s[i - 1] > gap_s || i - begin == MOST_FIXES;
        if ends {
            groups.push(begin..i);
            begin = i;
        }
    }
    groups
}

/// The usual time from one exchange to the next, s, which is positive: `None` of fewer than two times. Exchanges of one
/// instant, which are one of too many fixes, don't count.
#[must_use]
pub fn cycle_time_s(means_s: &[f64]) -> Option<f64> {
    let mut gaps: Vec<f64> = means_s.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 0.0).collect();
    robust::median(&mut gaps)
}

/// A first guess of the noise's standard deviation over the stated one, from fixes of one exchange beside each other.
///
/// Half of the pairs may hold a wild fix, so the guess is made from the nearest quarter, and is no more than 2 either way
/// unless it is clearly so: the fit finds out.
#[must_use]
pub(super) fn first_noise_scale(fixes: &[Sample], groups: &[Range<usize>]) -> f64 {
    const CLEAR: f64 = 2.0;
    let scale = nearest_quarter(pairs(fixes, groups).map(|pair| pair_square(&pair[0], &pair[1])).collect())
        .unwrap_or(1.0);
    if (CLEAR.recip()..=CLEAR).contains(&scale) { 1.0 } else { scale.max(1e-3) }
}

/// A guess of the noise's standard deviation an axis, m, from fixes of one exchange beside each other; `None` of too few.
/// `fixes` ascend in time; their sigmas are not looked at.
#[must_use]
pub fn guessed_sigma_m(fixes: &[Sample]) -> Option<f64> {
    let times: Vec<f64> = fixes.iter().map(|f| f.time_s).collect();
    let groups = group(&times, exchange_gap_s(&times).max(LEAST_GAP_S));
    // what is sent twice has no noise of its own
    let differ = pairs(fixes, &groups).filter(|w| w[0].value != w[1].value);
    let square = |w: &[Sample]| (0..3).map(|a| (w[1].value[a] - w[0].value[a]).powi(2)).sum::<f64>() / 2.0;
    nearest_quarter(differ.map(square).collect()).filter(|sigma_m| *sigma_m > 0.0)
}

/// The noise's standard deviation over that of `fixes` by the nearest pairs of one exchange: what half of the fixes may be
/// wild for, and what all of an exchange have in common doesn't show in. `None` where there are too few pairs.
pub(super) fn noise_scale_within(
    fixes: &[Sample],
    groups: impl Iterator<Item = Range<usize>>,
) -> Option<f64> {
    /// The nearest tenth of the pairs, and that quantile of a chi-square variable of three degrees of freedom.
    const NEAREST: f64 = 0.1;
    const QUANTILE: f64 = 0.584_374_374;
    const FEWEST: usize = 20;
    /// Fixes further on than this one are no other pairs than those before.
    const FARTHEST: usize = 3;
    let pairs = groups.flat_map(|group| {
        let end = group.end;
        group.flat_map(move |i| (i + 1..end.min(i + 1 + FARTHEST)).map(move |j| (i, j)))
    });
    let mut squares: Vec<f64> = pairs.map(|(i, j)| pair_square(&fixes[i], &fixes[j])).collect();
    let nearest = robust::quantile(&mut squares, NEAREST).filter(|q| squares.len() >= FEWEST && *q > 0.0)?;
    Some((nearest / QUANTILE).sqrt())
}

/// The squared distance of two fixes over its variance.
fn pair_square(a: &Sample, b: &Sample) -> f64 {
    (0..3)
        .map(|axis| (b.value[axis] - a.value[axis]).powi(2) / (a.sigma[axis].powi(2) + b.sigma[axis].powi(2)))
        .sum()
}

/// Fixes that follow each other in one exchange.
fn pairs<'a>(fixes: &'a [Sample], groups: &'a [Range<usize>]) -> impl Iterator<Item = &'a [Sample]> {
    groups.iter().flat_map(|group| fixes[group.clone()].windows(2))
}

/// The scale of squares that are, as far as no wild fix is in them, chi-square variables of three degrees of freedom; `None`
/// of too few.
fn nearest_quarter(mut squares: Vec<f64>) -> Option<f64> {
    /// Their quarter quantile.
    const QUARTER: f64 = 1.212_532_903;
    const FEWEST: usize = 20;
    if squares.len() < FEWEST {
        return None;
    }
    robust::quantile(&mut squares, 0.25).map(|quantile| (quantile / QUARTER).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Exchanges of 3 to 6 fixes half a second apart at these times.
    fn fixes(exchanges: &[f64]) -> (Vec<f64>, Vec<usize>) {
        let sizes: Vec<usize> = (0..exchanges.len()).map(|i| 3 + i * 7 % 4).collect();
        let of = |(&t, &n): (&f64, &usize)| (0..n).map(move |k| t + 0.5 * k as f64).collect::<Vec<_>>();
        (exchanges.iter().zip(&sizes).flat_map(of).collect(), sizes)
    }

    fn found(times: &[f64]) -> Vec<usize> {
        group(times, exchange_gap_s(times)).iter().map(Range::len).collect()
    }

    #[test]
    fn cycles_are_found_in_spite_of_jitter() {
        let at = |i: u32| 20.0 * f64::from(i) + 3.0 * (f64::from(i) * 1.7).sin();
        let (times, sizes) = fixes(&(0..100).map(at).collect::<Vec<_>>());
        assert_eq!(found(&times), sizes);
    }

    #[test]
    fn cycles_are_found_where_some_are_lost_and_a_silence_lies_between() {
        let kept = (0..150).filter(|i| i % 7 != 3 && !(60..80).contains(i));
        let (times, sizes) = fixes(&kept.map(|i| 20.0 * f64::from(i)).collect::<Vec<_>>());
        assert_eq!(found(&times), sizes);
    }

    #[test]
    fn cycles_are_found_where_their_time_changes() {
        let early = (0..80).map(|i| 20.0 * f64::from(i));
        let late = (0..80).map(|i| 1600.0 + 8.0 * f64::from(i));
        let (times, sizes) = fixes(&early.chain(late).collect::<Vec<_>>());
        assert_eq!(found(&times), sizes);
    }

    #[test]
    fn a_fix_a_cycle_and_an_even_stream_are_groups_of_one() {
        for step in [20.0, 1.0] {
            let times: Vec<f64> = (0..60).map(|i| step * f64::from(i) + 0.1 * f64::from(i % 3)).collect();
            assert!(found(&times).iter().all(|&n| n == 1), "{step}: {:?}", found(&times));
        }
        let paused: Vec<f64> = (0..300).map(|i| f64::from(i) + if i > 150 { 240.0 } else { 0.0 }).collect();
        assert!(found(&paused).iter().all(|&n| n == 1));
        assert!(found(&[]).is_empty() && found(&[3.0]) == [1]);
    }

    #[test]
    fn the_noise_is_guessed_from_bursts_though_a_third_of_the_fixes_is_wild_and_some_come_twice() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut fixes = Vec::new();
        for i in 0..200 {
            for k in 0..4 {
                let time_s = 20.0 * f64::from(i) + 0.5 * f64::from(k);
                let wild = if (i * 4 + k) % 3 == 0 { 80.0 } else { 0.0 };
                let value = std::array::from_fn(|_| 0.7 * time_s + 3.0 * normal() + wild);
                fixes.extend(std::iter::repeat_n(
                    Sample { time_s, value, sigma: [1.0; 3] },
                    1 + usize::from(k == 1),
                ));
            }
        }
        let sigma_m = guessed_sigma_m(&fixes).expect("enough");
        assert!((2.5..5.5).contains(&sigma_m), "{sigma_m}");
        assert_eq!(guessed_sigma_m(&fixes[..10]), None);
    }

    #[test]
    fn the_cycle_time_is_the_usual_one() {
        assert_eq!(cycle_time_s(&[0.0, 20.0, 40.0, 280.0, 300.0]), Some(20.0));
        assert_eq!(cycle_time_s(&[0.0, 0.0, 0.0, 20.0, 20.0, 20.0, 40.0]), Some(20.0));
        assert_eq!((cycle_time_s(&[1.0]), cycle_time_s(&[1.0, 1.0])), (None, None));
    }
}
