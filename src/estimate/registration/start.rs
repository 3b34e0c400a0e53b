//! Where a fit begins.

use super::Settings;
use super::bordered::Layout;
use super::fit::{Fit, Stage, WIDEST_SEARCH};
use super::knots::Knots;
use super::model::{Anchor, Reference};
use super::noise::Level;
use super::relaxation::Relaxation;
use super::rotation::Frame;
use super::unknowns::SourceErrors;
use crate::estimate::spline;
use crate::math::robust;
use crate::sample::{Quantity, Source};

/// No finer by default, s: velocity bands want a thrust's onset in 0.3 s to be followed.
const FINEST_SPACING_S: f64 = 0.04;

/// What a source is thought to be off by before anything is fitted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Guess {
    /// How late its stamps are, s.
    pub(super) clock_offset_s: f64,
    /// Its frame, if it is turned.
    pub(super) frame: Option<Frame>,
}

impl<'a> Fit<'a> {
    /// No curve yet, all samples alike, knots up to `pad_s` beyond both ends of each piece.
    pub(super) fn start(
        sources: &'a [Source],
        datum: usize,
        pieces: &[(f64, f64)],
        guesses: &[Guess],
        settings: &'a Settings,
        pad_s: f64,
    ) -> Self {
        let spacing_s = settings.knot_spacing_s.unwrap_or_else(|| spacing_s(sources, pieces));
        let knots = Knots::covering(pieces, spacing_s, pad_s);
        let jerk_weights = vec![1.0; knots.count()];
        let centre = middle(sources);
        let reference = |i: usize| Reference {
            anchor: Anchor { time_s: common_s(&sources[i], &sources[datum]), point_m: centre },
            image_m: guesses[i].frame.map_or(centre, |frame| frame.image(centre)),
            errors: SourceErrors {
                clock_offset_s: guesses[i].clock_offset_s,
                rotation_rad: guesses[i].frame.map_or(0.0, |frame| frame.angle_rad),
                ..SourceErrors::default()
            },
            is_datum: i == datum,
            centre,
        };
        let slots: Vec<usize> = (0..sources.len()).filter(|&i| i != datum).collect();
        Self {
            sources,
            settings,
            penalty: knots.jerk_penalty(&jerk_weights),
            jerk_weights,
            knots,
            references: (0..sources.len()).map(reference).collect(),
            frames: guesses.iter().map(|g| g.frame).collect(),
            robust: vec![settings.robust; sources.len()],
            levels: sources.iter().zip(guesses).map(|(source, guess)| first_levels(source, guess)).collect(),
            weights: sources.iter().map(|s| Quantity::ALL.map(|q| vec![1.0; s.series(q).len()])).collect(),
            lambda: [1.0; 3],
            search_decades: [WIDEST_SEARCH; 3],
            relaxations: vec![Relaxation::default(); slots.len()],
            stage: Stage::First,
            layout: Layout { slots, active: Vec::new() },
            posterior: None,
            inclusions: Vec::new(),
            separations: Vec::new(),
            log_evidence: 0.0,
            iterations: 0,
            converged: false,
        }
    }
}

/// The noise to begin with: of a turned source at least what its frame leaves, which the datum's is not to be taken for.
fn first_levels(source: &Source, guess: &Guess) -> [Level; 2] {
    let mut levels = [Level::default(); 2];
    let stated = robust::median(&mut source.positions.iter().map(|s| s.sigma[0]).collect::<Vec<_>>());
    if let (Some(left_m), Some(stated)) = (guess.frame.and_then(|frame| frame.left_m), stated) {
        levels[0].scale = (left_m / stated).max(1.0);
    }
    levels
}

/// The fastest source's median interval, but no finer than 0.04 s, and no more knots than the spline's.
fn spacing_s(sources: &[Source], pieces: &[(f64, f64)]) -> f64 {
    let seen_s: f64 = pieces.iter().map(|p| p.1 - p.0).sum();
    let fastest = sources.iter().filter_map(crate::estimate::coverage::median_interval_s);
    let wanted = fastest.fold(f64::INFINITY, f64::min);
    let wanted = if wanted.is_finite() { wanted.max(FINEST_SPACING_S) } else { FINEST_SPACING_S };
    wanted.max(spline::finest_affordable_s(sources, 0.0, seen_s))
}

/// The medians of the positions: coefficients about it are small, and so are rounding and ripple.
fn middle(sources: &[Source]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let mut values: Vec<f64> = sources.iter().flat_map(|s| &s.positions).map(|p| p.value[axis]).collect();
        robust::median(&mut values).unwrap_or(0.0)
    })
}

/// The middle of the overlap, or of the gap, of two sources.
fn common_s(a: &Source, b: &Source) -> f64 {
    let (Some(a), Some(b)) = (a.span_s(), b.span_s()) else { return 0.0 };
    a.0.max(b.0).midpoint(a.1.min(b.1))
}
