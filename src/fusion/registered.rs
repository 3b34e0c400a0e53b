//! Sources registered to the datum, and what a person must read of it.

use std::borrow::Cow;

use super::Plan;
use super::pieces::{instants, warn_of_lost, within};
use crate::estimate::agreement::{self, Disagreement};
use crate::estimate::coverage::Coverage;
use crate::estimate::registration::{Kind, Mirrored, Name, Registered, Separation, register};
use crate::estimate::{EstimateError, spline};
use crate::sample::{Quantity, Source};
use crate::track::{Curve, State};

/// The samples that were registered, and what came of it.
type Registration<'a> = (Cow<'a, [Source]>, Registered);

/// Registers what can be fitted of `sources`: the samples of the pieces that have enough of them; `None` where
/// there is no such piece, or nothing is to be registered.
pub(super) fn register_pieces<'a>(
    sources: &'a [Source],
    plan: &Plan,
    warnings: &mut Vec<String>,
) -> Result<Option<Registration<'a>>, EstimateError> {
    let Some(settings) = &plan.registration else { return Ok(None) };
    let mut pieces: Vec<(f64, f64)> = Vec::new();
    let (mut lost_samples, mut lost_at) = (0, None);
    for (from_s, to_s) in Coverage::of(sources).pieces(plan.bridge_max_s) {
        let inside = within(sources, from_s, to_s);
        if instants(&inside) >= spline::MIN_SAMPLES && inside.iter().any(|s| !s.positions.is_empty()) {
            pieces.push((from_s, to_s));
        } else {
            lost_samples += inside.iter().map(Source::len).sum::<usize>();
            lost_at.get_or_insert(plan.origin.plus_seconds(from_s));
        }
    }
    if pieces.is_empty() {
        return Ok(None);
    }
    let kept = match lost_at {
        None => Cow::Borrowed(sources),
        Some(first) => {
            warn_of_lost(lost_samples, first, plan, warnings);
            sources.iter().map(|s| of_pieces(s, &pieces)).collect()
        }
    };
    let registered = register(&kept, plan.datum, &pieces, settings)?;
    Ok(Some((kept, registered)))
}

/// The samples of a source that lie in one of `pieces`.
fn of_pieces(source: &Source, pieces: &[(f64, f64)]) -> Source {
    let mut kept = Source { name: source.name.clone(), ..Source::default() };
    for part in pieces.iter().map(|&(from_s, to_s)| source.within(from_s, to_s)) {
        kept.positions.extend(part.positions);
        kept.velocities.extend(part.velocities);
    }
    kept
}

/// A state whose curve doesn't know what the registration leaves open: that of the registered curve at the nearest
/// instant that was seen is put to it, growing with its velocity's.
pub(super) fn widened(mut state: State, time_s: f64, registered: &Registered) -> State {
    let (near_s, away_s) = registered.curve.nearest(time_s);
    if let Some(known) = registered.curve.at(near_s) {
        for axis in 0..3 {
            let (p, v) = (known.position_sigma[axis], known.velocity_sigma[axis]);
            state.position_sigma[axis] = state.position_sigma[axis].hypot(p + v * away_s);
            state.velocity_sigma[axis] = state.velocity_sigma[axis].hypot(v);
        }
    }
    state
}

/// An unknown that keeps more than this share of its prior sigma, and can't be told from another, is worth a warning.
const UNKNOWN: f64 = 0.5;

/// A bias that is more probable than this is there.
const LIKELY: f64 = 0.5;

/// Noise this many times what was stated means that something is wrong with one or the other.
const MISFIT: f64 = 3.0;

