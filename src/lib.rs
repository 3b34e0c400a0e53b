//! `trackfuse`
#![forbid(unsafe_code)]

pub mod simulate;
pub mod time;
