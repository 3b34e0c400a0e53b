//! The data section from record to record, and what the summary should say of it.

use std::collections::BTreeMap;

use mcap::records::{
    AttachmentIndex, ChunkIndex, DataEnd, Header, MessageHeader, Metadata, MetadataIndex, op,
};

use super::super::LogError;
use super::super::file::{Head, parse};
use super::chunk_content::OpenChunk;
use super::content::{Content, Place};
use super::findings::Findings;
use super::sequence::{Sequence, name_of};
use super::tail::Ending;
use super::{Checked, attachment};

/// Channel, sequence and two times of a message.
const MESSAGE_HEADER_LEN: u64 = 2 + 4 + 8 + 8;

/// How a data section ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum End {
    /// With its `DataEnd`.
    Whole,
    /// Without, where the summary begins.
    #[default]
    Missing,
    /// So damaged that where the summary begins is not known.
    Lost,
}

/// What was found in a data section. Indexes are as they should be, by offset.
#[derive(Debug, Default)]
pub(super) struct DataSection {
    pub(super) content: Content,
    pub(super) chunks: BTreeMap<u64, ChunkIndex>,
    pub(super) attachments: BTreeMap<u64, AttachmentIndex>,
    /// `None` where the record can't be read.
    pub(super) metadata: BTreeMap<u64, Option<MetadataIndex>>,
    /// Whether bytes were passed over that are no record.
    pub(super) has_holes: bool,
    /// Whether a chunk or a part of it can't be read.
    pub(super) has_unreadable: bool,
    pub(super) end: End,
    pub(super) findings: Findings,
    pub(super) not_checkable: Vec<String>,
    pub(super) checked: Checked,
}

impl DataSection {
    /// Goes through the data section, and stops behind its last record.
    pub(super) fn read(sequence: &mut Sequence<'_>, ending: Option<&Ending>) -> Result<Self, LogError> {
        let mut data = Self::default();
        let mut chunk = OpenChunk::default();
        let mut body = Vec::new();
        let mut expects_header = true;
        loop {
            let offset = sequence.position;
            if let Some(ending) = ending
                && offset >= ending.tail_start
            {
                data.findings.wrong(offset, "expected the end of the data section before the summary");
                break;
            }
            if sequence.left() == 0 {
                data.findings.wrong(offset, "the file ends within its data section: it was cut off");
                data.end = End::Lost;
                break;
            }
            let head = match sequence.head()? {
                Ok(head) => head,
                Err(problem) => {
                    data.has_holes = true;
                    if data.pass_over(sequence, ending, offset, &problem)? {
                        continue;
                    }
                    break;
                }
            };
            if expects_header && head.opcode != op::HEADER {
                data.findings
                    .wrong(offset, format_args!("expected a header, found {}", name_of(head.opcode)));
            }
            if head.opcode == op::FOOTER {
                data.findings.wrong(offset, "expected the end of the data section before the footer");
                // read again as part of the tail
                sequence.jump(offset)?;
                break;
            }
            let is_header = std::mem::take(&mut expects_header) && head.opcode == op::HEADER;
            // Records of others may stand among message indexes.
            if !matches!(head.opcode, op::MESSAGE_INDEX | 0x10..) {
                data.close(&mut chunk);
            }
            if is_header {
                data.small(sequence, head, &mut body)?;
                if let Err(problem) = parse::<Header>(&body) {
                    data.findings.wrong(offset, format_args!("header: {problem}"));
                }
                continue;
            }
            if data.record(sequence, head, &mut body, &mut chunk)? {
                data.end = End::Whole;
                break;
            }
        }
        data.close(&mut chunk);
        data.checked.messages = data.content.counted.message_count;
        Ok(data)
    }

    fn close(&mut self, chunk: &mut OpenChunk) {
        if let Some(seen) = chunk.close(&mut self.checked, &mut self.findings) {
            self.chunks.insert(seen.chunk_start_offset, seen);
        }
    }

