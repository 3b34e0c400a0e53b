//! Logs that are whole, leave things out, or are damaged.

use std::{
    collections::BTreeSet,
    panic::catch_unwind,
    sync::{Arc, Mutex},
};

use super::super::fixture::{PRIVATE, chunked, log, on_disk, records, without_summary_crc};
use super::super::index::LeftOut;
use super::super::{Appender, Compression, Destination, Observer, Work};
use super::*;

fn open(bytes: &[u8]) -> Result<Log, LogError> {
    let (_dir, path) = on_disk(bytes);
    Log::open(path)
}

/// Opens, reads and appends; what fails must do so with an error.
fn use_in_every_way(bytes: &[u8]) -> Result<(), LogError> {
    let (dir, path) = on_disk(bytes);
    let log = Log::open(path)?;
    let channels: BTreeSet<u16> = (0..4).collect();
    log.for_each_log_time(u64::MAX, |_, _| {});
    log.for_each_message_of_excerpt(&channels, 1, |_| {});
    if let Some(error) = log.first_messages(&channels).1.pop() {
        return Err(error);
    }
    log.for_each_message(&channels, |_| Ok::<_, LogError>(()))?;
    let to = Destination::new_file(dir.path().join("out.mcap"));
    Appender::begin(&log, &to, &[], Compression::None)?.finish()?;
    Ok(())
}

