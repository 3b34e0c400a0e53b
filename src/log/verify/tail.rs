//! What stands behind the data section: summary, summary offsets, footer, magic, and nothing more.

use std::cell::OnceCell;

use mcap::records::{AttachmentIndex, ChunkIndex, Footer, MetadataIndex, op};

use super::super::LogError;
use super::super::ending::MAGIC;
use super::super::file::{HEAD_LEN, Head, LogFile, parse};
use super::against::Summary;
use super::data_section::{DataSection, End};
use super::sequence::{Sequence, name_of};

/// Two starts and a checksum.
const FOOTER_BODY_LEN: u64 = 8 + 8 + 4;
/// `DataEnd` with its head.
const DATA_END_LEN: u64 = HEAD_LEN + 4;

/// The end of the file, where it is as it should be: it helps past what is broken before it.
#[derive(Debug)]
pub(super) struct Ending {
    /// Where summary, summary offsets or the footer begin, whichever comes first.
    pub(super) tail_start: u64,
    footer_start: u64,
    /// Opcode and offset of what the summary says stands in the data section, by offset.
    landmarks: OnceCell<Vec<(u64, u8)>>,
}

impl Ending {
    /// Looks at the last bytes of the file; `None` where they are no footer that can be believed.
    pub(super) fn of(file: &LogFile) -> Result<Option<Self>, LogError> {
        let magic_len = MAGIC.len() as u64;
        let Some(footer_start) = file.len.checked_sub(HEAD_LEN + FOOTER_BODY_LEN + magic_len) else {
            return Ok(None);
        };
        let magic = file.bytes(file.len - magic_len, magic_len, "the magic at the end")?;
        let Ok(head) = file.head(footer_start, file.len - magic_len) else { return Ok(None) };
        if magic != MAGIC || (head.opcode, head.body_len) != (op::FOOTER, FOOTER_BODY_LEN) {
            return Ok(None);
        }
        let footer = file.bytes(head.body(), head.body_len, "the footer")?;
        let Ok(footer) = parse::<Footer>(&footer) else { return Ok(None) };
        let starts = [footer.summary_start, footer.summary_offset_start];
        let tail_start = starts.into_iter().find(|&start| start != 0).unwrap_or(footer_start);
        let ending = Self { tail_start, footer_start, landmarks: OnceCell::new() };
        let believed = tail_start >= magic_len
            && tail_start <= footer_start
            && (ending.data_end(file).is_some() || ending.heads(file).is_some());
        Ok(believed.then_some(ending))
    }

    /// Where `DataEnd` stands, if it is right before the summary.
    fn data_end(&self, file: &LogFile) -> Option<u64> {
        let offset = self.tail_start.checked_sub(DATA_END_LEN)?;
        let head = file.head(offset, self.tail_start).ok()?;
        ((head.opcode, head.end()) == (op::DATA_END, self.tail_start)).then_some(offset)
    }

    /// The records before the footer, `None` where they are not all what a summary has.
    fn heads(&self, file: &LogFile) -> Option<Vec<Head>> {
        let (mut heads, mut offset) = (Vec::new(), self.tail_start);
        while offset < self.footer_start {
            let head = file.head(offset, self.footer_start).ok().filter(|head| is_of_summary(head.opcode))?;
            offset = head.end();
            heads.push(head);
        }
        Some(heads)
    }

    /// The first record behind `offset` that the summary tells of and that does stand there, else the end of the
    /// data section; `None` where all that is behind `offset`.
    pub(super) fn next_record(&self, file: &LogFile, offset: u64) -> Result<Option<u64>, LogError> {
        if self.landmarks.get().is_none() {
            let _ = self.landmarks.set(self.landmarks(file)?);
        }
        let landmarks = self.landmarks.get().map_or(&[][..], Vec::as_slice);
        let behind = landmarks.partition_point(|(at, _)| *at <= offset);
        let stands = |&&(at, opcode): &&(u64, u8)| {
            file.head(at, self.tail_start).is_ok_and(|head| head.opcode == opcode)
        };
        let next = landmarks.get(behind..).unwrap_or_default().iter().find(stands).map(|(at, _)| *at);
        let ends = [next, self.data_end(file), Some(self.tail_start)];
        Ok(ends.into_iter().flatten().find(|&next| next > offset))
    }

