//! What is to be said of a result: one value, rendered as text for people or as JSON for programs.

mod amount;
mod comparison;
mod comparison_text;
mod export;
pub mod html;
pub mod inspection;
mod proposal;
mod registration;
mod restore;
mod text;
mod usbl;

pub use comparison::{
    ComparisonParts, ComparisonReport, Crossing, CrossingReport, PhaseErrors, ReferenceReport, WorstReport,
};
pub use comparison_text::render_comparison;
pub use export::ExportReport;
pub use inspection::render_inspection;
pub use proposal::InitReport;
pub use registration::{NoiseReport, RegistrationReport, RejectedReport, UnknownReport};
pub use restore::RestoreReport;
pub use text::render;
pub use usbl::{
    DepthReport, ExchangesReport, FixesReport, PredictionReport, UsblParts, UsblReport, UsblTrackReport,
    render_usbl,
};

use schemars::JsonSchema;
use serde::Serialize;

use crate::estimate::characteristic_point::CharacteristicPoint;
use crate::estimate::coverage;
use crate::estimate::extrapolation::LawKind;
use crate::fusion::{Fusion, Plan, SplineSummary, TriedLaw};
use crate::quality::PhaseSummary;
use crate::sample::{Quantity, Source};
use crate::source::{Candidate, Loaded};
use crate::time::Time;
use crate::track::Phase;

/// The report of `fuse`. Nanoseconds are strings, since JSON numbers lose them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// The log that was read.
    pub input: String,
    /// The log that was written.
    pub output: String,
    /// T0, from which all `_s` times below count, ns since the epoch of the datum's clock.
    pub t0_ns: String,
    /// The sources, in the order of their bits.
    pub sources: Vec<SourceReport>,
    /// Chunks of which only the sources' messages were read, where the message index says that they stand: their
    /// checksums, which span the whole chunk, were not checked.
    pub unchecked_chunks: usize,
    /// Topics that hold a position or velocity, but were not used.
    pub unused_topics: Vec<String>,
    /// How the track was made.
    pub track: TrackReport,
    /// The track phase by phase.
    pub phases: Vec<PhaseReport>,
    /// The sources' errors against the datum, where they were registered.
    pub registration: Option<RegistrationReport>,
    /// How the sources differ where they overlap: what is left after the registration, if there was one.
    pub disagreements: Vec<DisagreementReport>,
    /// What SFF chose.
    pub spline: Option<SplineReport>,
    /// How the track was carried on.
    pub extrapolation: Option<ExtrapolationReport>,
    /// Characteristic points that were reached.
    pub characteristic_points: Vec<EventReport>,
    /// What is good to know of the output, and harms nothing.
    pub notes: Vec<String>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

/// A source and its samples.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SourceReport {
    /// Its name.
    pub name: String,
    /// Whether its bias and clock are zero by definition: nobody can see its own errors.
    pub datum: bool,
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
    /// Samples a second: the median.
    pub rate_hz: Option<f64>,
    /// First and last sample, s since T0.
    pub span_s: Option<(f64, f64)>,
    /// What its times are: `stamp`, `publish` or `log`.
    pub clock: String,
    /// Median of log time less sample time, s.
    pub delay_s: f64,
    /// Half the width of the middle 68 % of it, s.
    pub delay_spread_s: f64,
    /// Standard deviation of its positions, m.
    pub position_sigma_m: Option<f64>,
    /// Where that comes from.
    pub position_sigma_from: Option<String>,
    /// Standard deviation of its velocities, m/s.
    pub velocity_sigma_m_s: Option<f64>,
    /// Where that comes from.
    pub velocity_sigma_from: Option<String>,
}

/// How the track was made.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TrackReport {
    /// The estimator.
    pub method: String,
    /// `shared`, or `independent`.
    pub coefficients: String,
    /// Frame of the coordinates.
    pub frame_id: String,
    /// Latitude and longitude, degrees, and altitude, m, of the zero of the coordinates (WGS 84), where they are known.
    pub origin: Option<[f64; 3]>,
    /// Number of points.
    pub points: usize,
    /// Points a second.
    pub rate_hz: f64,
    /// First and last point, s since T0.
    pub span_s: (f64, f64),
    /// Pieces that long silences cut it into.
    pub pieces: usize,
}

