//! The simulator as a whole: the truth's numbers, the sensors' shares, the scenario's checks, the log's
//! bytes.

use std::io::Cursor;
use std::path::PathBuf;

use nalgebra::Vector3;

use super::*;

fn family(name: &str, seed: u64) -> Scenario {
    Scenario { seed, ..Scenario::family(name).unwrap() }
}

fn log_bytes(scenario: &Scenario) -> Vec<u8> {
    let mut log = Cursor::new(Vec::new());
    write_log(scenario, &mut log).unwrap();
    log.into_inner()
}

fn peak_m_s(simulation: &Simulation) -> f64 {
    simulation.truth.iter().map(|row| row.state.velocity.norm()).fold(0.0, f64::max)
}

/// A scenario whose sensors see the truth as it is.
fn noise_free() -> Scenario {
    let mut scenario = family("async", 4);
    for sensor in [&mut scenario.tether, &mut scenario.beacon] {
        (sensor.position_sigma_m, sensor.velocity_sigma_m_s) = (0.0, 0.0);
    }
    scenario
}

/// A scenario with a sensor that samples long enough for its shares to be counted.
fn many_samples(change: impl FnOnce(&mut SensorScenario)) -> SensorRecord {
    let mut scenario = Scenario::default();
    scenario.tether.rate_hz = 10_000.0;
    (scenario.tether.begin_s, scenario.tether.end_s) = (Some(0.0), Some(5.0));
    change(&mut scenario.tether);
    simulate(&scenario).unwrap().sensor("tether").unwrap().clone()
}

#[test]
fn the_velocity_is_the_derivative_of_the_position_and_the_acceleration_that_of_the_velocity() {
    for name in ["nominal", "drift"] {
        let track = simulate(&family(name, 9)).unwrap().trajectory;
        let h = 1e-5;
        for i in 1..5000 {
            let t_s = f64::from(i) * 0.001_111;
            let (before, now, after) = (track.at(t_s - h), track.at(t_s), track.at(t_s + h));
            let velocity = (after.position - before.position) / (2.0 * h);
            let acceleration = (after.velocity - before.velocity) / (2.0 * h);
            assert!((velocity - now.velocity).norm() < 1e-7, "{name} at {t_s}");
            assert!((acceleration - now.acceleration).norm() < 1e-5, "{name} at {t_s}");
        }
    }
}

#[test]
fn a_buoyant_body_at_rest_approaches_its_terminal_speed_by_the_hyperbolic_tangent() {
    let climb = ClimbScenario {
        vary: 0.0,
        thrust_m_s2: Some(0.0),
        carrier_m_s: Some(0.0),
        random_m_s2: Some(0.0),
        surface_m_s2: Some(0.0),
        buoyancy_m_s2: Some(9.0),
        drag_vertical_per_m: Some(0.04),
        ..ClimbScenario::default()
    };
    let scenario = Scenario { climb, ..Scenario::default() };
    for row in simulate(&scenario).unwrap().truth {
        // v' = b - K v^2  =>  v = sqrt(b / K) tanh(sqrt(b K) t)
        let expected = 15.0 * (0.6 * row.t_s).tanh();
        assert!((row.state.velocity.z - expected).abs() < 1e-9, "at {}", row.t_s);
    }
}

#[test]
fn twenty_steep_climbs_have_the_depth_and_the_speed_of_the_profile() {
    let mut depths_m = Vec::new();
    for seed in 1..=20 {
        let simulation = simulate(&family("nominal", seed)).unwrap();
        let peak = peak_m_s(&simulation);
        assert!((14.5..19.5).contains(&peak), "seed {seed}: {peak} m/s");
        depths_m.push(-simulation.truth[0].state.position.z);
    }
    let mean_m = depths_m.iter().sum::<f64>() / 20.0;
    assert!((57.0..65.0).contains(&mean_m), "{mean_m} m");
    assert!(depths_m.iter().all(|depth_m| (50.0..70.0).contains(depth_m)), "{depths_m:?}");
}

#[test]
fn twenty_oblique_climbs_have_the_range_and_the_speed_of_the_profile() {
    for seed in 1..=20 {
        let simulation = simulate(&family("drift", seed)).unwrap();
        let peak = peak_m_s(&simulation);
        assert!((17.5..23.0).contains(&peak), "seed {seed}: {peak} m/s");
        let range_m = simulation.truth.last().unwrap().state.position.xy().norm();
        assert!((140.0..190.0).contains(&range_m), "seed {seed}: {range_m} m");
    }
}

