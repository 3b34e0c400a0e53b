//! What is to be said of a log: one value, rendered as text for people or as JSON for programs.

mod table;
mod text;

pub use text::render_inspection;

use schemars::JsonSchema;
use serde::Serialize;

/// The report of `inspect`. Nanoseconds are strings, since JSON numbers lose them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Inspection {
    /// Version of the program.
    pub version: String,
    /// The log.
    pub input: String,
    /// The file.
    pub file: FileReport,
    /// The state of its index.
    pub index: IndexReport,
    /// The state of its checksums.
    pub checksums: ChecksumReport,
    /// What `--verify` found; null without it.
    pub verification: Option<VerificationReport>,
    /// Topics that this program wrote in earlier runs.
    pub earlier_results: Vec<String>,
    /// What `fuse` would take without a config, and what it would say.
    pub fuse: FuseReport,
    /// How much was read to look at the clocks of what is or could be a source.
    pub clocks_read: ClocksRead,
    /// The channels: sources first, then those that could be, then the others; each by topic.
    pub channels: Vec<ChannelReport>,
    /// What else was noticed, a sentence each.
    pub notes: Vec<String>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

/// The file.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FileReport {
    /// Its length.
    pub bytes: u64,
    /// What its header calls its profile, such as `ros2`.
    pub profile: String,
    /// What its header says wrote it.
    pub library: String,
    /// First log time, ns; null without messages.
    pub start_ns: Option<String>,
    /// Last log time, ns.
    pub end_ns: Option<String>,
    /// From the first to the last, s.
    pub duration_s: Option<f64>,
    /// Number of messages.
    pub messages: u64,
    /// Number of chunks.
    pub chunks: usize,
    /// How they are compressed.
    pub compressions: Vec<CompressionReport>,
    /// Number of attachments.
    pub attachments: usize,
    /// Number of metadata records.
    pub metadata_records: usize,
}

/// The chunks that are compressed in one way.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CompressionReport {
    /// `zstd`, `lz4`, `none`, or whatever the log says.
    pub name: String,
    /// Number of chunks.
    pub chunks: usize,
    /// Their size in the file.
    pub compressed_bytes: u64,
    /// Their size when decompressed.
    pub uncompressed_bytes: u64,
}

/// What the index holds, and what had to be found in the data section.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct IndexReport {
    /// Whether there is a summary.
    pub summary: bool,
    /// Schemas that it leaves out.
    pub schemas_left_out: usize,
    /// Channels that it leaves out.
    pub channels_left_out: usize,
    /// Chunks that it leaves out.
    pub chunks_left_out: usize,
    /// Attachments that it leaves out.
    pub attachments_left_out: usize,
    /// Metadata records that it leaves out.
    pub metadata_left_out: usize,
    /// Whether it has statistics; else messages were counted.
    pub statistics: bool,
    /// Whether every chunk was read to find what it leaves out.
    pub scanned: bool,
    /// Chunks with message indexes.
    pub chunks_with_message_index: usize,
    /// Parts of the log without message index that are damaged, or too large together to be read for it: times
    /// lack them.
    pub parts_without_times: usize,
}

/// Which checksums there are, and which were checked.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ChecksumReport {
    /// Of the summary: `right`, `wrong`, `none`, or `not used` where the summary is missing, or can't be trusted.
    pub summary: String,
    /// Of the whole data section: `not checked` or `none`; with `--verify` also `right` or `wrong`.
    pub data_section: String,
    /// Chunks that have none.
    pub chunks_without: usize,
    /// Chunks whose checksum was found to be right.
    pub chunks_right: usize,
}

/// Every checksum and index entry of the file, held against what the file holds.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VerificationReport {
    /// What is wrong, mostly in file order; the first hundred.
    pub findings: Vec<FindingReport>,
    /// How much more is.
    pub findings_left_out: u64,
    /// What the file has no checksum or index for, or what damage hides.
    pub not_checkable: Vec<String>,
    /// Bytes that were read.
    pub bytes: u64,
    /// Chunks that were read.
    pub chunks: u64,
    /// Messages, in chunks and outside.
    pub messages: u64,
    /// Entries of message indexes.
    pub index_entries: u64,
    /// Attachments.
    pub attachments: u64,
    /// Metadata records.
    pub metadata_records: u64,
}

