//! A dive seen by USBL: fixes in, the smoothed track and a causal prediction out, each in the shape of every track.

use super::{Fusion, difference_velocities, grid};
use crate::estimate::EstimateError;
use crate::estimate::coverage::Coverage;
use crate::estimate::usbl::causal::{Improved, ImprovedSettings, Paper, PaperSettings, Predictor};
use crate::estimate::usbl::{self, Cleaned, Height, Settings, Verdict};
use crate::math::robust;
use crate::quality;
use crate::sample::{Sample, Source};
use crate::time::Time;
use crate::track::{Curve, Method, Phase, Track, TrackPoint};

/// The vehicle counts as seen where exchanges are no more than so many cycles apart.
const SILENT_CYCLES: f64 = 2.5;

/// Which causal method predicts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causal {
    /// [`Improved`].
    Improved,
    /// [`Paper`].
    Paper,
}

/// What is to be done, every default resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct DivePlan {
    /// The instant that the samples' seconds count from.
    pub origin: Time,
    /// The frame of the coordinates.
    pub frame_id: String,
    /// Points of the track a second.
    pub rate_hz: f64,
    /// The smoother's settings.
    pub settings: Settings,
    /// Time from one exchange to the next, s; by default the fixes' median.
    pub cycle_s: Option<f64>,
    /// The causal method.
    pub causal: Causal,
}

/// A dive's tracks, and what became of its fixes.
#[derive(Clone, Debug)]
pub struct Dive {
    /// The track, its source the fixes that were kept.
    pub fusion: Fusion,
    /// The fixes that were kept.
    pub kept: Source,
    /// What the causal method said at every instant of what had come by then.
    pub prediction: Track,
    /// The smoother's result.
    pub cleaned: Cleaned,
    /// Time from one exchange to the next, s.
    pub cycle_s: f64,
    /// Root mean square 3-D distance of the prediction from the track: while fixes come, and in silence, m.
    pub prediction_rmse_m: [Option<f64>; 2],
}

/// Cleans the positions of `fixes`; `late` are the indices of those that came after one of a later time, which the causal
/// method passes over.
///
/// # Errors
/// Those of [`usbl::clean`].
pub fn clean(
    fixes: &Source,
    late: &[usize],
    heights: &[Height],
    plan: &DivePlan,
) -> Result<Dive, EstimateError> {
    let mut cleaned = usbl::clean(&fixes.positions, heights, &plan.settings)?;
    for (i, judged) in cleaned.judged.iter_mut().enumerate() {
        judged.late = late.binary_search(&i).is_ok();
    }
    let believed = believed_s(&cleaned);
    let mut steps: Vec<f64> = cleaned.cycle_times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let cycle_s = plan.cycle_s.or_else(|| robust::median(&mut steps)).unwrap_or(20.0);
    let kept: Vec<Sample> = fixes.positions.iter().zip(&cleaned.judged).filter_map(kept).collect();
    let kept = Source { name: fixes.name.clone(), positions: kept, velocities: Vec::new() };
    let (from_s, to_s) = kept.span_s().unwrap_or_default();

    let point = |time_s: f64| {
        let after = believed.partition_point(|&t| t < time_s);
        let gap_s = match (after.checked_sub(1).and_then(|i| believed.get(i)), believed.get(after)) {
            (Some(before), Some(after)) => after - before,
            _ => 0.0,
        };
        let silent = gap_s > SILENT_CYCLES * cycle_s;
        Some(TrackPoint {
            time: plan.origin.plus_seconds(time_s),
            state: cleaned.at(time_s)?,
            phase: if silent { Phase::Bridged } else { Phase::Single },
            method: Method::Usbl,
            seen_by: u32::from(!silent),
        })
    };
    let mut points: Vec<TrackPoint> = grid(from_s, to_s, plan.rate_hz).filter_map(point).collect();
    difference_velocities(&mut points, 1.5 / plan.rate_hz);
    let track = Track { frame_id: plan.frame_id.clone(), points };

    let in_order: Vec<Sample> = fixes
        .positions
        .iter()
        .enumerate()
        .filter(|(i, _)| late.binary_search(i).is_err())
        .map(|(_, f)| *f)
        .collect();
    let speed_limit_m_s = plan.settings.speed_limit_m_s;
    let prediction = match plan.causal {
        Causal::Improved => {
            let settings = ImprovedSettings { cycle_s, speed_limit_m_s };
            predicted(Improved::new(settings), Method::UsblCausal, &in_order, cycle_s, plan)
        }
        Causal::Paper => {
            let settings =
                PaperSettings { cycle_s, rate_limit_m_s: speed_limit_m_s, ..PaperSettings::default() };
            predicted(Paper::new(settings), Method::UsblPaper, &in_order, cycle_s, plan)
        }
    };
    let prediction_rmse_m = [Phase::Single, Phase::Extrapolated]
        .map(|phase| rmse(prediction.points.iter().filter(|p| p.phase == phase), &cleaned, plan.origin));

    // runs of exchanges, not of fixes: those come in bursts
    let centre = |&time_s: &f64| Sample { time_s, value: [0.0; 3], sigma: [1.0; 3] };
    let coverage =
        Coverage::of(&[Source { positions: believed.iter().map(centre).collect(), ..kept.clone() }]);
    let fitted: [(&[Source], &dyn Curve); 1] = [(std::slice::from_ref(&kept), &cleaned)];
    let residuals = quality::residuals(&fitted, plan.origin, &coverage);
    let fusion = Fusion {
        phases: quality::phases(&track, plan.origin, &residuals),
        plain_pcf: Track { frame_id: plan.frame_id.clone(), points: Vec::new() },
        track,
        events: Vec::new(),
        pieces: vec![(from_s, to_s)],
        coverage,
        residuals,
        registered: None,
        disagreements: Vec::new(),
        spline: None,
        laws: Vec::new(),
        warnings: Vec::new(),
    };
    Ok(Dive { fusion, kept, prediction, cleaned, cycle_s, prediction_rmse_m })
}

