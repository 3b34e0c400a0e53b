//! The program is killed while it writes. `TRACKFUSE_CRASHES=500` does it so often: see CONTRIBUTING.md.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::trial::{Trial, assert_says, trackfuse};
use super::trial_log::{Sensor, TrialLog, ns};

const UNDO: &str = "in.mcap.trackfuse-undo";
const PART: &str = ".out.mcap.trackfuse-part";
const IN_PLACE: &[&str] = &["fuse", "in.mcap", "--config", "trial.toml", "--in-place"];
const NEW_FILE: &[&str] = &["fuse", "in.mcap", "--config", "trial.toml", "-o", "out.mcap"];
/// Quickly computed, and a large track: what is written takes its time.
const CONFIG: &str = "[output]\nrate_hz = 1000.0\ncompression = \"none\"\n[fusion]\nmethod = \"gdf\"\n\
                      estimate = []\n[extrapolation]\nhorizon_s = 0\n";

/// Two sensors, and some MB of pictures.
fn large_log() -> Vec<u8> {
    let mut log = TrialLog::with(mcap::WriteOptions::new().compression(None).chunk_size(Some(1 << 20)));
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(5.0, 13.0, 2));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut picture = vec![0; 1 << 18];
    for i in 0..64 {
        rng.fill_bytes(&mut picture);
        log.raw("/camera", [ns(f64::from(i) * 0.2); 2], &picture);
    }
    log.finish()
}

fn spawn(folder: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trackfuse"));
    command.args(args).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Waits until `name` is there, or the child is gone.
fn wait_for(child: &mut Child, name: &Path) {
    while !name.exists() && child.try_wait().unwrap().is_none() {
        std::hint::spin_loop();
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn crash_of_a_killed_run_costs_nobody_the_original() {
    let crashes: u32 = std::env::var("TRACKFUSE_CRASHES").map_or(20, |n| n.parse().unwrap());
    let original = large_log();
    let trial = Trial::of(&original).config(CONFIG);
    let (log, out) = (trial.path("in.mcap"), trial.path("out.mcap"));
    let read = |name: &Path| fs::read(name).unwrap();
    let begun = Instant::now();
    let ran = trackfuse(trial.folder(), NEW_FILE);
    let whole_run = begun.elapsed();
    assert!(matches!(ran.code, 0 | 3), "{ran:#?}");
    let added = read(&out);
    fs::remove_file(&out).unwrap();
    fs::write(trial.path("wanted.mcap"), &added).unwrap();

    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(crashes));
    let [mut cut_off, mut done, mut left] = [0; 3];
    for crash in 0..crashes {
        let in_place = crash % 2 == 0;
        let (args, sign) = if in_place { (IN_PLACE, UNDO) } else { (NEW_FILE, PART) };
        let mut child = spawn(trial.folder(), args);
        if crash % 4 < 2 {
            // while it writes
            wait_for(&mut child, &trial.path(sign));
            sleep(rng.random_range(Duration::ZERO..whole_run / 10));
        } else {
            sleep(rng.random_range(Duration::ZERO..whole_run));
        }
        let _ = child.kill();
        child.wait().unwrap();

        if !in_place {
            assert!(read(&log) == original, "{crash}");
            left += u32::from(trial.path(PART).exists());
            if out.exists() {
                done += 1;
                assert!(read(&out) == added, "{crash}: a half-written output under its final name");
                fs::remove_file(&out).unwrap();
            }
            if crash % 8 == 1 {
                assert_eq!(trackfuse(trial.folder(), NEW_FILE).code, ran.code);
                assert!(read(&out) == added, "{crash}");
                fs::remove_file(&out).unwrap();
                assert_eq!(names(trial.folder()), ["in.mcap", "trial.toml", "wanted.mcap"], "{crash}");
            }
            continue;
        }
        if trial.path(UNDO).exists() {
            cut_off += 1;
            let inspected = trackfuse(trial.folder(), &["inspect", "in.mcap"]);
            assert_eq!(inspected.code, 1);
            assert_says(&inspected.stderr, &["cut off", "hint: `trackfuse restore in.mcap`"]);
            if crash % 8 == 0 {
                let again = trackfuse(trial.folder(), IN_PLACE);
                assert_eq!(again.code, ran.code);
                assert_says(&again.stderr, &["note: a run that added to in.mcap was cut off"]);
                assert!(read(&log) == added, "{crash}");
                assert_eq!(trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place"]).code, 0);
            } else {
                assert_eq!(trackfuse(trial.folder(), &["restore", "in.mcap"]).code, 0);
            }
        } else if read(&log) != original {
            done += 1;
            assert!(read(&log) == added, "{crash}: neither the original nor the output");
            assert_eq!(trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place"]).code, 0);
        }
        assert!(read(&log) == original, "{crash}: the original is lost");
        assert!(!trial.path(UNDO).exists());
    }
    println!(
        "{crashes} killed: {cut_off} while the log was changed, {left} while a file was written, {done} too late"
    );
    assert!(cut_off > 0 && left > 0, "no run was hit while it wrote");
}

#[test]
fn crash_by_ctrl_c_takes_the_output_back() {
    let original = large_log();
    let trial = Trial::of(&original).config(CONFIG);
    let mut heard = 0;
    for crash in 0..6 {
        let (args, sign) = if crash % 2 == 0 { (IN_PLACE, UNDO) } else { (NEW_FILE, PART) };
        let mut child = spawn(trial.folder(), args);
        wait_for(&mut child, &trial.path(sign));
        let signal = if crash < 3 { "-INT" } else { "-TERM" };
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        if status.success() || status.code() == Some(3) {
            // it came too late
            assert_eq!(trackfuse(trial.folder(), &["restore", "in.mcap", "--in-place"]).code, crash % 2);
            let _ = fs::remove_file(trial.path("out.mcap"));
        } else {
            heard += 1;
            assert!(std::os::unix::process::ExitStatusExt::signal(&status).is_some(), "{status}");
        }
        assert!(fs::read(trial.path("in.mcap")).unwrap() == original, "{crash}");
        assert_eq!(names(trial.folder()), ["in.mcap", "trial.toml"], "{crash}");
    }
    assert!(heard > 0, "no signal came while something was written");
}
