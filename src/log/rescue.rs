//! What of a log that is cut off goes into new records: messages of the chunk that was cut, and the message indexes
//! that the last whole chunk lost.

use std::collections::BTreeMap;

use mcap::records::{ChunkIndex, MessageHeader, MessageIndex, MessageIndexEntry, op};

use super::chunk::{self, Block, Scratch};
use super::file::{LogFile, parse};
use super::{Index, LogError};

/// The last whole chunk of a log that is cut off among its message indexes.
#[derive(Clone, Debug)]
pub(super) struct TornChunk {
    /// Its index entry, with the message indexes that are whole.
    pub(super) whole: ChunkIndex,
}

/// The message indexes that the torn chunk lost, and its index entry with those that are left.
pub(super) fn lost_message_indexes(
    file: &LogFile,
    index: &Index,
) -> Result<Option<(ChunkIndex, Vec<MessageIndex>)>, LogError> {
    let Some(TornChunk { whole }) = &index.torn_chunk else { return Ok(None) };
    // One that can't be decoded was taken out of the index.
    if !index.chunks.iter().any(|chunk| chunk.chunk_start_offset == whole.chunk_start_offset) {
        return Ok(None);
    }
    let mut buf = Vec::new();
    chunk::read_block(file, &Block::Chunk(whole), &mut Scratch::default(), &mut buf)?;
    let mut lost: BTreeMap<u16, Vec<MessageIndexEntry>> = BTreeMap::new();
    let mut offset = 0;
    for record in chunk::records(&buf).map_while(Result::ok) {
        if record.opcode == op::MESSAGE
            && let Ok(MessageHeader { channel_id, log_time, .. }) = parse(record.body)
            && !whole.message_index_offsets.contains_key(&channel_id)
        {
            lost.entry(channel_id).or_default().push(MessageIndexEntry { log_time, offset });
        }
        offset += record.whole.len() as u64;
    }
    let indexes = lost.into_iter().map(|(channel_id, mut records)| {
        records.sort_by_key(|entry| entry.log_time);
        MessageIndex { channel_id, records }
    });
    Ok(Some((whole.clone(), indexes.collect())))
}

/// Schemas, channels and messages that are left of the cut chunk, one after the other.
pub(super) fn left_of_cut_chunk(file: &LogFile, index: &Index) -> Result<Vec<u8>, LogError> {
    let mut buf = Vec::new();
    if let Some(cut) = &index.cut_chunk {
        chunk::read_block(file, &Block::Cut(cut), &mut Scratch::default(), &mut buf)?;
    }
    Ok(buf)
}
