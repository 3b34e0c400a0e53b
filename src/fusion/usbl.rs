//! A dive seen by USBL: fixes in, the smoothed track and a causal prediction out, each in the shape of every track.

use std::ops::Range;

use super::{Fusion, difference_velocities, grid};
use crate::estimate::EstimateError;
use crate::estimate::coverage::Coverage;
use crate::estimate::usbl::causal::{Improved, ImprovedSettings, Paper, PaperSettings, Predictor};
use crate::estimate::usbl::{self, Cleaned, Height, Judged, Reason, Settings, Verdict, Warning};
use crate::math::robust;
use crate::quality;
use crate::sample::{Sample, Source};
use crate::time::Time;
use crate::track::{Curve, Method, Phase, State, Track, TrackPoint};

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
    /// The longest silence that is bridged, s: a longer one parts two pieces, each with a track of its own.
    pub bridge_max_s: f64,
    /// The smoother's settings.
    pub settings: Settings,
    /// Time from one exchange to the next, s; by default the fixes' median.
    pub cycle_s: Option<f64>,
    /// The causal method.
    pub causal: Causal,
    /// Whether the fixes' sigmas are guesses, which what is found of the noise replaces.
    pub sigma_is_guess: bool,
}

/// A dive's tracks, and what became of its fixes.
#[derive(Clone, Debug)]
pub struct Dive {
    /// The track, its source the fixes that were kept.
    pub fusion: Fusion,
    /// All fixes, with the sigmas that were found where none were stated.
    pub fixes: Vec<Sample>,
    /// What became of each.
    pub judged: Vec<Judged>,
    /// The fixes that were kept.
    pub kept: Source,
    /// What the causal method said at every instant of what had come by then.
    pub prediction: Track,
    /// The smoother's result, piece by piece.
    pub pieces: Vec<Cleaned>,
    /// Standard deviation of the kept fixes' noise over that in `fixes`: horizontal, vertical.
    pub noise_scale: [f64; 2],
    /// Median standard deviation of the kept fixes' noise, m: horizontal, vertical.
    pub noise_m: [f64; 2],
    /// How much of that all fixes of an exchange have in common, m: horizontal, vertical.
    pub common_m: [f64; 2],
    /// Time from one exchange to the next, s.
    pub cycle_s: f64,
    /// Root mean square 3-D distance of the prediction from the track: while fixes come, and in silence, m.
    pub prediction_rmse_m: [Option<f64>; 2],
    /// What a person must know beside the pieces' own warnings.
    pub warnings: Vec<Warning>,
}

impl Dive {
    /// How many exchanges there are, and how many of them were thrown out as a whole.
    #[must_use]
    pub fn exchanges(&self) -> (usize, usize) {
        let wild = |piece: &Cleaned| piece.wild_cycles.iter().filter(|wild| **wild).count();
        let all = |piece: &Cleaned| piece.wild_cycles.len();
        (self.pieces.iter().map(all).sum(), self.pieces.iter().map(wild).sum())
    }

    /// The piece with the most exchanges.
    #[must_use]
    pub fn longest(&self) -> &Cleaned {
        let longest = self.pieces.iter().max_by_key(|piece| piece.cycle_times_s.len());
        // `clean` returns at least one
        longest.unwrap_or(&self.pieces[0])
    }
}

impl Curve for Dive {
    /// The state at a time within one of the pieces.
    fn at(&self, time_s: f64) -> Option<State> {
        let within = |(from_s, to_s): &(f64, f64)| (*from_s..=*to_s).contains(&time_s);
        let piece = self.fusion.pieces.iter().position(within)?;
        self.pieces.get(piece)?.at(time_s)
    }
}

