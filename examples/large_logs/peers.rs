//! The same jobs by the mcap crate's own readers and writer.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::sans_io::indexed_reader::{IndexedReadEvent, IndexedReader, IndexedReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader};
use mcap::{Compression, Summary, WriteOptions};
use trackfuse::log::{Encoding, NewChannel};
use trackfuse::publish::{Context, Topic, messages};

use crate::jobs::Fitted;

fn summary(file: &mut File) -> Summary {
    let mut reader = SummaryReader::new();
    while let Some(event) = reader.next_event() {
        match event.expect("a summary") {
            SummaryReadEvent::ReadRequest(need) => {
                let read = file.read(reader.insert(need)).expect("a file");
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).expect("a file")),
        }
    }
    reader.finish().expect("a summary")
}

/// Reads the sources' messages by the IndexedReader, as its documentation shows it, and counts them.
pub(crate) fn read_indexed(input: &Path) -> u64 {
    let mut file = File::open(input).expect("a log");
    let summary = summary(&mut file);
    let options = IndexedReaderOptions::new().include_topics(["/tether/track", "/beacon/track"]);
    let mut reader = IndexedReader::new_with_options(&summary, options).expect("an index");
    let (mut buffer, mut count, mut bytes) = (Vec::new(), 0, 0);
    while let Some(event) = reader.next_event() {
        match event.expect("a message") {
            IndexedReadEvent::ReadChunkRequest { offset, length } => {
                file.seek(SeekFrom::Start(offset)).expect("a file");
                buffer.resize(length, 0);
                file.read_exact(&mut buffer).expect("a chunk");
                reader.insert_chunk_record_data(offset, &buffer).expect("a chunk");
            }
            IndexedReadEvent::Message { data, .. } => {
                count += 1;
                bytes += data.len();
            }
        }
    }
    assert!(bytes > 0, "messages");
    count
}

/// Writes all messages anew, and what `fuse` adds behind them.
pub(crate) fn rewrite(input: &Path, output: &Path, fitted: &Fitted) {
    let compressed = summary(&mut File::open(input).expect("a log")).chunk_indexes;
    let compressed = compressed.iter().any(|chunk| chunk.compression == "zstd");
    let options =
        WriteOptions::new().chunk_size(Some(4_000_000)).compression(compressed.then_some(Compression::Zstd));
    let mut writer = options.create(BufWriter::new(File::create(output).expect("a file"))).expect("a writer");
    let source = BufReader::with_capacity(1 << 20, File::open(input).expect("a log"));
    for message in mcap::io::MessageReader::new(source) {
        writer.write(&message.expect("a message")).expect("room on the disk");
    }
    let new =
        Topic::channels(&Topic::written(&Topic::FUSED, Encoding::Json, false), "/fused", Encoding::Json);
    let mut channel = |new: &NewChannel| {
        let schema =
            writer.add_schema(&new.schema_name, &new.schema_encoding, &new.schema).expect("a schema");
        writer.add_channel(schema, &new.topic, &new.message_encoding, &BTreeMap::new()).expect("a channel")
    };
    let channels: Vec<u16> = new.iter().map(&mut channel).collect();
    let context = Context {
        sources: &fitted.sources,
        origin: fitted.origin,
        rate_hz: fitted.rate_hz,
        t0: fitted.origin,
        surface_at_zero: true,
        log_start: None,
        encoding: Encoding::Json,
        geodetic: None,
    };
    for (i, message) in messages(&fitted.fusion, context, "", &[], Vec::new()).enumerate() {
        let time = message.time.to_log();
        let channel_id = channels[message.topic as usize];
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message.data).expect("room on the disk");
    }
    writer.finish().expect("a summary");
    let file = writer.into_inner().into_inner().expect("room on the disk");
    file.sync_all().expect("room on the disk");
}
