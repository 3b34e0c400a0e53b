//! A good log is broken in one place each, and verifying must say so there.

use std::fs;
use std::sync::{Arc, Mutex};

use super::super::Observer;
use super::super::fixture::{PRIVATE, chunked, log, on_disk, records};
use super::super::summary::encode_bytes;
use super::*;
use mcap::records::op;

fn of(bytes: &[u8]) -> Verification {
    let (_dir, path) = on_disk(bytes);
    verify(&path, ReadOptions::default()).unwrap()
}

/// A log without the checksums that would tell of every change.
fn quiet() -> Vec<u8> {
    let options = chunked().calculate_data_section_crc(false).calculate_summary_section_crc(false);
    log(options.calculate_chunk_crcs(false))
}

/// Where the body begins of the last record with `opcode`.
fn body_of(bytes: &[u8], opcode: u8) -> usize {
    records(bytes).into_iter().rfind(|(found, _)| *found == opcode).unwrap().1 + 9
}

/// Where the first chunk's records begin.
fn first_content(bytes: &[u8]) -> usize {
    records(bytes).into_iter().find(|(opcode, _)| *opcode == op::CHUNK).unwrap().1 + 9 + 40
}

/// Where the body begins of the first record with `opcode` in the first chunk.
fn in_chunk(bytes: &[u8], opcode: u8) -> usize {
    let mut at = first_content(bytes);
    while bytes[at] != opcode {
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    at + 9
}

/// Holds that a change of one byte of the quiet log is found: at the record's offset, in these words.
#[track_caller]
fn assert_found(at: usize, record: usize, words: &str) {
    let mut bytes = quiet();
    bytes[at] = bytes[at].wrapping_add(1);
    assert_says(&bytes, record, words);
}

#[track_caller]
fn assert_says(bytes: &[u8], record: usize, words: &str) {
    let found = of(bytes);
    let said = found.findings.iter().any(|f| f.offset == record as u64 && f.what.contains(words));
    assert!(said, "expected {words:?} at {record}: {:#?}", found.findings);
}

#[test]
fn good_logs_verify_without_a_finding_and_what_lacks_a_checksum_is_named_once() {
    for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
        let found = of(&log(chunked().compression(compression)));
        assert!(found.is_clean() && found.not_checkable.is_empty(), "{found:#?}");
        let checked = found.checked;
        assert_eq!((checked.messages, checked.index_entries, checked.attachments), (20, 20, 1));
        assert_eq!((checked.data_section, checked.summary), (Some(true), Some(true)));
        assert_eq!(checked.chunk_checksums_right, checked.chunks);
    }
    let found = of(&quiet());
    assert!(found.is_clean(), "{found:#?}");
    assert_eq!(found.not_checkable.len(), 3, "{found:#?}");
    let found = of(&log(chunked().use_chunks(false)));
    assert!(found.is_clean(), "{found:#?}");
    assert_eq!(found.checked.messages, 20);
    assert_eq!(found.not_checkable, ["20 of 20 messages stand outside chunks and have no index"]);
}

#[test]
fn every_flipped_byte_is_found() {
    let bytes = log(chunked());
    let (_dir, path) = on_disk(&bytes);
    for at in 8..bytes.len() {
        let mut bytes = bytes.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&path, &bytes).unwrap();
        assert!(!verify(&path, ReadOptions::default()).unwrap().is_clean(), "byte {at}");
    }
}

#[test]
fn a_log_cut_off_anywhere_and_bytes_behind_its_end_are_found() {
    let bytes = log(chunked());
    let (_dir, path) = on_disk(&bytes);
    for len in 1..bytes.len() {
        fs::write(&path, &bytes[..len]).unwrap();
        assert!(!verify(&path, ReadOptions::default()).unwrap().is_clean(), "cut at {len}");
    }
    assert_says(&[&bytes[..], b"more"].concat(), bytes.len(), "4 bytes stand behind the end");
    let footer = body_of(&bytes, op::FOOTER) - 9;
    assert_says(&bytes[..footer], footer, "the file ends without a footer");
}

#[test]
fn whatever_the_length_of_a_record_nothing_panics_and_it_is_found() {
    let bytes = quiet();
    for (opcode, at) in records(&bytes) {
        for len in [0, 1, 5, 1 << 20, 1 << 40, u64::MAX] {
            let mut bytes = bytes.clone();
            bytes[at + 1..at + 9].copy_from_slice(&len.to_le_bytes());
            assert!(!of(&bytes).is_clean(), "{opcode:#04x} of {len} bytes");
        }
    }
}

