//! A log is changed in place only while its old end lies beside it, so that the original can be put back
//! whenever a run is cut off.
//!
//! | step | on the disk | after a crash here |
//! |---|---|---|
//! | 1 | the old end is written to `LOG.trackfuse-undo-part` and synced | the log is untouched |
//! | 2 | that becomes `LOG.trackfuse-undo`, and the folder is synced | putting back changes nothing |
//! | 3 | the log is changed from `data_end` on, and synced | putting back gives the original |
//! | 4 | `LOG.trackfuse-undo` is removed, and the folder is synced | it is there: as 3; it is not: done |
//!
//! Putting back is: cut to the original's length, write the old end, sync, compare, then step 4. It can be cut
//! off and done again. All of it happens under an exclusive lock of the log.
//!
//! The file: a line of text, then original length and data end (u64), CRC-32 of what stands at both ends of the
//! data section (u32), the old end itself, CRC-32 of all that (u32); numbers are little-endian.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
};

use super::disk;
use super::file::{At, LogFile};
use super::new_file::{create_new, readable_by_the_same};
use super::{LogError, ReadOptions};

const LINE: &[u8] =
    b"trackfuse undo 1: the end of the log beside this, as it was. `trackfuse restore LOG` puts it back.\n";
const OTHER_KIND: &str = "it is of another kind or version";
const SUFFIX: &str = ".trackfuse-undo";
/// Line, original length, data end, CRC of the log's ends.
const HEAD_LEN: u64 = LINE.len() as u64 + 8 + 8 + 4;
const CRC_LEN: u64 = 4;
/// How much of either end of a data section tells it from another's.
const END_LEN: u64 = 64 << 10;
const PIECE: usize = 1 << 20;

/// The old end of a log, safe on the disk beside it.
#[derive(Debug)]
pub(super) struct Undo {
    pub(super) path: PathBuf,
    file: File,
    pub(super) original_len: u64,
    data_end: u64,
    ends_crc: u32,
}

impl Undo {
    /// Saves the old end, which `tail` reads, of the original that is `original_len` long and whose first
    /// `data_end` bytes stay in the log.
    pub(super) fn create(
        log: &LogFile,
        original_len: u64,
        data_end: u64,
        tail: At<'_>,
    ) -> Result<Self, LogError> {
        let path = beside(&log.path).map_err(|source| LogError::Write { path: log.path.clone(), source })?;
        let cannot = |source| LogError::Write { path: path.clone(), source };
        let part = disk::with_suffix(&path, "-part");
        if fs::symlink_metadata(&part).is_ok() {
            fs::remove_file(&part).map_err(cannot)?;
        }
        let file = create_new(&part, readable_by_the_same(&log.file)).map_err(cannot)?;
        let ends_crc = ends_crc(&log.file, data_end).map_err(cannot)?;
        let undo = Self { path: path.clone(), file, original_len, data_end, ends_crc };
        if let Err(source) = undo.write(tail).and_then(|()| disk::rename(&part, &path)) {
            let _ = disk::remove(&part);
            return Err(cannot(source));
        }
        if let Err(source) = disk::sync_folder(&path) {
            // Nothing is changed yet, so that it does no harm where it can't be removed.
            return Err(match disk::remove(&path) {
                Ok(()) => cannot(source),
                Err(source) => LogError::NotPutBack { path: log.path.clone(), source },
            });
        }
        Ok(undo)
    }

    fn write(&self, tail: At<'_>) -> io::Result<()> {
        let mut head = LINE.to_vec();
        head.extend(self.original_len.to_le_bytes());
        head.extend(self.data_end.to_le_bytes());
        head.extend(self.ends_crc.to_le_bytes());
        disk::write_at(&self.file, &head, 0)?;
        let mut crc = crc32fast::Hasher::new();
        crc.update(&head);
        for_each_piece(tail, self.original_len - self.data_end, |at, piece| {
            crc.update(piece);
            disk::write_at(&self.file, piece, HEAD_LEN + at)
        })?;
        let end = HEAD_LEN + self.original_len - self.data_end;
        disk::write_at(&self.file, &crc.finalize().to_le_bytes(), end)?;
        disk::sync(&self.file)
    }

    /// The saved end at `path`, if it is whole and of this log.
    pub(super) fn read(path: &Path, log: &LogFile) -> Result<Self, LogError> {
        let bad = |what: &str| LogError::BadUndo { path: path.to_owned(), what: what.to_owned() };
        let cannot = |source| LogError::Open { path: path.to_owned(), source };
        let file = File::open(path).map_err(cannot)?;
        let len = file.metadata().map_err(cannot)?.len();
        let mut head = vec![0; HEAD_LEN.min(len) as usize];
        At::new(&file, 0).read_exact(&mut head).map_err(cannot)?;
        let numbers = head.strip_prefix(LINE).ok_or_else(|| bad(OTHER_KIND))?;
        let number =
            |at: usize| numbers.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        let (Some(original_len), Some(data_end), Some(ends)) = (number(0), number(8), numbers.get(16..20))
        else {
            return Err(bad("it is cut off"));
        };
        let tail_len = original_len.checked_sub(data_end);
        if tail_len.and_then(|tail| tail.checked_add(HEAD_LEN + CRC_LEN)) != Some(len) {
            return Err(bad("its length is not what it says"));
        }
        let mut crc = crc32fast::Hasher::new();
        let summed = for_each_piece(At::new(&file, 0), len - CRC_LEN, |_, piece| {
            crc.update(piece);
            Ok(())
        });
        let mut said = [0; 4];
        summed.and_then(|()| At::new(&file, len - CRC_LEN).read_exact(&mut said)).map_err(cannot)?;
        if crc.finalize().to_le_bytes() != said {
            return Err(bad("its checksum is wrong"));
        }
        if log.len < data_end {
            let what = format!("the log has {} bytes, the original's data section {data_end}", log.len);
            return Err(bad(&what));
        }
        let ends_crc = ends_crc(&log.file, data_end).map_err(cannot)?;
        if ends_crc.to_le_bytes() != ends {
            return Err(bad("the log beside it is another one than it was made of"));
        }
        Ok(Self { path: path.to_owned(), file, original_len, data_end, ends_crc })
    }

