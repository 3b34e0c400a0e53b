#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| trackfuse_fuzz::verify(data));
