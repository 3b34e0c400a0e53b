//! How far a log is whole that can't be opened, so that a person knows what is left of it.

use std::fmt;
use std::path::Path;

use mcap::records::op;

use super::file::{HEAD_LEN, LogFile};
use super::{ReadOptions, chunk};
use crate::time::Time;

/// After so many records the search ends: some seconds. A recording of 50 GB has about a million.
const MOST_RECORDS: usize = 5_000_000;

/// The records from a file's start on that are not cut off; what they hold is not looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WholePart {
    /// Where the last of them ends.
    pub end: u64,
    /// Length of the file.
    pub file_len: u64,
    /// How many chunks are among them.
    pub chunks: usize,
    /// How many messages outside chunks.
    pub messages: usize,
    /// The first and the last log time of the chunks, ns.
    pub span: Option<(u64, u64)>,
    /// Whether the data section is whole.
    pub data_section: bool,
}

impl WholePart {
    /// Goes from record to record through the file; `None` where not even that can be begun.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let file = LogFile::open(path, ReadOptions::default()).ok()?;
        // The magic; whoever asks knows that it is there.
        let mut found = Self { end: 8, file_len: file.len, ..Self::default() };
        for _ in 0..MOST_RECORDS {
            let Ok(head) = file.head(found.end, file.len) else { break };
            match head.opcode {
                op::CHUNK => {
                    let Ok((header, _)) = chunk::read_header(&file, head.offset, head.end()) else { break };
                    found.chunks += 1;
                    let (start, end) = (header.message_start_time, header.message_end_time);
                    let (first, last) = found.span.unwrap_or((start, end));
                    found.span = Some((first.min(start), last.max(end)));
                }
                op::MESSAGE => found.messages += 1,
                op::DATA_END => {
                    found.data_section = true;
                    found.end = head.end();
                    break;
                }
                // no record of the format or of somebody's own
                0 | op::FOOTER => break,
                _ => {}
            }
            found.end = head.end();
        }
        (found.end > 8 + HEAD_LEN).then_some(found)
    }
}

impl fmt::Display for WholePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = if self.data_section { "its data section is whole" } else { "its records are whole" };
        let share = 100.0 * self.end as f64 / self.file_len.max(1) as f64;
        write!(
            f,
            "{part} up to byte {} of {} ({share:.0} %): {} chunks",
            self.end, self.file_len, self.chunks
        )?;
        let utc = |ns| Time::from_log(ns).map(Time::utc);
        if let Some((Some(first), Some(last))) = self.span.map(|(a, b)| (utc(a), utc(b))) {
            write!(f, " of {first} .. {last} UTC")?;
        }
        if self.messages > 0 {
            write!(f, ", {} messages outside chunks", self.messages)?;
        }
        write!(f, "; what they hold was not checked")
    }
}

#[cfg(test)]
mod tests {
    use super::super::Log;
    use super::super::fixture::{chunked, log, on_disk, records};
    use super::*;

    #[test]
    fn a_log_cut_off_anywhere_is_whole_up_to_its_last_record() {
        let bytes = log(chunked());
        let starts: Vec<(u8, usize)> = records(&bytes);
        for len in 9..bytes.len() - 50 {
            let (_dir, path) = on_disk(&bytes[..len]);
            let found = WholePart::of(&path).unwrap_or_default();
            let whole = starts.iter().zip(&starts[1..]).take_while(|(_, next)| next.1 <= len);
            let (chunks, end) =
                whole.fold((0, 8), |(n, _), (a, next)| (n + usize::from(a.0 == op::CHUNK), next.1));
            let data_end = starts.iter().find(|(opcode, _)| *opcode == op::DATA_END).unwrap().1 + 13;
            if found != WholePart::default() {
                assert_eq!((found.chunks, found.end), (chunks, end.min(data_end) as u64), "cut at {len}");
            }
        }
    }

    #[test]
    fn what_is_left_is_said_with_its_times() {
        let bytes = log(chunked());
        let (_dir, path) = on_disk(&bytes[..bytes.len() - 20]);
        assert!(Log::open(&path).is_err());
        let text = WholePart::of(&path).unwrap().to_string();
        assert!(text.starts_with("its data section is whole up to byte "), "{text}");
        assert!(text.contains("chunks of 1970-01-01 00:00:00.000 .. 1970-01-01 00:00:19.000 UTC;"), "{text}");
        assert_eq!(WholePart::of(Path::new("/nowhere")), None);
    }
}
