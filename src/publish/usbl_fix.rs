//! `trackfuse.UsblFix`: a fix, what became of it, and why.

use serde::Serialize;

use super::fields::{Stamp, Xyz, rounded, xyz};
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::estimate::usbl::Judged;
use crate::sample::Sample;

#[derive(Serialize, prost::Message)]
pub(super) struct UsblFixMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(message, optional, tag = "3")]
    pub(super) position: Option<Xyz>,
    #[prost(message, optional, tag = "4")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_sigma: Option<Xyz>,
    #[prost(string, tag = "5")]
    pub(super) verdict: String,
    #[prost(string, tag = "6")]
    pub(super) reason: String,
    #[prost(bool, tag = "7")]
    pub(super) late: bool,
    #[prost(uint32, tag = "8")]
    pub(super) exchange: u32,
    #[prost(message, optional, tag = "9")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_residual: Option<Xyz>,
    #[prost(double, optional, tag = "10")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_normalised: Option<f64>,
}

impl Payload for UsblFixMessage {
    type Ros = ros::UsblFix;
}

/// The messages of fixes and of what became of each, both in order of time.
pub fn usbl_fix_messages<'a>(
    fixes: &'a [Sample],
    judged: &'a [Judged],
    frame_id: &'a str,
    context: Context<'a>,
) -> impl Iterator<Item = Published> + 'a {
    fixes.iter().zip(judged).filter_map(move |(fix, judged)| {
        let time = context.origin.plus_seconds(fix.time_s);
        let message = UsblFixMessage {
            timestamp: Some(Stamp::of(time)),
            frame_id: frame_id.to_owned(),
            position: Some(xyz(fix.value)?),
            position_sigma: xyz(fix.sigma),
            verdict: judged.verdict.name().into(),
            reason: judged.reason.name().into(),
            late: judged.late,
            exchange: u32::try_from(judged.cycle).unwrap_or(u32::MAX),
            // noise doesn't compress: no more digits than tell one residual from another
            position_residual: rounded(judged.residual_m, 1e4),
            position_normalised: Some((judged.residual_sigmas * 1e3).round() / 1e3).filter(|n| n.is_finite()),
        };
        Some(context.publish(Topic::UsblFixes, time, message))
    })
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::estimate::usbl::{Reason, Verdict};
    use crate::log::Encoding;
    use crate::time::Time;

    #[test]
    fn a_fix_says_what_became_of_it_and_every_field_stands_in_its_schema() {
        let zero = Time::from_ns(0);
        let context = Context {
            sources: &[],
            origin: zero,
            rate_hz: 1.0,
            t0: zero,
            surface_at_zero: true,
            log_start: None,
            encoding: Encoding::Json,
            geodetic: None,
        };
        let fix = Sample { time_s: 1.5, value: [1.0, 2.0, -3.0], sigma: [3.0; 3] };
        let judged = Judged {
            verdict: Verdict::Wild,
            reason: Reason::OffByItself,
            late: true,
            cycle: 7,
            residual_m: [30.0, 0.0, 0.0],
            residual_sigmas: 9.5,
        };
        let made: Vec<_> = usbl_fix_messages(&[fix], &[judged], "enu", context).collect();
        let value: Value = serde_json::from_slice(&made[0].data).expect("json");
        assert_eq!((&value["verdict"], &value["reason"]), (&"wild".into(), &"off-by-itself".into()));
        assert_eq!((&value["late"], &value["exchange"]), (&true.into(), &7.into()));
        assert_eq!(value["timestamp"]["nsec"], 500_000_000);
        let channel = Topic::UsblFixes.channel("/usbl", Encoding::Json);
        let schema: Value = serde_json::from_slice(&channel.schema).expect("json");
        assert_eq!(schema["title"], "trackfuse.UsblFix");
        for key in value.as_object().expect("an object").keys() {
            assert!(schema["properties"].get(key).is_some(), "{key}");
        }
        for required in schema["required"].as_array().expect("a list") {
            assert!(value.get(required.as_str().expect("a name")).is_some(), "{required}");
        }
    }
}
