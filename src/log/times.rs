//! When each channel's messages were recorded, from the message indexes: nothing is decompressed for it.
//!
//! A message index holds 16 bytes a message, so that a recording of 50 GB with ten million messages costs
//! 160 MB of reading, beside the chunks and in their order.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{ChunkIndex, op};

use super::chunk::{self, Block, Scratch};
use super::file::{LogFile, parse};
use super::part::{Part, Wanted};
use super::{Log, LogError};

/// What was found beside the times.
#[derive(Debug, Default)]
pub struct TimesRead {
    /// Chunks whose message indexes told.
    pub indexed: usize,
    /// Chunks, and runs of messages outside chunks, that had to be read for want of a message index.
    pub opened: usize,
    /// Those that were not read, since they are too large together.
    pub unread: usize,
    /// Chunks without a checksum.
    pub chunks_without_crc: usize,
    /// What could not be read.
    pub damaged: Vec<LogError>,
}

impl TimesRead {
    /// Parts of the log whose times were not told.
    #[must_use]
    pub fn missing(&self) -> usize {
        self.unread + self.damaged.len()
    }
}

impl Log {
    /// Hands the log times, ns, of each channel's messages to `f`, in file order and chunk by chunk.
    ///
    /// Parts without a message index are decompressed where they hold no more than `budget_bytes` together,
    /// and else passed over, as are damaged ones; they come last.
    pub fn for_each_log_time(&self, budget_bytes: u64, mut f: impl FnMut(u16, &[u64])) -> TimesRead {
        let mut read = TimesRead::default();
        let (mut index, mut unindexed) = (Vec::new(), Vec::new());
        for block in self.blocks() {
            if let Block::Chunk(chunk) = &block {
                read.chunks_without_crc += usize::from(self.lacks_crc(chunk) == Some(true));
                if message_index(&self.file, chunk, &mut index, &mut f) {
                    read.indexed += 1;
                    continue;
                }
            }
            unindexed.push(block);
        }
        let size = unindexed.iter().fold(0_u64, |sum, block| sum.saturating_add(block.size()));
        if size > budget_bytes {
            read.unread = unindexed.len();
            return read;
        }
        let (mut part, mut scratch) = (Part::default(), Scratch::default());
        for block in unindexed {
            read.opened += 1;
            let mut times: BTreeMap<u16, Vec<u64>> = BTreeMap::new();
            part.read(&self.file, &block, Wanted { channels: None, by_index: false }, &mut scratch);
            for message in part.messages() {
                times.entry(message.channel_id).or_default().push(message.log_time);
            }
            times.iter().for_each(|(id, times)| f(*id, times));
            read.damaged.extend(part.damage.take());
        }
        read
    }

    /// Whether the chunk's header says that it has no checksum; `None` where it can't be read.
    fn lacks_crc(&self, chunk: &ChunkIndex) -> Option<bool> {
        let end = chunk.chunk_start_offset.checked_add(chunk.chunk_length)?;
        let (header, _) = chunk::read_header(&self.file, chunk.chunk_start_offset, end).ok()?;
        Some(header.uncompressed_crc == 0)
    }
}

/// Hands on what stands in a chunk's message indexes; false where they are not all right behind it.
pub(super) fn message_index(
    file: &LogFile,
    chunk: &ChunkIndex,
    buf: &mut Vec<u8>,
    f: &mut impl FnMut(u16, &[u64]),
) -> bool {
    let start = chunk.chunk_start_offset.saturating_add(chunk.chunk_length);
    if chunk.message_index_offsets.is_empty()
        || file.read_into(start, chunk.message_index_length, "message indexes", buf).is_err()
    {
        return false;
    }
    let records = chunk::records(buf).map_while(Result::ok).filter(|r| r.opcode == op::MESSAGE_INDEX);
    let times = |(id, entries): (u16, Vec<(u64, u64)>)| {
        (id, entries.into_iter().map(|(_, time)| time).collect::<Vec<u64>>())
    };
    let channels = records.map(|record| entries(record.body).map(times));
    let Some(channels) = channels.collect::<Option<Vec<_>>>() else {
        return false;
    };
    let found: BTreeSet<u16> = channels.iter().map(|(id, _)| *id).collect();
    if found.len() != channels.len() || !chunk.message_index_offsets.keys().all(|id| found.contains(id)) {
        return false;
    }
    channels.iter().for_each(|(id, times)| f(*id, times));
    true
}

