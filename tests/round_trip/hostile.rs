//! Logs that were made to do harm, and the known holes of the mcap crate: each is an error or damage that is named,
//! costs no more memory than the limit, and stands in nobody's way who reads the rest.

use std::{fs, path::PathBuf};

use trackfuse::log::{Appender, Compression, Destination, Log, LogError, NewMessage, ReadOptions};

use super::new_channel;
use super::raw::told_by_stream;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

pub(super) fn record(opcode: u8, body: &[&[u8]]) -> Vec<u8> {
    let body = body.concat();
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), &body].concat()
}

pub(super) fn text(text: &[u8]) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text].concat()
}

pub(super) fn channel(id: u16, schema: u16, topic: &[u8]) -> Vec<u8> {
    let (id, schema) = (id.to_le_bytes(), schema.to_le_bytes());
    record(0x04, &[&id, &schema, &text(topic), &text(b"json"), &text(b"")])
}

pub(super) fn message(channel: u16, time: u64) -> Vec<u8> {
    let time = time.to_le_bytes();
    record(0x05, &[&channel.to_le_bytes(), &[0; 4], &time, &time, b"{}"])
}

/// A chunk that claims `size` bytes of records.
pub(super) fn chunk(size: u64, compression: &[u8], data: &[u8]) -> Vec<u8> {
    let len = (data.len() as u64).to_le_bytes();
    record(0x06, &[&[0; 16], &size.to_le_bytes(), &[0; 4], &text(compression), &len, data])
}

/// A log of these records in the data section, and no summary.
pub(super) fn log_of(records: &[Vec<u8>]) -> Vec<u8> {
    let header = record(0x01, &[&text(b""), &text(b"")]);
    let end = [record(0x0f, &[&[0; 4]]), record(0x02, &[&[0; 20]])].concat();
    [MAGIC, &header, &records.concat(), &end, MAGIC].concat()
}

pub(super) struct Opened {
    pub(super) dir: tempfile::TempDir,
    pub(super) log: Log,
    bytes: Vec<u8>,
}

pub(super) fn opened(bytes: Vec<u8>) -> Opened {
    opened_with(bytes, ReadOptions::default()).unwrap()
}

pub(super) fn opened_with(bytes: Vec<u8>, options: ReadOptions) -> Result<Opened, LogError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("in.mcap");
    fs::write(&path, &bytes).unwrap();
    Ok(Opened { log: Log::open_with(path, options)?, dir, bytes })
}

impl Opened {
    /// Times of all messages that can be read, and how many parts can't.
    pub(super) fn times(&self) -> (Vec<u64>, usize) {
        let mut times = Vec::new();
        let all = (0..=u16::MAX).collect();
        let read = self.log.for_each_message_of_excerpt(&all, u64::MAX, |m| times.push(m.log_time));
        (times, read.damaged.len())
    }

    pub(super) fn said(&self) -> String {
        self.log.damage().iter().map(|damage| format!("{damage}\n")).collect()
    }

    pub(super) fn append(&self) -> PathBuf {
        let out = self.dir.path().join("out.mcap");
        let to = Destination::new_file(&out);
        let mut appender =
            Appender::begin(&self.log, &to, &[new_channel("/new")], Compression::None).unwrap();
        appender.write(NewMessage { channel: 0, time_ns: 9, data: b"{}" }).unwrap();
        appender.finish().unwrap();
        let output = fs::read(&out).unwrap();
        let data_end = self.log.index().data_end as usize;
        assert!(output[..data_end] == self.bytes[..data_end]);
        out
    }
}

/// The most memory that this process ever had, bytes.
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kb| kb * 1024)
}

#[test]
fn the_crate_panics_or_aborts_at_record_lengths_and_this_reads_what_stands_before() {
    for claim in [u64::MAX, 1 << 62, 1 << 40] {
        let mut long = message(1, 2);
        long[1..9].copy_from_slice(&claim.to_le_bytes());
        let log = opened(log_of(&[channel(1, 0, b"/a"), message(1, 1), long]));
        assert_eq!(log.times(), (vec![1], 0));
        assert!(log.said().contains(&claim.to_string()), "{}", log.said());
        log.append();
    }
}