/// One kind of stretch, summed over the log.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PhaseReport {
    /// `single`, `overlap`, `bridged` or `extrapolated`.
    pub phase: String,
    /// The sources that see it.
    pub sources: Vec<String>,
    /// First and last point, s since T0.
    pub span_s: (f64, f64),
    /// Number of points.
    pub points: usize,
    /// Root mean square 3-D distance of the samples' positions from the track (Zhang 2025, eq. 12), m.
    pub position_rmse_m: Option<f64>,
    /// The same of the velocities, m/s.
    pub velocity_rmse_m_s: Option<f64>,
    /// Number of separate stretches that this is the sum of.
    pub stretches: usize,
    /// Root mean square 3-D standard deviation of the track's positions, m; null where nobody knows it.
    pub position_sigma_m: Option<f64>,
    /// The same of the velocities, m/s.
    pub velocity_sigma_m_s: Option<f64>,
}

/// A difference between two sources where both see.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DisagreementReport {
    /// The source that is subtracted.
    pub first: String,
    /// The source that it is subtracted from.
    pub second: String,
    /// `position` or `velocity`.
    pub quantity: String,
    /// Median difference, m or m/s.
    pub median: [f64; 3],
    /// Standard deviation of that median.
    pub sigma: [f64; 3],
    /// Number of instants compared.
    pub count: usize,
    /// Whether it is more than noise.
    pub significant: bool,
}

/// What SFF chose, for the last piece.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SplineReport {
    /// Number of knots.
    pub knots: usize,
    /// Their spacing, s.
    pub knot_spacing_s: f64,
    /// Weight of the jerk penalty by axis, 1/m^2.
    pub lambda: [f64; 3],
    /// Residuals over sigmas by axis: 1 where the sigmas are right.
    pub noise_scale: [f64; 3],
}

/// How the track was carried on.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ExtrapolationReport {
    /// How far it was to go, s.
    pub horizon_s: f64,
    /// How far it went: less where it reached the height at which it stops, s.
    pub length_s: f64,
    /// The laws that it could be carried on by; the one that was taken stands first.
    pub laws: Vec<LawReport>,
}

/// A law that the track could be carried on by, and how it did from earlier instants.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LawReport {
    /// The method.
    pub method: String,
    /// Order, of a polynomial.
    pub order: Option<usize>,
    /// Whether the polynomial's acceleration was made to die away.
    pub prior: bool,
    /// Length of the stretch that it was fitted to, s.
    pub window_s: f64,
    /// Root mean square 3-D position error of the same extrapolation from earlier instants, m.
    pub holdout_position_m: f64,
    /// The same of the velocity, m/s.
    pub holdout_velocity_m_s: f64,
    /// The mean lead at which those errors were taken, s.
    pub holdout_lead_s: f64,
    /// How many such trials there were.
    pub holdout_trials: usize,
    /// Whether it would clearly have been better than the one that was taken: from the same instants at least a third
    /// less off, and by more than the track is known to.
    pub clearly_better: bool,
}

/// A characteristic point.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EventReport {
    /// Its name.
    pub name: String,
    /// The instant, ns since the epoch of the datum's clock.
    pub time_ns: String,
    /// Seconds since T0.
    pub time_s: f64,
    /// Standard deviation of that time, s.
    pub time_sigma_s: Option<f64>,
    /// Position, m.
    pub position_m: [f64; 3],
    /// Velocity, m/s.
    pub velocity_m_s: [f64; 3],
    /// Its standard deviation, m/s; null where nobody knows it.
    pub velocity_sigma_m_s: Option<[f64; 3]>,
    /// `single`, `overlap`, `bridged` or `extrapolated`.
    pub phase: String,
}

