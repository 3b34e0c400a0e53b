//! The records of a chunk, decompressed and checked.

use std::cmp::Ordering;
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

    /// How many bytes it takes in the file.
    pub(super) fn stored_size(&self) -> u64 {
        match self {
            Self::Chunk(chunk) => chunk.chunk_length,
            Self::Loose(range) => range.end - range.start,
            Self::Cut(cut) => cut.data.end - cut.data.start,
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

/// What decoding takes beside the result; it serves one chunk after the other.
#[derive(Default)]
pub(super) struct Scratch {
    compressed: Vec<u8>,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

/// Above this a chunk's own header is believed only where the index says the same: how many chunks may be in memory
/// at once is decided by the index.
const UNANNOUNCED: u64 = 8 << 20;
/// Memory that is kept for the next chunk, bytes.
const KEPT: usize = 16 << 20;

/// Puts the records of `block` into `buf`. A chunk's size and checksum are checked; of one that is cut off the
/// whole records are taken, which nothing checks.
///
/// # Errors
/// [`LogError::BadChunk`] for a chunk that can't be decoded; [`LogError::TooLarge`];
/// [`LogError::UnknownCompression`]; [`LogError::Read`].
pub(super) fn read_block(
    file: &LogFile,
    block: &Block<'_>,
    scratch: &mut Scratch,
    buf: &mut Vec<u8>,
) -> Result<(), LogError> {
    match block {
        Block::Loose(range) => file.read_into(range.start, range.end - range.start, "a run of records", buf),
        Block::Cut(cut) => read_cut(file, cut, buf),
        Block::Chunk(chunk) => read_chunk(file, chunk, scratch, buf).map_err(LogError::of_chunk),
    }
}

fn read_chunk(
    file: &LogFile,
    chunk: &ChunkIndex,
    scratch: &mut Scratch,
    buf: &mut Vec<u8>,
) -> Result<(), LogError> {
    let offset = chunk.chunk_start_offset;
    let (header, data) = read_header(file, offset, offset.saturating_add(chunk.chunk_length).min(file.len))?;
    let (size, len) = (header.uncompressed_size, data.end - data.start);
    if size > file.options.memory_limit {
        return Err(file.too_large(offset, "the chunk", size));
    }
    if size > chunk.uncompressed_size.max(UNANNOUNCED) || len > chunk.compressed_size.max(UNANNOUNCED) {
        let said = (chunk.compressed_size, chunk.uncompressed_size);
        let what =
            format!("the chunk claims {len} bytes, {size} uncompressed, its index {} and {}", said.0, said.1);
        return Err(file.damaged(offset, what));
    }
    let compressed = &mut scratch.compressed;
    let done = match header.compression.as_str() {
        // One byte more than claimed tells a chunk that holds more from one that is right.
        "" => file.read_into(data.start, len.min(size + 1), "a chunk", buf).map(|()| Ok(())),
        "zstd" => file
            .read_into(data.start, len, "a chunk", compressed)
            .map(|()| unpack_zstd(&mut scratch.zstd, compressed, size, buf)),
        "lz4" => file.read_into(data.start, len, "a chunk", compressed).map(|()| {
            buf.clear();
            lz4::Decoder::new(&compressed[..]).and_then(|d| d.take(size + 1).read_to_end(buf)).map(drop)
        }),
        name => {
            let (path, name) = (file.path.clone(), name.to_owned());
            return Err(LogError::UnknownCompression { path, offset, name });
        }
    }?;
    if compressed.capacity() > KEPT {
        *compressed = Vec::new();
    }
    done.map_err(|e| file.damaged(offset, format!("the chunk can't be decompressed: {e}")))?;
    check_size(file, offset, size, buf)?;
    check_crc(file, offset, &header, buf)
}

/// Puts up to `size` bytes, or more where there are more, into `buf`: at once, which is faster than a stream.
fn unpack_zstd(
    decompressor: &mut Option<zstd::bulk::Decompressor<'static>>,
    compressed: &[u8],
    size: u64,
    buf: &mut Vec<u8>,
) -> io::Result<()> {
    let decompressor = match decompressor {
        Some(decompressor) => decompressor,
        None => decompressor.insert(zstd::bulk::Decompressor::new()?),
    };
    buf.clear();
    // Memory that is taken, but not touched, where the chunk claims more than it holds.
    buf.try_reserve_exact(size as usize + 1).map_err(io::Error::other)?;
    let Err(error) = decompressor.decompress_to_buffer(compressed, buf) else { return Ok(()) };
    // Whether it is bad, or holds more than it claims, a stream tells.
    buf.clear();
    let mut stream = zstd::Decoder::with_buffer(compressed)?.take(size + 1);
    if io::copy(&mut stream, &mut io::sink())? > size {
        buf.resize(size as usize + 1, 0);
        return Ok(());
    }
    Err(error)
}

/// Puts the records of the chunk at `offset` into `buf`, as many bytes as its header claims, from a stream.
pub(super) fn decompress(
    file: &LogFile,
    offset: u64,
    header: &ChunkHeader,
    compressed: impl BufRead,
    buf: &mut Vec<u8>,
) -> Result<(), LogError> {
    let size = header.uncompressed_size;
    if size > file.options.memory_limit {
        return Err(file.too_large(offset, "the chunk", size));
    }
    // One byte more than claimed tells a chunk that holds more from one that is right.
    stream(file, offset, header, compressed, size + 1, buf)?
        .map_err(|e| file.damaged(offset, format!("the chunk can't be decompressed: {e}")))?;
    check_size(file, offset, size, buf)
}

fn check_size(file: &LogFile, offset: u64, size: u64, records: &[u8]) -> Result<(), LogError> {
    let relation = match (records.len() as u64).cmp(&size) {
        Ordering::Equal => return Ok(()),
        Ordering::Greater => "more than",
        Ordering::Less => "less than",
    };
    Err(file.damaged(offset, format!("the chunk holds {relation} the {size} bytes it claims")))
}

/// What can be decompressed of a chunk that is cut off, up to its last whole record.
fn read_cut(file: &LogFile, cut: &CutChunk, buf: &mut Vec<u8>) -> Result<(), LogError> {
    let size = cut.header.uncompressed_size;
    let compressed = file.reader(cut.data.start).take(cut.data.end - cut.data.start);
    let compressed = BufReader::with_capacity(1 << 17, compressed);
    // That it ends too early is no news.
    let _ = stream(file, cut.offset, &cut.header, compressed, size.min(file.options.memory_limit), buf)?;
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