#[test]
fn the_crate_allocates_what_a_chunk_claims_and_this_does_not() {
    for (compression, data) in [(&b""[..], &b"abc"[..]), (b"zstd", &[0x28, 0xb5, 0x2f, 0xfd]), (b"lz4", b"")]
    {
        for claim in [1_u64 << 44, 1 << 62, u64::MAX] {
            let records =
                [channel(1, 0, b"/a"), message(1, 1), chunk(claim, compression, data), message(1, 2)];
            let log = opened(log_of(&records));
            let (times, _) = log.times();
            assert_eq!(times, [1, 2]);
            assert!(
                log.said().contains(&format!("claims {claim} bytes, more than the limit")),
                "{}",
                log.said()
            );
            log.append();
        }
    }
}

#[test]
fn the_crate_unpacks_a_bomb_and_this_stops_at_what_the_chunk_claims() {
    // 1 GiB of zeros in some 33 kB.
    let mut packed = Vec::new();
    let zeros = std::io::Read::take(std::io::repeat(0), 1 << 30);
    zstd::stream::copy_encode(zeros, &mut packed, 3).unwrap();
    assert!(packed.len() < 200_000, "{}", packed.len());
    let before = peak_memory();
    let log = opened(log_of(&[channel(1, 0, b"/a"), message(1, 1), chunk(100, b"zstd", &packed)]));
    assert_eq!(log.times().0, [1]);
    assert!(log.said().contains("the chunk holds more than the 100 bytes it claims"), "{}", log.said());
    // One that claims what it holds is held against the limit, which the caller sets.
    let honest = log_of(&[channel(1, 0, b"/a"), message(1, 1), chunk(1 << 30, b"zstd", &packed)]);
    let path = log.dir.path().join("in.mcap");
    fs::write(&path, honest).unwrap();
    let log = Log::open_with(&path, ReadOptions { memory_limit: 1 << 20, ..ReadOptions::default() }).unwrap();
    assert!(log.damage()[0].what.contains("more than the limit of 1048576"), "{:?}", log.damage());
    if let Some((before, after)) = before.zip(peak_memory()) {
        assert!(after < before + (300 << 20), "{} MB", (after - before) >> 20);
    }
}

#[test]
fn the_crate_panics_at_a_short_attachment_and_this_never_indexes_one() {
    let fixed = |data: u64| [&[0; 16][..], &text(b"name"), &text(b"type"), &data.to_le_bytes()].concat();
    for body in [vec![], vec![0; 3], vec![0xff; 20], fixed(0), fixed(1 << 40), fixed(u64::MAX)] {
        let log = opened(log_of(&[channel(1, 0, b"/a"), message(1, 1), record(0x09, &[&body])]));
        assert_eq!(log.times(), (vec![1], 0));
        assert_eq!(log.log.index().attachments, []);
        assert!(log.said().contains("attachment"), "{}", log.said());
        log.append();
    }
}

#[test]
fn the_crate_stops_at_channels_that_contradict_or_miss_something_and_this_reads_on() {
    let twice = [channel(1, 0, b"/a"), message(1, 1), channel(1, 0, b"/other"), message(1, 2)];
    let unknown_channel = [message(7, 1), channel(1, 0, b"/a"), message(1, 2)];
    let unknown_schema = [channel(1, 9, b"/a"), message(1, 1), message(1, 2)];
    for records in [&twice[..], &unknown_channel, &unknown_schema] {
        let log = opened(log_of(records));
        assert_eq!(log.times(), (vec![1, 2], 0));
        let again = Log::open(log.append()).unwrap();
        let first = again.index().channels.values().find(|channel| channel.id == 1).unwrap();
        assert_eq!(first.topic, "/a");
        // An id that a message used and nothing defines isn't given to a new channel.
        let new = again.index().channels.values().find(|channel| channel.topic == "/new").unwrap();
        assert!(new.id != 7 && new.schema_id != 9, "{new:?}");
    }
}

