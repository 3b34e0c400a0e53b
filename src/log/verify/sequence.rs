//! A log's bytes from the first to the last, each read once and counted into a checksum.

use std::io::{BufReader, Read};

use super::super::file::{At, HEAD_LEN, Head, LogFile, split_head};
use super::super::{LogError, Work};

/// How much is read at once.
const PIECE: u64 = 1 << 20;
/// How often progress is told.
const TOLD_EVERY: u64 = 8 << 20;

/// A position that only moves on.
pub(super) struct Sequence<'a> {
    pub(super) file: &'a LogFile,
    reader: BufReader<At<'a>>,
    pub(super) position: u64,
    crc: crc32fast::Hasher,
    /// Where the last head stood, and the checksum before it.
    record: (u64, crc32fast::Hasher),
    told: u64,
    piece: Vec<u8>,
}

impl<'a> Sequence<'a> {
    pub(super) fn new(file: &'a LogFile) -> Self {
        Self {
            file,
            reader: BufReader::with_capacity(PIECE as usize, file.reader(0)),
            position: 0,
            crc: crc32fast::Hasher::new(),
            record: (0, crc32fast::Hasher::new()),
            told: 0,
            piece: Vec::new(),
        }
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> u64 {
        self.file.len.saturating_sub(self.position)
    }

    /// The CRC-32 of all bytes since the last [`Sequence::restart_crc`].
    pub(super) fn crc(&self) -> u32 {
        self.crc.clone().finalize()
    }

    /// The CRC-32 without the record whose head was read last.
    pub(super) fn crc_before_record(&self) -> u32 {
        self.record.1.clone().finalize()
    }

    pub(super) fn restart_crc(&mut self) {
        self.crc = crc32fast::Hasher::new();
    }

    /// The head of the next record, or what stands against there being one: then nothing was read but its head.
    pub(super) fn head(&mut self) -> Result<Result<Head, String>, LogError> {
        let offset = self.position;
        self.record = (offset, self.crc.clone());
        if self.left() < HEAD_LEN {
            return Ok(Err(format!("no room for a record, the file ends at {}", self.file.len)));
        }
        let mut bytes = Vec::new();
        self.read_into(HEAD_LEN, &mut bytes)?;
        Ok(match split_head(&bytes) {
            Some((0, _)) | None => Err("expected a record, found opcode 0x00".into()),
            Some((opcode, body_len)) if body_len > self.left() => Err(format!(
                "a record ({}) claims {body_len} bytes, the file ends {} bytes on",
                name_of(opcode),
                self.left()
            )),
            Some((opcode, body_len)) => Ok(Head { opcode, offset, body_len }),
        })
    }

    /// Puts the next `len` bytes into `buf`, in place of what it held.
    pub(super) fn read_into(&mut self, len: u64, buf: &mut Vec<u8>) -> Result<(), LogError> {
        let offset = self.position;
        if len > self.file.options.memory_limit {
            return Err(self.file.too_large(offset, "a record", len));
        }
        buf.clear();
        let read = self.reader.by_ref().take(len).read_to_end(buf);
        let read = read.map_err(|source| LogError::Read { path: self.file.path.clone(), offset, source })?;
        if (read as u64) < len {
            return Err(self.file.damaged(offset, "the file became shorter while it was read"));
        }
        self.crc.update(buf);
        self.position += len;
        if self.position >= self.told + TOLD_EVERY || self.left() == 0 {
            self.told = self.position;
            self.file.options.observer.tell(Work::Read, self.position, self.file.len);
        }
        Ok(())
    }

    /// Goes on by `len` bytes, handing them to `f` piece by piece.
    pub(super) fn pass(&mut self, mut len: u64, mut f: impl FnMut(&[u8])) -> Result<(), LogError> {
        let mut piece = std::mem::take(&mut self.piece);
        while len > 0 {
            let next = len.min(PIECE).min(self.file.options.memory_limit.max(1));
            self.read_into(next, &mut piece)?;
            f(&piece);
            len -= next;
        }
        self.piece = piece;
        Ok(())
    }

    /// Goes on to `offset`, which is behind where the last head stood.
    pub(super) fn jump(&mut self, offset: u64) -> Result<(), LogError> {
        let (start, crc) = self.record.clone();
        self.reader = BufReader::with_capacity(PIECE as usize, self.file.reader(start));
        (self.position, self.crc) = (start, crc);
        self.pass(offset.saturating_sub(start), |_| {})
    }
}

/// What a record is called.
pub(super) fn name_of(opcode: u8) -> String {
    let names = [
        "opcode 0x00",
        "a header",
        "a footer",
        "a schema",
        "a channel",
        "a message",
        "a chunk",
        "a message index",
        "a chunk index",
        "an attachment",
        "an attachment index",
        "statistics",
        "metadata",
        "a metadata index",
        "a summary offset",
        "the end of the data section",
    ];
    names.get(usize::from(opcode)).map_or_else(|| format!("opcode {opcode:#04x}"), |name| (*name).to_owned())
}
