//! Messages, only those asked for, one chunk in memory at a time.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{MessageHeader, op};

use super::file::{LogFile, parse};
use super::{Log, LogError, chunk};

/// Channel, sequence, two times, before a message's payload.
pub(super) const MESSAGE_HEADER_LEN: usize = 2 + 4 + 8 + 8;

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

impl Log {
    /// Hands the messages of `channels` to `f`, in file order, which need not be the order of time.
    ///
    /// Reads only chunks that hold one of the channels, and checks their CRCs before it hands on
    /// anything of them.
    ///
    /// # Errors
    /// Whatever `f` returns; [`LogError::Damaged`] naming the chunk's offset when its CRC or size is
    /// wrong; [`LogError::TooLarge`] above 1 GiB; [`LogError::UnknownCompression`].
    pub fn for_each_message<E: From<LogError>>(
        &self,
        channels: &BTreeSet<u16>,
        mut f: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let wanted = |block: &chunk::Block<'_>| channels.iter().any(|&id| block.may_hold(id));
        self.for_each_message_of(self.blocks().into_iter().filter(wanted), |message| {
            if channels.contains(&message.channel_id) { f(message) } else { Ok(()) }
        })
    }

    /// The first message in the file of each of `channels` that has one, reading as few chunks as
    /// that takes; and the parts that could not be read, which are passed over.
    #[must_use]
    pub fn first_messages(&self, channels: &BTreeSet<u16>) -> (BTreeMap<u16, OwnedMessage>, Vec<LogError>) {
        let mut missing = channels.clone();
        let (mut first, mut damaged) = (BTreeMap::new(), Vec::new());
        for block in self.blocks() {
            if missing.is_empty() {
                break;
            }
            if !missing.iter().any(|&id| block.may_hold(id)) {
                continue;
            }
            let read = self.for_each_message_of([block], |message| {
                if missing.remove(&message.channel_id) {
                    first.insert(message.channel_id, message.into());
                }
                Ok::<_, LogError>(())
            });
            damaged.extend(read.err());
        }
        (first, damaged)
    }

    /// Hands all messages of `blocks` to `f`.
    pub(super) fn for_each_message_of<'b, E: From<LogError>>(
        &self,
        blocks: impl IntoIterator<Item = chunk::Block<'b>>,
        mut f: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        chunk::for_each_record(&self.file, blocks, |block, record| match record.opcode {
            op::MESSAGE => f(message(&self.file, block, record.body)?),
            _ => Ok(()),
        })
    }
}

fn message<'a>(file: &LogFile, block: &chunk::Block<'_>, body: &'a [u8]) -> Result<Message<'a>, LogError> {
    let header: MessageHeader =
        parse(body).map_err(|problem| file.damaged(block.offset(), format!("a message: {problem}")))?;
    Ok(Message {
        channel_id: header.channel_id,
        sequence: header.sequence,
        log_time: header.log_time,
        publish_time: header.publish_time,
        data: body.get(MESSAGE_HEADER_LEN..).unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::fixture::{chunked, log, on_disk};
    use super::*;

    fn times(log: &Log, channel: u16) -> Result<Vec<u64>, LogError> {
        let mut times = Vec::new();
        log.for_each_message(&[channel].into(), |message| {
            times.push(message.log_time / 1_000_000_000);
            Ok::<_, LogError>(())
        })?;
        Ok(times)
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
            Err(LogError::Damaged { offset: at, what, .. }) => {
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
