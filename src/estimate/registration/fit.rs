//! One joint fit: spline and unknowns, noise levels and smoothing, by turns until nothing moves.

use super::adaptive::jerk_weights;
use super::bordered::{Layout, Posterior, eliminate};
use super::knots::{Knots, Penalty};
use super::model::Reference;
use super::noise::Level;
use super::normal::{Normal, Weighted, motion};
use super::relaxation::Relaxation;
use super::residuals::Residuals;
use super::rotation::Frame;
use super::selection::{self, Averaged, Inclusion};
use super::smoothing::likeliest_lambda;
use super::start::Guess;
use super::unknowns::{Kind, OF_A_SOURCE, SourceErrors, index, kind_of};
use super::{REJECTED_WEIGHT, Settings, separation};
use crate::math::gaussian_basis::Active;
use crate::sample::{Quantity, Source};

/// Steps with weights that minimise absolute values, before outliers are told from noise: so many, and more until the
/// clock offsets come to rest.
const FIRST_STEPS: usize = 4;
const MOST_FIRST_STEPS: usize = 12;

/// A clock offset is at rest that moves by less than this share of its sigma.
const AT_REST: f64 = 0.3;

/// The priors' sigmas are so many times wider in those steps: far from the solution noise looks large, and would hold
/// a clock back that is far off.
const FIRST_WIDENING: f64 = 3.0;

/// Steps after which a fit that still moves is left as it is.
const MOST_STEPS: usize = 40;

/// Steps about the average over the models.
const LAST_STEPS: usize = 2;

/// A step is small that moves no unknown by more than this many of its sigmas,
const SMALL_MOVE: f64 = 0.02;
/// and no noise's variance by more than this share.
const SMALL_CHANGE: f64 = 0.01;

/// Knots beyond both ends of a piece for samples that a clock offset moves there, in sigmas of the prior.
const PAD_SIGMAS: f64 = 8.0;

/// A clock offset that comes near the last of these knots begins anew with four times as many, so often at most.
const MOST_WIDENINGS: usize = 3;

/// Fewest samples beside another source's that say whether a source is to be trusted.
const MIN_COMPARED: usize = 8;

/// Decades about the last lambda that the next one is looked for in, at most.
pub(super) const WIDEST_SEARCH: f64 = 0.7;

/// What is being fitted, and how far it is.
pub(super) struct Fit<'a> {
    pub(super) sources: &'a [Source],
    pub(super) settings: &'a Settings,
    pub(super) knots: Knots,
    pub(super) penalty: Penalty,
    /// The penalty's weights in time, by function.
    pub(super) jerk_weights: Vec<f64>,
    pub(super) references: Vec<Reference>,
    /// The frames that the sources began in whose rotation is looked for.
    pub(super) frames: Vec<Option<Frame>>,
    /// Whether outliers are looked for among the source's samples.
    pub(super) robust: Vec<bool>,
    pub(super) layout: Layout,
    pub(super) levels: Vec<[Level; 2]>,
    /// Robust weights by source, quantity and sample.
    pub(super) weights: Vec<[Vec<f64>; 2]>,
    pub(super) lambda: [f64; 3],
    /// How far about the last lambda the next one is looked for, decades.
    pub(super) search_decades: [f64; 3],
    pub(super) relaxations: Vec<Relaxation>,
    pub(super) stage: Stage,
    pub(super) posterior: Option<Posterior>,
    pub(super) inclusions: Vec<Inclusion>,
    pub(super) separations: Vec<(Option<(separation::Name, f64)>, separation::Separation)>,
    pub(super) log_evidence: f64,
    pub(super) iterations: usize,
    pub(super) converged: bool,
}

/// Which way of weighing samples.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Stage {
    /// By absolute values.
    First,
    /// By a mixture of scales, since that many steps.
    Mixture { since: usize },
}

/// Which unknowns are thought to be there.
#[derive(Clone, Copy, PartialEq)]
enum Choice {
    /// All.
    All,
    /// Those that the evidence asks for.
    ByEvidence,
}

impl<'a> Fit<'a> {
    /// Fits all `sources` from a first guess of each. `None` where the data leave the curve open.
    pub(super) fn run(
        sources: &'a [Source],
        datum: usize,
        pieces: &[(f64, f64)],
        guesses: &[Guess],
        settings: &'a Settings,
    ) -> Option<Self> {
        let latest = guesses.iter().map(|g| g.clock_offset_s.abs()).fold(0.0, f64::max);
        let mut pad_s = PAD_SIGMAS * settings.priors.clock_offset_s + latest;
        let mut fit = Self::once(Self::start(sources, datum, pieces, guesses, settings, pad_s))?;
        for _ in 0..MOST_WIDENINGS {
            let latest = fit.references.iter().map(|r| r.errors.clock_offset_s.abs()).fold(0.0, f64::max);
            if latest < 0.8 * pad_s {
                break;
            }
            pad_s *= 4.0;
            fit = Self::once(Self::start(sources, datum, pieces, guesses, settings, pad_s))?;
        }
        Some(fit)
    }

