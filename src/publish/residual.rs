//! `trackfuse.Residual`: how far a source's sample lies from the track.
//!
//! All sources share one topic and are told apart by name, `/fused/residuals{source=="tether"}.position_residual.z`:
//! a topic with a sensor's word in its name would look like a sensor to whoever fuses the log again.

use serde::Serialize;

use super::fields::{Stamp, Xyz, rounded};
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::estimate::coverage::Coverage;
use crate::quality::{Misfit, Residual};

#[derive(Serialize, prost::Message)]
pub(super) struct ResidualMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(string, tag = "3")]
    pub(super) source: String,
    #[prost(message, optional, tag = "4")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_residual: Option<Xyz>,
    #[prost(double, optional, tag = "5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_normalised: Option<f64>,
    #[prost(message, optional, tag = "6")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity_residual: Option<Xyz>,
    #[prost(double, optional, tag = "7")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity_normalised: Option<f64>,
    #[prost(string, tag = "8")]
    pub(super) phase: String,
}

impl Payload for ResidualMessage {
    type Ros = ros::Residual;
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
        let message = ResidualMessage {
            timestamp: Some(Stamp::of(residual.time)),
            frame_id: frame_id.to_owned(),
            source: context.sources.get(residual.source)?.name.clone(),
            position_residual: position.and_then(vector),
            position_normalised: position.and_then(normalised),
            velocity_residual: velocity.and_then(vector),
            velocity_normalised: velocity.and_then(normalised),
            phase: Coverage::phase(residual.seen_by).name().to_owned(),
        };
        Some(context.publish(Topic::Residuals, residual.time, message))
    })
}
