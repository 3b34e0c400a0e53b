//! A data section held against its checksum, without a look at what is in it.

use super::file::LogFile;
use super::undo::for_each_piece;
use super::{LogError, Work};

/// CRC-32 of the first `len` bytes of a log, which are all read.
pub(super) fn crc_of_start(file: &LogFile, len: u64) -> Result<u32, LogError> {
    let (mut crc, mut done) = (crc32fast::Hasher::new(), 0);
    let read = for_each_piece(file.reader(0), len, |at, piece| {
        crc.update(piece);
        done = at + piece.len() as u64;
        file.options.observer.tell(Work::Read, done, len);
        Ok(())
    });
    read.map_err(|source| LogError::Read { path: file.path.clone(), offset: done, source })?;
    Ok(crc.finalize())
}
