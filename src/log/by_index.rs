//! Messages of uncompressed chunks, read one by one where the message indexes say that they stand.
//!
//! A recording of several cameras holds a position a few hundred bytes long every few MB: reading just those bytes
//! is many times faster than reading all of them. What is given up is the chunk's checksum, which spans all of it;
//! whoever asks is told for how many chunks that was. What is checked instead: the head of each message (opcode,
//! length, channel, time) against its index entry, that no two overlap, and beforehand that the indexes name as
//! many messages as the statistics count. Where anything disagrees, the chunk is read whole.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{ChunkIndex, op};

use super::chunk::{self, Block, Scratch};
use super::file::{HEAD_LEN, LogFile, split_head};
use super::part::{MESSAGE_HEADER_LEN, Part, Wanted};
use super::times::entries;
use super::{Log, Message};

/// Messages that lie closer than this on average, bytes, are read with the rest of their chunk: a page has to be
/// fetched for each.
const SPARSE: u64 = 4096;
/// How much is read at a message's place: most are shorter, and the next may stand in it too.
const WINDOW: u64 = 4096;
/// Messages outside chunks, which no index names, are counted where they have no more bytes than this together.
const LOOSE_BYTES: u64 = 64 << 20;

impl Log {
    /// Whether the message indexes name every message of `channels`, as far as the statistics count them.
    pub(super) fn is_indexed(&self, channels: &BTreeSet<u16>) -> bool {
        let index = self.index();
        let uncompressed = index.chunks.iter().any(|c| c.compression.is_empty());
        let Some(statistics) = index.statistics.as_ref().filter(|_| uncompressed) else { return false };
        let Some(counts) = self.counted_by_index(channels) else { return false };
        let counted = |id| statistics.channel_message_counts.get(id).copied().unwrap_or(0);
        channels.iter().all(|id| counts.get(id).copied().unwrap_or(0) == counted(id))
    }

    /// How many messages of each of `channels` the message indexes name, and stand outside chunks; `None` where a
    /// chunk has no message index.
    pub(super) fn counted_by_index(&self, channels: &BTreeSet<u16>) -> Option<BTreeMap<u16, u64>> {
        let mut counts = self.loose_messages(channels)?;
        for chunk in &self.index().chunks {
            if chunk.message_index_offsets.is_empty() && chunk.uncompressed_size > 0 {
                return None;
            }
            for (&id, &offset) in chunk.message_index_offsets.iter().filter(|(id, _)| channels.contains(id)) {
                *counts.entry(id).or_default() += self.indexed_messages(id, offset)?;
            }
        }
        Some(counts)
    }

    /// How many messages of each channel stand outside chunks; `None` where that is too much to be counted.
    fn loose_messages(&self, channels: &BTreeSet<u16>) -> Option<BTreeMap<u16, u64>> {
        let loose = &self.index().loose;
        let size: u64 = loose.iter().map(|range| range.end - range.start).sum();
        if size > LOOSE_BYTES {
            return None;
        }
        let mut counts = BTreeMap::new();
        let (mut part, mut scratch) = (Part::default(), Scratch::default());
        for range in loose {
            let wanted = Wanted { channels: Some(channels), by_index: false };
            part.read(&self.file, &Block::Loose(range.clone()), wanted, &mut scratch);
            for message in part.messages() {
                *counts.entry(message.channel_id).or_default() += 1;
            }
        }
        Some(counts)
    }

    /// How many messages the message index at `offset` names.
    fn indexed_messages(&self, id: u16, offset: u64) -> Option<u64> {
        let head = self.file.head(offset, self.index().data_end).ok()?;
        let start = self.file.bytes(head.body(), head.body_len.min(6), "a message index").ok()?;
        let &[a, b, ref len @ ..] = <&[u8; 6]>::try_from(start.as_slice()).ok()?;
        let len = u32::from_le_bytes(*len);
        (head.opcode == op::MESSAGE_INDEX && u16::from_le_bytes([a, b]) == id).then_some(u64::from(len) / 16)
    }
}