/// A message index's channel, and the place and the time of its messages in the order in which they stand in the
/// chunk.
pub(super) fn entries(body: &[u8]) -> Option<(u16, Vec<(u64, u64)>)> {
    let (id, len) = parse::<(u16, u32)>(body).ok()?;
    let (entries, []) = body.get(6..)?.get(..len as usize)?.as_chunks::<16>() else { return None };
    let number = |bytes: &[u8]| bytes.try_into().map(u64::from_le_bytes).unwrap_or_default();
    let mut entries: Vec<(u64, u64)> =
        entries.iter().map(|entry| (number(&entry[8..]), number(&entry[..8]))).collect();
    if !entries.is_sorted() {
        entries.sort_unstable();
    }
    Some((id, entries))
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{chunked, log, on_disk};
    use super::*;

    fn seconds(bytes: &[u8], budget_bytes: u64) -> (BTreeMap<u16, Vec<u64>>, TimesRead) {
        let (_dir, path) = on_disk(bytes);
        let mut found: BTreeMap<u16, Vec<u64>> = BTreeMap::new();
        let read = Log::open(path).unwrap().for_each_log_time(budget_bytes, |id, times| {
            found.entry(id).or_default().extend(times.iter().map(|ns| ns / 1_000_000_000));
        });
        (found, read)
    }

    fn expected() -> BTreeMap<u16, Vec<u64>> {
        let odd = |i: &u64| *i >= 10 && i % 2 == 1;
        [(1, (0..20).filter(|i| !odd(i)).collect()), (2, (0..20).filter(odd).collect())].into()
    }

    #[test]
    fn times_come_from_the_message_indexes_without_a_look_into_the_chunks() {
        let mut bytes = log(chunked());
        // Nothing of this could be read.
        while let Some(at) = bytes.windows(6).position(|window| window == b"{\"i\":1") {
            bytes[at] = b'x';
        }
        let (found, read) = seconds(&bytes, 0);
        assert_eq!(found, expected());
        assert!(read.indexed > 3 && read.opened + read.unread + read.chunks_without_crc == 0, "{read:?}");
    }

    #[test]
    fn parts_without_a_message_index_are_opened_where_that_is_not_too_much() {
        for options in [chunked().emit_message_indexes(false), chunked().use_chunks(false)] {
            let bytes = log(options);
            let (found, read) = seconds(&bytes, u64::MAX);
            assert_eq!(found, expected());
            assert!(read.opened > 0 && read.indexed == 0, "{read:?}");
            let (found, read) = seconds(&bytes, 10);
            assert!(found.is_empty() && read.unread > 0, "{read:?}");
        }
    }

    #[test]
    fn times_are_in_file_order_though_the_index_is_sorted_by_time() {
        let entry = |time: u64, offset: u64| [time.to_le_bytes(), offset.to_le_bytes()].concat();
        let entries_of = [entry(5, 70), entry(6, 30), entry(9, 50)].concat();
        let body = [&[2, 0, 48, 0, 0, 0][..], &entries_of].concat();
        assert_eq!(entries(&body), Some((2, vec![(30, 6), (50, 9), (70, 5)])));
    }

    #[test]
    fn an_index_that_is_no_index_counts_as_none() {
        assert_eq!(
            entries(&[1, 0, 16, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0]),
            Some((1, vec![(3, 7)]))
        );
        assert_eq!(entries(&[1, 0, 15, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0]), None);
        assert_eq!(entries(&[1, 0, 255, 255, 255, 255]), None);
        assert_eq!(entries(&[1]), None);
    }
}