/// Cleans the positions of `fixes`, which ascend in time; `arrival` says which of them came first, second and so on.
///
/// # Errors
/// Those of [`usbl::clean`], where no piece has a track.
pub fn clean(
    fixes: &Source,
    arrival: &[u32],
    heights: &[Height],
    plan: &DivePlan,
) -> Result<Dive, EstimateError> {
    let mut positions = fixes.positions.clone();
    if let (true, Some(sigma_m)) = (plan.sigma_is_guess, usbl::cycles::guessed_sigma_m(&positions)) {
        positions.iter_mut().for_each(|fix| fix.sigma = [sigma_m; 3]);
    }
    let stray = Judged { verdict: Verdict::Wild, reason: Reason::Stray, ..Judged::UNJUDGED };
    let mut found = Dive {
        fusion: Fusion::default(),
        fixes: Vec::new(),
        judged: vec![stray; positions.len()],
        kept: Source { name: fixes.name.clone(), ..Source::default() },
        prediction: Track { frame_id: plan.frame_id.clone(), points: Vec::new() },
        pieces: Vec::new(),
        noise_scale: [1.0; 2],
        noise_m: [f64::NAN; 2],
        common_m: [0.0; 2],
        cycle_s: 0.0,
        prediction_rmse_m: [None; 2],
        warnings: Vec::new(),
    };
    let (mut ranges, mut kept, mut failed): (Vec<Range<usize>>, Vec<Source>, _) =
        (Vec::new(), Vec::new(), None);
    for range in parted(&positions, plan.bridge_max_s) {
        let own = &positions[range.clone()];
        let heights = about(heights, own);
        let cleaned = match usbl::clean(own, &heights, &plan.settings) {
            Ok(cleaned) => cleaned,
            Err(error @ EstimateError::BadNumber { .. }) => return Err(error),
            Err(error) => {
                let longer = |(count, _): &(usize, EstimateError)| *count >= own.len();
                failed = failed.filter(longer).or(Some((own.len(), error)));
                continue;
            }
        };
        let before: usize = found.pieces.iter().map(|piece| piece.wild_cycles.len()).sum();
        for (judged, of_piece) in found.judged[range.clone()].iter_mut().zip(&cleaned.judged) {
            *judged = Judged { cycle: before + of_piece.cycle, ..*of_piece };
        }
        let believed = own.iter().zip(&cleaned.judged).filter(|(_, judged)| judged.verdict == Verdict::Kept);
        let believed = believed.map(|(fix, _)| *fix).collect();
        kept.push(Source { name: fixes.name.clone(), positions: believed, velocities: Vec::new() });
        found.pieces.push(cleaned);
        ranges.push(range);
    }
    if let (true, Some((_, error))) = (found.pieces.is_empty(), failed) {
        return Err(error);
    }
    let strays = found.judged.iter().filter(|judged| judged.reason == Reason::Stray).count();
    if strays > 0 {
        found.warnings.push(Warning::Stray { count: strays, of: positions.len() });
    }
    if plan.sigma_is_guess {
        for (range, piece) in ranges.iter().zip(&found.pieces) {
            let [across, down] = piece.noise_scale;
            for fix in &mut positions[range.clone()] {
                fix.sigma = [across * fix.sigma[0], across * fix.sigma[1], down * fix.sigma[2]];
            }
        }
    } else {
        found.noise_scale = found.longest().noise_scale;
    }
    found.common_m = found.longest().common_m;
    found.noise_m = [0, 2].map(|axis| {
        let kept = positions.iter().zip(&found.judged).filter(|(_, judged)| judged.verdict == Verdict::Kept);
        let mut sigmas: Vec<f64> = kept.map(|(fix, _)| fix.sigma[axis]).collect();
        found.noise_scale[axis / 2] * robust::median(&mut sigmas).unwrap_or(f64::NAN)
    });
    let steps = found.pieces.iter().flat_map(|piece| piece.cycle_times_s.windows(2).map(|w| w[1] - w[0]));
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    found.cycle_s = plan.cycle_s.or_else(|| robust::median(&mut steps)).unwrap_or(20.0);
    found.kept.positions = kept.iter().flat_map(|piece| &piece.positions).copied().collect();
    track(&mut found, &kept, plan);

    let by_arrival = Arrived::of(&positions, arrival, &ranges);
    by_arrival.late.iter().for_each(|&i| found.judged[i].late = true);
    found.warnings.extend(by_arrival.warning(positions.len()));
    found.fixes = positions;
    for (range, piece) in ranges.iter().zip(&found.pieces) {
        let points = predict(&found, range.clone(), piece.common_m, plan);
        found.prediction.points.extend(points);
    }
    if found.prediction.points.is_empty() {
        found.warnings.push(Warning::NoPrediction);
    }
    found.prediction_rmse_m = [Phase::Single, Phase::Extrapolated]
        .map(|phase| rmse(found.prediction.points.iter().filter(|p| p.phase == phase), &found, plan.origin));
    Ok(found)
}

