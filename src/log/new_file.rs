//! A new file: it bears its name only when all of it is on the disk.
//!
//! Until then it is `.NAME.trackfuse-part` beside it, locked while somebody writes it. One that nobody
//! has locked was left by a run that was killed, and is swept away by the next run to the same output.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, BufWriter, Seek},
    path::{Path, PathBuf},
};

use tempfile::{NamedTempFile, TempPath};

use super::disk::{self, Step};
use super::interrupt::{self, Writing};
use super::{LogError, undo};

/// Names longer than this are shortened in the temporary's.
const LONGEST_NAME: usize = 200;
/// How often others may sweep what we are about to sweep.
const MOST_TRIES: usize = 16;

/// Writes a new file, of any content: nothing bears its name until all of it is on the disk. Returns its
/// length in bytes.
///
/// # Errors
/// [`LogError::OutputExists`] without `force`, before anything is written; [`LogError::InUse`] while another
/// run writes it; [`LogError::Write`]; [`LogError::Interrupted`]; whatever `write` returns.
pub fn write_new<E: From<LogError>>(
    out: &Path,
    force: bool,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<(), E>,
) -> Result<u64, E> {
    let prepared = Prepared::new(out, force, write)?;
    let len = prepared.len;
    prepared.publish()?;
    Ok(len)
}

/// A new file, all of it on the disk, that doesn't bear its name yet; dropped, it leaves nothing.
#[derive(Debug)]
pub struct Prepared {
    file: NamedTempFile,
    out: PathBuf,
    force: bool,
    len: u64,
    _writing: Writing,
}

impl Prepared {
    /// Writes the file's content.
    ///
    /// # Errors
    /// As [`write_new`].
    pub fn new<E: From<LogError>>(
        out: &Path,
        force: bool,
        write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<(), E>,
    ) -> Result<Self, E> {
        let written = |source| LogError::Write { path: out.to_owned(), source };
        check_name(out, force)?;
        let writing = Writing::begin();
        let mut file = BufWriter::new(temporary_beside(out, None)?);
        write(&mut file)?;
        let len = file.stream_position().map_err(written)?;
        interrupt::check(out)?;
        let file = file.into_inner().map_err(|e| written(e.into_error()))?;
        disk::sync(file.as_file()).map_err(written)?;
        Ok(Self { file, out: out.to_owned(), force, len, _writing: writing })
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// As [`write_new`].
    pub fn publish(self) -> Result<(), LogError> {
        publish(self.file, &self.out, self.force)
    }
}

/// Syncs and names a file, and syncs its directory.
pub(super) fn publish(file: NamedTempFile, out: &Path, force: bool) -> Result<(), LogError> {
    let written = |source| LogError::Write { path: out.to_owned(), source };
    disk::sync(file.as_file()).map_err(written)?;
    let _held = if force { hold(out)? } else { None };
    disk::take(Step::Rename).map_err(written)?;
    let named = if force { file.persist(out) } else { file.persist_noclobber(out) };
    match named {
        Ok(_) => {}
        Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists => {
            return Err(LogError::OutputExists { path: out.to_owned() });
        }
        Err(e) => return Err(written(e.error)),
    }
    // the file is there and whole: that its name is on the disk too is wished for, and not always granted
    let _ = disk::sync_folder(out);
    Ok(())
}

/// The file that is about to be replaced, held so that no run begins to change it in place meanwhile: its work
/// would be lost with it.
fn hold(out: &Path) -> Result<Option<File>, LogError> {
    let is_file = fs::symlink_metadata(out).is_ok_and(|found| found.is_file());
    let Some(file) = is_file.then(|| File::open(out).ok()).flatten() else { return Ok(None) };
    if let Err(TryLockError::WouldBlock) = file.try_lock_shared() {
        return Err(LogError::InUse { path: out.to_owned() });
    }
    undo::refuse_pending(out)?;
    Ok(Some(file))
}

/// The input's permissions, writable by its owner: a private recording's successor is private too.
pub(super) fn readable_by_the_same(input: &File) -> Option<u32> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        Some(input.metadata().ok()?.permissions().mode() & 0o666 | 0o200)
    }
    #[cfg(not(unix))]
    {
        let _ = input;
        None
    }
}

/// A new file with the permissions `mode`, less the user's umask; as any new file without.
pub(super) fn create_new(path: &Path, mode: Option<u32>) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode.unwrap_or(0o666));
    #[cfg(not(unix))]
    let _ = mode;
    options.open(path)
}

