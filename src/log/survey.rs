//! Holds the summary against the data section, and completes it.
//!
//! A summary may leave out anything. A new one that named only our channels would hide the old
//! ones from readers that trust it, so what it leaves out is looked up: the gaps between the
//! indexed parts from record to record, chunks' contents only where nothing else tells.

use std::{collections::BTreeSet, ops::Range};

use mcap::records::{
    AttachmentHeader, AttachmentIndex, Channel, ChunkIndex, MessageHeader, MetadataIndex, Statistics, op,
};

use super::chunk::{self, Block, Scratch};
use super::file::{HEAD_LEN, Head, LogFile, parse};
use super::index::{LeftOut, Schema, SummaryRecord, read_record};
use super::summary::encode;
use super::{Index, LogError, Obstacle};

/// Runs of loose records are cut into pieces of about this size, which are read at once.
const LOOSE_PIECE: u64 = 4 << 20;
/// Enough for an attachment's times, name and media type.
const LONGEST_ATTACHMENT_HEADER: u64 = 1 << 20;

/// Checks `index` against the file and adds what is missing. The answer is the first thing, if
/// any, that stands against adding channels.
pub(super) fn complete(file: &LogFile, index: &mut Index) -> Result<Option<Obstacle>, LogError> {
    let summarised = counts(index);
    let known = check_extents(file, index)?;
    let mut gaps = Gaps { file, index, schemas: Vec::new(), loose: None, garbage: None };
    let mut position = gaps.index.data_start;
    for extent in known {
        gaps.walk(position..extent.start)?;
        position = extent.end;
    }
    gaps.walk(position..gaps.index.data_end)?;
    let Gaps { schemas, loose, garbage, .. } = gaps;
    for (opcode, bytes) in schemas {
        adopt(index, opcode, &bytes).map_err(|problem| file.damaged(index.data_start, problem))?;
    }
    index.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
    index.attachments.sort_by_key(|attachment| attachment.offset);
    index.metadata.sort_by_key(|metadata| metadata.offset);

    let scanned = !is_complete(index);
    if scanned {
        scan(file, index)?;
    }
    let found = counts(index);
    index.left_out = LeftOut {
        schemas: found.schemas.saturating_sub(summarised.schemas),
        channels: found.channels.saturating_sub(summarised.channels),
        chunks: found.chunks.saturating_sub(summarised.chunks),
        attachments: found.attachments.saturating_sub(summarised.attachments),
        metadata: found.metadata.saturating_sub(summarised.metadata),
        statistics: found.statistics && !summarised.statistics,
        scanned,
    };
    if let Some(offset) = garbage {
        return Ok(Some(Obstacle::Garbage { offset }));
    }
    if let Some(offset) = loose {
        return Ok(Some(Obstacle::LooseMessages { offset }));
    }
    first_without_message_index(file, index)
}

/// How much the index holds.
fn counts(index: &Index) -> LeftOut {
    LeftOut {
        schemas: index.schemas.len(),
        channels: index.channels.len(),
        chunks: index.chunks.len(),
        attachments: index.attachments.len(),
        metadata: index.metadata.len(),
        statistics: index.statistics.is_some(),
        scanned: false,
    }
}

/// Where the indexed parts of the data section stand, in order; each is what the index says.
fn check_extents(file: &LogFile, index: &Index) -> Result<Vec<Range<u64>>, LogError> {
    let chunks = index
        .chunks
        .iter()
        .map(|c| (op::CHUNK, "chunk", c.chunk_start_offset, c.chunk_length, c.message_index_length));
    let attachments = index.attachments.iter().map(|a| (op::ATTACHMENT, "attachment", a.offset, a.length, 0));
    let metadata = index.metadata.iter().map(|m| (op::METADATA, "metadata", m.offset, m.length, 0));

    let mut extents = Vec::new();
    for (opcode, what, offset, len, behind) in chunks.chain(attachments).chain(metadata) {
        let end = offset.checked_add(len).and_then(|end| end.checked_add(behind));
        if end.is_none_or(|end| offset < index.data_start || end > index.data_end) {
            let what = format!(
                "the {what} index says {len} + {behind} bytes stand here, outside the data section [{}, {})",
                index.data_start, index.data_end
            );
            return Err(file.damaged(offset, what));
        }
        let head = file.head(offset, index.data_end)?;
        if head.opcode != opcode || head.end() != offset + len {
            let found = head.end() - offset;
            let what = format!(
                "the {what} index says a record of {len} bytes (opcode {opcode:#04x}) stands here, found {found} bytes (opcode {:#04x})",
                head.opcode
            );
            return Err(file.damaged(offset, what));
        }
        // Message indexes behind a chunk are walked like a gap: something else may stand among them.
        extents.push(offset..head.end());
    }
    for chunk in &index.chunks {
        let chunk_end = chunk.chunk_start_offset + chunk.chunk_length;
        if let Some((channel, offset)) = chunk
            .message_index_offsets
            .iter()
            .find(|(_, offset)| !(chunk_end..index.data_end).contains(offset))
        {
            let what =
                format!("the message index of channel {channel} is said to stand at {offset}, not behind it");
            return Err(file.damaged(chunk.chunk_start_offset, what));
        }
    }
    extents.sort_by_key(|extent| extent.start);
    if let Some((a, b)) = extents.iter().zip(extents.iter().skip(1)).find(|(a, b)| a.end > b.start) {
        return Err(file.damaged(b.start, format!("indexed again, within the record indexed at {}", a.start)));
    }
    Ok(extents)
}