    /// All steps from the start to the end.
    fn once(mut fit: Self) -> Option<Self> {
        fit.settle()?;
        if fit.distrust() {
            fit.settle()?;
        }
        if fit.settings.select {
            for _ in 0..LAST_STEPS {
                fit.solve(Choice::ByEvidence)?;
                fit.reweigh();
            }
        }
        fit.solve(if fit.settings.select { Choice::ByEvidence } else { Choice::All })?;
        Some(fit)
    }

    /// Steps until nothing moves.
    fn settle(&mut self) -> Option<()> {
        for _ in 0..MOST_STEPS {
            let before = (self.posterior.as_ref().map(|p| p.unknowns.clone()), self.levels.clone());
            self.solve(Choice::All)?;
            if before.0.is_none() {
                self.put_anchors_on_curve();
            }
            self.reweigh();
            self.iterations += 1;
            match self.stage {
                Stage::First => {
                    let over = self.iterations >= FIRST_STEPS && self.clocks_rest();
                    if over || self.iterations == MOST_FIRST_STEPS {
                        self.stage = Stage::Mixture { since: self.iterations };
                    }
                }
                Stage::Mixture { since } => {
                    self.converged =
                        self.iterations > since + 1 && self.is_settled(before.0.as_deref(), &before.1);
                }
            }
            if self.converged {
                break;
            }
        }
        Some(())
    }

    /// Takes all samples of a source for noise whose samples are rejected more often than not where another one sees:
    /// it has an error that the model doesn't hold, and where it sees alone nothing would show it. Whether there is
    /// one.
    fn distrust(&mut self) -> bool {
        let spans: Vec<Option<(f64, f64)>> = self.sources.iter().map(Source::span_s).collect();
        let mut any = false;
        for (i, source) in self.sources.iter().enumerate() {
            let compared = |time_s: f64| {
                let sees = |(j, span): (usize, &Option<(f64, f64)>)| {
                    j != i && span.is_some_and(|(from_s, to_s)| (from_s..=to_s).contains(&time_s))
                };
                spans.iter().enumerate().any(sees)
            };
            let contradicted = Quantity::ALL.iter().any(|&quantity| {
                let weights = &self.weights[i][quantity as usize];
                let compared = source.series(quantity).iter().zip(weights).filter(|s| compared(s.0.time_s));
                let (all, bad) = compared.fold((0, 0), |(all, bad), (_, weight)| {
                    (all + 1, bad + usize::from(*weight < REJECTED_WEIGHT))
                });
                all >= MIN_COMPARED && 2 * bad > all
            });
            if contradicted {
                self.robust[i] = false;
                self.weights[i].iter_mut().for_each(|weights| weights.fill(1.0));
                any = true;
            }
        }
        if any {
            self.stage = Stage::Mixture { since: self.iterations };
            self.converged = false;
        }
        any
    }