/// Something that is wrong with the file.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FindingReport {
    /// Where the record begins that it is about, bytes from the start of the file.
    pub offset: u64,
    /// What was found, and what was expected.
    pub what: String,
}

/// How much was read to look at clocks.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct ClocksRead {
    /// Chunks, and runs of messages outside chunks.
    pub parts: usize,
    /// Of so many that hold such channels.
    pub of: usize,
}

/// What `fuse` would do without a config.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FuseReport {
    /// Why it would refuse; empty where it would run.
    pub refusals: Vec<String>,
    /// What to do about it.
    pub hint: Option<String>,
    /// The sources that it would take, the datum first; empty where the topics' names give no clear answer.
    pub sources: Vec<TakenSource>,
}

/// A source that `fuse` would take.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TakenSource {
    /// Its name.
    pub name: String,
    /// Whether its bias and clock are zero by definition.
    pub datum: bool,
    /// Message path of its position.
    pub position: Option<String>,
    /// Message path of its velocity.
    pub velocity: Option<String>,
}

/// Whether a channel is a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// `fuse` takes it without a config.
    Source,
    /// It could be a source, where a config names it.
    Candidate,
    /// It can't be one.
    Other,
}

/// Why a channel can't be a source.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Unusable {
    /// In two words.
    pub short: String,
    /// In a sentence.
    pub reason: String,
}

/// A channel.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ChannelReport {
    /// Its id.
    pub id: u16,
    /// Its topic.
    pub topic: String,
    /// Name of its schema; empty without one.
    pub schema: String,
    /// Encoding of its schema.
    pub schema_encoding: String,
    /// Encoding of its messages.
    pub message_encoding: String,
    /// Number of its messages; null where nothing tells.
    pub messages: Option<u64>,
    /// Whether it is a source.
    pub role: Role,
    /// The source that it belongs to.
    pub source: Option<String>,
    /// Message path of its position.
    pub position: Option<String>,
    /// Message path of its velocity.
    pub velocity: Option<String>,
    /// Why it can't be a source.
    pub unusable: Option<Unusable>,
    /// When its messages were recorded; null where nothing tells.
    pub times: Option<TimesReport>,
    /// The clock of its samples; null for channels that can't be sources.
    pub clock: Option<ClockReport>,
}

/// The log times of a channel.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TimesReport {
    /// The earliest, ns.
    pub first_ns: String,
    /// The latest, ns.
    pub last_ns: String,
    /// Both, s since the log's first message.
    pub span_s: (f64, f64),
    /// Messages a second, by the median interval between distinct times; where these scatter much, the samples'
    /// own clock tells better.
    pub rate_hz: Option<f64>,
    /// Half the width of the middle 68 % of the intervals, s.
    pub jitter_s: Option<f64>,
    /// Number of silences longer than ten median intervals.
    pub gaps: u64,
    /// The longest of them, s.
    pub longest_gap_s: Option<f64>,
    /// Where it begins, s since the log's first message.
    pub longest_gap_at_s: Option<f64>,
    /// Messages with the time of the one before them.
    pub equal: u64,
    /// Messages that stand behind a later one.
    pub out_of_order: u64,
    /// By how much at most, s.
    pub out_of_order_s: f64,
}

/// The clock of a channel's samples against the log's.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ClockReport {
    /// How many messages were read for it.
    pub messages_read: usize,
    /// What times the samples: `stamp`, `publish` or `log`, or several with `+`.
    pub clock: String,
    /// Samples a second, by the median interval between those times.
    pub rate_hz: Option<f64>,
    /// Median of log time less that time, s.
    pub delay_s: f64,
    /// Half the width of the middle 68 % of it, s.
    pub delay_spread_s: f64,
    /// How much its median grows from the first third of the messages to the last, s.
    pub delay_growth_s: f64,
    /// The frame that the messages name; empty where they don't.
    pub frame_id: String,
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_schema_in_the_tree_is_the_one_of_this_code() {
        super::super::tests::assert_schema(&schemars::schema_for!(super::Inspection), "inspect");
    }
}
