//! The summary's records held against what the data section was found to hold.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;

use mcap::records::{AttachmentIndex, ChunkIndex, MetadataIndex, Statistics, SummaryOffset, op};

use super::super::file::{Head, parse};
use super::data_section::DataSection;
use super::findings::Findings;
use super::sequence::name_of;

/// What was read of the summary so far.
#[derive(Debug, Default)]
pub(super) struct Summary {
    start: u64,
    /// Whether a part of it could not be read.
    pub(super) has_holes: bool,
    /// Where the records of each opcode begin and end; summary offsets are none of them.
    groups: BTreeMap<u8, (u64, u64)>,
    offsets: Vec<(u64, SummaryOffset)>,
    schemas: BTreeSet<u16>,
    channels: BTreeSet<u16>,
    chunks: BTreeSet<u64>,
    attachments: BTreeSet<u64>,
    metadata: BTreeSet<u64>,
    /// The channels that chunk indexes name.
    indexed_channels: BTreeSet<u16>,
    statistics: Option<(u64, Statistics)>,
}

impl Summary {
    pub(super) fn new(start: u64) -> Self {
        Self { start, ..Self::default() }
    }

    /// Takes in one record.
    pub(super) fn record(&mut self, head: Head, body: &[u8], data: &mut DataSection) {
        let offset = head.offset;
        if head.opcode != op::SUMMARY_OFFSET {
            if let Some((at, _)) = self.offsets.first() {
                let what = format_args!("{} behind the summary offsets at {at}", name_of(head.opcode));
                data.findings.wrong(offset, what);
            }
            let (_, end) = self.groups.entry(head.opcode).or_insert((offset, offset));
            if *end != offset {
                let what = format_args!("{} apart from the others, which end at {end}", name_of(head.opcode));
                data.findings.wrong(offset, what);
            }
            *end = head.end();
        }
        let read = match head.opcode {
            op::SCHEMA => {
                self.schemas.extend(data.content.copy(op::SCHEMA, offset, body, &mut data.findings));
                Ok(())
            }
            op::CHANNEL => {
                self.channels.extend(data.content.copy(op::CHANNEL, offset, body, &mut data.findings));
                Ok(())
            }
            op::CHUNK_INDEX => parse(body).map(|index| self.chunk_index(offset, &index, data)),
            op::ATTACHMENT_INDEX => parse(body).map(|index| self.attachment_index(offset, &index, data)),
            op::METADATA_INDEX => parse(body).map(|index| self.metadata_index(offset, &index, data)),
            op::STATISTICS => parse(body).map(|statistics| {
                if let Some((at, _)) = &self.statistics {
                    data.findings.wrong(offset, format_args!("statistics again, as at offset {at}"));
                }
                self.statistics.get_or_insert((offset, statistics));
            }),
            op::SUMMARY_OFFSET => parse(body).map(|group| self.offsets.push((offset, group))),
            _ => Ok(()),
        };
        if let Err(problem) = read {
            data.findings.wrong(offset, format_args!("{}: {problem}", name_of(head.opcode)));
            self.has_holes = true;
        }
    }

    fn chunk_index(&mut self, offset: u64, index: &ChunkIndex, data: &mut DataSection) {
        let at = index.chunk_start_offset;
        self.indexed_channels.extend(index.message_index_offsets.keys());
        let mut entry = Entry { offset, at, what: "chunk", findings: &mut data.findings };
        if !entry.is_first(&mut self.chunks) {
            return;
        }
        let Some(found) = data.chunks.get(&at) else { return entry.stands_alone() };
        entry.holds("length", &index.chunk_length, &found.chunk_length);
        entry.holds("first log time", &index.message_start_time, &found.message_start_time);
        entry.holds("last log time", &index.message_end_time, &found.message_end_time);
        entry.holds("compression", &index.compression, &found.compression);
        entry.holds("compressed size", &index.compressed_size, &found.compressed_size);
        entry.holds("uncompressed size", &index.uncompressed_size, &found.uncompressed_size);
        entry.holds("length of message indexes", &index.message_index_length, &found.message_index_length);
        let (claimed, found) = (&index.message_index_offsets, &found.message_index_offsets);
        let channels: BTreeSet<u16> = claimed.keys().chain(found.keys()).copied().collect();
        for channel in channels {
            let what = format!("offset of the message index of channel {channel}");
            entry.holds(&what, &claimed.get(&channel), &found.get(&channel));
        }
    }

