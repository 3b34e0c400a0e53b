//! What the registration found, for the report.

use std::fmt::{self, Write};

use schemars::JsonSchema;
use serde::Serialize;

use crate::estimate::registration::{Kind, Name, Registered, Rejected, Separation};
use crate::printable::printable;
use crate::sample::{Quantity, Source};

/// The sources' errors against the datum, and what their samples leave.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RegistrationReport {
    /// Whether the last step was small.
    pub converged: bool,
    /// Steps that were taken.
    pub iterations: usize,
    /// Number of knots of the spline.
    pub knots: usize,
    /// The errors that can act.
    pub unknowns: Vec<UnknownReport>,
    /// The noise, one a source and quantity.
    pub noise: Vec<NoiseReport>,
    /// Samples that were rejected as outliers, the first thousand.
    pub rejected: Vec<RejectedReport>,
}

/// An error of a source against the datum.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct UnknownReport {
    /// The source.
    pub source: String,
    /// `bias`, `drift`, `velocity-bias`, `clock-offset`, `scale` or `rotation`.
    pub kind: Kind,
    /// `x`, `y` or `z`; null where it has no axis.
    pub axis: Option<String>,
    /// Its value, in `unit`; of a bias that at `anchor_s`.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// `m`, `m/s`, `s`, `rad`; empty for a share.
    pub unit: String,
    /// Its standard deviation before anything was known.
    pub prior_sigma: f64,
    /// How probable it is that there is an error of this kind at all.
    pub probability: f64,
    /// `separate`; `only-together` with `strongest`, their combination being known and each alone not; `at-prior`, where the
    /// data say next to nothing.
    pub separation: String,
    /// The unknown that it is most correlated with.
    pub strongest: Option<String>,
    /// That correlation.
    pub correlation: Option<f64>,
}

/// The noise of a source's positions or velocities.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NoiseReport {
    /// The source.
    pub source: String,
    /// `position` or `velocity`.
    pub quantity: String,
    /// Its standard deviation over the one that was stated or estimated before.
    pub scale: f64,
    /// Correlation from one sample to the next: it widens the bands.
    pub correlation: f64,
    /// Samples that were rejected as outliers.
    pub rejected: usize,
    /// All samples.
    pub samples: usize,
}

/// A sample that was rejected as an outlier.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RejectedReport {
    /// The source.
    pub source: String,
    /// `position` or `velocity`.
    pub quantity: String,
    /// Its stamp, s since T0.
    pub time_s: f64,
    /// How far it lies from the track, in sigmas of the noise.
    pub sigmas: f64,
}

