//! What is in a log, without reading more of it than that takes.
//!
//! | what | read for it |
//! |---|---|
//! | channels, counts, chunks, checksums | the summary, heads of records, chunks' headers |
//! | rates, gaps, jitter of log times | the message indexes, 16 bytes a message |
//! | what could be a source | the first message of each channel that can be decoded |
//! | stamps against log times | of what is or could be a source at most about 128 MB, spread over the log |

mod channels;
mod noticed;
mod rhythm;
pub mod verified;

use std::collections::BTreeMap;

use crate::config::Output;
use crate::config::SourceConfig;
use crate::log::{Encoding, Excerpt, Index, Log, TimesRead};
use crate::publish::Topic;
use crate::report::inspection::{
    ChecksumReport, ClocksRead, CompressionReport, FileReport, FuseReport, IndexReport, Inspection,
    TakenSource,
};
use crate::source::{self, Judgement, Recognised, SourceError, Unfit, init_line};
use rhythm::{Rhythm, Told};

/// How much of the log is decompressed to look at the clocks of its sources, and as much again where chunks
/// have no message index: some tenths of a second. A log that is smaller is read whole.
const BUDGET_BYTES: u64 = 128 << 20;

/// Looks into a log. Nothing here is an error: what is wrong with the log, or can't be told, stands in the
/// answer.
#[must_use]
pub fn inspect(log: &Log) -> Inspection {
    let index = log.index();
    let mut rhythms: BTreeMap<u16, Rhythm> = BTreeMap::new();
    let times = log.for_each_log_time(BUDGET_BYTES, |id, times| rhythms.entry(id).or_default().add(times));
    let rhythms: BTreeMap<u16, Told> = rhythms.into_iter().map(|(id, rhythm)| (id, rhythm.told())).collect();
    let extent = Extent::of(index, &rhythms, &times);
    let judgement = source::judge(log);
    let recognised = judgement.sources();
    let (glimpses, excerpt) = channels::glimpses(log, &judgement);
    let channels =
        channels::reports(index, &judgement, recognised.as_ref().ok(), &rhythms, extent, &glimpses);
    let mut inspection = Inspection {
        version: env!("CARGO_PKG_VERSION").into(),
        input: log.path().display().to_string(),
        file: file(index, extent),
        index: index_state(index, &times),
        checksums: checksums(index, &times, &excerpt),
        verification: None,
        earlier_results: earlier_results(&judgement),
        fuse: fuse(log, recognised.as_ref()),
        clocks_read: ClocksRead { parts: excerpt.read, of: excerpt.parts },
        channels,
        notes: Vec::new(),
        warnings: Vec::new(),
    };
    let damaged = [&times.damaged, &judgement.damaged, &excerpt.damaged].into_iter().flatten();
    let damaged = log.damage_warnings().into_iter().chain(damaged.map(ToString::to_string));
    noticed::warn(&mut inspection, index, recognised.as_ref().ok(), &glimpses, damaged);
    inspection.notes = noticed::notes(&inspection);
    inspection.notes.extend(log.visibility().note());
    inspection
}

/// How many messages there are, and their first and last log time, ns.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    messages: u64,
    span: Option<(u64, u64)>,
    /// Whether the times of all messages are known.
    known: bool,
}

impl Extent {
    /// Where all times are known, they tell; else the statistics.
    fn of(index: &Index, rhythms: &BTreeMap<u16, Told>, times: &TimesRead) -> Self {
        if times.missing() == 0 {
            let spans = rhythms.values().map(|told| told.span);
            return Self {
                messages: rhythms.values().map(|told| told.count).sum(),
                span: spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))),
                known: true,
            };
        }
        index.statistics.as_ref().map_or_else(Self::default, |s| Self {
            messages: s.message_count,
            span: (s.message_count > 0).then_some((s.message_start_time, s.message_end_time)),
            known: false,
        })
    }
}

