//! Messages, only those asked for, one chunk in memory at a time.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{MessageHeader, op};

use super::file::{LogFile, parse};
use super::{Log, LogError, chunk};

/// Channel, sequence, two times, before a message's payload.
const MESSAGE_HEADER_LEN: usize = 2 + 4 + 8 + 8;

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
        chunk::for_each_record(&self.file, self.blocks().into_iter().filter(wanted), |block, record| {
            if record.opcode != op::MESSAGE {
                return Ok(());
            }
            let message = message(&self.file, block, record.body)?;
            if channels.contains(&message.channel_id) { f(message) } else { Ok(()) }
        })
    }

    /// The first message in the file of each of `channels` that has one, reading as few chunks as
    /// that takes.
    ///
    /// # Errors
    /// As [`Log::for_each_message`].
    pub fn first_messages(&self, channels: &BTreeSet<u16>) -> Result<BTreeMap<u16, OwnedMessage>, LogError> {
        let mut missing = channels.clone();
        let mut first = BTreeMap::new();
        for block in self.blocks() {
            if missing.is_empty() {
                break;
            }
            if !missing.iter().any(|&id| block.may_hold(id)) {
                continue;
            }
            chunk::for_each_record(&self.file, [block], |block, record| {
                if record.opcode == op::MESSAGE {
                    let message = message(&self.file, block, record.body)?;
                    if missing.remove(&message.channel_id) {
                        first.insert(message.channel_id, message.into());
                    }
                }
                Ok::<_, LogError>(())
            })?;
        }
        Ok(first)
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
