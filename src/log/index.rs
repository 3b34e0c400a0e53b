//! What is in a log: from its summary, completed from the data section where the summary is not whole.

use std::{collections::BTreeMap, ops::Range, path::Path};

use mcap::records::{
    AttachmentIndex, Channel, ChunkIndex, DataEnd, Footer, Header, MetadataIndex, SchemaHeader, Statistics,
    op,
};

use super::file::{HEAD_LEN, Head, LogFile, parse};
use super::{LogError, Obstacle, ReadOptions, chunk, output, survey};

const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
const MAGIC_LEN: u64 = MAGIC.len() as u64;
/// Summary start, summary offset start, CRC.
const FOOTER_BODY_LEN: u64 = 8 + 8 + 4;
const DATA_END_BODY_LEN: u64 = 4;
/// `DataEnd` with its head, right before the summary.
const DATA_END_LEN: u64 = HEAD_LEN + DATA_END_BODY_LEN;

/// How a channel's messages are made up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The id that channels name it by.
    pub id: u16,
    /// Such as `nav_msgs/msg/Odometry`.
    pub name: String,
    /// Such as `ros2msg` or `jsonschema`.
    pub encoding: String,
    /// The definition itself.
    pub data: Vec<u8>,
}

impl Schema {
    pub(super) fn parse(body: &[u8]) -> Result<Self, String> {
        let header: SchemaHeader = parse(body)?;
        // Id, and two strings with their lengths; then the length of the data.
        let start = 2 + 4 + header.name.len() + 4 + header.encoding.len();
        let rest = body.get(start..).unwrap_or_default();
        let (len, rest) = rest.split_first_chunk::<4>().ok_or("its data has no length")?;
        let len = u32::from_le_bytes(*len);
        let data = rest
            .get(..len as usize)
            .ok_or_else(|| format!("its data claims {len} bytes, it has {}", rest.len()))?;
        Ok(Self { id: header.id, name: header.name, encoding: header.encoding, data: data.to_vec() })
    }
}

/// A record of the summary, with every byte that its writer gave it.
#[derive(Clone, Debug)]
pub(super) struct SummaryRecord {
    pub(super) opcode: u8,
    pub(super) bytes: Vec<u8>,
}

/// How much the summary left out, and was found in the data section.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Schemas.
    pub schemas: usize,
    /// Channels.
    pub channels: usize,
    /// Chunk indexes.
    pub chunks: usize,
    /// Indexes of attachments.
    pub attachments: usize,
    /// Indexes of metadata records.
    pub metadata: usize,
    /// The statistics, which were counted.
    pub statistics: bool,
    /// Whether every chunk had to be read to find it all.
    pub scanned: bool,
}

/// What is in a log, without its messages.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// What the header calls the log's profile, such as `ros2`.
    pub profile: String,
    /// What the header says wrote the log.
    pub library: String,
    /// By id.
    pub schemas: BTreeMap<u16, Schema>,
    /// By id; channels without messages too.
    pub channels: BTreeMap<u16, Channel>,
    /// In file order.
    pub chunks: Vec<ChunkIndex>,
    /// In file order.
    pub attachments: Vec<AttachmentIndex>,
    /// In file order.
    pub metadata: Vec<MetadataIndex>,
    /// Counts and times as the summary has them, or counted where it has none.
    pub statistics: Option<Statistics>,
    /// What of all this was not in the summary.
    pub left_out: LeftOut,
    /// Where the first record after the header stands.
    pub data_start: u64,
    /// Where the `DataEnd` record stands: the bytes before it never change.
    pub data_end: u64,
    /// Where the summary begins, `None` where there is none.
    pub summary_start: Option<u64>,
    /// CRC-32 of the bytes before `DataEnd`, `None` where the writer left it out.
    pub data_section_crc: Option<u32>,
    /// CRC-32 of the summary, `None` where the writer left it out.
    pub summary_crc: Option<u32>,
    /// Length of the file in bytes.
    pub file_len: u64,
    /// The summary's records as they stand, but for summary offsets; what was missing comes behind them.
    pub(super) summary: Vec<SummaryRecord>,
    /// Runs of schemas, channels and messages outside chunks, in pieces of some MB.
    pub(super) loose: Vec<Range<u64>>,
}

