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
    /// It has the position of the one before it, or that of another one of its time.
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
        "from {} s to {} s {rejected} of {of} exchanges were thrown out: the track may be wrong there by more than its bands",
        whole(*from_s),
        whole(*to_s)
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
        "from {} s to {} s the fixes allow another track, up to {apart_m:.0} m off (odds {odds:.2})",
        whole(*from_s),
        whole(*to_s)
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
    /// So many fixes were thrown out that those left over may be the wrong ones.
    #[error("{rejected} of {of} fixes were thrown out: the track may follow the wrong ones")]
    ManyWildFixes {
        /// How many were thrown out.
        rejected: usize,
        /// Of how many.
        of: usize,
    },
    /// Fixes that were thrown out agree with each other.
    #[error(
        "{alike} of {of} fixes that were thrown out are off like the one before them, by {off_m:.0} m: is there another \
         vehicle or transponder among the fixes, or a reflection?"
    )]
    AnotherTrack {
        /// How many are off like the one before them.
        alike: usize,
        /// Of how many that are off by enough to tell.
        of: usize,
        /// How far those are off in the median, m.
        off_m: f64,
    },
    /// Most fixes that have a depth beside them are elsewhere.
    #[error(
        "{off} of {of} fixes were thrown out because they are not at the depth sensor's depth (median: {}): check sign, \
         unit and zero of `usbl.depth`",
        beside(*median_m)
    )]
    OffDepth {
        /// How many are elsewhere.
        off: usize,
        /// Of how many that have a depth beside them.
        of: usize,
        /// How far those are above the depth sensor's depth in the median, m.
        median_m: f64,
    },
    /// Fixes that only say the last one again.
    #[error(
        "{held} of {of} fixes repeat the position before them, which the track takes once: a system may do so while it \
             hears nothing"
    )]
    Held {
        /// How many.
        held: usize,
        /// Of how many.
        of: usize,
    },
    /// The vehicle is faster than it should be.
    #[error(
        "the track is faster than `usbl.speed_limit_m_s` = {limit_m_s} at {exchanges} of {of} exchanges, up to \
         {speed_m_s:.1} m/s: where the vehicle is, set it higher"
    )]
    Fast {
        /// At how many exchanges.
        exchanges: usize,
        /// Of how many that are believed.
        of: usize,
        /// The highest speed at one of them, m/s.
        speed_m_s: f64,
        /// The limit, m/s.
        limit_m_s: f64,
    },
    /// Fixes of one exchange lie closer together than the noise that was found has it.
    #[error(
        "the noise is {factor:.1} times what the nearest fixes of one exchange tell: many fixes are wild, or all of an \
         exchange are off together, and the bands may be wrong"
    )]
    NoiseWithin {
        /// Standard deviation over that of the nearest fixes of one exchange.
        factor: f64,
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

/// Whole seconds, and never "-0".
fn whole(time_s: f64) -> f64 {
    time_s.round() + 0.0
}

/// "12 m above it", of a fix beside a depth sensor.
pub(crate) fn beside(above_m: f64) -> String {
    format!("{:.0} m {} it", above_m.abs(), if above_m < 0.0 { "below" } else { "above" })
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
