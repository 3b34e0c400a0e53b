//! `trackfuse simulate`: scenario -> truth and sensors -> log.

use std::path::Path;

use serde_json::{Value, json};

use super::{CommandError, Outcome, say};
use crate::cli::Simulate;
use crate::log::write_new;
use crate::simulate::{
    DiveScenario, Scenario, ScenarioFile, SimulateError, simulate as simulate_climb, simulate_dive,
    write_dive, write_simulation,
};

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
    let text = read(&args.scenario)?;
    match ScenarioFile::from_toml(&text).map_err(|error| of_file(args, error))? {
        ScenarioFile::Climb(scenario) => climb(args, &scenario),
        ScenarioFile::Dive(scenario) => dive(args, &scenario),
    }
}

fn of_file(args: &Simulate, error: SimulateError) -> CommandError {
    CommandError::Scenario { path: args.scenario.display().to_string(), error: Box::new(error) }
}

fn climb(args: &Simulate, scenario: &Scenario) -> Result<Outcome, CommandError> {
    let simulation = simulate_climb(scenario).map_err(|error| of_file(args, error))?;
    let len = write_new(&args.output, args.force, |file| {
        write_simulation(scenario, &simulation, file).map_err(CommandError::from)
    })?;
    let made = Made {
        name: &scenario.name,
        epoch_ns: scenario.epoch_ns,
        duration_s: simulation.phases.t3_s,
        samples: simulation.sensors.iter().map(|s| (s.name.as_str(), s.samples.len())).collect(),
        len,
    };
    let points: Vec<_> = simulation
        .characteristic_points
        .iter()
        .map(|p| json!({"time_s": p.t_s, "z_m": p.z_m, "vertical_speed_m_s": p.vz_m_s}))
        .collect();
    tell(args, &made, "", [("characteristic_points", points.into())]);
    Ok(Outcome::Done)
}

fn dive(args: &Simulate, scenario: &DiveScenario) -> Result<Outcome, CommandError> {
    let dive = simulate_dive(scenario).map_err(|error| of_file(args, error))?;
    let len = write_new(&args.output, args.force, |file| {
        write_dive(scenario, &dive, file).map_err(CommandError::from)
    })?;
    let mut samples = vec![("usbl", dive.messages.len()), ("ship", dive.ship.len())];
    samples.extend(scenario.depth.enabled.then_some(("depth", dive.depths.len())));
    samples.extend(dive.reference.iter().map(|r| ("reference", r.samples.len())));
    let made =
        Made { name: &scenario.name, epoch_ns: scenario.epoch_ns, duration_s: dive.end_s, samples, len };
    let (counts, deepest_m) = (dive.counts(), dive.deepest_m());
    let silence = dive.record.silence_s.map_or_else(
        || "no silence".to_owned(),
        |[begin_s, end_s]| format!("silence from {begin_s:.0} s to {end_s:.0} s"),
    );
    let text = format!(
        "down to {deepest_m:.0} m; {} fixes: {} wild, {} late, {} repeated; {silence}\n",
        counts.fixes, counts.wild, counts.late, counts.repeated
    );
    let fixes = json!({
        "total": counts.fixes, "wild": counts.wild, "late": counts.late, "repeated": counts.repeated,
    });
    let more =
        [("deepest_m", deepest_m.into()), ("fixes", fixes), ("silence_s", json!(dive.record.silence_s))];
    tell(args, &made, &text, more);
    Ok(Outcome::Done)
}

/// What there is to say of every simulated log.
struct Made<'a> {
    name: &'a str,
    epoch_ns: i64,
    duration_s: f64,
    /// Samples by sensor.
    samples: Vec<(&'a str, usize)>,
    /// Of the log, bytes.
    len: u64,
}

/// Prints what was made, and what `more` there is to say of it.
fn tell<const N: usize>(args: &Simulate, made: &Made, text: &str, more: [(&str, Value); N]) {
    let &Made { name, epoch_ns, duration_s, ref samples, len } = made;
    let output = args.output.display().to_string();
    let counts: Vec<String> = samples.iter().map(|(sensor, count)| format!("{sensor} {count}")).collect();
    let text = format!(
        "{} -> {output} ({len} bytes): {duration_s:.2} s of truth; samples: {}\n{text}",
        args.scenario.display(),
        counts.join(", ")
    );
    let mut summary = json!({
        "scenario": name,
        "output": output,
        "bytes": len.to_string(),
        "t0_ns": epoch_ns.to_string(),
        "duration_s": duration_s,
        "samples": samples.iter().map(|&(sensor, count)| (sensor.to_owned(), count.into())).collect::<serde_json::Map<_, _>>(),
    });
    for (key, value) in more {
        summary[key] = value;
    }
    say(args.voice, &text, &summary, &[]);
}
