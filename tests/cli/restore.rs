//! The three ways to write, the way back, and what happens to whoever comes meanwhile.

use std::collections::BTreeMap;
use std::fs::{self, File};

use serde_json::Value;

use super::output::validate;
use super::trial::{Output, Ran, Trial, assert_says, trackfuse};
use super::trial_log::two_sensors;
use crate::viewer_rules;

fn run(trial: &Trial, args: &[&str]) -> Ran {
    trackfuse(trial.folder(), args)
}

fn bytes(trial: &Trial, name: &str) -> Vec<u8> {
    fs::read(trial.path(name)).unwrap()
}

fn names(trial: &Trial) -> Vec<String> {
    let entries = fs::read_dir(trial.folder()).unwrap();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// What a run leaves that dies while it changes `in.mcap`, made by hand: see `src/log/undo.rs`.
fn cut_off(trial: &Trial) {
    let log = bytes(trial, "in.mcap");
    let data_end = mcap::read::footer(&log).unwrap().summary_start as usize - 13;
    let mut ends = log[..data_end.min(65_536)].to_vec();
    ends.extend(&log[data_end.saturating_sub(65_536)..data_end]);
    let mut undo =
        b"trackfuse undo 1: the end of the log beside this, as it was. `trackfuse restore LOG` puts it back.\n"
            .to_vec();
    undo.extend((log.len() as u64).to_le_bytes());
    undo.extend((data_end as u64).to_le_bytes());
    undo.extend(crc32fast::hash(&ends).to_le_bytes());
    undo.extend(&log[data_end..]);
    undo.extend(crc32fast::hash(&undo).to_le_bytes());
    fs::write(trial.path("in.mcap.trackfuse-undo"), undo).unwrap();
    let half = [&log[..data_end], &[7; 5000]].concat();
    fs::write(trial.path("in.mcap"), half).unwrap();
}

#[test]
fn in_place_gives_the_log_that_a_new_file_would_be_and_restore_leads_back_from_both() {
    let trial = Trial::of(two_sensors());
    let original = bytes(&trial, "in.mcap");
    assert_eq!(trial.fuse(&["-o", "new.mcap"]).code, 0);
    let ran = run(&trial, &["fuse", "in.mcap", "--in-place"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(ran.stdout.starts_with("in.mcap, in place\n"), "{}", ran.stdout);
    assert!(bytes(&trial, "in.mcap") == bytes(&trial, "new.mcap"));
    viewer_rules::assert_shown(&trial.path("in.mcap"));

    let schema: Value = serde_json::from_str(include_str!("../../schemas/restore.schema.json")).unwrap();
    for (args, output) in [
        (&["new.mcap"][..], "new.restored.mcap"),
        (&["new.mcap", "-o", "x"], "x"),
        (&["in.mcap", "--in-place"], "in.mcap"),
    ] {
        let ran = run(&trial, &[&["restore", "--json"], args].concat());
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
        let report: Value = serde_json::from_str(&ran.stdout).unwrap();
        validate(&report, &schema, &schema, "report");
        assert_eq!((&report["output"], &report["additions_taken_off"]), (&output.into(), &1.into()));
        assert!(bytes(&trial, output) == original, "{args:?}");
    }
    assert_eq!(names(&trial), ["in.mcap", "new.mcap", "new.restored.mcap", "x"]);
    let ran = run(&trial, &["restore", "new.mcap"]);
    assert_eq!(ran.code, 2);
    assert_says(&ran.stderr, &["\"new.restored.mcap\" exists", "hint: `--force`"]);
    assert_eq!(run(&trial, &["restore", "new.mcap", "-o", "new.mcap", "--force"]).code, 2);
}

#[test]
fn restore_takes_everything_off_or_only_the_last() {
    let trial = Trial::of(two_sensors());
    let original = bytes(&trial, "in.mcap");
    assert_eq!(run(&trial, &["fuse", "in.mcap", "--in-place"]).code, 0);
    let first = bytes(&trial, "in.mcap");
    for prefix in ["/b", "/c"] {
        assert_eq!(run(&trial, &["fuse", "in.mcap", "--in-place", "--prefix", prefix]).code, 0);
    }
    let ran = run(&trial, &["restore", "in.mcap", "-o", "out.mcap"]);
    assert_says(&ran.stdout, &["in.mcap -> out.mcap: the original, 3 additions taken off"]);
    assert!(bytes(&trial, "out.mcap") == original);
    for _ in 0..2 {
        let ran = run(&trial, &["restore", "in.mcap", "--in-place", "--last"]);
        assert_says(&ran.stdout, &["in.mcap, in place: 1 of ", " additions taken off"]);
    }
    assert!(bytes(&trial, "in.mcap") == first);
}

#[test]
fn restore_says_when_there_is_nothing_to_take_off() {
    let trial = Trial::of(two_sensors());
    for args in [&["restore", "in.mcap"][..], &["restore", "in.mcap", "--in-place", "--last"]] {
        let ran = run(&trial, args);
        assert_eq!(ran.code, 1);
        assert_says(&ran.stderr, &["error: \"in.mcap\" holds nothing that trackfuse added\n", "hint: "]);
    }
    assert_eq!(names(&trial), ["in.mcap"]);
    assert_eq!(run(&trial, &["restore", "none.mcap"]).code, 1);

    // An output that another program wrote anew.
    let mut writer = mcap::Writer::new(File::create(trial.path("in.mcap")).unwrap()).unwrap();
    writer
        .attach(&mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: "trackfuse:original-after-1000".into(),
            media_type: "application/octet-stream".into(),
            data: b"some end".as_slice().into(),
        })
        .unwrap();
    writer.finish().unwrap();
    let ran = run(&trial, &["restore", "in.mcap"]);
    assert_eq!(ran.code, 1);
    assert_says(&ran.stderr, &["and left in its place", "hint: another program rewrote the log"]);
}

#[test]
fn restore_refuses_an_original_that_would_be_another() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&["-o", "out.mcap"]).code, 0);
    let whole = bytes(&trial, "out.mcap");
    let summary = mcap::Summary::read(&whole).unwrap().unwrap();
    let attachment = summary.attachment_indexes.iter().find(|a| a.name.starts_with("trackfuse:")).unwrap();
    let mut damaged = whole.clone();
    damaged[(attachment.offset + attachment.length) as usize - 20] ^= 1;
    fs::write(trial.path("out.mcap"), &damaged).unwrap();
    for way in [&["-o", "x"][..], &["--in-place"]] {
        let ran = run(&trial, &[&["restore", "out.mcap"], way].concat());
        assert_eq!(ran.code, 1);
        assert_says(&ran.stderr, &["is damaged at offset", "the CRC of the original's end"]);
        assert!(bytes(&trial, "out.mcap") == damaged);
    }
    // A length that is not what was noted of the input.
    let noted = format!("{}", bytes(&trial, "in.mcap").len());
    let wrong = whole.windows(noted.len()).rposition(|w| w == noted.as_bytes()).unwrap();
    let mut damaged = whole.clone();
    damaged[wrong] = b'9';
    fs::write(trial.path("out.mcap"), &damaged).unwrap();
    let ran = run(&trial, &["restore", "out.mcap", "-o", "x"]);
    assert_eq!(ran.code, 1);
    assert_says(&ran.stderr, &["the original would have"]);
    assert_eq!(names(&trial), ["in.mcap", "out.mcap"]);
}

