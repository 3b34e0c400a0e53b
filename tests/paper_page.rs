//! `docs/paper.md` and its plots are what the code makes. `TRACKFUSE_UPDATE_DOCS=1` writes them anew.

use std::fs;

#[path = "../examples/paper/main.rs"]
#[allow(dead_code)] // its main
mod paper;

#[test]
fn the_page_and_its_plots_are_those_of_this_code() {
    let update = std::env::var_os("TRACKFUSE_UPDATE_DOCS").is_some();
    for (path, text) in paper::files().expect("the page has a place for each table") {
        if update {
            fs::write(&path, text).expect("docs can be written");
            continue;
        }
        let same = fs::read_to_string(&path).is_ok_and(|stored| stored == text);
        let hint = "hint: `cargo run --release --example paper` writes it anew";
        assert!(same, "{} differs; {hint}", path.display());
    }
}

#[test]
fn every_plot_is_small_and_stands_in_the_page() {
    let files = paper::files().expect("the page has a place for each table");
    let page = &files[0].1;
    for (path, svg) in &files[1..] {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        assert!(page.contains(&format!("(paper/{name})")), "{name} is not in the page");
        assert!(svg.len() < 100_000, "{name}: {} bytes", svg.len());
    }
}
