//! Where new channels go: into a new file, into the log itself, or into a file of their own.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;

use super::copying::Copying;
use super::disk;
use super::file::{At, LogFile};
use super::interrupt::{self, Writing};
use super::new_file::{check_name, publish, readable_by_the_same, temporary_beside};
use super::undo::Undo;
use super::{Log, LogError};

/// Where new channels go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// A new file: the log's data section byte for byte, and the new channels behind it.
    New {
        /// Its name.
        out: PathBuf,
        /// Whether an existing file is replaced; a link is replaced by the file, what it leads to stays.
        force: bool,
    },
    /// The log itself, opened with [`Log::open_in_place`]. Its data section stays as it is, the rest of the
    /// log is read no more until it is opened anew.
    InPlace,
    /// A new file that holds the new channels only, a complete MCAP of its own.
    Sidecar {
        /// Its name.
        out: PathBuf,
        /// As of [`Destination::New`].
        force: bool,
    },
}

impl Destination {
    /// A new file; an existing one is refused.
    #[must_use]
    pub fn new_file(out: impl Into<PathBuf>) -> Self {
        Self::New { out: out.into(), force: false }
    }

    /// The file that is written.
    #[must_use]
    pub fn path<'a>(&'a self, log: &'a Log) -> &'a Path {
        match self {
            Self::New { out, .. } | Self::Sidecar { out, .. } => out,
            Self::InPlace => log.path(),
        }
    }

    /// Refuses a destination before any work is done for it.
    pub(super) fn check(&self, log: &Log) -> Result<(), LogError> {
        match self {
            Self::New { out, force } | Self::Sidecar { out, force } => check_output(log, out, *force),
            Self::InPlace => ensure_in_place(log),
        }
    }
}

/// The output while it is written, and what must be known about the bytes in it.
#[derive(Debug)]
pub(super) struct Sink<'a> {
    file: BufWriter<Target<'a>>,
    path: PathBuf,
    pub(super) position: u64,
    /// `None` where the log has no data section CRC to continue.
    crc: Option<crc32fast::Hasher>,
    _writing: Writing,
}

impl<'a> Sink<'a> {
    /// Begins an output. What comes next stands right behind the log's data section, in a sidecar at its start.
    pub(super) fn begin(log: &'a Log, destination: &Destination) -> Result<Self, LogError> {
        let writing = Writing::begin();
        let (index, path) = (log.index(), destination.path(log));
        let mut position = index.data_end;
        let mut crc = index.data_section_crc.map(crc32fast::Hasher::new_with_initial);
        let kind = match destination {
            Destination::New { force, .. } => {
                let file = temporary_beside(path, readable_by_the_same(&log.file.file))?;
                let copying = Some(Copying::begin(&log.file, position, file.as_file(), path)?);
                Kind::New { copying, file: Some(file), force: *force, log: &log.file, data_end: position }
            }
            Destination::InPlace => {
                let tail = log.file.reader(position);
                let undo = Undo::create(&log.file, index.file_len, position, tail)?;
                Kind::InPlace { log: &log.file, undo, is_original: false }
            }
            Destination::Sidecar { force, .. } => {
                let file = temporary_beside(path, readable_by_the_same(&log.file.file))?;
                (position, crc) = (0, Some(crc32fast::Hasher::new()));
                let data_end = index.data_end;
                Kind::New { copying: None, file: Some(file), force: *force, log: &log.file, data_end }
            }
        };
        let file = BufWriter::new(Target { kind, position });
        Ok(Self { file, path: path.to_owned(), position, crc, _writing: writing })
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<(), LogError> {
        interrupt::check(&self.path).map_err(|e| self.taken_back(e))?;
        self.file.write_all(bytes).map_err(|e| self.failed(e))?;
        self.position += bytes.len() as u64;
        if let Some(crc) = &mut self.crc {
            crc.update(bytes);
        }
        Ok(())
    }

    /// Reads the log's old end from `at` bytes behind its beginning on, also while it is being overwritten.
    pub(super) fn read_old_tail(&mut self, at: u64, buf: &mut [u8]) -> Result<(), LogError> {
        let mut from = match &self.file.get_ref().kind {
            Kind::New { log, data_end, .. } => log.reader(*data_end),
            Kind::InPlace { undo, .. } => undo.tail(),
        };
        from.offset += at;
        from.read_exact(buf).map_err(|e| self.failed(e))
    }

    /// CRC of all that was put so far, 0 for none.
    pub(super) fn data_crc(&self) -> u32 {
        self.crc.clone().map_or(0, crc32fast::Hasher::finalize)
    }

    /// All is written: it is the output once it is on the disk.
    pub(super) fn finish(mut self) -> Result<(), LogError> {
        self.file.flush().map_err(|e| self.failed(e))?;
        match &mut self.file.get_mut().kind {
            Kind::New { copying, file, force, .. } => {
                copying.take().map_or(Ok(()), |mut copying| copying.finish())?;
                file.take().map_or(Ok(()), |file| publish(file, &self.path, *force))
            }
            Kind::InPlace { log, undo, is_original } => {
                let lost = || io::Error::other("another file took its name meanwhile");
                let named = || log.has_its_name().then_some(()).ok_or_else(lost);
                let done = disk::sync(&log.file).and_then(|()| named()).and_then(|()| undo.remove());
                // then there is nothing left to put back
                *is_original = done.is_ok();
                done.map_err(|e| self.failed(e))
            }
        }
    }

    /// Takes the output back, and says why.
    fn failed(&mut self, source: io::Error) -> LogError {
        self.taken_back(LogError::Write { path: self.path.clone(), source })
    }

    fn taken_back(&mut self, error: LogError) -> LogError {
        match self.file.get_mut().take_back() {
            Ok(()) => error,
            Err(source) => LogError::NotPutBack { path: self.path.clone(), source },
        }
    }
}

/// The bytes' place.
#[derive(Debug)]
struct Target<'a> {
    kind: Kind<'a>,
    position: u64,
}

