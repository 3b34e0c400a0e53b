//! Every log keeps every byte, record and message, and gains the new ones; and every reader that could read it
//! reads old and new alike.
//!
//! What is in a file is found here by a walk over raw records and by the mcap crate, never by the
//! reader under test. `independent_reader.py` and `independent_reader.js` beside this file do the same with the
//! libraries that notebooks and viewers use.

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

#[path = "round_trip/damage.rs"]
mod damage;
#[path = "round_trip/endings.rs"]
mod endings;
#[path = "round_trip/hostile.rs"]
mod hostile;
#[path = "round_trip/raw.rs"]
mod raw;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use trackfuse::log::{
    Appender, Compression, Destination, Log, LogError, NewChannel, NewMessage, NewMetadata, Visibility,
    Written,
};

use raw::{
    HEAD, MESSAGE, Told, first_record, raw_records, summary_start, told_by_index, told_by_index_of,
    told_by_stream, u32_at,
};

const TOPIC: &str = "/fused/track";

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
    appender.add_metadata(NewMetadata { name: "trackfuse:/fused".to_owned(), entries });
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

/// Says past the test runner, which would keep it to itself, what is not tested.
fn skipped(variable: &str) {
    let line = format!("skipped: {variable} is not set\n");
    let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
}

/// The folder of test logs, or `None` with a word on stderr.
fn test_data() -> Option<PathBuf> {
    let dir = std::env::var_os("TRACKFUSE_TEST_DATA").map(PathBuf::from);
    if dir.is_none() {
        skipped("TRACKFUSE_TEST_DATA");
    }
    dir
}

/// Appends to `path`, holds the output `out` against the input, and says how its messages are found.
fn check_round_trip(path: &Path, compression: Compression, out: &Path) -> Visibility {
    let name = path.display();
    let input = fs::read(path).unwrap();
    let log = Log::open(path).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(log.damage(), [], "{name}");

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

    append(&log, out, compression, false).unwrap_or_else(|e| panic!("{name}: {e}"));
    let output = fs::read(out).unwrap();
    check_bytes(&input, &output, &log, &name.to_string());

    // Messages, by both kinds of reader.
    let mut new = Vec::new();
    for i in 0..3_u64 {
        let time = 1_000 + i;
        new.push((TOPIC.to_owned(), i as u32, time, time, format!("{{\"i\":{i}}}").into_bytes()));
    }
    let with_new = |old: &[Told]| [old, &new].concat();
    assert_eq!(told_by_stream(&output), with_new(&old), "{name}");
    let sorted = |mut told: Vec<Told>| {
        told.sort();
        told
    };
    match log.visibility() {
        Visibility::Indexed => {
            assert_eq!(told_by_index(&output), sorted(with_new(&old)), "{name}: through the index");
        }
        Visibility::Partly { .. } => {
            // The crate reads no summary that leaves out a schema, and finds no name where it leaves out a channel.
            let before = mcap::Summary::read(&input)
                .map_or_else(|_| old.clone(), |_| told_by_index_of(&input, &output));
            assert_eq!(told_by_index(&output), sorted(with_new(&before)), "{name}: through the index");
        }
        Visibility::Scanned { summary, .. } => {
            assert_eq!(summary, summary_start(&input) > 0, "{name}");
            assert_eq!(summary, summary_start(&output) > 0, "{name}");
            assert!(!summary || told_by_index(&output).is_empty(), "{name}: an index hides old messages");
        }
    }
    if summary_start(&output) > 0 {
        check_summary(&output, with_new(&old).len() as u64, log.visibility(), &name.to_string());
    }

    // And by ourselves: the successor is a log like any other, but for its taken topic.
    let again = Log::open(out).unwrap();
    assert_eq!(again.damage(), [], "{name}: its successor");
    let taken = append(&again, &out.with_extension("again"), compression, false).unwrap_err();
    assert!(matches!(taken, LogError::TopicTaken { .. }) && taken.hint().is_some(), "{taken}");
    assert!(!out.with_extension("again").exists());
    log.visibility()
}

/// The data section and its records, every old record of the summary, and the CRCs by their definition.
fn check_bytes(input: &[u8], output: &[u8], log: &Log, name: &str) {
    let data_end = log.index().data_end as usize;
    assert!(output[..data_end] == input[..data_end], "{name}: the data section changed");

    // Every old record, one after the other, then ours.
    let (old_records, new_records) = (raw_records(input), raw_records(output));
    let kept = old_records.len() - 1;
    assert!(new_records[..kept] == old_records[..kept], "{name}: records changed");
    assert_eq!(new_records[kept..].iter().filter(|(opcode, _)| *opcode == MESSAGE).count(), 3, "{name}");

    let end = output.len() - 12;
    let footer = output.len() - 37;
    let start = if summary_start(output) > 0 { summary_start(output) } else { footer };
    if summary_start(input) > 0 {
        // Every old summary record, wherever it stands now; a chunk index that would hide messages is none.
        let hides = matches!(log.visibility(), Visibility::Scanned { .. });
        let mut rest = &input[summary_start(input)..input.len() - 37];
        while !rest.is_empty() {
            let record = first_record(rest);
            let remade = matches!(record[0], 0x0b | 0x0e) || hides && record[0] == 0x08;
            assert!(
                remade || output[start..].windows(record.len()).any(|window| window == record),
                "{name}: summary record {:#04x} is gone",
                record[0]
            );
            rest = &rest[record.len()..];
        }
    }

    let old_crc = u32_at(input, data_end + HEAD);
    let new_end = start - 13;
    let expected = if old_crc == 0 { 0 } else { crc32fast::hash(&output[..new_end]) };
    assert_eq!(u32_at(output, new_end + HEAD), expected, "{name}: data section CRC");
    assert_eq!(u32_at(output, end), crc32fast::hash(&output[start..end]), "{name}");
}

