//! Logs of which some chunks can't be decoded.

use mcap::WriteOptions;
use serde_json::json;

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::{Sensor, TrialLog, two_sensors, xyz};

/// Tether and beacon in many chunks, and where those stand that got a wrong checksum: the ones that `is_bad` names by
/// their number.
fn log_with(is_bad: impl Fn(usize) -> bool) -> (Vec<u8>, Vec<usize>) {
    let mut log = TrialLog::with(WriteOptions::new().chunk_size(Some(8_000)));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(0.0, 8.0, 2));
    let mut bytes = log.finish();
    let (mut at, mut chunks, mut bad) = (8, 0, Vec::new());
    while at < bytes.len() - 8 {
        // the CRC stands behind two times and the size
        if bytes[at] == 6 {
            if is_bad(chunks) {
                bytes[at + 33] ^= 0xff;
                bad.push(at);
            }
            chunks += 1;
        }
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    assert!(chunks > 5, "{chunks}");
    (bytes, bad)
}

#[test]
fn a_chunk_that_cannot_be_decoded_is_left_out_and_named() {
    let (bytes, bad) = log_with(|chunk| chunk == 2);
    let damage = format!("\"in.mcap\" is damaged at offset {}: the chunk's CRC is ", bad[0]);
    let trial = Trial::of(&bytes);
    let (report, _) = trial.report(3);
    let whole = Trial::of(log_with(|_| false).0).report(0).0;
    let samples = |report: &serde_json::Value| report["sources"][0]["positions"].as_u64().unwrap();
    assert!(samples(&report) > 0 && samples(&report) < samples(&whole), "{report:#}");
    let warnings = report["warnings"].to_string().replace('\\', "");
    assert_eq!(warnings.matches(&damage).count(), 1, "{warnings}");
    for command in [
        &["init", "in.mcap"][..],
        &["inspect", "in.mcap"],
        &["export", "in.mcap", "--topic", "/tether/track"],
        &["compare", "in.mcap", "--estimate", "/tether/track", "--reference", "/beacon/track"],
    ] {
        let ran = trackfuse(trial.folder(), command);
        assert_eq!(ran.code, 3, "{ran:#?}");
        assert_says(&ran.stderr, &["warning: ", &damage]);
    }
}

#[test]
fn a_topic_of_which_every_chunk_is_bad_is_an_error_that_says_so() {
    let (bytes, _) = log_with(|_| true);
    let trial = Trial::of(&bytes);
    assert_says(&trial.error(1), &["is damaged at offset", "the chunk's CRC is"]);
    let config = "[[source]]\nname = \"wire\"\nposition = \"/tether/track.position\"\n";
    let says = ["source \"wire\": no message of topic \"/tether/track\" can be read", "is damaged at offset"];
    assert_says(&trial.config(config).error(1), &says);
}

#[test]
fn a_chunk_above_the_memory_limit_is_named_with_the_flag_that_raises_it() {
    let (bytes, _) = log_with(|_| false);
    let trial = Trial::of(&bytes);
    let ran = trackfuse(trial.folder(), &["fuse", "in.mcap", "--memory-limit", "6000B"]);
    assert_eq!(ran.code, 1, "{ran:#?}");
    assert_says(&ran.stderr, &["more than the limit of 6000", "--memory-limit"]);
    let ran = trackfuse(trial.folder(), &["fuse", "in.mcap", "--memory-limit", "lots"]);
    assert_eq!(ran.code, 2, "{ran:#?}");
    assert_says(&ran.stderr, &["expected a size", "512MB"]);
}

/// A log with a chunk of its own for a channel that no source needs, but which is looked at when sources are
/// recognised; that chunk got a wrong checksum.
fn with_bad_bystander() -> Vec<u8> {
    let mut log =
        TrialLog::with(WriteOptions::new().chunk_size(Some(8_000)).calculate_data_section_crc(false));
    let pose = json!({"position": xyz([0.0; 3]), "padding": "x".repeat(8_000)});
    log.json("/other/pose", 0.0, &pose);
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(0.0, 8.0, 2));
    let mut bytes = log.finish();
    let chunk = bytes.iter().position(|byte| *byte == 6).unwrap();
    bytes[chunk + 33] ^= 0xff;
    bytes
}

#[test]
fn damage_met_when_sources_are_recognised_counts_for_strict_and_in_place_too() {
    let bytes = with_bad_bystander();
    let trial = Trial::of(&bytes);
    assert_eq!(trial.fuse(&[]).code, 3);
    for way in ["--strict", "--in-place"] {
        let ran = trackfuse(trial.folder(), &["fuse", "in.mcap", "--force", way]);
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(&ran.stderr, &["is damaged at offset", "the chunk's CRC is"]);
    }
    assert!(std::fs::read(trial.path("in.mcap")).unwrap() == bytes);
}

#[test]
fn strict_refuses_a_data_section_whose_checksum_is_wrong_and_statistics_that_miscount() {
    let whole = two_sensors();
    let footer = mcap::read::footer(&whole).unwrap();
    let mut checksum = whole.clone();
    checksum[footer.summary_start as usize - 4] ^= 1;
    // A message's last byte, in a chunk without a checksum: the data section's tells.
    let mut log = TrialLog::with(WriteOptions::new().compression(None).calculate_chunk_crcs(false));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    let mut payload = log.finish();
    let at = payload.windows(4).position(|window| window == b"\"enu").unwrap();
    payload[at + 1] = b'f';
    let mut log = TrialLog::with(WriteOptions::new().calculate_summary_section_crc(false));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    let mut statistics = log.finish();
    let at = mcap::read::footer(&statistics).unwrap().summary_start as usize;
    let at = at
        + statistics[at..].windows(9).position(|window| window == [0x0b, 56, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    statistics[at + 9] += 1;
    for (bytes, says) in [
        (checksum, "the data section's CRC is"),
        (payload, "the data section's CRC is"),
        (statistics, "the statistics count 162 messages, the message indexes 161"),
    ] {
        let trial = Trial::of(bytes);
        let ran = trial.fuse(&["--strict"]);
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(&ran.stderr, &["is damaged at offset", says, "hint: without `--strict`"]);
        let export =
            trackfuse(trial.folder(), &["export", "in.mcap", "--topic", "/tether/track", "--strict"]);
        assert_eq!(export.code, 1, "{export:#?}");
    }
    assert_eq!(Trial::of(whole).fuse(&["--strict"]).code, 0);
}
