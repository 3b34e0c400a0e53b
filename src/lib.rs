//! `trackfuse`
#![forbid(unsafe_code)]

pub mod config;
pub mod estimate;
pub mod fusion;
pub mod log;
pub mod math;
pub mod sample;
pub mod time;
pub mod track;
