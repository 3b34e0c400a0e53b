//! A chunk of ours, while it is filled and when it is full.

use std::collections::BTreeMap;
use std::io;

use mcap::records::{ChunkHeader, ChunkIndex, MessageHeader, MessageIndex, MessageIndexEntry, op};

use super::Compression;
use super::summary::{encode, encode_body, encode_bytes};

/// A viewer's seek then loads at most this much more than before.
const CHUNK_BYTES: usize = 4_000_000;
/// And at most this much log time.
const CHUNK_NS: u64 = 30_000_000_000;

/// The messages of the chunk that is being filled.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    records: Vec<u8>,
    index: BTreeMap<u16, Vec<MessageIndexEntry>>,
    start: u64,
    end: u64,
}

impl Chunk {
    pub(super) fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    pub(super) fn has_room(&self, time: u64, len: usize) -> bool {
        self.records.is_empty()
            || self.records.len() + len <= CHUNK_BYTES
                && self.end.max(time) - self.start.min(time) <= CHUNK_NS
    }

    pub(super) fn push(&mut self, header: &MessageHeader, record: &[u8]) {
        let time = header.log_time;
        (self.start, self.end) =
            if self.records.is_empty() { (time, time) } else { (self.start.min(time), self.end.max(time)) };
        let entry = MessageIndexEntry { log_time: time, offset: self.records.len() as u64 };
        self.index.entry(header.channel_id).or_default().push(entry);
        self.records.extend_from_slice(record);
    }

    /// The chunk's record and its message indexes, as they shall stand at `chunk_start_offset`, and its entry in the
    /// chunk index.
    pub(super) fn pack(
        self,
        compression: Compression,
        chunk_start_offset: u64,
    ) -> io::Result<(Vec<u8>, ChunkIndex)> {
        let compressed = compression.compress(&self.records)?;
        let header = ChunkHeader {
            message_start_time: self.start,
            message_end_time: self.end,
            uncompressed_size: self.records.len() as u64,
            uncompressed_crc: crc32fast::hash(&self.records),
            compression: compression.name().to_owned(),
            compressed_size: compressed.len() as u64,
        };
        let mut packed = encode_bytes(op::CHUNK, &[&encode_body(&header), &compressed]);
        let chunk_length = packed.len() as u64;
        let mut message_index_offsets = BTreeMap::new();
        for (channel_id, mut records) in self.index {
            records.sort_by_key(|entry| entry.log_time);
            message_index_offsets.insert(channel_id, chunk_start_offset + packed.len() as u64);
            packed.extend(encode(op::MESSAGE_INDEX, &MessageIndex { channel_id, records }));
        }
        let entry = ChunkIndex {
            message_start_time: self.start,
            message_end_time: self.end,
            chunk_start_offset,
            chunk_length,
            message_index_offsets,
            message_index_length: packed.len() as u64 - chunk_length,
            compression: header.compression,
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        };
        Ok((packed, entry))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::file::parse;
    use super::super::fixture::{chunked, log, on_disk};
    use super::super::{Appender, Destination, Log, NewChannel, NewMessage};
    use super::*;

    fn channel(topic: &str) -> NewChannel {
        NewChannel::json(topic, "trackfuse.Test", "{}")
    }

    #[test]
    fn new_chunks_are_short_in_time_and_small() {
        let (dir, path) = on_disk(&log(chunked()));
        let log = Log::open(&path).unwrap();
        let out = dir.path().join("out.mcap");
        let mut appender =
            Appender::begin(&log, &Destination::new_file(&out), &[channel("/x")], Compression::Zstd).unwrap();
        let large = vec![b' '; 1_500_000];
        for i in 0..100_u64 {
            let data: &[u8] = if i < 10 { &large } else { b"1" };
            appender.write(NewMessage { channel: 0, time_ns: i * 1_000_000_000, data }).unwrap();
        }
        appender.finish().unwrap();
        let written = Log::open(&out).unwrap();
        let (old, new) = written.index().chunks.split_at(log.index().chunks.len());
        assert_eq!(old, log.index().chunks);
        // Two of the large ones fit into one chunk, and 31 of the small ones into 30 s.
        assert_eq!(new.len(), 7);
        for chunk in new {
            assert!(chunk.uncompressed_size <= CHUNK_BYTES as u64, "{chunk:?}");
            assert!(chunk.message_end_time - chunk.message_start_time <= CHUNK_NS, "{chunk:?}");
        }
    }

    #[test]
    fn every_entry_of_a_new_message_index_leads_to_its_message() {
        let (dir, path) = on_disk(&log(chunked()));
        let log = Log::open(&path).unwrap();
        let out = dir.path().join("out.mcap");
        let channels = [channel("/x"), channel("/y")];
        let mut appender =
            Appender::begin(&log, &Destination::new_file(&out), &channels, Compression::None).unwrap();
        for i in 0..40 {
            // Not in the order of time, as messages of several channels may come.
            appender.write(NewMessage { channel: i % 2, time_ns: (i as u64 * 7) % 40, data: b"{}" }).unwrap();
        }
        appender.finish().unwrap();
        let (output, written) = (fs::read(&out).unwrap(), Log::open(&out).unwrap());
        let chunk = written.index().chunks.last().unwrap();
        let content = &output[chunk.compressed_data_offset().unwrap() as usize..];
        let mut entries = 0;
        for (&channel_id, &at) in &chunk.message_index_offsets {
            let index: MessageIndex = parse(&output[at as usize + 9..]).unwrap();
            assert!(index.records.is_sorted_by_key(|entry| entry.log_time));
            for entry in index.records {
                let message: MessageHeader = parse(&content[entry.offset as usize + 9..]).unwrap();
                assert_eq!(content[entry.offset as usize], op::MESSAGE);
                assert_eq!((message.channel_id, message.log_time), (channel_id, entry.log_time));
                entries += 1;
            }
        }
        assert_eq!(entries, 40);
    }
}