/// What was found between the indexed parts.
struct Gaps<'a> {
    file: &'a LogFile,
    index: &'a mut Index,
    /// Schemas and channels outside chunks, whole records.
    schemas: Vec<(u8, Vec<u8>)>,
    loose: Option<u64>,
    garbage: Option<u64>,
}

impl Gaps<'_> {
    /// Goes from record to record, reading heads, and bodies only of what is worth indexing.
    fn walk(&mut self, gap: Range<u64>) -> Result<(), LogError> {
        let mut position = gap.start;
        // The chunk that message indexes right behind it belong to.
        let mut chunk: Option<ChunkIndex> = None;
        while position < gap.end {
            let Ok(head) = self.file.head(position, gap.end) else {
                self.garbage.get_or_insert(position);
                break;
            };
            if let (op::MESSAGE_INDEX, Some(chunk)) = (head.opcode, &mut chunk) {
                let id = self.file.bytes(head.body(), head.body_len.min(2), "a message index")?;
                let id: u16 = self.file.parse(position, "message index", &id)?;
                chunk.message_index_offsets.insert(id, position);
                chunk.message_index_length += head.end() - position;
            } else {
                self.add_chunk(chunk.take())?;
                if self.record(head, &mut chunk)? {
                    self.garbage.get_or_insert(position);
                    break;
                }
            }
            position = head.end();
        }
        self.add_chunk(chunk)
    }

    /// Takes one record in. The answer is whether it can't stand in a data section.
    fn record(&mut self, head: Head, chunk: &mut Option<ChunkIndex>) -> Result<bool, LogError> {
        match head.opcode {
            op::MESSAGE => {
                self.loose.get_or_insert(head.offset);
                self.add_loose(head);
            }
            op::SCHEMA | op::CHANNEL => {
                let len = head.end() - head.offset;
                let bytes = self.file.bytes(head.offset, len, "a schema or channel")?;
                self.schemas.push((head.opcode, bytes));
                self.add_loose(head);
            }
            op::CHUNK => {
                let (header, _) = chunk::read_header(self.file, head.offset, head.end())?;
                *chunk = Some(ChunkIndex {
                    message_start_time: header.message_start_time,
                    message_end_time: header.message_end_time,
                    chunk_start_offset: head.offset,
                    chunk_length: head.end() - head.offset,
                    message_index_offsets: [].into(),
                    message_index_length: 0,
                    compression: header.compression,
                    compressed_size: header.compressed_size,
                    uncompressed_size: header.uncompressed_size,
                });
            }
            op::ATTACHMENT => self.add_attachment(head)?,
            op::METADATA => {
                let metadata: mcap::records::Metadata = read_record(self.file, head, "metadata")?;
                let length = head.end() - head.offset;
                let entry = MetadataIndex { offset: head.offset, length, name: metadata.name };
                self.add(op::METADATA_INDEX, encode(op::METADATA_INDEX, &entry))?;
            }
            // Reserved, or somebody's own; skipped as the format asks.
            op::MESSAGE_INDEX | 0x10.. => {}
            _ => return Ok(true),
        }
        Ok(false)
    }

    fn add_chunk(&mut self, chunk: Option<ChunkIndex>) -> Result<(), LogError> {
        match chunk {
            None => Ok(()),
            Some(chunk) => self.add(op::CHUNK_INDEX, encode(op::CHUNK_INDEX, &chunk)),
        }
    }

    fn add_loose(&mut self, head: Head) {
        match self.index.loose.last_mut() {
            Some(run) if run.end == head.offset && head.end() - run.start <= LOOSE_PIECE => {
                run.end = head.end();
            }
            _ => self.index.loose.push(head.offset..head.end()),
        }
    }

    fn add_attachment(&mut self, head: Head) -> Result<(), LogError> {
        let bytes =
            self.file.bytes(head.body(), head.body_len.min(LONGEST_ATTACHMENT_HEADER), "an attachment")?;
        let header: AttachmentHeader = self.file.parse(head.offset, "attachment", &bytes)?;
        // Two times, and two strings with their lengths; then the length of the data.
        let data_size_at = 8 + 8 + 4 + header.name.len() + 4 + header.media_type.len();
        let rest = bytes.get(data_size_at..).unwrap_or_default();
        let data_size: u64 = self.file.parse(head.offset, "attachment", rest)?;
        let entry = AttachmentIndex {
            offset: head.offset,
            length: head.end() - head.offset,
            log_time: header.log_time,
            create_time: header.create_time,
            data_size,
            name: header.name,
            media_type: header.media_type,
        };
        self.add(op::ATTACHMENT_INDEX, encode(op::ATTACHMENT_INDEX, &entry))
    }

    fn add(&mut self, opcode: u8, bytes: Vec<u8>) -> Result<(), LogError> {
        let inserted = self.index.insert(opcode, bytes.get(HEAD_LEN as usize..).unwrap_or_default());
        inserted.map_err(|problem| self.file.damaged(self.index.data_start, problem))?;
        self.index.summary.push(SummaryRecord { opcode, bytes });
        Ok(())
    }
}

