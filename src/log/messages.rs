//! Messages, only those asked for, a few chunks in memory at a time.

use std::collections::{BTreeMap, BTreeSet};

use super::chunk::{Block, Scratch};
use super::in_order::for_each_part;
use super::part::{Part, Wanted};
use super::{Log, LogError, Work};

/// A message as it stands in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// Its channel's id.
    pub channel_id: u16,
    /// Its number in the channel; 0 where the writer doesn't count.
    pub sequence: u32,
    /// When it was recorded, in ns.
    pub log_time: u64,
    /// When it was sent, in ns.
    pub publish_time: u64,
    /// The payload, in the channel's encoding.
    pub data: &'a [u8],
}

/// A message that outlives its chunk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnedMessage {
    /// Its channel's id.
    pub channel_id: u16,
    /// Its number in the channel; 0 where the writer doesn't count.
    pub sequence: u32,
    /// When it was recorded, in ns.
    pub log_time: u64,
    /// When it was sent, in ns.
    pub publish_time: u64,
    /// The payload, in the channel's encoding.
    pub data: Vec<u8>,
}

impl From<Message<'_>> for OwnedMessage {
    fn from(message: Message<'_>) -> Self {
        let Message { channel_id, sequence, log_time, publish_time, data } = message;
        Self { channel_id, sequence, log_time, publish_time, data: data.to_vec() }
    }
}

/// How messages were read.
#[derive(Debug, Default)]
pub struct MessagesRead {
    /// Chunks, and runs of messages outside chunks, that may hold one of the channels.
    pub parts: usize,
    /// How many of them are chunks that were read by message index, so that their checksums were not checked.
    pub unchecked: usize,
    /// What could not be read, or not all of it, and was passed over.
    pub damaged: Vec<LogError>,
}

/// A sentence on each thing that was passed over, the first of many only.
#[must_use]
pub fn passed_over(damaged: &[LogError]) -> Vec<String> {
    const NAMED: usize = 8;
    let sentence = |error: &LogError| {
        let hint = match error {
            LogError::TooLarge { .. } => error.hint().map_or(String::new(), |hint| format!(" ({hint})")),
            _ => String::new(),
        };
        format!("{error}; what can't be read there is left out{hint}")
    };
    let mut sentences: Vec<String> = damaged.iter().take(NAMED).map(sentence).collect();
    if damaged.len() > NAMED {
        let rest = damaged.len() - NAMED;
        sentences.push(format!("{rest} more parts of the log can't be read, and are left out"));
    }
    sentences
}

/// Where the chunks begin that some of `errors` say can't be decoded at all: no index should lead to them.
#[must_use]
pub fn bad_chunks(errors: &[LogError]) -> BTreeSet<u64> {
    let bad = |error: &LogError| match error {
        LogError::BadChunk { offset, .. } => Some(*offset),
        _ => None,
    };
    errors.iter().filter_map(bad).collect()
}

impl Log {
    /// Hands the messages of `channels` to `f`, in file order, which need not be the order of time.
    ///
    /// Reads only chunks that hold one of the channels, several at a time, and checks their CRCs before it hands on
    /// anything of them. Of uncompressed chunks in which the messages lie far apart only these are read, without the
    /// CRC ([`MessagesRead::unchecked`]), unless [`whole_chunks`](super::ReadOptions::whole_chunks) is asked for.
    ///
    /// What can't be decoded is passed over and named in the answer: damage as [`LogError::BadChunk`] or
    /// [`LogError::Damaged`], and [`LogError::TooLarge`] or [`LogError::UnknownCompression`].
    ///
    /// # Errors
    /// Whatever `f` returns; [`LogError::Read`].
    pub fn for_each_message<E: From<LogError>>(
        &self,
        channels: &BTreeSet<u16>,
        f: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<MessagesRead, E> {
        let blocks = self.blocks_of(channels);
        let by_index = !self.file.options.whole_chunks && self.is_indexed(channels);
        let mut read = MessagesRead { parts: blocks.len(), ..MessagesRead::default() };
        let wanted = Wanted { channels: Some(channels), by_index };
        self.for_each_wanted(&blocks, wanted, &mut read, f)?;
        Ok(read)
    }

    /// The first message in the file of each of `channels` that has one, reading as few chunks as
    /// that takes; and the parts that could not be read, which are passed over.
    #[must_use]
    pub fn first_messages(&self, channels: &BTreeSet<u16>) -> (BTreeMap<u16, OwnedMessage>, Vec<LogError>) {
        let mut missing = channels.clone();
        let (mut first, mut damaged) = (BTreeMap::new(), Vec::new());
        let (mut part, mut scratch) = (Part::default(), Scratch::default());
        for block in self.blocks() {
            if missing.is_empty() {
                break;
            }
            if !missing.iter().any(|&id| block.may_hold(id)) {
                continue;
            }
            let wanted = Wanted { channels: Some(&missing), by_index: false };
            part.read(&self.file, &block, wanted, &mut scratch);
            for message in part.messages() {
                if missing.remove(&message.channel_id) {
                    first.insert(message.channel_id, message.into());
                }
            }
            damaged.extend(part.damage.take());
        }
        (first, damaged)
    }

    /// The parts that may hold a message of `channels`, in file order.
    pub(super) fn blocks_of(&self, channels: &BTreeSet<u16>) -> Vec<Block<'_>> {
        let wanted = |block: &Block<'_>| channels.iter().any(|&id| block.may_hold(id));
        self.blocks().into_iter().filter(wanted).collect()
    }

