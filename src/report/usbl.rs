//! What is to be said of a dive seen by USBL.

use std::fmt::{self, Write};

use schemars::JsonSchema;
use serde::Serialize;

use super::text::{self, short};
use super::{PhaseReport, SourceReport, phases_of};
use crate::estimate::usbl::{Judged, Reason, Verdict};
use crate::fusion::usbl::{Dive, DivePlan};
use crate::printable::printable;
use crate::sample::Source;
use crate::source::Loaded;
use crate::time::Time;
use crate::track::Phase;

/// The report of `usbl`. Nanoseconds are strings, since JSON numbers lose them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct UsblReport {
    /// Version of the program.
    pub version: String,
    /// The log that was read.
    pub input: String,
    /// The log that was written.
    pub output: String,
    /// T0, from which all `_s` times below count, ns since the epoch of the fixes' clock.
    pub t0_ns: String,
    /// The fixes as they were read.
    pub source: SourceReport,
    /// What became of them.
    pub fixes: FixesReport,
    /// The acoustic exchanges that they came with.
    pub exchanges: ExchangesReport,
    /// The depth channel, where one was named.
    pub depth: Option<DepthReport>,
    /// The track.
    pub track: UsblTrackReport,
    /// The track phase by phase.
    pub phases: Vec<PhaseReport>,
    /// The causal method's prediction.
    pub prediction: PredictionReport,
    /// What is good to know of the output, and harms nothing.
    pub notes: Vec<String>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

/// What became of the fixes: numbers of them.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct FixesReport {
    /// The track rests on them.
    pub kept: usize,
    /// Thrown out: off, unlike others of their exchange.
    pub off_by_itself: usize,
    /// Thrown out with their whole exchange.
    pub off_as_cycle: usize,
    /// Thrown out: not at the depth sensor's depth.
    pub off_depth: usize,
    /// Thrown out: they repeat another one.
    pub repeated: usize,
    /// Those of all these that came after a fix of a later time.
    pub late: usize,
}

/// The acoustic exchanges.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ExchangesReport {
    /// How many there are.
    pub count: usize,
    /// How many of them were thrown out as a whole.
    pub thrown_out: usize,
    /// Time from one to the next, s.
    pub cycle_s: f64,
}

/// The depth channel.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DepthReport {
    /// Its message path.
    pub path: String,
    /// How many depths it gave.
    pub samples: usize,
    /// How many fixes have depths about them that they could be held against.
    pub fixes: usize,
}

/// The smoothed track.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct UsblTrackReport {
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
    /// Median standard deviation of the kept fixes' noise, m: horizontal, vertical.
    pub noise_m: [f64; 2],
    /// How much of it all fixes of an exchange have in common, m: horizontal, vertical.
    pub common_m: [f64; 2],
    /// The noise over what was stated, and 1 where nothing was.
    pub noise_scale: [f64; 2],
    /// Density of the vehicle's acceleration, m^2/s^3: horizontal, vertical.
    pub acceleration_density: [f64; 2],
}

impl UsblTrackReport {
    /// Whether the fixes of an exchange have so much in common that it matters.
    #[must_use]
    pub fn has_common(&self) -> bool {
        self.common_m.iter().zip(self.noise_m).any(|(common, noise)| *common > 0.4 * noise)
    }
}

/// The causal method's prediction.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PredictionReport {
    /// The method.
    pub method: String,
    /// Number of points.
    pub points: usize,
    /// Root mean square 3-D distance from the track while fixes come, m.
    pub rmse_m: Option<f64>,
    /// The same in silence, m.
    pub silent_rmse_m: Option<f64>,
}

/// What a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct UsblParts<'a> {
    /// The log that was read.
    pub input: &'a str,
    /// The log that is written.
    pub output: &'a str,
    /// T0.
    pub t0: Time,
    /// Latitude and longitude, degrees, and altitude, m, of the track's zero.
    pub origin: Option<[f64; 3]>,
    /// How the fixes were read.
    pub loaded: &'a Loaded,
    /// The fixes.
    pub fixes: &'a Source,
    /// The depth channel's path, how many depths it gave, and how many fixes have some about them.
    pub depth: Option<(&'a str, usize, usize)>,
    /// What was to be done.
    pub plan: &'a DivePlan,
    /// What came of it.
    pub dive: &'a Dive,
    /// What is good to know of the output.
    pub notes: &'a [String],
    /// All that a person must read.
    pub warnings: &'a [String],
}