    fn attachment_index(&mut self, offset: u64, index: &AttachmentIndex, data: &mut DataSection) {
        let mut entry = Entry { offset, at: index.offset, what: "attachment", findings: &mut data.findings };
        if !entry.is_first(&mut self.attachments) {
            return;
        }
        let Some(found) = data.attachments.get(&index.offset) else { return entry.stands_alone() };
        entry.holds("length", &index.length, &found.length);
        entry.holds("log time", &index.log_time, &found.log_time);
        entry.holds("create time", &index.create_time, &found.create_time);
        entry.holds("data size", &index.data_size, &found.data_size);
        entry.holds("name", &index.name, &found.name);
        entry.holds("media type", &index.media_type, &found.media_type);
    }

    fn metadata_index(&mut self, offset: u64, index: &MetadataIndex, data: &mut DataSection) {
        let mut entry = Entry { offset, at: index.offset, what: "metadata", findings: &mut data.findings };
        if !entry.is_first(&mut self.metadata) {
            return;
        }
        let Some(found) = data.metadata.get(&index.offset) else { return entry.stands_alone() };
        if let Some(found) = found {
            entry.holds("length", &index.length, &found.length);
            entry.holds("name", &index.name, &found.name);
        }
    }

    /// Holds what the footer says against where the sections were found.
    pub(super) fn starts(&self, footer: Head, summary_start: u64, offset_start: u64, data: &mut DataSection) {
        let first_offset = self.offsets.first().map(|(at, _)| *at);
        let found = [
            ("the summary", summary_start, (!self.groups.is_empty()).then_some(self.start)),
            ("the summary offsets", offset_start, first_offset),
        ];
        for (what, claimed, found) in found {
            // of a section without records the format wants 0; its place does no harm
            let empty_place = found.is_none() && claimed == footer.offset;
            if claimed != found.unwrap_or(0) && !empty_place {
                let found = found.map_or_else(|| "there are none".into(), |at| format!("found at {at}"));
                data.findings.wrong(
                    footer.offset,
                    format_args!("the footer says {what} begins at {claimed}, {found}"),
                );
            }
        }
    }

    /// Says what the summary lacks, and what it miscounts.
    pub(super) fn finish(&self, data: &mut DataSection) {
        self.check_offsets(&mut data.findings);
        if self.has_holes {
            data.not_checkable.push("whether the summary is complete, as a part of it can't be read".into());
            return;
        }
        self.check_channels(data);
        let attachments = data.attachments.keys().copied().collect::<Vec<_>>();
        let metadata = data.metadata.keys().copied().collect::<Vec<_>>();
        let chunks = data.chunks.keys().copied().collect::<Vec<_>>();
        for (what, found, named) in [
            ("chunk", chunks, &self.chunks),
            ("attachment", attachments, &self.attachments),
            ("metadata", metadata, &self.metadata),
        ] {
            if named.is_empty() && !found.is_empty() {
                data.not_checkable.push(format!("there is no {what} index"));
                continue;
            }
            for at in found.iter().filter(|at| !named.contains(at)) {
                data.findings.wrong(*at, format_args!("the {what} index leaves this record out"));
            }
        }
        self.check_statistics(data);
    }

    fn check_offsets(&self, findings: &mut Findings) {
        let mut named = BTreeSet::new();
        for (offset, group) in &self.offsets {
            let what = name_of(group.group_opcode);
            let claimed = (group.group_start, group.group_length);
            let found = self.groups.get(&group.group_opcode).map(|(start, end)| (*start, end - start));
            if !named.insert(group.group_opcode) {
                findings.wrong(*offset, format_args!("a second summary offset for {what}"));
            }
            match found {
                Some(found) if found == claimed => {}
                Some((start, len)) => findings.wrong(
                    *offset,
                    format_args!(
                        "the summary offset for {what} says {} bytes at {}, found {len} at {start}",
                        claimed.1, claimed.0
                    ),
                ),
                None if claimed.1 == 0 => {}
                None => findings.wrong(
                    *offset,
                    format_args!("a summary offset for {what}, of which the summary has none"),
                ),
            }
        }
        for (opcode, (start, _)) in &self.groups {
            if !self.offsets.is_empty() && !named.contains(opcode) {
                let what = format_args!("no summary offset leads to {}", name_of(*opcode));
                findings.wrong(*start, what);
            }
        }
    }

