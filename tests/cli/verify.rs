//! `inspect --verify` says whether every byte of a log is as it should be.

use serde_json::Value;

use super::output::validate;
use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::two_sensors;

/// Text, stderr and JSON of a log whose verification must end with `code`.
fn verify(log: &[u8], code: i32) -> (String, String, Value) {
    let trial = Trial::of(log);
    let text = trackfuse(trial.folder(), &["inspect", "in.mcap", "--verify"]);
    let json = trackfuse(trial.folder(), &["inspect", "in.mcap", "--verify", "--json", "--quiet"]);
    assert_eq!((text.code, json.code), (code, code), "{text:#?}");
    let report = serde_json::from_str(&json.stdout).unwrap_or_default();
    if code != 1 {
        let schema: Value = serde_json::from_str(include_str!("../../schemas/inspect.schema.json")).unwrap();
        validate(&report, &schema, &schema, "report");
    }
    (text.stdout, text.stderr, report)
}

/// Where the first chunk stands.
fn first_chunk(log: &[u8]) -> usize {
    let mut at = 8;
    while log[at] != 0x06 {
        at += 9 + u64::from_le_bytes(log[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    at
}

#[test]
fn verify_of_a_good_log_says_how_much_was_checked_and_that_nothing_is_wrong() {
    let (text, _, report) = verify(&two_sensors(), 0);
    assert_says(
        &text,
        &[
            "verified    ",
            " messages, ",
            " index entries: nothing is wrong\n",
            "checksums   right: summary, data section, ",
        ],
    );
    assert_eq!(report["verification"]["findings"], serde_json::json!([]));
    assert_eq!(report["verification"]["messages"], report["file"]["messages"]);
    assert_eq!(report["verification"]["bytes"], report["file"]["bytes"]);
    assert_eq!(report["checksums"]["data_section"], "right");
}

#[test]
fn verify_names_what_is_wrong_and_where_and_the_exit_code_tells() {
    let mut log = two_sensors();
    let chunk = first_chunk(&log);
    log[chunk + 9 + 24] ^= 1;
    let (text, stderr, report) = verify(&log, 3);
    let place = format!("warning: at byte {chunk}: the chunk's CRC is ");
    assert_says(&text, &["2 things are wrong", "not right: data section, ", &place]);
    assert_says(&stderr, &[&place]);
    let findings = report["verification"]["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 2, "{findings:#?}");
    assert_eq!(findings[0]["offset"], chunk);
    assert_eq!(report["checksums"]["data_section"], "wrong");
}

#[test]
fn verify_of_what_is_no_log_fails_like_inspect() {
    let trial = Trial::of("no log at all");
    let ran = trackfuse(trial.folder(), &["inspect", "in.mcap", "--verify"]);
    assert_eq!(ran.code, 1);
    assert!(ran.stderr.starts_with("error: "), "{ran:#?}");
}

#[test]
fn verify_takes_no_more_into_memory_than_it_is_allowed_to() {
    let trial = Trial::of(two_sensors());
    let ran = trackfuse(trial.folder(), &["inspect", "in.mcap", "--verify", "--memory-limit", "4000B"]);
    assert_eq!(ran.code, 3, "{ran:#?}");
    assert_says(&ran.stdout, &[" bytes, more than the limit of 4000, and was not looked into"]);
}