/// Reads the messages of `channels` in `chunk` into `part`; `None` where they should be read with the whole chunk:
/// it is compressed, they lie too close, or an index is not right.
pub(super) fn read(
    file: &LogFile,
    chunk: &ChunkIndex,
    channels: &BTreeSet<u16>,
    part: &mut Part,
) -> Option<()> {
    if !chunk.compression.is_empty() || chunk.message_index_offsets.is_empty() {
        return None;
    }
    let chunk_end = chunk.chunk_start_offset.checked_add(chunk.chunk_length)?;
    let (header, data) = chunk::read_header(file, chunk.chunk_start_offset, chunk_end).ok()?;
    let size = data.end - data.start;
    if !header.compression.is_empty() || header.uncompressed_size != size {
        return None;
    }
    let found = places(file, chunk, channels, size / SPARSE)?;
    part.bytes.clear();
    let mut window = Window { file, start: 0, bytes: Vec::new() };
    let mut free_from = 0;
    for (place, log_time, channel) in found {
        let head_len = HEAD_LEN + MESSAGE_HEADER_LEN as u64;
        if place < free_from || place.checked_add(head_len)? > size {
            return None;
        }
        let at = data.start + place;
        let head = window.read(at, head_len, data.end)?;
        let (opcode, body_len) = split_head(head)?;
        let message = Message::parse(head.get(HEAD_LEN as usize..)?)?;
        free_from = place.checked_add(HEAD_LEN)?.checked_add(body_len)?;
        let agrees = opcode == op::MESSAGE
            && body_len >= MESSAGE_HEADER_LEN as u64
            && free_from <= size
            && (message.channel_id, message.log_time) == (channel, log_time);
        if !agrees {
            return None;
        }
        let start = part.bytes.len();
        part.bytes.extend_from_slice(window.read(at + HEAD_LEN, body_len, data.end)?);
        part.messages.push(start..part.bytes.len());
    }
    Some(())
}

/// Place in the chunk, log time and channel of its messages of `channels`, in file order; `None` where an index is
/// not right, or there are more than `most`.
fn places(
    file: &LogFile,
    chunk: &ChunkIndex,
    channels: &BTreeSet<u16>,
    most: u64,
) -> Option<Vec<(u64, u64, u16)>> {
    let mut found = Vec::new();
    let end = file.len;
    for (&id, &offset) in chunk.message_index_offsets.iter().filter(|(id, _)| channels.contains(id)) {
        let head = file.head(offset, end).ok()?;
        // Far more than so many entries take need not be read to see that there are more.
        if head.opcode != op::MESSAGE_INDEX || head.body_len / 32 > most {
            return None;
        }
        let (channel, entries) = entries(&file.bytes(head.body(), head.body_len, "a message index").ok()?)?;
        if channel != id {
            return None;
        }
        found.extend(entries.into_iter().map(|(place, time)| (place, time, id)));
    }
    found.sort_unstable();
    (found.len() as u64 <= most).then_some(found)
}

/// The part of the file that was read last.
struct Window<'a> {
    file: &'a LogFile,
    start: u64,
    bytes: Vec<u8>,
}

