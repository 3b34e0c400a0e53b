//! Whole files of other writers, and our own, verify without a finding; those that don't are really wrong.

// Helpers of tests, which the exception in clippy.toml doesn't reach.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use trackfuse::log::ReadOptions;
use trackfuse::log::verify::{Verification, verify};

fn verified(path: &Path) -> Verification {
    verify(path, ReadOptions::default()).unwrap()
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

/// Its statistics begin at 1 ms, its first message has the log time 0.
const WRONG: [(&str, &str); 1] =
    [("rewriter_a_0.mcap", "the statistics say 1000000 as first log time, found 0")];

#[test]
fn files_of_other_writers_verify_without_a_finding() {
    let Ok(data) = std::env::var("TRACKFUSE_TEST_DATA") else {
        println!("skipped: TRACKFUSE_TEST_DATA is not set");
        return;
    };
    let logs = logs_below(Path::new(&data));
    assert!(logs.len() > 400, "{}", logs.len());
    for log in logs {
        let found: Vec<String> = verified(&log).findings.into_iter().map(|f| f.what).collect();
        let known = WRONG.iter().filter(|(name, _)| log.ends_with(name)).map(|(_, what)| *what);
        assert_eq!(found, known.collect::<Vec<_>>(), "{}", log.display());
    }
}

#[test]
fn what_fuse_writes_verifies_without_a_finding() {
    let folder = tempfile::tempdir().unwrap();
    let logs = logs_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs"));
    let flight =
        std::env::var("TRACKFUSE_TEST_DATA").map(|data| Path::new(&data).join("flight_two_sensors.mcap"));
    for log in logs.into_iter().chain(flight) {
        let out = folder.path().join(log.file_name().unwrap());
        let ran =
            Command::new(env!("CARGO_BIN_EXE_trackfuse")).arg("fuse").arg(&log).arg("-o").arg(&out).output();
        let code = ran.unwrap().status.code();
        assert!(matches!(code, Some(0 | 3)), "{}: {code:?}", log.display());
        let found = verified(&out);
        assert!(found.is_clean(), "{}: {found:#?}", log.display());
        assert!(found.checked.messages > verified(&log).checked.messages);
        // what the input has checksums for, the output has
        assert_eq!(found.not_checkable, verified(&log).not_checkable, "{}", log.display());
    }
}
