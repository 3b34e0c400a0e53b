//! A log held against its checksum and its counts, without a look at what its chunks hold.

use super::file::LogFile;
use super::undo::for_each_piece;
use super::{Damage, Log, LogError, Work};

impl Log {
    /// Refuses a log that is damaged, or whose data section is not what its checksum says, or whose statistics
    /// count other messages than its message indexes do. All of it is read once; chunks are not decoded.
    ///
    /// # Errors
    /// [`LogError::NotWhole`] with the first that is wrong; [`LogError::Read`].
    pub fn ensure_as_summed_up(&self) -> Result<(), LogError> {
        self.ensure_whole()?;
        let index = self.index();
        let wrong = |offset, what| LogError::NotWhole {
            path: self.path().to_owned(),
            first: Damage { offset, what },
            more: 0,
        };
        if let Some(what) = self.miscounted_messages() {
            return Err(wrong(index.summary_start.unwrap_or(index.data_end), what));
        }
        let Some(said) = index.data_section_crc else { return Ok(()) };
        let found = crc_of_start(&self.file, index.data_end)?;
        if found != said {
            let what = format!("the data section's CRC is {found:08x}, its end says {said:08x}");
            return Err(wrong(index.data_end, what));
        }
        Ok(())
    }

    /// What the statistics count otherwise than the message indexes, where these are there to tell.
    fn miscounted_messages(&self) -> Option<String> {
        let statistics = self.index().statistics.as_ref()?;
        let by_channel = &statistics.channel_message_counts;
        let named = self.index().chunks.iter().flat_map(|chunk| chunk.message_index_offsets.keys());
        let channels = named.chain(self.index().channels.keys()).chain(by_channel.keys()).copied().collect();
        let found = self.counted_by_index(&channels)?;
        let (claimed, all) = (statistics.message_count, found.values().sum::<u64>());
        if claimed != all {
            return Some(format!("the statistics count {claimed} messages, the message indexes {all}"));
        }
        let count = |counts: &std::collections::BTreeMap<u16, u64>, id| counts.get(id).copied().unwrap_or(0);
        let id = channels.iter().find(|id| count(by_channel, id) != count(&found, id));
        let id = id.filter(|_| !by_channel.is_empty())?;
        let [claimed, found] = [count(by_channel, id), count(&found, id)];
        Some(format!("the statistics count {claimed} messages of channel {id}, the message indexes {found}"))
    }
}

/// CRC-32 of the first `len` bytes of a log, which are all read.
pub(super) fn crc_of_start(file: &LogFile, len: u64) -> Result<u32, LogError> {
    let (mut crc, mut done) = (crc32fast::Hasher::new(), 0);
    let read = for_each_piece(file.reader(0), len, |at, piece| {
        crc.update(piece);
        done = at + piece.len() as u64;
        file.options.observer.tell(Work::Read, done, len);
        Ok(())
    });
    read.map_err(|source| LogError::Read { path: file.path.clone(), offset: done, source })?;
    Ok(crc.finalize())
}
