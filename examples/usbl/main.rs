//! USBL dives with known truth through every method: the tables of `docs/usbl.md`.
//!
//! ```sh
//! cargo run --release --example usbl -- --page docs/usbl.md
//! ```
//!
//! Without `--page` the tables are printed. The same arguments give the same tables.

mod judge;
#[path = "../shared/page.rs"]
mod page;

use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use clap::Parser;
use judge::{ROWS, Row, Sum, followed, predicted, smoothed};
use trackfuse::estimate::usbl::causal::{Improved, ImprovedSettings, Paper, PaperSettings};

/// USBL dives with known truth through every method, as Markdown tables
#[derive(Parser)]
struct Arguments {
    /// Dives a row
    #[arg(long, default_value_t = 200)]
    runs: u64,
    /// The page whose tables are made anew, instead of printing them
    #[arg(long)]
    page: Option<PathBuf>,
}

/// What was to be reached, by row of [`ROWS`].
const TARGETS: [&str; 5] = ["1.5 / 12", "1.8 / 12", "1.8 / 13", "5 / 25, or a warning", "-"];

/// The paper's method, and the same with a memory of this many seconds: the best of 40 to 200 without wild fixes.
fn paper(memory_s: Option<f64>) -> Paper {
    Paper::new(PaperSettings { memory_s, ..PaperSettings::default() })
}
const MEMORY_S: f64 = 60.0;

fn improved() -> Improved {
    Improved::new(ImprovedSettings::default())
}

fn table(columns: &str, rows: impl Iterator<Item = String>) -> String {
    let mut text = format!("| {columns} |\n|{}\n", "---|".repeat(columns.split('|').count()));
    rows.for_each(|row| writeln!(text, "| {row} |").expect("a String takes all"));
    text
}

fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.1}", 100.0 * share) } else { "-".into() }
}

fn short(value: f64) -> String {
    if value < 20.0 { format!("{value:.2}") } else { format!("{value:.0}") }
}

fn errors(sums: &[Sum]) -> String {
    sums.iter().map(|sum| short(sum.rmse())).collect::<Vec<_>>().join(" / ")
}

fn coverage(sums: &[Sum]) -> String {
    sums.iter().map(|sum| percent(sum.coverage())).collect::<Vec<_>>().join(" / ")
}

/// The smoother beside the paper's method.
fn tracks(seeds: &Range<u64>) -> String {
    let columns = "outliers | dives | to reach, m | smoother, m | in its bands, % | wild fixes found, % | false alarms, % | \
                   dives that warn | worst dive without a warning, m | paper's method, causal, m | improved, causal, m";
    let row = |(row, target): (&Row, &str)| {
        let judged = smoothed(row, seeds.clone());
        [
            row.name.to_owned(),
            judged.dives.to_string(),
            target.to_owned(),
            errors(&judged.sums),
            coverage(&judged.sums),
            percent(judged.recall()),
            percent(judged.false_alarms()),
            judged.warned.to_string(),
            short(judged.worst_unwarned_m),
            errors(&followed(row, seeds.clone(), || paper(None))),
            errors(&followed(row, seeds.clone(), improved)),
        ]
        .join(" | ")
    };
    table(columns, ROWS.iter().zip(TARGETS).map(row))
}

/// Predictions 20, 60 and 180 s ahead.
fn predictions(seeds: &Range<u64>) -> String {
    let columns = "outliers | paper's method, m | with a memory of 60 s, m | improved, m | in its bands, %";
    let row = |row: &Row| {
        let better = predicted(row, seeds.clone(), improved);
        [
            row.name.to_owned(),
            errors(&predicted(row, seeds.clone(), || paper(None))),
            errors(&predicted(row, seeds.clone(), || paper(Some(MEMORY_S)))),
            errors(&better),
            coverage(&better),
        ]
        .join(" | ")
    };
    table(columns, ROWS[..4].iter().map(row))
}

fn main() -> Result<(), String> {
    let arguments = Arguments::parse();
    let [ours, fresh] = [1, 3001].map(|first| first..first + arguments.runs);
    let tables = vec![
        ("tracks".to_owned(), tracks(&ours)),
        ("predictions".to_owned(), predictions(&ours)),
        ("fresh tracks".to_owned(), tracks(&fresh)),
    ];
    if let Some(path) = &arguments.page {
        let old = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        return fs::write(path, page::filled(&old, &tables)?).map_err(|e| format!("{}: {e}", path.display()));
    }
    tables.iter().for_each(|(name, table)| println!("<!-- {name} -->\n\n{table}\n<!-- end {name} -->\n"));
    Ok(())
}
