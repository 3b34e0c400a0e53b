//! `trackfuse.Residual`: how far a source's sample lies from the track.
//!
//! All sources share one topic and are told apart by name, `/fused/residuals{source=="tether"}.position_residual.z`:
//! a topic with a sensor's word in its name would look like a sensor to whoever fuses the log again.

use serde::Serialize;

use super::fields::{Stamp, Xyz, json, rounded};
use super::{Context, Published, Topic};
use crate::estimate::coverage::Coverage;
use crate::quality::{Misfit, Residual};

#[derive(Serialize)]
struct ResidualMessage<'a> {
    timestamp: Stamp,
    frame_id: &'a str,
    source: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_residual: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_normalised: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_residual: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_normalised: Option<f64>,
    phase: &'a str,
}

/// The messages of residuals.
pub(super) fn residual_messages<'a>(
    residuals: &'a [Residual],
    frame_id: &'a str,
    context: Context<'a>,
) -> impl Iterator<Item = Published> + 'a {
    residuals.iter().filter_map(move |residual| {
        let [position, velocity] = residual.misfits;
        // noise doesn't compress: no more digits than tell one residual from another
        let vector = |m: Misfit| rounded(m.vector, 1e4);
        let normalised = |m: Misfit| Some((m.normalised * 1e3).round() / 1e3).filter(|n| n.is_finite());
        let data = json(&ResidualMessage {
            timestamp: residual.time.into(),
            frame_id,
            source: &context.sources.get(residual.source)?.name,
            position_residual: position.and_then(vector),
            position_normalised: position.and_then(normalised),
            velocity_residual: velocity.and_then(vector),
            velocity_normalised: velocity.and_then(normalised),
            phase: Coverage::phase(residual.seen_by).name(),
        });
        Some(Published { topic: Topic::Residuals, time: residual.time, data })
    })
}
