//! The pages' commands do what the pages say. `TRACKFUSE_UPDATE_README=1` writes their outputs anew.

use std::fs;
use std::path::Path;

use super::trial::trackfuse;

/// The commands that run in a clone, each with the output that follows it.
fn examples(page: &str) -> Vec<(&str, &str)> {
    let commands = page.split("\n```sh\ncargo run --release -- ").skip(1);
    let examples = commands.filter_map(|rest| {
        let (command, rest) = rest.split_once("\n```\n")?;
        Some((command, rest.split_once("```text\n")?.1.split_once("```\n")?.0))
    });
    examples.collect()
}

#[test]
fn commands_of_the_pages_print_what_the_pages_show_and_again_when_run_again() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("sample_logs")).unwrap();
    for entry in fs::read_dir(root.join("sample_logs")).unwrap() {
        let entry = entry.unwrap();
        if !entry.file_name().to_string_lossy().ends_with(".fused.mcap") {
            fs::copy(entry.path(), folder.path().join("sample_logs").join(entry.file_name())).unwrap();
        }
    }
    for page in ["README.md", "docs/logs.md", "docs/usbl.md"] {
        let stored = fs::read_to_string(root.join(page)).unwrap();
        let updated = checked(&stored, folder.path());
        if updated != stored {
            fs::write(root.join(page), updated).unwrap();
        }
    }
}

/// The page, with its outputs made anew where that is asked for; fails where they differ and it isn't.
fn checked(page: &str, folder: &Path) -> String {
    let output = || fs::read(folder.join("sample_logs/steep_climb.fused.mcap")).ok();
    let mut updated = page.to_owned();
    let examples = examples(page);
    assert!(!examples.is_empty());
    for (command, shown) in examples {
        let args: Vec<&str> = command.split(' ').collect();
        let first = trackfuse(folder, &args);
        let bytes = output();
        let second = trackfuse(folder, &args);
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
                "the page's output differs; hint: TRACKFUSE_UPDATE_README=1 writes it anew"
            );
        }
    }
    updated
}