    /// The format wants copies of the channels that chunk indexes name; its own test files lack them.
    fn check_channels(&self, data: &mut DataSection) {
        let lacking = self.indexed_channels.difference(&self.channels).count();
        if lacking > 0 {
            data.not_checkable
                .push(format!("the summary has no copy of {lacking} channels that its chunk index names"));
        }
    }

    fn check_statistics(&self, data: &mut DataSection) {
        let Some((offset, claimed)) = &self.statistics else {
            data.not_checkable.push("there are no statistics".into());
            return;
        };
        if data.has_holes || data.has_unreadable {
            data.not_checkable.push("the statistics, as not all of the data section can be read".into());
            return;
        }
        // Some writers copy definitions into the summary that no data stands on, and don't count them.
        let ids = |own: Vec<u16>, copies: &BTreeSet<u16>, claimed: u64| {
            let all = own.iter().chain(copies).collect::<BTreeSet<_>>().len() as u64;
            if claimed == own.len() as u64 { claimed } else { all }
        };
        let schemas = data.content.schemas.keys().copied().collect();
        let schemas = ids(schemas, &self.schemas, claimed.schema_count.into());
        let channels = data.content.channels.keys().copied().collect();
        let channels = ids(channels, &self.channels, claimed.channel_count.into());
        let found = &data.content.counted;
        let (checked, findings) = (&data.checked, &mut data.findings);
        let counts = [
            ("messages", claimed.message_count, found.message_count),
            ("schemas", claimed.schema_count.into(), schemas),
            ("channels", claimed.channel_count.into(), channels),
            ("attachments", claimed.attachment_count.into(), checked.attachments),
            ("metadata records", claimed.metadata_count.into(), checked.metadata),
            ("chunks", claimed.chunk_count.into(), checked.chunks),
            ("as first log time", claimed.message_start_time, found.message_start_time),
            ("as last log time", claimed.message_end_time, found.message_end_time),
        ];
        for (what, claimed, found) in counts {
            if claimed != found {
                findings.wrong(*offset, format_args!("the statistics say {claimed} {what}, found {found}"));
            }
        }
        let claimed = &claimed.channel_message_counts;
        if claimed.is_empty() {
            return;
        }
        let both: BTreeSet<u16> =
            claimed.keys().chain(found.channel_message_counts.keys()).copied().collect();
        for id in both {
            let [claimed, found] =
                [claimed, &found.channel_message_counts].map(|counts| counts.get(&id).copied().unwrap_or(0));
            if claimed != found {
                let what =
                    format_args!("the statistics say {claimed} messages on channel {id}, found {found}");
                findings.wrong(*offset, what);
            }
        }
    }
}

/// An index's record of one record of the data section.
struct Entry<'a> {
    offset: u64,
    /// Where the record stands that it is about.
    at: u64,
    what: &'static str,
    findings: &'a mut Findings,
}

impl Entry<'_> {
    fn is_first(&mut self, named: &mut BTreeSet<u64>) -> bool {
        let first = named.insert(self.at);
        if !first {
            let what = format_args!("the {} at offset {} is indexed again", self.what, self.at);
            self.findings.wrong(self.offset, what);
        }
        first
    }

    fn stands_alone(self) {
        let what = format_args!("the {} index leads to offset {}, where none was found", self.what, self.at);
        self.findings.wrong(self.offset, what);
    }

    fn holds<T: PartialEq + Debug>(&mut self, field: &str, claimed: &T, found: &T) {
        if claimed != found {
            let claimed = short(&format!("{claimed:?}"));
            let found = short(&format!("{found:?}"));
            self.findings.wrong(
                self.offset,
                format_args!(
                    "the index of the {} at offset {} says {field} {claimed}, found {found}",
                    self.what, self.at
                ),
            );
        }
    }
}

fn short(text: &str) -> String {
    if text.chars().count() <= 80 {
        text.to_owned()
    } else {
        text.chars().take(80).chain("...".chars()).collect()
    }
}
