//! Bytes as a log: opened, read, added to, verified.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tempfile::TempDir;
use trackfuse::inspect::inspect;
use trackfuse::log::verify::verify as verify_file;
use trackfuse::log::{
    Appender, Compression, Destination, Log, LogError, NewChannel, NewMessage, ReadOptions, Visibility,
};

thread_local! {
    static FOLDER: TempDir = tempfile::tempdir().expect("a temporary folder");
}

/// Calls `f` with a folder and a file in it that holds `data`.
fn with_file<T>(data: &[u8], f: impl FnOnce(&Path, &Path) -> T) -> T {
    FOLDER.with(|folder| {
        let path = folder.path().join("in.mcap");
        fs::write(&path, data).expect("room for the input");
        f(folder.path(), &path)
    })
}

/// Channel, log time and length of a message.
type Told = (u16, u64, usize);

/// Every message of the log that can be read, and what is wrong with the rest.
fn messages(log: &Log) -> (Vec<Told>, Result<(), LogError>) {
    let channels: BTreeSet<u16> = (0..=u16::MAX).collect();
    let mut found = Vec::new();
    let read = log.for_each_message(&channels, |message| {
        found.push((message.channel_id, message.log_time, message.data.len()));
        Ok(())
    });
    // What can't be read is passed over.
    let whole = read.and_then(|read| read.damaged.into_iter().next().map_or(Ok(()), Err));
    (found, whole)
}

/// Opens a log, and reads all that can be read of it.
pub fn open(data: &[u8]) {
    with_file(data, |_, path| {
        let Ok(log) = Log::open(path) else { return };
        let (found, read) = messages(&log);
        let (first, damaged) = log.first_messages(&log.index().channels.keys().copied().collect());
        if read.is_ok() {
            assert!(damaged.is_empty(), "the same parts were read before: {damaged:?}");
            // Message indexes that lie may hide a channel's first one, and make none up.
            for (id, message) in first {
                assert!(found.contains(&(id, message.log_time, message.data.len())), "channel {id}");
            }
        }
        let _ = inspect(&log);
    });
}

/// Reads a chunk: the first byte chooses its compression, two more its size, the rest are its bytes.
pub fn chunk(data: &[u8]) {
    let [kind, low, high, records @ ..] = data else { return };
    let compression: &[u8] = match kind % 4 {
        0 => b"",
        1 => b"zstd",
        2 => b"lz4",
        _ => b"none",
    };
    let claimed = u64::from(u16::from_le_bytes([*low, *high]));
    let size = if *kind < 4 { records.len() as u64 } else { claimed };
    let mut body = [[0; 8], [0; 8], size.to_le_bytes()].concat();
    body.extend([0; 4]);
    body.extend((compression.len() as u32).to_le_bytes());
    body.extend(compression);
    body.extend((records.len() as u64).to_le_bytes());
    body.extend(records);
    let mut file = b"\x89MCAP0\r\n".to_vec();
    for (opcode, body) in [(1, &[0; 8][..]), (6, &body), (0x0f, &[0; 4]), (2, &[0; 20])] {
        file.push(opcode);
        file.extend((body.len() as u64).to_le_bytes());
        file.extend(body);
    }
    file.extend(b"\x89MCAP0\r\n");
    open(&file);
    verify(&file);
}

/// Adds a channel: every byte of the data section stays, old and new are read.
pub fn append(data: &[u8]) {
    with_file(data, |folder, path| {
        let Ok(log) = Log::open(path) else { return };
        let out = folder.join("out.mcap");
        let to = Destination::New { out: out.clone(), force: true };
        let channels = [NewChannel::json("/new", "Test", "{}")];
        let Ok(mut appender) = Appender::begin(&log, &to, &channels, Compression::None) else {
            return;
        };
        appender.write(NewMessage { channel: 0, time_ns: 7, data: b"{}" }).expect("room for the output");
        appender.finish().expect("room for the output");
        let end = log.index().data_end as usize;
        let output = fs::read(&out).expect("the output");
        assert!(output.starts_with(&data[..end]), "the data section changed");
        let successor = Log::open(&out).expect("the output opens as the input did");
        // Past a record without an end the old summary's entries lead on, also those that the new one must not have.
        let is_lost = !log.damage().is_empty() && matches!(log.visibility(), Visibility::Partly { .. });
        if let (old, Ok(())) = messages(&log)
            && !is_lost
        {
            let (new, read) = messages(&successor);
            assert!(read.is_ok(), "{read:?}");
            assert_eq!((new.len(), &new[..old.len()]), (old.len() + 1, &old[..]));
        }
    });
}

/// Verifies a log: what has no finding opens, and has as many messages for the reader as for the verifier.
pub fn verify(data: &[u8]) {
    with_file(data, |_, path| {
        let Ok(found) = verify_file(path, ReadOptions::default()) else { return };
        assert_eq!(found.is_clean() && found.left_out == 0, found.is_clean());
        if found.is_clean() {
            let log = Log::open(path).expect("nothing is wrong with it");
            let (messages, read) = messages(&log);
            assert!(read.is_ok(), "{read:?}");
            assert_eq!(messages.len() as u64, found.checked.messages);
        }
    });
}
