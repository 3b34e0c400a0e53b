//! The new summary: every old record as it stood, and the new ones in their groups.

use std::io::Cursor;

use binrw::{BinWrite, BinWriterExt};
use mcap::records::{Header, Statistics, SummaryOffset, op};

use super::Index;
use super::file::HEAD_LEN;
use super::index::SummaryRecord;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// What a log of this profile begins with.
pub(super) fn start(profile: &str) -> Vec<u8> {
    let library = format!("trackfuse {}", env!("CARGO_PKG_VERSION"));
    let header = Header { profile: profile.to_owned(), library };
    [MAGIC, &encode(op::HEADER, &header)].concat()
}

/// A record of `body`.
pub(super) fn encode_bytes(opcode: u8, body: &[&[u8]]) -> Vec<u8> {
    let len: usize = body.iter().map(|part| part.len()).sum();
    let mut bytes = Vec::with_capacity(len + HEAD_LEN as usize);
    bytes.push(opcode);
    bytes.extend((len as u64).to_le_bytes());
    for part in body {
        bytes.extend_from_slice(part);
    }
    bytes
}

/// A record of `fields`.
pub(super) fn encode<T>(opcode: u8, fields: &T) -> Vec<u8>
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    encode_bytes(opcode, &[&encode_body(fields)])
}

pub(super) fn encode_body<T>(fields: &T) -> Vec<u8>
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    let mut body = Vec::new();
    let written = Cursor::new(&mut body).write_le(fields);
    debug_assert!(written.is_ok(), "memory takes any record");
    body
}

/// Everything behind `DataEnd`: summary, summary offsets, footer, magic.
///
/// `start` is where it will stand, `statistics` count old and new together; of the chunks it names those whose
/// start `is_named`.
pub(super) fn tail(
    old: &Index,
    new: &[SummaryRecord],
    statistics: &Statistics,
    start: u64,
    is_named: impl Fn(u64) -> bool,
) -> Vec<u8> {
    let statistics = [statistics_record(old, statistics)];
    let kept = old.summary.iter().filter(|record| record.opcode != op::STATISTICS);
    let is_named = |record: &&SummaryRecord| record.chunk_start_offset().is_none_or(&is_named);
    let records: Vec<_> = kept.chain(&statistics).chain(new).filter(is_named).collect();

    // Readers take counts by channel from the statistics, so channels must come before them.
    let mut groups = vec![op::SCHEMA, op::CHANNEL];
    let order = old.summary.iter().chain(&statistics).chain(new);
    for opcode in order.map(|record| record.opcode) {
        if !groups.contains(&opcode) {
            groups.push(opcode);
        }
    }

    let mut tail = Vec::new();
    let mut offsets = Vec::new();
    for opcode in groups {
        let group_start = start + tail.len() as u64;
        for record in records.iter().filter(|record| record.opcode == opcode) {
            tail.extend_from_slice(&record.bytes);
        }
        let group_length = start + tail.len() as u64 - group_start;
        if group_length > 0 {
            let offset = SummaryOffset { group_opcode: opcode, group_start, group_length };
            offsets.extend(encode(op::SUMMARY_OFFSET, &offset));
        }
    }
    let offset_start = start + tail.len() as u64;
    tail.extend(offsets);
    footed(tail, start, offset_start)
}

/// Footer and magic alone, of a log without a summary.
pub(super) fn no_tail() -> Vec<u8> {
    footed(Vec::new(), 0, 0)
}

fn footed(mut tail: Vec<u8>, summary_start: u64, summary_offset_start: u64) -> Vec<u8> {
    // The CRC spans the footer too, up to itself.
    tail.push(op::FOOTER);
    tail.extend(20_u64.to_le_bytes());
    tail.extend(summary_start.to_le_bytes());
    tail.extend(summary_offset_start.to_le_bytes());
    tail.extend(crc32fast::hash(&tail).to_le_bytes());
    tail.extend_from_slice(MAGIC);
    tail
}

/// The statistics in place of the old ones, with the bytes that others put behind their fields.
fn statistics_record(old: &Index, statistics: &Statistics) -> SummaryRecord {
    let record = old.summary.iter().rfind(|record| record.opcode == op::STATISTICS);
    let known = old.statistics.as_ref().map_or(0, |old| encode(op::STATISTICS, old).len());
    let padding = record.and_then(|record| record.bytes.get(known..)).unwrap_or_default();
    SummaryRecord {
        opcode: op::STATISTICS,
        bytes: encode_bytes(op::STATISTICS, &[&encode_body(statistics), padding]),
    }
}
