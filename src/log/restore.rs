//! The original of a log that was added to, bit for bit.

use std::io::{self, Read};
use std::path::Path;

use mcap::records::{DataEnd, op};

use super::checksum::crc_of_start;
use super::copying::copy_start;
use super::file::{At, LogFile};
use super::index::read_record;
use super::interrupt::Writing;
use super::new_file::{check_name, publish, readable_by_the_same, temporary_beside};
use super::output::{check_output, copy_behind, ensure_in_place, is_same_file};
use super::undo::{self, Undo, for_each_piece};
use super::{Log, LogError, ReadOptions, old_tail};

/// What the metadata record of an addition is called.
const METADATA: &str = "trackfuse:";

/// One addition of this program to a log, and the original before it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Addition {
    /// Where it begins: the original's data section ends here.
    pub offset: u64,
    /// Length of the original in bytes.
    pub original_len: u64,
    /// Where the first record begins that another program appended since: taking the addition off takes it away
    /// too.
    pub appended_by_others: Option<u64>,
    /// Where the attachment with the original's end begins.
    attached_at: u64,
    /// Where the original's end stands in the log.
    tail_at: u64,
    /// Where the next addition begins.
    end: u64,
}

impl Addition {
    fn tail_len(&self) -> u64 {
        self.original_len - self.offset
    }
}

impl Log {
    /// What this program added to the log, first to last.
    ///
    /// # Errors
    /// [`LogError::NothingAdded`]; [`LogError::Read`]; [`LogError::Damaged`] where an addition is not as it was
    /// written.
    pub fn additions(&self) -> Result<Vec<Addition>, LogError> {
        let index = self.index();
        let mut additions: Vec<Addition> = Vec::new();
        let mut moved = false;
        for found in &index.attachments {
            let Some(data_end) = old_tail::data_end(found) else { continue };
            if !self.only_message_indexes(data_end, found.offset) {
                moved = true;
                continue;
            }
            // What the index claims may be more than there is.
            let tail_len = found.data_size.min(found.length);
            let head = old_tail::head(data_end, tail_len);
            let stands = self.file.bytes(found.offset, head.len() as u64, "an attachment")?;
            if stands != head {
                return Err(self.file.damaged(found.offset, "the attachment with the original's end"));
            }
            if let Some(before) = additions.last_mut() {
                before.end = data_end;
            }
            additions.push(Addition {
                offset: data_end,
                original_len: data_end.saturating_add(tail_len),
                appended_by_others: None,
                attached_at: found.offset,
                tail_at: found.offset + head.len() as u64,
                end: index.data_end,
            });
        }
        if additions.is_empty() {
            return Err(LogError::NothingAdded { path: self.path().to_owned(), moved });
        }
        let mut later = None;
        for addition in additions.iter_mut().rev() {
            later = self.others_within(addition).or(later);
            addition.appended_by_others = later;
        }
        Ok(additions)
    }

    /// Where records of another program begin between an addition and the next: attachments and metadata that
    /// bear their own names, and whatever stands behind the metadata that an addition ends with.
    fn others_within(&self, addition: &Addition) -> Option<u64> {
        let within = addition.attached_at..addition.end;
        let index = self.index();
        let attachments = index.attachments.iter().map(|a| (a.offset, &a.name));
        let named = attachments.chain(index.metadata.iter().map(|m| (m.offset, &m.name)));
        let others = named.filter(|(at, name)| within.contains(at) && !name.starts_with(METADATA));
        let ours =
            index.metadata.iter().rfind(|m| within.contains(&m.offset) && m.name.starts_with(METADATA));
        let end = ours.map(|m| m.offset.saturating_add(m.length)).filter(|&end| end < addition.end);
        others.map(|(at, _)| at).chain(end).min()
    }

    /// Whether nothing but message indexes stands in the file from `start` to `end`.
    fn only_message_indexes(&self, start: u64, end: u64) -> bool {
        let mut at = start;
        while at < end {
            match self.file.head(at, end) {
                Ok(head) if head.opcode == op::MESSAGE_INDEX => at = head.end(),
                _ => return false,
            }
        }
        at == end
    }

