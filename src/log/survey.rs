//! Holds the summary against the data section, and completes it.
//!
//! A summary may leave out anything. A new one that named only our channels would hide the old
//! ones from readers that trust it, so what it leaves out is looked up: the gaps between the
//! indexed parts from record to record, chunks' contents only where nothing else tells.

use std::collections::BTreeSet;

use mcap::records::{ChunkIndex, Statistics, op};

use super::chunk::{self, Block, Scratch};
use super::contents::{self, Closed, Contents, look_into};
use super::damage::Damages;
use super::extents;
use super::file::LogFile;
use super::gaps::Gaps;
use super::index::{LeftOut, SummaryRecord};
use super::rescue::TornChunk;
use super::summary::encode;
use super::visibility::Visibility;
use super::{Index, LogError, Work};

/// Checks `index` against the file and adds what is missing. The answer is how readers of a successor will find
/// the messages, and where the data section first holds bytes that are no record.
pub(super) fn complete(
    file: &LogFile,
    index: &mut Index,
    damages: &mut Damages,
) -> Result<(Visibility, Option<u64>), LogError> {
    let summarised = counts(index);
    let entries = index.chunks.len() + index.attachments.len() + index.metadata.len();
    let known = extents::check(file, index, damages)?;
    let contradicted = known.len() < entries;
    // Viewers scan a log whose summary has no channels, whatever its chunk index.
    let read_by_index = !index.chunks.is_empty() && !index.channels.is_empty();

    let data_end = index.data_end;
    let mut gaps = Gaps { file, index, damages, loose: None, garbage: None, chunks: BTreeSet::new() };
    let mut position = gaps.index.data_start;
    for extent in known {
        gaps.walk(position..extent.start)?;
        position = extent.end;
    }
    gaps.walk(position..data_end)?;
    let Gaps { loose, garbage, chunks: unnamed, .. } = gaps;
    index.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
    index.attachments.sort_by_key(|attachment| attachment.offset);
    index.metadata.sort_by_key(|metadata| metadata.offset);
    tear(index);

    let mut survey = Survey {
        file,
        index,
        damages,
        unnamed,
        hidden: loose,
        undecodable: BTreeSet::new(),
        closed: false,
        scratch: Scratch::default(),
        buf: Vec::new(),
    };
    let miscounted = survey.miscounted_records();
    let distrusted = contradicted || miscounted || survey.index.summary_distrusted;
    let scanned = distrusted || !is_complete(survey.index);
    if scanned {
        survey.scan()?;
    } else {
        survey.find_hidden()?;
    }
    let visibility = survey.visibility(read_by_index);
    let found = counts(index);
    index.left_out = LeftOut {
        schemas: found.schemas.saturating_sub(summarised.schemas),
        channels: found.channels.saturating_sub(summarised.channels),
        chunks: found.chunks.saturating_sub(summarised.chunks),
        attachments: found.attachments.saturating_sub(summarised.attachments),
        metadata: found.metadata.saturating_sub(summarised.metadata),
        statistics: found.statistics && !summarised.statistics,
        scanned,
    };
    Ok((visibility, garbage))
}

/// How much the index holds.
fn counts(index: &Index) -> LeftOut {
    LeftOut {
        schemas: index.schemas.len(),
        channels: index.channels.len(),
        chunks: index.chunks.len(),
        attachments: index.attachments.len(),
        metadata: index.metadata.len(),
        statistics: index.statistics.is_some(),
        scanned: false,
    }
}

/// Sets the last chunk apart where the log is cut off among its message indexes: those that are there don't tell
/// all that it holds.
fn tear(index: &mut Index) {
    let data_end = index.data_end;
    // A summary that can be trusted names them all.
    let may_be_torn = index.is_cut && index.cut_chunk.is_none() && index.summary_start.is_none();
    let Some(chunk) = index.chunks.last_mut().filter(|_| may_be_torn) else { return };
    if chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length == data_end {
        let torn = TornChunk { whole: chunk.clone() };
        chunk.message_index_offsets.clear();
        chunk.message_index_length = 0;
        let start = torn.whole.chunk_start_offset;
        // It is indexed anew, with all its message indexes.
        index.summary.retain(|record| record.chunk_start_offset() != Some(start));
        index.torn_chunk = Some(torn);
    }
}

/// Whether the summary names every schema and channel that anything in it refers to.
fn is_complete(index: &Index) -> bool {
    let Some(statistics) = &index.statistics else { return false };
    let used = index.chunks.iter().flat_map(|chunk| chunk.message_index_offsets.keys());
    let used: BTreeSet<u16> = used.chain(statistics.channel_message_counts.keys()).copied().collect();
    let schemas = index.channels.values().map(|channel| channel.schema_id);
    index.channels.len() as u64 >= u64::from(statistics.channel_count)
        && index.schemas.len() >= usize::from(statistics.schema_count)
        && used.iter().all(|id| index.channels.contains_key(id))
        && schemas.into_iter().all(|id| id == 0 || index.schemas.contains_key(&id))
}

