//! A real flight, watched by motion capture, with two sensors cut from it whose errors are known.

use std::path::Path;

use trackfuse::config::SourceConfig;
use trackfuse::estimate::registration::{Kind, Unknown};
use trackfuse::log::Log;
use trackfuse::quality::{self, Errors};
use trackfuse::source;
use trackfuse::track::{Phase, Track, TrackPoint};

use super::climbs::Recording;
use super::family::{REGISTERED, fuse};

const TRUTH: &str = "/cub1/pose.pose.position";
const BIAS_M: [f64; 3] = [0.8, -0.5, 0.4];
const CLOCK_OFFSET_S: f64 = 0.12;

/// What the program makes of the flight.
pub(crate) struct Flight {
    /// What is known of the beacon, and what was found.
    pub(crate) unknowns: Vec<Found>,
    /// Errors of the position where the gauge sees, and where the beacon alone does.
    pub(crate) errors: [Errors; 2],
}

/// An unknown beside its true value.
pub(crate) struct Found {
    pub(crate) kind: Kind,
    pub(crate) axis: Option<usize>,
    pub(crate) value: f64,
    pub(crate) sigma: f64,
    pub(crate) truth: f64,
}

/// Fuses the log, and holds the track against the motion capture.
pub(crate) fn judge(log: &Path) -> Flight {
    let recording = Recording::open(log);
    let fusion = fuse(&recording, 2.0, &[], REGISTERED.1);
    let registered = fusion.registered.as_ref().expect("two sources");
    let found = |unknown: &Unknown| {
        let truth = match (unknown.name.kind, unknown.name.axis) {
            (Kind::Bias, Some(axis)) => BIAS_M[axis],
            (Kind::ClockOffset, _) => CLOCK_OFFSET_S,
            _ => return None,
        };
        let (value, sigma) = (unknown.value, unknown.sigma);
        Some(Found { kind: unknown.name.kind, axis: unknown.name.axis, value, sigma, truth })
    };
    let log = Log::open(log).expect("a log");
    let config =
        SourceConfig { name: "truth".into(), position: Some(TRUTH.into()), ..SourceConfig::default() };
    let source::Samples { loaded: truth, origin, .. } =
        source::load(&log, &[config], true, None).expect("the truth");
    let configs: Vec<SourceConfig> = recording.loaded.iter().map(|l| l.config.clone()).collect();
    let datum = source::datum(&configs);
    let errors = [true, false].map(|by_gauge| {
        let wanted =
            |p: &&TrackPoint| (p.seen_by >> datum & 1 == 1) == by_gauge && p.phase != Phase::Extrapolated;
        let points = fusion.track.points.iter().filter(wanted).copied().collect();
        let part = Track { frame_id: fusion.track.frame_id.clone(), points };
        quality::compare(&part, origin, &truth[0].source, &[]).all.position.expect("the truth covers it")
    });
    Flight { unknowns: registered.unknowns.iter().filter_map(found).collect(), errors }
}
