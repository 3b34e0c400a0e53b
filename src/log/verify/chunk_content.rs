//! One chunk at a time: its header, its records, and the message indexes behind it.

use std::collections::BTreeMap;

use mcap::records::{ChunkHeader, ChunkIndex, MessageHeader, op};

use super::super::chunk::{self, records};
use super::super::file::{Head, LogFile, parse};
use super::super::{LogError, summary::encode_body};
use super::content::{Content, Place};
use super::findings::Findings;
use super::sequence::name_of;
use super::{Checked, what_of};

/// The chunk that was read last, until its message indexes are past.
#[derive(Debug, Default)]
pub(super) struct OpenChunk {
    /// What a chunk index should say of it; `None` where there is no chunk.
    seen: Option<ChunkIndex>,
    /// Its records, decompressed; kept from chunk to chunk for its memory.
    records: Vec<u8>,
    /// Where its messages begin in them, and whether an index entry led there.
    messages: Vec<(u64, bool)>,
    /// Whether its records could be read.
    readable: bool,
}

impl OpenChunk {
    /// Reads the chunk whose record has `body`. The answer is whether all that it holds was seen.
    pub(super) fn open(
        &mut self,
        file: &LogFile,
        head: Head,
        body: &[u8],
        content: &mut Content,
        checked: &mut Checked,
        findings: &mut Findings,
    ) -> Result<bool, LogError> {
        self.messages.clear();
        self.readable = false;
        checked.chunks += 1;
        let mut seen = ChunkIndex {
            message_start_time: 0,
            message_end_time: 0,
            chunk_start_offset: head.offset,
            chunk_length: head.end() - head.offset,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: String::new(),
            compressed_size: 0,
            uncompressed_size: 0,
        };
        let header: ChunkHeader = match parse(body) {
            Ok(header) => header,
            Err(problem) => {
                findings.wrong(head.offset, format_args!("chunk: {problem}"));
                self.seen = Some(seen);
                return Ok(false);
            }
        };
        seen.message_start_time = header.message_start_time;
        seen.message_end_time = header.message_end_time;
        seen.compression.clone_from(&header.compression);
        seen.compressed_size = header.compressed_size;
        seen.uncompressed_size = header.uncompressed_size;
        self.seen = Some(seen);
        let rest = body.get(encode_body(&header).len()..).unwrap_or_default();
        let Some(compressed) = usize::try_from(header.compressed_size).ok().and_then(|len| rest.get(..len))
        else {
            findings.wrong(
                head.offset,
                format_args!(
                    "the chunk claims {} compressed bytes, its record has {}",
                    header.compressed_size,
                    rest.len()
                ),
            );
            return Ok(false);
        };
        if let Err(error) = chunk::decompress(file, head.offset, &header, compressed, &mut self.records) {
            findings.wrong(head.offset, what_of(error)?);
            return Ok(false);
        }
        match chunk::check_crc(file, head.offset, &header, &self.records) {
            Err(error) => findings.wrong(head.offset, what_of(error)?),
            Ok(()) if header.uncompressed_crc == 0 => checked.chunks_without_checksum += 1,
            Ok(()) => checked.chunk_checksums_right += 1,
        }
        self.readable = true;
        self.read_records(head, &header, content, findings);
        Ok(self.readable)
    }

