//! A log, open for reading: whatever of it can be trusted, and what is wrong with the rest.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::Read,
    path::Path,
};

use mcap::records::{Header, MetadataIndex, op};

use super::damage::{Damage, Damages};
use super::ending::{self, DATA_END_LEN, Ending, MAGIC, MAGIC_LEN};
use super::file::{HEAD_LEN, Head, LogFile};
use super::index::{SummaryRecord, read_record};
use super::visibility::Visibility;
use super::{Index, LogError, ReadOptions, chunk, output, survey, undo};

/// A recording, open for reading.
#[derive(Debug)]
pub struct Log {
    pub(super) file: LogFile,
    index: Index,
    visibility: Visibility,
    damage: Vec<Damage>,
}

impl Log {
    /// Opens a log and reads what is in it.
    ///
    /// Takes time by the number of chunks, not by their size, unless the summary leaves out channels, schemas or
    /// statistics, or can't be trusted: then every chunk is read once. What is wrong with the log stands in
    /// [`Log::damage`].
    ///
    /// # Errors
    /// [`LogError::Open`]; [`LogError::Read`]; [`LogError::NotMcap`]; [`LogError::CutOff`] and
    /// [`LogError::Damaged`] where not even the header is whole; [`LogError::TooLarge`] where a record that must
    /// be read takes more than 1 GiB; [`LogError::Pending`] when a run that added to it was cut off,
    /// [`LogError::InUse`] while one goes on.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        Self::open_with(path, ReadOptions::default())
    }

    /// Opens a log that is to be read as `options` say: see [`Log::open`].
    ///
    /// # Errors
    /// As [`Log::open`].
    pub fn open_with(path: impl AsRef<Path>, options: ReadOptions) -> Result<Self, LogError> {
        Self::of(LogFile::open(path.as_ref(), options)?)
    }

    /// Opens a log to add to it in place: see [`super::Destination::InPlace`]. Until it is dropped nobody else
    /// can open it by this library.
    ///
    /// # Errors
    /// As [`Log::open`]; [`LogError::NotInPlace`] for a log that can't be written or locked.
    pub fn open_in_place(path: impl AsRef<Path>) -> Result<Self, LogError> {
        Self::open_in_place_with(path, ReadOptions::default())
    }

    /// Opens a log to add to it in place, and reads it as `options` say.
    ///
    /// # Errors
    /// As [`Log::open_in_place`].
    pub fn open_in_place_with(path: impl AsRef<Path>, options: ReadOptions) -> Result<Self, LogError> {
        let file = LogFile::open_exclusive(path.as_ref(), options)?;
        undo::refuse_pending(path.as_ref())?;
        Self::of(file)
    }

    fn of(file: LogFile) -> Result<Self, LogError> {
        let header_head = check_magic(&file)?;
        let header: Header = read_record(&file, header_head, "header")?;
        let mut damages = Damages::default();
        let ending = ending::find(&file, header_head.end(), &mut damages)?;
        let mut index = Index {
            profile: header.profile,
            library: header.library,
            data_start: header_head.end(),
            file_len: file.len,
            ..Index::default()
        };
        take_in(&mut index, ending, &mut damages);
        let (mut visibility, garbage) = survey::complete(&file, &mut index, &mut damages)?;
        if let (Visibility::Scanned { .. }, Some(garbage)) = (visibility, garbage) {
            // Who scans comes no further than this. New messages must stand before it, so the log ends here.
            damages.push(
                garbage,
                "readers that scan the log come no further: what follows is kept, and not used",
            );
            index = Index {
                profile: index.profile,
                library: index.library,
                data_start: index.data_start,
                file_len: index.file_len,
                data_end: garbage,
                is_cut: true,
                summary_distrusted: true,
                cut_chunk: chunk::look_at_cut(&file, garbage)?,
                ..Index::default()
            };
            (visibility, _) = survey::complete(&file, &mut index, &mut damages)?;
        }
        let mut damage = damages.found;
        // Of one place the cause stands first, as it was found first.
        damage.sort_by_key(|damage| damage.offset);
        let mut said = BTreeSet::new();
        damage.retain(|damage| said.insert(damage.clone()));
        Ok(Self { file, index, visibility, damage })
    }

    /// What is in the log.
    #[must_use]
    pub fn index(&self) -> &Index {
        &self.index
    }

    /// Where the log is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// How readers will find the messages of this log's successor.
    #[must_use]
    pub fn visibility(&self) -> Visibility {
        self.visibility
    }

    /// What is wrong with the log, by offset; empty where nothing was found. Chunks that need not be read to know
    /// what is in the log were not checked.
    #[must_use]
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Refuses a log that is damaged.
    ///
    /// # Errors
    /// [`LogError::NotWhole`] with the first damage.
    pub fn ensure_whole(&self) -> Result<(), LogError> {
        match self.damage.first() {
            None => Ok(()),
            Some(first) => Err(LogError::NotWhole {
                path: self.file.path.clone(),
                first: first.clone(),
                more: self.damage.len() - 1,
            }),
        }
    }

    /// [`Log::damage`], a sentence each.
    #[must_use]
    pub fn damage_warnings(&self) -> Vec<String> {
        self.damage.iter().map(|damage| self.file.damaged(damage.offset, &damage.what).to_string()).collect()
    }

    /// Refuses an output that is the log itself, by whatever link.
    ///
    /// # Errors
    /// [`LogError::OutputIsInput`].
    pub fn ensure_other(&self, out: &Path) -> Result<(), LogError> {
        if output::is_same_file(&self.file.file, &self.file.path, out) {
            return Err(LogError::OutputIsInput { path: out.to_owned() });
        }
        Ok(())
    }

    /// The bytes behind the data section and its `DataEnd`: summary, footer and magic. They tell two logs apart
    /// that share a data section.
    #[must_use]
    pub fn tail(&self) -> impl Read {
        let data_end_len = if self.index.is_cut { 0 } else { DATA_END_LEN };
        let start = (self.index.data_end + data_end_len).min(self.index.file_len);
        self.file.reader(start).take(self.index.file_len - start)
    }

    /// The entries of the last metadata record of that name, `None` where there is none.
    ///
    /// # Errors
    /// [`LogError::Read`]; [`LogError::Damaged`]; [`LogError::TooLarge`].
    pub fn metadata(&self, name: &str) -> Result<Option<BTreeMap<String, String>>, LogError> {
        let Some(entry) = self.index.metadata.iter().rfind(|m| m.name == name) else { return Ok(None) };
        self.metadata_at(entry).map(Some)
    }

    /// The entries of a metadata record.
    pub(super) fn metadata_at(&self, entry: &MetadataIndex) -> Result<BTreeMap<String, String>, LogError> {
        let head = self.file.head(entry.offset, self.index.data_end)?;
        let record: mcap::records::Metadata = read_record(&self.file, head, "metadata")?;
        Ok(record.metadata)
    }

    /// Whether the file is as long as it was when it was opened.
    pub(super) fn has_its_length(&self) -> bool {
        self.file.file.metadata().is_ok_and(|metadata| metadata.len() == self.index.file_len)
    }

    /// The parts of the log that hold messages, in file order.
    pub(super) fn blocks(&self) -> Vec<chunk::Block<'_>> {
        chunk::blocks(&self.index)
    }
}

