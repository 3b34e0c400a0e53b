//! The output on the disk: a nameless file beside it until all is written.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Read, Seek, Write},
    path::Path,
};

use tempfile::NamedTempFile;

use super::{Log, LogError};

/// The output while it has no name, and what must be known about the bytes in it.
#[derive(Debug)]
pub(super) struct Sink {
    file: BufWriter<NamedTempFile>,
    pub(super) position: u64,
    /// `None` where the log has no data section CRC to continue.
    crc: Option<crc32fast::Hasher>,
}

impl Sink {
    /// The log's data section in a new file beside `out`.
    pub(super) fn copy(log: &Log, out: &Path) -> Result<Self, LogError> {
        let index = log.index();
        let written = |source| LogError::Write { path: out.to_owned(), source };
        let mut file = temporary_beside(out, readable_by_the_same(&log.file.file)).map_err(written)?;
        let mut source = &log.file.file;
        // Both are plain files, so that the kernel copies, and shares blocks where it can.
        let copied = source
            .rewind()
            .and_then(|()| io::copy(&mut source.take(index.data_end), file.as_file_mut()))
            .map_err(written)?;
        if copied != index.data_end {
            let what =
                format!("only {copied} bytes of the data section are left, expected {}", index.data_end);
            return Err(log.file.damaged(copied, what));
        }
        let crc = index.data_section_crc.map(crc32fast::Hasher::new_with_initial);
        Ok(Self { file: BufWriter::new(file), position: copied, crc })
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.position += bytes.len() as u64;
        if let Some(crc) = &mut self.crc {
            crc.update(bytes);
        }
        Ok(())
    }

    /// CRC of all that was put so far, 0 for none.
    pub(super) fn data_crc(&self) -> u32 {
        self.crc.clone().map_or(0, crc32fast::Hasher::finalize)
    }

    pub(super) fn publish(self, out: &Path, force: bool) -> io::Result<()> {
        publish(self.file, out, force)
    }
}

/// Writes a new file, of any content: nothing bears its name until all of it is on the disk. Returns its
/// length in bytes.
///
/// # Errors
/// [`LogError::OutputExists`] without `force`, before anything is written; [`LogError::Write`]; whatever
/// `write` returns.
pub fn write_new<E: From<LogError>>(
    out: &Path,
    force: bool,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<(), E>,
) -> Result<u64, E> {
    let written = |source| LogError::Write { path: out.to_owned(), source };
    check_name(out, force)?;
    let mut file = BufWriter::new(temporary_beside(out, None).map_err(written)?);
    write(&mut file)?;
    let len = file.stream_position().map_err(written)?;
    match publish(file, out, force) {
        Ok(()) => Ok(len),
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
            Err(LogError::OutputExists { path: out.to_owned() }.into())
        }
        Err(source) => Err(written(source).into()),
    }
}

/// Flushes, syncs and names a file, and syncs its directory.
fn publish(file: BufWriter<NamedTempFile>, out: &Path, force: bool) -> io::Result<()> {
    let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    let named = if force { file.persist(out) } else { file.persist_noclobber(out) };
    named.map_err(|e| e.error)?;
    // the file is there and whole: that its name is on the disk too is wished for, and not always granted
    #[cfg(unix)]
    let _ = File::open(directory(out)).and_then(|folder| folder.sync_all());
    Ok(())
}

fn directory(out: &Path) -> &Path {
    out.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The input's permissions, writable by its owner: a private recording's successor is private too.
fn readable_by_the_same(input: &File) -> Option<fs::Permissions> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = input.metadata().ok()?.permissions().mode();
        Some(fs::Permissions::from_mode(mode & 0o666 | 0o200))
    }
    #[cfg(not(unix))]
    {
        let _ = input;
        None
    }
}

fn temporary_beside(out: &Path, like: Option<fs::Permissions>) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".trackfuse-").suffix(".part");
    // As the file that it comes from, else as any new file, less the user's umask.
    #[cfg(unix)]
    builder.permissions(like.unwrap_or_else(|| std::os::unix::fs::PermissionsExt::from_mode(0o666)));
    // Less the temporary's own name, which the user didn't choose.
    builder.tempfile_in(directory(out)).map_err(|error| match error.kind() {
        kind @ (io::ErrorKind::NotFound
        | io::ErrorKind::PermissionDenied
        | io::ErrorKind::ReadOnlyFilesystem
        | io::ErrorKind::StorageFull) => kind.into(),
        _ => error,
    })
}

/// Refuses an output before any work is done for it.
pub(super) fn check_output(log: &Log, out: &Path, force: bool) -> Result<(), LogError> {
    log.ensure_other(out)?;
    check_name(out, force)
}

fn check_name(out: &Path, force: bool) -> Result<(), LogError> {
    let path = || out.to_owned();
    let cannot = |why: String| Err(LogError::Write { path: path(), source: io::Error::other(why) });
    if !directory(out).is_dir() {
        return cannot(format!("there is no folder {}", directory(out).display()));
    }
    match fs::symlink_metadata(out) {
        Ok(found) if found.is_dir() => cannot("it is a directory".into()),
        // A device or a pipe would be replaced, not written to.
        Ok(found) if !found.is_file() && !found.is_symlink() => cannot("it is no regular file".into()),
        Ok(_) if !force => Err(LogError::OutputExists { path: path() }),
        _ => Ok(()),
    }
}

/// Whether `out` leads to the open file `input`, by whatever link.
#[cfg(unix)]
pub(super) fn is_same_file(input: &File, _: &Path, out: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |metadata: &fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((input.metadata(), fs::metadata(out)), (Ok(a), Ok(b)) if id(&a) == id(&b))
}

/// Whether `out` leads to the file at `input`, by its path.
#[cfg(not(unix))]
pub(super) fn is_same_file(_: &File, input: &Path, out: &Path) -> bool {
    matches!((input.canonicalize(), out.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
