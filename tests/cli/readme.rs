//! The README's command does what the README says. `TRACKFUSE_UPDATE_README=1` writes its output anew.

use std::fs;
use std::path::Path;

use super::trial::trackfuse;

/// The commands that run in a clone, each with the output that follows it.
fn examples(readme: &str) -> Vec<(&str, &str)> {
    let commands = readme.split("\n```sh\ncargo run --release -- ").skip(1);
    let examples = commands.filter_map(|rest| {
        let (command, rest) = rest.split_once("\n```\n")?;
        Some((command, rest.split_once("```text\n")?.1.split_once("```\n")?.0))
    });
    examples.collect()
}

#[test]
fn readme_commands_print_what_the_readme_shows_and_again_when_run_again() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("sample_logs")).unwrap();
    for entry in fs::read_dir(root.join("sample_logs")).unwrap() {
        let entry = entry.unwrap();
        if !entry.file_name().to_string_lossy().ends_with(".fused.mcap") {
            fs::copy(entry.path(), folder.path().join("sample_logs").join(entry.file_name())).unwrap();
        }
    }
    let output = || fs::read(folder.path().join("sample_logs/steep_climb.fused.mcap")).unwrap();
    let mut updated = readme.clone();
    let examples = examples(&readme);
    assert!(examples.len() > 1);
    for (command, shown) in examples {
        let args: Vec<&str> = command.split(' ').collect();
        let first = trackfuse(folder.path(), &args);
        let bytes = output();
        let second = trackfuse(folder.path(), &args);
        assert_eq!(first.code, 0, "{first:#?}");
        assert_eq!((first.code, &first.stdout), (second.code, &second.stdout));
        assert!(bytes == output(), "the output differs from run to run");
        if std::env::var_os("TRACKFUSE_UPDATE_README").is_some() {
            let (before, rest) = updated.split_once(command).unwrap();
            let between = rest.split_once("```text\n").unwrap().0;
            let behind = &rest[between.len() + "```text\n".len() + shown.len()..];
            updated = format!("{before}{command}{between}```text\n{}{behind}", first.stdout);
        } else {
            assert_eq!(
                first.stdout, shown,
                "the README's output differs; hint: TRACKFUSE_UPDATE_README=1 writes it anew"
            );
        }
    }
    if updated != readme {
        fs::write(root.join("README.md"), updated).unwrap();
    }
}
