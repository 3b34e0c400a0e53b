//! `trackfuse`
#![forbid(unsafe_code)]

pub mod cli;
pub mod commands;
pub mod config;
pub mod estimate;
pub mod fusion;
pub mod log;
pub mod math;
mod printable;
pub mod publish;
pub mod quality;
pub mod report;
pub mod sample;
pub mod simulate;
pub mod source;
pub mod time;
pub mod track;
