//! Where a log's data section ends, and the summary behind it.
//!
//! The footer tells, at the file's end. Where that is missing or contradicts itself, the records tell: one after
//! the other from the start, until one ends the data section, is cut off, or is none. A summary whose checksum is
//! wrong isn't used at all.

use std::ops::Range;

use mcap::records::{DataEnd, Footer, op};

use super::damage::Damages;
use super::file::{HEAD_LEN, Head, LogFile};
use super::index::read_record;
use super::{LogError, chunk};

pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
pub(super) const MAGIC_LEN: u64 = MAGIC.len() as u64;
/// Summary start, summary offset start, CRC.
const FOOTER_BODY_LEN: u64 = 8 + 8 + 4;
/// Footer and magic, behind the summary.
const FOOT_LEN: u64 = HEAD_LEN + FOOTER_BODY_LEN + MAGIC_LEN;
const DATA_END_BODY_LEN: u64 = 4;
/// `DataEnd` with its head, right before the summary.
pub(super) const DATA_END_LEN: u64 = HEAD_LEN + DATA_END_BODY_LEN;

/// How a log ends.
#[derive(Debug, Default)]
pub(super) struct Ending {
    /// Where the data section ends: at `DataEnd`, else behind the last whole record.
    pub(super) data_end: u64,
    /// Whether no `DataEnd` stands there, be it that the data section was cut off.
    pub(super) is_cut: bool,
    /// What `DataEnd` says.
    pub(super) data_section_crc: Option<u32>,
    /// Where the summary begins.
    pub(super) summary_start: Option<u64>,
    /// The summary's CRC, found right.
    pub(super) summary_crc: Option<u32>,
    /// Whether something stands in the summary's place that can't be trusted.
    pub(super) distrusted: bool,
    /// The summary's records, in one piece.
    pub(super) records: Vec<u8>,
    /// A chunk that begins at `data_end` and is cut off.
    pub(super) cut_chunk: Option<chunk::CutChunk>,
}

/// Finds the end of the log whose first record after the header is at `data_start`.
pub(super) fn find(file: &LogFile, data_start: u64, damages: &mut Damages) -> Result<Ending, LogError> {
    let mut found = Damages::default();
    if let Some(ending) = found.note(read(file, data_start, file.len, damages))? {
        return Ok(ending);
    }
    let walked = walk(file, data_start..file.len)?;
    if let Some(head) = walked.data_end {
        // All may be there, and something else behind it.
        if let Some(end) = end_of_footer(file, head.end())?.filter(|&end| end < file.len)
            && let Ok(ending) = read(file, data_start, end, damages)
            && ending.data_end == head.offset
        {
            damages.push(end, format!("{} bytes stand behind the log's end", file.len - end));
            return Ok(ending);
        }
        damages.found.append(&mut found.found);
        let crc: DataEnd = read_record(file, head, "data end")?;
        let data_section_crc = Some(crc.data_section_crc).filter(|&crc| crc != 0);
        return Ok(Ending { data_end: head.offset, data_section_crc, distrusted: true, ..Ending::default() });
    }
    // That a log which is cut off lacks its last bytes is no news.
    found.found.retain(|damage| damage.offset < file.len - MAGIC_LEN);
    damages.found.append(&mut found.found);
    let cut_chunk = chunk::look_at_cut(file, walked.at)?;
    let left = file.len - walked.at;
    damages.push(
        walked.at,
        match left {
            0 => "the log is cut off here, behind a whole record".to_owned(),
            _ if cut_chunk.is_some() => format!("the log is cut off: of a chunk only {left} bytes are left"),
            _ => format!("the log is cut off: its last {left} bytes are no whole records ({})", walked.why),
        },
    );
    Ok(Ending { data_end: walked.at, is_cut: true, distrusted: true, cut_chunk, ..Ending::default() })
}

