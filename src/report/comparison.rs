//! The report of `compare`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::estimate::characteristic_point::CharacteristicPoint;
use crate::quality::{Comparison, CrossingErrors, Errors, Interpolated, Jump, Kind, Stretch};
use crate::sample::Quantity;
use crate::source::{Loaded, Recorded, SigmaOrigin};
use crate::time::Time;

/// The report of `compare`. Nanoseconds are strings, since JSON numbers lose them; all `_s` times count from T0;
/// errors are estimate less reference.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ComparisonReport {
    /// Version of the program.
    pub version: String,
    /// The log that was read.
    pub log: String,
    /// The topic of the track.
    pub estimate: String,
    /// T0, ns since the epoch of the track's clock.
    pub t0_ns: String,
    /// What the track was held against.
    pub reference: ReferenceReport,
    /// Frame of the track.
    pub frame_id: String,
    /// Points of the track.
    pub points: usize,
    /// Points of the track without a reference beside them.
    pub uncompared_points: usize,
    /// What was interpolated, of the positions.
    pub interpolated_position: Option<Interpolated>,
    /// What was interpolated, of the velocities.
    pub interpolated_velocity: Option<Interpolated>,
    /// Errors phase by phase, in order of appearance.
    pub phases: Vec<PhaseErrors>,
    /// Errors of the whole track.
    pub all: PhaseErrors,
    /// Characteristic points.
    pub characteristic_points: Vec<CrossingReport>,
    /// The track's largest jump of the acceleration.
    pub acceleration_jump: Option<Jump>,
    /// The reference's, at its own rate.
    pub reference_acceleration_jump: Option<Jump>,
    /// The instants with the largest position errors, worst first.
    pub worst: Vec<WorstReport>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

/// The reference.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ReferenceReport {
    /// Message path of its position.
    pub position: Option<String>,
    /// Message path of its velocity.
    pub velocity: Option<String>,
    /// Frame that its messages name.
    pub frame_id: String,
    /// Number of positions.
    pub positions: usize,
    /// Number of velocities.
    pub velocities: usize,
    /// First and last sample, s since T0.
    pub span_s: Option<(f64, f64)>,
    /// What its times are: `stamp`, `publish` or `log`.
    pub clock: String,
    /// Standard deviation of its positions, m, from its messages or its scatter; null where these don't tell.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of its velocities, m/s.
    pub velocity_sigma_m_s: Option<f64>,
}

/// Errors of one kind of stretch.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PhaseErrors {
    /// `single`, `overlap`, `bridged`, `extrapolated`; `all` for the whole track, `unlabelled` where it has none.
    pub phase: String,
    /// The sources that see it.
    pub sources: Vec<String>,
    /// First and last instant that was compared, s since T0.
    pub span_s: (f64, f64),
    /// Errors of the position.
    pub position_m: Option<Errors>,
    /// Errors of the velocity.
    pub velocity_m_s: Option<Errors>,
}

/// A characteristic point, of the track and of the reference.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CrossingReport {
    /// Its name.
    pub name: String,
    /// The height, m.
    pub z_m: f64,
    /// The track's; null where it doesn't get there.
    pub estimate: Option<Crossing>,
    /// The reference's.
    pub reference: Option<Crossing>,
    /// Relative error of the time since T0 (Zhang 2025, eq. 13).
    pub time_error: Option<f64>,
    /// Relative error of the vertical speed (Zhang 2025, eq. 13).
    pub speed_error: Option<f64>,
    /// Whether the reference's time lies within the track's 95 % band.
    pub time_inside: Option<bool>,
    /// Whether its vertical speed does.
    pub speed_inside: Option<bool>,
}

/// A crossing of a height.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Crossing {
    /// Seconds since T0.
    pub time_s: f64,
    /// Standard deviation of that, s.
    pub time_sigma_s: Option<f64>,
    /// Vertical speed, m/s.
    pub vertical_speed_m_s: Option<f64>,
    /// Standard deviation of that, m/s.
    pub vertical_speed_sigma_m_s: Option<f64>,
}

/// An instant at which the track is far off.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WorstReport {
    /// Seconds since T0.
    pub time_s: f64,
    /// Phase.
    pub phase: String,
    /// The sources that see it.
    pub sources: Vec<String>,
    /// Error of the position by axis, m.
    pub error_m: [f64; 3],
    /// The largest of the three over its standard deviation.
    pub sigmas: Option<f64>,
}