/// What a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The log that was read.
    pub input: &'a str,
    /// The log that is written.
    pub output: &'a str,
    /// T0.
    pub t0: Time,
    /// Latitude and longitude, degrees, and altitude, m, of the track's zero.
    pub fix_origin: Option<[f64; 3]>,
    /// The sources, whose samples may have been moved to [`Parts::sources`].
    pub loaded: &'a [Loaded],
    /// Their samples, in the same order.
    pub sources: &'a [Source],
    /// How many chunks were read by message index.
    pub unchecked_chunks: usize,
    /// Which of them is the datum.
    pub datum: usize,
    /// Channels that were passed over.
    pub unused: &'a [Candidate],
    /// What was to be done.
    pub plan: &'a Plan,
    /// What came of it.
    pub fusion: &'a Fusion,
    /// What is good to know of the output.
    pub notes: &'a [String],
    /// All that a person must read.
    pub warnings: &'a [String],
}

impl Report {
    /// Puts a report together.
    #[must_use]
    pub fn new(parts: &Parts<'_>) -> Self {
        let Parts {
            input,
            output,
            t0,
            fix_origin,
            loaded,
            sources,
            datum,
            unused,
            plan,
            fusion,
            notes,
            warnings,
            ..
        } = *parts;
        let since_t0 = |s: f64| plan.origin.plus_seconds(s).seconds_since(t0);
        let span = |(a, b): (f64, f64)| (since_t0(a), since_t0(b));
        let name = |i: usize| sources[i].name.clone();
        let points = &fusion.track.points;
        let carried = fusion.phases.iter().find(|p| p.phase == Phase::Extrapolated);
        let carried_s = carried.map_or(0.0, |p| p.span_s.1 - fusion.pieces.last().map_or(0.0, |p| p.1));
        let end = |p: Option<&crate::track::TrackPoint>| p.map_or(0.0, |p| p.time.seconds_since(t0));
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            input: input.into(),
            output: output.into(),
            t0_ns: t0.ns().to_string(),
            sources: loaded
                .iter()
                .zip(sources)
                .enumerate()
                .map(|(i, (l, source))| SourceReport::new(l, source, i == datum, source.span_s().map(span)))
                .collect(),
            unchecked_chunks: parts.unchecked_chunks,
            unused_topics: unused.iter().map(|c| c.topic.clone()).collect(),
            track: TrackReport {
                method: plan.method.method().name().into(),
                coefficients: plan.coefficients.name().into(),
                frame_id: fusion.track.frame_id.clone(),
                origin: fix_origin,
                points: points.len(),
                rate_hz: plan.rate_hz,
                span_s: (end(points.first()), end(points.last())),
                pieces: fusion.pieces.len(),
            },
            phases: phases_of(fusion, sources, span),
            registration: fusion.registered.as_ref().map(|found| {
                let sources: Vec<&Source> = sources.iter().collect();
                RegistrationReport::new(found, &sources, since_t0)
            }),
            disagreements: fusion
                .disagreements
                .iter()
                .map(|d| DisagreementReport {
                    first: name(d.sources.0),
                    second: name(d.sources.1),
                    quantity: d.quantity.name().into(),
                    median: d.median,
                    sigma: d.sigma,
                    count: d.count,
                    significant: d.is_significant(),
                })
                .collect(),
            spline: fusion.spline.map(SplineReport::new),
            extrapolation: plan.extrapolation.as_ref().filter(|_| !fusion.laws.is_empty()).map(|settings| {
                ExtrapolationReport {
                    horizon_s: settings.horizon_s,
                    length_s: carried_s,
                    laws: fusion.laws.iter().map(LawReport::new).collect(),
                }
            }),
            characteristic_points: fusion.events.iter().map(|e| EventReport::new(e, t0)).collect(),
            notes: notes.to_vec(),
            warnings: warnings.to_vec(),
        }
    }
}

/// A track phase by phase; `span` counts from T0.
fn phases_of(
    fusion: &Fusion,
    sources: &[Source],
    span: impl Fn((f64, f64)) -> (f64, f64),
) -> Vec<PhaseReport> {
    let known = |sigma: f64| Some(sigma).filter(|s| s.is_finite());
    let report = |p: &PhaseSummary| PhaseReport {
        phase: p.phase.name().into(),
        sources: sources
            .iter()
            .enumerate()
            .filter(|(i, _)| p.seen_by >> i & 1 == 1)
            .map(|(_, s)| s.name.clone())
            .collect(),
        span_s: span(p.span_s),
        points: p.points,
        position_rmse_m: p.rmse[Quantity::Position as usize],
        velocity_rmse_m_s: p.rmse[Quantity::Velocity as usize],
        stretches: p.stretches,
        position_sigma_m: known(p.sigma[Quantity::Position as usize]),
        velocity_sigma_m_s: known(p.sigma[Quantity::Velocity as usize]),
    };
    fusion.phases.iter().map(report).collect()
}