impl FixesReport {
    fn of(judged: &[Judged]) -> Self {
        let count = |wanted: &dyn Fn(&Judged) -> bool| judged.iter().filter(|j| wanted(j)).count();
        let because = |reason| count(&|j| j.reason == reason);
        Self {
            kept: count(&|j| j.verdict == Verdict::Kept),
            off_by_itself: because(Reason::OffByItself),
            off_as_cycle: because(Reason::OffAsCycle),
            off_depth: because(Reason::OffDepth),
            repeated: because(Reason::Repeated),
            late: count(&|j| j.late),
        }
    }
}

impl UsblReport {
    /// Puts a report together.
    #[must_use]
    pub fn new(parts: &UsblParts<'_>) -> Self {
        let UsblParts { t0, loaded, fixes, plan, dive, .. } = *parts;
        let since_t0 = |s: f64| plan.origin.plus_seconds(s).seconds_since(t0);
        let span = |(a, b): (f64, f64)| (since_t0(a), since_t0(b));
        let (track, prediction) = (&dive.fusion.track, &dive.prediction);
        let end = |p: Option<&crate::track::TrackPoint>| p.map_or(0.0, |p| p.time.seconds_since(t0));
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            input: parts.input.into(),
            output: parts.output.into(),
            t0_ns: t0.ns().to_string(),
            source: SourceReport::new(loaded, fixes, true, fixes.span_s().map(span)),
            fixes: FixesReport::of(&dive.judged),
            exchanges: ExchangesReport {
                count: dive.exchanges().0,
                thrown_out: dive.exchanges().1,
                cycle_s: dive.cycle_s,
            },
            depth: parts.depth.map(|(path, samples, fixes)| DepthReport {
                path: path.into(),
                samples,
                fixes,
            }),
            track: UsblTrackReport {
                frame_id: track.frame_id.clone(),
                origin: parts.origin,
                points: track.points.len(),
                rate_hz: plan.rate_hz,
                span_s: (end(track.points.first()), end(track.points.last())),
                noise_scale: dive.noise_scale,
                noise_m: dive.noise_m,
                common_m: dive.common_m,
                acceleration_density: dive.longest().acceleration_density,
            },
            phases: phases_of(&dive.fusion, std::slice::from_ref(fixes), span),
            prediction: PredictionReport {
                method: prediction.points.first().map_or(String::new(), |p| p.method.name().into()),
                points: prediction.points.len(),
                rmse_m: dive.prediction_rmse_m[0],
                silent_rmse_m: dive.prediction_rmse_m[1],
            },
            notes: parts.notes.to_vec(),
            warnings: parts.warnings.to_vec(),
        }
    }
}

/// The report as text. It doesn't name the files, which may change without the track changing.
#[must_use]
pub fn render_usbl(report: &UsblReport) -> String {
    let mut page = String::new();
    // writing to a String can't fail
    let _ = write_page(&mut page, report);
    page
}

fn write_page(out: &mut String, report: &UsblReport) -> fmt::Result {
    let track = &report.track;
    writeln!(out, "track   known to {} (1 sigma, over three axes)", known(report))?;
    let span_s = track.span_s.1 - track.span_s.0;
    write!(out, "        {} points at {} Hz over {span_s:.2} s", track.points, short(track.rate_hz))?;
    if !track.frame_id.is_empty() {
        write!(out, ", frame {:?}", track.frame_id)?;
    }
    writeln!(out)?;
    text::origin(out, track.origin)?;
    let prediction = &report.prediction;
    if let Some(off) = off(prediction) {
        writeln!(out, "        rmse of a prediction by the past alone ({}): {off}", prediction.method)?;
    }
    writeln!(out)?;
    fixes(out, report)?;
    writeln!(out)?;
    text::phases(out, &report.phases)?;
    text::notes(out, &report.notes)?;
    text::warnings(out, &report.warnings)
}

