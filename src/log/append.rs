//! A log's successor: its data section byte for byte, new chunks behind it, a summary of both.

use std::{borrow::Cow, collections::BTreeSet, path::PathBuf};

use mcap::records::{Channel, DataEnd, MessageHeader, MetadataIndex, SchemaHeader, Statistics, op};

use super::addition::{Compression, NewChannel, NewMessage, NewMetadata};
use super::contents::count;
use super::file::parse;
use super::ids::{Ids, assign_ids};
use super::index::SummaryRecord;
use super::new_chunk::Chunk;
use super::output::{Destination, Sink};
use super::rescue::{left_of_cut_chunk, lost_message_indexes};
use super::summary::{self, encode, encode_body, encode_bytes};
use super::{Index, Log, LogError, Visibility, chunk, old_tail};

const PIECE: u64 = 1 << 20;

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Where.
    pub path: PathBuf,
    /// Length of the whole output in bytes.
    pub len: u64,
    /// How many messages were added.
    pub messages: u64,
}

/// Writes a log's successor. Until [`Appender::finish`] nothing bears the output's name, and a
/// dropped appender leaves nothing behind; in place, it leaves the log as it was.
#[derive(Debug)]
pub struct Appender<'a> {
    /// What was there before.
    old: Cow<'a, Index>,
    out: PathBuf,
    compression: Compression,
    sink: Sink<'a>,
    /// Id and next sequence number, by the new channel's place.
    channels: Vec<(u16, u32)>,
    chunk: Chunk,
    summary: Vec<SummaryRecord>,
    statistics: Statistics,
    messages: u64,
    metadata: Vec<NewMetadata>,
    /// How readers will find it all.
    visibility: Visibility,
    /// Chunks of the log that can't be decoded.
    left_out: BTreeSet<u64>,
}

impl<'a> Appender<'a> {
    /// Starts the successor of `log`, with all `channels`. The data section of one that is a new file is copied
    /// from now on, beside other work, until [`Appender::finish`]. All checks come before the copy.
    ///
    /// # Errors
    /// [`LogError::OutputIsInput`]; [`LogError::OutputExists`] unless forced; [`LogError::NotInPlace`];
    /// [`LogError::InUse`] while another run writes the same; [`LogError::TopicTaken`] also for a topic given
    /// twice; [`LogError::IdsExhausted`]; errors of [`Appender::write`].
    pub fn begin(
        log: &'a Log,
        destination: &Destination,
        channels: &[NewChannel],
        compression: Compression,
    ) -> Result<Self, LogError> {
        let ids = checked(log, destination, channels)?;
        let is_sidecar = matches!(destination, Destination::Sidecar { .. });
        let old = if is_sidecar { Cow::Owned(Index::default()) } else { Cow::Borrowed(log.index()) };
        let mut appender = Self {
            out: destination.path(log).to_owned(),
            compression,
            sink: Sink::begin(log, destination)?,
            channels: Vec::new(),
            chunk: Chunk::default(),
            summary: Vec::new(),
            statistics: statistics_of(&old),
            messages: 0,
            metadata: Vec::new(),
            old,
            visibility: if is_sidecar { Visibility::Indexed } else { log.visibility() },
            left_out: BTreeSet::new(),
        };
        if is_sidecar {
            let is_ros2 = !channels.is_empty() && channels.iter().all(|c| c.schema_encoding == "ros2msg");
            appender.put(&summary::start(if is_ros2 { "ros2" } else { "" }))?;
        } else {
            appender.complete_torn_chunk(log)?;
            appender.keep_old_tail()?;
            appender.write_saved_messages(log)?;
        }
        // Before all chunks, so that each is readable on its own and a channel without messages is there.
        for (channel, ids) in channels.iter().zip(ids) {
            appender.define(channel, ids)?;
        }
        Ok(appender)
    }

    /// Makes all checks of [`Appender::begin`], so that nothing need be computed for an output that can't be.
    ///
    /// # Errors
    /// As [`Appender::begin`], but for [`LogError::Write`] of a full or read-only disk.
    pub fn check(log: &Log, destination: &Destination, channels: &[NewChannel]) -> Result<(), LogError> {
        checked(log, destination, channels).map(|_| ())
    }