#[test]
fn after_a_run_was_cut_off_logs_are_not_read_until_restore_or_the_next_run_puts_them_back() {
    let trial = Trial::of(two_sensors());
    let original = bytes(&trial, "in.mcap");
    cut_off(&trial);
    let before = bytes(&trial, "in.mcap");
    for args in [
        &["inspect", "in.mcap"][..],
        &["init", "in.mcap"],
        &["export", "in.mcap"],
        &["compare", "in.mcap", "--reference", "/x"],
        &["fuse", "other.mcap", "-o", "in.mcap", "--force"],
    ] {
        fs::write(trial.path("other.mcap"), &original).unwrap();
        let ran = run(&trial, args);
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(
            &ran.stderr,
            &[
                "\"in.mcap\" is not whole: a run that added to it was cut off",
                "hint: `trackfuse restore in.mcap`",
            ],
        );
        assert!(bytes(&trial, "in.mcap") == before);
    }
    fs::remove_file(trial.path("other.mcap")).unwrap();
    let ran = run(&trial, &["restore", "in.mcap", "-o", "out.mcap"]);
    assert_eq!(ran.code, 0);
    assert!(bytes(&trial, "out.mcap") == original && bytes(&trial, "in.mcap") == before);
    assert_eq!(names(&trial), ["in.mcap", "in.mcap.trackfuse-undo", "out.mcap"]);

    let ran = run(&trial, &["restore", "in.mcap"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert_says(&ran.stdout, &["in.mcap, in place: as it was before a run that was cut off"]);
    assert!(bytes(&trial, "in.mcap") == original);
    assert_eq!(names(&trial), ["in.mcap", "out.mcap"]);

    assert_eq!(trial.fuse(&["-o", "new.mcap"]).code, 0);
    for way in [&["-o", "new.mcap", "--force"][..], &["--in-place"]] {
        cut_off(&trial);
        let ran = run(&trial, &[&["fuse", "in.mcap"], way].concat());
        assert_eq!(ran.code, 0, "{ran:#?}");
        assert_eq!(
            ran.stderr,
            "note: a run that added to in.mcap was cut off: in.mcap is as it was before that\n"
        );
        let expected = if way.len() == 1 { bytes(&trial, "new.mcap") } else { original.clone() };
        assert!(bytes(&trial, "in.mcap") == expected);
        assert_eq!(names(&trial), ["in.mcap", "new.mcap", "out.mcap"]);
    }
}

#[test]
fn a_log_is_read_by_many_or_changed_by_one() {
    let trial = Trial::of(two_sensors());
    let original = bytes(&trial, "in.mcap");
    let held = File::open(trial.path("in.mcap")).unwrap();
    held.lock_shared().unwrap();
    assert_eq!(run(&trial, &["inspect", "in.mcap"]).code, 0);
    let in_use = |args: &[&str], name: &str| {
        let ran = run(&trial, args);
        assert_eq!(ran.code, 1, "{ran:#?}");
        assert_says(&ran.stderr, &[&format!("error: \"{name}\" is in use by another run"), "\nhint: wait"]);
    };
    in_use(&["fuse", "in.mcap", "--in-place"], "in.mcap");
    held.unlock().unwrap();
    held.lock().unwrap();
    in_use(&["fuse", "in.mcap", "--in-place"], "in.mcap");
    in_use(&["fuse", "in.mcap", "-o", "out.mcap"], "in.mcap");
    in_use(&["inspect", "in.mcap"], "in.mcap");
    held.unlock().unwrap();
    assert!(bytes(&trial, "in.mcap") == original);

    // The same for an output; one that nobody writes any more is swept.
    fs::write(trial.path(".out.mcap.trackfuse-part"), "half").unwrap();
    let held = File::open(trial.path(".out.mcap.trackfuse-part")).unwrap();
    held.lock().unwrap();
    in_use(&["fuse", "in.mcap", "-o", "out.mcap"], "out.mcap");
    assert_eq!(names(&trial), [".out.mcap.trackfuse-part", "in.mcap"]);
    drop(held);
    assert_eq!(run(&trial, &["fuse", "in.mcap", "-o", "out.mcap"]).code, 0);
    assert_eq!(names(&trial), ["in.mcap", "out.mcap"]);
}

#[test]
fn a_sidecar_is_a_log_of_the_new_channels_alone() {
    let trial = Trial::of(two_sensors());
    assert_eq!(trial.fuse(&["-o", "new.mcap"]).code, 0);
    // It goes through the tests that hold for every output.
    let ran = trial.fuse(&["--sidecar", "side.mcap"]);
    assert_eq!(ran.code, 0, "{ran:#?}");
    let sidecar = bytes(&trial, "side.mcap");
    let (new, side) = (Output::read(&trial.path("new.mcap")), Output::read(&trial.path("side.mcap")));
    let ours: BTreeMap<_, _> = new.topics.iter().filter(|(topic, _)| topic.starts_with("/fused/")).collect();
    assert!(side.topics.keys().eq(ours.keys().copied()));
    for (topic, messages) in ours {
        let values = |w: &[super::trial::Written]| w.iter().map(|w| w.value.clone()).collect::<Vec<_>>();
        assert_eq!(values(messages), values(&side.topics[topic]));
    }
    assert_eq!(new.metadata["trackfuse:/fused"], side.metadata["trackfuse:/fused"]);
    let summary = mcap::Summary::read(&sidecar).unwrap().unwrap();
    assert!(summary.attachment_indexes.is_empty());
    assert_eq!(summary.schemas.keys().min(), Some(&1));
    let header = mcap::records::Header {
        profile: String::new(),
        library: format!("trackfuse {}", env!("CARGO_PKG_VERSION")),
    };
    let first = mcap::read::LinearReader::new(&sidecar).unwrap().next().unwrap().unwrap();
    assert!(matches!(first, mcap::records::Record::Header(found) if found == header));
    let end = summary_start(&sidecar) - 13;
    assert_eq!(sidecar[end + 9..end + 13], crc32fast::hash(&sidecar[..end]).to_le_bytes());

    assert_eq!(trial.fuse(&["--sidecar", "side.mcap"]).code, 2);
    assert_eq!(trial.fuse(&["--sidecar", "in.mcap", "--force"]).code, 2);
    assert_eq!(trial.fuse(&["--sidecar", "a", "-o", "b"]).code, 2);
    assert_eq!(trial.fuse(&["--sidecar", "a", "--in-place"]).code, 2);
    let ran = run(&trial, &["restore", "side.mcap"]);
    assert_says(&ran.stderr, &["nothing that trackfuse added", "a sidecar holds no original"]);
}

fn summary_start(log: &[u8]) -> usize {
    mcap::read::footer(log).unwrap().summary_start as usize
}

#[cfg(unix)]
#[test]
fn in_place_follows_a_soft_link_and_refuses_a_file_of_two_names() {
    let trial = Trial::of(two_sensors());
    let original = bytes(&trial, "in.mcap");
    fs::create_dir(trial.path("links")).unwrap();
    std::os::unix::fs::symlink("../in.mcap", trial.path("links/soft.mcap")).unwrap();
    // What was cut off is known by every name.
    cut_off(&trial);
    let ran = run(&trial, &["inspect", "links/soft.mcap"]);
    assert_says(&ran.stderr, &["hint: `trackfuse restore links/soft.mcap`"]);
    assert_eq!(run(&trial, &["restore", "links/soft.mcap"]).code, 0);
    assert!(bytes(&trial, "in.mcap") == original);
    assert_eq!(run(&trial, &["fuse", "links/soft.mcap", "--in-place"]).code, 0);
    assert!(fs::symlink_metadata(trial.path("links/soft.mcap")).unwrap().is_symlink());
    assert!(bytes(&trial, "in.mcap").len() > original.len());
    assert_eq!(run(&trial, &["restore", "links/soft.mcap", "--in-place"]).code, 0);

    fs::hard_link(trial.path("in.mcap"), trial.path("backup.mcap")).unwrap();
    let ran = run(&trial, &["fuse", "in.mcap", "--in-place"]);
    assert_eq!(ran.code, 1);
    assert_says(&ran.stderr, &["cannot change \"in.mcap\" in place: the file has 2 names", "hint: `-o`"]);
    assert!(bytes(&trial, "in.mcap") == original);
}

#[cfg(unix)]
#[test]
fn force_replaces_a_link_and_keeps_what_it_leads_to() {
    let trial = Trial::of(two_sensors());
    fs::write(trial.path("precious"), "precious").unwrap();
    for target in ["precious", "nowhere"] {
        let _ = fs::remove_file(trial.path("link.mcap"));
        std::os::unix::fs::symlink(target, trial.path("link.mcap")).unwrap();
        assert_eq!(trial.fuse(&["-o", "link.mcap"]).code, 2);
        assert_eq!(trial.fuse(&["-o", "link.mcap", "--force"]).code, 0);
        assert!(fs::symlink_metadata(trial.path("link.mcap")).unwrap().is_file());
        assert_eq!(bytes(&trial, "precious"), b"precious");
    }
    assert_eq!(names(&trial), ["in.mcap", "link.mcap", "precious"]);
}

#[test]
fn in_place_is_refused_on_a_log_that_is_not_whole() {
    let whole = two_sensors();
    let trial = Trial::of(&whole[..whole.len() - 3]);
    let ran = trial.fuse_with(&["in.mcap", "--in-place"]);
    assert_eq!(ran.code, 1);
    assert_says(&ran.stderr, &["in place: it is damaged at offset", "`-o` writes a new log"]);
    assert!(bytes(&trial, "in.mcap") == whole[..whole.len() - 3], "the log was touched");
}