/// What a comparison's report is made of.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonParts<'a> {
    /// The log.
    pub log: &'a str,
    /// The topic of the track.
    pub topic: &'a str,
    /// The track.
    pub estimate: &'a Recorded,
    /// The reference, its times counting from T0.
    pub reference: &'a Loaded,
    /// T0.
    pub t0: Time,
    /// What came of it.
    pub comparison: &'a Comparison,
    /// All that a person must read.
    pub warnings: &'a [String],
}

impl ComparisonReport {
    /// Puts a report together.
    #[must_use]
    pub fn new(parts: &ComparisonParts<'_>) -> Self {
        let ComparisonParts { log, topic, estimate, reference, t0, comparison, warnings } = *parts;
        let named = |kind: Kind| -> (String, Vec<String>) {
            let names = estimate.sources.iter().enumerate();
            let names = names.filter(|(i, _)| kind.seen_by >> i & 1 == 1).map(|(_, name)| name.clone());
            let phase = if estimate.has_phases { kind.phase.name() } else { "unlabelled" };
            (phase.into(), names.collect())
        };
        let phase = |s: &Stretch| {
            let (phase, sources) = s.kind.map_or(("all".into(), Vec::new()), named);
            let (position_m, velocity_m_s) = (s.position.clone(), s.velocity.clone());
            PhaseErrors { phase, sources, span_s: s.span_s, position_m, velocity_m_s }
        };
        let [position, velocity] = comparison.interpolated.clone();
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            log: log.into(),
            estimate: topic.into(),
            t0_ns: t0.ns().to_string(),
            reference: ReferenceReport {
                position: reference.config.position.clone(),
                velocity: reference.config.velocity.clone(),
                frame_id: reference.frame_id.clone(),
                positions: reference.source.positions.len(),
                velocities: reference.source.velocities.len(),
                span_s: reference.source.span_s(),
                clock: reference.timing.clock.clone(),
                position_sigma_m: known_sigma(reference, Quantity::Position),
                velocity_sigma_m_s: known_sigma(reference, Quantity::Velocity),
            },
            frame_id: estimate.track.frame_id.clone(),
            points: estimate.track.points.len(),
            uncompared_points: comparison.uncompared,
            interpolated_position: position,
            interpolated_velocity: velocity,
            phases: comparison.stretches.iter().map(phase).collect(),
            all: phase(&comparison.all),
            characteristic_points: comparison.crossings.iter().map(|c| CrossingReport::new(c, t0)).collect(),
            acceleration_jump: comparison.jump,
            reference_acceleration_jump: comparison.reference_jump,
            worst: comparison
                .worst
                .iter()
                .map(|w| {
                    let (phase, sources) = named(w.kind);
                    WorstReport { time_s: w.time_s, phase, sources, error_m: w.error_m, sigmas: w.sigmas }
                })
                .collect(),
            warnings: warnings.to_vec(),
        }
    }
}

/// A reference's standard deviation, where it is more than an assumption.
fn known_sigma(reference: &Loaded, quantity: Quantity) -> Option<f64> {
    reference.sigma[quantity as usize].filter(|s| s.1 != SigmaOrigin::Assumed).map(|s| s.0)
}

impl CrossingReport {
    fn new(errors: &CrossingErrors, t0: Time) -> Self {
        let known = |v: f64| Some(v).filter(|v| v.is_finite());
        let crossing = |point: &CharacteristicPoint| Crossing {
            time_s: point.time.seconds_since(t0),
            time_sigma_s: point.time_sigma_s,
            vertical_speed_m_s: known(point.state.velocity[2]),
            vertical_speed_sigma_m_s: known(point.state.velocity_sigma[2]),
        };
        Self {
            name: errors.height.name.clone(),
            z_m: errors.height.z_m,
            estimate: errors.estimate.as_ref().map(crossing),
            reference: errors.reference.as_ref().map(crossing),
            time_error: errors.time_error,
            speed_error: errors.speed_error,
            time_inside: errors.time_inside,
            speed_inside: errors.speed_inside,
        }
    }
}
