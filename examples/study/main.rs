//! Every method over many climbs with known truth: the yardstick of this program's accuracy.
//!
//! ```sh
//! cargo run --release --example study -- --data ../shared/data --peers python3 --page docs/accuracy.md
//! ```
//!
//! makes every table of that page. Without `--page` they are printed; without data the parts that need some are left
//! out, without a Python that has numpy and scipy the peers are. The same arguments give the same tables.

mod climbs;
mod family;
mod flight;
#[path = "../shared/page.rs"]
mod page;
mod peers;
mod pool;
mod tables;

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use climbs::{Climb, LAWLESS};
use family::{CARRIED_ON, Family, Method, PAPERS, REGISTERED};
use page::Tables;
use trackfuse::simulate::FAMILIES;

/// Every method over many climbs with known truth, as Markdown tables
#[derive(Parser)]
struct Arguments {
    /// What to make [default: all]
    sections: Vec<Section>,
    /// Runs a family
    #[arg(long, default_value_t = 200)]
    runs: u64,
    /// Folder with `climbs/FAMILY_K.mcap`, their `.truth.csv` and `.truth.json`, and `flight_two_sensors.mcap`
    #[arg(long)]
    data: Option<PathBuf>,
    /// A Python with numpy and scipy, to run peers.py
    #[arg(long)]
    peers: Option<PathBuf>,
    /// Keep the samples that the peers get in this folder
    #[arg(long)]
    samples: Option<PathBuf>,
    /// The page whose tables are made anew, instead of printing them
    #[arg(long)]
    page: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Section {
    /// Our own simulator, seeds from 1, with all methods
    Ours,
    /// Seeds from 1001, on which nothing was chosen
    Fresh,
    /// AR(1) noise on the beacon
    Correlated,
    /// Logs of another simulator
    Climbs,
    /// The real flight
    Flight,
}

/// Families with AR(1) noise on the beacon.
const CORRELATED: [&str; 6] =
    ["nominal@0.5", "nominal@0.8", "async@0.5", "async@0.8", "single@0.5", "single@0.8"];

/// The folder of what goes to the peers, removed where nobody asked for it.
struct Samples {
    folder: PathBuf,
    _own: Option<tempfile::TempDir>,
}

impl Samples {
    fn of(arguments: &Arguments, section: &str) -> Option<Self> {
        if let Some(folder) = &arguments.samples {
            return Some(Self { folder: folder.join(section), _own: None });
        }
        arguments.peers.as_ref()?;
        let own = tempfile::tempdir().expect("a temporary folder");
        Some(Self { folder: own.path().to_owned(), _own: Some(own) })
    }
}

/// What every family of a section comes to, with its samples written for the peers.
fn judge(
    names: &[&str],
    climbs: impl Fn(&str) -> Vec<Climb>,
    methods: &[Method],
    samples: Option<&Samples>,
) -> Vec<Family> {
    let family = |name: &&str| {
        eprintln!("{name}");
        let climbs = climbs(name);
        if let Some(samples) = samples.filter(|_| FAMILIES.contains(name)) {
            peers::write(&samples.folder, name, &climbs).expect("the samples can be written");
        }
        Family::judge(name, &climbs, methods)
    };
    names.iter().map(family).collect()
}

/// The tables of climbs, `name` before each of theirs.
fn with_peers(
    name: &str,
    names: &[&str],
    climbs: impl Fn(&str) -> Vec<Climb>,
    arguments: &Arguments,
) -> Tables {
    let methods: Vec<Method> = PAPERS.into_iter().chain([REGISTERED]).chain(CARRIED_ON).collect();
    let samples = Samples::of(arguments, name);
    let families = judge(names, climbs, &methods, samples.as_ref());
    let rows =
        samples.as_ref().zip(arguments.peers.as_ref()).map(|(s, python)| peers::run(python, &s.folder));
    let usual = &families[..FAMILIES.len()];
    let papers = PAPERS.map(|(method, _)| method);
    let mut all = [REGISTERED.0].to_vec();
    all.extend(papers);
    let mut tables = vec![
        ("targets", tables::targets(usual, rows.as_ref(), &[papers[0], papers[3], papers[2]])),
        ("errors", tables::errors(usual, &all)),
        ("bands", tables::bands(usual)),
        ("unseen", tables::unseen(&families)),
        ("points", tables::points(&families)),
    ];
    tables.extend(rows.map(|rows| ("equivalence", tables::equivalence(usual, &rows))));
    tables.into_iter().map(|(table, text)| (format!("{name} {table}"), text)).collect()
}

/// The tables of the default method alone.
fn alone(name: &str, names: &[&str], climbs: impl Fn(&str) -> Vec<Climb>) -> Tables {
    let families = judge(names, climbs, &[REGISTERED], None);
    vec![
        (format!("{name} errors"), tables::errors(&families, &[REGISTERED.0])),
        (format!("{name} bands"), tables::bands(&families)),
    ]
}

fn section(section: Section, arguments: &Arguments) -> Tables {
    let data = |name: &str| arguments.data.as_deref().map(|data: &Path| data.join(name));
    let simulated = |first_seed| move |name: &str| climbs::simulated(name, first_seed, arguments.runs);
    match section {
        Section::Ours => {
            let names: Vec<&str> = FAMILIES.into_iter().chain(LAWLESS).collect();
            with_peers("ours", &names, simulated(1), arguments)
        }
        Section::Fresh => alone("fresh", &FAMILIES, simulated(1001)),
        Section::Correlated => alone("correlated", &CORRELATED, simulated(1)),
        Section::Climbs => data("climbs").map_or(Vec::new(), |folder| {
            with_peers("climbs", &FAMILIES, |name| climbs::recorded(&folder, name), arguments)
        }),
        Section::Flight => data("flight_two_sensors.mcap")
            .map_or(Vec::new(), |log| vec![("flight".into(), tables::flight(&flight::judge(&log)))]),
    }
}

fn main() -> Result<(), String> {
    let arguments = Arguments::parse();
    let all = Section::value_variants();
    let sections = if arguments.sections.is_empty() { all } else { &arguments.sections };
    for &which in sections {
        let tables = section(which, &arguments);
        if tables.is_empty() {
            eprintln!("skipped: {which:?} needs --data");
        }
        if let Some(path) = &arguments.page {
            let old = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
            fs::write(path, page::filled(&old, &tables)?).map_err(|e| format!("{}: {e}", path.display()))?;
        } else {
            tables
                .iter()
                .for_each(|(name, table)| println!("<!-- {name} -->\n\n{table}\n<!-- end {name} -->\n"));
        }
    }
    Ok(())
}
