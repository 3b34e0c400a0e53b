//! What is in a log: from its summary, completed from the data section where the summary is not whole.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use mcap::records::{
    AttachmentHeader, AttachmentIndex, Channel, ChunkIndex, MetadataIndex, SchemaHeader, Statistics, op,
};

use super::LogError;
use super::chunk::CutChunk;
use super::file::{HEAD_LEN, Head, LogFile, parse};
use super::rescue::TornChunk;

/// How a channel's messages are made up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The id that channels name it by.
    pub id: u16,
    /// Such as `nav_msgs/msg/Odometry`.
    pub name: String,
    /// Such as `ros2msg` or `jsonschema`.
    pub encoding: String,
    /// The definition itself.
    pub data: Vec<u8>,
}

impl Schema {
    pub(super) fn parse(body: &[u8]) -> Result<Self, String> {
        let header: SchemaHeader = parse(body)?;
        // Id, and two strings with their lengths; then the length of the data.
        let start = 2 + 4 + header.name.len() + 4 + header.encoding.len();
        let rest = body.get(start..).unwrap_or_default();
        let (len, rest) = rest.split_first_chunk::<4>().ok_or("its data has no length")?;
        let len = u32::from_le_bytes(*len);
        let data = rest
            .get(..len as usize)
            .ok_or_else(|| format!("its data claims {len} bytes, it has {}", rest.len()))?;
        Ok(Self { id: header.id, name: header.name, encoding: header.encoding, data: data.to_vec() })
    }
}

/// A record of the summary, with every byte that its writer gave it.
#[derive(Clone, Debug)]
pub(super) struct SummaryRecord {
    pub(super) opcode: u8,
    pub(super) bytes: Vec<u8>,
}

impl SummaryRecord {
    /// Where the chunk stands that this record is the index of.
    pub(super) fn chunk_start_offset(&self) -> Option<u64> {
        // Behind the head and two times.
        let (offset, _) = self.bytes.get(9 + 16..)?.split_first_chunk::<8>()?;
        (self.opcode == op::CHUNK_INDEX).then_some(u64::from_le_bytes(*offset))
    }
}

/// How much the summary left out, and was found in the data section.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Schemas.
    pub schemas: usize,
    /// Channels.
    pub channels: usize,
    /// Chunk indexes.
    pub chunks: usize,
    /// Indexes of attachments.
    pub attachments: usize,
    /// Indexes of metadata records.
    pub metadata: usize,
    /// The statistics, which were counted.
    pub statistics: bool,
    /// Whether every chunk had to be read to find it all.
    pub scanned: bool,
}

/// What is in a log, without its messages.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// What the header calls the log's profile, such as `ros2`.
    pub profile: String,
    /// What the header says wrote the log.
    pub library: String,
    /// By id.
    pub schemas: BTreeMap<u16, Schema>,
    /// By id; channels without messages too.
    pub channels: BTreeMap<u16, Channel>,
    /// In file order.
    pub chunks: Vec<ChunkIndex>,
    /// In file order.
    pub attachments: Vec<AttachmentIndex>,
    /// In file order.
    pub metadata: Vec<MetadataIndex>,
    /// Counts and times as the summary has them, or counted where it has none.
    pub statistics: Option<Statistics>,
    /// What of all this was not in the summary.
    pub left_out: LeftOut,
    /// Where the first record after the header stands.
    pub data_start: u64,
    /// Where the data section ends: at the `DataEnd` record, or behind the last whole record of a log that is
    /// cut off. The bytes before it never change.
    pub data_end: u64,
    /// Whether no `DataEnd` record stands at the data section's end: the log is cut off there, or has none.
    pub is_cut: bool,
    /// Where the summary begins, `None` where there is none, or none that can be trusted.
    pub summary_start: Option<u64>,
    /// Whether what stands behind the data section can't be trusted, so that all was found by a scan.
    pub summary_distrusted: bool,
    /// CRC-32 of the bytes before `DataEnd`, `None` where the writer left it out, or it is cut off.
    pub data_section_crc: Option<u32>,
    /// CRC-32 of the summary, `None` where the writer left it out.
    pub summary_crc: Option<u32>,
    /// Length of the file in bytes.
    pub file_len: u64,
    /// The summary's records as they stand, but for summary offsets; what was missing comes behind them.
    pub(super) summary: Vec<SummaryRecord>,
    /// How many bytes of schemas and channels the summary left out.
    pub(super) adopted_bytes: u64,
    /// Runs of schemas, channels and messages outside chunks, in pieces of some MB.
    pub(super) loose: Vec<Range<u64>>,
    /// Of a log that is cut off within a chunk.
    pub(super) cut_chunk: Option<CutChunk>,
    /// Of a log that is cut off among message indexes.
    pub(super) torn_chunk: Option<TornChunk>,
    /// How many whole chunks can't be decoded; they aren't among the chunks above.
    pub(super) undecodable: usize,
    /// Channels that those chunks may use, and nothing else tells of.
    pub(super) reserved_ids: BTreeSet<u16>,
}

