//! What is in a file, found by a walk over raw records and by the mcap crate.

pub(crate) const HEAD: usize = 9;
pub(crate) const DATA_END: u8 = 0x0f;
pub(crate) const MESSAGE: u8 = 0x05;
pub(crate) const CHUNK: u8 = 0x06;

/// Opcode and whole bytes of every record up to and with `DataEnd`, those of chunks in their place.
pub(crate) fn raw_records(file: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut found = Vec::new();
    let mut rest = &file[8..];
    while found.last().is_none_or(|(opcode, _)| *opcode != DATA_END) {
        let record = first_record(rest);
        rest = &rest[record.len()..];
        if record[0] != CHUNK {
            found.push((record[0], record.to_vec()));
            continue;
        }
        let records = content(record);
        let mut inside = &records[..];
        while !inside.is_empty() {
            let record = first_record(inside);
            inside = &inside[record.len()..];
            found.push((record[0], record.to_vec()));
        }
    }
    found
}

/// The records of a chunk.
pub(crate) fn content(chunk: &[u8]) -> Vec<u8> {
    let body = &chunk[HEAD..];
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
    records
}

pub(crate) fn first_record(bytes: &[u8]) -> &[u8] {
    &bytes[..HEAD + u64_at(bytes, 1) as usize]
}

pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// Where the summary begins, by the footer at the file's end.
pub(crate) fn summary_start(file: &[u8]) -> usize {
    u64_at(file, file.len() - 8 - 20) as usize
}

/// Topic, sequence, both times, payload.
pub(crate) type Told = (String, u32, u64, u64, Vec<u8>);

pub(crate) fn told_by_stream(file: &[u8]) -> Vec<Told> {
    let told = |m: mcap::Message| {
        (m.channel.topic.clone(), m.sequence, m.log_time, m.publish_time, m.data.into_owned())
    };
    mcap::MessageStream::new(file).unwrap().map(|message| told(message.unwrap())).collect()
}

/// As an indexed reader finds them: through the summary only, with the names of the channels from `names`' summary.
pub(crate) fn told_by_index_of(file: &[u8], names: &[u8]) -> Vec<Told> {
    use mcap::sans_io::{IndexedReadEvent, IndexedReader};
    let summary = mcap::Summary::read(file).unwrap().unwrap();
    let names = mcap::Summary::read(names).unwrap().unwrap();
    let mut reader = IndexedReader::new(&summary).unwrap();
    let mut told = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            IndexedReadEvent::ReadChunkRequest { offset, length } => {
                reader.insert_chunk_record_data(offset, &file[offset as usize..][..length]).unwrap();
            }
            IndexedReadEvent::Message { header: h, data } => {
                let topic = names.channels[&h.channel_id].topic.clone();
                told.push((topic, h.sequence, h.log_time, h.publish_time, data.to_vec()));
            }
        }
    }
    told.sort();
    told
}

pub(crate) fn told_by_index(file: &[u8]) -> Vec<Told> {
    told_by_index_of(file, file)
}
