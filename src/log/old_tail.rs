//! The original's end, in an attachment: a log that was added to can be taken back to the original, bit for bit.
//!
//! The attachment `trackfuse:original-after-N` stands at offset N: the original is the first N bytes of the file,
//! and then the attachment. Every addition brings its own; the first of them leads to the very original. Only
//! message indexes that a cut took away from the last chunk come between.

use mcap::records::{AttachmentHeader, AttachmentIndex, op};

use super::file::HEAD_LEN;
use super::summary::encode_body;

const NAME: &str = "trackfuse:original-after-";
const CRC_LEN: u64 = 4;

/// The record up to its data, for the end of an original whose data section ends at `data_end`.
pub(super) fn head(data_end: u64, tail_len: u64) -> Vec<u8> {
    let mut fields = encode_body(&AttachmentHeader {
        // No clock's time: the same input gives the same bytes.
        log_time: 0,
        create_time: 0,
        name: format!("{NAME}{data_end}"),
        media_type: "application/octet-stream".to_owned(),
    });
    fields.extend(tail_len.to_le_bytes());
    let mut head = vec![op::ATTACHMENT];
    head.extend((fields.len() as u64 + tail_len + CRC_LEN).to_le_bytes());
    head.extend(fields);
    head
}

/// What of [`head`] the attachment's CRC spans, beside its data.
pub(super) fn summed(head: &[u8]) -> &[u8] {
    head.get(HEAD_LEN as usize..).unwrap_or_default()
}

/// The index of the attachment that begins with `head` at `offset`.
pub(super) fn index(offset: u64, data_end: u64, tail_len: u64, head: &[u8]) -> AttachmentIndex {
    AttachmentIndex {
        offset,
        length: head.len() as u64 + tail_len + CRC_LEN,
        log_time: 0,
        create_time: 0,
        data_size: tail_len,
        name: format!("{NAME}{data_end}"),
        media_type: "application/octet-stream".to_owned(),
    }
}

/// Where the original's data section ended, `None` where the attachment is none of these.
pub(super) fn data_end(attachment: &AttachmentIndex) -> Option<u64> {
    attachment.name.strip_prefix(NAME)?.parse().ok()
}
