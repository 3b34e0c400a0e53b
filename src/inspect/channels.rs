//! Channel by channel: when it was recorded, and what it is fit for.

use std::collections::BTreeMap;

use super::rhythm::Told;
use super::{BUDGET_BYTES, Extent, seconds_between};
use crate::config::SourceConfig;
use crate::estimate::coverage;
use crate::log::{Excerpt, Index, Log};
use crate::report::inspection::{ChannelReport, ClockReport, Role, TimesReport, Unusable};
use crate::source::{self, Candidate, Glimpse, Judged, Judgement, Recognised, Unfit};

/// Looks at the messages of every topic that is or could be a source.
pub(super) fn glimpses(log: &Log, judgement: &Judgement) -> (BTreeMap<String, Glimpse>, Excerpt) {
    let candidates: BTreeMap<&str, &Candidate> = judgement
        .channels
        .iter()
        .filter_map(|channel| Some((channel.topic.as_str(), channel.verdict.as_ref().ok()?)))
        .collect();
    let configs: Vec<SourceConfig> = candidates
        .values()
        .map(|candidate| SourceConfig {
            name: candidate.topic.clone(),
            position: candidate.position.clone(),
            velocity: candidate.velocity.clone(),
            ..SourceConfig::default()
        })
        .collect();
    let (glimpses, excerpt) = source::glimpse(log, &configs, BUDGET_BYTES);
    (configs.into_iter().map(|config| config.name).zip(glimpses).collect(), excerpt)
}

/// The channels: sources first, then those that could be, then the others; each by topic.
pub(super) fn reports(
    index: &Index,
    judgement: &Judgement,
    recognised: Option<&Recognised>,
    rhythms: &BTreeMap<u16, Told>,
    extent: Extent,
    glimpses: &BTreeMap<String, Glimpse>,
) -> Vec<ChannelReport> {
    let sources = recognised.map_or(&[][..], |r| r.sources.as_slice());
    let start_ns = extent.span.map_or(0, |span| span.0);
    let mut reports: Vec<ChannelReport> = judgement
        .channels
        .iter()
        .filter_map(|judged| {
            let channel = index.channels.get(&judged.id)?;
            let schema = index.schema_of(channel);
            let candidate = judged.verdict.as_ref().ok();
            let source = candidate.and_then(|c| sources.iter().find(|s| is_of(s, c)));
            let rhythm = rhythms.get(&judged.id);
            let counted = index.statistics.as_ref().map(|s| &s.channel_message_counts);
            // Where not all was read, the statistics know better, and where all was, the other way round.
            let by_statistics = counted.and_then(|counts| counts.get(&judged.id).copied());
            let messages = match rhythm.map(|r| r.count) {
                _ if !extent.known => by_statistics,
                count => Some(count.unwrap_or(0)),
            };
            Some(ChannelReport {
                id: judged.id,
                topic: channel.topic.clone(),
                schema: schema.map_or(String::new(), |s| s.name.clone()),
                schema_encoding: schema.map_or(String::new(), |s| s.encoding.clone()),
                message_encoding: channel.message_encoding.clone(),
                messages,
                role: match (candidate, source) {
                    (None, _) => Role::Other,
                    (Some(_), None) => Role::Candidate,
                    (Some(_), Some(_)) => Role::Source,
                },
                source: source.map(|s| s.name.clone()),
                position: candidate.and_then(|c| c.position.clone()),
                velocity: candidate.and_then(|c| c.velocity.clone()),
                unusable: unusable(judged),
                times: rhythm.map(|told| times_report(told, start_ns)),
                clock: candidate.and_then(|c| clock(glimpses.get(&c.topic)?)),
            })
        })
        .collect();
    let rank = |report: &ChannelReport| {
        let of = |s: &SourceConfig| Some(&s.name) == report.source.as_ref();
        (report.role, sources.iter().position(of), report.topic.clone(), report.id)
    };
    reports.sort_by_cached_key(rank);
    reports
}

/// Whether the source takes something of the candidate.
fn is_of(source: &SourceConfig, candidate: &Candidate) -> bool {
    let same = |a: &Option<String>, b: &Option<String>| a.is_some() && a == b;
    same(&source.position, &candidate.position) || same(&source.velocity, &candidate.velocity)
}

fn unusable(judged: &Judged) -> Option<Unusable> {
    let unfit = judged.verdict.as_ref().err()?;
    let short = match unfit {
        Unfit::Own => "by trackfuse",
        Unfit::Reference => "reference",
        Unfit::Undecodable(_) => "can't decode",
        Unfit::Silent => "no messages",
        Unfit::Unreadable => "no message can be read",
        Unfit::NoVector(_) => "no position",
        Unfit::Polar => "seen from a ship",
    };
    Some(Unusable { short: short.into(), reason: unfit.to_string() })
}

fn times_report(told: &Told, start_ns: u64) -> TimesReport {
    let since_start = |ns: u64| seconds_between(start_ns, ns);
    TimesReport {
        first_ns: told.span.0.to_string(),
        last_ns: told.span.1.to_string(),
        span_s: (since_start(told.span.0), since_start(told.span.1)),
        rate_hz: told.interval_s.map(f64::recip),
        jitter_s: told.jitter_s,
        gaps: told.gaps,
        longest_gap_s: told.longest_gap.map(|gap| gap.0),
        longest_gap_at_s: told.longest_gap.map(|gap| since_start(gap.1)),
        equal: told.equal,
        out_of_order: told.behind.0,
        out_of_order_s: told.behind.1,
    }
}

fn clock(glimpse: &Glimpse) -> Option<ClockReport> {
    let seen = glimpse.seen.as_ref()?;
    Some(ClockReport {
        messages_read: glimpse.messages,
        clock: seen.timing.clock.clone(),
        rate_hz: coverage::median_interval_s(&seen.source).map(f64::recip),
        delay_s: seen.timing.delay_s,
        delay_spread_s: seen.timing.delay_spread_s,
        delay_growth_s: seen.timing.delay_growth_s,
        frame_id: seen.frame_id.clone(),
    })
}
