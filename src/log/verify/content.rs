//! Schemas, channels and messages, in chunks and outside: what the file defines, and what stands on it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use mcap::records::{Channel, MessageHeader, Statistics, op};
use sha2::{Digest, Sha256};

use super::super::file::parse;
use super::super::index::Schema;
use super::super::summary::encode_body;
use super::findings::{Findings, quoted};

/// Where a record stands: in the file itself, or in a chunk's records.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) offset: u64,
    pub(super) in_chunk: Option<u64>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.in_chunk {
            Some(at) => write!(f, " at byte {at} of the chunk's records"),
            None => Ok(()),
        }
    }
}

/// A definition as the data section has it: enough to tell whether another is the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Defined {
    /// The file's offset of the record, or of its chunk.
    pub(super) offset: u64,
    /// `None` where it can't be read.
    digest: Option<[u8; 32]>,
}

/// What the data section defines and holds.
#[derive(Debug, Default)]
pub(super) struct Content {
    pub(super) schemas: BTreeMap<u16, Defined>,
    pub(super) channels: BTreeMap<u16, Defined>,
    /// Messages and times as counted; other counts are not kept here.
    pub(super) counted: Statistics,
    /// Channels whose absence was said.
    undefined: BTreeSet<u16>,
}

impl Content {
    pub(super) fn schema(&mut self, place: Place, body: &[u8], findings: &mut Findings) {
        let Some((id, digest)) = schema(place, body, findings) else { return };
        define(&mut self.schemas, "schema", id, digest, place, findings);
    }

    pub(super) fn channel(&mut self, place: Place, body: &[u8], findings: &mut Findings) {
        let Some((id, schema_id, digest)) = channel(place, body, findings) else { return };
        if schema_id != 0 && !self.schemas.contains_key(&schema_id) {
            findings.wrong(
                place.offset,
                format_args!("channel {id}{place} has schema {schema_id}, which no record before it defines"),
            );
        }
        define(&mut self.channels, "channel", id, digest, place, findings);
    }

    /// Takes in a message's first bytes; `None` where it has no header.
    pub(super) fn message(
        &mut self,
        place: Place,
        body: &[u8],
        findings: &mut Findings,
    ) -> Option<MessageHeader> {
        let header: MessageHeader = match parse(body) {
            Ok(header) => header,
            Err(problem) => {
                findings.wrong(place.offset, format_args!("message{place}: {problem}"));
                return None;
            }
        };
        let id = header.channel_id;
        if !self.channels.contains_key(&id) && self.undefined.insert(id) {
            findings.wrong(
                place.offset,
                format_args!("message{place} is on channel {id}, which no record before it defines"),
            );
        }
        let (time, counted) = (header.log_time, &mut self.counted);
        let first = counted.message_count == 0;
        counted.message_start_time = if first { time } else { counted.message_start_time.min(time) };
        counted.message_end_time = counted.message_end_time.max(time);
        counted.message_count += 1;
        *counted.channel_message_counts.entry(id).or_default() += 1;
        Some(header)
    }

    /// Holds a copy in the summary against the data section. The answer is its id.
    pub(super) fn copy(&self, opcode: u8, offset: u64, body: &[u8], findings: &mut Findings) -> Option<u16> {
        let place = Place { offset, in_chunk: None };
        let (what, id, digest, own) = if opcode == op::SCHEMA {
            let (id, digest) = schema(place, body, findings)?;
            ("schema", id, digest, self.schemas.get(&id))
        } else {
            let (id, _, digest) = channel(place, body, findings)?;
            ("channel", id, digest, self.channels.get(&id))
        };
        if let Some(own) = own
            && own.digest.is_some()
            && digest.is_some()
            && own.digest != digest
        {
            findings.wrong(
                offset,
                format_args!("{what} {id} of the summary is not the one defined at offset {}", own.offset),
            );
        }
        Some(id)
    }
}

fn define(
    known: &mut BTreeMap<u16, Defined>,
    what: &str,
    id: u16,
    digest: Option<[u8; 32]>,
    place: Place,
    findings: &mut Findings,
) {
    let own = known.entry(id).or_insert(Defined { offset: place.offset, digest });
    if own.digest.is_some() && digest.is_some() && own.digest != digest {
        let first = own.offset;
        findings.wrong(
            place.offset,
            format_args!("{what} {id}{place} is not the same as the {what} {id} defined at offset {first}"),
        );
    }
}

/// Id and digest; the id is told even where the rest can't be read.
fn schema(place: Place, body: &[u8], findings: &mut Findings) -> Option<(u16, Option<[u8; 32]>)> {
    match Schema::parse(body) {
        Ok(Schema { id, name, encoding, data }) => {
            if id == 0 {
                findings.wrong(
                    place.offset,
                    format_args!("schema {}{place} has the id 0, which stands for none", quoted(&name)),
                );
                return None;
            }
            let parts = [name.as_bytes(), encoding.as_bytes(), &data];
            let digest = parts.iter().fold(Sha256::new(), |sha, part| {
                sha.chain_update((part.len() as u64).to_le_bytes()).chain_update(part)
            });
            Some((id, Some(digest.finalize().into())))
        }
        Err(problem) => {
            findings.wrong(place.offset, format_args!("schema{place}: {problem}"));
            parse(body).ok().map(|id| (id, None))
        }
    }
}

/// Id, schema's id and digest.
fn channel(place: Place, body: &[u8], findings: &mut Findings) -> Option<(u16, u16, Option<[u8; 32]>)> {
    match parse::<Channel>(body) {
        Ok(channel) => {
            let digest = Sha256::digest(encode_body(&channel)).into();
            Some((channel.id, channel.schema_id, Some(digest)))
        }
        Err(problem) => {
            findings.wrong(place.offset, format_args!("channel{place}: {problem}"));
            parse(body).ok().map(|id| (id, 0, None))
        }
    }
}
