//! An attachment, which may be larger than the memory: its fields, and its data piece by piece.

use mcap::records::{AttachmentHeader, AttachmentIndex};

use super::super::LogError;
use super::super::file::{Head, parse};
use super::super::index::attachment_index;
use super::Checked;
use super::findings::{Findings, quoted};
use super::sequence::Sequence;

/// Enough for any name and media type.
const LONGEST_TEXT: u64 = 1 << 20;

/// Reads the attachment whose head was read last. The answer is what its index should say, `None` where its
/// fields can't be read.
pub(super) fn read(
    sequence: &mut Sequence<'_>,
    head: Head,
    checked: &mut Checked,
    findings: &mut Findings,
) -> Result<Option<AttachmentIndex>, LogError> {
    checked.attachments += 1;
    let (mut body, mut part) = (Vec::new(), Vec::new());
    // Two times, then two texts and the data, each behind its length.
    let mut need = 8 + 8 + 4;
    for next in [4_u64, 8, 0] {
        let left = head.end() - sequence.position;
        if need > left.min(LONGEST_TEXT).min(sequence.file.options.memory_limit) {
            let what = format_args!("the attachment's fields need {need} bytes, its record has {left} left");
            findings.wrong(head.offset, what);
            sequence.pass(left, |_| {})?;
            return Ok(None);
        }
        sequence.read_into(need, &mut part)?;
        body.extend_from_slice(&part);
        let len = part.last_chunk::<4>().map_or(0, |len| u32::from_le_bytes(*len));
        need = u64::from(len) + next;
    }
    let data_size = part.last_chunk::<8>().map_or(0, |len| u64::from_le_bytes(*len));
    let left = head.end() - sequence.position;
    if data_size.checked_add(4).is_none_or(|need| need > left) {
        let what =
            format_args!("the attachment claims {data_size} bytes and a CRC, its record has {left} left");
        findings.wrong(head.offset, what);
        sequence.pass(left, |_| {})?;
        return Ok(None);
    }
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&body);
    sequence.pass(data_size, |piece| hasher.update(piece))?;
    sequence.read_into(4, &mut part)?;
    let claimed = part.first_chunk::<4>().map_or(0, |crc| u32::from_le_bytes(*crc));
    sequence.pass(head.end() - sequence.position, |_| {})?;
    let header: Option<AttachmentHeader> = match parse(&body) {
        Ok(header) => Some(header),
        Err(problem) => {
            findings.wrong(head.offset, format_args!("attachment: {problem}"));
            None
        }
    };
    let found = hasher.finalize();
    if claimed == 0 {
        checked.attachments_without_checksum += 1;
    } else if found != claimed {
        let name = header.as_ref().map_or_else(String::new, |header| format!(" {}", quoted(&header.name)));
        findings.wrong(
            head.offset,
            format_args!("the attachment{name} has the CRC {found:08x}, its record says {claimed:08x}"),
        );
    }
    Ok(header.map(|header| attachment_index(head, header, data_size)))
}
