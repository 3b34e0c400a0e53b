//! The main job on samples: sources in, one track out, with everything that a report says of it.
//!
//! 1. Who sees what when ([`coverage`]); a silence longer than `bridge_max_s` cuts the log into pieces.
//! 2. Sources are registered to the datum ([`registration`]); what follows sees them without their errors. Each piece is fitted by the method that was asked for.
//! 3. Where sources overlap they are held against each other ([`agreement`]); where they weren't
//!    registered, what they differ by widens the bands.
//! 4. The last piece is carried on ([`extrapolation`]), and once more the paper's plain way.
//! 5. Characteristic points are looked up on the track.

mod bands;
mod carried;
mod pieces;
mod registered;
pub mod usbl;

use bands::{Bands, Unregistered, warn_of_disagreement, warn_of_misfit};
use carried::Carried;
use pieces::{Piece, fit_pieces};
use registered::register_pieces;

use crate::estimate::agreement::{self, Disagreement};
use crate::estimate::characteristic_point::{self, CharacteristicPoint, Height};
use crate::estimate::coverage::{self, Coverage};
use crate::estimate::extrapolation::{self, Holdout, Law};
use crate::estimate::registration::{self, Registered};
use crate::estimate::{self, EstimateError};
use crate::estimate::{Coefficients, Estimator};
use crate::quality::{self, PhaseSummary, Residual};
use crate::sample::Source;
use crate::time::Time;
use crate::track::{Curve, Track, TrackPoint};

/// What is to be done, every default resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The instant that the samples' seconds count from.
    pub origin: Time,
    /// The frame of the coordinates.
    pub frame_id: String,
    /// Points of the track a second.
    pub rate_hz: f64,
    /// Index of the source whose errors are zero by definition.
    pub datum: usize,
    /// The estimator.
    pub method: Estimator,
    /// SFF and PCF: whether velocity is the derivative of position.
    pub coefficients: Coefficients,
    /// SFF: knot spacing, s.
    pub knot_spacing_s: Option<f64>,
    /// PCF: order.
    pub order: usize,
    /// Moving average: points.
    pub window_points: usize,
    /// What is registered between sources; `None` for nothing.
    pub registration: Option<registration::Settings>,
    /// The longest silence of all sources that is bridged, s.
    pub bridge_max_s: f64,
    /// How to carry the track on; `None` for not at all.
    pub extrapolation: Option<extrapolation::Settings>,
    /// Height at which the extrapolation stops, m.
    pub stop_z_m: Option<f64>,
    /// Characteristic points to look for.
    pub heights: Vec<Height>,
}

impl Plan {
    /// Whether the spline that the sources are registered with is the track.
    fn is_registered_spline(&self) -> bool {
        let shared = self.coefficients == Coefficients::Shared;
        self.method == Estimator::Sff && shared && self.registration.is_some()
    }
}

/// What SFF chose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplineSummary {
    /// Number of knots of the last piece, and their spacing, s.
    pub knots: (usize, f64),
    /// Weight of the jerk penalty by axis, 1/m^2.
    pub lambda: [f64; 3],
    /// Residuals over sigmas by axis: 1 where the sigmas are right.
    pub noise_scale: [f64; 3],
}

/// The track and what is to be said of it.
#[derive(Clone, Debug, Default)]
pub struct Fusion {
    /// The fused track with its extrapolation.
    pub track: Track,
    /// The paper's plain order-4 extrapolation, for comparison; no points where there is none.
    pub plain_pcf: Track,
    /// Characteristic points that were reached.
    pub events: Vec<CharacteristicPoint>,
    /// Pieces that were fitted, s since the origin.
    pub pieces: Vec<(f64, f64)>,
    /// Who saw what when.
    pub coverage: Coverage,
    /// How far the samples lie from the track.
    pub residuals: Vec<Residual>,
    /// The track phase by phase.
    pub phases: Vec<PhaseSummary>,
    /// The sources' errors, where they were registered.
    pub registered: Option<Registered>,
    /// How the sources differ where they overlap: what is left after the registration, if there was one.
    pub disagreements: Vec<Disagreement>,
    /// What SFF chose, where SFF it was.
    pub spline: Option<SplineSummary>,
    /// The laws that the track could be carried on by; the one that was taken stands first.
    pub laws: Vec<TriedLaw>,
    /// What a person must read, a sentence each.
    pub warnings: Vec<String>,
}

/// A law, and how it did from earlier instants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriedLaw {
    /// The law.
    pub law: Law,
    /// How it did.
    pub holdout: Holdout,
    /// Whether it would clearly have been better than the one that was taken.
    pub clearly_better: bool,
}

