//! What stands between the records that the summary names.

use std::{collections::BTreeSet, ops::Range};

use mcap::records::{AttachmentHeader, ChunkIndex, MetadataIndex, op};

use super::damage::Damages;
use super::ending::may_stand_in_data;
use super::file::{HEAD_LEN, Head, LogFile};
use super::index::{SummaryRecord, attachment_index, read_record};
use super::part::MESSAGE_HEADER_LEN;
use super::summary::encode;
use super::{Index, LogError, Work, chunk};

/// Runs of loose records are cut into pieces of about this size, which are read at once.
const LOOSE_PIECE: u64 = 4 << 20;
/// Enough for an attachment's times, name and media type.
const LONGEST_ATTACHMENT_HEADER: u64 = 1 << 20;

/// What was found between the indexed records.
pub(super) struct Gaps<'a> {
    pub(super) file: &'a LogFile,
    pub(super) index: &'a mut Index,
    pub(super) damages: &'a mut Damages,
    /// The first message outside chunks.
    pub(super) loose: Option<u64>,
    /// The first bytes that are no record.
    pub(super) garbage: Option<u64>,
    /// Chunks that the summary doesn't name, by their starts.
    pub(super) chunks: BTreeSet<u64>,
}

impl Gaps<'_> {
    /// Goes from record to record, reading heads, and bodies only of what is worth indexing.
    pub(super) fn walk(&mut self, gap: Range<u64>) -> Result<(), LogError> {
        let mut position = gap.start;
        // The chunk that message indexes right behind it belong to.
        let mut chunk: Option<ChunkIndex> = None;
        while position < gap.end {
            let head = match self.file.head(position, gap.end) {
                Ok(head) if may_stand_in_data(head.opcode) => head,
                Ok(head) => {
                    self.garbage(position, gap.end, &format!("opcode {:#04x}", head.opcode));
                    break;
                }
                Err(LogError::Damaged { what, .. }) => {
                    self.garbage(position, gap.end, &what);
                    break;
                }
                Err(other) => return Err(other),
            };
            if let (op::MESSAGE_INDEX, Some(chunk)) = (head.opcode, &mut chunk) {
                let id = self.file.bytes(head.body(), head.body_len.min(2), "a message index")?;
                if let Some(id) = self.damages.note(self.file.parse(position, "message index", &id))? {
                    chunk.message_index_offsets.insert(id, position);
                }
                chunk.message_index_length += head.end() - position;
            } else {
                self.add_chunk(chunk.take())?;
                let taken = self.record(head, &mut chunk);
                self.damages.note(taken)?;
            }
            position = head.end();
            self.file.options.observer.tell(Work::Scan, position, self.index.data_end);
        }
        self.add_chunk(chunk)
    }

    fn garbage(&mut self, position: u64, end: u64, why: &str) {
        let what = format!("bytes that are no record stand in the data section, up to {end} ({why})");
        self.damages.push(position, what);
        self.garbage.get_or_insert(position);
    }

    /// Takes one record in.
    fn record(&mut self, head: Head, chunk: &mut Option<ChunkIndex>) -> Result<(), LogError> {
        match head.opcode {
            op::MESSAGE => {
                if head.body_len < MESSAGE_HEADER_LEN as u64 {
                    let what = format!("a message of {} bytes, too short for its header", head.body_len);
                    return Err(self.file.damaged(head.offset, what));
                }
                self.loose.get_or_insert(head.offset);
                self.add_loose(head);
            }
            op::SCHEMA | op::CHANNEL => {
                self.add_loose(head);
                // A log may repeat them any number of times: known ones aren't read again.
                let id = self.file.bytes(head.body(), head.body_len.min(2), "a schema or channel")?;
                if self.index.knows(head.opcode, &id) != Ok(true) {
                    let len = head.end() - head.offset;
                    let whole = self.file.bytes(head.offset, len, "a schema or channel")?;
                    self.index.adopt(self.file, head.offset, head.opcode, whole)?;
                }
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
            // A message index of no chunk, reserved, or somebody's own; skipped as the format asks.
            _ => {}
        }
        Ok(())
    }

    fn add_chunk(&mut self, chunk: Option<ChunkIndex>) -> Result<(), LogError> {
        match chunk {
            None => Ok(()),
            Some(chunk) => {
                self.chunks.insert(chunk.chunk_start_offset);
                self.add(op::CHUNK_INDEX, encode(op::CHUNK_INDEX, &chunk))
            }
        }
    }

    fn add_loose(&mut self, head: Head) {
        let piece = LOOSE_PIECE.min(self.file.options.memory_limit);
        match self.index.loose.last_mut() {
            Some(run) if run.end == head.offset && head.end() - run.start <= piece => {
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
        // The data is followed by its CRC. An attachment that claims more than it has makes readers fail.
        let claimed = (data_size_at as u64 + 8 + 4).checked_add(data_size);
        if claimed.is_none_or(|claimed| claimed > head.body_len) {
            let what =
                format!("an attachment claims {data_size} bytes, its record has {} in all", head.body_len);
            return Err(self.file.damaged(head.offset, what));
        }
        let entry = attachment_index(head, header, data_size);
        self.add(op::ATTACHMENT_INDEX, encode(op::ATTACHMENT_INDEX, &entry))
    }

    fn add(&mut self, opcode: u8, bytes: Vec<u8>) -> Result<(), LogError> {
        let inserted = self.index.insert(opcode, bytes.get(HEAD_LEN as usize..).unwrap_or_default());
        inserted.map_err(|problem| self.file.damaged(self.index.data_start, problem))?;
        self.index.summary.push(SummaryRecord { opcode, bytes });
        Ok(())
    }
}