/// The look into chunks, where the summary doesn't tell what they hold.
struct Survey<'a> {
    file: &'a LogFile,
    index: &'a mut Index,
    damages: &'a mut Damages,
    /// Chunks that the summary didn't name.
    unnamed: BTreeSet<u64>,
    /// The first part with messages that no index names.
    hidden: Option<u64>,
    /// Chunks that can't be decoded.
    undecodable: BTreeSet<u64>,
    /// Whether a chunk couldn't be looked into that may be whole.
    closed: bool,
    scratch: Scratch,
    buf: Vec<u8>,
}

impl Survey<'_> {
    /// Whether the statistics count other numbers of records than the data section has.
    fn miscounted_records(&mut self) -> bool {
        let Some(statistics) = &self.index.statistics else { return false };
        let counted = [
            ("chunks", statistics.chunk_count, self.index.chunks.len()),
            ("attachments", statistics.attachment_count, self.index.attachments.len()),
            ("metadata records", statistics.metadata_count, self.index.metadata.len()),
        ];
        let wrong: Vec<_> =
            counted.iter().filter(|(_, claimed, found)| *claimed as usize != *found).collect();
        for (what, claimed, found) in &wrong {
            let what = format!("the statistics count {claimed} {what}, there are {found}");
            self.damages.push(self.index.summary_start.unwrap_or(self.index.data_end), what);
        }
        !wrong.is_empty()
    }

    /// Looks for messages that no index names, reading as little as that takes.
    fn find_hidden(&mut self) -> Result<(), LogError> {
        let unclear = |chunk: &&ChunkIndex| {
            chunk.message_index_offsets.is_empty() || self.unnamed.contains(&chunk.chunk_start_offset)
        };
        let unclear: Vec<ChunkIndex> = self.index.chunks.iter().filter(unclear).cloned().collect();
        for chunk in unclear {
            // No index shall name one that can't be decoded.
            if self.hidden.is_none() || self.unnamed.contains(&chunk.chunk_start_offset) {
                self.look(&Block::Chunk(&chunk))?;
            }
        }
        self.drop_undecodable();
        Ok(())
    }

    /// Reads every chunk for the schemas and channels that the summary leaves out, and counts.
    fn scan(&mut self) -> Result<(), LogError> {
        let Index { chunks, loose, cut_chunk, .. } = &*self.index;
        let (chunks, loose, cut_chunk) = (chunks.clone(), loose.clone(), cut_chunk.clone());
        let of_index = Index { chunks, loose, cut_chunk, ..Index::default() };
        let mut counted = Statistics::default();
        for block in chunk::blocks(&of_index) {
            let looked = self.look(&block)?;
            let done = block.offset().saturating_add(block.stored_size());
            self.file.options.observer.tell(Work::Scan, done, self.index.data_end.max(done));
            let Some(Contents { definitions, counted: of_block }) = looked else { continue };
            contents::add(&mut counted, &of_block);
            // Those outside chunks were taken in when the gaps were walked.
            let definitions = definitions.into_iter().filter(|_| !matches!(block, Block::Loose(_)));
            for (opcode, bytes) in definitions {
                let adopted = self.index.adopt(self.file, block.offset(), opcode, bytes);
                self.damages.note(adopted)?;
            }
        }
        self.drop_undecodable();
        self.count(counted);
        Ok(())
    }

    /// Takes the chunks that can't be decoded out of the index: all at once, there may be many.
    fn drop_undecodable(&mut self) {
        let undecodable = std::mem::take(&mut self.undecodable);
        self.drop_chunks(&undecodable);
        self.index.chunks.retain(|chunk| !undecodable.contains(&chunk.chunk_start_offset));
        self.index.undecodable += undecodable.len();
    }

    /// Looks into one part.
    fn look(&mut self, block: &Block<'_>) -> Result<Option<Contents>, LogError> {
        let looked = look_into(self.file, block, &mut self.scratch, &mut self.buf)?;
        let offset = block.offset();
        if let Block::Cut(_) = block {
            self.saved(&looked);
        }
        match (looked, block) {
            (Ok(contents), Block::Chunk(chunk)) => {
                if self.hides(chunk, &contents) {
                    self.hidden = Some(self.hidden.map_or(offset, |first| first.min(offset)));
                }
                Ok(Some(contents))
            }
            (Ok(contents), _) => Ok(Some(contents)),
            (Err(Closed::Undecodable(why)), Block::Chunk(chunk)) => {
                self.damages.push(offset, why);
                self.undecodable.insert(offset);
                self.index.reserved_ids.extend(chunk.message_index_offsets.keys());
                Ok(None)
            }
            (Err(Closed::Unread(why)), Block::Chunk(chunk)) => {
                self.damages.push(offset, why);
                self.closed = true;
                // What isn't read is given no message indexes.
                if self.torn() == Some(offset) {
                    self.index.torn_chunk = None;
                }
                if chunk.message_index_offsets.is_empty() {
                    self.hidden.get_or_insert(offset);
                }
                Ok(None)
            }
            (Err(Closed::Undecodable(why) | Closed::Unread(why)), _) => {
                self.damages.push(offset, why);
                Ok(None)
            }
        }
    }

    /// What could be saved of the chunk at which the log is cut off.
    fn saved(&mut self, looked: &Result<Contents, Closed>) {
        let Some(cut) = &mut self.index.cut_chunk else { return };
        match looked {
            Ok(contents) => {
                let what = match contents.counted.message_count {
                    0 => "no message of the chunk that is cut off can be saved".to_owned(),
                    messages => format!(
                        "{messages} messages of the chunk that is cut off are saved, which no checksum covers"
                    ),
                };
                self.damages.push(cut.offset, what);
                cut.saved_bytes = self.buf.len() as u64;
            }
            Err(_) => self.index.cut_chunk = None,
        }
    }

    /// Whether some readers don't find a chunk's messages through an index.
    fn hides(&self, chunk: &ChunkIndex, contents: &Contents) -> bool {
        let offset = chunk.chunk_start_offset;
        if contents.counted.message_count == 0 || self.torn() == Some(offset) {
            return false;
        }
        if self.unnamed.contains(&offset) {
            return !contents::is_indexed(self.file, chunk, &contents.counted);
        }
        chunk.message_index_offsets.is_empty()
    }

    fn torn(&self) -> Option<u64> {
        self.index.torn_chunk.as_ref().map(|torn| torn.whole.chunk_start_offset)
    }

    /// Puts what was counted in place of statistics that are missing or wrong.
    fn count(&mut self, mut counted: Statistics) {
        let index = &mut *self.index;
        counted.schema_count = index.schemas.len() as u16;
        counted.channel_count = index.channels.len() as u32;
        counted.attachment_count = index.attachments.len() as u32;
        counted.metadata_count = index.metadata.len() as u32;
        counted.chunk_count = (index.chunks.len() + index.undecodable) as u32;
        if let Some(claimed) = &index.statistics {
            let same = is_same(claimed, &counted);
            if same || self.closed {
                return;
            }
            if self.damages.found.is_empty() {
                let what = format!(
                    "the statistics are wrong: {} messages of {} .. {} ns, there are {} of {} .. {} ns",
                    claimed.message_count,
                    claimed.message_start_time,
                    claimed.message_end_time,
                    counted.message_count,
                    counted.message_start_time,
                    counted.message_end_time
                );
                self.damages.push(index.summary_start.unwrap_or(index.data_end), what);
            }
        }
        index.summary.retain(|record| record.opcode != op::STATISTICS);
        index.summary.push(SummaryRecord { opcode: op::STATISTICS, bytes: encode(op::STATISTICS, &counted) });
        index.statistics = Some(counted);
    }

    /// What follows for a successor; its summary won't name what it must not.
    fn visibility(&mut self, read_by_index: bool) -> Visibility {
        let Some(offset) = self.hidden else {
            // `@mcap/core` gives up at a chunk index with times and without message indexes.
            let empty = |chunk: &&ChunkIndex| {
                self.unnamed.contains(&chunk.chunk_start_offset)
                    && chunk.message_index_offsets.is_empty()
                    && (chunk.message_start_time, chunk.message_end_time) != (0, 0)
            };
            let empty =
                self.index.chunks.iter().filter(empty).map(|chunk| chunk.chunk_start_offset).collect();
            self.drop_chunks(&empty);
            return Visibility::Indexed;
        };
        if read_by_index {
            let unnamed = std::mem::take(&mut self.unnamed);
            self.drop_chunks(&unnamed);
            return Visibility::Partly { offset };
        }
        Visibility::Scanned { offset, summary: self.index.summary_start.is_some() }
    }

    /// Takes chunks out of the summary.
    fn drop_chunks(&mut self, offsets: &BTreeSet<u64>) {
        if !offsets.is_empty() {
            let dropped = |record: &SummaryRecord| {
                record.chunk_start_offset().is_some_and(|offset| offsets.contains(&offset))
            };
            self.index.summary.retain(|record| !dropped(record));
        }
    }
}

/// Whether statistics are what was counted; counts by channel may be left out, and those of none.
fn is_same(claimed: &Statistics, counted: &Statistics) -> bool {
    let times = |s: &Statistics| (s.message_start_time, s.message_end_time);
    let by_channel = |s: &Statistics| {
        let counts = s.channel_message_counts.iter().filter(|(_, messages)| **messages > 0);
        counts.map(|(&id, &messages)| (id, messages)).collect::<Vec<_>>()
    };
    claimed.message_count == counted.message_count
        && (claimed.message_count == 0 || times(claimed) == times(counted))
        && (claimed.channel_message_counts.is_empty() || by_channel(claimed) == by_channel(counted))
        && claimed.chunk_count == counted.chunk_count
        && claimed.attachment_count == counted.attachment_count
        && claimed.metadata_count == counted.metadata_count
}
