//! `trackfuse simulate`: scenario -> truth and sensors -> log.

use std::path::Path;

use serde_json::json;

use super::{CommandError, Outcome, say};
use crate::cli::Simulate;
use crate::log::write_new;
use crate::simulate::{Scenario, simulate as run, write_simulation};

/// Makes the log of a scenario file.
///
/// # Errors
/// [`CommandError`] for a scenario that can't be read or is out of range, and an output that can't be
/// written.
pub fn simulate(args: &Simulate) -> Result<Outcome, CommandError> {
    let read = |path: &Path| {
        std::fs::read_to_string(path)
            .map_err(|source| CommandError::File { path: path.display().to_string(), source })
    };
    let of_file =
        |error| CommandError::Scenario { path: args.scenario.display().to_string(), error: Box::new(error) };
    let scenario = Scenario::from_toml(&read(&args.scenario)?).map_err(of_file)?;
    let simulation = run(&scenario).map_err(of_file)?;
    let len = write_new(&args.output, args.force, |file| {
        write_simulation(&scenario, &simulation, file).map_err(CommandError::from)
    })?;

    let end = simulation.phases.t3_s;
    let counts: Vec<String> =
        simulation.sensors.iter().map(|s| format!("{} {}", s.name, s.samples.len())).collect();
    let output = args.output.display().to_string();
    let text = format!(
        "{} -> {output} ({len} bytes): {end:.2} s of truth; samples: {}\n",
        args.scenario.display(),
        counts.join(", ")
    );
    let points: Vec<_> = simulation
        .characteristic_points
        .iter()
        .map(|p| json!({"time_s": p.t_s, "z_m": p.z_m, "vertical_speed_m_s": p.vz_m_s}))
        .collect();
    let summary = json!({
        "scenario": scenario.name,
        "output": output,
        "bytes": len.to_string(),
        "t0_ns": scenario.epoch_ns.to_string(),
        "duration_s": end,
        "samples": simulation.sensors.iter().map(|s| (s.name.clone(), s.samples.len().into())).collect::<serde_json::Map<_, _>>(),
        "characteristic_points": points,
    });
    say(args.voice, &text, &summary, &[]);
    Ok(Outcome::Done)
}
