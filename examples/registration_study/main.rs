//! Registration judged against the truth, family by family: errors (root mean square of the 3-D error, m and m/s) and
//! what the nominal 95 % bands cover, in phase 1, in the overlap and in phase 2.
//!
//! ```text
//! cargo run --release --example registration_study -- simulated [RUNS [FAMILY[@CORRELATION]...]]
//! cargo run --release --example registration_study -- climbs FOLDER
//! cargo run --release --example registration_study -- flight LOG TRUTH_PATH
//! ```
//!
//! `simulated` draws runs of our own simulator, seeds 1 to RUNS (200), with noise of the beacon correlated from sample
//! to sample where a number stands behind the family. `climbs` reads logs with the truth beside them, `flight` a log
//! that holds the truth itself.

mod recorded;
mod simulated;
mod tally;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        [] | ["simulated"] => simulated::study(200, &[]),
        ["simulated", runs, families @ ..] => match runs.parse() {
            Ok(runs) => simulated::study(runs, families),
            Err(error) => {
                eprintln!("{runs:?} is no number of runs: {error}");
                return ExitCode::from(2);
            }
        },
        ["climbs", folder] => recorded::climbs(folder.as_ref()),
        ["flight", log, truth] => recorded::flight(log.as_ref(), truth),
        _ => {
            eprintln!("expected `simulated [RUNS [FAMILY...]]`, `climbs FOLDER` or `flight LOG TRUTH_PATH`");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}
