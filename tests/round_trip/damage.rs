//! Logs that are cut off or have a flipped byte: whatever stood in whole records before the damage is read, and
//! stands in the output.
//!
//! A sample is taken of all places; `TRACKFUSE_TEST_SWEEP=full cargo test --release --test round_trip damage` takes
//! every byte of the small logs and a thousand places of the large one.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{Cursor, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use mcap::{WriteOptions, records::MessageHeader};
use trackfuse::log::{Appender, Compression, Destination, Log, LogError, NewMessage, Visibility};

use super::new_channel;
use super::raw::{
    CHUNK, HEAD, MESSAGE, Told, content, first_record, told_by_index, told_by_stream, u32_at, u64_at,
};

/// Messages of two channels, `bytes_each` long, in chunks of `chunk_bytes`.
pub(super) fn log_of(options: WriteOptions, messages: u64, bytes_each: usize, chunk_bytes: u64) -> Vec<u8> {
    let mut writer = options.chunk_size(Some(chunk_bytes)).create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("Test", "jsonschema", b"{}").unwrap();
    let ids = ["/a", "/b"].map(|topic| writer.add_channel(schema, topic, "json", &BTreeMap::new()).unwrap());
    // Like noise, so that compression leaves the size as it is.
    let mut noise = 1_u64;
    for i in 0..messages {
        let data: Vec<u8> = std::iter::repeat_with(|| {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (noise >> 56) as u8
        })
        .take(bytes_each)
        .collect();
        let time = 1_000 + i * 1_000_000;
        let channel_id = ids[usize::from(i % 3 == 1)];
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Small logs of every kind, by what is to be said of them.
fn small_logs() -> Vec<(&'static str, Vec<u8>)> {
    let options = |compression| WriteOptions::new().compression(compression);
    [
        ("uncompressed", options(None)),
        ("zstd", options(Some(mcap::Compression::Zstd))),
        ("lz4", options(Some(mcap::Compression::Lz4))),
        ("without chunks", options(None).use_chunks(false)),
        ("without message indexes", options(None).emit_message_indexes(false)),
    ]
    .map(|(name, options)| (name, log_of(options, 12, 20, 150)))
    .into()
}

fn is_full_sweep() -> bool {
    std::env::var_os("TRACKFUSE_TEST_SWEEP").is_some_and(|sweep| sweep == "full")
}

/// All of `range`, or about `sample` of them.
fn places(range: std::ops::Range<usize>, sample: usize) -> impl Iterator<Item = usize> {
    let step = if is_full_sweep() { 1 } else { (range.len() / sample).max(1) };
    range.step_by(step)
}

/// The messages of the whole records in `bytes[..len]`, and where the last of those records ends.
fn messages_before(bytes: &[u8], len: usize) -> (Vec<(u32, Vec<u8>)>, usize) {
    let (mut messages, mut at) = (Vec::new(), 8);
    let mut push = |record: &[u8]| {
        if record[0] == MESSAGE {
            messages.push((u32_at(record, HEAD + 2), record[HEAD + 22..].to_vec()));
        }
    };
    while at + HEAD <= len && at + HEAD + u64_at(bytes, at + 1) as usize <= len {
        let record = first_record(&bytes[at..]);
        // DataEnd
        if record[0] == 0x0f {
            break;
        }
        push(record);
        if record[0] == CHUNK {
            let records = content(record);
            let mut rest = &records[..];
            while !rest.is_empty() {
                let record = first_record(rest);
                push(record);
                rest = &rest[record.len()..];
            }
        }
        at += record.len();
    }
    (messages, at)
}

/// All that can be read, however much of the log can't.
fn read(log: &Log) -> (Vec<(u32, Vec<u8>)>, usize) {
    let mut messages = Vec::new();
    let channels = (0..=u16::MAX).collect();
    let excerpt = log.for_each_message_of_excerpt(&channels, u64::MAX, |m| {
        messages.push((m.sequence, m.data.to_vec()));
    });
    (messages, excerpt.damaged.len())
}

fn append(log: &Log, out: &Path) -> Vec<u8> {
    let to = Destination::New { out: out.to_owned(), force: true };
    let mut appender = Appender::begin(log, &to, &[new_channel("/new")], Compression::None).unwrap();
    appender.write(NewMessage { channel: 0, time_ns: 7, data: b"new" }).unwrap();
    appender.finish().unwrap();
    fs::read(out).unwrap()
}

fn short(told: Vec<Told>) -> Vec<(u32, Vec<u8>)> {
    told.into_iter().filter(|told| told.0 != "/new").map(|told| (told.1, told.4)).collect()
}

/// Holds the output of a log of `len` bytes, cut off there, against what must be in it.
fn check_output(log: &Log, out: &Path, input: &[u8], whole: &[(u32, Vec<u8>)], place: &str) {
    let output = append(log, out);
    let data_end = log.index().data_end as usize;
    assert!(output[..data_end] == input[..data_end], "{place}: the data section changed");
    let told = told_by_stream(&output);
    assert_eq!(told.iter().filter(|told| told.0 == "/new").count(), 1, "{place}");
    let told = short(told);
    assert!(told.starts_with(whole), "{place}: {} of {} in the output", told.len(), whole.len());
    if log.visibility() == Visibility::Indexed {
        let mut indexed = short(told_by_index(&output));
        indexed.sort();
        let mut told = told;
        told.sort();
        assert_eq!(indexed, told, "{place}: through the index");
    }
    assert_eq!(Log::open(out).unwrap().damage(), [], "{place}: the output is damaged too");
}

/// A file that is changed in place, which is faster than a new one each time.
struct Patient {
    dir: tempfile::TempDir,
    path: PathBuf,
    file: File,
}

impl Patient {
    fn new(bytes: &[u8]) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("in.mcap");
        fs::write(&path, bytes).unwrap();
        let file = File::options().write(true).open(&path).unwrap();
        Self { dir, path, file }
    }

    fn cut(&self, len: usize) {
        self.file.set_len(len as u64).unwrap();
    }

    fn set(&mut self, at: usize, byte: u8) {
        self.file.seek(SeekFrom::Start(at as u64)).unwrap();
        self.file.write_all(&[byte]).unwrap();
    }

    fn out(&self) -> PathBuf {
        self.dir.path().join("out.mcap")
    }
}

fn check_cut(patient: &Patient, bytes: &[u8], len: usize, place: &str) {
    patient.cut(len);
    let log = match Log::open(&patient.path) {
        Ok(log) => log,
        Err(LogError::CutOff { .. } | LogError::Damaged { .. }) if len < 60 => return,
        Err(other) => panic!("{place}: {other}"),
    };
    assert!(!log.damage().is_empty(), "{place}");
    let (whole, end) = messages_before(bytes, len);
    assert_eq!(log.index().data_end as usize, end, "{place}: what is kept");
    let (found, damaged) = read(&log);
    assert_eq!(damaged, 0, "{place}");
    assert!(found.starts_with(&whole), "{place}: {} of {} read", found.len(), whole.len());
    check_output(&log, &patient.out(), bytes, &found, place);
}

#[test]
fn a_small_log_cut_off_at_any_byte_keeps_what_stands_before() {
    for (name, bytes) in small_logs() {
        let patient = Patient::new(&bytes);
        let lens: Vec<usize> = places(1..bytes.len(), 25).collect();
        for len in lens.into_iter().rev() {
            check_cut(&patient, &bytes, len, &format!("{name}, cut at {len}"));
        }
    }
}

#[test]
fn a_log_of_5_mb_cut_off_keeps_what_stands_before() {
    let options = WriteOptions::new().compression(Some(mcap::Compression::Zstd));
    let bytes = log_of(options, 1_000, 5_000, 100_000);
    assert!((4_900_000..5_200_000).contains(&bytes.len()), "{}", bytes.len());
    let patient = Patient::new(&bytes);
    let step = bytes.len() / if is_full_sweep() { 1_000 } else { 8 };
    for len in (100..bytes.len()).step_by(step).collect::<Vec<_>>().into_iter().rev() {
        check_cut(&patient, &bytes, len, &format!("cut at {len}"));
    }
}

#[test]
fn whole_messages_of_a_chunk_cut_in_half_are_saved() {
    let options = WriteOptions::new().compression(None);
    let bytes = log_of(options, 10, 100, 100_000);
    let (all, _) = messages_before(&bytes, bytes.len());
    let of = |data: &[u8]| bytes.windows(data.len()).position(|window| window == data).unwrap() + data.len();
    let patient = Patient::new(&bytes);
    for len in places(100..bytes.len(), 20).collect::<Vec<_>>().into_iter().rev() {
        patient.cut(len);
        let log = Log::open(&patient.path).unwrap();
        let expected: Vec<_> = all.iter().filter(|(_, data)| of(data) <= len).cloned().collect();
        let (found, _) = read(&log);
        assert_eq!(found, expected, "cut at {len}");
        check_output(&log, &patient.out(), &bytes, &found, &format!("cut at {len}"));
    }
}

#[test]
fn messages_of_a_compressed_chunk_cut_in_half_are_saved_block_by_block() {
    for compression in [mcap::Compression::Zstd, mcap::Compression::Lz4] {
        let bytes = log_of(WriteOptions::new().compression(Some(compression)), 100, 10_000, 10_000_000);
        let patient = Patient::new(&bytes);
        patient.cut(bytes.len() / 2);
        let log = Log::open(&patient.path).unwrap();
        let (all, _) = messages_before(&bytes, bytes.len());
        let (found, _) = read(&log);
        // Zstandard's blocks are of 128 kB, and the frames of LZ4 that the crate writes of 4 MB.
        assert!(
            found.len() >= 30 || matches!(compression, mcap::Compression::Lz4),
            "{compression:?}: {}",
            found.len()
        );
        assert!(all.starts_with(&found));
        assert!(log.damage().iter().any(|damage| damage.what.contains("saved")), "{:?}", log.damage());
        check_output(&log, &patient.out(), &bytes, &found, &format!("{compression:?}"));
    }
}

#[test]
fn message_indexes_that_the_last_chunk_lost_are_written_anew() {
    let options = WriteOptions::new().compression(None);
    let bytes = log_of(options, 12, 20, 150);
    // Within the second message index of the second chunk.
    let mut at = 8;
    let mut indexes = 0;
    while indexes < 5 {
        indexes += usize::from(bytes[at] == 0x07);
        at += first_record(&bytes[at..]).len();
    }
    let start = at;
    for cut in [start - 1, start, start + 3] {
        let patient = Patient::new(&bytes);
        patient.cut(cut);
        let log = Log::open(&patient.path).unwrap();
        assert_eq!(log.visibility(), Visibility::Indexed, "cut at {cut}");
        let (found, _) = read(&log);
        check_output(&log, &patient.out(), &bytes, &found, &format!("cut at {cut}"));
        let again = Log::open(patient.out()).unwrap();
        for chunk in &again.index().chunks {
            assert!(!chunk.message_index_offsets.is_empty(), "cut at {cut}");
        }
    }
}

/// Any byte may be wrong. Then it is noticed, or nothing that is read changes but what no checksum covers: payloads
/// and times of messages outside chunks, message indexes, the header's texts, and bytes that nothing reads.
#[test]
fn a_flipped_byte_is_noticed_or_harmless_and_costs_no_message_of_a_chunk_before_it() {
    for (name, bytes) in small_logs() {
        let mut patient = Patient::new(&bytes);
        let whole = Log::open(&patient.path).unwrap();
        let (all, _) = read(&whole);
        let loose = name == "without chunks";
        for at in places(0..bytes.len(), 40) {
            let place = format!("{name}, byte {at}");
            patient.set(at, bytes[at] ^ 0xff);
            match Log::open(&patient.path) {
                Err(LogError::NotMcap { .. } | LogError::Damaged { .. } | LogError::CutOff { .. }) => {
                    assert!(at < whole.index().data_start as usize, "{place}");
                }
                Err(other) => panic!("{place}: {other}"),
                Ok(log) => {
                    let (found, damaged) = read(&log);
                    let noticed = damaged > 0 || !log.damage().is_empty();
                    assert!(noticed || loose || found == all, "{place}: not noticed");
                    let (before, _) = messages_before(&bytes, at);
                    assert!(found.starts_with(&before), "{place}: {} of {}", found.len(), before.len());
                    let mut input = bytes.clone();
                    input[at] ^= 0xff;
                    check_flipped_output(&log, &patient.out(), &input, &before, &place);
                }
            }
            patient.set(at, bytes[at]);
        }
    }
}

/// What is before the flipped byte is in the output for a reader that goes from record to record, and what we read
/// of it is what we read of the input.
fn check_flipped_output(log: &Log, out: &Path, input: &[u8], before: &[(u32, Vec<u8>)], place: &str) {
    let output = append(log, out);
    let data_end = log.index().data_end as usize;
    assert!(output[..data_end] == input[..data_end], "{place}: the data section changed");
    let again = Log::open(out).unwrap_or_else(|e| panic!("{place}: {e}"));
    let (found, _) = read(&again);
    assert!(found.starts_with(before), "{place}: in the output");
    assert!(found.iter().any(|(_, data)| data == b"new"), "{place}: new messages");
}
