//! How sure a track is of itself beyond what its curve knows.

use super::Plan;
use super::pieces::Piece;
use super::registered::widened;
use crate::estimate::agreement::{self, Disagreement};
use crate::estimate::coverage::Coverage;
use crate::estimate::registration::Registered;
use crate::sample::{Quantity, Source};
use crate::track::{Phase, State};

/// What the bands hold beside a curve's own sigma.
pub(super) enum Bands<'a> {
    /// What the registration leaves open, which only the registered spline itself knows of.
    Registered {
        /// The registration.
        registered: &'a Registered,
        /// Whether its spline is the track.
        is_track: bool,
    },
    /// What the sources may differ by.
    Unregistered(Unregistered),
}

impl Bands<'_> {
    /// The state with the sigmas that it deserves; NaN for those that nobody knows.
    pub(super) fn widen(&self, state: State, time_s: f64, seen_by: u32, phase: Phase) -> State {
        match self {
            Self::Unregistered(bands) => bands.widen(state, time_s, seen_by),
            Self::Registered { is_track: true, .. } if phase != Phase::Extrapolated => state,
            Self::Registered { registered, .. } => widened(state, time_s, registered),
        }
    }
}

/// What sources that aren't registered to each other may differ by.
pub(super) struct Unregistered {
    /// In position, m, and velocity, m/s, by axis.
    systematic: [[f64; 3]; 2],
    /// Whether they differ by so much that they pull the curve away from the datum even where it sees alone.
    everywhere: bool,
    /// Whether a source could not be compared with the datum in position or velocity, so that without the
    /// datum nobody knows how sure the track is.
    unknown: [bool; 2],
    /// The datum's bit, and when it sees, s.
    datum: u32,
    datum_runs: Vec<(f64, f64)>,
}

impl Unregistered {
    pub(super) fn of(
        sources: &[Source],
        coverage: &Coverage,
        disagreements: &[Disagreement],
        plan: &Plan,
    ) -> Self {
        let apart = |q| agreement::uncompared(sources, disagreements, q);
        Self {
            systematic: Quantity::ALL.map(|q| agreement::systematic_sigma(disagreements, q)),
            everywhere: disagreements.iter().any(Disagreement::is_significant),
            unknown: Quantity::ALL
                .map(|q| apart(q).iter().any(|pair| pair.0 == plan.datum || pair.1 == plan.datum)),
            datum: 1 << plan.datum,
            datum_runs: coverage.runs(plan.datum).to_vec(),
        }
    }

    fn widen(&self, mut state: State, time_s: f64, seen_by: u32) -> State {
        let [position, velocity] = self.systematic;
        // away from the datum, velocities that differ make positions drift apart
        let away = |run: &(f64, f64)| (run.0 - time_s).max(time_s - run.1).max(0.0);
        let away_s = self.datum_runs.iter().map(away).fold(f64::INFINITY, f64::min);
        let away_s = if away_s.is_finite() { away_s } else { 0.0 };
        for axis in 0..3 {
            let (p, v) = (&mut state.position_sigma[axis], &mut state.velocity_sigma[axis]);
            if self.everywhere || seen_by != self.datum {
                *p = p.hypot(position[axis] + velocity[axis] * away_s);
                *v = v.hypot(velocity[axis]);
            }
            if seen_by & self.datum == 0 {
                *p = if self.unknown[0] { f64::NAN } else { *p };
                *v = if self.unknown[1] { f64::NAN } else { *v };
            }
        }
        state
    }
}

/// Warns of sources that disagree, and of those that can't be compared.
pub(super) fn warn_of_disagreement(
    sources: &[Source],
    disagreements: &[Disagreement],
    warnings: &mut Vec<String>,
) {
    for d in disagreements.iter().filter(|d| d.is_significant()) {
        let (first, second) = (&sources[d.sources.0].name, &sources[d.sources.1].name);
        let (what, unit) = (d.quantity.name(), d.quantity.unit());
        let [x, y, z] = d.median;
        warnings.push(format!(
            "{second} and {first} disagree in {what} by more than their sigmas and are not registered: \
             {second} - {first} = ({x:+.2}, {y:+.2}, {z:+.2}) {unit}; the track lies between them and every \
             band is widened by that much",
        ));
    }
    for quantity in Quantity::ALL {
        for (first, second) in agreement::uncompared(sources, disagreements, quantity) {
            let what = quantity.name();
            warnings.push(format!(
                "{} and {} never measure {what} at the same time: nobody can say whether they agree, and where \
                 the datum doesn't see the track has no sigma of its {what}",
                sources[first].name, sources[second].name
            ));
        }
    }
}

/// Residuals this many times the sigmas mean that something is wrong with one or the other.
const MISFIT: f64 = 2.0;

/// Warns of a fit that leaves more than noise, where no known disagreement explains it.
pub(super) fn warn_of_misfit(pieces: &[Piece], disagreements: &[Disagreement], warnings: &mut Vec<String>) {
    let scales = pieces.iter().filter_map(|p| p.spline).flat_map(|s| s.noise_scale);
    let worst = scales.fold(0.0, f64::max);
    if worst > MISFIT && !disagreements.iter().any(Disagreement::is_significant) {
        warnings.push(format!(
            "the samples lie up to {worst:.1} times their sigmas from the track (root mean square): outliers, \
             sigmas that are too small, or sources that disagree; the bands are widened by that factor"
        ));
    }
}