    fn landmarks(&self, file: &LogFile) -> Result<Vec<(u64, u8)>, LogError> {
        let mut landmarks = Vec::new();
        for head in self.heads(file).unwrap_or_default() {
            // The rest of a chunk index, which grows with its channels, is not needed.
            let len = head.body_len.min(1 << 20);
            if !matches!(head.opcode, op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX) {
                continue;
            }
            let body = file.bytes(head.body(), len, "a record of the summary")?;
            landmarks.extend(match head.opcode {
                op::CHUNK_INDEX => {
                    parse::<ChunkIndex>(&body).ok().map(|index| (index.chunk_start_offset, op::CHUNK))
                }
                op::ATTACHMENT_INDEX => {
                    parse::<AttachmentIndex>(&body).ok().map(|index| (index.offset, op::ATTACHMENT))
                }
                _ => parse::<MetadataIndex>(&body).ok().map(|index| (index.offset, op::METADATA)),
            });
        }
        landmarks.sort_unstable();
        Ok(landmarks)
    }
}

fn is_of_summary(opcode: u8) -> bool {
    matches!(
        opcode,
        op::SCHEMA
            | op::CHANNEL
            | op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::STATISTICS
            | op::METADATA_INDEX
            | op::SUMMARY_OFFSET
            | 0x10..
    )
}

/// Reads on from the end of the data section to the end of the file, and holds the summary against `data`.
pub(super) fn check(
    sequence: &mut Sequence<'_>,
    ending: Option<&Ending>,
    data: &mut DataSection,
) -> Result<(), LogError> {
    if data.end == End::Lost {
        data.not_checkable.push("the summary, which was not found".into());
        return Ok(());
    }
    if let Some(ending) = ending
        && sequence.position > ending.tail_start
        && data.end == End::Missing
    {
        sequence.jump(ending.tail_start)?;
    }
    sequence.restart_crc();
    let mut summary = Summary::new(sequence.position);
    let mut body = Vec::new();
    loop {
        let offset = sequence.position;
        if sequence.left() == 0 {
            data.findings.wrong(offset, "the file ends without a footer: it was cut off");
            return Ok(());
        }
        let head = match sequence.head()? {
            Ok(head) => head,
            Err(problem) => {
                summary.has_holes = true;
                data.findings.wrong(offset, format_args!("in the summary: {problem}"));
                match ending.filter(|ending| ending.footer_start > offset) {
                    Some(ending) => sequence.jump(ending.footer_start)?,
                    None => return Ok(()),
                }
                continue;
            }
        };
        if head.opcode == op::FOOTER {
            footer(sequence, head, &summary, data)?;
            break;
        }
        if !is_of_summary(head.opcode) {
            let what = format_args!("{} in the summary, where it doesn't belong", name_of(head.opcode));
            data.findings.wrong(offset, what);
        }
        if head.body_len > sequence.file.options.memory_limit {
            summary.has_holes = true;
            data.findings.wrong(offset, "a record of the summary larger than the limit was not looked into");
            sequence.pass(head.body_len, |_| {})?;
        } else {
            sequence.read_into(head.body_len, &mut body)?;
            summary.record(head, &body, data);
        }
    }
    summary.finish(data);
    magic(sequence, data)
}

fn footer(
    sequence: &mut Sequence<'_>,
    head: Head,
    summary: &Summary,
    data: &mut DataSection,
) -> Result<(), LogError> {
    if head.body_len != FOOTER_BODY_LEN {
        let what = format_args!("the footer has {} bytes, expected {FOOTER_BODY_LEN}", head.body_len);
        data.findings.wrong(head.offset, what);
        return sequence.pass(head.body_len, |_| {});
    }
    let (mut body, mut crc_field) = (Vec::new(), Vec::new());
    sequence.read_into(FOOTER_BODY_LEN - 4, &mut body)?;
    // The checksum counts all before itself.
    let found = sequence.crc();
    sequence.read_into(4, &mut crc_field)?;
    let (Ok((summary_start, offset_start)), Ok(claimed)) =
        (parse::<(u64, u64)>(&body), parse::<u32>(&crc_field))
    else {
        return Ok(());
    };
    summary.starts(head, summary_start, offset_start, data);
    if claimed == 0 {
        data.not_checkable.push("the summary has no checksum".into());
    } else {
        data.checked.summary = Some(found == claimed);
        if found != claimed {
            let what = format_args!("the summary's CRC is {found:08x}, the footer says {claimed:08x}");
            data.findings.wrong(head.offset, what);
        }
    }
    Ok(())
}

fn magic(sequence: &mut Sequence<'_>, data: &mut DataSection) -> Result<(), LogError> {
    let offset = sequence.position;
    let mut end = Vec::new();
    sequence.read_into(sequence.left().min(MAGIC.len() as u64), &mut end)?;
    if end != MAGIC {
        let what = format_args!(
            "the file ends with \"{}\", expected \"{}\" behind the footer",
            end.escape_ascii(),
            MAGIC.escape_ascii()
        );
        data.findings.wrong(offset, what);
    }
    let left = sequence.left();
    if left > 0 {
        let what = format_args!("{left} bytes stand behind the end of the log");
        data.findings.wrong(sequence.position, what);
        sequence.pass(left, |_| {})?;
    }
    Ok(())
}
