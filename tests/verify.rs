//! Whole files of other writers, and our own, verify without a finding; those that don't are really wrong.

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use trackfuse::log::verify::{Verification, verify};

fn verified(path: &Path) -> Verification {
    verify(path, &mut |_, _| {}).unwrap()
}

fn logs_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(logs_below(&path));
        } else if path.extension().is_some_and(|extension| extension == "mcap") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn files_of_other_writers_verify_without_a_finding() {
    let Ok(data) = std::env::var("TRACKFUSE_TEST_DATA") else {
        println!("skipped: TRACKFUSE_TEST_DATA is not set");
        return;
    };
    let logs = logs_below(Path::new(&data));
    assert!(logs.len() > 400, "{}", logs.len());
    for log in logs {
        let found = verified(&log);
        if !found.is_clean() {
            println!("{}: {:#?}", log.display(), found);
        }
    }
}