impl RegistrationReport {
    /// Puts the report together; `since_t0` turns a sample's seconds into those since T0.
    pub(super) fn new(found: &Registered, sources: &[&Source], since_t0: impl Fn(f64) -> f64) -> Self {
        const SHOWN: usize = 1000;
        let name = |s: usize| sources[s].name.clone();
        let unknowns = found.unknowns.iter().map(|u| UnknownReport {
            source: name(u.name.source),
            kind: u.name.kind,
            axis: u.name.axis.map(|axis| AXES[axis].to_owned()),
            value: u.value,
            sigma: u.sigma,
            unit: u.name.kind.unit().into(),
            prior_sigma: u.prior_sigma,
            probability: u.probability,
            separation: match u.separation {
                Separation::Separate => "separate",
                Separation::OnlyTogether => "only-together",
                Separation::AtPrior => "at-prior",
            }
            .into(),
            strongest: u.strongest.map(|(other, _)| in_words(other, &name(other.source))),
            correlation: u.strongest.map(|(_, r)| r),
        });
        let noise = |s: usize, q: Quantity| {
            let of = |r: &&Rejected| (r.source, r.quantity) == (s, q);
            NoiseReport {
                source: name(s),
                quantity: q.name().into(),
                scale: found.noise[s][q as usize].scale,
                correlation: found.noise[s][q as usize].correlation,
                rejected: found.rejected.iter().filter(of).count(),
                samples: sources[s].series(q).len(),
            }
        };
        let rejected = found.rejected.iter().take(SHOWN).map(|r| RejectedReport {
            source: name(r.source),
            quantity: r.quantity.name().into(),
            time_s: since_t0(r.time_s),
            sigmas: r.sigmas,
        });
        Self {
            converged: found.converged,
            iterations: found.iterations,
            knots: found.knots,
            unknowns: unknowns.collect(),
            noise: (0..sources.len())
                .flat_map(|s| Quantity::ALL.map(|q| noise(s, q)))
                .filter(|n| n.samples > 0)
                .collect(),
            rejected: rejected.collect(),
        }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

fn in_words(name: Name, source: &str) -> String {
    let axis = name.axis.map_or(String::new(), |axis| format!(" {}", AXES[axis]));
    format!("{source}'s {}{axis}", name.kind.name())
}

/// An error that is less probable than this is not shown as one.
const NO_SIGN: f64 = 0.05;

/// A line a source and kind, with the verdicts; then the noise.
pub(super) fn write(out: &mut String, report: &RegistrationReport) -> fmt::Result {
    if report.unknowns.iter().any(|u| u.probability >= NO_SIGN) {
        writeln!(
            out,
            "{:<22} {:<14} {:<62} {:<4} is there  data tell",
            "errors of", "", "value ± sigma", ""
        )?;
    }
    let there = |u: &&UnknownReport| u.probability >= NO_SIGN;
    let shown: Vec<&UnknownReport> = report.unknowns.iter().filter(there).collect();
    let same = |a: &&UnknownReport, b: &&UnknownReport| (&a.source, a.kind) == (&b.source, b.kind);
    let mut before = "";
    for kind in shown.chunk_by(same) {
        let first = kind[0];
        // people turn things by degrees
        let (unit, per_rad) =
            if first.unit == "rad" { ("deg", 1f64.to_degrees()) } else { (first.unit.as_str(), 1.0) };
        let value =
            |u: &&UnknownReport| format!("{} ± {}", signed(per_rad * u.value), digits(per_rad * u.sigma));
        let values: Vec<String> = kind.iter().map(value).collect();
        let verdicts: Vec<&str> = kind.iter().map(|u| u.separation.as_str()).collect();
        let is_clear = kind.iter().any(|u| u.value.abs() > 3.0 * u.sigma);
        let verdict = if verdicts.iter().all(|v| *v == "at-prior") && !is_clear {
            "next to nothing".into()
        } else if let Some(u) = kind.iter().find(|u| u.separation == "only-together") {
            let axis = u.axis.as_ref().map_or(String::new(), |axis| format!("{axis} "));
            let with = u.strongest.as_deref().map_or("", printable_str);
            format!("{axis}only together with {with} ({:+.2})", u.correlation.unwrap_or(0.0))
        } else {
            "it".to_owned()
        };
        let source = printable(&first.source);
        let source = if before == first.source { "" } else { &source };
        writeln!(
            out,
            "{source:<22} {:<14} {:<62} {:<4} {:>6.0} %  {verdict}",
            first.kind.name(),
            values.join(", "),
            unit,
            100.0 * first.probability
        )?;
        before = &first.source;
    }
    let mut absent: Vec<String> = Vec::new();
    for u in report.unknowns.iter().filter(|u| !there(u)) {
        let text = format!("{}'s {}", printable(&u.source), u.kind.name());
        if !absent.contains(&text) {
            absent.push(text);
        }
    }
    if !absent.is_empty() {
        writeln!(out, "no sign of: {}", absent.join(", "))?;
    }
    let noise = report.noise.iter().map(|n| {
        let rejected = if n.rejected > 0 {
            format!(", {} of {} rejected", n.rejected, n.samples)
        } else {
            String::new()
        };
        let correlated =
            if n.correlation > 0.1 { format!(", correlated {:.2}", n.correlation) } else { String::new() };
        format!("{} {} x {:.2}{correlated}{rejected}", printable(&n.source), n.quantity, n.scale)
    });
    writeln!(out, "noise / sigma: {}", noise.collect::<Vec<_>>().join("; "))
}

fn printable_str(text: &str) -> &str {
    if printable(text) == text { text } else { "another" }
}

/// Two significant digits.
fn digits(v: f64) -> String {
    let places =
        if v > 0.0 && v.is_finite() { (1.0 - v.log10().floor()).clamp(0.0, 6.0) as usize } else { 3 };
    format!("{v:.places$}")
}

fn signed(v: f64) -> String {
    format!("{v:+.3}")
}
