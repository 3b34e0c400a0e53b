//! Small logs for tests, written by the mcap crate.

use std::{
    collections::BTreeMap,
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, WriteOptions};
use tempfile::TempDir;

pub(super) const PRIVATE: u8 = 0x85;

/// Chunks of some messages each, on the channels `/a` (1) and, in the later half only, `/b` (2).
pub(super) fn chunked() -> WriteOptions {
    WriteOptions::new().compression(None).chunk_size(Some(200))
}

/// Twenty messages a second apart, an attachment, a metadata and a private record.
#[expect(clippy::default_trait_access, reason = "the set's type is of a crate that isn't ours")]
pub(super) fn log(options: WriteOptions) -> Vec<u8> {
    let mut writer = options.profile("test").create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("Test", "jsonschema", b"{}").unwrap();
    let ids = ["/a", "/b"].map(|topic| writer.add_channel(schema, topic, "json", &BTreeMap::new()).unwrap());
    for i in 0..20_u64 {
        let channel_id = if i >= 10 && i % 2 == 1 { ids[1] } else { ids[0] };
        let time = i * 1_000_000_000;
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time + 1 };
        writer.write_to_known_channel(&header, format!("{{\"i\":{i}}}").as_bytes()).unwrap();
        if i == 5 {
            writer.write_private_record(PRIVATE, b"somebody's own", Default::default()).unwrap();
        }
    }
    let (name, media_type) = ("notes".to_owned(), "text/plain".to_owned());
    let data = b"an attachment".as_slice().into();
    writer.attach(&Attachment { log_time: 1, create_time: 2, name, media_type, data }).unwrap();
    let metadata = BTreeMap::from([("ship".to_owned(), "Ada".to_owned())]);
    writer.write_metadata(&Metadata { name: "trial".to_owned(), metadata }).unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A folder that holds nothing but `in.mcap` with `bytes`.
pub(super) fn on_disk(bytes: &[u8]) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("in.mcap");
    fs::write(&path, bytes).unwrap();
    (dir, path)
}

pub(super) fn names_in(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Where each top-level record stands: opcode and offset.
pub(super) fn records(bytes: &[u8]) -> Vec<(u8, usize)> {
    let mut found = Vec::new();
    let mut at = 8;
    while at < bytes.len() - 8 {
        found.push((bytes[at], at));
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    found
}

/// The same log, without the CRC that would tell a change of its summary.
pub(super) fn without_summary_crc(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = bytes.len() - 12;
    bytes[crc..crc + 4].fill(0);
    bytes
}