    /// Reads one record. The answer is whether it was the end.
    fn record(
        &mut self,
        sequence: &mut Sequence<'_>,
        head: Head,
        body: &mut Vec<u8>,
        chunk: &mut OpenChunk,
    ) -> Result<bool, LogError> {
        let place = Place { offset: head.offset, in_chunk: None };
        match head.opcode {
            op::MESSAGE => {
                self.checked.loose_messages += 1;
                sequence.read_into(head.body_len.min(MESSAGE_HEADER_LEN), body)?;
                let _: Option<MessageHeader> = self.content.message(place, body, &mut self.findings);
                sequence.pass(head.end() - sequence.position, |_| {})?;
            }
            op::SCHEMA | op::CHANNEL | op::CHUNK | op::MESSAGE_INDEX | op::METADATA => {
                if !self.small(sequence, head, body)? {
                    return Ok(false);
                }
                let findings = &mut self.findings;
                match head.opcode {
                    op::SCHEMA => self.content.schema(place, body, findings),
                    op::CHANNEL => self.content.channel(place, body, findings),
                    op::CHUNK => {
                        let (content, checked) = (&mut self.content, &mut self.checked);
                        let whole = chunk.open(sequence.file, head, body, content, checked, findings)?;
                        self.has_unreadable |= !whole;
                    }
                    op::MESSAGE_INDEX => chunk.index(head, body, &mut self.checked, findings),
                    _ => self.metadata(head, body),
                }
            }
            op::ATTACHMENT => {
                let seen = attachment::read(sequence, head, &mut self.checked, &mut self.findings)?;
                self.attachments.extend(seen.map(|seen| (seen.offset, seen)));
            }
            op::DATA_END => {
                let found = sequence.crc_before_record();
                self.small(sequence, head, body)?;
                self.data_end(head, body, found);
                return Ok(true);
            }
            other => {
                if other < 0x10 {
                    let what =
                        format_args!("{} in the data section, where it doesn't belong", name_of(other));
                    self.findings.wrong(head.offset, what);
                }
                sequence.pass(head.body_len, |_| {})?;
            }
        }
        Ok(false)
    }

    /// Reads a record's body, unless it is too large for the memory.
    fn small(
        &mut self,
        sequence: &mut Sequence<'_>,
        head: Head,
        body: &mut Vec<u8>,
    ) -> Result<bool, LogError> {
        let limit = sequence.file.options.memory_limit;
        if head.body_len <= limit {
            sequence.read_into(head.body_len, body)?;
            return Ok(true);
        }
        self.has_unreadable = true;
        self.findings.wrong(
            head.offset,
            format_args!(
                "{} of {} bytes, more than the limit of {limit}, was not looked into",
                name_of(head.opcode),
                head.body_len
            ),
        );
        body.clear();
        sequence.pass(head.body_len, |_| {})?;
        Ok(false)
    }

    fn metadata(&mut self, head: Head, body: &[u8]) {
        self.checked.metadata += 1;
        let seen = match parse::<Metadata>(body) {
            Ok(metadata) => Some(MetadataIndex {
                offset: head.offset,
                length: head.end() - head.offset,
                name: metadata.name,
            }),
            Err(problem) => {
                self.findings.wrong(head.offset, format_args!("metadata: {problem}"));
                None
            }
        };
        self.metadata.insert(head.offset, seen);
    }

    fn data_end(&mut self, head: Head, body: &[u8], found: u32) {
        match parse::<DataEnd>(body) {
            Err(problem) => {
                self.findings.wrong(head.offset, format_args!("end of the data section: {problem}"));
            }
            Ok(DataEnd { data_section_crc: 0 }) => {
                self.not_checkable.push("the data section has no checksum".into());
            }
            Ok(DataEnd { data_section_crc }) => {
                self.checked.data_section = Some(found == data_section_crc);
                if found != data_section_crc {
                    self.findings.wrong(
                        head.offset,
                        format_args!(
                            "the data section's CRC is {found:08x}, its end says {data_section_crc:08x}"
                        ),
                    );
                }
            }
        }
    }

    /// Says that no record stands at `offset`, and goes on to the next that the summary tells of. The answer is
    /// whether there is one.
    fn pass_over(
        &mut self,
        sequence: &mut Sequence<'_>,
        ending: Option<&Ending>,
        offset: u64,
        problem: &str,
    ) -> Result<bool, LogError> {
        let next = match ending {
            Some(ending) => ending.next_record(sequence.file, offset)?,
            None => None,
        };
        if let Some(next) = next {
            self.findings.wrong(
                offset,
                format_args!("{problem}; went on at offset {next}, where the summary says a record stands"),
            );
            sequence.jump(next)?;
            return Ok(true);
        }
        self.end = End::Lost;
        let left = sequence.file.len - offset;
        self.findings.wrong(
            offset,
            format_args!(
                "{problem}; nothing tells where the next record is, {left} bytes were not looked into"
            ),
        );
        Ok(false)
    }
}