/// The ending by a footer and magic that end at `end`; [`LogError::Damaged`] where it can't be trusted.
fn read(file: &LogFile, data_start: u64, end: u64, damages: &mut Damages) -> Result<Ending, LogError> {
    let footer_start = end.saturating_sub(FOOT_LEN);
    if footer_start < data_start + DATA_END_LEN {
        return Err(file.damaged(end, "the log ends without a footer"));
    }
    if file.bytes(end - MAGIC_LEN, MAGIC_LEN, "the magic at the end")? != MAGIC {
        return Err(file.damaged(end - MAGIC_LEN, "the magic at the log's end is missing"));
    }
    let footer_head = file.head(footer_start, end - MAGIC_LEN)?;
    if (footer_head.opcode, footer_head.body_len) != (op::FOOTER, FOOTER_BODY_LEN) {
        return Err(file.damaged(footer_start, "expected the footer"));
    }
    let footer: Footer = read_record(file, footer_head, "footer")?;

    // Without a summary, DataEnd stands before what follows in its place.
    let starts = [footer.summary_start, footer.summary_offset_start, footer_start];
    let tail_start = starts.into_iter().find(|&start| start != 0).unwrap_or(footer_start);
    let records_end =
        if footer.summary_offset_start == 0 { footer_start } else { footer.summary_offset_start };
    if tail_start < data_start + DATA_END_LEN || tail_start > records_end || records_end > footer_start {
        let what = format!("the footer's summary [{tail_start}, {records_end}) is not before the footer");
        return Err(file.damaged(footer_start, what));
    }
    let at = tail_start - DATA_END_LEN;
    let data_end = data_end_at(file, at, tail_start);
    // The CRC spans the summary and the footer up to the CRC itself.
    let tail_len = end - MAGIC_LEN - 4 - tail_start;
    // One that is too large to be checked is no better than one without a checksum.
    if data_end.is_none() && (footer.summary_crc == 0 || tail_len > file.options.memory_limit) {
        return Err(file.damaged(at, "expected the end of the data section before the summary"));
    }

    let mut records = file.bytes(tail_start, tail_len, "the summary")?;
    let found = crc32fast::hash(&records);
    if footer.summary_crc != 0 && footer.summary_crc != found {
        let what = format!("the summary's CRC is {found:08x}, the footer says {:08x}", footer.summary_crc);
        return Err(file.damaged(tail_start, what));
    }
    let walked = match data_end {
        Some(head) => Walked { at: head.offset, data_end, why: String::new() },
        None => walk_to_summary(file, data_start, at..tail_start)?,
    };
    let crc = walked.data_end.map(|head| read_record::<DataEnd>(file, head, "data end")).transpose()?;
    if crc.is_none() {
        damages.push(walked.at, "expected the end of the data section before the summary");
    }
    records.truncate((records_end - tail_start) as usize);
    Ok(Ending {
        data_end: walked.at,
        is_cut: crc.is_none(),
        data_section_crc: crc.map(|crc| crc.data_section_crc).filter(|&crc| crc != 0),
        summary_start: Some(footer.summary_start).filter(|&start| start != 0),
        summary_crc: Some(footer.summary_crc).filter(|&crc| crc != 0),
        records,
        ..Ending::default()
    })
}

/// Where the records end before a summary that can be trusted, though no `DataEnd` stands in its `place`, which
/// ends with the data section.
fn walk_to_summary(file: &LogFile, data_start: u64, place: Range<u64>) -> Result<Walked, LogError> {
    let before = walk(file, data_start..place.start)?;
    if before.at == place.start {
        // What stands in its place is it, broken, and no record of the data section.
        return Ok(before);
    }
    // It may have bytes behind its fields, as any record, or not be there at all.
    let walked = walk(file, before.at..place.end)?;
    match walked.data_end {
        Some(head) if head.end() == place.end => Ok(walked),
        // Garbage ends the walk, but not what the summary names.
        _ if walked.at < place.start => Ok(Walked { at: place.end, data_end: None, ..walked }),
        _ => Ok(Walked { data_end: None, ..walked }),
    }
}

fn data_end_at(file: &LogFile, at: u64, end: u64) -> Option<Head> {
    let head = file.head(at, end).ok()?;
    ((head.opcode, head.body_len) == (op::DATA_END, DATA_END_BODY_LEN)).then_some(head)
}

/// Where the footer's magic ends, going from record to record.
fn end_of_footer(file: &LogFile, summary_start: u64) -> Result<Option<u64>, LogError> {
    let mut position = summary_start;
    loop {
        let head = match file.head(position, file.len) {
            Ok(head) => head,
            Err(LogError::Damaged { .. }) => return Ok(None),
            Err(other) => return Err(other),
        };
        if head.opcode == op::FOOTER {
            return Ok(head.end().checked_add(MAGIC_LEN).filter(|&end| end <= file.len));
        }
        position = head.end();
    }
}

/// How far the records of a data section go.
struct Walked {
    /// Behind the last of them.
    at: u64,
    /// The record that ends them.
    data_end: Option<Head>,
    /// What stands there instead.
    why: String,
}

/// Goes from record to record until one ends the data section, or is none of it.
fn walk(file: &LogFile, range: Range<u64>) -> Result<Walked, LogError> {
    let mut at = range.start;
    let why = loop {
        let head = match file.head(at, range.end) {
            Ok(head) => head,
            Err(LogError::Damaged { what, .. }) => break what,
            Err(other) => return Err(other),
        };
        if head.opcode == op::DATA_END && head.body_len >= DATA_END_BODY_LEN {
            return Ok(Walked { at, data_end: Some(head), why: String::new() });
        }
        if !may_stand_in_data(head.opcode) {
            break format!("opcode {:#04x} is none of the data section", head.opcode);
        }
        at = head.end();
    };
    Ok(Walked { at, data_end: None, why })
}

/// Whether the format has such records in a data section: its own, reserved ones and those of others.
pub(super) fn may_stand_in_data(opcode: u8) -> bool {
    matches!(
        opcode,
        op::SCHEMA
            | op::CHANNEL
            | op::MESSAGE
            | op::CHUNK
            | op::MESSAGE_INDEX
            | op::ATTACHMENT
            | op::METADATA
            | 0x10..
    )
}