    /// Hands the wanted messages of `blocks` to `f`, in file order, passes over what is damaged, and tells how far
    /// it is.
    pub(super) fn for_each_wanted<E: From<LogError>>(
        &self,
        blocks: &[Block<'_>],
        wanted: Wanted<'_>,
        read: &mut MessagesRead,
        mut f: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let observer = &self.file.options.observer;
        let total: u64 = blocks.iter().fold(0, |sum, block| sum.saturating_add(block.stored_size()));
        let mut done = 0_u64;
        for_each_part(&self.file, blocks, wanted, |block, part| {
            part.messages().try_for_each(&mut f)?;
            read.unchecked += usize::from(part.by_index);
            match part.damage.take() {
                Some(error @ LogError::Read { .. }) => return Err(error.into()),
                damage => read.damaged.extend(damage),
            }
            done = done.saturating_add(block.stored_size());
            observer.tell(Work::Read, done, total);
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::fixture::{chunked, log, on_disk};
    use super::*;

    fn times(log: &Log, channel: u16) -> Result<Vec<u64>, LogError> {
        let mut times = Vec::new();
        let read = log.for_each_message(&[channel].into(), |message| {
            times.push(message.log_time / 1_000_000_000);
            Ok::<_, LogError>(())
        });
        match read.unwrap().damaged.pop() {
            Some(error) => Err(error),
            None => Ok(times),
        }
    }

    #[test]
    fn only_the_wanted_channel_is_handed_on() {
        for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
            let (_dir, path) = on_disk(&log(chunked().compression(compression)));
            let log = Log::open(&path).unwrap();
            assert_eq!(times(&log, 2).unwrap(), [11, 13, 15, 17, 19]);
            assert!(times(&log, 9).unwrap().is_empty());
            let (first, damaged) = log.first_messages(&[1, 2, 9].into());
            assert!(damaged.is_empty());
            assert_eq!(first.keys().copied().collect::<Vec<_>>(), [1, 2]);
            assert_eq!(first[&2].data, b"{\"i\":11}");
            assert_eq!(first[&2].publish_time, 11_000_000_001);
        }
    }

    #[test]
    fn a_chunk_with_a_wrong_crc_is_named_and_others_stay_readable() {
        let (_dir, path) = on_disk(&log(chunked()));
        let offset = Log::open(&path).unwrap().index().chunks[0].chunk_start_offset;
        let mut bytes = fs::read(&path).unwrap();
        let payload = bytes.windows(7).position(|window| window == b"{\"i\":0}").unwrap();
        bytes[payload + 5] = b'7';
        fs::write(&path, &bytes).unwrap();
        let log = Log::open(&path).unwrap();
        match times(&log, 1) {
            Err(LogError::BadChunk { offset: at, what, .. }) => {
                assert_eq!(at, offset);
                assert!(what.contains("CRC"), "{what}");
            }
            other => panic!("{other:?}"),
        }
        // `/b` is in later chunks only, so the bad one isn't even read.
        assert_eq!(times(&log, 2).unwrap().len(), 5);
        let (first, damaged) = log.first_messages(&[1, 2].into());
        assert_eq!(
            (first.len(), damaged.len()),
            (2, 1),
            "the first message of `/a` is then one of a good chunk"
        );
    }

    #[test]
    fn a_chunk_that_holds_other_than_it_claims_is_an_error() {
        let bytes = log(chunked().compression(Some(mcap::Compression::Zstd)));
        let (_dir, path) = on_disk(&bytes);
        let at = Log::open(&path).unwrap().index().chunks[0].chunk_start_offset as usize + 9 + 16;
        let size = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        for (claim, expected) in
            [(size - 1, "more than"), (size + 1, "less than"), (1 << 44, "more than the limit")]
        {
            let mut bytes = bytes.clone();
            bytes[at..at + 8].copy_from_slice(&claim.to_le_bytes());
            fs::write(&path, &bytes).unwrap();
            let error = times(&Log::open(&path).unwrap(), 1).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn an_unknown_compression_is_named() {
        let mut bytes = log(chunked().compression(Some(mcap::Compression::Lz4)));
        while let Some(at) = bytes.windows(3).position(|window| window == b"lz4") {
            bytes[at..at + 3].copy_from_slice(b"xyz");
        }
        let (_dir, path) = on_disk(&super::super::fixture::without_summary_crc(bytes));
        let error = times(&Log::open(&path).unwrap(), 1).unwrap_err();
        assert!(matches!(&error, LogError::UnknownCompression { name, .. } if name == "xyz"), "{error}");
    }
}
