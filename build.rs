//! Which commit the program is built from, for `trackfuse --version`: ` (0123456789ab)`, with a `+` where files
//! were changed since, and nothing where neither git nor cargo knows.
//!
//! It stands nowhere else. What the program writes names the version alone: the same input, config and version
//! give the same bytes, whoever built it.

use std::path::Path;
use std::process::Command;

/// What the program is made of.
const SOURCES: [&str; 5] = ["build.rs", "Cargo.toml", "Cargo.lock", "src", "schemas"];

fn main() {
    for path in SOURCES {
        println!("cargo::rerun-if-changed={path}");
    }
    let commit = of_the_tree().or_else(of_the_package).unwrap_or_default();
    println!("cargo::rustc-env=TRACKFUSE_COMMIT={commit}");
}

fn git(args: &[&str]) -> Option<String> {
    let ran = Command::new("git").args(args).output().ok().filter(|ran| ran.status.success())?;
    Some(String::from_utf8(ran.stdout).ok()?.trim().to_owned())
}

/// The commit of the work tree that begins here; a package in another project's tree is not of its commits.
fn of_the_tree() -> Option<String> {
    if !git(&["rev-parse", "--show-prefix"])?.is_empty() {
        return None;
    }
    // where HEAD, and the branch that it names, are kept
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]).unwrap_or_default();
    for name in ["HEAD", "packed-refs", &branch] {
        let path = git(&["rev-parse", "--git-path", name]).filter(|path| Path::new(path).is_file());
        if let Some(path) = path {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat())?;
    Some(format!(" ({commit}{})", if changed.is_empty() { "" } else { "+" }))
}

/// The commit that cargo notes in a package.
fn of_the_package() -> Option<String> {
    let noted = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let commit = noted.split_once("\"sha1\": \"")?.1.get(..12)?;
    Some(format!(" ({commit})"))
}
