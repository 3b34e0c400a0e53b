//! The pieces that long silences cut a log into, each fitted by the method that was asked for.

use std::borrow::Cow;

use super::{Plan, SplineSummary, grid};
use crate::estimate::EstimateError;
use crate::estimate::Estimator;
use crate::estimate::coverage::Coverage;
use crate::estimate::moving_average::MovingAverage;
use crate::estimate::registration::RegisteredCurve;
use crate::estimate::weighted_mean::WeightedMean;
use crate::estimate::{polynomial, spline};
use crate::sample::{Quantity, Source};
use crate::time::Time;
use crate::track::{Curve, State};

/// A fitted piece.
pub(super) struct Piece<'a> {
    pub(super) from_s: f64,
    pub(super) to_s: f64,
    pub(super) sources: Cow<'a, [Source]>,
    pub(super) curve: Box<dyn Curve + 'a>,
    pub(super) spline: Option<SplineSummary>,
}

/// What of `sources` lies within `[from_s, to_s]`; no copy where that is all.
pub(super) fn within(sources: &[Source], from_s: f64, to_s: f64) -> Cow<'_, [Source]> {
    let inside = |s: &Source| s.span_s().is_none_or(|(first, last)| from_s <= first && last <= to_s);
    if sources.iter().all(inside) {
        Cow::Borrowed(sources)
    } else {
        sources.iter().map(|s| s.within(from_s, to_s)).collect()
    }
}

/// Fits every piece that can be, and warns of those that can't.
pub(super) fn fit_pieces<'a>(
    sources: &'a [Source],
    coverage: &Coverage,
    plan: &Plan,
    registered: Option<&'a RegisteredCurve>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Piece<'a>>, EstimateError> {
    let (mut fitted, mut first_error) = (Vec::new(), None);
    let (mut lost_samples, mut lost_at) = (0, None);
    for (from_s, to_s) in coverage.pieces(plan.bridge_max_s) {
        let inside = within(sources, from_s, to_s);
        match fit(&inside, from_s, to_s, plan, registered) {
            Ok((curve, spline)) => fitted.push(Piece { from_s, to_s, sources: inside, curve, spline }),
            Err(error) => {
                lost_samples += inside.iter().map(Source::len).sum::<usize>();
                lost_at.get_or_insert(plan.origin.plus_seconds(from_s));
                first_error.get_or_insert(error);
            }
        }
    }
    match (fitted.is_empty(), first_error) {
        (true, Some(error)) => return Err(error),
        (true, None) => {
            let what = plan.method.method().name().to_owned();
            return Err(EstimateError::TooFewSamples { what, needed: spline::MIN_SAMPLES, got: 0 });
        }
        _ => {}
    }
    if let Some(at) = lost_at {
        warn_of_lost(lost_samples, at, plan, warnings);
    }
    if fitted.len() > 1 {
        let longest = fitted.windows(2).map(|w| w[1].from_s - w[0].to_s).fold(0.0, f64::max);
        warnings.push(format!(
            "nobody sees the vehicle for up to {longest:.1} s, more than bridge_max_s = {} s: the track is cut \
             into {} pieces",
            plan.bridge_max_s,
            fitted.len()
        ));
    }
    Ok(fitted)
}

/// Warns of samples that stand alone.
pub(super) fn warn_of_lost(lost_samples: usize, first: Time, plan: &Plan, warnings: &mut Vec<String>) {
    warnings.push(format!(
        "left out: {lost_samples} {} more than {} s away from all others, too few to fit, the first at {first} \
         (wrong stamps?)",
        if lost_samples == 1 { "sample" } else { "samples" },
        plan.bridge_max_s
    ));
}

type Fitted<'a> = (Box<dyn Curve + 'a>, Option<SplineSummary>);

/// A curve that pieces share.
struct Shared<'a>(&'a RegisteredCurve);

impl Curve for Shared<'_> {
    fn at(&self, time_s: f64) -> Option<State> {
        self.0.at(time_s)
    }
}

fn fit<'a>(
    sources: &[Source],
    from_s: f64,
    to_s: f64,
    plan: &Plan,
    registered: Option<&'a RegisteredCurve>,
) -> Result<Fitted<'a>, EstimateError> {
    let got = instants(sources);
    if got < spline::MIN_SAMPLES {
        let what = plan.method.method().name().to_owned();
        return Err(EstimateError::TooFewSamples { what, needed: spline::MIN_SAMPLES, got });
    }
    if let (true, Some(curve)) = (plan.is_registered_spline(), registered) {
        return Ok((Box::new(Shared(curve)), None));
    }
    match plan.method {
        Estimator::Sff => {
            let settings = spline::Settings {
                knot_spacing_s: plan.knot_spacing_s,
                coefficients: plan.coefficients,
                ..spline::Settings::default()
            };
            let fitted = spline::fit(sources, from_s, to_s, &settings)?;
            let summary = SplineSummary {
                knots: fitted.knots(),
                lambda: fitted.lambda(),
                noise_scale: fitted.noise_scale(),
            };
            Ok((Box::new(fitted), Some(summary)))
        }
        Estimator::Pcf => {
            let fitted = polynomial::fit(sources, from_s, to_s, plan.order, plan.coefficients, None)?;
            Ok((Box::new(fitted), None))
        }
        Estimator::Gdf => Ok((Box::new(WeightedMean::new(sources.to_vec())), None)),
        Estimator::MovingAverage => {
            let mean = WeightedMean::new(sources.to_vec());
            let times = grid(from_s, to_s, plan.rate_hz);
            let average = MovingAverage::of(&mean, times, plan.window_points, 1.5 / plan.rate_hz)?;
            Ok((Box::new(average), None))
        }
    }
}

/// Number of different sampling instants, counted up to [`spline::MIN_SAMPLES`] of each series.
pub(super) fn instants(sources: &[Source]) -> usize {
    let mut times: Vec<f64> = Vec::new();
    for series in sources.iter().flat_map(|s| Quantity::ALL.map(|q| s.series(q))) {
        let mut own: Vec<f64> = Vec::new();
        for sample in series {
            if own.last() != Some(&sample.time_s) {
                own.push(sample.time_s);
            }
            if own.len() == spline::MIN_SAMPLES {
                break;
            }
        }
        times.extend(own);
    }
    times.sort_by(f64::total_cmp);
    times.dedup();
    times.len()
}
