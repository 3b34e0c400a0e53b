//! Every log that can be appended to keeps every byte, record and message, and gains the new ones.
//!
//! What is in a file is found here by a walk over raw records and by the mcap crate, never by the
//! reader under test. `independent_reader.py` beside this file does the same with another library.

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use trackfuse::log::{
    Appender, Compression, Destination, Log, LogError, NewChannel, NewMessage, NewMetadata, Obstacle, Written,
};

const TOPIC: &str = "/fused/track";
const HEAD: usize = 9;
const DATA_END: u8 = 0x0f;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;

/// Opcode and whole bytes of every record up to and with `DataEnd`, those of chunks in their place.
fn raw_records(file: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut found = Vec::new();
    let mut rest = &file[8..];
    while found.last().is_none_or(|(opcode, _)| *opcode != DATA_END) {
        let record = first_record(rest);
        rest = &rest[record.len()..];
        if record[0] != CHUNK {
            found.push((record[0], record.to_vec()));
            continue;
        }
        let body = &record[HEAD..];
        let uncompressed_size = u64_at(body, 16) as usize;
        let name_len = u32_at(body, 28) as usize;
        let (name, data) = (&body[32..32 + name_len], &body[32 + name_len + 8..]);
        let data = &data[..u64_at(body, 32 + name_len) as usize];
        let mut records = Vec::new();
        match name {
            b"" => records.extend_from_slice(data),
            b"zstd" => records = zstd::decode_all(data).unwrap(),
            b"lz4" => {
                std::io::copy(&mut lz4::Decoder::new(data).unwrap(), &mut records).unwrap();
            }
            other => panic!("{}", other.escape_ascii()),
        }
        assert_eq!(records.len(), uncompressed_size);
        let mut inside = &records[..];
        while !inside.is_empty() {
            let record = first_record(inside);
            inside = &inside[record.len()..];
            found.push((record[0], record.to_vec()));
        }
    }
    found
}

fn first_record(bytes: &[u8]) -> &[u8] {
    &bytes[..HEAD + u64_at(bytes, 1) as usize]
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// Where the summary begins, by the footer at the file's end.
fn summary_start(file: &[u8]) -> usize {
    u64_at(file, file.len() - 8 - 20) as usize
}

/// Topic, sequence, both times, payload.
type Told = (String, u32, u64, u64, Vec<u8>);

fn told_by_stream(file: &[u8]) -> Vec<Told> {
    let told = |m: mcap::Message| {
        (m.channel.topic.clone(), m.sequence, m.log_time, m.publish_time, m.data.into_owned())
    };
    mcap::MessageStream::new(file).unwrap().map(|message| told(message.unwrap())).collect()
}

/// As an indexed reader finds them: through the summary only.
fn told_by_index(file: &[u8]) -> Vec<Told> {
    use mcap::sans_io::{IndexedReadEvent, IndexedReader};
    let summary = mcap::Summary::read(file).unwrap().unwrap();
    let mut reader = IndexedReader::new(&summary).unwrap();
    let mut told = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            IndexedReadEvent::ReadChunkRequest { offset, length } => {
                reader.insert_chunk_record_data(offset, &file[offset as usize..][..length]).unwrap();
            }
            IndexedReadEvent::Message { header: h, data } => {
                let topic = summary.channels[&h.channel_id].topic.clone();
                told.push((topic, h.sequence, h.log_time, h.publish_time, data.to_vec()));
            }
        }
    }
    told.sort();
    told
}