    /// The old end.
    pub(super) fn tail(&self) -> At<'_> {
        At::new(&self.file, HEAD_LEN)
    }

    pub(super) fn tail_start(&self) -> u64 {
        self.data_end
    }

    /// Makes `log` the original again, and removes what was saved of it.
    pub(super) fn put_back(&self, log: &File) -> io::Result<()> {
        disk::set_len(log, self.original_len)?;
        let tail_len = self.original_len - self.data_end;
        for_each_piece(self.tail(), tail_len, |at, piece| disk::write_at(log, piece, self.data_end + at))?;
        disk::sync(log)?;
        let mut again = At::new(log, self.data_end);
        for_each_piece(self.tail(), tail_len, |_, piece| {
            let mut written = vec![0; piece.len()];
            again.read_exact(&mut written)?;
            if written == piece {
                Ok(())
            } else {
                Err(io::Error::other("what was written reads back otherwise"))
            }
        })?;
        self.remove()
    }

    /// After that there is no way back.
    pub(super) fn remove(&self) -> io::Result<()> {
        disk::remove(&self.path)?;
        // The log is whole either way; should the name come back after a power failure, so can the original.
        let _ = disk::sync_folder(&self.path);
        Ok(())
    }
}

/// Puts the original of a log back where a run that added to it was cut off, and returns its length; `None`
/// where none was.
///
/// # Errors
/// [`LogError::InUse`] while that run goes on; [`LogError::BadUndo`], and then nothing is touched;
/// [`LogError::NotPutBack`]; [`LogError::Open`], [`LogError::NotInPlace`] for a log that can't be written.
pub fn put_back(path: &Path) -> Result<Option<u64>, LogError> {
    let Some(pending) = pending(path) else {
        sweep(path);
        return Ok(None);
    };
    let log = LogFile::open_exclusive(path, ReadOptions::default())?;
    // the other run may have ended meanwhile
    if fs::symlink_metadata(&pending).is_err() {
        return Ok(None);
    }
    let undo = Undo::read(&pending, &log)?;
    undo.put_back(&log.file).map_err(|source| LogError::NotPutBack { path: path.to_owned(), source })?;
    Ok(Some(undo.original_len))
}

/// Removes what a run left that was cut off before it changed anything.
fn sweep(path: &Path) {
    let Ok(undo) = beside(path) else { return };
    let part = disk::with_suffix(&undo, "-part");
    if fs::symlink_metadata(&part).is_ok() && LogFile::open_exclusive(path, ReadOptions::default()).is_ok() {
        let _ = disk::remove(&part);
    }
}

/// What was saved of the log at `path` by a run that goes on or was cut off.
pub(super) fn pending(path: &Path) -> Option<PathBuf> {
    beside(path).ok().filter(|undo| fs::symlink_metadata(undo).is_ok())
}

/// An error for a log that a run was cut off in.
pub(super) fn refuse_pending(path: &Path) -> Result<(), LogError> {
    match pending(path) {
        Some(undo) if is_ours(&undo) => Err(LogError::Pending { path: path.to_owned() }),
        Some(path) => Err(LogError::BadUndo { path, what: OTHER_KIND.to_owned() }),
        None => Ok(()),
    }
}

/// Whether a file begins as what is saved of a log; one that can't be read may.
fn is_ours(undo: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(undo).and_then(|file| file.take(LINE.len() as u64).read_to_end(&mut start));
    read.is_err() || start == LINE
}

/// Beside the file itself, whatever links lead to it.
fn beside(log: &Path) -> io::Result<PathBuf> {
    Ok(disk::with_suffix(&fs::canonicalize(log)?, SUFFIX))
}

/// CRC-32 of what stands at both ends of a data section: quick, and enough to tell two logs apart.
fn ends_crc(log: &File, data_end: u64) -> io::Result<u32> {
    let mut crc = crc32fast::Hasher::new();
    let len = data_end.min(END_LEN);
    for start in [0, data_end - len] {
        for_each_piece(At::new(log, start), len, |_, piece| {
            crc.update(piece);
            Ok(())
        })?;
    }
    Ok(crc.finalize())
}

/// Hands on `len` bytes in pieces, each with its distance from the start.
pub(super) fn for_each_piece(
    mut from: At<'_>,
    len: u64,
    mut handle: impl FnMut(u64, &[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let mut buf = vec![0; len.min(PIECE as u64) as usize];
    let mut at = 0;
    while at < len {
        let size = (len - at).min(PIECE as u64) as usize;
        let piece = buf.get_mut(..size).unwrap_or_default();
        from.read_exact(piece)?;
        handle(at, piece)?;
        at += size as u64;
    }
    Ok(())
}