#[test]
fn names_that_are_no_utf_8_are_named_and_lengths_in_records_are_not_believed() {
    let mut long_name = channel(2, 0, b"/b");
    long_name[9 + 4..9 + 8].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut long_map = channel(2, 0, b"/b");
    let map = long_map.len() - 4;
    long_map[map..].copy_from_slice(&u32::MAX.to_le_bytes());
    let schema = record(0x03, &[&[3, 0], &text(b"S"), &text(b"e"), &[0xff; 4]]);
    for bad in [channel(2, 0, b"/\xff\xfe"), long_name, long_map, schema, record(0x0c, &[&[0xff; 4]])] {
        let log = opened(log_of(&[channel(1, 0, b"/a"), message(1, 1), bad, message(1, 2)]));
        assert_eq!(log.times().0, [1, 2]);
        assert_eq!(log.log.damage().len(), 1, "{}", log.said());
        log.append();
    }
}

#[test]
fn nothing_but_damage_is_opened_and_added_to() {
    let garbage: Vec<u8> = (0..5_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let whole = log_of(&[channel(1, 0, b"/a"), message(1, 1)]);
    let header_end = 8 + 9 + 8;
    let log = opened([&whole[..header_end], &garbage].concat());
    assert_eq!(log.log.index().data_end as usize, header_end, "{}", log.said());
    let out = fs::read(log.append()).unwrap();
    assert_eq!(told_by_stream(&out).len(), 1);
    let strict = log.log.ensure_whole().unwrap_err();
    assert!(matches!(strict, LogError::NotWhole { .. }) && strict.hint().is_some());
}

/// A schema whose definition has `len` bytes.
fn schema(id: u16, len: usize) -> Vec<u8> {
    record(0x03, &[&id.to_le_bytes(), &text(b"S"), &text(b"e"), &text(&vec![0; len])])
}

#[test]
fn definitions_that_are_kept_count_together_against_the_limit_and_repeated_ones_once() {
    let options = ReadOptions { memory_limit: 100_000, ..ReadOptions::default() };
    let packed = |id| {
        let schema = schema(id, 70_000);
        chunk(schema.len() as u64, b"zstd", &zstd::encode_all(&schema[..], 3).unwrap())
    };
    let many = log_of(&(1..=40).map(packed).collect::<Vec<_>>());
    assert!(many.len() < 12_000, "{}", many.len());
    let loose = log_of(&(1..=40).map(|id| schema(id, 70_000)).collect::<Vec<_>>());
    for bytes in [many, loose] {
        match opened_with(bytes, options.clone()).map(|opened| opened.said()) {
            Err(error @ LogError::TooLarge { .. }) => assert!(error.hint().is_some()),
            other => panic!("{other:?}"),
        }
    }
    let repeated = [vec![schema(1, 70_000); 40], vec![channel(1, 1, b"/a"), message(1, 1)]].concat();
    let log = opened_with(log_of(&repeated), options.clone()).unwrap();
    assert_eq!((log.log.index().schemas.len(), log.times()), (1, (vec![1], 0)));
    let repeated = log_of(&vec![packed(1); 40]);
    assert_eq!(opened_with(repeated, options).unwrap().log.index().schemas.len(), 1);
}

#[test]
fn sixty_thousand_chunks_that_cannot_be_decoded_are_passed_over() {
    let mut bad = chunk(3, b"", b"abc");
    // its checksum
    bad[9 + 24] = 1;
    let bytes = log_of(&[channel(1, 0, b"/a"), bad.repeat(60_000)]);
    let log = opened(bytes);
    assert!(log.log.index().chunks.is_empty() && log.said().contains("the chunk's CRC"));
}