impl Window<'_> {
    /// The bytes `[at, at + len)`, which lie before `end`, read anew where they aren't in the window.
    fn read(&mut self, at: u64, len: u64, end: u64) -> Option<&[u8]> {
        let holds = |window: &Self| {
            at >= window.start
                && at.checked_add(len).is_some_and(|e| e <= window.start + window.bytes.len() as u64)
        };
        if !holds(self) {
            let len = len.max(WINDOW).min(end - at);
            self.file.read_into(at, len, "messages of a chunk", &mut self.bytes).ok()?;
            self.start = at;
        }
        let from = (at - self.start) as usize;
        self.bytes.get(from..from + len as usize)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::io::Cursor;

    use mcap::records::MessageHeader;

    use super::super::fixture::{on_disk, records};
    use super::super::{LogError, MessagesRead, OwnedMessage, ReadOptions, bad_chunks};
    use super::*;

    /// The channels, then chunks of ten frames of 100 KB (channel 0), with a short message on 1 at each and a longer one on 2 at some.
    fn camera_log(crc: bool) -> Vec<u8> {
        let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(1_000_000));
        let mut writer = options.calculate_chunk_crcs(crc).create(Cursor::new(Vec::new())).unwrap();
        let ids =
            ["/camera", "/a", "/b"].map(|topic| writer.add_channel(0, topic, "x", &BTreeMap::new()).unwrap());
        for i in 0..50_u64 {
            let mut put = |channel: usize, data: &[u8]| {
                let (channel_id, time) = (ids[channel], 1_000 + 10 * (i ^ 1) + channel as u64);
                let header =
                    MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
                writer.write_to_known_channel(&header, data).unwrap();
            };
            put(0, &vec![i as u8; 100_000]);
            put(1, format!("a{i}").as_bytes());
            if i % 3 == 0 {
                put(2, format!("b{i}").repeat(3_000).as_bytes());
            }
        }
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    }

    fn read_all(bytes: &[u8], whole_chunks: bool) -> (Vec<OwnedMessage>, MessagesRead) {
        let (_dir, path) = on_disk(bytes);
        let log = Log::open_with(path, ReadOptions { whole_chunks, ..ReadOptions::default() }).unwrap();
        let mut found = Vec::new();
        let read = log.for_each_message(&[1, 2].map(|i| i + first_id(&log)).into(), |message| {
            found.push(message.into());
            Ok::<_, LogError>(())
        });
        (found, read.unwrap())
    }

    /// The camera's id.
    fn first_id(log: &Log) -> u16 {
        log.index().channels_of("/camera").next().unwrap().id
    }

    fn position(bytes: &[u8], part: &[u8]) -> usize {
        bytes.windows(part.len()).position(|window| window == part).unwrap()
    }

    #[test]
    fn messages_far_apart_are_the_same_read_alone_or_with_their_chunks() {
        let bytes = camera_log(true);
        let (alone, by_index) = read_all(&bytes, false);
        let (with_chunks, whole) = read_all(&bytes, true);
        assert_eq!((alone.len(), &alone), (67, &with_chunks));
        assert!(alone.iter().any(|m| m.data == b"a49") && alone.iter().any(|m| m.data.len() == 9_000));
        assert!(by_index.parts > 3 && by_index.unchecked == by_index.parts - 1, "{by_index:?}");
        assert_eq!((whole.parts, whole.unchecked), (by_index.parts, 0));
    }

    #[test]
    fn of_a_chunk_read_by_message_index_the_checksum_is_not_checked_and_that_is_said() {
        let mut bytes = camera_log(true);
        let frame = position(&bytes, &[7; 9_000]);
        bytes[frame] = 8;
        let (found, read) = read_all(&bytes, false);
        assert!(found.len() == 67 && read.unchecked == read.parts - 1 && read.damaged.is_empty());
        let (found, read) = read_all(&bytes, true);
        assert!(found.len() < 67 && bad_chunks(&read.damaged).len() == 1, "{read:?}");
    }

    #[test]
    fn where_a_message_disagrees_with_its_index_the_chunk_is_read_whole() {
        // The head of `a7`: opcode, length, channel, and time; its payload stands 31 bytes behind its start.
        for (at, value) in [(0, 4_u8), (1, 3), (5, 1), (9, 9), (15, 1)] {
            let mut bytes = camera_log(true);
            let head = position(&bytes, b"a7") - 31;
            bytes[head + at] = value;
            let (found, read) = read_all(&bytes, false);
            assert_eq!((bad_chunks(&read.damaged).len(), read.unchecked), (1, read.parts - 2), "byte {at}");
            assert!(found.iter().all(|m| m.data != b"a7"), "byte {at}");
        }
    }

    #[test]
    fn an_index_that_leaves_out_messages_is_not_relied_on() {
        let mut bytes = camera_log(true);
        let (opcode, at) =
            records(&bytes).into_iter().find(|(opcode, _)| *opcode == op::MESSAGE_INDEX).unwrap();
        assert_eq!(opcode, op::MESSAGE_INDEX);
        // `/a` and `/b` have indexes behind it; one entry of the last before the next chunk goes.
        let next = at + 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let entries = next + 9 + 2;
        let len = u32::from_le_bytes(bytes[entries..entries + 4].try_into().unwrap());
        bytes[entries..entries + 4].copy_from_slice(&(len - 16).to_le_bytes());
        let (found, read) = read_all(&bytes, false);
        assert_eq!((found.len(), read.unchecked), (67, 0), "the statistics count one more");
    }

    #[test]
    fn messages_close_together_are_read_with_their_chunk() {
        let (_dir, path) = on_disk(&camera_log(true));
        let log = Log::open(path).unwrap();
        let all = [0, 1, 2].map(|i| i + first_id(&log)).into();
        let read = log.for_each_message(&all, |_| Ok::<_, LogError>(())).unwrap();
        assert_eq!(read.unchecked, read.parts - 1, "frames of 100 KB are far apart");
        let (_dir, path) = on_disk(&super::super::fixture::log(super::super::fixture::chunked()));
        let read =
            Log::open(path).unwrap().for_each_message(&[1, 2].into(), |_| Ok::<_, LogError>(())).unwrap();
        assert!(read.parts > 0 && read.unchecked == 0, "{read:?}");
    }
}
