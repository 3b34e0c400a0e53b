//! `trackfuse`
#![forbid(unsafe_code)]

pub mod estimate;
pub mod math;
pub mod sample;
pub mod time;
pub mod track;
