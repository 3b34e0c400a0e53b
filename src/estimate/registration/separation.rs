//! Which unknowns the data can tell apart.

use super::bordered::{Information, Layout};
use super::unknowns::{Kind, OF_A_SOURCE, Priors, kind_of};

/// An unknown whose variance falls by less than this share has learned nothing.
const LEARNED: f64 = 0.2;

/// Two unknowns with more correlation than this are known by their combination only.
const INSEPARABLE: f64 = 0.95;

/// One error of one source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// Index of the source.
    pub source: usize,
    /// What kind of error.
    pub kind: Kind,
    /// The axis; `None` for what has none.
    pub axis: Option<usize>,
}

/// What the data can tell of an unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separation {
    /// Its value.
    Separate,
    /// A combination of it and another one, whose correlation is above 0.95; each alone is uncertain.
    OnlyTogether,
    /// Next to nothing: it stays at what was thought of it before.
    AtPrior,
}

/// An error, with what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// Which.
    pub name: Name,
    /// Its estimate, averaged over the models, in the kind's unit.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Its standard deviation before anything was known.
    pub prior_sigma: f64,
    /// How probable it is that there is an error of this kind at all.
    pub probability: f64,
    /// The unknown that it is most correlated with if all are there, and that correlation.
    pub strongest: Option<(Name, f64)>,
    /// What the data can tell of it.
    pub separation: Separation,
}

/// For each acting unknown what the data tell of it if all errors are there: the strongest correlation and a verdict.
pub(super) fn separations(
    information: &Information,
    layout: &Layout,
    priors: &Priors,
) -> Vec<(Option<(Name, f64)>, Separation)> {
    let variances: Vec<f64> = layout.active.iter().map(|&i| priors.of(kind_of(i).0).powi(2)).collect();
    let Some(all) = information.with_prior(&variances) else { return Vec::new() };
    let covariance = all.covariance;
    let verdict = |i: usize| {
        let correlation = |j: usize| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        let others = (0..variances.len()).filter(|&j| j != i).map(|j| (j, correlation(j)));
        let strongest = others.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let separation = if covariance[(i, i)] > (1.0 - LEARNED) * variances[i] {
            Separation::AtPrior
        } else if strongest.is_some_and(|(_, r)| r.abs() > INSEPARABLE) {
            Separation::OnlyTogether
        } else {
            Separation::Separate
        };
        (strongest.map(|(j, r)| (name_of(layout, layout.active[j]), r)), separation)
    };
    (0..variances.len()).map(verdict).collect()
}

/// The name of an unknown.
pub(super) fn name_of(layout: &Layout, index: usize) -> Name {
    let (kind, axis) = kind_of(index);
    let source = layout.slots[index / OF_A_SOURCE];
    Name { source, kind, axis: kind.is_vector().then_some(axis) }
}