    /// The unknowns that can act: not those of a quantity that isn't measured, and, while there is no curve, not
    /// those that its motion multiplies.
    fn acting(&self) -> Vec<usize> {
        let mut active = Vec::new();
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            let measures = Quantity::ALL.map(|q| !self.sources[source].series(q).is_empty());
            for own in 0..OF_A_SOURCE {
                let (kind, axis) = kind_of(own);
                let acts = match kind {
                    Kind::Bias | Kind::Drift => measures[0],
                    Kind::VelocityBias => measures[1],
                    Kind::ClockOffset | Kind::Scale => self.posterior.is_some(),
                    Kind::Rotation => self.frames[source].is_some() && self.posterior.is_some(),
                };
                if acts && measures.contains(&true) && self.settings.kinds.contains(&kind) {
                    active.push(index(slot, kind, axis));
                }
            }
        }
        active
    }

    fn solve(&mut self, choice: Choice) -> Option<()> {
        self.layout.active = self.acting();
        let normal = self.normal();
        let priors = &self.settings.priors;
        let widening = if self.stage == Stage::First { FIRST_WIDENING } else { 1.0 };
        let variances: Vec<f64> =
            self.layout.active.iter().map(|&i| (widening * priors.of(kind_of(i).0)).powi(2)).collect();
        for axis in 0..3 {
            // everywhere at first, and again when outliers are told from noise
            let anew = match self.stage {
                Stage::First => self.iterations == 0,
                Stage::Mixture { since } => self.iterations < since + 3,
            };
            let last = self.lambda[axis];
            let about = (!anew).then_some((last, self.search_decades[axis]));
            let lambda = likeliest_lambda(&normal, &self.penalty, &self.layout, &variances, axis, about);
            let moved = (lambda / last).log10().abs();
            self.search_decades[axis] =
                if anew { WIDEST_SEARCH } else { (2.0 * moved).clamp(0.1, WIDEST_SEARCH) };
            self.lambda[axis] = lambda;
        }
        let eliminated = eliminate(&normal, &self.penalty, self.lambda, &self.layout)?;
        let information = &eliminated.information;
        let estimate = match choice {
            Choice::All => information.with_prior(&variances)?,
            Choice::ByEvidence => {
                let Averaged { estimate, inclusions } =
                    selection::average(information, &self.layout, priors)?;
                self.inclusions = inclusions;
                estimate
            }
        };
        self.separations = separation::separations(information, &self.layout, priors);
        self.log_evidence = estimate.log_evidence - 0.5 * eliminated.deviance_at_zero;
        self.take(eliminated.posterior(&self.layout, &estimate));
        Some(())
    }

    fn normal(&self) -> Normal {
        let weights: Vec<[Vec<f64>; 2]> = self
            .weights
            .iter()
            .zip(&self.levels)
            .map(|(weights, levels)| {
                let total = |q: usize| weights[q].iter().map(|w| w * levels[q].precision()).collect();
                [total(0), total(1)]
            })
            .collect();
        let series: Vec<Weighted<'_>> = (0..self.sources.len())
            .flat_map(|source| Quantity::ALL.map(|quantity| (source, quantity)))
            .map(|(source, quantity)| Weighted {
                source,
                block: self.layout.slots.iter().position(|&s| s == source).unwrap_or(0),
                quantity,
                samples: self.sources[source].series(quantity),
                weights: &weights[source][quantity as usize],
            })
            .collect();
        let none = vec![[0.0; 3]; self.knots.count()];
        let coefficients = self.posterior.as_ref().map_or(&none, |p| &p.coefficients);
        Normal::of(&self.knots, &series, &self.references, coefficients)
    }

    /// Goes to a new solution, clock offsets by a part of the way where they would swing.
    fn take(&mut self, posterior: Posterior) {
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            let before = self.references[source].errors;
            let mut errors = SourceErrors::of(&posterior.unknowns, slot);
            let step = errors.clock_offset_s - before.clock_offset_s;
            let acts = |kind| self.layout.active.contains(&index(slot, kind, 0));
            errors.clock_offset_s = before.clock_offset_s;
            if acts(Kind::ClockOffset) {
                errors.clock_offset_s += self.relaxations[slot].shorten(step);
            }
            if !acts(Kind::Rotation) {
                errors.rotation_rad = before.rotation_rad;
            }
            self.references[source].errors = errors;
        }
        self.posterior = Some(posterior);
    }

    fn put_anchors_on_curve(&mut self) {
        let Some(posterior) = &self.posterior else { return };
        for (reference, frame) in self.references.iter_mut().zip(&self.frames) {
            let mut active = Active::default();
            self.knots.evaluate(reference.anchor.time_s, &mut active);
            let point_m = motion(&posterior.coefficients, &active, reference.centre)[0];
            reference.anchor.point_m = point_m;
            reference.image_m = frame.map_or(point_m, |frame| frame.image(point_m));
        }
    }

    /// What the current solution leaves of one series.
    pub(super) fn residuals(&self, posterior: &Posterior, source: usize, quantity: Quantity) -> Residuals {
        let slot = self.layout.slots.iter().position(|&s| s == source);
        let samples = self.sources[source].series(quantity);
        let reference = &self.references[source];
        Residuals::of(&self.knots, posterior, reference, slot, quantity, samples)
    }

    fn reweigh(&mut self) {
        let Some(posterior) = self.posterior.take() else { return };
        for source in 0..self.sources.len() {
            for quantity in Quantity::ALL {
                let residuals = self.residuals(&posterior, source, quantity);
                let level = &mut self.levels[source][quantity as usize];
                let weights = &mut self.weights[source][quantity as usize];
                match self.stage {
                    Stage::First if self.robust[source] => level.first_weights(&residuals, weights),
                    Stage::First => level.step(&residuals, weights, false),
                    Stage::Mixture { .. } => {
                        level.step(&residuals, weights, self.robust[source]);
                        level.correlate(&residuals, weights);
                    }
                }
            }
        }
        // before, clocks that are far off look like jerk
        if self.stage != Stage::First {
            self.jerk_weights = jerk_weights(&self.knots, &posterior, self.lambda, &self.jerk_weights);
            self.penalty = self.knots.jerk_penalty(&self.jerk_weights);
        }
        self.posterior = Some(posterior);
    }

    /// Whether the last step moved no clock offset by much.
    fn clocks_rest(&self) -> bool {
        let Some(posterior) = &self.posterior else { return false };
        self.relaxations.iter().enumerate().all(|(slot, relaxation)| {
            let i = index(slot, Kind::ClockOffset, 0);
            relaxation.last.abs() <= AT_REST * posterior.covariance[(i, i)].sqrt()
        })
    }

    fn is_settled(&self, before: Option<&[f64]>, levels: &[[Level; 2]]) -> bool {
        let (Some(before), Some(posterior)) = (before, &self.posterior) else { return false };
        let still = |i: usize| {
            let sigma = posterior.covariance[(i, i)].sqrt();
            (posterior.unknowns[i] - before[i]).abs() <= SMALL_MOVE * sigma
        };
        let calm = |(a, b): (&Level, &Level)| (a.precision() / b.precision()).ln().abs() < SMALL_CHANGE;
        self.levels.iter().flatten().zip(levels.iter().flatten()).all(calm) && (0..before.len()).all(still)
    }
}
