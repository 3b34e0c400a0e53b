//! The wanted messages of one chunk, or of one run of messages outside chunks, in memory.

use std::collections::BTreeSet;
use std::ops::Range;

use mcap::records::op;

use super::chunk::{self, Block, Scratch};
use super::file::{HEAD_LEN, LogFile};
use super::{LogError, Message, by_index};

/// Channel, sequence, two times, before a message's payload.
pub(super) const MESSAGE_HEADER_LEN: usize = 2 + 4 + 8 + 8;

/// What of a block is wanted, and how it may be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted<'a> {
    /// The channels; `None` for all.
    pub(super) channels: Option<&'a BTreeSet<u16>>,
    /// Whether the message indexes are known to name every message.
    pub(super) by_index: bool,
}

/// The wanted messages of a block; its memory serves one block after the other.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) bytes: Vec<u8>,
    /// Where the bodies of the wanted messages stand in `bytes`, in file order.
    pub(super) messages: Vec<Range<usize>>,
    /// Whether it was read by message index, so that its checksum could not be checked.
    pub(super) by_index: bool,
    /// What is wrong with it; messages before that stand.
    pub(super) damage: Option<LogError>,
}

impl Part {
    /// Reads the wanted messages of `block`, in place of what it held. What goes wrong is in `damage`.
    pub(super) fn read(
        &mut self,
        file: &LogFile,
        block: &Block<'_>,
        wanted: Wanted<'_>,
        scratch: &mut Scratch,
    ) {
        self.messages.clear();
        (self.by_index, self.damage) = (false, None);
        if let (true, Some(channels), Block::Chunk(chunk)) = (wanted.by_index, wanted.channels, block) {
            self.by_index = by_index::read(file, chunk, channels, self).is_some();
            if self.by_index {
                return;
            }
            self.messages.clear();
        }
        match chunk::read_block(file, block, scratch, &mut self.bytes) {
            Ok(()) => self.damage = self.find_messages(file, block, wanted).err(),
            Err(error) => self.damage = Some(error),
        }
    }

    fn find_messages(
        &mut self,
        file: &LogFile,
        block: &Block<'_>,
        wanted: Wanted<'_>,
    ) -> Result<(), LogError> {
        let mut start = 0;
        for record in chunk::records(&self.bytes) {
            let record = record.map_err(|left| {
                file.damaged(block.offset(), format!("the last {left} bytes of the chunk are no record"))
            })?;
            let end = start + record.whole.len();
            if record.opcode == op::MESSAGE {
                let message = Message::parse(record.body).ok_or_else(|| {
                    let len = record.body.len();
                    file.damaged(
                        block.offset(),
                        format!("a message: its fields need more than its {len} bytes"),
                    )
                })?;
                if wanted.channels.is_none_or(|channels| channels.contains(&message.channel_id)) {
                    self.messages.push(start + HEAD_LEN as usize..end);
                }
            }
            start = end;
        }
        Ok(())
    }

    /// The messages that were found.
    pub(super) fn messages(&self) -> impl Iterator<Item = Message<'_>> {
        self.messages.iter().filter_map(|range| Message::parse(self.bytes.get(range.clone())?))
    }
}

impl<'a> Message<'a> {
    /// The message in a record's body; `None` where that is too short for one.
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let (&[c0, c1, ref rest @ ..], data) = body.split_first_chunk::<MESSAGE_HEADER_LEN>()?;
        let (sequence, rest) = rest.split_first_chunk::<4>()?;
        let (log_time, rest) = rest.split_first_chunk::<8>()?;
        let (publish_time, _) = rest.split_first_chunk::<8>()?;
        Some(Self {
            channel_id: u16::from_le_bytes([c0, c1]),
            sequence: u32::from_le_bytes(*sequence),
            log_time: u64::from_le_bytes(*log_time),
            publish_time: u64::from_le_bytes(*publish_time),
            data,
        })
    }
}
