//! `trackfuse compare`: a track of a log against a reference channel of it.

use super::progress::Bar;
use super::{CommandError, Outcome, open, show};
use crate::cli::Compare;
use crate::estimate::characteristic_point::Height;
use crate::log::decode::MessagePath;
use crate::quality::{self, Comparison};
use crate::report::{ComparisonParts, ComparisonReport, render_comparison};
use crate::sample::Quantity;
use crate::source::{self, Loaded, Recorded, SigmaOrigin};

/// Holds a track against a reference, and says how far they are apart.
///
/// # Errors
/// [`CommandError`] for a log that can't be read, a channel that doesn't fit, and two that have no instant in
/// common.
pub fn compare(args: &Compare) -> Result<Outcome, CommandError> {
    let bar = Bar::new(args.voice);
    let (log, damage) = open(&args.log, args.memory, args.strict, &bar)?;
    let topic = args.estimate.clone().unwrap_or_else(|| source::usual_track(&log));
    let mut estimate = source::recorded(&log, &topic)?;
    estimate.warnings.splice(..0, damage);
    let (mut reference, reference_origin) =
        source::reference(&log, &args.reference, args.reference_time, estimate.fix_origin)?;
    let t0 = estimate.origin();
    let shift_s = reference_origin.seconds_since(t0);
    for quantity in Quantity::ALL {
        reference.source.series_mut(quantity).iter_mut().for_each(|s| s.time_s += shift_s);
    }
    let (events, left_out) = source::recorded_events(&log, &topic)?;
    let mut heights: Vec<Height> =
        events.into_iter().map(|event| Height { name: event.name, z_m: event.position[2] }).collect();
    for height in &args.height {
        if !heights.contains(height) {
            heights.push(height.clone());
        }
    }

    let comparison = quality::compare(&estimate.track, t0, &reference.source, &heights);
    if comparison.all.position.is_none() && comparison.all.velocity.is_none() {
        let span = |times: Option<(f64, f64)>| {
            times.map_or("nothing".into(), |(a, b)| format!("{a:.2} to {b:.2} s"))
        };
        let ends = estimate.track.points.first().zip(estimate.track.points.last());
        return Err(CommandError::NothingInCommon {
            estimate: span(ends.map(|(a, b)| (a.time.seconds_since(t0), b.time.seconds_since(t0)))),
            reference: span(reference.source.span_s()),
        });
    }
    let mut warnings = warnings(&topic, &estimate, &reference, &comparison);
    warnings.splice(..0, left_out.into_iter().filter(|w| !warnings.contains(w)).collect::<Vec<_>>());
    drop(bar);
    let report = ComparisonReport::new(&ComparisonParts {
        log: &args.log.display().to_string(),
        topic: &topic,
        estimate: &estimate,
        reference: &reference,
        t0,
        comparison: &comparison,
        warnings: &warnings,
    });
    show(args.voice, &render_comparison(&report), &report, &warnings)?;
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// What would make the numbers mean something else than they seem to.
fn warnings(topic: &str, estimate: &Recorded, reference: &Loaded, comparison: &Comparison) -> Vec<String> {
    let mut warnings = estimate.warnings.clone();
    warnings.extend(reference.warnings.iter().cloned());
    let (own, its) = (&estimate.track.frame_id, &reference.frame_id);
    if !own.is_empty() && !its.is_empty() && own != its {
        warnings.push(format!(
            "the track is in frame {own:?}, the reference in {its:?}: they are taken as one, and errors mean nothing \
             if they aren't"
        ));
    }
    let paths = [&reference.config.position, &reference.config.velocity];
    let of_reference = |topic: &str| {
        paths.into_iter().flatten().any(|p| MessagePath::parse(p).is_ok_and(|p| p.topic == topic))
    };
    if of_reference(topic) {
        warnings.push(format!("the reference is {topic} itself: that they agree proves nothing"));
    } else if let Some(made_of) = estimate.made_of.iter().find(|made_of| of_reference(made_of)) {
        warnings.push(format!("{topic} was made of {made_of}: that it agrees with it proves nothing"));
    }
    let noise = reference.sigma.map(|s| s.filter(|s| s.1 != SigmaOrigin::Assumed).map(|s| s.0));
    for (q, errors) in [&comparison.all.position, &comparison.all.velocity].into_iter().enumerate() {
        // what the track thinks of itself: errors over sigmas, against errors
        let bands = errors.as_ref().and_then(|e| Some((e, e.bands.as_ref()?)));
        let own = bands.map(|(e, b)| e.rmse / b.normalised_rmse / 3.0_f64.sqrt());
        if let Some((noise, own)) = noise[q].zip(own).filter(|(noise, own)| noise > &(0.3 * own)) {
            let (what, unit) = (Quantity::ALL[q].name(), Quantity::ALL[q].unit());
            warnings.push(format!(
                "the reference's {what} has a noise of {noise:.3} {unit} of its own, the track's bands are of {own:.3} \
                 {unit}: errors and what lies inside the bands hold both"
            ));
        }
    }
    for (q, errors) in [&comparison.all.position, &comparison.all.velocity].into_iter().enumerate() {
        let quantity = Quantity::ALL[q];
        let Some((errors, by)) = errors.as_ref().zip(comparison.interpolated[q].as_ref()) else { continue };
        let error = by.error.unwrap_or(f64::INFINITY);
        if error > 0.2 * errors.rmse {
            warnings.push(format!(
                "the {} is too coarse: interpolating its {} is off by {:.3} {unit}, of an error of {:.3} {unit}",
                by.series,
                quantity.name(),
                error,
                errors.rmse,
                unit = quantity.unit()
            ));
        }
    }
    warnings
}
