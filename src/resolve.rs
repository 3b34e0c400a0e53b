//! From what was asked to what is done: every default resolved for the sources at hand.

use std::collections::BTreeMap;

use crate::config::{self, Config, ExtrapolationMethod, Registration};
use crate::estimate::characteristic_point::Height;
use crate::estimate::coverage;
use crate::estimate::extrapolation::{self, Choice, Law, LawKind};
use crate::estimate::registration::{self, Kind};
use crate::estimate::usbl;
use crate::fusion::usbl::{Causal, DivePlan};
use crate::fusion::{self, Fusion, Plan};
use crate::log::Log;
use crate::math::robust;
use crate::sample::Source;
use crate::source::Loaded;
use crate::time::Time;

/// Why what was asked can't be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResolveError {
    /// The track would have more points than anyone can read.
    #[error(
        "output.rate_hz is {rate_hz}, which makes {points:.0} points over {span_s:.0} s with the extrapolation, expected \
         at most {most:.0}"
    )]
    TooManyPoints {
        /// The rate that was asked for, Hz.
        rate_hz: f64,
        /// How long the track is, s.
        span_s: f64,
        /// How many points that makes.
        points: f64,
        /// How many there may be.
        most: f64,
    },
    /// Two sources' clocks count from different epochs.
    #[error(
        "{first}'s and {second}'s clocks are of different epochs, {apart_s:.0} s apart, expected one clock"
    )]
    Epochs {
        /// The datum.
        first: String,
        /// The other source.
        second: String,
        /// How far their clocks are apart, s.
        apart_s: f64,
    },
}

impl ResolveError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::TooManyPoints { .. } => "lower `output.rate_hz` or `extrapolation.horizon_s`".into(),
            Self::Epochs { .. } => "set `time = \"log\"` for both sources".into(),
        }
    }
}

/// What is to be done for these sources; what was resolved goes back into the config, which so makes the
/// track again.
///
/// # Errors
/// [`ResolveError::TooManyPoints`] for a rate that makes a track nobody can read,
/// [`ResolveError::Epochs`] for sources whose clocks can't be put on one time line.
pub fn plan(
    config: &mut Config,
    loaded: &[Loaded],
    sources: &[Source],
    datum: usize,
    origin: Time,
    warnings: &mut Vec<String>,
) -> Result<Plan, ResolveError> {
    check_epochs(loaded, datum)?;
    let rate_hz = rate_hz(config, sources, warnings)?;
    let Config { output, fusion: fuse, extrapolation: beyond, .. } = config;
    output.rate_hz = Some(rate_hz);
    let frame_id = output.frame_id.get_or_insert_with(|| loaded[datum].frame_id.clone()).clone();
    // altitudes are above the ellipsoid, from which the sea may be a hundred metres away
    let is_altitude = loaded[datum].fix_origin.is_some();
    output.surface_at_zero.get_or_insert_with(|| !is_altitude && surface_at_zero(sources));
    let kinds = match &fuse.estimate {
        Registration::Auto(_) => Kind::ALL.to_vec(),
        Registration::List(kinds) => kinds.clone(),
    };
    let registration = (!kinds.is_empty()).then(|| registration::Settings {
        kinds,
        priors: config.registration,
        knot_spacing_s: fuse.knot_spacing_s,
        ..registration::Settings::default()
    });
    Ok(Plan {
        origin,
        frame_id,
        rate_hz,
        datum,
        method: fuse.method,
        coefficients: fuse.coefficients,
        knot_spacing_s: fuse.knot_spacing_s,
        order: fuse.order,
        window_points: fuse.window_points,
        bridge_max_s: fuse.bridge_max_s,
        registration,
        extrapolation: (beyond.horizon_s > 0.0).then(|| carrying_on(beyond, sources)),
        stop_z_m: beyond.stop_z_m,
        heights: config
            .characteristic_point
            .iter()
            .map(|p| Height { name: p.name.clone(), z_m: p.z_m })
            .collect(),
    })
}

/// Most points of a track: 14 h at 100 Hz, 3 GB of messages.
const MAX_POINTS: f64 = 5e6;

/// Most points for each sample, where the rate is not the user's: samples in bursts have a short median
/// interval that says nothing of the log.
const MAX_POINTS_PER_SAMPLE: f64 = 100.0;