/// The pieces: ranges of indices into `fixes`, which ascend, parted by silences longer than `most_s`.
fn parted(fixes: &[Sample], most_s: f64) -> Vec<Range<usize>> {
    let parts = fixes.chunk_by(|a, b| b.time_s - a.time_s <= most_s);
    let mut begin = 0;
    let range = |part: &[Sample]| {
        let range = begin..begin + part.len();
        begin = range.end;
        range
    };
    parts.map(range).collect()
}

/// The heights from a minute before the first of `fixes` to a minute after the last.
fn about(heights: &[Height], fixes: &[Sample]) -> Vec<Height> {
    const MARGIN_S: f64 = 60.0;
    let (Some(first), Some(last)) = (fixes.first(), fixes.last()) else { return Vec::new() };
    let span = first.time_s - MARGIN_S..=last.time_s + MARGIN_S;
    heights.iter().filter(|height| span.contains(&height.time_s)).copied().collect()
}

/// The track of every piece, with everything that is said of it.
fn track(found: &mut Dive, kept: &[Source], plan: &DivePlan) {
    let mut track = Track { frame_id: plan.frame_id.clone(), points: Vec::new() };
    let (mut pieces, mut all_believed_s) = (Vec::new(), Vec::new());
    for (cleaned, kept) in found.pieces.iter().zip(kept) {
        let believed_s = believed_s(cleaned);
        let (from_s, to_s) = kept.span_s().unwrap_or_default();
        let point = |time_s: f64| {
            let after = believed_s.partition_point(|&t| t < time_s);
            let gap_s = match (after.checked_sub(1).and_then(|i| believed_s.get(i)), believed_s.get(after)) {
                (Some(before), Some(after)) => after - before,
                _ => 0.0,
            };
            let silent = gap_s > SILENT_CYCLES * found.cycle_s;
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
        track.points.extend(points);
        pieces.push((from_s, to_s));
        all_believed_s.extend(believed_s);
    }
    // runs of exchanges, not of fixes: those come in bursts
    let centre = |&time_s: &f64| Sample { time_s, value: [0.0; 3], sigma: [1.0; 3] };
    let positions = all_believed_s.iter().map(centre).collect();
    let coverage =
        Coverage::of(&[Source { positions, name: found.kept.name.clone(), velocities: Vec::new() }]);
    let fitted: Vec<(&[Source], &dyn Curve)> = kept
        .iter()
        .zip(&found.pieces)
        .map(|(kept, cleaned)| (std::slice::from_ref(kept), cleaned as &dyn Curve))
        .collect();
    let residuals = quality::residuals(&fitted, plan.origin, &coverage);
    found.fusion = Fusion {
        phases: quality::phases(&track, plan.origin, &residuals),
        plain_pcf: Track { frame_id: plan.frame_id.clone(), points: Vec::new() },
        track,
        pieces,
        coverage,
        residuals,
        ..Fusion::default()
    };
}

/// The times of the exchanges that were not thrown out, s.
fn believed_s(cleaned: &Cleaned) -> Vec<f64> {
    let exchanges = cleaned.cycle_times_s.iter().zip(&cleaned.wild_cycles);
    exchanges.filter(|(_, wild)| !**wild).map(|(time_s, _)| *time_s).collect()
}

/// Which fixes came after one of a later time.
struct Arrived {
    /// Their indices.
    late: Vec<usize>,
    /// How late the latest came, s.
    most_s: f64,
}

impl Arrived {
    /// A fix far from all others in time makes none late: each of the `pieces` is looked at by itself.
    fn of(fixes: &[Sample], arrival: &[u32], pieces: &[Range<usize>]) -> Self {
        let mut found = Self { late: Vec::new(), most_s: 0.0 };
        for piece in pieces {
            let mut order: Vec<usize> = piece.clone().collect();
            order.sort_by_key(|&i| arrival.get(i));
            let mut newest_s = f64::NEG_INFINITY;
            for i in order {
                let behind_s = newest_s - fixes[i].time_s;
                if behind_s > 0.0 {
                    found.late.push(i);
                    found.most_s = found.most_s.max(behind_s);
                }
                newest_s = newest_s.max(fixes[i].time_s);
            }
        }
        found
    }

    /// Acoustic systems are late by nature, by a few exchanges; a clock that was set back looks otherwise.
    fn warning(&self, of: usize) -> Option<Warning> {
        /// So late may a fix be, s, and so large a share of them.
        const MOST_LATE_S: f64 = 120.0;
        const MOST_SHARE: f64 = 0.3;
        let count = self.late.len();
        let strange = self.most_s > MOST_LATE_S || count as f64 > MOST_SHARE * of as f64;
        strange.then_some(Warning::Late { count, of, most_s: self.most_s })
    }
}

/// What the causal method says at a piece's instants of the fixes that are neither late nor out at first sight.
fn predict(found: &Dive, piece: Range<usize>, common_m: [f64; 2], plan: &DivePlan) -> Vec<TrackPoint> {
    let judged = found.fixes[piece.clone()].iter().zip(&found.judged[piece]);
    let seen =
        |judged: &Judged| !judged.late && !matches!(judged.reason, Reason::Repeated | Reason::OffDepth);
    // a sigma is of all that a fix is off by: its own noise is what the exchange has not in common
    let own = |sigma_m: f64, common_m: f64| {
        (sigma_m * sigma_m - common_m * common_m).max(0.01 * sigma_m * sigma_m).sqrt()
    };
    let with_own =
        |fix: &Sample| Sample { sigma: std::array::from_fn(|a| own(fix.sigma[a], common_m[a / 2])), ..*fix };
    let fixes: Vec<Sample> =
        judged.filter(|(_, judged)| seen(judged)).map(|(fix, _)| with_own(fix)).collect();
    let (cycle_s, limit_m_s) = (found.cycle_s, plan.settings.speed_limit_m_s);
    match plan.causal {
        Causal::Improved => {
            let settings = ImprovedSettings { cycle_s, speed_limit_m_s: limit_m_s, common_m };
            predicted(Improved::new(settings), Method::UsblCausal, &fixes, cycle_s, plan)
        }
        Causal::Paper => {
            let settings = PaperSettings { cycle_s, rate_limit_m_s: limit_m_s, ..PaperSettings::default() };
            predicted(Paper::new(settings), Method::UsblPaper, &fixes, cycle_s, plan)
        }
    }
}

/// What `method` says at the track's instants of the fixes up to each.
fn predicted(
    mut predictor: impl Predictor,
    method: Method,
    fixes: &[Sample],
    cycle_s: f64,
    plan: &DivePlan,
) -> Vec<TrackPoint> {
    let (from_s, to_s) = fixes.first().zip(fixes.last()).map_or((0.0, 0.0), |(a, b)| (a.time_s, b.time_s));
    let (mut coming, mut newest_s) = (fixes.iter().peekable(), from_s);
    let mut points = Vec::new();
    for time_s in grid(from_s, to_s, plan.rate_hz) {
        while let Some(fix) = coming.next_if(|fix| fix.time_s <= time_s) {
            newest_s = fix.time_s;
            predictor.push(fix);
        }
        predictor.advance(time_s);
        let Some(state) = predictor.at(time_s).filter(State::is_finite) else { continue };
        let silent = time_s - newest_s > SILENT_CYCLES * cycle_s;
        points.push(TrackPoint {
            time: plan.origin.plus_seconds(time_s),
            state,
            phase: if silent { Phase::Extrapolated } else { Phase::Single },
            method,
            seen_by: u32::from(!silent),
        });
    }
    points
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