#[test]
fn damage_of_a_chunk_is_found() {
    let bytes = quiet();
    let content = first_content(&bytes);
    let chunk = content - 40 - 9;
    assert_found(content - 40, chunk, "the chunk's header says log times");
    assert_found(content - 32, chunk, "the chunk's header says log times");
    assert_found(content - 24, chunk, "holds less than");
    assert_found(content - 1, chunk, "compressed bytes, its record has");
    assert_found(in_chunk(&bytes, op::MESSAGE) - 2, chunk, "no whole record at byte");
    assert_found(in_chunk(&bytes, op::MESSAGE) - 9, chunk, "a chunk at byte");
    assert_found(in_chunk(&bytes, op::MESSAGE) + 1, chunk, "is on channel 257, which no record before it");
    assert_found(in_chunk(&bytes, op::CHANNEL) + 3, chunk, "has schema 257, which no record before it");

    let full = log(chunked());
    let mut changed = full.clone();
    changed[in_chunk(&full, op::MESSAGE) + 23] ^= 1;
    assert_says(&changed, chunk, "the chunk's CRC is");
    let data_end = body_of(&full, op::DATA_END) - 9;
    assert_says(&changed, data_end, "the data section's CRC is");

    let mut packed = log(chunked().compression(Some(mcap::Compression::Zstd)));
    packed[content + 4] ^= 1;
    assert_says(&packed, chunk, "can't be decompressed");
    packed[content - 5] = b'?';
    assert_says(&packed, chunk, "the chunk's compression is");
}

#[test]
fn damage_of_a_message_index_is_found() {
    let bytes = quiet();
    let body = body_of(&bytes, op::MESSAGE_INDEX);
    assert_found(body, body - 9, "the message index says channel");
    assert_found(body + 2, body - 9, "each has 16");
    assert_found(body + 6, body - 9, "log time");
    assert_found(body + 14, body - 9, "where no message begins");
    let chunk = body_of(&bytes, op::CHUNK) - 9;
    assert_found(body + 14, chunk, "in no message index");
    // an index record of somebody's own behind the attachment, where no chunk is
    let mut bytes = quiet();
    let metadata = body_of(&bytes, op::METADATA) - 9;
    bytes[metadata] = op::MESSAGE_INDEX;
    assert_says(&bytes, metadata, "stands behind no chunk");
}

#[test]
fn damage_of_a_chunk_index_is_found() {
    let bytes = quiet();
    let body = body_of(&bytes, op::CHUNK_INDEX);
    let record = body - 9;
    assert_found(body, record, "says first log time");
    assert_found(body + 8, record, "says last log time");
    assert_found(body + 16, record, "where none was found");
    assert_found(body + 24, record, "says length");
    assert_found(body + 38, record, "says offset of the message index of channel");
    let end = records(&bytes).into_iter().find(|(_, at)| *at > body).unwrap().1;
    assert_found(end - 28, record, "says length of message indexes");
    assert_found(end - 16, record, "says compressed size");
    assert_found(end - 8, record, "says uncompressed size");
    let mut bytes = quiet();
    bytes[record] = 0x90;
    let chunk = body_of(&bytes, op::CHUNK) - 9;
    assert_says(&bytes, chunk, "the chunk index leaves this record out");
}

#[test]
fn damage_of_attachments_and_metadata_and_their_indexes_is_found() {
    let bytes = quiet();
    let attachment = body_of(&bytes, op::ATTACHMENT);
    assert_found(attachment, attachment - 9, "the attachment \"notes\" has the CRC");
    assert_found(attachment + 50, attachment - 9, "has the CRC");
    assert_found(attachment + 19, attachment - 9, "the attachment's fields need");
    let size = attachment + 8 + 8 + 4 + 5 + 4 + 10;
    assert_found(size + 1, attachment - 9, "the attachment claims 269 bytes");
    let body = body_of(&bytes, op::ATTACHMENT_INDEX);
    for (at, words) in [
        (0, "where none was found"),
        (8, "says length"),
        (16, "says log time"),
        (24, "says create time"),
        (32, "says data size"),
        (44, "says name"),
        (53, "says media type"),
    ] {
        assert_found(body + at, body - 9, words);
    }
    assert_found(body, attachment - 9, "the attachment index leaves this record out");
    let body = body_of(&bytes, op::METADATA_INDEX);
    for (at, words) in [(0, "where none was found"), (8, "says length"), (20, "says name")] {
        assert_found(body + at, body - 9, words);
    }
    let metadata = body_of(&bytes, op::METADATA);
    assert_found(metadata + 3, metadata - 9, "metadata: its fields need more");
}

#[test]
fn wrong_statistics_are_found() {
    let bytes = quiet();
    let body = body_of(&bytes, op::STATISTICS);
    for (at, words) in [
        (0, "say 21 messages, found 20"),
        (8, "say 2 schemas, found 1"),
        (10, "say 3 channels, found 2"),
        (14, "say 2 attachments, found 1"),
        (18, "say 2 metadata records, found 1"),
        (22, " chunks, found "),
        (26, "say 1 as first log time, found 0"),
        (34, " as last log time, found 19000000000"),
        (48, "say 16 messages on channel 1, found 15"),
    ] {
        assert_found(body + at, body - 9, words);
    }
}