#[test]
fn no_climb_passes_the_surface_before_the_end_of_the_unseen_phase_and_all_come_close() {
    for name in ["nominal", "drift"] {
        for seed in 1..=20 {
            let truth = simulate(&family(name, seed)).unwrap().truth;
            let top_m = truth.iter().map(|row| row.state.position.z).fold(f64::NEG_INFINITY, f64::max);
            assert!((top_m + 0.2).abs() < 0.002, "{name} {seed}: {top_m} m");
        }
    }
}

#[test]
fn the_phases_hold_the_frames_they_are_counted_in() {
    let simulation = simulate(&family("nominal", 1)).unwrap();
    assert_eq!(simulation.sensor("tether").unwrap().samples.len(), 80 + 30);
    assert_eq!(simulation.sensor("beacon").unwrap().samples.len(), 30 + 75);
    assert_eq!(simulation.truth.len(), 569);
    let gap = simulate(&family("gap", 1)).unwrap();
    let last = gap.sensor("tether").unwrap().samples.last().unwrap().true_time_s;
    let first = gap.sensor("beacon").unwrap().samples[0].true_time_s;
    assert!((0.3..0.36).contains(&(first - last)), "{first} {last}");
}

#[test]
fn without_noise_a_sample_is_the_truth_under_the_registration_model() {
    let simulation = simulate(&noise_free()).unwrap();
    let beacon = simulation.sensor("beacon").unwrap();
    let SensorErrors { bias_m, velocity_bias_m_s, drift_m_s, scale, clock_offset_s } = beacon.errors;
    assert!(scale != 0.0 && clock_offset_s != 0.0);
    let middle_s = simulation.phases.t1_s;
    let p = |t_s| simulation.trajectory.at(t_s).position;
    for sample in &beacon.samples {
        let t_s = sample.true_time_s;
        let position = p(t_s) + bias_m + drift_m_s * (t_s - middle_s) + (p(t_s) - p(middle_s)) * scale;
        let velocity = simulation.trajectory.at(t_s).velocity * (1.0 + scale) + drift_m_s + velocity_bias_m_s;
        assert!((sample.position - position).norm() < 1e-12);
        assert!((sample.velocity - velocity).norm() < 1e-12);
        assert!((sample.stamp_s - t_s - clock_offset_s).abs() < 1e-15);
        assert!(sample.receive_s - t_s >= 0.060);
    }
}

#[test]
fn the_tether_and_the_reference_have_no_systematic_errors() {
    let simulation = simulate(&noise_free()).unwrap();
    for name in ["tether", "reference"] {
        let sensor = simulation.sensor(name).unwrap();
        assert_eq!(sensor.errors, SensorErrors::default());
        for sample in &sensor.samples {
            assert!((sample.position - simulation.trajectory.at(sample.stamp_s).position).norm() < 1e-12);
        }
    }
}

#[test]
fn a_fixed_error_holds_and_leaves_the_other_draws_as_they_were() {
    let drawn = family("nominal", 3);
    let mut fixed = drawn.clone();
    fixed.beacon.errors.bias_m = Some([1.0, -2.0, 5.0]);
    let errors = |scenario: &Scenario| simulate(scenario).unwrap().sensor("beacon").unwrap().errors;
    let expected = SensorErrors { bias_m: Vector3::new(1.0, -2.0, 5.0), ..errors(&drawn) };
    assert_eq!(errors(&fixed), expected);
}

#[test]
fn outliers_and_dropouts_leave_the_truth_and_the_noise_as_they_were() {
    let calm = simulate(&family("gap", 3)).unwrap();
    let mut scenario = family("gap", 3);
    (scenario.tether.outlier_share, scenario.tether.dropout_share) = (0.2, 0.2);
    let wild = simulate(&scenario).unwrap();
    assert_eq!(calm.truth, wild.truth);
    let calm = &calm.sensor("tether").unwrap().samples;
    for sample in wild.sensor("tether").unwrap().samples.iter().filter(|sample| !sample.is_outlier) {
        assert!(calm.contains(sample));
    }
}

#[test]
fn the_noise_has_the_sigma_and_the_correlation_asked_for() {
    for correlation in [0.0, 0.8] {
        let mut scenario = Scenario::default();
        scenario.tether.rate_hz = 10_000.0;
        (scenario.tether.begin_s, scenario.tether.end_s) = (Some(0.0), Some(5.0));
        scenario.tether.noise_correlation = correlation;
        let simulation = simulate(&scenario).unwrap();
        let samples = &simulation.sensor("tether").unwrap().samples;
        let noise: Vec<Vector3<f64>> = samples
            .iter()
            .map(|sample| sample.position - simulation.trajectory.at(sample.true_time_s).position)
            .collect();
        let power = noise.iter().map(Vector3::norm_squared).sum::<f64>();
        let rms = (power / (3.0 * noise.len() as f64)).sqrt();
        assert!((rms - 0.10).abs() < 0.002, "{rms} m");
        let found = noise.windows(2).map(|pair| pair[0].dot(&pair[1])).sum::<f64>() / power;
        assert!((found - correlation).abs() < 0.02, "{found}");
    }
}

