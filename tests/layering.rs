//! The house's walls: who may know whom.

use std::fs;
use std::path::{Path, PathBuf};

/// Folder or file, and the words that must not stand in its code.
const WALLS: [(&str, &[&str]); 14] = [
    ("src/map.rs", &["crate::publish", "crate::export", "crate::log", "crate::fusion", "mcap", "std::fs"]),
    ("src/sample.rs", &["crate::", "mcap", "std::fs"]),
    ("src/track.rs", &["crate::log", "crate::estimate", "mcap", "std::fs"]),
    ("src/quality", &["crate::log", "crate::commands", "crate::config", "mcap", "std::fs"]),
    ("src/source", &["crate::commands", "crate::fusion", "crate::report", "clap", "std::fs"]),
    (
        "src/math",
        &["crate::estimate", "crate::log", "crate::sample", "crate::track", "mcap", "clap", "std::fs"],
    ),
    (
        "src/estimate",
        &["crate::log", "crate::commands", "crate::config", "mcap", "clap", "std::fs", "println!"],
    ),
    (
        "src/export",
        &["crate::log", "crate::commands", "crate::config", "mcap", "clap", "std::fs", "println!"],
    ),
    ("src/log", &["crate::estimate", "crate::commands", "crate::fusion", "clap", "println!"]),
    ("src/publish", &["crate::commands", "crate::config", "crate::report", "mcap", "clap", "std::fs"]),
    ("src/report", &["crate::log", "crate::commands", "mcap", "clap", "std::fs", "println!"]),
    (
        "src/fusion",
        &["crate::log", "crate::commands", "crate::config", "mcap", "clap", "std::fs", "println!"],
    ),
    ("src/inspect", &["crate::commands", "crate::fusion", "clap", "std::fs", "println!"]),
    ("src/simulate", &["crate::estimate", "crate::commands", "clap", "std::fs", "println!"]),
];

fn rust_files(at: &Path) -> Vec<PathBuf> {
    if at.is_file() {
        return vec![at.to_owned()];
    }
    let entries = fs::read_dir(at).expect("a folder of the tree").map(|e| e.expect("an entry").path());
    entries
        .flat_map(|p| {
            if p.is_dir() || p.extension().is_some_and(|e| e == "rs") { rust_files(&p) } else { Vec::new() }
        })
        .collect()
}

/// The code of a file: no comments, nothing behind the tests' mark, nothing of files that are all tests.
fn code(path: &Path) -> String {
    if path.ends_with("tests.rs") {
        return String::new();
    }
    let text = fs::read_to_string(path).expect("a source file");
    let before_tests = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().to_owned();
    before_tests.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

#[test]
fn no_layer_knows_what_it_must_not() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut seen = 0;
    for (place, forbidden) in WALLS {
        for file in rust_files(&root.join(place)) {
            seen += 1;
            let code = code(&file);
            for word in forbidden {
                assert!(!code.contains(word), "{} knows {word}", file.display());
            }
        }
    }
    assert!(seen > 30, "only {seen} files were looked at");
}

#[test]
fn nothing_but_main_and_the_commands_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in rust_files(&root.join("src")) {
        let inside = file.strip_prefix(root).expect("inside").display().to_string();
        let may_print = inside == "src/main.rs" || inside.starts_with("src/commands");
        assert!(may_print || !code(&file).contains("println!"), "{inside} prints");
    }
}
