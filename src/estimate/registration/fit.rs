//! The order of steps.

use super::bordered::{Layout, Penalty, Posterior, eliminate};
use super::curve::RegisteredCurve;
use super::knots::Knots;
use super::model::{Anchor, Reference};
use super::noise::{Level, Residuals};
use super::normal::{Normal, Weighted, motion};
use super::selection::{self, Inclusion};
use super::smoothing::likeliest_lambda;
use super::unknowns::{Kind, OF_A_SOURCE, Priors, SourceErrors, index, kind_of};
use crate::estimate::{EstimateError, check, spline};
use crate::math::gaussian_basis::Active;
use crate::math::robust;
use crate::math::simd::{Kernel, vectorised};
use crate::sample::{Quantity, Sample, Source};

/// What may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What is thought of the errors before.
    pub priors: Priors,
    /// Knot spacing, s.
    pub knot_spacing_s: Option<f64>,
    /// Whether outliers are looked for.
    pub robust: bool,
    /// Whether the residuals' correlation widens.
    pub correlated: bool,
    /// Whether unknowns that the data don't ask for are left out.
    pub select: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { priors: Priors::default(), knot_spacing_s: None, robust: true, correlated: true, select: true }
    }
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Registered {
    /// The curve.
    pub curve: RegisteredCurve,
    /// Errors by source; zeros for the datum.
    pub errors: Vec<SourceErrors>,
    /// Their standard deviations.
    pub sigmas: Vec<SourceErrors>,
    /// Noise by source and quantity.
    pub levels: Vec<[Level; 2]>,
    /// Which kinds of errors there are.
    pub inclusions: Vec<Inclusion>,
    /// Weight of the jerk.
    pub lambda: [f64; 3],
    /// Steps taken.
    pub iterations: usize,
    /// Whether the last step was small.
    pub converged: bool,
}

struct Fit<'a> {
    sources: &'a [Source],
    settings: &'a Settings,
    pieces: &'a [(f64, f64)],
    spacing_s: f64,
    knots: Knots,
    references: Vec<Reference>,
    layout: Layout,
    levels: Vec<[Level; 2]>,
    weights: Vec<[Vec<f64>; 2]>,
    penalty: Penalty,
    posterior: Option<Posterior>,
    inclusions: Vec<Inclusion>,
    effective: Option<Vec<f64>>,
    relax: Vec<(f64, f64)>,
}

/// Registers.
///
/// # Errors
/// as the spline.
pub fn register(
    sources: &[Source],
    datum: usize,
    pieces: &[(f64, f64)],
    settings: &Settings,
) -> Result<Registered, EstimateError> {
    check(sources)?;
    let mut fit = Fit::start(sources, datum, pieces, settings);
    let undetermined = || EstimateError::Undetermined {
        what: "registration".into(),
        why: "too few of them, or at too few instants",
    };
    let mut converged = false;
    let mut iterations = 0;
    for step in 0..40 {
        iterations = step + 1;
        let before = (fit.posterior.as_ref().map(|p| p.unknowns.clone()), fit.levels.clone());
        fit.solve(false).ok_or_else(undetermined)?;
        if step == 0 {
            fit.anchor();
        }
        let stage = if step < 6 && settings.robust { Stage::First } else { Stage::Mixture };
        fit.reweigh(stage);
        if step > 7 && fit.settled(&before.0, &before.1) {
            converged = true;
            break;
        }
    }
    if settings.select {
        let n: usize = std::env::var("FIN").map_or(3, |v| v.parse().unwrap());
        for _ in 0..n {
            fit.solve(true).ok_or_else(undetermined)?;
            fit.reweigh(Stage::Mixture);
        }
    }
    fit.solve(settings.select).ok_or_else(undetermined)?;
    Ok(fit.finish(iterations, converged))
}

#[derive(Clone, Copy, PartialEq)]
enum Stage {
    First,
    Mixture,
}