/// Warns of what the registration can't tell, and of what it leaves in `sources`, which are corrected and without
/// what was rejected.
pub(super) fn warn(
    sources: &[Source],
    registered: &Registered,
    left: &[Disagreement],
    warnings: &mut Vec<String>,
) {
    if !registered.converged {
        warnings.push(format!(
            "the registration has not converged in {} steps: look at its numbers before you use them",
            registered.iterations
        ));
    }
    for (source, mirrored) in sources.iter().zip(&registered.mirrored) {
        let Some(mirrored) = mirrored else { continue };
        let what = match mirrored {
            Mirrored::Ned => "as north, east, down: say `axes = \"ned\"` for this source if that is so",
            Mirrored::Level => "with x and y exchanged, or one of them turned over",
            Mirrored::Vertical => "with z turned over",
        };
        warnings.push(format!(
            "{} is left out: its positions are mirrored against the datum's, which no rotation mends; they would fit far \
             better {what}",
            source.name
        ));
    }
    for (s, source) in sources.iter().enumerate() {
        let vague = |kind: Kind| {
            registered.unknowns.iter().any(|u| {
                (u.name.source, u.name.kind) == (s, kind)
                    && u.separation != Separation::Separate
                    && u.sigma > UNKNOWN * u.prior_sigma
            })
        };
        let own = |kind: Kind| {
            registered.unknowns.iter().filter(move |u| (u.name.source, u.name.kind) == (s, kind))
        };
        let clock_is_open = own(Kind::ClockOffset).any(|u| u.separation == Separation::AtPrior);
        let together = own(Kind::Bias).any(|u| {
            let clock = |(other, _): (Name, f64)| (other.source, other.kind) == (s, Kind::ClockOffset);
            u.separation == Separation::OnlyTogether
                && u.strongest.is_some_and(clock)
                && u.probability > LIKELY
        }) && clock_is_open;
        if together {
            warnings.push(format!(
                "the data don't separate the bias of {} from its clock offset: an overlap with the datum in which \
                 the velocity changes would; the bands hold what that leaves open",
                source.name
            ));
        }
        let kinds = [Kind::Bias, Kind::ClockOffset].into_iter().filter(|kind| vague(*kind)).map(Kind::name);
        let kinds: Vec<&str> = kinds.collect();
        if !kinds.is_empty() && !together {
            warnings.push(format!(
                "the data can't tell the {} of {}: an overlap with the datum in which the speed changes would; the \
                 bands hold what that leaves open",
                kinds.join(" and the "),
                source.name
            ));
        }
        for quantity in Quantity::ALL {
            let of = |r: &&crate::estimate::registration::Rejected| (r.source, r.quantity) == (s, quantity);
            let count = registered.rejected.iter().filter(of).count();
            let all = count + source.series(quantity).len();
            if 10 * count > all {
                warnings.push(format!(
                    "{count} of {all} samples of {}'s {} are rejected as outliers",
                    source.name,
                    quantity.name()
                ));
            }
        }
    }
    for (s, q) in (0..sources.len()).flat_map(|s| Quantity::ALL.map(|q| (s, q))) {
        let scale = registered.noise[s][q as usize].scale;
        if scale > MISFIT && !sources[s].series(q).is_empty() {
            warnings.push(format!(
                "the {} of {} lies {scale:.1} times its sigmas from the track (root mean square): sigmas that are too small, \
                 or an error that the model doesn't hold; the bands are widened by that factor",
                q.name(),
                sources[s].name
            ));
        }
    }
    for (first, second) in agreement::uncompared(sources, left, Quantity::Position) {
        warnings.push(format!(
            "{} and {} never measure position at the same time: nothing shows directly what they differ by, and the \
             registration rests on a smooth track between them; the bands hold what that leaves open, an overlap \
             would make them narrower",
            sources[first].name, sources[second].name
        ));
    }
    for d in left.iter().filter(|d| d.is_significant()) {
        let (first, second) = (&sources[d.sources.0].name, &sources[d.sources.1].name);
        let [x, y, z] = d.median;
        warnings.push(format!(
            "{second} and {first} still disagree in {} after registration: {second} - {first} = ({x:+.3}, {y:+.3}, \
             {z:+.3}) {}; an error that the model doesn't hold",
            d.quantity.name(),
            d.quantity.unit()
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::warn;
    use crate::estimate::registration::{Settings, register};
    use crate::sample::{Sample, Source};

    /// 200 samples at 5 m/s, every fourth 30 m off if `wild`.
    fn source(name: &str, wild: bool) -> Source {
        let sample = |i: u32| {
            let off = if wild && i.is_multiple_of(4) { 30.0 } else { 0.0 };
            let noise = 0.1 * (7.3 * f64::from(i * i)).sin();
            let time_s = 0.05 * f64::from(i);
            Sample { time_s, value: [noise, -noise, 5.0 * time_s + noise + off], sigma: [0.1; 3] }
        };
        Source { name: name.into(), positions: (0..200).map(sample).collect(), ..Source::default() }
    }

    #[test]
    fn rejected_samples_are_counted_among_all_samples() {
        let sources = [source("tether", false), source("beacon", true)];
        let found = register(&sources, 0, &[(0.0, 10.0)], &Settings::default()).expect("a good problem");
        let mut warnings = Vec::new();
        warn(&found.corrected(&sources), &found, &[], &mut warnings);
        let wanted = "50 of 200 samples of beacon's position are rejected as outliers";
        assert!(warnings.iter().any(|w| w == wanted), "{warnings:?}");
    }
}
