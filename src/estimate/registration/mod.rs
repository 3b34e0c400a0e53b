//! Registration: the sources' systematic errors, solved jointly with the spline.
//!
//! Plain fusion carries the sensors' disagreement straight into the track. Here each source s but the datum has
//! errors of its own, at its true sampling time t:
//!
//! ```text
//! stamp    = t + tau
//! position = q + R (p(t) - q + b + r (t - t_m) + c (p(t) - q)) + noise
//! velocity = R ((1 + c) v(t) + r + w) + noise
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | p, v | the spline and its derivative | 3 | m, m/s |
//! | b, r | bias of the position at t_m, and its drift | 3 | m, m/s |
//! | w | velocity bias | 3 | m/s |
//! | tau | clock offset, positive where stamps are late | 1 | s |
//! | c | scale error | 1 | - |
//! | R | rotation about the vertical, used only if the evidence asks for it | 1 | rad |
//! | t_m, q | anchor: the middle of the overlap, or of the gap, and the track's point there | 1, 3 | s, m |
//!
//! Zhang 2025 has no registration, and says so. Steps, by turns until nothing moves: linear about the last estimate;
//! smoothing; solution; noise levels and weights. At the end the unknowns are averaged over the models.
//! The parts, each in a file of its own:
//!
//! | file | what |
//! |---|---|
//! | `model` | the equations above, linear about the last estimate (Gauss-Newton) |
//! | `normal`, `bordered` | an arrowhead system, its banded blocks eliminated by the Schur complement; the curve's posterior covariance holds the border's share |
//! | `smoothing` | the jerk's weight by restricted maximum likelihood (Wood 2011) |
//! | `adaptive` | the same in time: smaller where the motion is sharp (Wood, Fasiolo 2017) |
//! | `noise`, `residuals` | noise levels as variance components, outliers by a mixture of scales, correlated noise widens |
//! | `selection` | which errors there are, by evidence, averaged (MacKay 1992; Madigan, Raftery 1994) |
//! | `separation` | which unknowns the data can tell apart |
//! | `clock`, `rotation` | where to begin with a clock that is far off, and with a turned frame (Procrustes); axes that are mirrored |
//!
//! Only differences are seen: an error that all sources share, or one of the datum, stays in the track and in no
//! band.

mod adaptive;
mod bordered;
mod clock;
mod correction;
mod curve;
mod fit;
mod knots;
mod model;
mod noise;
mod normal;
mod outcome;
mod relaxation;
mod residuals;
mod rotation;
mod selection;
mod separation;
mod smoothing;
mod start;
mod unknowns;

pub use curve::RegisteredCurve;
pub use model::Anchor;
pub use noise::Level;
pub use rotation::Mirrored;
pub use separation::{Name, Separation, Unknown};
pub use unknowns::{Kind, Priors, SourceErrors};

use std::borrow::Cow;

use fit::Fit;
use start::Guess;

use super::coverage::Coverage;
use super::{EstimateError, check, spline};
use crate::sample::{Quantity, Source};

#[cfg(test)]
mod tests;

/// What may be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The kinds of errors that may be there; a rotation is looked for where the evidence asks for it.
    pub kinds: Vec<Kind>,
    /// What is thought of the errors before.
    pub priors: Priors,
    /// Whether errors that the data don't ask for are left out.
    pub select: bool,
    /// Knot spacing, s; by default the fastest source's interval, but no finer than 0.04 s.
    pub knot_spacing_s: Option<f64>,
    /// Whether outliers are looked for.
    pub robust: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            kinds: Kind::ALL.to_vec(),
            priors: Priors::default(),
            select: true,
            knot_spacing_s: None,
            robust: true,
        }
    }
}

/// A sample that is no noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rejected {
    /// Index of the source.
    pub source: usize,
    /// Which of its series.
    pub quantity: Quantity,
    /// Index in that series.
    pub index: usize,
    /// Its stamp, s.
    pub time_s: f64,
    /// How far it lies from the track, in sigmas of the noise.
    pub sigmas: f64,
}

