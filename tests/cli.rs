//! The process's edge: exit codes, what is printed, what is left on the disk.
//!
//! Every run of `fuse` here is also held to what holds for all: the input stays as it was, no temporary file
//! remains, and a failure leaves nothing behind (see `Trial::fuse`).

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

mod cli {
    mod bad_input;
    mod exit_code;
    mod init;
    mod inspect;
    mod output;
    mod readme;
    mod real_logs;
    mod sources;
    mod trial;
    mod trial_log;
}
