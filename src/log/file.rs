//! A log's bytes: read by offset, and never more of them than the file has.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Cursor, Read},
    path::{Path, PathBuf},
};

use binrw::{BinRead, BinReaderExt};

use super::{LogError, ReadOptions, output, undo};

/// Opcode and length, before each record's body.
pub(super) const HEAD_LEN: u64 = 9;

/// A record's opcode and where its parts stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) opcode: u8,
    pub(super) offset: u64,
    pub(super) body_len: u64,
}

impl Head {
    pub(super) fn body(self) -> u64 {
        self.offset + HEAD_LEN
    }

    pub(super) fn end(self) -> u64 {
        self.body() + self.body_len
    }
}

/// An open log.
#[derive(Debug)]
pub(super) struct LogFile {
    pub(super) path: PathBuf,
    pub(super) file: File,
    pub(super) len: u64,
    pub(super) options: ReadOptions,
    /// Whether nobody else reads or writes it by this program meanwhile, and it can be changed.
    pub(super) is_exclusive: bool,
}

impl LogFile {
    /// Opens a log that no run was cut off in.
    pub(super) fn open(path: &Path, options: ReadOptions) -> Result<Self, LogError> {
        let file = Self::open_shared(path, options)?;
        undo::refuse_pending(path)?;
        Ok(file)
    }

    /// Opens a log for reading, which others may read too, but not change.
    pub(super) fn open_shared(path: &Path, options: ReadOptions) -> Result<Self, LogError> {
        let log = Self::open_for(path, OpenOptions::new().read(true), options)?;
        match log.file.try_lock_shared() {
            Err(TryLockError::WouldBlock) => Err(LogError::InUse { path: path.to_owned() }),
            // Where there are no locks nothing is changed in place either.
            Err(TryLockError::Error(_)) | Ok(()) => Ok(log),
        }
    }

    /// Opens a log to change it, for nobody else.
    pub(super) fn open_exclusive(path: &Path, options: ReadOptions) -> Result<Self, LogError> {
        let refused = |source| LogError::NotInPlace { path: path.to_owned(), source };
        let log = match Self::open_for(path, OpenOptions::new().read(true).write(true), options) {
            Err(LogError::Open { source, .. })
                if matches!(
                    source.kind(),
                    io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem
                ) =>
            {
                return Err(refused(source));
            }
            other => other?,
        };
        match log.file.try_lock() {
            // Between opening and locking another run may have replaced it.
            Ok(()) if !log.has_its_name() => Err(LogError::InUse { path: path.to_owned() }),
            Ok(()) => Ok(Self { is_exclusive: true, ..log }),
            Err(TryLockError::WouldBlock) => Err(LogError::InUse { path: path.to_owned() }),
            Err(TryLockError::Error(e)) => Err(refused(io::Error::other(format!("it can't be locked: {e}")))),
        }
    }

    fn open_for(path: &Path, access: &OpenOptions, options: ReadOptions) -> Result<Self, LogError> {
        let cannot = |source| LogError::Open { path: path.to_owned(), source };
        // Asked before opening, which would wait on a named pipe.
        let kind = fs::metadata(path).map_err(cannot)?;
        if !kind.is_file() {
            let found = if kind.is_dir() { "it is a directory" } else { "it is no regular file" };
            return Err(cannot(io::Error::other(found)));
        }
        let file = access.open(path).map_err(cannot)?;
        let len = file.metadata().map_err(cannot)?.len();
        Ok(Self { path: path.to_owned(), file, len, options, is_exclusive: false })
    }

    /// Whether its path still leads to this file.
    pub(super) fn has_its_name(&self) -> bool {
        output::is_same_file(&self.file, &self.path, &self.path)
    }

