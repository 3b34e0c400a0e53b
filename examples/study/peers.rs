//! Other people's smoothers on the same samples, by `peers.py`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::{fs, io};

use trackfuse::sample::Source;
use trackfuse::source;

use super::climbs::Climb;
use super::pool::Part;

/// The peers, as the script calls them.
pub(crate) const PEERS: [&str; 3] = ["spline", "RTS", "RTS + errors"];

/// Root mean square errors, of position and velocity in m and m/s, by family, peer and part.
pub(crate) type Rows = BTreeMap<(String, String, String), [f64; 2]>;

/// Writes a family's samples as they are fused, and the truth where somebody sees.
///
/// `FAMILY.samples.csv` has a row a sample, sensor 0 the datum, `FAMILY.truth.csv` a row an instant, parts counted
/// from 0; times count from the release.
pub(crate) fn write(folder: &Path, family: &str, climbs: &[Climb]) -> io::Result<()> {
    let columns = "time_s,px,py,pz,vx,vy,vz";
    let mut samples = format!("run,sensor,{columns},position_sigma,velocity_sigma\n");
    let mut truth = format!("run,part,{columns}\n");
    let row = |time_s: f64, p: [f64; 3], v: [f64; 3]| {
        let numbers: Vec<String> = p.iter().chain(&v).map(|x| format!("{x:.9}")).collect();
        format!("{time_s:.9},{}", numbers.join(","))
    };
    for (run, climb) in climbs.iter().enumerate() {
        let loaded = &climb.recording.loaded;
        let configs: Vec<_> = loaded.iter().map(|l| l.config.clone()).collect();
        let datum = source::datum(&configs);
        let from_release_s = climb.recording.origin.seconds_since(climb.release);
        let sources: Vec<&Source> = loaded.iter().map(|l| &l.source).collect();
        for (index, source) in sources.iter().enumerate() {
            // the datum first, the others behind it
            let sensor = (index + sources.len() - datum) % sources.len();
            for (position, velocity) in source.instants() {
                let Some((p, v)) = position.zip(velocity) else { continue };
                let row = row(p.time_s + from_release_s, p.value, v.value);
                // writing to a String can't fail
                let _ = writeln!(samples, "{run},{sensor},{row},{:.6},{:.6}", p.sigma[0], v.sigma[0]);
            }
        }
        for (p, v) in climb.truth.positions.iter().zip(&climb.truth.velocities) {
            let part = Part::at(p.time_s, climb.overlap_s, climb.unseen_s.0);
            if part != Part::Unseen {
                let _ = writeln!(truth, "{run},{},{}", part as usize, row(p.time_s, p.value, v.value));
            }
        }
    }
    fs::create_dir_all(folder)?;
    fs::write(folder.join(format!("{family}.samples.csv")), samples)?;
    fs::write(folder.join(format!("{family}.truth.csv")), truth)
}

/// Runs the script over such a folder; `python` needs numpy and scipy.
pub(crate) fn run(python: &Path, folder: &Path) -> Rows {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/study/peers.py");
    let output = Command::new(python).arg(script).arg(folder).output().expect("a Python");
    assert!(output.status.success(), "peers.py: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse().expect("a number");
        ((cells[0].into(), cells[1].into(), cells[2].into()), [number(3), number(4)])
    };
    text.lines().skip(1).map(row).collect()
}