#[test]
fn outliers_have_their_share_and_size_and_half_of_them_a_wild_velocity() {
    let record = many_samples(|tether| {
        tether.outlier_share = 0.05;
        (tether.position_sigma_m, tether.velocity_sigma_m_s) = (0.0, 0.0);
    });
    let truth = many_samples(|tether| (tether.position_sigma_m, tether.velocity_sigma_m_s) = (0.0, 0.0));
    let (mut outliers, mut wild) = (0.0, 0.0);
    for (sample, truth) in record.samples.iter().zip(&truth.samples) {
        let error_m = (sample.position - truth.position).norm();
        assert_eq!(sample.is_outlier, error_m > 0.0);
        if sample.is_outlier {
            assert!((2.0..=20.0).contains(&error_m), "{error_m} m");
            outliers += 1.0;
            wild += f64::from(u8::from(sample.velocity != truth.velocity));
        }
    }
    let share = outliers / record.samples.len() as f64;
    assert!((share - 0.05).abs() < 0.005, "{share}");
    assert!((wild / outliers - 0.5).abs() < 0.05, "{}", wild / outliers);
}

#[test]
fn dropouts_have_their_share_and_come_in_bursts_of_five() {
    let record = many_samples(|tether| tether.dropout_share = 0.3);
    let share = 1.0 - record.samples.len() as f64 / 50_001.0;
    assert!((share - 0.3).abs() < 0.02, "{share}");
    let lost: Vec<f64> = record
        .samples
        .windows(2)
        .map(|pair| ((pair[1].true_time_s - pair[0].true_time_s) * 10_000.0).round() - 1.0)
        .filter(|&lost| lost > 0.0)
        .collect();
    let mean = lost.iter().sum::<f64>() / lost.len() as f64;
    assert!((mean - 5.0).abs() < 0.3, "{mean}");
}

#[test]
fn the_same_seed_makes_the_same_bytes_and_another_seed_makes_others() {
    let scenario = family("outliers", 5);
    let bytes = log_bytes(&scenario);
    assert_eq!(bytes, log_bytes(&scenario));
    assert_ne!(bytes, log_bytes(&Scenario { seed: 6, ..scenario }));
}

#[test]
fn a_log_holds_the_scenario_that_made_it() {
    for name in FAMILIES {
        let mut scenario = family(name, 11);
        scenario.recording.bystanders = false;
        let bytes = log_bytes(&scenario);
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let index = summary.attachment_indexes.iter().find(|index| index.name == "scenario.toml").unwrap();
        let attachment = mcap::read::attachment(&bytes, index).unwrap();
        let text = std::str::from_utf8(&attachment.data).unwrap();
        assert_eq!(Scenario::from_toml(text).unwrap(), scenario);
    }
}

#[test]
fn messages_stand_in_the_order_of_their_log_times_and_no_two_share_one() {
    let bytes = log_bytes(&family("async", 2));
    let times: Vec<u64> =
        mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap().log_time).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn a_table_given_in_part_keeps_the_sensors_own_defaults() {
    let scenario = Scenario::from_toml("[beacon]\nrate_hz = 10\n[beacon.errors]\nscale = 0.01").unwrap();
    let mut expected = Scenario::default();
    expected.beacon.rate_hz = 10.0;
    expected.beacon.errors.scale = Some(0.01);
    assert_eq!(scenario, expected);
}

#[test]
fn an_unknown_key_is_refused_by_name_and_line() {
    let message = Scenario::from_toml("[beacon]\nrate = 10.0").unwrap_err().to_string();
    assert!(message.contains("`rate`") && message.contains("line 2"), "{message}");
    assert!(message.contains("`rate_hz`"), "{message}");
}

#[test]
fn an_unknown_family_is_refused_with_the_valid_ones() {
    let message = Scenario::family("noimnal").unwrap_err().to_string();
    assert!(message.contains("\"noimnal\"") && message.contains("nominal, async"), "{message}");
}