    /// The file's bytes from `offset` on. Readers don't disturb each other.
    pub(super) fn reader(&self, offset: u64) -> At<'_> {
        At::new(&self.file, offset)
    }

    /// Puts the bytes `[offset, offset + len)` into `buf`, in place of what it held.
    pub(super) fn read_into(
        &self,
        offset: u64,
        len: u64,
        what: &'static str,
        buf: &mut Vec<u8>,
    ) -> Result<(), LogError> {
        if offset.checked_add(len).is_none_or(|end| end > self.len) {
            let what = format!("{what} claims {len} bytes, the file ends at {}", self.len);
            return Err(self.damaged(offset, what));
        }
        if len > self.options.memory_limit {
            return Err(self.too_large(offset, what, len));
        }
        // No clear before: only what it grows by is filled with zeros.
        buf.resize(len as usize, 0);
        let read = fill(self.reader(offset), buf);
        let read = read.map_err(|source| LogError::Read { path: self.path.clone(), offset, source })?;
        if (read as u64) < len {
            return Err(self.damaged(offset, format!("{what} ends {read} bytes on, the file became shorter")));
        }
        Ok(())
    }

    pub(super) fn bytes(&self, offset: u64, len: u64, what: &'static str) -> Result<Vec<u8>, LogError> {
        let mut buf = Vec::new();
        self.read_into(offset, len, what, &mut buf)?;
        Ok(buf)
    }

    /// The head of the record at `offset`, which must end before `end`.
    pub(super) fn head(&self, offset: u64, end: u64) -> Result<Head, LogError> {
        let bytes = if offset.checked_add(HEAD_LEN).is_some_and(|head_end| head_end <= end) {
            self.bytes(offset, HEAD_LEN, "a record")?
        } else {
            Vec::new()
        };
        let (opcode, body_len) = split_head(&bytes)
            .ok_or_else(|| self.damaged(offset, format!("no room for a record before {end}")))?;
        if body_len > end - offset - HEAD_LEN {
            let what =
                format!("a record (opcode {opcode:#04x}) claims {body_len} bytes, it must end by {end}");
            return Err(self.damaged(offset, what));
        }
        Ok(Head { opcode, offset, body_len })
    }

    /// A record's fields. Bytes behind the known fields are allowed by the format.
    pub(super) fn parse<T>(&self, offset: u64, what: &str, body: &[u8]) -> Result<T, LogError>
    where
        T: for<'a> BinRead<Args<'a> = ()>,
    {
        parse(body).map_err(|problem| self.damaged(offset, format!("{what}: {problem}")))
    }

    pub(super) fn damaged(&self, offset: u64, what: impl Into<String>) -> LogError {
        LogError::Damaged { path: self.path.clone(), offset, what: what.into() }
    }

    pub(super) fn too_large(&self, offset: u64, what: &'static str, size: u64) -> LogError {
        LogError::TooLarge { path: self.path.clone(), offset, what, size, limit: self.options.memory_limit }
    }
}

/// Reads until `buf` is full or the end is reached, and says how much that was.
fn fill(mut reader: impl Read, buf: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = buf.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// A record's opcode and body length, `None` where `bytes` is too short for a head.
pub(super) fn split_head(bytes: &[u8]) -> Option<(u8, u64)> {
    let (&[opcode, ref len @ ..], _) = bytes.split_first_chunk::<9>()?;
    Some((opcode, u64::from_le_bytes(*len)))
}

/// A record's fields, or one line on what is wrong with them.
pub(super) fn parse<T>(body: &[u8]) -> Result<T, String>
where
    T: for<'a> BinRead<Args<'a> = ()>,
{
    Cursor::new(body).read_le().map_err(|e: binrw::Error| match e.root_cause() {
        binrw::Error::Io(_) => format!("its fields need more than its {} bytes", body.len()),
        other => other.to_string().replace('\n', " "),
    })
}

/// Reads on from an offset, with a position of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct At<'a> {
    file: &'a File,
    pub(super) offset: u64,
}

impl<'a> At<'a> {
    pub(super) fn new(file: &'a File, offset: u64) -> Self {
        Self { file, offset }
    }
}

impl Read for At<'_> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        #[cfg(unix)]
        let read = std::os::unix::fs::FileExt::read_at(self.file, buf, self.offset)?;
        #[cfg(windows)]
        let read = std::os::windows::fs::FileExt::seek_read(self.file, buf, self.offset)?;
        self.offset += read as u64;
        Ok(read)
    }
}
