//! The `trackfuse` program.
fn main() {}