fn file(index: &Index, extent: Extent) -> FileReport {
    let mut compressions: BTreeMap<&str, CompressionReport> = BTreeMap::new();
    for chunk in &index.chunks {
        let name = if chunk.compression.is_empty() { "none" } else { chunk.compression.as_str() };
        let entry = compressions.entry(name).or_insert_with(|| CompressionReport {
            name: name.into(),
            chunks: 0,
            compressed_bytes: 0,
            uncompressed_bytes: 0,
        });
        entry.chunks += 1;
        entry.compressed_bytes = entry.compressed_bytes.saturating_add(chunk.compressed_size);
        entry.uncompressed_bytes = entry.uncompressed_bytes.saturating_add(chunk.uncompressed_size);
    }
    FileReport {
        bytes: index.file_len,
        profile: index.profile.clone(),
        library: index.library.clone(),
        start_ns: extent.span.map(|span| span.0.to_string()),
        end_ns: extent.span.map(|span| span.1.to_string()),
        duration_s: extent.span.map(|span| seconds_between(span.0, span.1)),
        messages: extent.messages,
        chunks: index.chunks.len(),
        compressions: compressions.into_values().collect(),
        attachments: index.attachments.len(),
        metadata_records: index.metadata.len(),
    }
}

fn index_state(index: &Index, times: &TimesRead) -> IndexReport {
    let left_out = index.left_out;
    IndexReport {
        summary: index.summary_start.is_some(),
        schemas_left_out: left_out.schemas,
        channels_left_out: left_out.channels,
        chunks_left_out: left_out.chunks,
        attachments_left_out: left_out.attachments,
        metadata_left_out: left_out.metadata,
        statistics: !left_out.statistics,
        scanned: left_out.scanned,
        chunks_with_message_index: index
            .chunks
            .iter()
            .filter(|c| !c.message_index_offsets.is_empty())
            .count(),
        parts_without_times: times.missing(),
    }
}

fn checksums(index: &Index, times: &TimesRead, excerpt: &Excerpt) -> ChecksumReport {
    let with = index.chunks.len().saturating_sub(times.chunks_without_crc);
    let read = if index.left_out.scanned { with } else { excerpt.chunks_read };
    ChecksumReport {
        summary: match (index.summary_distrusted, index.summary_crc) {
            (true, _) => "not used",
            (false, Some(_)) => "right",
            (false, None) => "none",
        }
        .into(),
        data_section: if index.data_section_crc.is_some() { "not checked" } else { "none" }.into(),
        chunks_without: times.chunks_without_crc,
        // those without one are not told apart among those that were read
        chunks_right: read.min(with).saturating_sub(excerpt.damaged.len()),
    }
}

fn earlier_results(judgement: &Judgement) -> Vec<String> {
    let own = judgement.channels.iter().filter(|c| c.verdict == Err(Unfit::Own));
    own.map(|c| c.topic.clone()).collect()
}

/// What `fuse` would take, or what is not clear.
fn fuse(log: &Log, recognised: Result<&Recognised, &SourceError>) -> FuseReport {
    let taken = |config: &SourceConfig| TakenSource {
        name: config.name.clone(),
        datum: config.datum,
        position: config.position.clone(),
        velocity: config.velocity.clone(),
    };
    let unclear = recognised.err().map(|error| match error {
        SourceError::Ambiguous { ambiguity } => (ambiguity.what.clone(), ambiguity.candidates.len()),
        SourceError::Unrecognised { candidates, .. } if candidates.is_empty() => {
            ("no channel holds a position or velocity that can be read".to_owned(), 0)
        }
        SourceError::Unrecognised { candidates, .. } => {
            ("no topic's name says that it is a sensor's".to_owned(), candidates.len())
        }
        other => (other.to_string(), 0),
    });
    let encoding = Encoding::of_profile(&log.index().profile);
    let new = Topic::written(&Topic::FUSED, encoding, true)
        .into_iter()
        .map(|topic| topic.channel(Output::FUSED, encoding).topic);
    let new: Vec<String> = new.collect();
    let taken_topic = new.iter().find(|topic| log.index().channels_of(topic).next().is_some());
    let taken_topic = taken_topic.map(|t| format!("{t} is in the log already: `--prefix` names others"));
    let choosing = unclear.as_ref().is_some_and(|(_, candidates)| *candidates > 0);
    FuseReport {
        hint: choosing.then(|| format!("`{}` writes a config to choose in", init_line(log.path()))),
        refusals: [taken_topic, unclear.map(|u| u.0)].into_iter().flatten().collect(),
        sources: recognised.map_or(Vec::new(), |r| r.sources.iter().map(taken).collect()),
    }
}

/// Seconds from one log time to another, to the nanosecond.
fn seconds_between(from_ns: u64, to_ns: u64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 * 1e-9
}
