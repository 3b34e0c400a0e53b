use std::time::Instant;
use trackfuse::estimate::spline::{self, Settings, Smoothing};
use trackfuse::sample::{Sample, Source};
use trackfuse::track::Curve;
fn main() {
    let n: usize = std::env::args().nth(1).map_or(1_000_000, |a| a.parse().unwrap());
    let mut x = 1u64;
    let mut noise = || {
        x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((x >> 33) as f64 / (1u64 << 31) as f64 - 0.5) * 0.35
    };
    let mut series = |f: fn(f64) -> f64| -> Vec<Sample> {
        (0..n)
            .map(|i| {
                let t = i as f64 * 0.01;
                Sample {
                    time_s: t,
                    value: std::array::from_fn(|a| 5.0 * f(0.7 * t + a as f64) + noise()),
                    sigma: [0.1; 3],
                }
            })
            .collect()
    };
    let s =
        [Source { name: "b".into(), positions: series(f64::sin), velocities: series(|x| 0.7 * f64::cos(x)) }];
    for sm in [Smoothing::Fixed(3.0), Smoothing::Likelihood] {
        let t = Instant::now();
        let f =
            spline::fit(&s, 0.0, (n - 1) as f64 * 0.01, &Settings { smoothing: sm, ..Settings::default() })
                .unwrap();
        let a = t.elapsed();
        let v: f64 = s[0]
            .positions
            .iter()
            .filter_map(|p| f.at(p.time_s))
            .map(|s| s.position[2] + s.position_sigma[2])
            .sum();
        println!(
            "{sm:?} fit {:.0} ns  eval {:.0} ns  {v} {:?} {:?}",
            a.as_nanos() as f64 / n as f64,
            (t.elapsed() - a).as_nanos() as f64 / n as f64,
            f.lambda(),
            f.noise_scale()
        );
    }
}
