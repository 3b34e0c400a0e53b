//! The README's command does what the README says. `TRACKFUSE_UPDATE_README=1` writes its output anew.

use std::fs;
use std::path::Path;

use super::trial::trackfuse;

/// What stands in the first block of that language.
fn block<'t>(text: &'t str, language: &str) -> &'t str {
    let start = format!("\n```{language}\n");
    let from = text.find(&start).expect("a block") + start.len();
    let len = text[from..].find("```\n").expect("its end");
    &text[from..][..len]
}

#[test]
fn readme_command_prints_what_the_readme_shows_and_again_when_run_again() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let command = block(&readme, "sh").trim();
    let args = command.strip_prefix("cargo run --release -- ").expect("the program's arguments");
    let args: Vec<&str> = args.split(' ').collect();

    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("sample_logs")).unwrap();
    for entry in fs::read_dir(root.join("sample_logs")).unwrap() {
        let entry = entry.unwrap();
        if !entry.file_name().to_string_lossy().ends_with(".fused.mcap") {
            fs::copy(entry.path(), folder.path().join("sample_logs").join(entry.file_name())).unwrap();
        }
    }
    let first = trackfuse(folder.path(), &args);
    let output = folder.path().join("sample_logs/steep_climb.fused.mcap");
    let bytes = fs::read(&output).unwrap();
    let second = trackfuse(folder.path(), &args);
    assert_eq!((first.code, second.code), (3, 3), "{first:#?}");
    assert_eq!(first.stdout, second.stdout);
    assert!(bytes == fs::read(&output).unwrap(), "the output differs from run to run");

    if std::env::var_os("TRACKFUSE_UPDATE_README").is_some() {
        let updated = readme.replacen(block(&readme, "text"), &first.stdout, 1);
        fs::write(root.join("README.md"), updated).unwrap();
        return;
    }
    let hint = "TRACKFUSE_UPDATE_README=1 writes it anew";
    assert_eq!(first.stdout, block(&readme, "text"), "the README's output differs; hint: {hint}");
}
