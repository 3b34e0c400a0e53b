//! Remakes the tables and the plots of `docs/paper.md`: `cargo run --release --example paper`.

mod chart;
mod figures;
#[path = "../shared/page.rs"]
mod page;
mod remade;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// The page and its plots, each with what has to stand in it.
pub(crate) fn files() -> Result<Vec<(PathBuf, String)>, Box<dyn Error>> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let page = docs.join("paper.md");
    let filled = page::filled(&fs::read_to_string(&page)?, &remade::tables::all())?;
    let mut files = vec![(page, filled)];
    for (name, draw) in figures::FIGURES {
        files.push((docs.join("paper").join(name), draw()?));
    }
    Ok(files)
}

fn main() -> Result<(), Box<dyn Error>> {
    for (path, text) in files()? {
        fs::write(&path, text)?;
        println!("{}", path.display());
    }
    Ok(())
}