/// Puts a schema or channel of the data section into the summary, if that has none with its id.
fn adopt(index: &mut Index, opcode: u8, whole: &[u8]) -> Result<(), String> {
    let body = whole.get(HEAD_LEN as usize..).unwrap_or_default();
    let known = match opcode {
        op::SCHEMA => index.schemas.contains_key(&Schema::parse(body)?.id),
        op::CHANNEL => index.channels.contains_key(&parse::<Channel>(body)?.id),
        _ => true,
    };
    if !known {
        index.insert(opcode, body)?;
        index.summary.push(SummaryRecord { opcode, bytes: whole.to_vec() });
    }
    Ok(())
}

/// Whether the summary names every schema and channel that anything in it refers to.
fn is_complete(index: &Index) -> bool {
    let Some(statistics) = &index.statistics else { return false };
    let used = index.chunks.iter().flat_map(|chunk| chunk.message_index_offsets.keys());
    let used: BTreeSet<u16> = used.chain(statistics.channel_message_counts.keys()).copied().collect();
    let schemas = index.channels.values().map(|channel| channel.schema_id);
    index.channels.len() as u64 >= u64::from(statistics.channel_count)
        && index.schemas.len() >= usize::from(statistics.schema_count)
        && used.iter().all(|id| index.channels.contains_key(id))
        && schemas.into_iter().all(|id| id == 0 || index.schemas.contains_key(&id))
}

/// Reads every chunk for the schemas and channels that the summary leaves out, and counts.
fn scan(file: &LogFile, index: &mut Index) -> Result<(), LogError> {
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    let mut counted = Statistics::default();
    chunk::for_each_record(file, chunk::blocks(index), |block, record| {
        let bad = |problem| file.damaged(block.offset(), format!("the chunk: {problem}"));
        match record.opcode {
            op::MESSAGE => {
                let header: MessageHeader = parse(record.body).map_err(bad)?;
                count(&mut counted, &header);
            }
            // The id is the first field of both.
            op::SCHEMA | op::CHANNEL
                if seen.insert((record.opcode, parse::<u16>(record.body).map_err(bad)?)) =>
            {
                found.push((record.opcode, record.whole.to_vec(), block.offset()));
            }
            _ => {}
        }
        Ok::<_, LogError>(())
    })?;
    for (opcode, bytes, offset) in found {
        adopt(index, opcode, &bytes).map_err(|problem| file.damaged(offset, problem))?;
    }
    if index.statistics.is_none() {
        counted.schema_count = index.schemas.len() as u16;
        counted.channel_count = index.channels.len() as u32;
        counted.attachment_count = index.attachments.len() as u32;
        counted.metadata_count = index.metadata.len() as u32;
        counted.chunk_count = index.chunks.len() as u32;
        index.summary.push(SummaryRecord { opcode: op::STATISTICS, bytes: encode(op::STATISTICS, &counted) });
        index.statistics = Some(counted);
    }
    Ok(())
}

/// Counts a message in.
pub(super) fn count(statistics: &mut Statistics, message: &MessageHeader) {
    let time = message.log_time;
    let (start, end) = match statistics.message_count {
        0 => (time, time),
        _ => (statistics.message_start_time.min(time), statistics.message_end_time.max(time)),
    };
    statistics.message_start_time = start;
    statistics.message_end_time = end;
    // Saturating, since old counts may be anything.
    statistics.message_count = statistics.message_count.saturating_add(1);
    let counted = statistics.channel_message_counts.entry(message.channel_id).or_default();
    *counted = counted.saturating_add(1);
}

/// The first chunk that holds messages and no message index. Only chunks without one are read.
fn first_without_message_index(file: &LogFile, index: &Index) -> Result<Option<Obstacle>, LogError> {
    let (mut buf, mut scratch) = (Vec::new(), Scratch::default());
    for chunk in index.chunks.iter().filter(|chunk| chunk.message_index_offsets.is_empty()) {
        chunk::read_block(file, &Block::Chunk(chunk), &mut scratch, &mut buf)?;
        if chunk::records(&buf).flatten().any(|record| record.opcode == op::MESSAGE) {
            return Ok(Some(Obstacle::NoMessageIndex { offset: chunk.chunk_start_offset }));
        }
    }
    Ok(None)
}
