//! MCAP at both ends; nothing else knows MCAP.

pub mod decode;
