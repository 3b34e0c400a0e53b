//! The log of a climb: its sensors' tracks, channels of no concern, and the truth.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use nalgebra::Vector3;

use super::bystanders;
use super::error::SimulateError;
use super::log::{Channel, Recorded, decimal, entries, write};
use super::scenario::{RecordingScenario, Scenario};
use super::sensor_channel::sensor_channel;
use super::sensors::SensorRecord;
use super::{Simulation, simulate};
use crate::time::Time;

/// Simulates a scenario and writes its log.
///
/// # Errors
///
/// Those of [`simulate`], before anything is written; [`SimulateError::Log`] where writing fails.
pub fn write_log<W: Write + Seek>(scenario: &Scenario, writer: W) -> Result<Simulation, SimulateError> {
    let simulation = simulate(scenario)?;
    write_simulation(scenario, &simulation, writer)?;
    Ok(simulation)
}

/// Writes the log of a simulation of `scenario`: the same bytes for the same arguments.
///
/// # Errors
///
/// [`SimulateError::Log`] where writing fails, [`SimulateError::Serialize`] for a scenario that TOML can't
/// hold.
pub fn write_simulation<W: Write + Seek>(
    scenario: &Scenario,
    simulation: &Simulation,
    writer: W,
) -> Result<(), SimulateError> {
    let release = Time::from_ns(scenario.epoch_ns);
    let RecordingScenario { encoding, bystanders, .. } = scenario.recording;
    let mut channels: Vec<Channel> =
        simulation.sensors.iter().map(|sensor| sensor_channel(sensor, encoding, release)).collect();
    if bystanders {
        channels.extend(bystanders::channels(scenario, simulation));
    }

    let recorded = Recorded {
        name: &scenario.name,
        release,
        begin: release.plus_seconds(-scenario.recording.lead_s),
        // the bystanders are in encodings of their own
        profile: if bystanders { "" } else { encoding.profile() },
        chunk_bytes: scenario.recording.chunk_bytes,
        channels,
        truth: truth(scenario, simulation),
        notes: notes(simulation),
        scenario: scenario.to_toml()?,
    };
    write(recorded, writer)
}

/// What a real log wouldn't know: phases, characteristic points and systematic errors.
fn truth(scenario: &Scenario, simulation: &Simulation) -> BTreeMap<String, String> {
    let phases = &simulation.phases;
    let mut map = entries([
        ("name", scenario.name.clone()),
        ("description", scenario.description.clone()),
        ("seed", scenario.seed.to_string()),
        ("epoch_ns", scenario.epoch_ns.to_string()),
        ("t0_s", decimal(phases.t0_s)),
        ("t1_s", decimal(phases.t1_s)),
        ("t2_s", decimal(phases.t2_s)),
        ("t3_s", decimal(phases.t3_s)),
        ("overlap_begin_s", decimal(phases.overlap_begin_s)),
        ("overlap_end_s", decimal(phases.overlap_end_s)),
    ]);
    for (k, point) in (1..).zip(&simulation.characteristic_points) {
        map.insert(format!("point_{k}_t_s"), decimal(point.t_s));
        map.insert(format!("point_{k}_z_m"), decimal(point.z_m));
        map.insert(format!("point_{k}_vz_m_s"), decimal(point.vz_m_s));
    }
    for SensorRecord { name, errors, .. } in &simulation.sensors {
        let list = |v: &Vector3<f64>| format!("[{}, {}, {}]", decimal(v.x), decimal(v.y), decimal(v.z));
        map.insert(format!("{name}_bias_m"), list(&errors.bias_m));
        map.insert(format!("{name}_velocity_bias_m_s"), list(&errors.velocity_bias_m_s));
        map.insert(format!("{name}_drift_m_s"), list(&errors.drift_m_s));
        map.insert(format!("{name}_scale"), decimal(errors.scale));
        map.insert(format!("{name}_clock_offset_s"), decimal(errors.clock_offset_s));
    }
    map
}

fn notes(simulation: &Simulation) -> String {
    let start = simulation.trajectory.at(0.0).position;
    format!(
        "Deployment notes\n\
         Vehicle on the carrier at {:.0} m depth, tether gauge zeroed on the release point.\n\
         Sea state 2, current below 0.1 m/s. Beacon interrogation started before release.\n\
         This is a simulated trial: scenario.toml made it.\n",
        -start.z
    )
}