impl Index {
    /// The schema of a channel, `None` where it has none.
    #[must_use]
    pub fn schema_of(&self, channel: &Channel) -> Option<&Schema> {
        self.schemas.get(&channel.schema_id)
    }

    /// Channels of a topic: several where a log was merged, or its writer restarted.
    pub fn channels_of<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a Channel> {
        self.channels.values().filter(move |channel| channel.topic == topic)
    }

    /// Whether there is a schema or channel with the id that `body` begins with.
    pub(super) fn knows(&self, opcode: u8, body: &[u8]) -> Result<bool, String> {
        let id = parse::<u16>(body)?;
        Ok(if opcode == op::SCHEMA {
            self.schemas.contains_key(&id)
        } else {
            self.channels.contains_key(&id)
        })
    }

    /// Takes in a schema or channel that the summary leaves out, a whole record found at or in what is at `offset`.
    ///
    /// # Errors
    /// [`LogError::Damaged`]; [`LogError::TooLarge`] where it takes more than the limit with those before.
    pub(super) fn adopt(
        &mut self,
        file: &LogFile,
        offset: u64,
        opcode: u8,
        whole: Vec<u8>,
    ) -> Result<(), LogError> {
        let body = whole.get(HEAD_LEN as usize..).unwrap_or_default();
        let damaged = |problem: String| file.damaged(offset, problem);
        if self.knows(opcode, body).map_err(damaged)? {
            return Ok(());
        }
        self.adopted_bytes += whole.len() as u64;
        if self.adopted_bytes > file.options.memory_limit {
            return Err(file.too_large(
                offset,
                "a schema or channel, with those before it,",
                self.adopted_bytes,
            ));
        }
        self.insert(opcode, body).map_err(damaged)?;
        self.summary.push(SummaryRecord { opcode, bytes: whole });
        Ok(())
    }

    /// Puts one record of the summary into the index.
    pub(super) fn insert(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        match opcode {
            op::SCHEMA => {
                let schema = Schema::parse(body)?;
                self.schemas.entry(schema.id).or_insert(schema);
            }
            op::CHANNEL => {
                let channel: Channel = parse(body)?;
                self.channels.entry(channel.id).or_insert(channel);
            }
            op::STATISTICS => self.statistics = Some(parse(body)?),
            op::CHUNK_INDEX => self.chunks.push(parse(body)?),
            op::ATTACHMENT_INDEX => self.attachments.push(parse(body)?),
            op::METADATA_INDEX => self.metadata.push(parse(body)?),
            _ => {}
        }
        Ok(())
    }
}

/// A record of the file, whole in memory: only for small ones.
pub(super) fn read_record<T>(file: &LogFile, head: Head, what: &'static str) -> Result<T, LogError>
where
    T: for<'a> binrw::BinRead<Args<'a> = ()>,
{
    file.parse(head.offset, what, &file.bytes(head.body(), head.body_len, what)?)
}

/// What the index says of an attachment.
pub(super) fn attachment_index(head: Head, header: AttachmentHeader, data_size: u64) -> AttachmentIndex {
    let AttachmentHeader { log_time, create_time, name, media_type } = header;
    let length = head.end() - head.offset;
    AttachmentIndex { offset: head.offset, length, log_time, create_time, data_size, name, media_type }
}