/// Points a second, such that the track stays of a size that can be read.
fn rate_hz(config: &Config, sources: &[Source], warnings: &mut Vec<String>) -> Result<f64, ResolveError> {
    let pieces = coverage::Coverage::of(sources).pieces(config.fusion.bridge_max_s);
    let seen_s: f64 = pieces.iter().map(|p| p.1 - p.0).sum();
    let span_s = seen_s + config.extrapolation.horizon_s;
    if let Some(rate_hz) = config.output.rate_hz {
        let points = rate_hz * span_s;
        return if points <= MAX_POINTS {
            Ok(rate_hz)
        } else {
            Err(ResolveError::TooManyPoints { rate_hz, span_s, points, most: MAX_POINTS })
        };
    }
    let rate_hz = fusion::fastest_rate_hz(sources).unwrap_or(1.0);
    let samples: usize = sources.iter().map(Source::len).sum();
    let for_samples = 1000.0 + MAX_POINTS_PER_SAMPLE * samples as f64;
    let lowered = rate_hz.min(for_samples / seen_s).min(MAX_POINTS / span_s);
    if lowered == rate_hz {
        return Ok(rate_hz);
    }
    warnings.push(format!(
        "the median interval of the fastest source asks for {rate_hz:.2} points a second over {span_s:.0} s: lowered \
         to {lowered:.2}; set `output.rate_hz` for another rate"
    ));
    Ok(lowered)
}

/// Points a second of a dive's track, where the config says nothing: a heavy vehicle does nothing new within one.
const DIVE_RATE_HZ: f64 = 1.0;

/// What is to be done for a dive's fixes; what was resolved goes back into the config.
///
/// # Errors
/// [`ResolveError::TooManyPoints`].
pub fn dive_plan(
    config: &mut Config,
    loaded: &Loaded,
    fixes: &Source,
    origin: Time,
) -> Result<DivePlan, ResolveError> {
    let bridge_max_s = config.usbl.bridge_max_s;
    let steps = fixes.positions.windows(2).map(|w| w[1].time_s - w[0].time_s);
    let span_s = steps.filter(|step| *step <= bridge_max_s).sum::<f64>();
    let rate_hz = match config.output.rate_hz {
        Some(rate_hz) if rate_hz * span_s > MAX_POINTS => {
            let points = rate_hz * span_s;
            return Err(ResolveError::TooManyPoints { rate_hz, span_s, points, most: MAX_POINTS });
        }
        asked => asked.unwrap_or(DIVE_RATE_HZ.min(MAX_POINTS / span_s)),
    };
    config.output.rate_hz = Some(rate_hz);
    let frame_id = config.output.frame_id.get_or_insert_with(|| loaded.frame_id.clone()).clone();
    config.output.surface_at_zero.get_or_insert_with(|| {
        let mut heights: Vec<f64> = fixes.positions.iter().map(|p| p.value[2]).collect();
        // of wild fixes some lie above the surface
        robust::median(&mut heights).is_some_and(|z| z < -2.0)
    });
    let usbl = &config.usbl;
    Ok(DivePlan {
        origin,
        frame_id,
        rate_hz,
        bridge_max_s,
        settings: usbl::Settings { speed_limit_m_s: usbl.speed_limit_m_s, ..usbl::Settings::default() },
        cycle_s: usbl.cycle_s,
        causal: match usbl.prediction {
            config::Causal::Improved => Causal::Improved,
            config::Causal::Paper => Causal::Paper,
        },
        sigma_is_guess: !loaded.sigma[0].is_some_and(|(_, from)| from.is_stated()),
    })
}

/// What the track may be carried on by: what is asked for, then the others, for comparison. Each law is fitted to the
/// last stretch, by default of its own length, but of at least 12 median intervals of the slowest source.
fn carrying_on(beyond: &config::Extrapolation, sources: &[Source]) -> extrapolation::Settings {
    let slowest = sources.iter().filter_map(coverage::median_interval_s).fold(0.0, f64::max);
    let windowed = |law: Law| {
        let window_s = beyond.window_s.unwrap_or(law.window_s.max(12.0 * slowest));
        Law { window_s, ..law }
    };
    let prior = beyond.prior.then_some(extrapolation::PRIOR);
    let kind = LawKind::Polynomial { order: beyond.order, prior };
    let (polynomial, drag) = (windowed(Law { kind, ..Law::POLYNOMIAL }), windowed(Law::DRAG));
    let (mut laws, choice) = match beyond.method {
        ExtrapolationMethod::Pcf => (vec![polynomial, windowed(Law::POLYNOMIAL), drag], Choice::First),
        ExtrapolationMethod::Drag => (vec![drag, polynomial], Choice::First),
        ExtrapolationMethod::Auto => (vec![polynomial, drag], Choice::Best),
    };
    laws.dedup();
    extrapolation::Settings { laws, choice, horizon_s: beyond.horizon_s }
}