    fn read_records(
        &mut self,
        head: Head,
        header: &ChunkHeader,
        content: &mut Content,
        findings: &mut Findings,
    ) {
        let mut times: Option<(u64, u64)> = None;
        let mut at = 0;
        for record in records(&self.records) {
            let Ok(record) = record else {
                let what = format_args!(
                    "no whole record at byte {at} of the chunk's records, which have {} bytes",
                    self.records.len()
                );
                findings.wrong(head.offset, what);
                self.readable = false;
                return;
            };
            let place = Place { offset: head.offset, in_chunk: Some(at) };
            match record.opcode {
                op::SCHEMA => content.schema(place, record.body, findings),
                op::CHANNEL => content.channel(place, record.body, findings),
                op::MESSAGE => {
                    if let Some(message) = content.message(place, record.body, findings) {
                        let (first, last) = times.unwrap_or((message.log_time, message.log_time));
                        times = Some((first.min(message.log_time), last.max(message.log_time)));
                        self.messages.push((at, false));
                    }
                }
                // unknown ones are passed over, as the format asks
                0x10.. => {}
                other => findings.wrong(
                    head.offset,
                    format_args!(
                        "{}{place}, where only schemas, channels and messages may be",
                        name_of(other)
                    ),
                ),
            }
            at += record.whole.len() as u64;
        }
        let expected = times.unwrap_or_default();
        let claimed = (header.message_start_time, header.message_end_time);
        if claimed != expected {
            findings.wrong(
                head.offset,
                format_args!(
                    "the chunk's header says log times {} to {} ns, its messages have {} to {}",
                    claimed.0, claimed.1, expected.0, expected.1
                ),
            );
        }
    }

    /// Holds a message index behind the chunk against its messages.
    pub(super) fn index(&mut self, head: Head, body: &[u8], checked: &mut Checked, findings: &mut Findings) {
        let Some(seen) = &mut self.seen else {
            findings.wrong(head.offset, "a message index that stands behind no chunk");
            return;
        };
        seen.message_index_length += head.end() - head.offset;
        let Ok((id, len)) = parse::<(u16, u32)>(body) else {
            findings.wrong(head.offset, format_args!("message index of {} bytes, too short", body.len()));
            return;
        };
        if seen.message_index_offsets.insert(id, head.offset).is_some() {
            findings.wrong(head.offset, format_args!("a second message index of channel {id} for one chunk"));
        }
        let entries = body.get(6..).and_then(|rest| rest.get(..len as usize)).unwrap_or_default();
        if entries.len() != len as usize || !entries.len().is_multiple_of(16) {
            findings.wrong(
                head.offset,
                format_args!(
                    "the message index of channel {id} claims entries of {len} bytes, each has 16, there are {}",
                    body.len().saturating_sub(6)
                ),
            );
        }
        if !self.readable {
            return;
        }
        for entry in entries.chunks_exact(16) {
            let Ok((time, at)) = parse::<(u64, u64)>(entry) else { continue };
            checked.index_entries += 1;
            let Ok(place) = self.messages.binary_search_by_key(&at, |(start, _)| *start) else {
                findings.wrong(
                    head.offset,
                    format_args!("the message index of channel {id} leads to byte {at} of the chunk's records, where no message begins"),
                );
                continue;
            };
            let body = self.records.get(at as usize + 9..).unwrap_or_default();
            if let Ok(message) = parse::<MessageHeader>(body)
                && (message.channel_id, message.log_time) != (id, time)
            {
                findings.wrong(
                    head.offset,
                    format_args!(
                        "the message index says channel {id}, log time {time} ns, the message at byte {at} of the chunk's records is of channel {}, {} ns",
                        message.channel_id, message.log_time
                    ),
                );
            }
            if std::mem::replace(&mut self.messages[place].1, true) {
                findings.wrong(
                    head.offset,
                    format_args!("the message at byte {at} of the chunk's records is indexed again"),
                );
            }
        }
    }

    /// Ends the chunk, if there is one; the answer is what a chunk index should say of it.
    pub(super) fn close(&mut self, checked: &mut Checked, findings: &mut Findings) -> Option<ChunkIndex> {
        let seen = self.seen.take()?;
        if seen.message_index_offsets.is_empty() {
            checked.chunks_without_message_index += u64::from(!self.messages.is_empty());
        } else if self.readable {
            let mut left = self.messages.iter().filter(|(_, indexed)| !indexed);
            if let Some((at, _)) = left.next() {
                findings.wrong(
                    seen.chunk_start_offset,
                    format_args!(
                        "{} of the chunk's {} messages are in no message index, the first at byte {at} of its records",
                        1 + left.count(),
                        self.messages.len()
                    ),
                );
            }
        }
        self.messages.clear();
        Some(seen)
    }
}