impl Index {
    /// The schema of a channel, `None` where it has none.
    #[must_use]
    pub fn schema_of(&self, channel: &Channel) -> Option<&Schema> {
        self.schemas.get(&channel.schema_id)
    }

    /// Channels of a topic: several where a log was merged, or its writer restarted.
    pub fn channels_of<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a Channel> {
        self.channels.values().filter(move |channel| channel.topic == topic)
    }

    /// Puts one record of the summary into the index.
    pub(super) fn insert(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        match opcode {
            op::SCHEMA => {
                let schema = Schema::parse(body)?;
                self.schemas.entry(schema.id).or_insert(schema);
            }
            op::CHANNEL => {
                let channel: Channel = parse(body)?;
                self.channels.entry(channel.id).or_insert(channel);
            }
            op::STATISTICS => self.statistics = Some(parse(body)?),
            op::CHUNK_INDEX => self.chunks.push(parse(body)?),
            op::ATTACHMENT_INDEX => self.attachments.push(parse(body)?),
            op::METADATA_INDEX => self.metadata.push(parse(body)?),
            _ => {}
        }
        Ok(())
    }
}

/// A recording, open for reading.
#[derive(Debug)]
pub struct Log {
    pub(super) file: LogFile,
    index: Index,
    obstacle: Option<Obstacle>,
}

impl Log {
    /// Opens a log and reads what is in it.
    ///
    /// Takes time by the number of chunks, not by their size, unless the summary leaves out
    /// channels, schemas or statistics: then every chunk is read once.
    ///
    /// # Errors
    /// [`LogError::Open`], [`LogError::NotMcap`], [`LogError::CutOff`] when the end is missing,
    /// [`LogError::Damaged`] when the summary contradicts itself or the data section.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        Self::open_with(path, ReadOptions::default())
    }

    /// Opens a log that is to be read as `options` say: see [`Log::open`].
    ///
    /// # Errors
    /// As [`Log::open`].
    pub fn open_with(path: impl AsRef<Path>, options: ReadOptions) -> Result<Self, LogError> {
        let file = LogFile::open(path.as_ref(), options)?;
        let mut index = read_summary(&file)?;
        let obstacle = survey::complete(&file, &mut index)?;
        Ok(Self { file, index, obstacle })
    }

    /// What is in the log.
    #[must_use]
    pub fn index(&self) -> &Index {
        &self.index
    }

    /// Where the log is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// Whether channels can be added without hiding old messages from indexed readers.
    ///
    /// # Errors
    /// [`LogError::NotAppendable`] with the first obstacle.
    pub fn ensure_appendable(&self) -> Result<(), LogError> {
        match self.obstacle {
            None => Ok(()),
            Some(obstacle) => Err(LogError::NotAppendable { path: self.file.path.clone(), obstacle }),
        }
    }

    /// Refuses an output that is the log itself, by whatever link.
    ///
    /// # Errors
    /// [`LogError::OutputIsInput`].
    pub fn ensure_other(&self, out: &Path) -> Result<(), LogError> {
        if output::is_same_file(&self.file.file, &self.file.path, out) {
            return Err(LogError::OutputIsInput { path: out.to_owned() });
        }
        Ok(())
    }

    /// The bytes behind DataEnd: summary, footer and magic. They tell two logs apart that share a data section.
    ///
    /// # Errors
    /// [`LogError::Read`]; [`LogError::TooLarge`].
    pub fn tail(&self) -> Result<Vec<u8>, LogError> {
        let start = (self.index.data_end + DATA_END_LEN).min(self.index.file_len);
        self.file.bytes(start, self.index.file_len - start, "the summary")
    }

    /// The entries of the last metadata record of that name, `None` where there is none.
    ///
    /// # Errors
    /// [`LogError::Read`]; [`LogError::Damaged`]; [`LogError::TooLarge`].
    pub fn metadata(&self, name: &str) -> Result<Option<BTreeMap<String, String>>, LogError> {
        let Some(entry) = self.index.metadata.iter().rfind(|m| m.name == name) else { return Ok(None) };
        let head = self.file.head(entry.offset, self.index.data_end)?;
        let record: mcap::records::Metadata = read_record(&self.file, head, "metadata")?;
        Ok(Some(record.metadata))
    }

    /// The parts of the log that hold messages, in file order.
    pub(super) fn blocks(&self) -> Vec<chunk::Block<'_>> {
        chunk::blocks(&self.index)
    }
}