/// How well the place is known where fixes come and in silence.
pub(super) fn known(report: &UsblReport) -> String {
    let of_phase = |p: &PhaseReport| {
        let sigma_m = p.position_sigma_m.map_or("unknown".into(), |s| format!("± {s:.1} m"));
        if p.phase == Phase::Bridged.name() {
            format!("{sigma_m} in {} of silence", duration(p.points as f64 / report.track.rate_hz))
        } else {
            format!("{sigma_m} where fixes come")
        }
    };
    report.phases.iter().map(of_phase).collect::<Vec<_>>().join(", ")
}

/// The root mean square error of the prediction while fixes came and in silence; `None` where there is none to be held against the
/// track.
pub(super) fn off(prediction: &PredictionReport) -> Option<String> {
    let seen = prediction.rmse_m.map(|m| format!("{m:.1} m while fixes came"));
    let silent = prediction.silent_rmse_m.map(|m| format!("{m:.1} m in silence"));
    seen.into_iter().chain(silent).reduce(|a, b| format!("{a}, {b}"))
}

/// In seconds, minutes or hours, whichever is read at a glance.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 300.0 => format!("{s:.0} s"),
        s if s < 10_800.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn fixes(out: &mut String, report: &UsblReport) -> fmt::Result {
    let (source, fixes) = (&report.source, &report.fixes);
    let path = source.position.as_deref().map(printable).unwrap_or_default();
    writeln!(out, "fixes   {} of {path}, timed by {}", source.positions, source.clock)?;
    writeln!(out, "        {} kept; {}", fixes.kept, noise(report))?;
    if report.track.has_common() {
        let [across, down] = report.track.common_m;
        writeln!(out, "        of it {across:.2} m and {down:.2} m are common to all fixes of an exchange")?;
    }
    for (count, why) in [
        (fixes.off_by_itself, "thrown out: each off by itself"),
        (fixes.off_as_cycle, "thrown out with their whole exchange"),
        (fixes.off_depth, "thrown out: not at the depth sensor's depth"),
        (fixes.repeated, "passed over: they repeat another one"),
        (fixes.late, "of all these came late, and are not in the prediction"),
    ] {
        if count > 0 {
            writeln!(out, "        {count} {why}")?;
        }
    }
    let ExchangesReport { count, thrown_out, cycle_s } = report.exchanges;
    write!(out, "        {count} exchanges, {cycle_s:.1} s apart")?;
    if thrown_out > 0 {
        write!(out, "; {thrown_out} of them thrown out as a whole")?;
    }
    writeln!(out)?;
    if let Some(DepthReport { path, samples, fixes: beside }) = &report.depth {
        writeln!(out, "depth   {samples} of {}", printable(path))?;
        writeln!(out, "        {beside} of {} fixes have a depth beside them", source.positions)?;
    }
    Ok(())
}

/// The noise of the fixes that were kept, beside what was stated.
fn noise(report: &UsblReport) -> String {
    let [across, down] = report.track.noise_m;
    let found = format!("1 sigma of their noise is {across:.2} m in x and y, {down:.2} m in z");
    match (report.source.position_sigma_m, report.source.position_sigma_from.as_deref()) {
        (Some(sigma), Some(from)) if from != "estimated" => format!("{found} ({sigma:.2} m: {from})"),
        _ => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_in_the_tree_is_that_of_this_code() {
        super::super::tests::assert_schema(&schemars::schema_for!(super::UsblReport), "usbl");
    }

    #[test]
    fn a_length_of_time_is_told_in_the_unit_that_suits_it() {
        assert_eq!(
            [299.0, 300.0, 10_799.0, 90_000.0].map(duration),
            ["299 s", "5.0 min", "180.0 min", "25.0 h"]
        );
    }

    #[test]
    fn a_prediction_is_told_of_where_there_is_one() {
        let said = |rmse_m, silent_rmse_m| {
            off(&PredictionReport { method: String::new(), points: 0, rmse_m, silent_rmse_m })
        };
        assert_eq!(said(None, None), None);
        assert_eq!(said(Some(2.0), None).as_deref(), Some("2.0 m while fixes came"));
        let both = said(Some(2.0), Some(30.0));
        assert_eq!(both.as_deref(), Some("2.0 m while fixes came, 30.0 m in silence"));
    }
}