#[test]
fn nonsense_is_refused_with_the_key_the_value_and_the_range() {
    for (text, expected) in [
        ("[beacon]\nrate_hz = -3.0", "scenario key \"beacon.rate_hz\": got -3, expected 0.01 to 10000"),
        ("[tether]\nposition_sigma_m = nan", "\"tether.position_sigma_m\": got NaN, expected 0 to 1000"),
        ("[tether]\nrate_hz = 1e12", "\"tether.rate_hz\": got 1000000000000"),
        ("[climb]\nunseen_frames = 4000000000", "asks for 4000000185 frames, expected at most 50000"),
        ("[climb]\nthrust_m_s2 = inf", "\"climb.thrust_m_s2\": got inf"),
        (
            "[climb]\nrandom_low_hz = 2.0",
            "got 2, expected at most 1.3, the value of \"climb.random_high_hz\"",
        ),
        ("[climb]\nunseen_frames = 49000\n[reference]\nrate_hz = 10000", "table \"reference\": asks for"),
        ("[beacon.errors]\nbias_m = [0.0, nan, 0.0]", "\"beacon.errors.bias_m\": got NaN"),
        ("[recording]\nsonar_bytes = 9000000", "bytes of sonar pings, expected at most 1000000000"),
        ("epoch_ns = 0", "scenario key \"epoch_ns\": got 0"),
    ] {
        let message = Scenario::from_toml(text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn extreme_scenarios_in_range_end_in_numbers_or_in_an_error() {
    for text in [
        "[climb]\nthrust_m_s2 = 200\ndrag_vertical_per_m = 0\ndrag_horizontal_per_m = 1\nframe_s = 0.1\nburn_s = 1000",
        "[climb]\ntether_frames = 0\nbeacon_frames = 0\noverlap_frames = 1\nunseen_frames = 1",
        "[climb]\nbuoyancy_m_s2 = -9.81\nvary = 5",
        "[tether]\nbegin_s = 3.0\n[beacon]\nphase = 1.0\nrate_hz = 0.01",
        "[climb]\nrandom_m_s2 = 20\nsurface_m_s2 = 20\nsurface_depth_m = 0.1",
    ] {
        let scenario = Scenario::from_toml(text).unwrap();
        match simulate(&scenario) {
            Ok(simulation) => {
                let finite = |row: &TruthPoint| row.state.position.iter().all(|x| x.is_finite());
                assert!(simulation.truth.iter().all(finite), "{text}");
            }
            Err(error) => assert!(matches!(error, SimulateError::Diverged { .. }), "{text}: {error}"),
        }
    }
}

/// Rows `(px, py, pz, vx, vy, vz)` of the recorded truths of a family, made by another simulator.
fn recorded(names: &[&str]) -> Option<Vec<Vec<[f64; 6]>>> {
    let Some(folder) = std::env::var_os("TRACKFUSE_TEST_DATA") else {
        // past the test runner, which would keep it to itself
        let _ =
            std::io::Write::write_all(&mut std::io::stderr(), b"skipped: TRACKFUSE_TEST_DATA is not set\n");
        return None;
    };
    let mut runs = Vec::new();
    for name in names {
        for k in 0..4 {
            let path = PathBuf::from(&folder).join(format!("climbs/{name}_{k}.truth.csv"));
            let text = std::fs::read_to_string(path).unwrap();
            let row = |line: &str| {
                let numbers: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
                std::array::from_fn(|i| numbers[i + 1])
            };
            runs.push(text.lines().skip(1).map(row).collect());
        }
    }
    Some(runs)
}

#[test]
fn our_climbs_rise_as_far_and_as_fast_as_those_of_another_simulator() {
    for (ours, theirs, tolerance) in
        [("nominal", &["nominal", "async", "bigtau", "no_error"][..], 0.05), ("drift", &["drift"][..], 0.25)]
    {
        let Some(runs) = recorded(theirs) else { return };
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let speed = |row: &[f64; 6]| row[3].hypot(row[4]).hypot(row[5]);
        let their_rise_m = mean(runs.iter().map(|run| run[run.len() - 1][2] - run[0][2]).collect());
        let their_peak_m_s = mean(runs.iter().map(|run| run.iter().map(speed).fold(0.0, f64::max)).collect());
        let simulations: Vec<_> = (1..=20).map(|seed| simulate(&family(ours, seed)).unwrap()).collect();
        let our_rise_m = mean(
            simulations
                .iter()
                .map(|s| s.characteristic_points[2].z_m - s.truth[0].state.position.z)
                .collect(),
        );
        let our_peak_m_s = mean(simulations.iter().map(peak_m_s).collect());
        println!(
            "{ours}: rise {our_rise_m:.1} m against {their_rise_m:.1}, peak {our_peak_m_s:.2} m/s against {their_peak_m_s:.2}"
        );
        assert!((our_rise_m / their_rise_m - 1.0).abs() < tolerance, "{our_rise_m} {their_rise_m}");
        assert!((our_peak_m_s / their_peak_m_s - 1.0).abs() < 0.05, "{our_peak_m_s} {their_peak_m_s}");
    }
}
