//! Where the indexed records of the data section stand, and whether they do.

use std::ops::Range;

use mcap::records::op;

use super::damage::Damages;
use super::file::LogFile;
use super::index::SummaryRecord;
use super::{Index, LogError};

/// What an entry of the summary says of a record.
struct Claim {
    opcode: u8,
    what: &'static str,
    offset: u64,
    len: u64,
    /// Length of the message indexes behind it.
    behind: u64,
    holds: bool,
}

/// Where the indexed records stand, in order. Entries that say other than the data section are damage, and taken
/// out of the index: what stands there is then looked up as if they had never been.
pub(super) fn check(
    file: &LogFile,
    index: &mut Index,
    damages: &mut Damages,
) -> Result<Vec<Range<u64>>, LogError> {
    let mut claims = claims(index);
    for claim in &mut claims {
        claim.holds = damages.note(held_against_file(file, index, claim))?.is_some();
    }
    let chunks = index.chunks.iter().zip(&mut claims);
    for (chunk, claim) in chunks {
        let chunk_end = claim.offset.saturating_add(claim.len);
        let behind = chunk_end..index.data_end;
        let astray = chunk.message_index_offsets.iter().find(|(_, offset)| !behind.contains(offset));
        if let (true, Some((channel, offset))) = (claim.holds, astray) {
            let what =
                format!("the message index of channel {channel} is said to stand at {offset}, not behind it");
            damages.push(claim.offset, what);
            claim.holds = false;
        }
    }

    let mut order: Vec<usize> = (0..claims.len()).filter(|&i| claims[i].holds).collect();
    order.sort_by_key(|&i| claims[i].offset);
    let mut extents: Vec<Range<u64>> = Vec::with_capacity(order.len());
    for i in order {
        let claim = &mut claims[i];
        // Message indexes behind a chunk are walked like a gap: something else may stand among them.
        let extent = claim.offset..claim.offset + claim.len;
        match extents.last() {
            Some(last) if last.end > extent.start => {
                damages.push(
                    extent.start,
                    format!("indexed again, within the record indexed at {}", last.start),
                );
                claim.holds = false;
            }
            _ => extents.push(extent),
        }
    }
    take_out(index, &claims);
    Ok(extents)
}

fn claims(index: &Index) -> Vec<Claim> {
    let claim = |opcode, what, offset, len, behind| Claim { opcode, what, offset, len, behind, holds: false };
    let chunks = index
        .chunks
        .iter()
        .map(|c| claim(op::CHUNK, "chunk", c.chunk_start_offset, c.chunk_length, c.message_index_length));
    let attachments =
        index.attachments.iter().map(|a| claim(op::ATTACHMENT, "attachment", a.offset, a.length, 0));
    let metadata = index.metadata.iter().map(|m| claim(op::METADATA, "metadata", m.offset, m.length, 0));
    chunks.chain(attachments).chain(metadata).collect()
}

fn held_against_file(file: &LogFile, index: &Index, claim: &Claim) -> Result<(), LogError> {
    let &Claim { opcode, what, offset, len, behind, .. } = claim;
    let end = offset.checked_add(len).and_then(|end| end.checked_add(behind));
    if end.is_none_or(|end| offset < index.data_start || end > index.data_end) {
        let what = format!(
            "the {what} index says {len} + {behind} bytes stand here, outside the data section [{}, {})",
            index.data_start, index.data_end
        );
        return Err(file.damaged(offset, what));
    }
    let head = file.head(offset, index.data_end)?;
    if head.opcode != opcode || head.end() != offset + len {
        let found = head.end() - offset;
        let what = format!(
            "the {what} index says a record of {len} bytes (opcode {opcode:#04x}) stands here, found {found} bytes (opcode {:#04x})",
            head.opcode
        );
        return Err(file.damaged(offset, what));
    }
    Ok(())
}

/// Takes the entries that don't hold out of the index and the summary; these are in one order.
fn take_out(index: &mut Index, claims: &[Claim]) {
    if claims.iter().all(|claim| claim.holds) {
        return;
    }
    let holds =
        |opcode: u8| claims.iter().filter(move |claim| claim.opcode == opcode).map(|claim| claim.holds);
    let used = index.chunks.iter().zip(claims).filter(|(_, claim)| !claim.holds);
    let used = used.flat_map(|(chunk, _)| chunk.message_index_offsets.keys().copied());
    index.reserved_ids.extend(used);
    retain(&mut index.chunks, &mut index.summary, op::CHUNK_INDEX, holds(op::CHUNK));
    retain(&mut index.attachments, &mut index.summary, op::ATTACHMENT_INDEX, holds(op::ATTACHMENT));
    retain(&mut index.metadata, &mut index.summary, op::METADATA_INDEX, holds(op::METADATA));
}

fn retain<T>(
    entries: &mut Vec<T>,
    summary: &mut Vec<SummaryRecord>,
    opcode: u8,
    holds: impl Iterator<Item = bool> + Clone,
) {
    let mut of_entries = holds.clone();
    entries.retain(|_| of_entries.next() != Some(false));
    let mut of_records = holds;
    summary.retain(|record| record.opcode != opcode || of_records.next() != Some(false));
}
