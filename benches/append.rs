//! Adding a track of 70,000 points to a log, beside copying that log: both end with the bytes on the disk.
//! The log has 512 MB of incompressible chunks of 4 MB; set `TRACKFUSE_BENCH_MB` for another size.

#[path = "../examples/large_logs/added.rs"]
mod added;

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use mcap::records::MessageHeader;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trackfuse::log::Destination;

fn make_log(path: &Path, megabytes: u64) {
    let file = BufWriter::new(File::create(path).expect("a temporary file"));
    let options = mcap::WriteOptions::new().chunk_size(Some(4_000_000)).compression(None);
    let mut writer = options.create(file).expect("a writer");
    let channel =
        writer.add_channel(0, "/video", "x-video", &std::collections::BTreeMap::new()).expect("a channel");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for i in 0..megabytes * 10 {
        let frame: Vec<u8> = (0..100_000 / 8).flat_map(|_| rng.random::<u64>().to_le_bytes()).collect();
        let time = 1_000_000_000 + i * 10_000_000;
        let header =
            MessageHeader { channel_id: channel, sequence: i as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &frame).expect("a message");
    }
    writer.finish().expect("a summary");
}

fn append(c: &mut Criterion) {
    let megabytes = std::env::var("TRACKFUSE_BENCH_MB").ok().and_then(|v| v.parse().ok()).unwrap_or(512);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (input, output) = (folder.path().join("in.mcap"), folder.path().join("out.mcap"));
    make_log(&input, megabytes);
    let track = added::track(1_000_000_000);

    let mut group = c.benchmark_group("append");
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .throughput(Throughput::Bytes(megabytes * 1_000_000));
    group.bench_function("copy alone", |b| {
        b.iter(|| {
            fs::copy(&input, &output).expect("room on the disk");
            File::open(&output).and_then(|f| f.sync_all()).expect("a synced file");
        });
    });
    group.bench_function("copy and add 70,000 points", |b| {
        b.iter(|| {
            let to = Destination::New { out: output.clone(), force: true };
            added::add(&input, &to, &track).expect("a log");
        });
    });
    group.finish();
}

criterion_group!(benches, append);
criterion_main!(benches);