/// The datum's first sample that is in the track, which a stray stamp is not: T0.
#[must_use]
pub fn first_sample(datum: &Source, fusion: &Fusion, origin: Time) -> Time {
    let inside = |t: f64| fusion.pieces.iter().any(|p| (p.0..=p.1).contains(&t));
    let times = datum.positions.iter().chain(&datum.velocities).map(|s| s.time_s).filter(|&t| inside(t));
    let first = times.fold(f64::INFINITY, f64::min);
    let start = fusion.pieces.first().map_or(0.0, |p| p.0);
    origin.plus_seconds(if first.is_finite() { first } else { start })
}

/// Clocks that differ by more than this count from different epochs.
pub(crate) const DIFFERENT_EPOCHS_S: f64 = 3600.0;

/// Seconds between the datum's clock and the log's, where they are clocks of different epochs.
#[must_use]
pub fn log_time_shift_s(datum: &Loaded) -> Option<f64> {
    Some(datum.timing.delay_s).filter(|d| d.abs() > DIFFERENT_EPOCHS_S)
}

/// The instant of the log's first message on the datum's clock, at the earliest that clock's 0: a stamp has no
/// sign. `None` where the message's log time is 0, which is no time.
#[must_use]
pub fn log_start(log: &Log, shift_s: Option<f64>) -> Option<Time> {
    let start_ns = log.index().statistics.as_ref()?.message_start_time;
    let start = Time::from_log(start_ns).filter(|_| start_ns != 0)?;
    Some(start.plus_seconds(-shift_s.unwrap_or(0.0)).max(Time::from_ns(0)))
}

/// Whether the data look as if z = 0 were the surface.
fn surface_at_zero(sources: &[Source]) -> bool {
    let heights = || sources.iter().flat_map(|s| &s.positions).map(|p| p.value[2]);
    heights().all(|z| z < 2.0) && heights().any(|z| z < -2.0)
}

/// An error where a source's clock is of another epoch than the datum's: no track can hold both.
///
/// # Errors
/// [`ResolveError::Epochs`].
pub fn check_epochs(loaded: &[Loaded], datum: usize) -> Result<(), ResolveError> {
    let of_datum = &loaded[datum];
    let apart_s = |other: &Loaded| (other.timing.delay_s - of_datum.timing.delay_s).abs();
    match loaded.iter().find(|l| apart_s(l) > DIFFERENT_EPOCHS_S) {
        Some(other) => Err(ResolveError::Epochs {
            first: of_datum.config.name.clone(),
            second: other.config.name.clone(),
            apart_s: apart_s(other),
        }),
        None => Ok(()),
    }
}

/// What a person must read of the sources' own troubles, frames and clocks.
#[must_use]
pub fn warnings_of(loaded: &[Loaded], shift_s: Option<f64>) -> Vec<String> {
    let mut warnings: Vec<String> = loaded.iter().flat_map(|l| l.warnings.clone()).collect();
    let frames: BTreeMap<&str, &str> = loaded
        .iter()
        .filter(|l| !l.frame_id.is_empty())
        .map(|l| (l.frame_id.as_str(), l.config.name.as_str()))
        .collect();
    if frames.len() > 1 {
        let list: Vec<String> = frames.iter().map(|(frame, name)| format!("{name} in {frame:?}")).collect();
        warnings.push(format!(
            "the sources name different frames ({}): they are taken as one, but for what the registration finds",
            list.join(", ")
        ));
    }
    if let Some(shift) = shift_s {
        warnings.push(format!(
            "the datum's stamps and the log's times are of different epochs: new messages keep the stamps in \
             `timestamp`, and their log times are {shift:.3} s later"
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::ExtrapolationMethod::{Auto, Drag, Pcf};
    use super::*;

    #[test]
    fn the_law_that_is_asked_for_comes_first_and_others_are_tried_beside_it() {
        let asked = |method, prior| {
            let beyond = config::Extrapolation { method, prior, ..config::Extrapolation::default() };
            let found = carrying_on(&beyond, &[]);
            (found.choice, found.laws)
        };
        let plain = Law { kind: LawKind::Polynomial { order: 4, prior: None }, ..Law::POLYNOMIAL };
        assert_eq!(asked(Pcf, true), (Choice::First, vec![Law::POLYNOMIAL, Law::DRAG]));
        assert_eq!(asked(Pcf, false), (Choice::First, vec![plain, Law::POLYNOMIAL, Law::DRAG]));
        assert_eq!(asked(Drag, true), (Choice::First, vec![Law::DRAG, Law::POLYNOMIAL]));
        assert_eq!(asked(Auto, true), (Choice::Best, vec![Law::POLYNOMIAL, Law::DRAG]));
    }
}
