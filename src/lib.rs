//! `trackfuse`
#![forbid(unsafe_code)]

pub mod time;