/// The times of the exchanges that were not thrown out, s.
fn believed_s(cleaned: &Cleaned) -> Vec<f64> {
    let exchanges = cleaned.cycle_times_s.iter().zip(&cleaned.wild_cycles);
    exchanges.filter(|(_, wild)| !**wild).map(|(time_s, _)| *time_s).collect()
}

fn kept((fix, judged): (&Sample, &usbl::Judged)) -> Option<Sample> {
    (judged.verdict == Verdict::Kept).then_some(*fix)
}

/// What `method` says at the track's instants of the fixes up to each.
fn predicted(
    mut predictor: impl Predictor,
    method: Method,
    fixes: &[Sample],
    cycle_s: f64,
    plan: &DivePlan,
) -> Track {
    let (from_s, to_s) = fixes.first().zip(fixes.last()).map_or((0.0, 0.0), |(a, b)| (a.time_s, b.time_s));
    let (mut coming, mut newest_s) = (fixes.iter().peekable(), from_s);
    let mut points = Vec::new();
    for time_s in grid(from_s, to_s, plan.rate_hz) {
        while let Some(fix) = coming.next_if(|fix| fix.time_s <= time_s) {
            newest_s = fix.time_s;
            predictor.push(fix);
        }
        predictor.advance(time_s);
        let Some(state) = predictor.at(time_s).filter(crate::track::State::is_finite) else { continue };
        let silent = time_s - newest_s > SILENT_CYCLES * cycle_s;
        points.push(TrackPoint {
            time: plan.origin.plus_seconds(time_s),
            state,
            phase: if silent { Phase::Extrapolated } else { Phase::Single },
            method,
            seen_by: u32::from(!silent),
        });
    }
    Track { frame_id: plan.frame_id.clone(), points }
}

fn rmse<'a>(points: impl Iterator<Item = &'a TrackPoint>, curve: &impl Curve, origin: Time) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    for point in points {
        let Some(state) = curve.at(point.time.seconds_since(origin)) else { continue };
        sum += (0..3).map(|i| (point.state.position[i] - state.position[i]).powi(2)).sum::<f64>();
        count += 1;
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}
