//! The records of a chunk, decompressed and checked.

use std::io::{self, BufRead, BufReader, Read};
use std::ops::Range;

use mcap::records::{ChunkHeader, ChunkIndex, op};

use super::file::{HEAD_LEN, LogFile, parse, split_head};
use super::{Index, LogError};

/// Start, end, size, CRC, the name's length and the compressed size: a chunk's header without the name.
const FIXED_HEADER_LEN: u64 = 8 + 8 + 8 + 4 + 4 + 8;
/// Far beyond any compression's name.
const LONGEST_HEADER: u64 = FIXED_HEADER_LEN + 256;

/// A part of the data section that holds messages.
#[derive(Clone, Debug)]
pub(super) enum Block<'a> {
    Chunk(&'a ChunkIndex),
    /// Schemas, channels and messages outside chunks, some MB of them.
    Loose(Range<u64>),
    /// What is left of the chunk at which the log is cut off.
    Cut(&'a CutChunk),
}

/// The beginning of a chunk, where the log is cut off.
#[derive(Clone, Debug)]
pub(super) struct CutChunk {
    pub(super) offset: u64,
    pub(super) header: ChunkHeader,
    /// What is left of its compressed bytes.
    pub(super) data: Range<u64>,
    /// How many bytes of whole records that gives.
    pub(super) saved_bytes: u64,
}

impl Block<'_> {
    pub(super) fn offset(&self) -> u64 {
        match self {
            Self::Chunk(chunk) => chunk.chunk_start_offset,
            Self::Loose(range) => range.start,
            Self::Cut(cut) => cut.offset,
        }
    }

    /// How many bytes its records have, as far as the index tells.
    pub(super) fn size(&self) -> u64 {
        match self {
            Self::Chunk(chunk) => chunk.uncompressed_size,
            Self::Loose(range) => range.end - range.start,
            Self::Cut(cut) => cut.saved_bytes,
        }
    }

    /// Whether a message of `channel` may be in it, as far as the index tells.
    pub(super) fn may_hold(&self, channel: u16) -> bool {
        match self {
            Self::Chunk(chunk) => {
                chunk.message_index_offsets.is_empty() || chunk.message_index_offsets.contains_key(&channel)
            }
            Self::Loose(_) | Self::Cut(_) => true,
        }
    }
}

/// All parts that hold messages, in file order.
pub(super) fn blocks(index: &Index) -> Vec<Block<'_>> {
    let chunks = index.chunks.iter().map(Block::Chunk);
    let mut blocks: Vec<_> = chunks.chain(index.loose.iter().cloned().map(Block::Loose)).collect();
    blocks.sort_by_key(Block::offset);
    blocks.extend(index.cut_chunk.as_ref().map(Block::Cut));
    blocks
}

/// The header of the chunk at `offset` and where its compressed bytes stand.
pub(super) fn read_header(
    file: &LogFile,
    offset: u64,
    end: u64,
) -> Result<(ChunkHeader, Range<u64>), LogError> {
    let head = file.head(offset, end)?;
    if head.opcode != op::CHUNK {
        let what = format!("expected a chunk (opcode {:#04x}), found {:#04x}", op::CHUNK, head.opcode);
        return Err(file.damaged(offset, what));
    }
    let bytes = file.bytes(head.body(), head.body_len.min(LONGEST_HEADER), "a chunk's header")?;
    let header: ChunkHeader = file.parse(offset, "chunk", &bytes)?;
    let start = head.body() + FIXED_HEADER_LEN + header.compression.len() as u64;
    match start.checked_add(header.compressed_size) {
        Some(data_end) if data_end <= head.end() => Ok((header, start..data_end)),
        _ => {
            let what = format!(
                "the chunk claims {} compressed bytes, its record has {}",
                header.compressed_size,
                head.end() - start
            );
            Err(file.damaged(offset, what))
        }
    }
}

/// The chunk that begins at `offset` and is cut off, `None` where none does.
pub(super) fn look_at_cut(file: &LogFile, offset: u64) -> Result<Option<CutChunk>, LogError> {
    let left = file.len.saturating_sub(offset);
    let bytes = file.bytes(offset, left.min(HEAD_LEN + LONGEST_HEADER), "a chunk's header")?;
    if bytes.first() != Some(&op::CHUNK) {
        return Ok(None);
    }
    let Ok(header) = parse::<ChunkHeader>(bytes.get(HEAD_LEN as usize..).unwrap_or_default()) else {
        return Ok(None);
    };
    let start = offset + HEAD_LEN + FIXED_HEADER_LEN + header.compression.len() as u64;
    let end = start.saturating_add(header.compressed_size).min(file.len);
    Ok((start <= end).then_some(CutChunk { offset, header, data: start..end, saved_bytes: 0 }))
}

