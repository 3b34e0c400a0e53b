//! Logs whose end is not as it should be, though all before it is.

use std::fs;
use std::io::Read;

use mcap::WriteOptions;
use trackfuse::log::{LogError, ReadOptions, Visibility};

use super::damage::log_of as chunked_log;
use super::hostile::{Opened, channel, chunk, message, opened, opened_with};
use super::raw::{summary_start, told_by_index, told_by_stream, u64_at};

/// Some chunks, and where their data section ends.
fn whole() -> (Vec<u8>, usize) {
    let bytes = chunked_log(WriteOptions::new().compression(None), 12, 20, 150);
    let data_end = summary_start(&bytes) - 13;
    (bytes, data_end)
}

/// Puts a right checksum of the summary into the footer.
fn sum_up(bytes: &mut [u8]) {
    let (start, end) = (summary_start(bytes), bytes.len() - 12);
    let crc = crc32fast::hash(&bytes[start..end]);
    bytes[end..end + 4].copy_from_slice(&crc.to_le_bytes());
}

/// The log without its `DataEnd`, and a footer that knows of it.
fn without_data_end() -> (Vec<u8>, usize) {
    let (mut bytes, data_end) = whole();
    bytes.drain(data_end..data_end + 13);
    for field in [28, 20] {
        let at = bytes.len() - field;
        let start = u64_at(&bytes, at) - 13;
        bytes[at..at + 8].copy_from_slice(&start.to_le_bytes());
    }
    sum_up(&mut bytes);
    (bytes, data_end)
}

/// Adds to the log: readers from record to record and by index find the messages `old` and the new one, and nothing
/// is wrong with the output.
fn assert_all_found(log: &Opened, old: &[u8], what: &str) -> Vec<u8> {
    let output = fs::read(log.append()).unwrap();
    let told = told_by_stream(&output);
    let expected: Vec<_> = told_by_stream(old);
    assert_eq!(told[..told.len() - 1], expected, "{what}");
    let mut sorted = told;
    sorted.sort();
    assert_eq!(told_by_index(&output), sorted, "{what}");
    assert_eq!(opened(output.clone()).said(), "", "{what}");
    output
}

#[test]
fn without_the_record_that_ends_the_data_section_a_right_summary_is_used_and_the_records_tell_the_end() {
    let (gone, data_end) = without_data_end();
    let flipped = |at: usize, mask: u8| {
        let mut bytes = whole().0;
        bytes[data_end + at] ^= mask;
        bytes
    };
    // Gone, of another opcode (a message index, a private record), of another length.
    for (what, bytes) in [
        ("gone", gone),
        ("a message index", flipped(0, 0x08)),
        ("private", flipped(0, 0xf0)),
        ("no record", flipped(0, 0x0f)),
        ("shorter", flipped(1, 4)),
        ("too long", flipped(8, 0x40)),
    ] {
        let log = opened(bytes.clone());
        assert!(log.said().contains("expected the end of the data section"), "{what}: {}", log.said());
        assert_eq!(log.log.index().data_end as usize, data_end, "{what}");
        assert!(log.log.index().summary_start.is_some() && log.log.index().is_cut, "{what}");
        let mut tail = Vec::new();
        log.log.tail().read_to_end(&mut tail).unwrap();
        assert!(tail == bytes[data_end..], "{what}");
        let output = assert_all_found(&log, &whole().0, what);

        let output = opened(output);
        let restored = output.dir.path().join("restored.mcap");
        output.log.restore_to(&output.log.additions().unwrap()[0], &restored, false).unwrap();
        assert!(fs::read(restored).unwrap() == bytes, "{what}");
    }
}

#[test]
fn garbage_in_the_data_section_and_no_record_that_ends_it_cost_nothing_that_a_right_summary_names() {
    let (mut bytes, _) = without_data_end();
    let last = opened(bytes.clone()).log.index().chunks.last().unwrap().clone();
    // The record behind the first chunk claims more than there is.
    let first = opened(bytes.clone()).log.index().chunks[0].clone();
    let at = (first.chunk_start_offset + first.chunk_length) as usize;
    bytes[at + 8] = 0x7f;
    let log = opened(bytes);
    assert!(log.log.index().chunks.contains(&last), "{}", log.said());
    assert!(!told_by_index(&fs::read(log.append()).unwrap()).is_empty());
}

#[test]
fn a_log_cut_off_right_behind_a_chunk_of_time_0_or_without_messages_is_indexed_once() {
    let (bytes, data_end) = whole();
    for (what, records) in [
        ("no record", vec![]),
        ("a channel", channel(99, 0, b"/late")),
        ("messages", [channel(99, 0, b"/late"), message(99, 0), message(99, 0)].concat()),
    ] {
        let cut = [&bytes[..data_end], &chunk(records.len() as u64, b"", &records)].concat();
        let log = opened(cut.clone());
        assert_eq!(log.log.visibility(), Visibility::Indexed, "{what}");
        let end = [&[0x0f, 4][..], &[0; 7 + 4], &[0x02, 20], &[0; 7 + 20], b"\x89MCAP0\r\n"].concat();
        assert_all_found(&log, &[cut, end].concat(), what);
    }
}

#[test]
fn a_log_cut_off_behind_a_chunk_that_cannot_be_unpacked_here_is_added_to() {
    let (bytes, data_end) = whole();
    for (what, last) in [("zpaq", chunk(100, b"zpaq", b"abcdef")), ("too large", chunk(1 << 44, b"", b"abc"))]
    {
        let log = opened([&bytes[..data_end], &last].concat());
        assert!(log.said().contains("it was not read"), "{what}: {}", log.said());
        let (old, _) = log.times();
        assert_eq!(old.len(), 12, "{what}");
        let again = opened(fs::read(log.append()).unwrap());
        assert_eq!(again.times().0, [&old[..], &[9]].concat(), "{what}");
    }
}

#[test]
fn a_broken_footer_is_damage_however_large_the_summary_would_be_by_it() {
    let (mut bytes, data_end) = whole();
    let options = ReadOptions { memory_limit: 2_000, ..ReadOptions::default() };
    let more = chunk(0, b"", b"").repeat(60);
    bytes.splice(data_end..data_end, more.iter().copied());
    let len = bytes.len();
    for at in [len - 28, len - 20] {
        let start = u64_at(&bytes, at) + more.len() as u64;
        bytes[at..at + 8].copy_from_slice(&start.to_le_bytes());
    }
    sum_up(&mut bytes);
    let start = u64_at(&bytes, len - 28);
    for wrong in [start, start - 2_500] {
        bytes[len - 28..len - 20].copy_from_slice(&wrong.to_le_bytes());
        let log = opened_with(bytes.clone(), options.clone()).unwrap_or_else(|e: LogError| panic!("{e}"));
        assert_eq!(log.times().0.len(), 12);
    }
}
