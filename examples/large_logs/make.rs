//! Three kinds of large logs, each with two sources of 100 Hz.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What most of the log's bytes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Frames that are compressed already, in zstd chunks.
    Video,
    /// The same frames in chunks without compression.
    Uncompressed,
    /// Samples of few bits in a byte each, in zstd chunks.
    Sonar,
}

impl Kind {
    pub(crate) const ALL: [Self; 3] = [Self::Video, Self::Uncompressed, Self::Sonar];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Video => "video, zstd",
            Self::Uncompressed => "uncompressed",
            Self::Sonar => "sonar, zstd",
        }
    }
}

/// Samples of each source, 100 a second.
pub(crate) const SAMPLES: u64 = 70_000;
const START_NS: u64 = 1_700_000_000_000_000_000;
const STEP_NS: u64 = 10_000_000;
/// A frame comes with every so many samples.
const SAMPLES_A_FRAME: u64 = 10;

/// Writes a log of about `megabytes` MB.
pub(crate) fn make(path: &Path, kind: Kind, megabytes: u64) {
    let compression = (kind != Kind::Uncompressed).then_some(Compression::Zstd);
    let options = WriteOptions::new().chunk_size(Some(4_000_000)).compression(compression);
    let file = BufWriter::new(File::create(path).expect("a file"));
    let mut writer = options.create(file).expect("a writer");
    let camera = writer.add_channel(0, "/frames", "x", &BTreeMap::new()).expect("a channel");
    let schema = writer.add_schema("Track", "jsonschema", b"{\"type\":\"object\"}").expect("a schema");
    let sources = ["/tether/track", "/beacon/track"]
        .map(|topic| writer.add_channel(schema, topic, "json", &BTreeMap::new()).expect("a channel"));

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    // sonar samples take about half of their size on the disk
    let content = if kind == Kind::Sonar { 2 * megabytes } else { megabytes } * 1_000_000;
    let mut frame = vec![0; (content / (SAMPLES / SAMPLES_A_FRAME)) as usize];
    for i in 0..SAMPLES {
        if i % SAMPLES_A_FRAME == 0 {
            rng.fill_bytes(&mut frame);
            if kind == Kind::Sonar {
                frame.iter_mut().for_each(|b| *b = 100 + (*b & 15));
            }
            put(&mut writer, camera, i, &frame);
        }
        for (source, (sigma, bias)) in sources.iter().zip([(0.1, 0.0), (0.15, 1.0)]) {
            put(&mut writer, *source, i, sample(i, sigma, bias, &mut rng).as_bytes());
        }
    }
    writer.finish().expect("a summary");
}

fn put(writer: &mut Writer<BufWriter<File>>, channel_id: u16, i: u64, data: &[u8]) {
    let time = START_NS + i * STEP_NS;
    let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
    writer.write_to_known_channel(&header, data).expect("room on the disk");
}

/// A position and a velocity on a smooth path, with uniform noise.
fn sample(i: u64, sigma: f64, bias: f64, rng: &mut ChaCha8Rng) -> String {
    let t = i as f64 * 0.01;
    let mut noise = || sigma * 12.0_f64.sqrt() * (rng.random::<f64>() - 0.5);
    let p = [10.0 * (0.3 * t).sin() + bias, 10.0 * (0.2 * t).cos(), -30.0 + 5.0 * (0.1 * t).sin()];
    let v = [3.0 * (0.3 * t).cos(), -2.0 * (0.2 * t).sin(), 0.5 * (0.1 * t).cos()];
    let [p, v] = [p, v].map(|vector| vector.map(|x| x + noise()));
    let ns = START_NS + i * STEP_NS;
    format!(
        "{{\"timestamp\":{{\"sec\":{},\"nsec\":{}}},\"frame_id\":\"enu\",\"position\":{{\"x\":{:.6},\"y\":{:.6},\
         \"z\":{:.6}}},\"velocity\":{{\"x\":{:.6},\"y\":{:.6},\"z\":{:.6}}}}}",
        ns / 1_000_000_000,
        ns % 1_000_000_000,
        p[0],
        p[1],
        p[2],
        v[0],
        v[1],
        v[2]
    )
}