impl SplineReport {
    fn new(spline: SplineSummary) -> Self {
        Self {
            knots: spline.knots.0,
            knot_spacing_s: spline.knots.1,
            lambda: spline.lambda,
            noise_scale: spline.noise_scale,
        }
    }
}

impl EventReport {
    fn new(event: &CharacteristicPoint, t0: Time) -> Self {
        let sigma = event.state.velocity_sigma;
        Self {
            name: event.name.clone(),
            time_ns: event.time.ns().to_string(),
            time_s: event.time.seconds_since(t0),
            time_sigma_s: event.time_sigma_s,
            position_m: event.state.position,
            velocity_m_s: event.state.velocity,
            velocity_sigma_m_s: Some(sigma).filter(|v| v.iter().all(|s| s.is_finite())),
            phase: event.phase.name().into(),
        }
    }
}

impl LawReport {
    /// How a config asks for it.
    fn asked(&self) -> String {
        match self.order {
            None => "method = \"drag\"".into(),
            Some(order) => format!("method = \"pcf\", order = {order}, prior = {}", self.prior),
        }
    }

    fn new(tried: &TriedLaw) -> Self {
        let (order, prior) = match tried.law.kind {
            LawKind::Polynomial { order, prior } => (Some(order), prior.is_some()),
            LawKind::Drag => (None, false),
        };
        let h = tried.holdout;
        Self {
            method: tried.law.kind.name().into(),
            order,
            prior,
            window_s: tried.law.window_s,
            holdout_position_m: h.position_m,
            holdout_velocity_m_s: h.velocity_m_s,
            holdout_lead_s: h.lead_s,
            holdout_trials: h.trials,
            clearly_better: tried.clearly_better,
        }
    }
}

impl SourceReport {
    fn new(loaded: &Loaded, source: &Source, datum: bool, span_s: Option<(f64, f64)>) -> Self {
        let [position, velocity] = loaded.sigma;
        Self {
            name: source.name.clone(),
            datum,
            position: loaded.config.position.clone(),
            velocity: loaded.config.velocity.clone(),
            frame_id: loaded.frame_id.clone(),
            positions: source.positions.len(),
            velocities: source.velocities.len(),
            rate_hz: coverage::median_interval_s(source).map(f64::recip),
            span_s,
            clock: loaded.timing.clock.clone(),
            delay_s: loaded.timing.delay_s,
            delay_spread_s: loaded.timing.delay_spread_s,
            position_sigma_m: position.map(|s| s.0),
            position_sigma_from: position.map(|s| s.1.name().into()),
            velocity_sigma_m_s: velocity.map(|s| s.0),
            velocity_sigma_from: velocity.map(|s| s.1.name().into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// Fails where `schemas/<command>.schema.json` is not this schema.
    pub(super) fn assert_schema(schema: &schemars::Schema, command: &str) {
        let schema = serde_json::to_string_pretty(schema).expect("a schema is JSON");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("schemas/{command}.schema.json"));
        if std::env::var_os("TRACKFUSE_UPDATE_SCHEMAS").is_some() {
            std::fs::write(&path, format!("{schema}\n")).expect("the tree can be written");
        }
        let stored = std::fs::read_to_string(&path).expect("a schema of this command");
        assert!(stored.trim_end() == schema, "it differs; TRACKFUSE_UPDATE_SCHEMAS=1 writes it anew");
    }

    #[test]
    fn the_schemas_in_the_tree_are_those_of_this_code() {
        assert_schema(&schemars::schema_for!(super::Report), "fuse");
        assert_schema(&schemars::schema_for!(super::ComparisonReport), "compare");
    }
}
