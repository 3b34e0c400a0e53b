//! Which unknowns the data ask for: an average over models, weighted by their evidence.
//!
//! Each kind of error of each source is nothing, or normal with one of a few standard deviations about the prior's.
//! Since the spline is eliminated, a model costs no more than a small dense system. The models that matter are found
//! by walking from the best to its neighbours (Occam's window; Madigan, Raftery 1994), and averaged by their
//! evidence (MacKay 1992):
//!
//! ```text
//! w_m ~ p(m) p(data | m),   u = sum_m w_m u_m,   C = sum_m w_m (C_m + (u_m - u) (u_m - u)')
//! ```

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::bordered::{Estimate, Information, Layout};
use super::unknowns::{Kind, OF_A_SOURCE, Priors, kind_of};

/// Standard deviations that a kind of error may have, over the prior's.
const LEVELS: [f64; 4] = [0.0, 1.0 / 3.0, 1.0, 3.0];

/// How probable each of the levels is of an error that there is: three times the prior's sigma is rare.
const LEVEL_SHARES: [f64; 4] = [f64::NAN, 0.4, 0.5, 0.1];

/// Both parameters of the beta distribution of the share of errors that there are. One clock and one array with
/// errors have them all, a calibrated pair has none: small, and what is found makes the rest more likely (Scott,
/// Berger 2010, Ann. Stat. 38, 2587).
const SHARE_OF_ERRORS: f64 = 0.25;

/// The level that the search begins with.
const FIRST_LEVEL: u8 = 2;

/// Models whose weight is below exp(-8) of the best one's are left out.
const WINDOW: f64 = 8.0;

/// Most models that are looked at.
const MOST_MODELS: usize = 3000;

/// One kind of error of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inclusion {
    /// Index of the source.
    pub(super) source: usize,
    /// What kind of error.
    pub(super) kind: Kind,
    /// How probable it is that there is one.
    pub(super) probability: f64,
}

/// The unknowns, averaged over the models.
pub(super) struct Averaged {
    pub(super) estimate: Estimate,
    pub(super) inclusions: Vec<Inclusion>,
}

/// The acting unknowns that stand or fall together.
struct Group {
    source: usize,
    kind: Kind,
    members: Vec<usize>,
}

struct Models<'a> {
    information: &'a Information,
    /// Prior variances of the acting unknowns at level 1.
    variances: &'a [f64],
    groups: &'a [Group],
}

impl Models<'_> {
    fn estimate(&self, levels: &[u8]) -> Option<Estimate> {
        let mut variances = self.variances.to_vec();
        for (group, &level) in self.groups.iter().zip(levels) {
            let factor = LEVELS[usize::from(level)].powi(2);
            group.members.iter().for_each(|&i| variances[i] *= factor);
        }
        self.information.with_prior(&variances)
    }

    fn log_weight(&self, levels: &[u8]) -> f64 {
        let sources: BTreeSet<usize> = self.groups.iter().map(|g| g.source).collect();
        let of_source = |source| {
            let own = self.groups.iter().zip(levels).filter(move |(g, _)| g.source == source);
            let (all, some) = (own.clone().count(), own.filter(|(_, level)| **level > 0));
            let shares: f64 = some.clone().map(|(_, &level)| LEVEL_SHARES[usize::from(level)].ln()).sum();
            shares + log_share(some.count(), all)
        };
        let prior: f64 = sources.into_iter().map(of_source).sum();
        self.estimate(levels).map_or(f64::NEG_INFINITY, |e| prior + e.log_evidence)
    }

    /// The models of Occam's window with their weights over the best one's, and the logarithm of that.
    fn search(&self) -> (Vec<(Vec<u8>, f64)>, f64) {
        let start = vec![FIRST_LEVEL; self.groups.len()];
        let mut weights = BTreeMap::from([(start.clone(), self.log_weight(&start))]);
        let mut best = weights[&start];
        let mut expanded = BTreeSet::new();
        while weights.len() < MOST_MODELS {
            let open = weights.iter().filter(|(model, w)| **w > best - WINDOW && !expanded.contains(*model));
            let Some((model, _)) = open.max_by(|a, b| a.1.total_cmp(b.1)) else { break };
            let model = model.clone();
            for group in 0..model.len() {
                for level in 0..LEVELS.len() as u8 {
                    let mut near = model.clone();
                    near[group] = level;
                    if let Entry::Vacant(place) = weights.entry(near) {
                        let weight = self.log_weight(place.key());
                        place.insert(weight);
                        best = best.max(weight);
                    }
                }
            }
            expanded.insert(model);
        }
        let inside = weights.into_iter().filter(|(_, w)| *w > best - WINDOW);
        (inside.map(|(model, w)| (model, (w - best).exp())).collect(), best)
    }
}

/// Averages over the models.
pub(super) fn average(information: &Information, layout: &Layout, priors: &Priors) -> Option<Averaged> {
    let variances: Vec<f64> = layout.active.iter().map(|&i| priors.of(kind_of(i).0).powi(2)).collect();
    let groups = groups(layout);
    let models = Models { information, variances: &variances, groups: &groups };
    let (found, best) = models.search();
    let total: f64 = found.iter().map(|(_, w)| w).sum();
    let k = variances.len();
    // counted from one of them, so that what differs isn't lost in the rounding of what doesn't
    let mut reference = None;
    let mut mean = DVector::zeros(k);
    let mut second = DMatrix::zeros(k, k);
    let mut probabilities = vec![0.0; groups.len()];
    for (levels, weight) in &found {
        let share = weight / total;
        let one = models.estimate(levels)?;
        let origin: &DVector<f64> = reference.get_or_insert_with(|| one.mean.clone());
        let from = one.mean - origin;
        second += share * (one.covariance + &from * from.transpose());
        mean += from * share;
        for (probability, &level) in probabilities.iter_mut().zip(levels) {
            *probability += if level == 0 { 0.0 } else { share };
        }
    }
    let covariance = second - &mean * mean.transpose();
    let mean = mean + reference?;
    let inclusions = groups.iter().zip(probabilities).map(|(group, probability)| Inclusion {
        source: group.source,
        kind: group.kind,
        probability,
    });
    Some(Averaged {
        estimate: Estimate { mean, covariance, log_evidence: best + total.ln() },
        inclusions: inclusions.collect(),
    })
}

/// The log probability of one choice of `included` out of `count`, the share of errors integrated out:
/// B(a + k, a + n - k) / B(a, a).
fn log_share(included: usize, count: usize) -> f64 {
    let rising = |from: f64, n: usize| (0..n).map(|i| (from + i as f64).ln()).sum::<f64>();
    let a = SHARE_OF_ERRORS;
    rising(a, included) + rising(a, count - included) - rising(2.0 * a, count)
}

/// The kinds of errors of each source; a rotation that is looked for stands beyond doubt.
fn groups(layout: &Layout) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (place, &i) in layout.active.iter().enumerate() {
        let (source, kind) = (layout.slots[i / OF_A_SOURCE], kind_of(i).0);
        if kind == Kind::Rotation {
            continue;
        }
        match groups.iter_mut().find(|g| g.source == source && g.kind == kind) {
            Some(group) => group.members.push(place),
            None => groups.push(Group { source, kind, members: vec![place] }),
        }
    }
    groups
}