/// Puts the records of `block` into `buf`. A chunk's size and checksum are checked; of one that is cut off the
/// whole records are taken, which nothing checks.
pub(super) fn read_block(file: &LogFile, block: &Block<'_>, buf: &mut Vec<u8>) -> Result<(), LogError> {
    let chunk = match block {
        Block::Loose(range) => {
            return file.read_into(range.start, range.end - range.start, "a run of records", buf);
        }
        Block::Cut(cut) => return read_cut(file, cut, buf),
        Block::Chunk(chunk) => chunk,
    };
    let offset = chunk.chunk_start_offset;
    let (header, data) = read_header(file, offset, offset.saturating_add(chunk.chunk_length).min(file.len))?;
    let compressed = BufReader::with_capacity(1 << 17, file.reader(data.start).take(data.end - data.start));
    decompress(file, offset, &header, compressed, buf)?;
    check_crc(file, offset, &header, buf)
}

/// Puts the records of the chunk at `offset` into `buf`, as many bytes as its header claims.
pub(super) fn decompress(
    file: &LogFile,
    offset: u64,
    header: &ChunkHeader,
    compressed: impl BufRead,
    buf: &mut Vec<u8>,
) -> Result<(), LogError> {
    let size = header.uncompressed_size;
    if size > file.memory_limit {
        return Err(file.too_large(offset, "the chunk", size));
    }
    // One byte more than claimed tells a chunk that holds more from one that is right.
    stream(file, offset, header, compressed, size + 1, buf)?
        .map_err(|e| file.damaged(offset, format!("the chunk can't be decompressed: {e}")))?;
    if buf.len() as u64 != size {
        let relation = if buf.len() as u64 > size { "more than" } else { "less than" };
        return Err(file.damaged(offset, format!("the chunk holds {relation} the {size} bytes it claims")));
    }
    Ok(())
}

/// What can be decompressed of a chunk that is cut off, up to its last whole record.
fn read_cut(file: &LogFile, cut: &CutChunk, buf: &mut Vec<u8>) -> Result<(), LogError> {
    let size = cut.header.uncompressed_size;
    let compressed = file.reader(cut.data.start).take(cut.data.end - cut.data.start);
    let compressed = BufReader::with_capacity(1 << 17, compressed);
    // That it ends too early is no news.
    let _ = stream(file, cut.offset, &cut.header, compressed, size.min(file.memory_limit), buf)?;
    if buf.len() as u64 == size {
        check_crc(file, cut.offset, &cut.header, buf)?;
    }
    let whole = records(buf).map_while(Result::ok).map(|record| record.whole.len()).sum();
    buf.truncate(whole);
    Ok(())
}

/// Puts at most `most` decompressed bytes into `buf`: all that there are before the error, if there is one.
fn stream(
    file: &LogFile,
    offset: u64,
    header: &ChunkHeader,
    compressed: impl BufRead,
    most: u64,
    buf: &mut Vec<u8>,
) -> Result<io::Result<usize>, LogError> {
    buf.clear();
    Ok(match header.compression.as_str() {
        "" => compressed.take(most).read_to_end(buf),
        "zstd" => {
            zstd::Decoder::with_buffer(compressed).and_then(|decoder| decoder.take(most).read_to_end(buf))
        }
        "lz4" => lz4::Decoder::new(compressed).and_then(|decoder| decoder.take(most).read_to_end(buf)),
        name => {
            let (path, name) = (file.path.clone(), name.to_owned());
            return Err(LogError::UnknownCompression { path, offset, name });
        }
    })
}

/// Holds a chunk's records against its checksum, if it has one.
pub(super) fn check_crc(
    file: &LogFile,
    offset: u64,
    header: &ChunkHeader,
    records: &[u8],
) -> Result<(), LogError> {
    if header.uncompressed_crc == 0 {
        return Ok(());
    }
    let found = crc32fast::hash(records);
    if header.uncompressed_crc != found {
        let what = format!("the chunk's CRC is {found:08x}, its header says {:08x}", header.uncompressed_crc);
        return Err(file.damaged(offset, what));
    }
    Ok(())
}

/// One record of a block, whole and without its head.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record<'a> {
    pub(super) opcode: u8,
    pub(super) body: &'a [u8],
    pub(super) whole: &'a [u8],
}

/// The records of a block, or how many bytes of it remain that are none.
pub(super) fn records(mut bytes: &[u8]) -> impl Iterator<Item = Result<Record<'_>, usize>> {
    std::iter::from_fn(move || {
        if bytes.is_empty() {
            return None;
        }
        let record = split_head(bytes).and_then(|(opcode, len)| {
            let whole = bytes.get(..usize::try_from(len.checked_add(HEAD_LEN)?).ok()?)?;
            Some(Record { opcode, body: whole.get(HEAD_LEN as usize..)?, whole })
        });
        let Some(record) = record else {
            return Some(Err(std::mem::take(&mut bytes).len()));
        };
        bytes = bytes.get(record.whole.len()..).unwrap_or_default();
        Some(Ok(record))
    })
}

/// Hands every record of `blocks` to `f`, one block in memory at a time.
pub(super) fn for_each_record<'b, E: From<LogError>>(
    file: &LogFile,
    blocks: impl IntoIterator<Item = Block<'b>>,
    mut f: impl FnMut(&Block<'b>, Record<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut buf = Vec::new();
    for block in blocks {
        read_block(file, &block, &mut buf)?;
        for record in records(&buf) {
            let record = record.map_err(|left| {
                file.damaged(block.offset(), format!("the last {left} bytes of the chunk are no record"))
            })?;
            f(&block, record)?;
        }
    }
    Ok(())
}
