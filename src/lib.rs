//! `trackfuse`
#![forbid(unsafe_code)]

pub mod log;
pub mod time;