/// The temporary of `out`, locked.
pub(super) fn temporary_beside(out: &Path, mode: Option<u32>) -> Result<NamedTempFile, LogError> {
    let in_use = || LogError::InUse { path: out.to_owned() };
    // Less the temporary's own name, which the user didn't choose.
    let cannot = |error: io::Error| {
        let source = match error.kind() {
            kind @ (io::ErrorKind::NotFound
            | io::ErrorKind::PermissionDenied
            | io::ErrorKind::ReadOnlyFilesystem
            | io::ErrorKind::StorageFull) => kind.into(),
            _ => error,
        };
        LogError::Write { path: out.to_owned(), source }
    };
    let part = temporary_name(out);
    for _ in 0..MOST_TRIES {
        let (file, is_new) = match create_new(&part, mode) {
            Ok(file) => (file, true),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => match open_existing(&part) {
                Ok(file) => (file, false),
                Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
                Err(e) => return Err(cannot(e)),
            },
            Err(e) => return Err(cannot(e)),
        };
        match file.try_lock() {
            // somebody sweeps ours, which is empty yet
            Err(TryLockError::WouldBlock) if is_new => continue,
            Err(TryLockError::WouldBlock) => return Err(in_use()),
            Err(TryLockError::Error(_)) => {
                // No locks here: then a name that nobody else takes.
                if is_new {
                    fs::remove_file(&part).map_err(cannot)?;
                }
                return unlocked(out, mode).map_err(cannot);
            }
            Ok(()) => {}
        }
        // The lock is of the file, the name may be another's by now.
        if !is_at(&file, &part) {
            continue;
        }
        if is_new {
            return Ok(NamedTempFile::from_parts(file, TempPath::try_from_path(part).map_err(cannot)?));
        }
        fs::remove_file(&part).map_err(cannot)?;
    }
    Err(in_use())
}

fn open_existing(part: &Path) -> io::Result<File> {
    if !fs::symlink_metadata(part)?.is_file() {
        return Err(io::Error::other(format!("{} is no regular file", part.display())));
    }
    OpenOptions::new().read(true).write(true).open(part)
}

fn unlocked(out: &Path, mode: Option<u32>) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(".trackfuse-part");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode.unwrap_or(0o666)));
    #[cfg(not(unix))]
    let _ = mode;
    builder.tempfile_in(disk::folder(out))
}

fn temporary_name(out: &Path) -> PathBuf {
    let name = out.file_name().unwrap_or_default();
    let mut hidden = OsString::from(".");
    if name.len() > LONGEST_NAME {
        hidden.push(format!("{:08x}", crc32fast::hash(name.as_encoded_bytes())));
    } else {
        hidden.push(name);
    }
    hidden.push(".trackfuse-part");
    out.with_file_name(hidden)
}

/// Whether the open file is the one at `path`.
#[cfg(unix)]
pub(super) fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |metadata: &fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((file.metadata(), fs::symlink_metadata(path)), (Ok(a), Ok(b)) if id(&a) == id(&b))
}

/// An open file keeps its name here.
#[cfg(not(unix))]
pub(super) fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// Refuses a name before any work is done for it.
///
/// # Errors
/// [`LogError::OutputExists`] without `force`; [`LogError::Write`] where no file can be.
pub fn check_name(out: &Path, force: bool) -> Result<(), LogError> {
    let path = || out.to_owned();
    let cannot = |kind, why: String| Err(LogError::Write { path: path(), source: io::Error::new(kind, why) });
    let folder = disk::folder(out);
    if !folder.is_dir() {
        return cannot(io::ErrorKind::NotFound, format!("there is no folder {}", folder.display()));
    }
    match fs::symlink_metadata(out) {
        Ok(found) if found.is_dir() => cannot(io::ErrorKind::IsADirectory, "it is a directory".into()),
        // A device or a pipe would be replaced, not written to. A link is: what it leads to stays.
        Ok(found) if !found.is_file() && !found.is_symlink() => {
            cannot(io::ErrorKind::Other, "it is no regular file".into())
        }
        Ok(_) if !force => Err(LogError::OutputExists { path: path() }),
        // What lies beside it is of this file.
        Ok(_) => undo::refuse_pending(out),
        Err(_) => Ok(()),
    }
}