impl<'a> Fit<'a> {
    fn start(
        sources: &'a [Source],
        datum: usize,
        pieces: &'a [(f64, f64)],
        settings: &'a Settings,
    ) -> Self {
        let (from_s, to_s) = (pieces[0].0, pieces[pieces.len() - 1].1);
        let spacing_s =
            settings.knot_spacing_s.unwrap_or_else(|| spline::default_knot_spacing_s(sources, from_s, to_s));
        let knots = Knots::covering(pieces, spacing_s, 0.25);
        let (matrix, rank) = knots.jerk_penalty();
        let centre = std::array::from_fn(|axis| {
            let mut values: Vec<f64> =
                sources.iter().flat_map(|s| &s.positions).map(|p| p.value[axis]).collect();
            robust::median(&mut values).unwrap_or(0.0)
        });
        let references = sources
            .iter()
            .enumerate()
            .map(|(i, source)| Reference {
                anchor: Anchor { time_s: middle_s(source, &sources[datum]), point_m: centre },
                errors: SourceErrors::default(),
                is_datum: i == datum,
                centre,
            })
            .collect();
        let slots: Vec<usize> = (0..sources.len()).filter(|&i| i != datum).collect();
        let layout = Layout { slots, active: Vec::new() };
        Self {
            sources,
            settings,
            pieces,
            spacing_s,
            knots,
            references,
            layout,
            levels: vec![[Level::default(); 2]; sources.len()],
            weights: sources.iter().map(|s| Quantity::ALL.map(|q| vec![1.0; s.series(q).len()])).collect(),
            penalty: Penalty { matrix, rank, lambda: [1.0; 3] },
            posterior: None,
            inclusions: Vec::new(),
            effective: None,
            relax: vec![(1.0, 0.0); sources.len()],
        }
    }

    fn acting(&self, with_curve: bool) -> Vec<usize> {
        let mut active = Vec::new();
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            let source = &self.sources[source];
            for own in 0..OF_A_SOURCE {
                let (kind, axis) = kind_of(own);
                let acts = match kind {
                    Kind::Bias | Kind::Drift => !source.positions.is_empty(),
                    Kind::VelocityBias => !source.velocities.is_empty(),
                    Kind::ClockOffset | Kind::Scale => with_curve,
                    Kind::Rotation => false,
                };
                if acts {
                    active.push(index(slot, kind, axis));
                }
            }
        }
        active
    }

    fn variances(&self) -> Vec<f64> {
        if let Some(v) = &self.effective {
            return v.clone();
        }
        self.layout.active.iter().map(|&i| self.settings.priors.of(kind_of(i).0).powi(2)).collect()
    }

    fn solve(&mut self, select: bool) -> Option<()> {
        let latest = self.references.iter().map(|r| r.errors.clock_offset_s.abs()).fold(0.0, f64::max);
        let coefficients = match &self.posterior {
            Some(posterior) => posterior.coefficients.clone(),
            None => vec![[0.0; 3]; self.knots.count()],
        };
        let _ = latest;
        self.layout.active = self.acting(self.posterior.is_some());
        let totals: Vec<[Vec<f64>; 2]> = (0..self.sources.len())
            .map(|s| {
                [0, 1].map(|q| {
                    let precision = self.levels[s][q].precision();
                    self.weights[s][q].iter().map(|w| w * precision).collect()
                })
            })
            .collect();
        let mut series = Vec::new();
        for (s, source) in self.sources.iter().enumerate() {
            for (q, quantity) in Quantity::ALL.into_iter().enumerate() {
                let samples = source.series(quantity);
                series.push(Weighted { source: s, quantity, samples, weights: &totals[s][q] });
            }
        }
        let normal = Normal::of(&self.knots, &series, &self.references, &coefficients);
        let variances = self.variances();
        for axis in 0..3 {
            self.penalty.lambda[axis] =
                likeliest_lambda(&normal, &self.penalty, &self.layout, &variances, axis);
        }
        let eliminated = eliminate(&normal, &self.penalty, &self.layout)?;
        let estimate = if select {
            let averaged = selection::average(&eliminated.information, &self.layout, &self.settings.priors)?;
            self.inclusions = averaged.inclusions;
            if std::env::var_os("NOEFF").is_none() { self.effective = Some(averaged.variances);}
            averaged.estimate
        } else {
            eliminated.information.with_prior(&variances)?
        };
        let posterior = eliminated.posterior(&self.layout, &estimate);
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            let mut errors = SourceErrors::of(&posterior.unknowns, slot);
            let before = self.references[source].errors.clock_offset_s;
            let full = errors.clock_offset_s - before;
            let (relax, last) = &mut self.relax[slot];
            if *last != 0.0 {
                *relax = (*relax * *last / (*last - full)).clamp(0.25, 1.0);
            }
            if (*last - full).abs() == 0.0 || *last == 0.0 { *relax = 1.0; }
            *last = full;
            errors.clock_offset_s = before + *relax * full;
            self.references[source].errors = errors;
        }
        if std::env::var_os("TRACE").is_some() {
            eprintln!("tau {:.4} +- {:.4} bz {:.3} dev {:.3} lam {:?}", posterior.unknowns[9], posterior.covariance[(9, 9)].sqrt(), posterior.unknowns[2], eliminated.deviance_at_zero - 2.0 * estimate.log_evidence, self.penalty.lambda.map(|l| l.log10()));
        }
        self.posterior = Some(posterior);
        Some(())
    }

    /// Puts the anchors' points onto the first curve.
    fn anchor(&mut self) {
        let Some(posterior) = &self.posterior else { return };
        for reference in &mut self.references {
            let mut active = Active::default();
            self.knots.evaluate(reference.anchor.time_s, &mut active);
            reference.anchor.point_m = motion(&posterior.coefficients, &active, reference.centre)[0];
        }
    }

    fn reweigh(&mut self, stage: Stage) {
        let Some(posterior) = &self.posterior else { return };
        for (s, source) in self.sources.iter().enumerate() {
            for (q, quantity) in Quantity::ALL.into_iter().enumerate() {
                let residuals = vectorised(ResidualsOf {
                    knots: &self.knots,
                    posterior,
                    reference: &self.references[s],
                    slot: self.layout.slots.iter().position(|&i| i == s),
                    quantity,
                    samples: source.series(quantity),
                });
                let (level, weights) = (&mut self.levels[s][q], &mut self.weights[s][q]);
                match stage {
                    Stage::First => level.first_weights(&residuals, weights),
                    Stage::Mixture => {
                        level.step(&residuals, weights, self.settings.robust);
                        if self.settings.correlated {
                            level.correlate(&residuals, weights);
                        }
                    }
                }
            }
        }
    }

    fn settled(&self, unknowns: &Option<Vec<f64>>, levels: &[[Level; 2]]) -> bool {
        let (Some(before), Some(posterior)) = (unknowns, &self.posterior) else { return false };
        let near = |i: usize| {
            let sigma = posterior.covariance[(i, i)].sqrt();
            (posterior.unknowns[i] - before[i]).abs() <= 0.02 * sigma
        };
        let still = |a: &Level, b: &Level| {
            (a.precision() / b.precision()).ln().abs() < 0.01
        };
        let levels_still =
            self.levels.iter().flatten().zip(levels.iter().flatten()).all(|(a, b)| still(a, b));
        levels_still && (0..before.len()).all(near)
    }

    fn finish(self, iterations: usize, converged: bool) -> Registered {
        let posterior = self.posterior.expect("solved");
        let mut sigmas = vec![SourceErrors::default(); self.sources.len()];
        let deviations: Vec<f64> =
            (0..self.layout.len()).map(|i| posterior.covariance[(i, i)].sqrt()).collect();
        for (slot, &source) in self.layout.slots.iter().enumerate() {
            sigmas[source] = SourceErrors::of(&deviations, slot);
        }
        Registered {
            errors: self.references.iter().map(|r| r.errors).collect(),
            sigmas,
            levels: self.levels,
            inclusions: self.inclusions,
            lambda: self.penalty.lambda,
            iterations,
            converged,
            curve: RegisteredCurve {
                knots: self.knots,
                posterior,
                centre: self.references[0].centre,
                pieces: self.pieces.to_vec(),
            },
        }
    }
}

