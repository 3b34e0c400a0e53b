//! The sample logs, fused once for all tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use tempfile::TempDir;

use crate::viewer_rules::{assert_shown, violations};

/// The names of the sample logs with climbs.
pub(super) const NAMES: [&str; 3] = ["oblique_climb", "single_source", "steep_climb"];

/// The name of the one with a dive.
pub(super) const DIVE: &str = "usbl_dive";

fn sample_logs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs")
}

/// A sample log with its track: climbs fused, the steep one with its config, and the dive cleaned.
pub(super) fn fused(name: &str) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        for name in NAMES.into_iter().chain([DIVE]) {
            let config = sample_logs().join(format!("{name}.config.toml"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_trackfuse"));
            command
                .args([if name == DIVE { "usbl" } else { "fuse" }, "--quiet"])
                .arg(sample_logs().join(format!("{name}.mcap")));
            command.arg("-o").arg(folder.path().join(name));
            if config.exists() {
                command.arg("--config").arg(config);
            }
            assert!(matches!(command.output().unwrap().status.code(), Some(0 | 3)), "{name}");
        }
        folder
    });
    folder.path().join(name)
}

#[test]
fn all_channels_of_the_fused_sample_logs_are_shown_old_and_new() {
    for name in NAMES.into_iter().chain([DIVE]) {
        let path = fused(name);
        assert_shown(&path);
        assert_eq!(violations(&fs::read(path).unwrap(), |_| true), [""; 0], "{name}");
    }
}
