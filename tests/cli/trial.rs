//! A folder with a log, in which the program is run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use trackfuse::log::decode::Decoder;

use crate::viewer_rules;

/// What a run gave.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs the program in `folder`.
pub(crate) fn trackfuse(folder: &Path, args: &[&str]) -> Ran {
    let done = Command::new(env!("CARGO_BIN_EXE_trackfuse")).args(args).current_dir(folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let ran = Ran {
        code: done.status.code().expect("ended by itself"),
        stdout: text(done.stdout),
        stderr: text(done.stderr),
    };
    assert!((0..=3).contains(&ran.code), "{ran:#?}");
    assert!(!ran.stderr.contains("panicked"), "{ran:#?}");
    ran
}

/// A folder that holds `in.mcap`, and perhaps `trial.toml`.
pub(crate) struct Trial {
    folder: TempDir,
}

impl Trial {
    pub(crate) fn of(log: impl AsRef<[u8]>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("in.mcap"), log).unwrap();
        Self { folder }
    }

    pub(crate) fn config(self, text: &str) -> Self {
        fs::write(self.path("trial.toml"), text).unwrap();
        self
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Name and content of every file.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let files = fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap());
        files
            .map(|entry| {
                (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap_or_default())
            })
            .collect()
    }

    /// Runs `trackfuse fuse` with `args`. Whatever they are: what was there stays as it was, but for a
    /// replaced output; a failure adds nothing; no temporary file remains; and viewers show what was added.
    pub(crate) fn fuse_with(&self, args: &[&str]) -> Ran {
        let before = self.files();
        let ran = trackfuse(self.folder.path(), &[&["fuse"], args].concat());
        let after = self.files();
        assert_eq!(before["in.mcap"], after["in.mcap"], "{ran:#?}");
        if matches!(ran.code, 1 | 2) {
            assert!(before == after, "a failure left {:?}: {ran:#?}", after.keys());
            assert_eq!(ran.stdout, "", "a failure has no result");
            assert!(ran.stderr.starts_with("error: "), "{ran:#?}");
            assert!(ran.stderr.lines().next().unwrap().len() > 20, "an error says what and where: {ran:#?}");
        }
        assert!(after.keys().all(|name| !name.contains("trackfuse-")), "{:?}", after.keys());
        for name in after.keys().filter(|&name| {
            matches!(ran.code, 0 | 3)
                && !after[name].starts_with(b"<!DOCTYPE html>")
                && before.get(name) != after.get(name)
        }) {
            viewer_rules::assert_shown(&self.path(name));
        }
        ran
    }

    /// `fuse in.mcap`, with `--config trial.toml` where there is one.
    pub(crate) fn fuse(&self, args: &[&str]) -> Ran {
        let config: &[&str] =
            if self.path("trial.toml").exists() { &["--config", "trial.toml"] } else { &[] };
        self.fuse_with(&[&["in.mcap"], config, args].concat())
    }

    /// The report of a run that must end with `code`, and the output.
    pub(crate) fn report(&self, code: i32) -> (Value, Output) {
        let ran = self.fuse(&["--json", "--quiet", "--force"]);
        assert_eq!(ran.code, code, "{ran:#?}");
        assert_eq!(ran.stderr, "");
        (serde_json::from_str(&ran.stdout).unwrap(), Output::read(&self.path("in.fused.mcap")))
    }

    /// The error of a run that must end with `code`.
    pub(crate) fn error(&self, code: i32) -> String {
        let ran = self.fuse(&[]);
        assert_eq!(ran.code, code, "{ran:#?}");
        ran.stderr
    }
}

/// A message of an output.
#[derive(Clone, Debug)]
pub(crate) struct Written {
    pub(crate) log_time: u64,
    pub(crate) publish_time: u64,
    pub(crate) value: Value,
}

impl Written {
    pub(crate) fn timestamp_ns(&self) -> i64 {
        let part = |name: &str| self.value["timestamp"][name].as_i64().unwrap();
        part("sec") * 1_000_000_000 + part("nsec")
    }

    pub(crate) fn vector(&self, field: &str) -> [f64; 3] {
        ["x", "y", "z"].map(|axis| self.value[field][axis].as_f64().unwrap())
    }
}

/// The new channels of an output, read with the mcap crate.
pub(crate) struct Output {
    pub(crate) topics: BTreeMap<String, Vec<Written>>,
    pub(crate) metadata: BTreeMap<String, BTreeMap<String, String>>,
}

impl Output {
    pub(crate) fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let mut topics: BTreeMap<String, Vec<Written>> =
            summary.channels.values().map(|c| (c.topic.clone(), Vec::new())).collect();
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let topic = &message.channel.topic;
            let value = if message.channel.message_encoding == "json" {
                serde_json::from_slice(&message.data).unwrap_or_default()
            } else if let Some(s) = message
                .channel
                .schema
                .clone()
                .filter(|_| ["/fused/", "/usbl/"].iter().any(|own| topic.starts_with(own)))
            {
                let encoding = &message.channel.message_encoding;
                let decoder = Decoder::new(encoding, &s.encoding, &s.name, &s.data).unwrap();
                decoder.decode(&message.data).unwrap().to_json()
            } else {
                continue;
            };
            let (log_time, publish_time) = (message.log_time, message.publish_time);
            topics.get_mut(topic).unwrap().push(Written { log_time, publish_time, value });
        }
        let metadata = summary
            .metadata_indexes
            .iter()
            .map(|index| mcap::read::metadata(&bytes, index).unwrap())
            .map(|record| (record.name, record.metadata))
            .collect();
        Self { topics, metadata }
    }

    pub(crate) fn track(&self) -> &[Written] {
        &self.topics["/fused/track"]
    }

    /// The track's point nearest to `time_s` since [`super::trial_log::EPOCH_NS`].
    pub(crate) fn near(&self, time_s: f64) -> &Written {
        let at = super::trial_log::ns(time_s) as i64;
        self.track().iter().min_by_key(|w| (w.timestamp_ns() - at).abs()).unwrap()
    }
}

/// Fails unless all `parts` stand in `text`.
#[track_caller]
pub(crate) fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is missing in:\n{text}");
    }
}

/// The recordings in a folder of those that `TRACKFUSE_TEST_DATA` leads to.
pub(crate) fn logs(folder: &str) -> Vec<PathBuf> {
    let Some(data) = std::env::var_os("TRACKFUSE_TEST_DATA") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
        return Vec::new();
    };
    let entries = fs::read_dir(PathBuf::from(data).join(folder)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "mcap"));
    paths.sort();
    assert!(!paths.is_empty());
    paths
}