    /// Holds the original's end against its checksum, and its length against what was noted of it.
    fn verify(&self, addition: &Addition) -> Result<(), LogError> {
        let Addition { offset, attached_at, tail_at, .. } = *addition;
        let tail_len = addition.tail_len();
        let cannot = |source| LogError::Read { path: self.path().to_owned(), offset: tail_at, source };
        let mut crc = crc32fast::Hasher::new();
        crc.update(old_tail::summed(&old_tail::head(offset, tail_len)));
        for_each_piece(self.file.reader(tail_at), tail_len, |_, piece| {
            crc.update(piece);
            Ok(())
        })
        .map_err(cannot)?;
        let mut said = [0; 4];
        self.file.reader(tail_at + tail_len).read_exact(&mut said).map_err(cannot)?;
        let (found, said) = (crc.finalize(), u32::from_le_bytes(said));
        if found != said {
            let what =
                format!("the CRC of the original's end is {found:08x}, the attachment says {said:08x}");
            return Err(self.file.damaged(attached_at, what));
        }
        let of_this = |m: &&super::MetadataIndex| {
            m.name.starts_with(METADATA) && (addition.offset..addition.end).contains(&m.offset)
        };
        for entry in self.index().metadata.iter().filter(of_this) {
            let noted = self.metadata_at(entry)?.get("input_size").and_then(|size| size.parse::<u64>().ok());
            if let Some(size) = noted.filter(|&size| size != addition.original_len) {
                let what = format!(
                    "the original would have {} bytes, {:?} says {size}",
                    addition.original_len, entry.name
                );
                return Err(self.file.damaged(entry.offset, what));
            }
        }
        Ok(())
    }

    /// Whether the original's data section is as its `DataEnd` says; `None` where that says nothing.
    fn check_data_section(&self, addition: &Addition) -> Result<Option<bool>, LogError> {
        let end = self.file.head(addition.tail_at, addition.tail_at + addition.tail_len());
        let Some(end) = end.ok().filter(|head| head.opcode == op::DATA_END && head.body_len >= 4) else {
            return Ok(None);
        };
        match read_record(&self.file, end, "data end")? {
            DataEnd { data_section_crc: 0 } => Ok(None),
            DataEnd { data_section_crc } => {
                Ok(Some(crc_of_start(&self.file, addition.offset)? == data_section_crc))
            }
        }
    }

    /// Writes the original before an addition to a new file. The answer is whether its data section is as its
    /// checksum says, `None` where it has none; the log is read once for that.
    ///
    /// # Errors
    /// [`LogError::Damaged`] when it can't be the original; errors of [`super::write_new`].
    pub fn restore_to(&self, addition: &Addition, out: &Path, force: bool) -> Result<Option<bool>, LogError> {
        check_output(self, out, force)?;
        self.verify(addition)?;
        let is_right = self.check_data_section(addition)?;
        let tail = self.file.reader(addition.tail_at);
        write_original(&self.file, addition.offset, tail, addition.tail_len(), (out, force))?;
        Ok(is_right)
    }

    /// Makes the log, opened with [`Log::open_in_place`], the original before an addition.
    ///
    /// # Errors
    /// [`LogError::Damaged`] when that can't be the original; [`LogError::NotInPlace`], also where another program
    /// appended something since, which would be lost; [`LogError::Write`], and then the log is as it was;
    /// [`LogError::NotPutBack`].
    pub fn restore_in_place(self, addition: &Addition) -> Result<(), LogError> {
        ensure_in_place(&self)?;
        if let Some(at) = addition.appended_by_others {
            let why = format!("another program appended to it, from offset {at} on, which would be lost");
            return Err(LogError::NotInPlace { path: self.path().to_owned(), source: io::Error::other(why) });
        }
        self.verify(addition)?;
        let _writing = Writing::begin();
        // What was added goes by the same way as what a run that is cut off leaves behind.
        let tail = self.file.reader(addition.tail_at);
        let undo = Undo::create(&self.file, addition.original_len, addition.offset, tail)?;
        undo.put_back(&self.file.file)
            .map_err(|source| LogError::NotPutBack { path: self.path().to_owned(), source })
    }
}

/// Writes the original of a log that a run was cut off in to a new file, and leaves all else as it is.
/// The answer is its length, `None` where no run was cut off.
///
/// # Errors
/// [`LogError::InUse`] while that run goes on; [`LogError::BadUndo`]; errors of [`super::write_new`].
pub fn restore_pending_to(path: &Path, out: &Path, force: bool) -> Result<Option<u64>, LogError> {
    let Some(pending) = undo::pending(path) else { return Ok(None) };
    let log = LogFile::open_shared(path, ReadOptions::default())?;
    if is_same_file(&log.file, path, out) {
        return Err(LogError::OutputIsInput { path: out.to_owned() });
    }
    check_name(out, force)?;
    let undo = Undo::read(&pending, &log)?;
    let (len, start) = (undo.original_len, undo.tail_start());
    write_original(&log, start, undo.tail(), len - start, (out, force))?;
    Ok(Some(len))
}

fn write_original(
    log: &LogFile,
    data_end: u64,
    tail: At<'_>,
    tail_len: u64,
    (out, force): (&Path, bool),
) -> Result<(), LogError> {
    let _writing = Writing::begin();
    let file = temporary_beside(out, readable_by_the_same(&log.file))?;
    copy_start(log, data_end, file.as_file(), out)?;
    copy_behind(tail, tail_len, file.as_file(), data_end, out)?;
    publish(file, out, force)
}
