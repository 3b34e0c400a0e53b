//! What is fuzzed: each function takes any bytes, and must come back without a panic and in bounded memory, with
//! what it asserts being true. `fuzz_targets` hand them to libFuzzer, `tests/fuzz_sample.rs` runs a short sample.

mod logs;
mod texts;

pub use logs::{append, chunk, open, verify};
pub use texts::{config, decode, json, path};
