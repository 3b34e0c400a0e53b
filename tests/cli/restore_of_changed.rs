//! The way back from outputs that somebody changed, or that are damaged.

use std::fs;

use serde_json::Value;

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::two_sensors;

/// An output in place of the log, and the original.
fn fused() -> (Trial, Vec<u8>) {
    let original = two_sensors();
    let trial = Trial::of(&original);
    assert_eq!(trackfuse(trial.folder(), &["fuse", "in.mcap", "--in-place"]).code, 0);
    (trial, original)
}

/// What tools do that amend a log in place: `record` in place of its end, and a new end without a summary.
fn amend(trial: &Trial, opcode: u8, body: &[u8]) {
    let mut log = fs::read(trial.path("in.mcap")).unwrap();
    log.truncate(mcap::read::footer(&log).unwrap().summary_start as usize - 13);
    let end: [(u8, &[u8]); 3] = [(opcode, body), (0x0f, &[0; 4]), (0x02, &[0; 20])];
    for (opcode, body) in end {
        log.push(opcode);
        log.extend((body.len() as u64).to_le_bytes());
        log.extend(body);
    }
    log.extend(b"\x89MCAP0\r\n");
    fs::write(trial.path("in.mcap"), log).unwrap();
}

fn attachment() -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let mut body =
        [&[0; 16][..], &text("dive.pdf"), &text("application/pdf"), &4_u64.to_le_bytes(), b"%PDF"].concat();
    body.extend(crc32fast::hash(&body).to_le_bytes());
    body
}

/// A channel in a chunk.
fn chunk() -> Vec<u8> {
    let records = [
        &[0x04, 26, 0, 0, 0, 0, 0, 0, 0, 99, 0, 0, 0, 6, 0, 0, 0][..],
        b"/other",
        &[4, 0, 0, 0],
        b"json",
        &[0; 4],
    ]
    .concat();
    let len = (records.len() as u64).to_le_bytes();
    [&[0; 16][..], &len, &[0; 4], &[0; 4], &len, &records].concat()
}

#[test]
fn restore_in_place_never_takes_away_what_another_program_appended() {
    for (opcode, body) in [(0x09, attachment()), (0x06, chunk()), (0x90, b"private".to_vec())] {
        let (trial, original) = fused();
        amend(&trial, opcode, &body);
        for again in [false, true] {
            if again {
                let more = ["fuse", "in.mcap", "--in-place", "--prefix", "/more"];
                assert_eq!(trackfuse(trial.folder(), &more).code, 0);
            }
            let before = fs::read(trial.path("in.mcap")).unwrap();
            let refused = trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place"]);
            assert_eq!(refused.code, 1, "{opcode:#x}: {refused:#?}");
            assert_says(&refused.stderr, &["another program appended", "hint: `-o`"]);
            assert!(!refused.stderr.contains("--sidecar"), "{refused:#?}");
            assert!(fs::read(trial.path("in.mcap")).unwrap() == before);

            let ran =
                trackfuse(trial.folder(), &["restore", "in.mcap", "-o", "out.mcap", "--force", "--json"]);
            assert_eq!(ran.code, 3, "{ran:#?}");
            assert_says(&ran.stderr, &["warning: ", "another program appended"]);
            let report: Value = serde_json::from_str(&ran.stdout).unwrap();
            assert_eq!(report["warnings"].as_array().unwrap().len(), 1, "{report:#}");
            assert!(fs::read(trial.path("out.mcap")).unwrap() == original);
        }
        // What came last is ours alone.
        assert_eq!(trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place", "--last"]).code, 0);
    }
}

#[test]
fn restore_says_what_is_damaged_and_whether_the_original_is_as_its_checksum_says() {
    let (trial, original) = fused();
    let ran = trackfuse(trial.folder(), &["restore", "in.mcap", "-o", "out.mcap", "--json"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["data_section"], "right");

    // In a chunk of the original.
    let mut log = fs::read(trial.path("in.mcap")).unwrap();
    log[200] ^= 1;
    fs::write(trial.path("in.mcap"), &log).unwrap();
    let ran = trackfuse(trial.folder(), &["restore", "in.mcap", "-o", "out.mcap", "--force"]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stderr, &["warning: ", "data section is not what its checksum says"]);
    assert_says(&ran.stdout, &["warning: ", ": 1 addition taken off", "data section wrong"]);
    assert!(!ran.stdout.contains("the original, "), "{}", ran.stdout);
    assert_eq!(fs::read(trial.path("out.mcap")).unwrap().len(), original.len());
    let ran = trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place"]);
    assert_says(&ran.stdout, &["data section not checked"]);

    // Behind the end.
    let (trial, original) = fused();
    let log = [&fs::read(trial.path("in.mcap")).unwrap()[..], b"garbage"].concat();
    fs::write(trial.path("in.mcap"), log).unwrap();
    let ran = trackfuse(trial.folder(), &["restore", "in.mcap", "-o", "out.mcap"]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stderr, &["7 bytes stand behind the log's end"]);
    assert!(fs::read(trial.path("out.mcap")).unwrap() == original);
}

#[test]
fn a_file_beside_the_log_that_is_none_of_ours_is_named_and_what_to_do_about_it() {
    let trial = Trial::of(two_sensors());
    fs::write(trial.path("in.mcap.trackfuse-undo"), "notes").unwrap();
    for command in ["inspect", "fuse", "restore"] {
        let ran = trackfuse(trial.folder(), &[command, "in.mcap"]);
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(
            &ran.stderr,
            &[
                "in.mcap.trackfuse-undo",
                "it is of another kind or version",
                "hint: ",
                "`trackfuse inspect --verify` on a copy",
            ],
        );
    }
}
