//! Every method over many climbs with known truth: the yardstick of this program's accuracy.
//!
//! ```sh
//! cargo run --release --example study                                       # 200 runs a family of our own simulator
//! cargo run --release --example study -- --climbs ../shared/data/climbs     # logs of another's
//! ```
//!
//! prints the tables of `docs/accuracy.md`. The same arguments give the same tables.

mod climbs;
mod family;
mod tables;

use std::path::PathBuf;

use clap::Parser;
use family::Family;
use trackfuse::simulate::FAMILIES;

/// Every method over many climbs with known truth, as Markdown tables
#[derive(Parser)]
struct Arguments {
    /// Runs a family
    #[arg(long, default_value_t = 200)]
    runs: u64,
    /// Seed of the first run
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// A folder of `FAMILY_K.mcap` with `.truth.csv` and `.truth.json`, instead of simulating
    #[arg(long)]
    climbs: Option<PathBuf>,
}

fn main() {
    let arguments = Arguments::parse();
    let families: Vec<Family> = FAMILIES
        .iter()
        .map(|name| match &arguments.climbs {
            Some(folder) => Family::judge(name, climbs::recorded(folder, name)),
            None => Family::judge(name, climbs::simulated(name, arguments.first_seed, arguments.runs)),
        })
        .collect();
    print!("{}", tables::render(&families));
}