    /// Adds a message. Chunks are cut as messages come, so those near in time should come together.
    ///
    /// # Errors
    /// [`LogError::Write`] or [`LogError::Interrupted`], and then the output is taken back: a new file is gone,
    /// in place the log is as it was. [`LogError::NotPutBack`] when it isn't yet.
    ///
    /// # Panics
    /// When `message.channel` is none of the channels given at the start.
    pub fn write(&mut self, message: NewMessage<'_>) -> Result<(), LogError> {
        let (channel_id, sequence) = &mut self.channels[message.channel];
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: message.time_ns,
            publish_time: message.time_ns,
        };
        *sequence = sequence.wrapping_add(1);
        let record = encode_bytes(op::MESSAGE, &[&encode_body(&header), message.data]);
        if !self.chunk.has_room(message.time_ns, record.len()) {
            self.end_chunk()?;
        }
        self.chunk.push(&header, &record);
        count(&mut self.statistics, &header);
        self.messages += 1;
        Ok(())
    }

    /// Leaves chunks of the log out of the chunk index, by their starts: those that were found to be undecodable
    /// when they were read. Their bytes stay, and so do the counts.
    pub fn leave_out(&mut self, chunk_starts: impl IntoIterator<Item = u64>) {
        self.left_out.extend(chunk_starts);
    }

    /// Adds a metadata record, which will stand behind all messages. Its name should begin with `trackfuse:`: the
    /// way back takes records of other names, and what stands behind the last of these, for another program's.
    pub fn add_metadata(&mut self, metadata: NewMetadata) {
        self.metadata.push(metadata);
    }

    fn put_metadata(&mut self, NewMetadata { name, entries }: NewMetadata) -> Result<(), LogError> {
        let record = encode(op::METADATA, &mcap::records::Metadata { name: name.clone(), metadata: entries });
        let entry = MetadataIndex { offset: self.sink.position, length: record.len() as u64, name };
        self.put(&record)?;
        self.summarize(op::METADATA_INDEX, encode(op::METADATA_INDEX, &entry));
        self.statistics.metadata_count += 1;
        Ok(())
    }

    /// Writes the rest, waits until all of it is on the disk, and gives the output its name.
    ///
    /// # Errors
    /// As [`Appender::write`]; [`LogError::OutputExists`] when somebody else made the output meanwhile.
    pub fn finish(mut self) -> Result<Written, LogError> {
        self.end_chunk()?;
        for metadata in std::mem::take(&mut self.metadata) {
            self.put_metadata(metadata)?;
        }
        let end = DataEnd { data_section_crc: self.sink.data_crc() };
        self.put(&encode(op::DATA_END, &end))?;
        let start = self.sink.position;
        let tail = match self.visibility {
            Visibility::Scanned { summary: false, .. } => summary::no_tail(),
            Visibility::Scanned { .. } => {
                summary::tail(&self.old, &self.summary, &self.statistics, start, |_| false)
            }
            Visibility::Indexed | Visibility::Partly { .. } => {
                let named = |chunk_start| !self.left_out.contains(&chunk_start);
                summary::tail(&self.old, &self.summary, &self.statistics, start, named)
            }
        };
        self.put(&tail)?;
        let Self { out, sink, messages, .. } = self;
        let len = sink.position;
        sink.finish()?;
        Ok(Written { path: out, len, messages })
    }

    /// Attaches the old end, which the new one takes the place of.
    fn keep_old_tail(&mut self) -> Result<(), LogError> {
        let data_end = self.old.data_end;
        let len = self.old.file_len.saturating_sub(data_end);
        let head = old_tail::head(data_end, len);
        let offset = self.sink.position;
        let mut crc = crc32fast::Hasher::new();
        crc.update(old_tail::summed(&head));
        self.put(&head)?;
        let mut piece = vec![0; len.min(PIECE) as usize];
        let mut at = 0;
        while at < len {
            piece.truncate((len - at) as usize);
            self.sink.read_old_tail(at, &mut piece)?;
            crc.update(&piece);
            self.put(&piece)?;
            at += piece.len() as u64;
        }
        self.put(&crc.finalize().to_le_bytes())?;
        let entry = old_tail::index(offset, data_end, len, &head);
        self.summarize(op::ATTACHMENT_INDEX, encode(op::ATTACHMENT_INDEX, &entry));
        self.statistics.attachment_count = self.statistics.attachment_count.saturating_add(1);
        Ok(())
    }

    fn define(&mut self, channel: &NewChannel, ids: Ids) -> Result<(), LogError> {
        if ids.schema_is_new {
            let header = SchemaHeader {
                id: ids.schema,
                name: channel.schema_name.clone(),
                encoding: channel.schema_encoding.clone(),
            };
            let len = (channel.schema.len() as u32).to_le_bytes();
            let record = encode_bytes(op::SCHEMA, &[&encode_body(&header), &len, &channel.schema]);
            self.put(&record)?;
            self.summarize(op::SCHEMA, record);
            self.statistics.schema_count = self.statistics.schema_count.saturating_add(1);
        }
        let record = encode(
            op::CHANNEL,
            &Channel {
                id: ids.channel,
                schema_id: ids.schema,
                topic: channel.topic.clone(),
                message_encoding: channel.message_encoding.clone(),
                metadata: channel.metadata.clone(),
            },
        );
        self.put(&record)?;
        self.summarize(op::CHANNEL, record);
        self.statistics.channel_count = self.statistics.channel_count.saturating_add(1);
        self.channels.push((ids.channel, 0));
        Ok(())
    }

    /// Right behind the data section, where readers expect them: the message indexes that a cut took away.
    fn complete_torn_chunk(&mut self, log: &Log) -> Result<(), LogError> {
        let Some((mut chunk, lost)) = lost_message_indexes(&log.file, log.index())? else { return Ok(()) };
        for index in lost {
            let record = encode(op::MESSAGE_INDEX, &index);
            chunk.message_index_offsets.insert(index.channel_id, self.sink.position);
            chunk.message_index_length += record.len() as u64;
            self.put(&record)?;
        }
        self.summarize(op::CHUNK_INDEX, encode(op::CHUNK_INDEX, &chunk));
        Ok(())
    }

    /// What is left of the chunk at which the log is cut off, with the ids that it had.
    fn write_saved_messages(&mut self, log: &Log) -> Result<(), LogError> {
        let saved = left_of_cut_chunk(&log.file, log.index())?;
        let saved = || chunk::records(&saved).map_while(Result::ok);
        for record in saved().filter(|record| matches!(record.opcode, op::SCHEMA | op::CHANNEL)) {
            self.put(record.whole)?;
        }
        for record in saved().filter(|record| record.opcode == op::MESSAGE) {
            let header: MessageHeader =
                parse(record.body).map_err(|problem| log.file.damaged(log.index().data_end, problem))?;
            if !self.chunk.has_room(header.log_time, record.whole.len()) {
                self.end_chunk()?;
            }
            self.chunk.push(&header, record.whole);
        }
        self.end_chunk()
    }

    fn end_chunk(&mut self) -> Result<(), LogError> {
        let chunk = std::mem::take(&mut self.chunk);
        if chunk.is_empty() {
            return Ok(());
        }
        let (records, entry) = chunk
            .pack(self.compression, self.sink.position)
            .map_err(|source| LogError::Write { path: self.out.clone(), source })?;
        self.put(&records)?;
        self.summarize(op::CHUNK_INDEX, encode(op::CHUNK_INDEX, &entry));
        self.statistics.chunk_count += 1;
        Ok(())
    }

    fn summarize(&mut self, opcode: u8, bytes: Vec<u8>) {
        self.summary.push(SummaryRecord { opcode, bytes });
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), LogError> {
        self.sink.put(bytes)
    }
}

fn checked(log: &Log, destination: &Destination, channels: &[NewChannel]) -> Result<Vec<Ids>, LogError> {
    destination.check(log)?;
    let ids = assign_ids(log.index(), log.path(), channels)?;
    match destination {
        // Viewers merge it with the log, so its topics must be new too; its ids are its own.
        Destination::Sidecar { .. } => assign_ids(&Index::default(), log.path(), channels),
        _ => Ok(ids),
    }
}

/// The log's statistics, with counts that aren't below what is there: some writers count only what
/// has messages.
fn statistics_of(index: &Index) -> Statistics {
    let mut statistics = index.statistics.clone().unwrap_or_default();
    statistics.schema_count = statistics.schema_count.max(index.schemas.len() as u16);
    statistics.channel_count = statistics.channel_count.max(index.channels.len() as u32);
    statistics.attachment_count = index.attachments.len() as u32;
    statistics.metadata_count = index.metadata.len() as u32;
    statistics.chunk_count = (index.chunks.len() + index.undecodable) as u32;
    statistics
}

#[cfg(test)]
mod tests;