/// Fuses `sources`, each in order of time.
///
/// # Errors
/// [`EstimateError::BadNumber`] as [`estimate::check`]; that of the first piece when no piece can be fitted.
pub fn fuse(sources: &[Source], plan: &Plan) -> Result<Fusion, EstimateError> {
    estimate::check(sources)?;
    let mut warnings = Vec::new();
    let mut registered = None;
    let corrected;
    let mut sources = sources;
    if let Some((kept, found)) = register_pieces(sources, plan, &mut warnings)? {
        corrected = found.corrected(&kept);
        sources = &corrected;
        registered = Some(found);
    }
    let coverage = Coverage::of(sources);
    if let Some(registered) = &mut registered {
        registered.curve.cover(&coverage.pieces(plan.bridge_max_s));
    }
    let curve = registered.as_ref().map(|r| &r.curve);
    let pieces = fit_pieces(sources, &coverage, plan, curve, &mut warnings)?;

    let disagreements = agreement::compare(sources, &coverage);
    let bands = if let Some(registered) = &registered {
        registered::warn(sources, registered, &disagreements, &mut warnings);
        Bands::Registered { registered, is_track: plan.is_registered_spline() }
    } else {
        warn_of_disagreement(sources, &disagreements, &mut warnings);
        warn_of_misfit(&pieces, &disagreements, &mut warnings);
        Bands::Unregistered(Unregistered::of(sources, &coverage, &disagreements, plan))
    };

    let mut points = Vec::new();
    let mut last_s = 0.0;
    for piece in &pieces {
        let seen = observed(piece, &coverage, &bands, plan);
        if seen.is_empty() {
            warnings.push(format!(
                "{} gives no point between {:.2} s and {:.2} s after the origin: no source has a position there",
                plan.method.method().name(),
                piece.from_s,
                piece.to_s
            ));
        }
        last_s = seen.last().map_or(piece.to_s, |p| p.time.seconds_since(plan.origin));
        points.extend(seen);
    }
    let mut carried = Carried::default();
    if let Some((piece, settings)) = pieces.last().zip(plan.extrapolation.as_ref()) {
        carried = carried::carry_on(piece, settings, last_s, &coverage, &bands, plan, &mut warnings);
        points.append(&mut carried.points);
    }

    let track = Track { frame_id: plan.frame_id.clone(), points };
    let fitted: Vec<(&[Source], &dyn Curve)> = pieces.iter().map(|p| (&*p.sources, &*p.curve)).collect();
    let residuals = quality::residuals(&fitted, plan.origin, &coverage);
    drop(fitted);
    let spline = pieces.last().and_then(|p| p.spline);
    let spans = pieces.iter().map(|p| (p.from_s, p.to_s)).collect();
    // they borrow the registered curve: a copy of it takes more than the samples
    drop(pieces);
    Ok(Fusion {
        events: events(&track, plan, &mut warnings),
        phases: quality::phases(&track, plan.origin, &residuals),
        residuals,
        plain_pcf: Track { frame_id: plan.frame_id.clone(), points: carried.plain },
        track,
        spline,
        pieces: spans,
        coverage,
        registered,
        disagreements,
        laws: carried.laws,
        warnings,
    })
}

/// The points of a piece between its first and last sample.
fn observed(piece: &Piece<'_>, coverage: &Coverage, bands: &Bands<'_>, plan: &Plan) -> Vec<TrackPoint> {
    let point = |time_s| {
        let seen_by = coverage.seen_by(time_s);
        Some(TrackPoint {
            time: plan.origin.plus_seconds(time_s),
            state: bands.widen(piece.curve.at(time_s)?, time_s, seen_by, Coverage::phase(seen_by)),
            phase: Coverage::phase(seen_by),
            method: plan.method.method(),
            seen_by,
        })
    };
    let mut points: Vec<TrackPoint> =
        grid(piece.from_s, piece.to_s, plan.rate_hz).filter_map(point).collect();
    difference_velocities(&mut points, 1.5 / plan.rate_hz);
    points
}

/// Characteristic points that the track reaches; a warning for each that it doesn't.
fn events(track: &Track, plan: &Plan, warnings: &mut Vec<String>) -> Vec<CharacteristicPoint> {
    let mut events = Vec::new();
    for height in &plan.heights {
        match characteristic_point::first_crossing(track, height, 1.5 / plan.rate_hz) {
            Some(event) => events.push(event),
            None => warnings.push(format!(
                "characteristic point {:?}: the track never rises through z = {} m; it is left out",
                height.name, height.z_m
            )),
        }
    }
    events
}

/// Instants from `from_s` on, `1 / rate_hz` apart, up to `to_s`.
fn grid(from_s: f64, to_s: f64, rate_hz: f64) -> impl Iterator<Item = f64> {
    // a last sample that a clock offset moved by microseconds still counts
    let count = ((to_s - from_s) * rate_hz + 1e-3).floor().max(0.0) as usize;
    (0..=count).map(move |i| (from_s + i as f64 / rate_hz).min(to_s))
}

/// Gives points without an acceleration the difference of their neighbours' velocities, as the paper does; none
/// to a point without neighbours within `max_step_s`.
fn difference_velocities(points: &mut [TrackPoint], max_step_s: f64) {
    let slope = |i: usize| {
        let near = |j: usize| {
            let neighbour = points.get(j)?;
            let step_s = neighbour.time.seconds_since(points[i].time).abs();
            (step_s <= max_step_s).then_some(neighbour)
        };
        let (a, b) =
            (i.checked_sub(1).and_then(near).unwrap_or(&points[i]), near(i + 1).unwrap_or(&points[i]));
        let dt = b.time.seconds_since(a.time);
        let difference = |axis| (b.state.velocity[axis] - a.state.velocity[axis]) / dt;
        (dt > 0.0).then(|| std::array::from_fn(difference))
    };
    let slopes: Vec<Option<[f64; 3]>> = (0..points.len()).map(slope).collect();
    for (point, slope) in points.iter_mut().zip(slopes) {
        point.state.acceleration = point.state.acceleration.or(slope);
    }
}

/// The rate of the fastest source, Hz: what the track's defaults to.
#[must_use]
pub fn fastest_rate_hz(sources: &[Source]) -> Option<f64> {
    let intervals = sources.iter().filter_map(coverage::median_interval_s);
    intervals.reduce(f64::min).map(|s| s.recip().clamp(1e-3, 1e4))
}