/// The sources registered to the datum.
#[derive(Clone, Debug)]
pub struct Registered {
    /// The track as the datum would see it.
    pub curve: RegisteredCurve,
    /// The errors by source; all zero for the datum.
    pub errors: Vec<SourceErrors>,
    /// Their standard deviations.
    pub sigmas: Vec<SourceErrors>,
    /// Where drift, scale error and rotation are zero, by source.
    pub anchors: Vec<Anchor>,
    /// All errors that can act, with what is known of them.
    pub unknowns: Vec<Unknown>,
    /// The noise by source, of positions and velocities.
    pub noise: Vec<[Level; 2]>,
    /// Samples that are no noise, in order of source, quantity and time.
    pub rejected: Vec<Rejected>,
    /// Sources whose axes are no rotation of the datum's: they are left out.
    pub mirrored: Vec<Option<Mirrored>>,
    /// Number of knots.
    pub knots: usize,
    /// Weight of the jerk penalty by axis, 1/m^2; about it, the weight varies in time.
    pub lambda: [f64; 3],
    /// The logarithm of the evidence, to compare registrations of the same samples.
    pub log_evidence: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether the last of them was small.
    pub converged: bool,
}

/// A rotation must make the data this much more probable, in log, to be believed: 20 to 1 against.
const ROTATION_ODDS: f64 = 3.0;

/// A sample is rejected whose weight is below this: another scale of the mixture is more probable than the noise.
const REJECTED_WEIGHT: f64 = 0.5;

/// Registers `sources` to the one at index `datum`, on a track in `pieces`, from and to in s, in order.
///
/// A single source is smoothed. Sources that never meet have large sigmas.
///
/// # Errors
/// [`EstimateError::TooFewSamples`] below four sampling instants, [`EstimateError::BadNumber`] as [`check()`],
/// [`EstimateError::Undetermined`] where there is no position, no piece, or the data leave the curve open.
pub fn register(
    sources: &[Source],
    datum: usize,
    pieces: &[(f64, f64)],
    settings: &Settings,
) -> Result<Registered, EstimateError> {
    check(sources)?;
    let what = || "registration".to_owned();
    let got: usize = sources.iter().map(Source::len).sum();
    if got < spline::MIN_SAMPLES {
        return Err(EstimateError::TooFewSamples { what: what(), needed: spline::MIN_SAMPLES, got });
    }
    let undetermined = |why| EstimateError::Undetermined { what: what(), why };
    if sources.iter().all(|s| s.positions.is_empty()) {
        return Err(undetermined("there is no position"));
    }
    if datum >= sources.len() || pieces.is_empty() {
        return Err(undetermined("there is no datum, or no time to cover"));
    }
    let coverage = Coverage::of(sources);
    let others = || (0..sources.len()).filter(|&s| s != datum);
    let mut guesses = vec![Guess::default(); sources.len()];
    if settings.kinds.contains(&Kind::ClockOffset) {
        for source in others() {
            guesses[source].clock_offset_s =
                clock::first_offset_s(sources, datum, source, &coverage, &settings.priors);
        }
    }
    let mut mirrored = vec![None; sources.len()];
    let mut frames: Vec<(usize, rotation::Frame)> = Vec::new();
    for source in others() {
        let late = (source, guesses[source].clock_offset_s);
        mirrored[source] = rotation::mirrored(sources, datum, late, &coverage);
        if mirrored[source].is_some() {
            guesses[source] = Guess::default();
            continue;
        }
        if !settings.kinds.contains(&Kind::Rotation) {
            continue;
        }
        let found = rotation::candidates(sources, datum, late, &coverage, &settings.priors);
        match found.iter().find(|frame| frame.is_clear) {
            Some(clear) => guesses[source].frame = Some(*clear),
            None => frames.extend(found.into_iter().map(|frame| (source, frame))),
        }
    }
    let mut kept = Cow::Borrowed(sources);
    for source in others().filter(|&source| mirrored[source].is_some()) {
        kept.to_mut()[source] = Source { name: sources[source].name.clone(), ..Source::default() };
    }
    let run = |guesses: &[Guess]| Fit::run(&kept, datum, pieces, guesses, settings);
    let mut best = run(&guesses);
    for (source, frame) in frames {
        let mut turned = guesses.clone();
        turned[source].frame = Some(frame);
        let Some(tried) = run(&turned) else { continue };
        let odds = if guesses[source].frame.is_some() { 0.0 } else { ROTATION_ODDS };
        if best.as_ref().is_none_or(|b| tried.log_evidence > b.log_evidence + odds) {
            (best, guesses) = (Some(tried), turned);
        }
    }
    let fit = best.ok_or_else(|| undetermined("too few samples, or at too few instants"))?;
    let registered = fit.registered(pieces);
    let found = registered.ok_or_else(|| undetermined("too few samples, or at too few instants"))?;
    Ok(Registered { mirrored, ..found })
}