/// Both ends of the file, and the summary between them.
fn read_summary(file: &LogFile) -> Result<Index, LogError> {
    let data_start = check_magic(file)?;
    let cut_off = |what| LogError::CutOff { path: file.path.clone(), what, len: file.len };

    let footer_start = file.len.saturating_sub(MAGIC_LEN + HEAD_LEN + FOOTER_BODY_LEN);
    if footer_start < data_start.end() + DATA_END_LEN {
        return Err(cut_off("it has no footer"));
    }
    if file.bytes(file.len - MAGIC_LEN, MAGIC_LEN, "the magic at the end")? != MAGIC {
        return Err(cut_off("the magic at its end is missing"));
    }
    let footer_head = file.head(footer_start, file.len - MAGIC_LEN)?;
    if (footer_head.opcode, footer_head.body_len) != (op::FOOTER, FOOTER_BODY_LEN) {
        return Err(file.damaged(footer_start, "expected the footer"));
    }
    let footer: Footer = read_record(file, footer_head, "footer")?;

    // Without a summary, DataEnd stands before what follows in its place.
    let starts = [footer.summary_start, footer.summary_offset_start, footer_start];
    let tail_start = starts.into_iter().find(|&start| start != 0).unwrap_or(footer_start);
    let records_end =
        if footer.summary_offset_start == 0 { footer_start } else { footer.summary_offset_start };
    if tail_start < data_start.end() + DATA_END_LEN || tail_start > records_end || records_end > footer_start
    {
        let what = format!("the footer's summary [{tail_start}, {records_end}) is not before the footer");
        return Err(file.damaged(footer_start, what));
    }
    let data_end = file.head(tail_start - DATA_END_LEN, tail_start)?;
    if (data_end.opcode, data_end.body_len) != (op::DATA_END, DATA_END_BODY_LEN) {
        return Err(file.damaged(data_end.offset, "expected the end of the data section before the summary"));
    }
    let crc: DataEnd = read_record(file, data_end, "data end")?;

    // The CRC spans the summary and the footer up to the CRC itself.
    let tail_len = file.len - MAGIC_LEN - 4 - tail_start;
    let tail = file.bytes(tail_start, tail_len, "the summary")?;
    let found = crc32fast::hash(&tail);
    if footer.summary_crc != 0 && footer.summary_crc != found {
        let what = format!("the summary's CRC is {found:08x}, the footer says {:08x}", footer.summary_crc);
        return Err(file.damaged(tail_start, what));
    }

    let header: Header = read_record(file, data_start, "header")?;
    let mut index = Index {
        profile: header.profile,
        library: header.library,
        data_start: data_start.end(),
        data_end: data_end.offset,
        summary_start: Some(footer.summary_start).filter(|&start| start != 0),
        data_section_crc: Some(crc.data_section_crc).filter(|&crc| crc != 0),
        summary_crc: Some(footer.summary_crc).filter(|&crc| crc != 0),
        file_len: file.len,
        ..Index::default()
    };
    if footer.summary_start == 0 {
        return Ok(index);
    }
    let records = tail.get(..(records_end - tail_start) as usize).unwrap_or_default();
    let mut offset = tail_start;
    for record in chunk::records(records) {
        let record = record.map_err(|left| {
            file.damaged(offset, format!("the last {left} bytes of the summary are no record"))
        })?;
        let bad = |problem| {
            file.damaged(offset, format!("summary record (opcode {:#04x}): {problem}", record.opcode))
        };
        index.insert(record.opcode, record.body).map_err(bad)?;
        if record.opcode != op::SUMMARY_OFFSET {
            index.summary.push(SummaryRecord { opcode: record.opcode, bytes: record.whole.to_vec() });
        }
        offset += record.whole.len() as u64;
    }
    Ok(index)
}

