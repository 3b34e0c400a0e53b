//! A short sample of the fuzzing: the targets of `fuzz/` on their seeds, and on seeds broken in ways that the
//! same random numbers choose every time.

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[allow(unreachable_pub, reason = "what is fuzzed is a crate of its own")]
#[path = "../fuzz/src/lib.rs"]
mod targets;

/// Numbers at the edges of what lengths and ids may be.
const EDGES: [u64; 10] = [0, 1, 0x7f, 0xff, 0xffff, 1 << 20, 0x7fff_ffff, 0xffff_ffff, 1 << 62, u64::MAX];

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(name);
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 2, "{name}");
    paths.into_iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Breaks `data` in one place.
fn mutate(data: &mut Vec<u8>, other: &[u8], random: &mut impl Rng) {
    if data.is_empty() {
        data.push(0);
    }
    let at = random.random_range(0..data.len());
    let len = random.random_range(1..=16.min(data.len() - at));
    match random.random_range(0..7) {
        0 => data[at] ^= 1 << random.random_range(0..8),
        1 => data[at] = random.random(),
        2 => {
            let number = EDGES[random.random_range(0..EDGES.len())].to_le_bytes();
            let width = [1, 2, 4, 8][random.random_range(0..4)].min(data.len() - at);
            data[at..at + width].copy_from_slice(&number[..width]);
        }
        3 => {
            data.drain(at..at + len);
        }
        4 => {
            let part = data[at..at + len].to_vec();
            data.splice(at..at, part);
        }
        5 => data.truncate(at),
        _ => {
            let from = random.random_range(0..other.len());
            let part = &other[from..(from + 4 * len).min(other.len())];
            data.splice(at..at + len, part.iter().copied());
        }
    }
}

fn sample(target: impl Fn(&[u8]), folder: &str, rounds: usize) {
    let seeds = seeds(folder);
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for seed in &seeds {
        target(seed);
    }
    for round in 0..rounds {
        let mut data = seeds[round % seeds.len()].clone();
        let other = &seeds[random.random_range(0..seeds.len())];
        for _ in 0..random.random_range(1..=3) {
            mutate(&mut data, other, &mut random);
        }
        let ended = catch_unwind(AssertUnwindSafe(|| target(&data)));
        assert!(ended.is_ok(), "{folder}, round {round}: \"{}\"", data.escape_ascii());
    }
}

#[test]
fn opening_and_reading_any_bytes_never_panics() {
    sample(targets::open, "log", 300);
}

#[test]
fn reading_any_chunk_never_panics() {
    sample(targets::chunk, "chunk", 1_000);
}

#[test]
fn adding_to_any_log_that_opens_keeps_its_bytes_and_messages() {
    sample(targets::append, "log", 300);
}

#[test]
fn verifying_any_bytes_never_panics_and_what_is_clean_opens() {
    sample(targets::verify, "log", 1_000);
}

#[test]
fn decoding_any_payload_by_any_definition_never_panics_and_selections_agree_with_the_whole() {
    sample(targets::decode, "decode", 20_000);
}

#[test]
fn following_any_path_into_any_json_never_panics() {
    sample(targets::json, "json", 20_000);
}

#[test]
fn reading_any_path_never_panics_and_what_is_written_is_read_again() {
    sample(targets::path, "path", 20_000);
}

#[test]
fn reading_any_config_never_panics() {
    sample(targets::config, "config", 2_000);
}
