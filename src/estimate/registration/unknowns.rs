//! The systematic errors of one source, and their places among the unknowns beside the spline.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a source's samples are off by, against the datum. All zero for the datum itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SourceErrors {
    /// Bias of the position at the anchor's instant, m.
    pub bias_m: [f64; 3],
    /// Rate at which that bias grows, m/s.
    pub drift_m_s: [f64; 3],
    /// Bias of the velocity beside the drift, m/s.
    pub velocity_bias_m_s: [f64; 3],
    /// How late the stamps are, s.
    pub clock_offset_s: f64,
    /// Scale error, a share.
    pub scale: f64,
    /// Angle about the vertical from the datum's frame to the source's, counter-clockwise, rad.
    pub rotation_rad: f64,
}

/// What kind of error an unknown is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Of the position, m.
    Bias,
    /// Of the position's bias with time, m/s.
    Drift,
    /// Of the velocity, m/s.
    VelocityBias,
    /// Of the stamps, s.
    ClockOffset,
    /// Of position and velocity, a share.
    Scale,
    /// Of the frame about the vertical, rad.
    Rotation,
}

impl Kind {
    /// All, in the order in which they are reported.
    pub const ALL: [Self; 6] =
        [Self::Bias, Self::Drift, Self::VelocityBias, Self::ClockOffset, Self::Scale, Self::Rotation];

    /// The kind's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bias => "bias",
            Self::Drift => "drift",
            Self::VelocityBias => "velocity bias",
            Self::ClockOffset => "clock offset",
            Self::Scale => "scale",
            Self::Rotation => "rotation",
        }
    }

    /// Its name in configs.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::VelocityBias => "velocity-bias",
            Self::ClockOffset => "clock-offset",
            _ => self.name(),
        }
    }

    /// Its unit; none for a share.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Bias => "m",
            Self::Drift | Self::VelocityBias => "m/s",
            Self::ClockOffset => "s",
            Self::Scale => "",
            Self::Rotation => "rad",
        }
    }

    /// Whether there is one an axis, or one for all three.
    #[must_use]
    pub fn is_vector(self) -> bool {
        matches!(self, Self::Bias | Self::Drift | Self::VelocityBias)
    }
}

/// Unknowns of one source: three vectors and three numbers.
pub(super) const OF_A_SOURCE: usize = 12;

/// Unknowns of one source that act on one axis, one a [`Kind`].
pub(super) const OF_AN_AXIS: usize = 6;

/// Index of an unknown of the `slot`-th source beside the datum.
pub(super) fn index(slot: usize, kind: Kind, axis: usize) -> usize {
    let own = match kind {
        Kind::Bias => axis,
        Kind::Drift => 3 + axis,
        Kind::VelocityBias => 6 + axis,
        Kind::ClockOffset => 9,
        Kind::Scale => 10,
        Kind::Rotation => 11,
    };
    slot * OF_A_SOURCE + own
}

/// The kind and axis of an unknown; the axis is 0 for what has none.
pub(super) fn kind_of(index: usize) -> (Kind, usize) {
    match index % OF_A_SOURCE {
        own @ 0..3 => (Kind::Bias, own),
        own @ 3..6 => (Kind::Drift, own - 3),
        own @ 6..9 => (Kind::VelocityBias, own - 6),
        9 => (Kind::ClockOffset, 0),
        10 => (Kind::Scale, 0),
        _ => (Kind::Rotation, 0),
    }
}

impl SourceErrors {
    /// The errors of the `slot`-th source out of all unknowns.
    pub(super) fn of(values: &[f64], slot: usize) -> Self {
        let vector = |kind| std::array::from_fn(|axis| values[index(slot, kind, axis)]);
        let number = |kind| values[index(slot, kind, 0)];
        Self {
            bias_m: vector(Kind::Bias),
            drift_m_s: vector(Kind::Drift),
            velocity_bias_m_s: vector(Kind::VelocityBias),
            clock_offset_s: number(Kind::ClockOffset),
            scale: number(Kind::Scale),
            rotation_rad: number(Kind::Rotation),
        }
    }
}

/// Standard deviations of the errors before anything is known: normal, of zero mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Priors {
    /// Of the bias, m an axis.
    pub bias_m: f64,
    /// Of the drift, m/s an axis.
    pub drift_m_s: f64,
    /// Of the velocity's bias, m/s an axis.
    pub velocity_bias_m_s: f64,
    /// Of the clock offset, s.
    pub clock_offset_s: f64,
    /// Of the scale error, a share.
    pub scale: f64,
    /// Of the rotation, rad, where one is looked for.
    pub rotation_rad: f64,
}

impl Default for Priors {
    /// What acoustic positioning shows on trials; a rotation may be anything. The evidence looks at a third and at
    /// three times of these too, so that they need only be of the right size.
    fn default() -> Self {
        Self {
            bias_m: 3.0,
            drift_m_s: 0.10,
            velocity_bias_m_s: 0.30,
            clock_offset_s: 0.06,
            scale: 0.003,
            rotation_rad: 1.8,
        }
    }
}

impl Priors {
    /// The standard deviation of one kind.
    #[must_use]
    pub fn of(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Bias => self.bias_m,
            Kind::Drift => self.drift_m_s,
            Kind::VelocityBias => self.velocity_bias_m_s,
            Kind::ClockOffset => self.clock_offset_s,
            Kind::Scale => self.scale,
            Kind::Rotation => self.rotation_rad,
        }
    }
}