/// The header record, behind the magic.
fn check_magic(file: &LogFile) -> Result<Head, LogError> {
    let start = file.bytes(0, file.len.min(MAGIC_LEN), "the magic at the start")?;
    let not_mcap = |found: String| Err(LogError::NotMcap { path: file.path.clone(), found });
    if start.is_empty() {
        return not_mcap("the file is empty".to_owned());
    }
    if start != MAGIC {
        if MAGIC.starts_with(&start) {
            let what = "it ends within the magic at its start";
            return Err(LogError::CutOff { path: file.path.clone(), what, len: file.len });
        }
        let text = start.escape_ascii();
        return not_mcap(format!("it starts with \"{text}\", expected \"{}\"", MAGIC.escape_ascii()));
    }
    let cut_off = || LogError::CutOff { path: file.path.clone(), what: "it has no header", len: file.len };
    if file.len < MAGIC_LEN + HEAD_LEN {
        return Err(cut_off());
    }
    let head = file.head(MAGIC_LEN, file.len)?;
    if head.opcode != op::HEADER {
        return Err(
            file.damaged(MAGIC_LEN, format!("expected the header, found opcode {:#04x}", head.opcode))
        );
    }
    Ok(head)
}

/// A record of the file, whole in memory: only for small ones.
pub(super) fn read_record<T>(file: &LogFile, head: Head, what: &'static str) -> Result<T, LogError>
where
    T: for<'a> binrw::BinRead<Args<'a> = ()>,
{
    file.parse(head.offset, what, &file.bytes(head.body(), head.body_len, what)?)
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, panic::catch_unwind};

    use super::super::fixture::{PRIVATE, chunked, log, on_disk, records, without_summary_crc};
    use super::super::{Appender, Compression, WholePart};
    use super::*;

    fn open(bytes: &[u8]) -> Result<Log, LogError> {
        let (_dir, path) = on_disk(bytes);
        Log::open(path)
    }

    /// Opens, reads and appends; what fails must do so with an error.
    fn use_in_every_way(bytes: &[u8]) -> Result<(), LogError> {
        let (dir, path) = on_disk(bytes);
        let _ = WholePart::of(&path).map(|whole| whole.to_string());
        let log = Log::open(path)?;
        let channels: BTreeSet<u16> = (0..4).collect();
        log.for_each_log_time(u64::MAX, |_, _| {});
        log.for_each_message_of_excerpt(&channels, 1, |_| {});
        if let Some(error) = log.first_messages(&channels).1.pop() {
            return Err(error);
        }
        log.for_each_message(&channels, |_| Ok::<_, LogError>(()))?;
        Appender::begin(&log, dir.path().join("out.mcap"), false, &[], Compression::None)?.finish()?;
        Ok(())
    }

    #[test]
    fn a_file_that_is_no_mcap_says_what_it_is() {
        let not_mcap = |bytes: &[u8]| match open(bytes) {
            Err(e @ LogError::NotMcap { .. }) => e.to_string(),
            other => panic!("{other:?}"),
        };
        assert!(not_mcap(b"").ends_with("the file is empty"));
        assert!(not_mcap(b"#ROSBAG V2.0\n").contains("#ROSBAG "), "{}", not_mcap(b"#ROSBAG V2.0\n"));
        assert!(not_mcap(b"\x89MCAP9\r\n").contains("MCAP9"));
        assert!(matches!(Log::open("/nowhere/at.all"), Err(LogError::Open { .. })));
        assert!(matches!(Log::open("/"), Err(LogError::Open { .. })));
    }

    #[test]
    fn a_log_cut_off_anywhere_is_refused() {
        let bytes = log(chunked());
        for len in 1..bytes.len() {
            match open(&bytes[..len]) {
                Err(LogError::CutOff { .. } | LogError::Damaged { .. }) => {}
                other => panic!("cut at {len}: {other:?}"),
            }
        }
        let Err(e @ LogError::CutOff { .. }) = open(&bytes[..bytes.len() / 2]) else { panic!("not cut off") };
        assert!(e.hint().is_some());
    }

    #[test]
    fn a_flipped_byte_in_the_summary_is_noticed_and_none_anywhere_panics() {
        let bytes = log(chunked());
        let summary_start = open(&bytes).unwrap().index().summary_start.unwrap() as usize;
        for at in 0..bytes.len() {
            let mut bytes = bytes.clone();
            bytes[at] ^= 0xff;
            let result = catch_unwind(|| use_in_every_way(&bytes)).unwrap();
            let magic = bytes.len() - 8;
            assert!(at < summary_start || at >= magic || result.is_err(), "byte {at}");
        }
    }

    #[test]
    fn a_length_beyond_the_file_is_an_error_wherever_it_stands() {
        for (options, every) in
            [(chunked(), 1), (chunked().use_chunks(false), 7), (chunked().emit_chunk_indexes(false), 7)]
        {
            let bytes = without_summary_crc(log(options));
            for at in (8..bytes.len() - 16).step_by(every) {
                for claim in [1_u64 << 62, 1 << 40] {
                    let mut bytes = bytes.clone();
                    bytes[at..at + 8].copy_from_slice(&claim.to_le_bytes());
                    // Many of these hit a field that may hold anything; none may panic or abort.
                    let _ = catch_unwind(|| use_in_every_way(&bytes)).unwrap();
                }
            }
            for (opcode, at) in records(&bytes) {
                let mut bytes = bytes.clone();
                bytes[at + 1..at + 9].copy_from_slice(&(1_u64 << 62).to_le_bytes());
                assert!(use_in_every_way(&bytes).is_err() || opcode == op::SUMMARY_OFFSET, "{opcode:#x}");
            }
        }
    }

    #[test]
    fn a_summary_that_leaves_things_out_is_completed() {
        let whole = open(&log(chunked())).unwrap();
        let bare = open(&log(chunked().emit_summary_records(false).emit_summary_offsets(false))).unwrap();
        assert_eq!(bare.index().summary_start, None);
        bare.ensure_appendable().unwrap();
        let (found, expected) = (bare.index(), whole.index());
        assert_eq!(found.schemas, expected.schemas);
        assert_eq!(found.channels, expected.channels);
        assert_eq!(found.chunks, expected.chunks);
        assert_eq!(found.attachments, expected.attachments);
        assert_eq!(found.metadata, expected.metadata);
        assert_eq!(found.statistics, expected.statistics);
        assert_eq!(expected.left_out, LeftOut::default());
        let counted = LeftOut {
            schemas: 1,
            channels: 2,
            chunks: expected.chunks.len(),
            attachments: 1,
            metadata: 1,
            statistics: true,
            scanned: true,
        };
        assert_eq!(found.left_out, counted);
    }

    #[test]
    fn messages_outside_chunks_can_be_read_but_forbid_new_channels() {
        let log = open(&log(chunked().use_chunks(false))).unwrap();
        let mut count = 0;
        log.for_each_message(&log.index().channels.keys().copied().collect(), |_| {
            count += 1;
            Ok::<_, LogError>(())
        })
        .unwrap();
        assert_eq!(count, 20);
        let refused = log.ensure_appendable().unwrap_err();
        assert!(
            matches!(refused, LogError::NotAppendable { obstacle: Obstacle::LooseMessages { .. }, .. }),
            "{refused}"
        );
        assert!(refused.hint().unwrap().contains("indexed copy"));
    }

    #[test]
    fn bytes_that_are_no_record_forbid_new_channels_but_not_reading() {
        let mut bytes = log(chunked());
        let (_, private) = records(&bytes).into_iter().find(|(opcode, _)| *opcode == PRIVATE).unwrap();
        bytes[private] = 0;
        let log = open(&bytes).unwrap();
        let refused = log.ensure_appendable().unwrap_err();
        assert!(
            matches!(refused, LogError::NotAppendable { obstacle: Obstacle::Garbage { offset }, .. } if offset == private as u64),
            "{refused}"
        );
        assert_eq!(log.first_messages(&[1, 2].into()).0.len(), 2);
    }

    #[test]
    fn a_chunk_indexed_twice_is_damage() {
        let log_file = open(&log(chunked())).unwrap();
        let mut index = log_file.index().clone();
        index.chunks.push(index.chunks[0].clone());
        let (_dir, path) = on_disk(&log(chunked()));
        let file = LogFile::open(&path, ReadOptions::default()).unwrap();
        assert!(matches!(survey::complete(&file, &mut index), Err(LogError::Damaged { .. })));
    }
}
