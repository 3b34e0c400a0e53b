//! What became of every fix, and what a person must know of the whole.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What became of a fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The track rests on it.
    Kept,
    /// Thrown out: it is not where the vehicle was.
    Wild,
    /// Thrown out: it repeats another one, which is judged.
    Duplicate,
}

/// Why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// It fits the track.
    Fits,
    /// It alone of its exchange is off.
    OffByItself,
    /// Its whole exchange is off.
    OffAsCycle,
    /// Its height is not that of the depth sensor.
    OffDepth,
    /// It has the time and the position of an earlier one.
    Repeated,
    /// It and the few about it stand alone in time, too few for a track.
    Stray,
}

impl Verdict {
    /// The verdict's name in logs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Wild => "wild",
            Self::Duplicate => "duplicate",
        }
    }
}

impl Reason {
    /// The reason's name in logs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fits => "fits",
            Self::OffByItself => "off-by-itself",
            Self::OffAsCycle => "off-as-cycle",
            Self::OffDepth => "off-depth",
            Self::Repeated => "repeated",
            Self::Stray => "stray",
        }
    }
}

/// A fix, judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// What became of it.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
    /// Whether it came after one of a later time.
    pub late: bool,
    /// Its exchange: an index into [`super::Cleaned::cycle_times_s`].
    pub cycle: usize,
    /// The fix less the track, m.
    pub residual_m: [f64; 3],
    /// Length of the residual over its standard deviation, which is the track's and the noise's together.
    pub residual_sigmas: f64,
}

impl Judged {
    /// Before anything is known of a fix.
    pub(crate) const UNJUDGED: Self = Self {
        verdict: Verdict::Kept,
        reason: Reason::Fits,
        late: false,
        cycle: 0,
        residual_m: [f64::NAN; 3],
        residual_sigmas: f64::NAN,
    };
}

/// What a person must know of a track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum Warning {
    /// So many exchanges were thrown out as a whole that those left over may be the wrong ones.
    #[error("{rejected} of {of} exchanges were thrown out as a whole: the track may follow the wrong ones")]
    ManyWildCycles {
        /// How many were thrown out.
        rejected: usize,
        /// Of how many.
        of: usize,
    },
    /// For a while hardly any exchange was believed: those that were may be the wrong ones.
    #[error(
        "from {from_s:.0} s to {to_s:.0} s {rejected} of {of} exchanges were thrown out: the track may be wrong there by more \
         than its bands"
    )]
    WildStretch {
        /// Where it begins, s.
        from_s: f64,
        /// Where it ends, s.
        to_s: f64,
        /// How many were thrown out.
        rejected: usize,
        /// Of how many.
        of: usize,
    },
    /// Another track explains the fixes nearly as well.
    #[error(
        "from {from_s:.0} s to {to_s:.0} s the fixes allow another track, up to {apart_m:.0} m off (odds {odds:.2})"
    )]
    Ambiguous {
        /// Where the other one leaves this one, s.
        from_s: f64,
        /// Where it comes back, s.
        to_s: f64,
        /// How far they are apart, m.
        apart_m: f64,
        /// How likely the other one is beside this one.
        odds: f64,
    },
    /// Some fixes stand alone in time.
    #[error(
        "{count} of {of} fixes are left out: a long silence parts them from the others, and they are too few for a track of \
         their own; are their stamps right?"
    )]
    Stray {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
    },
    /// Fixes came late, and not as acoustic systems do.
    #[error(
        "{count} of {of} fixes came after one of a later time, by up to {most_s:.0} s: was a clock set back? What was seen \
         before and after may lie upon each other"
    )]
    Late {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
        /// How late the latest was, s.
        most_s: f64,
    },
    /// The causal method never had a track.
    #[error("there is no prediction: too few fixes came in order of time")]
    NoPrediction,
    /// The noise differs from what was stated.
    #[error("the noise is {scale:.2} times what was stated")]
    Noise {
        /// Standard deviation over the stated one.
        scale: f64,
    },
}

impl Warning {
    /// The same with its times `by_s` later.
    #[must_use]
    pub fn later(mut self, by_s: f64) -> Self {
        if let Self::WildStretch { from_s, to_s, .. } | Self::Ambiguous { from_s, to_s, .. } = &mut self {
            *from_s += by_s;
            *to_s += by_s;
        }
        self
    }
}