fn new_channel(topic: &str) -> NewChannel {
    NewChannel::json(topic, "trackfuse.Test", r#"{"type":"object"}"#)
}

fn append(log: &Log, out: &Path, compression: Compression, force: bool) -> Result<Written, LogError> {
    let channels = [new_channel(TOPIC), new_channel("/fused/silent")];
    let mut appender =
        Appender::begin(log, &Destination::New { out: out.to_owned(), force }, &channels, compression)?;
    for i in 0..3_u64 {
        let data = format!("{{\"i\":{i}}}");
        appender.write(NewMessage { channel: 0, time_ns: 1_000 + i, data: data.as_bytes() })?;
    }
    let entries = BTreeMap::from([("version".to_owned(), "0".to_owned())]);
    appender.write_metadata(&NewMetadata { name: "trackfuse:/fused".to_owned(), entries })?;
    appender.finish()
}

fn names_in(dir: &Path) -> BTreeSet<String> {
    fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

fn all_logs(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all_logs(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "mcap") {
            found.push(path);
        }
    }
    found.sort();
}

/// The folder of test logs, or `None` with a word on stderr.
fn test_data() -> Option<PathBuf> {
    let dir = std::env::var_os("TRACKFUSE_TEST_DATA").map(PathBuf::from);
    if dir.is_none() {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
    }
    dir
}

/// Appends to `path` and holds the output against the input. The answer is what forbade it, if anything.
fn check_round_trip(path: &Path, compression: Compression, dir: &Path) -> Option<LogError> {
    let name = path.display();
    let input = fs::read(path).unwrap();
    let out = dir.join("out.mcap");
    let log = Log::open(path).unwrap_or_else(|e| panic!("{name}: {e}"));

    let channels = log.index().channels.keys().copied().collect();
    let mut ours = Vec::new();
    log.for_each_message(&channels, |m| {
        let topic = log.index().channels[&m.channel_id].topic.clone();
        ours.push((topic, m.sequence, m.log_time, m.publish_time, m.data.to_vec()));
        Ok::<_, LogError>(())
    })
    .unwrap();
    let old = told_by_stream(&input);
    assert_eq!(ours, old, "{name}");

    if let Err(refused) = append(&log, &out, compression, false) {
        assert_eq!(names_in(dir).len(), 0, "{name} left something behind");
        return Some(refused);
    }
    let output = fs::read(&out).unwrap();
    let data_end = log.index().data_end as usize;
    assert!(output[..data_end] == input[..data_end], "{name}: the data section changed");

    // Every old record, one after the other, then ours.
    let (old_records, new_records) = (raw_records(&input), raw_records(&output));
    let kept = old_records.len() - 1;
    assert!(new_records[..kept] == old_records[..kept], "{name}: records changed");
    assert_eq!(new_records[kept..].iter().filter(|(opcode, _)| *opcode == MESSAGE).count(), 3, "{name}");

    // Every old summary record, wherever it stands now.
    let new_summary = &output[summary_start(&output)..];
    if summary_start(&input) > 0 {
        let mut rest = &input[summary_start(&input)..input.len() - 37];
        while !rest.is_empty() {
            let record = first_record(rest);
            let remade = matches!(record[0], 0x0b | 0x0e);
            assert!(
                remade || new_summary.windows(record.len()).any(|window| window == record),
                "{name}: summary record {:#04x} is gone",
                record[0]
            );
            rest = &rest[record.len()..];
        }
    }

    // CRCs, by their definition.
    let old_crc = u32_at(&input, data_end + HEAD);
    let new_end = summary_start(&output) - 13;
    let expected = if old_crc == 0 { 0 } else { crc32fast::hash(&output[..new_end]) };
    assert_eq!(u32_at(&output, new_end + HEAD), expected, "{name}: data section CRC");
    let end = output.len() - 12;
    assert_eq!(u32_at(&output, end), crc32fast::hash(&output[summary_start(&output)..end]), "{name}");

    // Messages, by both kinds of reader.
    let mut expected = old;
    for i in 0..3_u64 {
        let time = 1_000 + i;
        expected.push((TOPIC.to_owned(), i as u32, time, time, format!("{{\"i\":{i}}}").into_bytes()));
    }
    assert_eq!(told_by_stream(&output), expected, "{name}");
    expected.sort();
    assert_eq!(told_by_index(&output), expected, "{name}: through the index");

    let summary = mcap::Summary::read(&output).unwrap().unwrap();
    let statistics = summary.stats.as_ref().unwrap();
    assert_eq!(statistics.message_count, expected.len() as u64, "{name}");
    assert_eq!(statistics.channel_count as usize, summary.channels.len(), "{name}");
    assert_eq!(statistics.schema_count as usize, summary.schemas.len(), "{name}");
    assert_eq!(statistics.chunk_count as usize, summary.chunk_indexes.len(), "{name}");
    assert_eq!(statistics.attachment_count as usize, summary.attachment_indexes.len(), "{name}");
    assert_eq!(statistics.metadata_count as usize, summary.metadata_indexes.len(), "{name}");
    for attachment in &summary.attachment_indexes {
        mcap::read::attachment(&output, attachment).unwrap();
    }
    for metadata in &summary.metadata_indexes {
        mcap::read::metadata(&output, metadata).unwrap();
    }

    // And by ourselves: the successor is a log like any other, but for its taken topic.
    let again = Log::open(&out).unwrap();
    let taken = append(&again, &dir.join("again.mcap"), compression, false).unwrap_err();
    assert!(matches!(taken, LogError::TopicTaken { .. }) && taken.hint().is_some(), "{taken}");
    assert_eq!(names_in(dir), BTreeSet::from(["out.mcap".to_owned()]));
    fs::remove_file(&out).unwrap();
    None
}

#[test]
fn every_sample_log_keeps_its_bytes_and_messages() {
    let dir = tempfile::tempdir().unwrap();
    let mut logs = Vec::new();
    all_logs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs"), &mut logs);
    logs.retain(|path| !path.to_string_lossy().ends_with(".fused.mcap"));
    assert_eq!(logs.len(), 3, "{logs:?}");
    for path in logs {
        for compression in [Compression::Zstd, Compression::Lz4, Compression::None] {
            assert!(check_round_trip(&path, compression, dir.path()).is_none(), "{}", path.display());
        }
    }
}

#[test]
fn every_test_log_keeps_its_bytes_and_messages_or_is_refused_with_a_reason() {
    let Some(data) = test_data() else { return };
    let mut logs = Vec::new();
    all_logs(&data, &mut logs);
    let dir = tempfile::tempdir().unwrap();
    let mut kept = 0;
    let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, path) in logs.iter().enumerate() {
        let compression = [Compression::Zstd, Compression::Lz4, Compression::None][i % 3];
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let chunked = name.contains("-ch-") || name.contains("-ch.");
        let indexed = name.contains("-mx");
        match check_round_trip(path, compression, dir.path()) {
            None => kept += 1,
            Some(LogError::NotAppendable { obstacle: Obstacle::LooseMessages { .. }, .. }) => {
                assert!(!chunked, "{name}");
                *refused.entry("loose messages").or_default() += 1;
            }
            Some(LogError::NotAppendable { obstacle: Obstacle::NoMessageIndex { .. }, .. }) => {
                assert!(chunked && !indexed, "{name}");
                *refused.entry("no message index").or_default() += 1;
            }
            Some(other) => panic!("{name}: {other}"),
        }
    }
    println!("{kept} logs round-trip, refused: {refused:?}");
    // What round-tripped when this was written; a log that is refused must not become more common.
    assert!(kept >= 255, "only {kept} of {} logs round-trip", logs.len());
}