/// The summary's counts, and that its indexes lead to attachments and metadata.
fn check_summary(output: &[u8], messages: u64, visibility: Visibility, name: &str) {
    let summary = mcap::Summary::read(output).unwrap().unwrap();
    let statistics = summary.stats.as_ref().unwrap();
    assert_eq!(statistics.message_count, messages, "{name}");
    assert_eq!(statistics.channel_count as usize, summary.channels.len(), "{name}");
    assert_eq!(statistics.schema_count as usize, summary.schemas.len(), "{name}");
    if visibility == Visibility::Indexed {
        assert_eq!(statistics.chunk_count as usize, summary.chunk_indexes.len(), "{name}");
    }
    assert_eq!(statistics.attachment_count as usize, summary.attachment_indexes.len(), "{name}");
    assert_eq!(statistics.metadata_count as usize, summary.metadata_indexes.len(), "{name}");
    for attachment in &summary.attachment_indexes {
        mcap::read::attachment(output, attachment).unwrap();
    }
    for metadata in &summary.metadata_indexes {
        mcap::read::metadata(output, metadata).unwrap();
    }
}

#[test]
fn every_sample_log_keeps_its_bytes_and_messages() {
    let dir = tempfile::tempdir().unwrap();
    let mut logs = Vec::new();
    all_logs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs"), &mut logs);
    logs.retain(|path| !path.to_string_lossy().ends_with(".fused.mcap"));
    assert_eq!(logs.len(), 4, "{logs:?}");
    let out = dir.path().join("out.mcap");
    for path in logs {
        for compression in [Compression::Zstd, Compression::Lz4, Compression::None] {
            assert_eq!(check_round_trip(&path, compression, &out), Visibility::Indexed, "{}", path.display());
            fs::remove_file(&out).unwrap();
        }
    }
    assert_eq!(names_in(dir.path()), BTreeSet::new());
}

#[test]
fn every_test_log_keeps_its_bytes_and_messages_and_what_each_reader_sees_of_them() {
    let Some(data) = test_data() else { return };
    let mut logs = Vec::new();
    all_logs(&data, &mut logs);
    let dir = tempfile::tempdir().unwrap();
    let mut found: BTreeMap<&str, usize> = BTreeMap::new();
    let mut pairs = Vec::new();
    for (i, path) in logs.iter().enumerate() {
        let compression = [Compression::Zstd, Compression::Lz4, Compression::None][i % 3];
        let out = dir.path().join(format!("{i}.mcap"));
        let visibility = check_round_trip(path, compression, &out);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let (has, none) = (|what: &str| name.contains(what), Visibility::Indexed == visibility);
        if !none && path.to_string_lossy().contains("conformance") {
            assert!(!has("-mx") || !has("-ch"), "{name} could be indexed");
        }
        let kind = match visibility {
            Visibility::Indexed => "indexed",
            Visibility::Partly { .. } => "partly",
            Visibility::Scanned { .. } => "scanned",
        };
        *found.entry(kind).or_default() += 1;
        pairs.extend([path.clone(), out]);
    }
    println!("{found:?}");
    if data.join("mcap-conformance").exists() {
        assert!(found["indexed"] >= 255 && found.len() == 3, "{found:?}");
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/independent_reader");
    // The viewers' library finds its modules in NODE_PATH, where the other check that wants it does.
    let node = std::env::var_os("TRACKFUSE_TEST_VIEWER_CHECK").map(|_| "node".into());
    let python = std::env::var_os("TRACKFUSE_TEST_PYTHON");
    for (program, extension, of) in
        [(python, "py", "TRACKFUSE_TEST_PYTHON"), (node, "js", "TRACKFUSE_TEST_VIEWER_CHECK")]
    {
        let Some(program) = program else {
            skipped(of);
            continue;
        };
        let ran = Command::new(program).arg(script.with_extension(extension)).args(&pairs).output().unwrap();
        let said = String::from_utf8_lossy(&ran.stdout);
        assert!(ran.status.success(), "{said}\n{}", String::from_utf8_lossy(&ran.stderr));
        println!("{extension}: {said}");
    }
}