#[derive(Debug)]
enum Kind<'a> {
    /// `file` has no name yet; without one it is finished or taken back.
    New {
        copying: Option<Copying>,
        file: Option<NamedTempFile>,
        force: bool,
        log: &'a LogFile,
        data_end: u64,
    },
    /// While `is_original` isn't set, the log is being changed.
    InPlace { log: &'a LogFile, undo: Undo, is_original: bool },
}

impl Target<'_> {
    fn take_back(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::New { copying, file, .. } => {
                *copying = None;
                *file = None;
            }
            Kind::InPlace { is_original: true, .. } => {}
            Kind::InPlace { log, undo, is_original } => {
                // Whatever comes of it, nothing more is written.
                *is_original = true;
                undo.put_back(&log.file)?;
            }
        }
        Ok(())
    }
}

impl Write for Target<'_> {
    fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
        let file = match &self.kind {
            Kind::New { file: Some(file), .. } => file.as_file(),
            Kind::InPlace { log, is_original: false, .. } => &log.file,
            _ => return Err(io::Error::other("the output was given up")),
        };
        disk::write_at(file, buf, self.position)?;
        self.position += buf.len() as u64;
        Ok(buf.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Target<'_> {
    fn drop(&mut self) {
        // What can't be put back now can be later: see `undo`.
        let _ = self.take_back();
    }
}

/// Appends `len` bytes to `file`, which is `position` long and will be `out`.
pub(super) fn copy_behind(
    from: At<'_>,
    len: u64,
    file: &File,
    position: u64,
    out: &Path,
) -> Result<(), LogError> {
    super::undo::for_each_piece(from, len, |at, piece| disk::write_at(file, piece, position + at))
        .map_err(|source| LogError::Write { path: out.to_owned(), source })
}

/// Refuses an output before any work is done for it.
pub(super) fn check_output(log: &Log, out: &Path, force: bool) -> Result<(), LogError> {
    log.ensure_other(out)?;
    check_name(out, force)
}

/// Refuses to change a log whose original could not be put back for sure.
pub(super) fn ensure_in_place(log: &Log) -> Result<(), LogError> {
    let refuse = |why: &str| {
        Err(LogError::NotInPlace { path: log.path().to_owned(), source: io::Error::other(why.to_owned()) })
    };
    if !log.file.is_exclusive {
        return refuse("it was opened for reading only");
    }
    if let Some(damage) = log.damage().first() {
        return refuse(&format!("it is damaged at offset {}: {}", damage.offset, damage.what));
    }
    if !log.file.has_its_name() {
        return refuse("another file took its name meanwhile");
    }
    if !log.has_its_length() {
        return refuse("somebody else changed it meanwhile");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let names = log.file.file.metadata().map_or(1, |metadata| metadata.nlink());
        // Under the other name nobody would find the old end after a crash; and it may be somebody's backup.
        if names > 1 {
            return refuse(&format!("the file has {names} names (hard links), and would change under all"));
        }
    }
    Ok(())
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
