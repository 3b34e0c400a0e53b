//! A check of a viewer's rules by other people's code, which `TRACKFUSE_TEST_VIEWER_CHECK` leads to: a script for
//! `node` that takes a log, and exits with 0 when all of it is shown and with 1 when something isn't.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::fused::{NAMES, fused};

#[test]
fn an_independent_check_finds_nothing_wrong_with_the_fused_sample_logs_and_something_with_a_bad_one() {
    let Some(script) = std::env::var_os("TRACKFUSE_TEST_VIEWER_CHECK").map(PathBuf::from) else {
        // past the test runner, which would keep it to itself
        let _ = std::io::Write::write_all(
            &mut std::io::stderr(),
            b"skipped: TRACKFUSE_TEST_VIEWER_CHECK is not set\n",
        );
        return;
    };
    let check = |log: &Path| {
        let ran = Command::new("node").arg(&script).arg(log).output().expect("node");
        let said = [ran.stdout, ran.stderr].concat();
        (ran.status.code(), String::from_utf8(said).unwrap())
    };
    for name in NAMES {
        let (code, said) = check(&fused(name));
        assert_eq!(code, Some(0), "{name}: {said}");
        for topic in ["/fused/scene  foxglove.SceneUpdate  1 messages", "/fused/pose  foxglove.PoseInFrame"] {
            assert!(said.contains(topic), "{name}: {said}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    for encoding in ["protobuf", "cdr"] {
        let log = folder.path().join(encoding);
        let config = folder.path().join("trial.toml");
        fs::write(&config, format!("[output]\nencoding = \"{encoding}\"\norigin = [59.4, 10.5, 3.0]\n"))
            .unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_trackfuse"));
        command.args(["fuse", "--quiet", "sample_logs/steep_climb.mcap", "--config"]).arg(config);
        command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("-o").arg(&log);
        assert!(matches!(command.output().unwrap().status.code(), Some(0 | 3)));
        let (code, said) = check(&log);
        assert!(code == Some(0) && said.contains("/fused/geojson"), "{encoding}: {said}");
    }
    let cut = folder.path().join("cut.mcap");
    let whole = fs::read(fused(NAMES[0])).unwrap();
    fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    assert_ne!(check(&cut).0, Some(0));
}