#[test]
fn a_file_that_is_no_mcap_says_what_it_is() {
    let not_mcap = |bytes: &[u8]| match open(bytes) {
        Err(e @ LogError::NotMcap { .. }) => e.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(not_mcap(b"").ends_with("the file is empty"));
    assert!(not_mcap(b"#ROSBAG V2.0\n").contains("#ROSBAG "), "{}", not_mcap(b"#ROSBAG V2.0\n"));
    assert!(not_mcap(b"\x89MCAP9\r\n").contains("MCAP9"));
    assert!(matches!(Log::open("/nowhere/at.all"), Err(LogError::Open { .. })));
    assert!(matches!(Log::open("/"), Err(LogError::Open { .. })));
}

#[test]
fn a_log_cut_off_within_its_header_is_refused_and_anywhere_else_not() {
    let bytes = log(chunked());
    let data_start = open(&bytes).unwrap().index().data_start as usize;
    for len in 1..bytes.len() {
        match open(&bytes[..len]) {
            Err(e @ (LogError::CutOff { .. } | LogError::Damaged { .. })) => {
                assert!(len < data_start && e.hint().is_some(), "cut at {len}: {e}");
            }
            Ok(log) => {
                assert!(len >= data_start && !log.damage().is_empty(), "cut at {len}");
                assert!(matches!(log.ensure_whole(), Err(LogError::NotWhole { .. })));
            }
            Err(other) => panic!("cut at {len}: {other}"),
        }
    }
}

#[test]
fn a_flipped_byte_behind_the_data_section_is_noticed_and_none_anywhere_panics() {
    let bytes = log(chunked());
    let data_end = open(&bytes).unwrap().index().data_end as usize;
    for at in 0..bytes.len() {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0xff;
        let result = catch_unwind(|| use_in_every_way(&bytes)).unwrap();
        // The data section's CRC is no part of what is checked on opening.
        let unchecked = data_end + 9..data_end + 13;
        let noticed = result.is_err() || !open(&bytes).unwrap().damage().is_empty();
        assert!(at < data_end || unchecked.contains(&at) || noticed, "byte {at}");
    }
}

#[test]
fn a_length_beyond_the_file_is_an_error_wherever_it_stands() {
    for (options, every) in
        [(chunked(), 1), (chunked().use_chunks(false), 7), (chunked().emit_chunk_indexes(false), 7)]
    {
        let bytes = without_summary_crc(log(options));
        for at in (8..bytes.len() - 16).step_by(every) {
            for claim in [1_u64 << 62, 1 << 40] {
                let mut bytes = bytes.clone();
                bytes[at..at + 8].copy_from_slice(&claim.to_le_bytes());
                // Many of these hit a field that may hold anything; none may panic or abort.
                let _ = catch_unwind(|| use_in_every_way(&bytes)).unwrap();
            }
        }
        for (opcode, at) in records(&bytes) {
            let mut bytes = bytes.clone();
            bytes[at + 1..at + 9].copy_from_slice(&(1_u64 << 62).to_le_bytes());
            let noticed = use_in_every_way(&bytes).is_err() || !open(&bytes).unwrap().damage().is_empty();
            assert!(noticed || opcode == op::SUMMARY_OFFSET, "{opcode:#x}");
        }
    }
}

#[test]
fn a_summary_that_leaves_things_out_is_completed() {
    let whole = open(&log(chunked())).unwrap();
    let bare = open(&log(chunked().emit_summary_records(false).emit_summary_offsets(false))).unwrap();
    assert_eq!(bare.index().summary_start, None);
    assert_eq!((bare.visibility(), bare.damage()), (Visibility::Indexed, &[][..]));
    let (found, expected) = (bare.index(), whole.index());
    assert_eq!(found.schemas, expected.schemas);
    assert_eq!(found.channels, expected.channels);
    assert_eq!(found.chunks, expected.chunks);
    assert_eq!(found.attachments, expected.attachments);
    assert_eq!(found.metadata, expected.metadata);
    assert_eq!(found.statistics, expected.statistics);
    assert_eq!(expected.left_out, LeftOut::default());
    let counted = LeftOut {
        schemas: 1,
        channels: 2,
        chunks: expected.chunks.len(),
        attachments: 1,
        metadata: 1,
        statistics: true,
        scanned: true,
    };
    assert_eq!(found.left_out, counted);
}

#[test]
fn messages_outside_chunks_can_be_read_and_no_chunk_index_will_hide_them() {
    for summary in [true, false] {
        let options = chunked().use_chunks(false);
        let options = if summary { options } else { options.emit_summary_records(false) };
        let log = open(&log(options.emit_summary_offsets(summary))).unwrap();
        let mut count = 0;
        log.for_each_message(&log.index().channels.keys().copied().collect(), |_| {
            count += 1;
            Ok::<_, LogError>(())
        })
        .unwrap();
        assert_eq!((count, log.damage()), (20, &[][..]));
        let Visibility::Scanned { summary: found, .. } = log.visibility() else { panic!("indexed") };
        assert_eq!(found, summary);
    }
}

#[test]
fn chunks_without_a_message_index_stay_as_visible_as_they_were() {
    let log = |options: mcap::WriteOptions| open(&log(options.emit_message_indexes(false))).unwrap();
    assert!(matches!(log(chunked()).visibility(), Visibility::Partly { .. }));
    let scanned = log(chunked().emit_chunk_indexes(false)).visibility();
    assert!(matches!(scanned, Visibility::Scanned { summary: true, .. }), "{scanned:?}");
    assert!(scanned.note().unwrap().contains("must scan"));
}

#[test]
fn bytes_that_are_no_record_are_damage_and_the_rest_can_be_used() {
    let mut bytes = log(chunked());
    let (_, private) = records(&bytes).into_iter().find(|(opcode, _)| *opcode == PRIVATE).unwrap();
    bytes[private] = 0;
    let log = open(&bytes).unwrap();
    let [Damage { offset, what }] = log.damage() else { panic!("{:?}", log.damage()) };
    assert_eq!(*offset, private as u64);
    assert!(what.contains("no record"), "{what}");
    assert_eq!(log.first_messages(&[1, 2].into()).0.len(), 2);
    assert_eq!(log.visibility(), Visibility::Indexed);
}

#[test]
fn a_summary_with_a_wrong_checksum_is_not_used() {
    let bytes = log(chunked());
    let whole = open(&bytes).unwrap();
    let mut flipped = bytes.clone();
    // The name of a topic, which would be believed.
    let at = bytes.windows(2).rposition(|window| window == b"/b").unwrap();
    assert!(at as u64 > whole.index().summary_start.unwrap());
    flipped[at + 1] = b'x';
    let log = open(&flipped).unwrap();
    assert_eq!(log.index().channels, whole.index().channels);
    assert_eq!(log.index().chunks, whole.index().chunks);
    assert_eq!(log.index().statistics, whole.index().statistics);
    assert!(log.index().summary_distrusted && log.index().summary_start.is_none());
    assert!(log.damage()[0].what.contains("the summary's CRC is"), "{:?}", log.damage());
}

#[test]
fn garbage_behind_the_end_is_damage_and_the_summary_is_used_all_the_same() {
    let mut bytes = log(chunked());
    let len = bytes.len() as u64;
    let whole = open(&bytes).unwrap();
    bytes.extend(b"some bytes");
    let log = open(&bytes).unwrap();
    let expected = Damage { offset: len, what: "10 bytes stand behind the log's end".to_owned() };
    assert_eq!(log.damage(), [expected]);
    assert!(!log.index().summary_distrusted && !log.index().left_out.scanned);
    assert_eq!(log.index().data_end, whole.index().data_end);
}

#[test]
fn statistics_that_are_wrong_are_counted_anew() {
    for (field, what) in [(8 + 2, "messages"), (8 + 2 + 4 + 4 + 4, "chunks")] {
        // Only a scan tells that the number of messages is wrong, and only what is missing makes one.
        let options = chunked().repeat_channels(field != 10);
        let bytes = without_summary_crc(log(options));
        let whole = open(&bytes).unwrap();
        let (_, at) = records(&bytes).into_iter().find(|(opcode, _)| *opcode == op::STATISTICS).unwrap();
        let mut wrong = bytes.clone();
        wrong[at + 9 + if field == 10 { 0 } else { field }] += 1;
        let log = open(&wrong).unwrap();
        assert_eq!(log.index().statistics, whole.index().statistics);
        assert!(log.damage()[0].what.contains(what), "{:?}", log.damage());
    }
}

#[test]
fn an_undecodable_chunk_is_left_out_when_all_is_scanned() {
    let mut bytes = log(chunked().emit_statistics(false));
    let first = open(&bytes).unwrap().index().chunks[0].clone();
    let payload = bytes.windows(7).position(|window| window == b"{\"i\":0}").unwrap();
    bytes[payload + 5] = b'7';
    let log = open(&bytes).unwrap();
    let [Damage { offset, what }] = log.damage() else { panic!("{:?}", log.damage()) };
    assert_eq!(*offset, first.chunk_start_offset);
    assert!(what.contains("CRC"), "{what}");
    let index = log.index();
    assert_eq!((index.undecodable, index.chunks.contains(&first)), (1, false));
    let mut count = 0;
    log.for_each_message(&[1, 2].into(), |_| {
        count += 1;
        Ok::<_, LogError>(())
    })
    .unwrap();
    assert_eq!(count, index.statistics.as_ref().unwrap().message_count);
    assert_eq!(log.visibility(), Visibility::Indexed);
}

#[test]
fn a_chunk_indexed_twice_is_damage() {
    let (_dir, path) = on_disk(&log(chunked()));
    let log_file = Log::open(&path).unwrap();
    let mut index = log_file.index().clone();
    let twice = index.chunks[0].clone();
    index.summary.push(SummaryRecord {
        opcode: op::CHUNK_INDEX,
        bytes: super::super::summary::encode(op::CHUNK_INDEX, &twice),
    });
    index.chunks.push(twice);
    let mut damages = Damages::default();
    let file = LogFile::open(&path, ReadOptions::default()).unwrap();
    survey::complete(&file, &mut index, &mut damages).unwrap();
    assert!(damages.found[0].what.contains("indexed again"), "{damages:?}");
    assert_eq!(index.chunks, log_file.index().chunks);
}

#[test]
fn the_observer_hears_of_a_scan_up_to_its_end() {
    for options in [chunked().use_chunks(false), chunked()] {
        let (_dir, path) = on_disk(&log(options.emit_summary_records(false).emit_summary_offsets(false)));
        let told = Arc::new(Mutex::new(Vec::new()));
        let ear = Arc::clone(&told);
        let observer = Observer::new(move |progress| ear.lock().unwrap().push(progress));
        let log = Log::open_with(path, ReadOptions { observer, ..ReadOptions::default() }).unwrap();
        let told = told.lock().unwrap();
        assert!(told.iter().all(|p| p.work == Work::Scan && p.done <= p.total), "{told:?}");
        assert!(told.iter().any(|p| p.done < p.total), "{told:?}");
        assert_eq!(told.iter().map(|p| p.done).max(), Some(log.index().data_end));
    }
}

#[test]
fn of_a_log_that_is_cut_off_the_cut_is_named_before_what_follows_from_it() {
    let bytes = log(chunked());
    let whole = open(&bytes).unwrap();
    let chunk = &whole.index().chunks[2];
    let within = (chunk.chunk_start_offset + chunk.chunk_length) as usize - 3;
    for (len, says) in
        [(whole.index().data_end as usize, "the log is cut off here"), (within, "the log is cut off: of")]
    {
        let log = open(&bytes[..len]).unwrap();
        assert!(log.damage()[0].what.starts_with(says), "{:?}", log.damage());
        assert!(log.damage().iter().all(|damage| !damage.what.contains("the magic")), "{:?}", log.damage());
    }
}
