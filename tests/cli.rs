//! The process's edge: exit codes, what is printed, what is left on the disk.
//!
//! Every run of `fuse` here is also held to what holds for all: the input stays as it was, no temporary file
//! remains, a failure leaves nothing behind, and viewers show what was added (see `Trial::fuse_with`).

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

mod viewer_rules;

mod cli {
    mod axes;
    mod bad_input;
    mod compare;
    mod crash;
    mod damaged_chunks;
    mod encodings;
    mod exit_code;
    mod export;
    mod fixes;
    mod init;
    mod inspect;
    mod output;
    mod output_encodings;
    mod readme;
    mod real_logs;
    mod report;
    mod restore;
    mod restore_of_changed;
    mod simulate;
    mod sources;
    mod trial;
    mod trial_log;
    mod usbl;
    mod usbl_time;
    mod verify;
    mod viewer_topics;
}
