//! Zhang 2025, figures 3-5: PCF of orders 3, 5, 12 and 48; Runge's oscillation, and what rounding adds to it.
//!
//! On the simulator's steep climb with noise, no systematic errors: what is off is the polynomial's alone.

use trackfuse::estimate::Coefficients;
use trackfuse::math::robust;
use trackfuse::sample::Source;
use trackfuse::track::Curve;

use super::markdown;
use super::raw_time;
use super::table_1::rmse;
use super::tracks::pcf;
use super::trial::{FRAMES, Trial, Z, time_s};

/// Climbs that the medians are over.
const CLIMBS: u64 = 20;
/// Instants that a fit is looked at, ten a frame: between samples too.
const INSTANTS: usize = 10 * (FRAMES - 1);

/// Height and vertical speed at an instant.
type Fitted = Box<dyn Fn(f64) -> (f64, f64)>;

/// A way to fit.
pub(crate) struct Fit {
    pub(crate) name: &'static str,
    make: fn(&Source) -> Fitted,
}

/// The ways that are compared.
pub(crate) const FITS: [Fit; 8] = [
    Fit { name: "order 3", make: |fused| sound(fused.clone(), 3) },
    Fit { name: "order 5", make: |fused| sound(fused.clone(), 5) },
    Fit { name: "order 12", make: |fused| sound(fused.clone(), 12) },
    Fit { name: "order 48", make: |fused| sound(fused.clone(), 48) },
    Fit {
        name: "order 48, positions alone",
        make: |fused| sound(Source { velocities: Vec::new(), ..fused.clone() }, 48),
    },
    Fit { name: "order 48, position and velocity apart", make: |fused| apart(fused, 48) },
    Fit { name: "order 12, eq. 6 as printed", make: |fused| printed(fused, 12) },
    Fit { name: "order 48, eq. 6 as printed", make: |fused| printed(fused, 48) },
];

/// Chebyshev polynomials and QR: the library's.
fn sound(fused: Source, order: usize) -> Fitted {
    let fitted = pcf(&[fused], order, Coefficients::Shared);
    Box::new(move |t| height_and_speed(&fitted, t))
}

fn height_and_speed(curve: &dyn Curve, t: f64) -> (f64, f64) {
    curve.at(t).map_or((f64::NAN, f64::NAN), |s| (s.position[Z], s.velocity[Z]))
}

/// The same, with a polynomial for the position and another for the velocity, as Table 1 has them.
fn apart(fused: &Source, order: usize) -> Fitted {
    let fitted = pcf(std::slice::from_ref(fused), order, Coefficients::Independent);
    Box::new(move |t| height_and_speed(&fitted, t))
}

/// Powers of raw time and the inverse of the normal matrix.
fn printed(fused: &Source, order: usize) -> Fitted {
    let coefficients = raw_time::fit(fused, order);
    Box::new(move |t| raw_time::at(&coefficients, t))
}

/// Instant (s), error of height (m) and of vertical speed (m/s).
pub(crate) type Error = (f64, f64, f64);

/// The errors of one way on one climb.
pub(crate) fn errors(fit: &Fit, trial: &Trial) -> Vec<Error> {
    let made = (fit.make)(&trial.fused()[0]);
    let end_s = time_s(FRAMES - 1);
    let instants = (0..=INSTANTS).map(|i| end_s * i as f64 / INSTANTS as f64);
    instants
        .map(|t| {
            let ((z, v), truth) = (made(t), trial.truth(t));
            (t, z - truth.z, v - truth.v)
        })
        .collect()
}

/// How far one way is from the truth, medians over the climbs.
pub(crate) struct Row {
    pub(crate) name: &'static str,
    /// Over the whole climb, m and m/s.
    pub(crate) rms: [f64; 2],
    /// The worst in the first and the last twentieth, m and m/s.
    pub(crate) ends: [f64; 2],
    /// The worst between those, m and m/s.
    pub(crate) middle: [f64; 2],
}

/// All ways.
pub(crate) fn rows() -> Vec<Row> {
    let trials: Vec<Trial> = (1..=CLIMBS).map(|seed| Trial::steep(seed, 1.0, false)).collect();
    FITS.iter()
        .map(|fit| {
            let runs: Vec<Vec<Error>> = trials.iter().map(|trial| errors(fit, trial)).collect();
            let median = |f: &dyn Fn(&[Error]) -> f64| {
                robust::median(&mut runs.iter().map(|run| f(run)).collect::<Vec<_>>()).unwrap_or(f64::NAN)
            };
            let both = |f: &dyn Fn(&[f64]) -> f64| {
                [
                    median(&|run| f(&run.iter().map(|e| e.1).collect::<Vec<_>>())),
                    median(&|run| f(&run.iter().map(|e| e.2).collect::<Vec<_>>())),
                ]
            };
            let twentieth = INSTANTS / 20;
            let worst = |errors: &[f64]| errors.iter().fold(0.0, |w: f64, e| w.max(e.abs()));
            Row {
                name: fit.name,
                rms: both(&|e| rmse(e.iter().copied())),
                ends: both(&|e| worst(&e[..twentieth]).max(worst(&e[e.len() - twentieth..]))),
                middle: both(&|e| worst(&e[twentieth..e.len() - twentieth])),
            }
        })
        .collect()
}

/// The page's table of errors.
pub(crate) fn table() -> String {
    let cells = |Row { name, rms, ends, middle }| {
        let [a, b, c, d, e, f] = [rms[0], ends[0], middle[0], rms[1], ends[1], middle[1]].map(two_digits);
        [String::from(name), a, b, c, d, e, f]
    };
    let head = [
        "",
        "rms, m",
        "worst at the ends, m",
        "worst between, m",
        "rms, m/s",
        "worst at the ends, m/s",
        "worst between, m/s",
    ];
    markdown::table(head, rows().into_iter().map(cells))
}

/// The page's table of condition numbers.
pub(crate) fn condition_table() -> String {
    let row = |order: usize| {
        let found = raw_time::conditions(order);
        [order.to_string(), format!("{:.0e}", found.raw), format!("{:.0}", found.chebyshev)]
    };
    let head = ["order", "powers of time in s", "Chebyshev polynomials on [-1, 1]"];
    markdown::table(head, [3, 5, 12, 48].map(row))
}

/// A number to two digits that count, of those before the third decimal.
fn two_digits(value: f64) -> String {
    let magnitude = value.log10().floor() as i32;
    match magnitude {
        3.. => format!("{value:.0e}"),
        2 => format!("{:.0}", 10.0 * (0.1 * value).round()),
        _ => format!("{value:.decimals$}", decimals = (1 - magnitude).clamp(0, 3) as usize),
    }
}
