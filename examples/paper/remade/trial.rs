//! The trial that stands in for the paper's: two classes of data on common frames, and the truth.
//!
//! The frames are 0.02 s apart, 185 of them, as in the paper. Only Z is looked at, as in its Table 1.

use trackfuse::estimate::weighted_mean::WeightedMean;
use trackfuse::sample::{Quantity, Sample, Source};
use trackfuse::simulate::{ErrorsScenario, Scenario, Simulation, simulate};
use trackfuse::track::Curve;

/// Spacing of the frames, s.
pub(crate) const FRAME_S: f64 = 0.02;
/// Frames that anybody sees.
pub(crate) const FRAMES: usize = 185;
/// The up axis.
pub(crate) const Z: usize = 2;
/// Sigmas of the two classes, m and m/s: 2 to 3, so that GDF's weights are 0.69 and 0.31 (Zhang 2025, eq. 2).
const SIGMAS: [f64; 2] = [0.10, 0.15];

/// Height, vertical speed and acceleration at an instant: m, m/s, m/s2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) z: f64,
    pub(crate) v: f64,
    pub(crate) a: f64,
}

/// Two classes of data, and what is true.
pub(crate) struct Trial {
    pub(crate) simulation: Simulation,
    /// The tether gauge (class I) and the beacon (class II).
    pub(crate) sources: Vec<Source>,
    /// First frame of the overlap, and first frame after it.
    pub(crate) overlap: [usize; 2],
}

/// The instant of a frame, s.
pub(crate) fn time_s(frame: usize) -> f64 {
    frame as f64 * FRAME_S
}

/// The frame of an instant.
pub(crate) fn frame(time_s: f64) -> usize {
    (time_s / FRAME_S).round() as usize
}

impl Trial {
    /// The trial of Table 1: 63, 29 and 93 samples without noise, from classes that disagree.
    pub(crate) fn of_table_1() -> Self {
        Self::of(&Scenario::from_toml(include_str!("../table_1.scenario.toml")).expect("a good scenario"))
    }

    /// The same of a climb that nothing was searched for: the simulator's steep one, differences constant.
    pub(crate) fn not_searched(seed: u64) -> Self {
        let mut scenario =
            Scenario::from_toml(include_str!("../table_1.scenario.toml")).expect("a good scenario");
        let frames = scenario.climb;
        scenario.seed = seed;
        scenario.climb = Scenario::default().climb;
        scenario.climb.tether_frames = frames.tether_frames;
        scenario.climb.overlap_frames = frames.overlap_frames;
        scenario.climb.beacon_frames = frames.beacon_frames;
        let errors = &mut scenario.beacon.errors;
        (errors.bias_m, errors.velocity_bias_m_s) = (Some([0.0, 0.0, 2.17]), Some([0.0, 0.0, 2.07]));
        errors.clock_offset_s = Some(0.0);
        (scenario.beacon.begin_s, scenario.beacon.end_s) = (None, None);
        Self::of(&scenario)
    }

    /// A steep climb as the simulator has it, 80, 30 and 75 samples; `noise` times its noise, and its beacon with
    /// or without systematic errors.
    pub(crate) fn steep(seed: u64, noise: f64, errors: bool) -> Self {
        let mut scenario = Scenario::family("nominal").expect("a family");
        scenario.seed = seed;
        for sensor in [&mut scenario.tether, &mut scenario.beacon] {
            sensor.position_sigma_m *= noise;
            sensor.velocity_sigma_m_s *= noise;
        }
        scenario.beacon.errors.clock_offset_s = Some(0.0); // samples stay on the frames
        if !errors {
            scenario.beacon.errors = ErrorsScenario::default();
        }
        Self::of(&scenario)
    }

    fn of(scenario: &Scenario) -> Self {
        let simulation = simulate(scenario).expect("a good scenario");
        let source = |name: &str, sigma: f64| {
            let record = simulation.sensor(name).expect("the climb has both");
            let series = |velocity: bool| {
                let sample = |s: &trackfuse::simulate::SensorSample| Sample {
                    time_s: time_s(frame(s.stamp_s)),
                    value: if velocity { s.velocity.into() } else { s.position.into() },
                    sigma: [sigma; 3],
                };
                record.samples.iter().map(sample).collect()
            };
            Source { name: name.into(), positions: series(false), velocities: series(true) }
        };
        let sources = vec![source("tether", SIGMAS[0]), source("beacon", SIGMAS[1])];
        let overlap = [frame(sources[1].positions[0].time_s), sources[0].len()];
        Self { simulation, sources, overlap }
    }

    /// The truth at an instant.
    pub(crate) fn truth(&self, time_s: f64) -> Point {
        let state = self.simulation.trajectory.at(time_s);
        Point { z: state.position.z, v: state.velocity.z, a: state.acceleration.z }
    }

    /// GDF, eq. 1-2.
    pub(crate) fn gdf(&self) -> WeightedMean {
        WeightedMean::new(self.sources.clone())
    }

    /// What the paper fits its curves to: one sample a frame, after GDF, all of one weight.
    pub(crate) fn fused(&self) -> Vec<Source> {
        sampled(&self.gdf())
    }

    /// The samples of one quantity on Z, with their frames.
    pub(crate) fn observed(&self, quantity: Quantity) -> impl Iterator<Item = (usize, f64)> {
        let samples = self.sources.iter().flat_map(move |s| s.series(quantity));
        samples.map(|s| (frame(s.time_s), s.value[Z]))
    }
}

/// A curve's states at all frames, as one source whose samples have one weight.
pub(crate) fn sampled(curve: &dyn Curve) -> Vec<Source> {
    let states = || (0..FRAMES).map(|i| (time_s(i), curve.at(time_s(i)).expect("it covers all frames")));
    let sample = |time_s, value| Sample { time_s, value, sigma: [1.0; 3] };
    vec![Source {
        name: "fused".into(),
        positions: states().map(|(t, s)| sample(t, s.position)).collect(),
        velocities: states().map(|(t, s)| sample(t, s.velocity)).collect(),
    }]
}