/// The middle of the overlap, or of the gap, of two sources.
fn middle_s(a: &Source, b: &Source) -> f64 {
    let (Some(a), Some(b)) = (a.span_s(), b.span_s()) else { return 0.0 };
    a.0.max(b.0).midpoint(a.1.min(b.1))
}

struct ResidualsOf<'a> {
    knots: &'a Knots,
    posterior: &'a Posterior,
    reference: &'a Reference,
    slot: Option<usize>,
    quantity: Quantity,
    samples: &'a [Sample],
}

impl Kernel for ResidualsOf<'_> {
    type Output = Residuals;

    #[inline(always)]
    fn run(self) -> Residuals {
        let Self { knots, posterior, reference, slot, quantity, samples } = self;
        let mut residuals = Residuals::default();
        let mut active = Active::default();
        for sample in samples {
            knots.evaluate(reference.time_s(sample.time_s), &mut active);
            let motion = motion(&posterior.coefficients, &active, reference.centre);
            let row = reference.row(quantity, sample, &motion);
            let left = if reference.is_datum {
                std::array::from_fn(|axis| sample.value[axis] - motion[quantity as usize][axis])
            } else {
                reference.residual(quantity, sample, &motion)
            };
            let b = if quantity == Quantity::Position { active.value() } else { active.slope() };
            let sigma = reference.sigma(sample);
            let mut leverage = 0.0;
            for axis in 0..3 {
                let own = slot.map(|slot| (slot, &row.columns[axis]));
                let variance = posterior.variance(axis, active.first, b, row.gain, own);
                leverage += variance / (sigma[axis] * sigma[axis]);
            }
            residuals.scaled.push(std::array::from_fn(|axis| left[axis] / sigma[axis]));
            residuals.leverage.push(leverage);
        }
        residuals
    }
}