#[test]
fn damage_of_the_summary_is_found() {
    let bytes = quiet();
    let (schema, channel) = (body_of(&bytes, op::SCHEMA), body_of(&bytes, op::CHANNEL));
    assert_found(schema + 6, schema - 9, "schema 1 of the summary is not the one defined at offset");
    assert_found(channel + 9, channel - 9, "of the summary is not the one defined at offset");
    let offset = body_of(&bytes, op::SUMMARY_OFFSET);
    assert_found(offset + 1, offset - 9, "the summary offset for");
    let footer = body_of(&bytes, op::FOOTER);
    assert_found(footer, footer - 9, "the footer says the summary begins at");
    assert_found(footer + 8, footer - 9, "the footer says the summary offsets begins at");
    assert_found(footer + 16, footer - 9, "the summary's CRC is");
    assert_found(footer + 20, footer + 20, "expected \"\\x89MCAP0\\r\\n\" behind the footer");
    let mut bytes = quiet();
    bytes[schema - 9] = op::MESSAGE_INDEX;
    assert_says(&bytes, schema - 9, "a message index in the summary");
}

#[test]
fn a_broken_end_of_the_data_section_hides_nothing_else() {
    let mut bytes = quiet();
    let end = body_of(&bytes, op::DATA_END);
    bytes[end - 9] = PRIVATE;
    assert_says(&bytes, end + 4, "expected the end of the data section");
    bytes[end - 9] = 0;
    assert_says(&bytes, end - 9, "found opcode 0x00; went on");
    let schema = body_of(&bytes, op::SCHEMA);
    bytes[schema + 6] ^= 1;
    assert_says(&bytes, schema - 9, "schema 1 of the summary is not");
}

#[test]
fn bytes_that_are_no_record_are_passed_over_where_the_summary_tells_what_comes_next() {
    let mut bytes = quiet();
    let private = body_of(&bytes, PRIVATE) - 9;
    bytes[private] = 0;
    let next = records(&quiet()).into_iter().find(|(opcode, at)| *at > private && *opcode == op::CHUNK);
    let found = of(&bytes);
    let words = format!("went on at offset {}", next.unwrap().1);
    assert_says(&bytes, private, &words);
    assert_eq!(found.checked.messages, 20);
    // damage behind it is still found
    let attachment = body_of(&quiet(), op::ATTACHMENT);
    bytes[attachment] ^= 1;
    assert_says(&bytes, attachment - 9, "has the CRC");
}

#[test]
fn definitions_that_contradict_each_other_are_found() {
    let bare = log(chunked().emit_summary_records(false).emit_summary_offsets(false));
    let end = body_of(&bare, op::DATA_END) - 9;
    let with = |opcode: u8, body: &[u8]| {
        let mut bytes = bare.clone();
        bytes.splice(end..end, encode_bytes(opcode, &[body]));
        bytes
    };
    let other_channel = b"\x01\0\x01\0\x02\0\0\0/z\x04\0\0\0json\0\0\0\0";
    assert_says(&with(op::CHANNEL, other_channel), end, "channel 1 is not the same as");
    let other_schema = b"\x01\0\x01\0\0\0T\0\0\0\0\0\0\0\0";
    assert_says(&with(op::SCHEMA, other_schema), end, "schema 1 is not the same as");
    let nameless = b"\0\0\0\0\0\0\0\0\0\0\0\0\0\0";
    assert_says(&with(op::SCHEMA, nameless), end, "has the id 0");
    assert_says(&with(op::STATISTICS, b""), end, "statistics in the data section");
}

#[test]
fn a_file_that_is_broken_all_over_is_told_of_in_bounded_memory() {
    let bare = log(chunked().emit_summary_records(false).emit_summary_offsets(false));
    let end = body_of(&bare, op::DATA_END) - 9;
    let mut bytes = bare.clone();
    bytes.splice(end..end, encode_bytes(op::STATISTICS, &[]).repeat(1000));
    let found = of(&bytes);
    // the wrong checksum of the data section is the last
    assert_eq!((found.findings.len(), found.left_out), (100, 901));
}

#[test]
fn progress_is_told_up_to_the_last_byte() {
    let bytes = log(chunked());
    let (_dir, path) = on_disk(&bytes);
    let told = Arc::new(Mutex::new(Vec::new()));
    let ear = Arc::clone(&told);
    let observer = Observer::new(move |progress| ear.lock().unwrap().push((progress.done, progress.total)));
    let found = verify(&path, ReadOptions { observer, ..ReadOptions::default() }).unwrap();
    let len = bytes.len() as u64;
    assert_eq!(told.lock().unwrap().last(), Some(&(len, len)));
    assert_eq!(found.checked.bytes, len);
}
