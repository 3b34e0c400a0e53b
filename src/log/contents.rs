//! What the chunks hold: schemas, channels, and how many messages of which.

use std::collections::BTreeSet;

use mcap::records::{ChunkIndex, MessageHeader, Statistics, op};

use super::LogError;
use super::chunk::{self, Block, Scratch};
use super::file::{LogFile, parse};
use super::times;

/// What stands in a part of the log that holds messages.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// Schemas and channels, whole records, each id once.
    pub(super) definitions: Vec<(u8, Vec<u8>)>,
    /// Its messages.
    pub(super) counted: Statistics,
}

/// Why a part can't be looked into.
#[derive(Debug)]
pub(super) enum Closed {
    /// Its content isn't what was written.
    Undecodable(String),
    /// It may be whole, but this program can't read it.
    Unread(String),
}

/// Reads the whole of a part. Nothing of it counts unless all of it is right.
pub(super) fn look_into(
    file: &LogFile,
    block: &Block<'_>,
    scratch: &mut Scratch,
    buf: &mut Vec<u8>,
) -> Result<Result<Contents, Closed>, LogError> {
    match contents(file, block, scratch, buf) {
        Ok(contents) => Ok(Ok(contents)),
        Err(LogError::Damaged { what, .. } | LogError::BadChunk { what, .. }) => {
            Ok(Err(Closed::Undecodable(what)))
        }
        Err(LogError::TooLarge { size, limit, .. }) => Ok(Err(Closed::Unread(format!(
            "the chunk claims {size} bytes, more than the limit of {limit}: it was not read"
        )))),
        Err(LogError::UnknownCompression { name, .. }) => Ok(Err(Closed::Unread(format!(
            "the chunk is compressed with {name:?}, expected zstd, lz4 or none: it was not read"
        )))),
        Err(other) => Err(other),
    }
}

fn contents(
    file: &LogFile,
    block: &Block<'_>,
    scratch: &mut Scratch,
    buf: &mut Vec<u8>,
) -> Result<Contents, LogError> {
    chunk::read_block(file, block, scratch, buf)?;
    let mut found = Contents::default();
    let mut seen = BTreeSet::new();
    for record in chunk::records(buf) {
        let record = record.map_err(|left| {
            file.damaged(block.offset(), format!("the last {left} bytes of the chunk are no record"))
        })?;
        let bad = |problem| file.damaged(block.offset(), format!("the chunk: {problem}"));
        match record.opcode {
            op::MESSAGE => {
                let header: MessageHeader = parse(record.body).map_err(bad)?;
                count(&mut found.counted, &header);
            }
            // The id is the first field of both.
            op::SCHEMA | op::CHANNEL
                if seen.insert((record.opcode, parse::<u16>(record.body).map_err(bad)?)) =>
            {
                found.definitions.push((record.opcode, record.whole.to_vec()));
            }
            _ => {}
        }
    }
    Ok(found)
}

/// Counts a message in.
pub(super) fn count(statistics: &mut Statistics, message: &MessageHeader) {
    let one = Statistics {
        message_count: 1,
        message_start_time: message.log_time,
        message_end_time: message.log_time,
        ..Statistics::default()
    };
    add(statistics, &one);
    // Saturating, since old counts may be anything.
    let counted = statistics.channel_message_counts.entry(message.channel_id).or_default();
    *counted = counted.saturating_add(1);
}

/// Adds other messages' number and times, and their numbers by channel.
pub(super) fn add(statistics: &mut Statistics, others: &Statistics) {
    if others.message_count == 0 {
        return;
    }
    let (start, end) = (others.message_start_time, others.message_end_time);
    (statistics.message_start_time, statistics.message_end_time) = match statistics.message_count {
        0 => (start, end),
        _ => (statistics.message_start_time.min(start), statistics.message_end_time.max(end)),
    };
    statistics.message_count = statistics.message_count.saturating_add(others.message_count);
    for (&id, &messages) in &others.channel_message_counts {
        let counted = statistics.channel_message_counts.entry(id).or_default();
        *counted = counted.saturating_add(messages);
    }
}

/// Whether the message indexes behind a chunk name as many messages of each channel as it holds.
pub(super) fn is_indexed(file: &LogFile, chunk: &ChunkIndex, counted: &Statistics) -> bool {
    let mut named = std::collections::BTreeMap::new();
    let mut buf = Vec::new();
    times::message_index(file, chunk, &mut buf, &mut |id, times: &[u64]| {
        named.insert(id, times.len() as u64);
    });
    named.retain(|_, messages| *messages > 0);
    named == counted.channel_message_counts
}
