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

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::bordered::{Estimate, Information, Layout};
use super::unknowns::{Kind, OF_A_SOURCE, Priors, kind_of};

/// Standard deviations that a kind of error may have, over the prior's.
static EXP: std::sync::LazyLock<(Vec<f64>, Vec<f64>)> = std::sync::LazyLock::new(|| {
    let v = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into()).split(',').map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    (v("LV", "0,0.3333,1,3"), v("SH", "0.4,0.2,0.2,0.2"))
});

/// How probable each is before anything is known.


/// The level that the search begins with.
const FIRST_LEVEL: u8 = 2;

/// Models whose weight is below exp(-8) of the best one's are left out.
const WINDOW: f64 = 8.0;

/// Most models that are looked at.
const MOST_MODELS: usize = 3000;

/// One kind of error of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inclusion {
    /// Index of the source.
    pub source: usize,
    /// What kind of error.
    pub kind: Kind,
    /// How probable it is that there is one.
    pub probability: f64,
}

/// The unknowns, averaged over the models.
pub(super) struct Averaged {
    pub(super) estimate: Estimate,
    pub(super) inclusions: Vec<Inclusion>,
    /// The prior's variances, averaged.
    pub(super) variances: Vec<f64>,
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
            let factor = EXP.0[usize::from(level)].powi(2);
            group.members.iter().for_each(|&i| variances[i] *= factor);
        }
        self.information.with_prior(&variances)
    }

    fn log_weight(&self, levels: &[u8]) -> f64 {
        let g = levels.len();
        let k = levels.iter().filter(|l| **l > 0).count();
        let (a, b) = (EXP.1[0], EXP.1[1]);
        // log of B(a+k, b+g-k)/B(a,b)
        let mut prior = 0.0;
        for i in 0..k { prior += (a + i as f64).ln(); }
        for i in 0..g - k { prior += (b + i as f64).ln(); }
        for i in 0..g { prior -= (a + b + i as f64).ln(); }
        prior -= k as f64 * ((EXP.0.len() - 1) as f64).ln();
        self.estimate(levels).map_or(f64::NEG_INFINITY, |e| prior + e.log_evidence)
    }

    /// The models of Occam's window with their log weights.
    fn search(&self) -> Vec<(Vec<u8>, f64)> {
        let start = vec![FIRST_LEVEL; self.groups.len()];
        let mut weights = BTreeMap::from([(start.clone(), self.log_weight(&start))]);
        let mut best = weights[&start];
        let mut expanded = BTreeSet::new();
        while weights.len() < MOST_MODELS {
            let open = weights.iter().filter(|(model, w)| **w > best - WINDOW && !expanded.contains(*model));
            let Some((model, _)) = open.max_by(|a, b| a.1.total_cmp(b.1)) else { break };
            let model = model.clone();
            for group in 0..model.len() {
                for level in 0..EXP.0.len() as u8 {
                    let mut near = model.clone();
                    near[group] = level;
                    if !weights.contains_key(&near) {
                        let weight = self.log_weight(&near);
                        best = best.max(weight);
                        weights.insert(near, weight);
                    }
                }
            }
            expanded.insert(model);
        }
        weights.into_iter().filter(|(_, w)| *w > best - WINDOW).map(|(m, w)| (m, (w - best).exp())).collect()
    }
}

/// Averages over the models.
pub(super) fn average(information: &Information, layout: &Layout, priors: &Priors) -> Option<Averaged> {
    let variances: Vec<f64> = layout.active.iter().map(|&i| priors.of(kind_of(i).0).powi(2)).collect();
    let groups = groups(layout);
    let models = Models { information, variances: &variances, groups: &groups };
    let found = models.search();
    let total: f64 = found.iter().map(|(_, w)| w).sum();
    let k = variances.len();
    let mut mean = DVector::zeros(k);
    let mut second = DMatrix::zeros(k, k);
    let mut probabilities = vec![0.0; groups.len()];
    let mut effective = vec![0.0; k];
    for (levels, weight) in &found {
        let share = weight / total;
        let one = models.estimate(levels)?;
        mean += share * &one.mean;
        second += share * (one.covariance + &one.mean * one.mean.transpose());
        for (group, &level) in groups.iter().zip(levels) {
            let factor = EXP.0[usize::from(level)].powi(2);
            group.members.iter().for_each(|&i| effective[i] += share * factor * variances[i]);
        }
        for (probability, &level) in probabilities.iter_mut().zip(levels) {
            *probability += if level == 0 { 0.0 } else { share };
        }
    }
    let covariance = second - &mean * mean.transpose();
    let inclusions = groups.iter().zip(probabilities).map(|(group, probability)| Inclusion {
        source: group.source,
        kind: group.kind,
        probability,
    });
    Some(Averaged {
        estimate: Estimate { mean, covariance, log_evidence: total.ln() },
        inclusions: inclusions.collect(),
        variances: effective,
    })
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
