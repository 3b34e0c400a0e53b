//! Outputs beside, over and instead of others, and what is in them.

use std::{fs, path::Path};

use super::super::fixture::{PRIVATE, chunked, log, names_in, on_disk, records};
use super::*;

fn channel(topic: &str) -> NewChannel {
    NewChannel::json(topic, "trackfuse.Test", "{}")
}

fn to(out: &Path, force: bool) -> Destination {
    Destination::New { out: out.to_owned(), force }
}

fn append(log: &Log, out: &Path, force: bool, compression: Compression) -> Result<Written, LogError> {
    let mut appender = Appender::begin(log, &to(out, force), &[channel("/fused/track")], compression)?;
    for i in 0..100_u64 {
        let data = i.to_string();
        appender.write(NewMessage { channel: 0, time_ns: i * 1_000_000_000, data: data.as_bytes() })?;
    }
    appender.finish()
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let (dir, path) = on_disk(&log(chunked()));
    let log = Log::open(&path).unwrap();
    for compression in [Compression::Zstd, Compression::Lz4, Compression::None] {
        let outs = ["1", "2"].map(|name| dir.path().join(name));
        let [a, b] = outs.map(|out| {
            append(&log, &out, true, compression).unwrap();
            fs::read(out).unwrap()
        });
        assert!(a == b, "{compression:?}");
    }
}

#[test]
fn an_existing_output_is_refused_and_kept_unless_forced() {
    let (dir, path) = on_disk(&log(chunked()));
    let log = Log::open(&path).unwrap();
    let out = dir.path().join("out.mcap");
    fs::write(&out, "precious").unwrap();
    // At the start, not after an hour of copying.
    let refused = Appender::begin(&log, &Destination::new_file(&out), &[], Compression::Zstd).unwrap_err();
    assert!(matches!(refused, LogError::OutputExists { .. }) && refused.hint().is_some(), "{refused}");
    assert_eq!(fs::read(&out).unwrap(), b"precious");
    assert_eq!(names_in(dir.path()), ["in.mcap", "out.mcap"]);
    let written = append(&log, &out, true, Compression::Zstd).unwrap();
    assert_eq!((written.len, written.messages), (fs::metadata(&out).unwrap().len(), 100));
}

#[test]
fn an_output_made_by_another_meanwhile_is_kept() {
    let (dir, path) = on_disk(&log(chunked()));
    let log = Log::open(&path).unwrap();
    let out = dir.path().join("out.mcap");
    let appender = Appender::begin(&log, &Destination::new_file(&out), &[], Compression::Zstd).unwrap();
    fs::write(&out, "precious").unwrap();
    assert!(matches!(appender.finish(), Err(LogError::OutputExists { .. })));
    assert_eq!(fs::read(&out).unwrap(), b"precious");
    assert_eq!(names_in(dir.path()), ["in.mcap", "out.mcap"]);
}

#[cfg(unix)]
#[test]
fn the_input_is_never_the_output_through_any_link() {
    let (dir, path) = on_disk(&log(chunked()));
    let log = Log::open(&path).unwrap();
    let [soft, hard] = ["soft", "hard"].map(|name| dir.path().join(name));
    std::os::unix::fs::symlink(&path, &soft).unwrap();
    fs::hard_link(&path, &hard).unwrap();
    for out in [&path, &soft, &hard] {
        let refused = append(&log, out, true, Compression::Zstd);
        assert!(matches!(refused, Err(LogError::OutputIsInput { .. })), "{out:?}: {refused:?}");
    }
    assert_eq!(names_in(dir.path()), ["hard", "in.mcap", "soft"]);
}

#[test]
fn nothing_remains_of_an_output_that_was_not_finished() {
    let (dir, path) = on_disk(&log(chunked()));
    let log = Log::open(&path).unwrap();
    let out = dir.path().join("out.mcap");
    let begin = |out: &Path, channels: &[NewChannel]| {
        Appender::begin(&log, &Destination::new_file(out), channels, Compression::Zstd)
    };
    let mut given_up = begin(&out, &[channel("/x")]).unwrap();
    given_up.write(NewMessage { channel: 0, time_ns: 1, data: b"1" }).unwrap();
    drop(given_up);
    assert!(matches!(begin(&out, &[channel("/a")]), Err(LogError::TopicTaken { .. })));
    assert!(matches!(begin(&out, &[channel("/x"), channel("/x")]), Err(LogError::TopicTaken { .. })));
    assert!(matches!(begin(&dir.path().join("no/such"), &[]), Err(LogError::Write { .. })));
    assert_eq!(names_in(dir.path()), ["in.mcap"]);
}

#[test]
fn records_of_others_and_a_missing_crc_stay_as_they_are() {
    let mut bytes = log(chunked().calculate_data_section_crc(false).calculate_summary_section_crc(false));
    // A record of somebody's own in the summary too, in place of the summary offsets.
    let (_, offsets) = records(&bytes).into_iter().find(|&(opcode, _)| opcode == op::SUMMARY_OFFSET).unwrap();
    let private = encode_bytes(PRIVATE + 1, &[b"in the summary"]);
    bytes.splice(offsets..offsets, private.iter().copied());
    let offset_start = bytes.len() - 8 - 12;
    bytes[offset_start..offset_start + 8].copy_from_slice(&((offsets + private.len()) as u64).to_le_bytes());

    let (dir, path) = on_disk(&bytes);
    let log = Log::open(&path).unwrap();
    let out = dir.path().join("out.mcap");
    append(&log, &out, false, Compression::Zstd).unwrap();
    let output = fs::read(&out).unwrap();
    let found = records(&output);
    assert!(found.iter().any(|&(opcode, _)| opcode == PRIVATE));
    let &(_, at) = found.iter().find(|&&(opcode, _)| opcode == PRIVATE + 1).unwrap();
    assert_eq!(output[at..at + private.len()], private);
    assert_eq!(Log::open(&out).unwrap().index().data_section_crc, None);
}