/// Puts the summary into the index. Where one of its records can't be read, the rest is not believed either.
fn take_in(index: &mut Index, ending: Ending, damages: &mut Damages) {
    let Ending { data_end, is_cut, data_section_crc, summary_start, summary_crc, records, .. } = ending;
    let bare = Index {
        data_end,
        is_cut,
        data_section_crc,
        cut_chunk: ending.cut_chunk,
        summary_distrusted: ending.distrusted,
        ..std::mem::take(index)
    };
    *index = Index { summary_start, summary_crc, ..bare.clone() };
    let Some(start) = summary_start else { return };
    let mut offset = start;
    for record in chunk::records(&records) {
        let taken = record
            .map_err(|left| format!("the last {left} bytes of the summary are no record"))
            .and_then(|record| {
                index.insert(record.opcode, record.body).map_err(|problem| {
                    format!("summary record (opcode {:#04x}): {problem}", record.opcode)
                })?;
                Ok(record)
            });
        match taken {
            Ok(record) => {
                if record.opcode != op::SUMMARY_OFFSET {
                    let bytes = record.whole.to_vec();
                    index.summary.push(SummaryRecord { opcode: record.opcode, bytes });
                }
                offset += record.whole.len() as u64;
            }
            Err(problem) => {
                damages.push(offset, problem);
                *index = Index { summary_distrusted: true, ..bare };
                return;
            }
        }
    }
}

/// The header record, behind the magic.
fn check_magic(file: &LogFile) -> Result<Head, LogError> {
    let start = file.bytes(0, file.len.min(MAGIC_LEN), "the magic at the start")?;
    let not_mcap = |found: String| Err(LogError::NotMcap { path: file.path.clone(), found });
    if start.is_empty() {
        return not_mcap(super::error::EMPTY.to_owned());
    }
    if start != MAGIC {
        if MAGIC.starts_with(&start) {
            let what = "it ends within the magic at its start";
            return Err(LogError::CutOff { path: file.path.clone(), what, len: file.len });
        }
        let text = start.escape_ascii();
        return not_mcap(format!("it starts with \"{text}\", expected \"{}\"", MAGIC.escape_ascii()));
    }
    let cut_off = || LogError::CutOff { path: file.path.clone(), what: "it has no header", len: file.len };
    if file.len < MAGIC_LEN + HEAD_LEN {
        return Err(cut_off());
    }
    let head = file.head(MAGIC_LEN, file.len)?;
    if head.opcode != op::HEADER {
        return Err(
            file.damaged(MAGIC_LEN, format!("expected the header, found opcode {:#04x}", head.opcode))
        );
    }
    Ok(head)
}

#[cfg(test)]
mod tests;
