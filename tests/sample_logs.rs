//! The stored sample logs are what their scenarios make. `TRACKFUSE_UPDATE_SAMPLES=1` writes them anew.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use trackfuse::simulate::{FAMILIES, Scenario, ScenarioFile, write_dive_log, write_log};

mod viewer_rules;

fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs");
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.to_string_lossy().ends_with(".scenario.toml"))
        .collect();
    paths.sort();
    paths
}

/// `steep_climb.scenario.toml` -> `steep_climb.mcap`
fn stored(scenario: &Path) -> PathBuf {
    scenario.with_extension("").with_extension("mcap")
}

fn log_of(scenario: &ScenarioFile) -> Vec<u8> {
    let mut log = Cursor::new(Vec::new());
    match scenario {
        ScenarioFile::Climb(scenario) => drop(write_log(scenario, &mut log).unwrap()),
        ScenarioFile::Dive(scenario) => drop(write_dive_log(scenario, &mut log).unwrap()),
    }
    log.into_inner()
}

#[test]
fn every_sample_log_is_what_its_scenario_makes() {
    let update = std::env::var_os("TRACKFUSE_UPDATE_SAMPLES").is_some();
    let scenarios = scenarios();
    assert_eq!(scenarios.len(), 4, "{scenarios:?}");
    for scenario in scenarios {
        let stored = stored(&scenario);
        let log = log_of(&ScenarioFile::from_toml(&fs::read_to_string(&scenario).unwrap()).unwrap());
        if update {
            fs::write(&stored, log).unwrap();
            continue;
        }
        let same = fs::read(&stored).unwrap() == log;
        assert!(same, "{} differs; hint: TRACKFUSE_UPDATE_SAMPLES=1 writes it anew", stored.display());
    }
}

#[test]
fn sample_logs_are_small_indexed_and_have_the_channels_they_promise() {
    for path in scenarios() {
        let bytes = fs::read(stored(&path)).unwrap();
        assert!(bytes.len() < 2_000_000, "{}: {} bytes", path.display(), bytes.len());
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        assert!(summary.chunk_indexes.len() > 2, "{}", path.display());
        assert_eq!(summary.attachment_indexes.len(), 2);
        assert_eq!(summary.metadata_indexes.len(), 2);
        let topics: Vec<&str> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();
        let name = path.file_name().unwrap().to_string_lossy();
        let promised: &[&str] = match name.trim_end_matches(".scenario.toml") {
            "usbl_dive" => &["/usbl/fix", "/ship/navigation", "/vehicle/depth"],
            "single_source" => &["/beacon/track", "/sonar/image", "/ship/log"],
            _ => &["/tether/track", "/beacon/track", "/sonar/image", "/ship/log"],
        };
        for topic in promised.iter().chain(&["/reference/ins"]) {
            assert!(topics.contains(topic), "{topic} is missing in {topics:?}");
        }
        assert_eq!(topics.contains(&"/tether/track"), promised.contains(&"/tether/track"), "{topics:?}");
        let times: Vec<u64> =
            mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap().log_time).collect();
        assert!(times.is_sorted(), "{}", path.display());
    }
}

#[test]
fn viewers_show_every_channel_of_simulated_logs() {
    for family in FAMILIES {
        let log = log_of(&ScenarioFile::Climb(Box::new(Scenario::family(family).unwrap())));
        assert_eq!(viewer_rules::violations(&log, |_| true), [""; 0], "{family}");
    }
    for fixes_as in ["polar", "geodetic"] {
        let dive = format!("[dive]\nduration_s = 600.0\n[messages]\nfixes_as = \"{fixes_as}\"");
        let log = log_of(&ScenarioFile::from_toml(&dive).unwrap());
        assert_eq!(viewer_rules::violations(&log, |_| true), [""; 0], "{fixes_as}");
    }
    for path in scenarios() {
        let log = fs::read(stored(&path)).unwrap();
        assert_eq!(viewer_rules::violations(&log, |_| true), [""; 0], "{}", path.display());
    }
}
