//! The measurement model of one source, and its linear form about an estimate.
//!
//! With q = p(t_m) the anchor's point, R the rotation about the vertical, u = p(t) - q:
//!
//! ```text
//! stamp = t + tau
//! R' (position - q') = (1 + c) u + b + r (t - t_m)                                                      (1)
//! R' velocity       = (1 + c) v(t) + r + w                                                              (2)
//! ```
//!
//! q' is q, but of a turned source its image in the frame that the fit begins with: R' (q' - q) is added to b in the end.
//! About tau0, c0, psi0 and a curve p0 these are linear in the spline and in all unknowns; J turns by a right
//! angle about the vertical:
//!
//! ```text
//! d/dtau = -((1 + c0) v0 + r0)  or  -(1 + c0) a0;    d/dc = u0  or  v0;    d/dpsi = J (right side)      (3)
//! ```

use super::unknowns::{OF_AN_AXIS, SourceErrors};
use crate::sample::{Quantity, Sample};

/// Numbers in a row of an axis beside its spline functions: one an unknown that acts on it, the measured value,
/// and one more that makes the length a multiple of four.
pub(super) const COLUMNS: usize = 8;

/// Where among the columns the measured value stands.
pub(super) const VALUE: usize = OF_AN_AXIS;

/// Where drift and scale error are zero by definition.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anchor {
    /// The instant t_m, s: the middle of the overlap with the datum, or of the gap.
    pub time_s: f64,
    /// The point q, m.
    pub point_m: [f64; 3],
}

/// What is thought of a source while its rows are made.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reference {
    pub(super) anchor: Anchor,
    /// The anchor's point as the frame has it that the source is thought to be in: the bias counts from there.
    pub(super) image_m: [f64; 3],
    pub(super) errors: SourceErrors,
    /// Whether it is the datum, which has no unknowns.
    pub(super) is_datum: bool,
    /// What the spline's coefficients count from, m.
    pub(super) centre: [f64; 3],
}

/// The curve at an instant: position, velocity, acceleration.
pub(super) type Motion = [[f64; 3]; 3];

/// A sample in linear form: `value = gain * (spline or its derivative) + columns . unknowns`, by axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) gain: f64,
    pub(super) columns: [[f64; COLUMNS]; 3],
}

/// (x, y) turned by `angle_rad`, z kept.
pub(super) fn turned(v: [f64; 3], angle_rad: f64) -> [f64; 3] {
    if angle_rad == 0.0 {
        return v;
    }
    let (sin, cos) = angle_rad.sin_cos();
    [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]]
}

impl Reference {
    /// The true instant of a stamp, s.
    #[inline(always)]
    pub(super) fn time_s(&self, stamp_s: f64) -> f64 {
        stamp_s - self.errors.clock_offset_s
    }

    /// The right sides of (1) and (2): what a source with these errors would measure, turned back.
    #[inline(always)]
    fn expected(&self, quantity: Quantity, time_s: f64, motion: &Motion) -> [f64; 3] {
        let Self { anchor, errors, .. } = self;
        let gain = 1.0 + errors.scale;
        std::array::from_fn(|axis| match quantity {
            Quantity::Position => {
                let u = motion[0][axis] - anchor.point_m[axis];
                gain * u + errors.bias_m[axis] + errors.drift_m_s[axis] * (time_s - anchor.time_s) // (1)
            }
            Quantity::Velocity => {
                gain * motion[1][axis] + errors.drift_m_s[axis] + errors.velocity_bias_m_s[axis] // (2)
            }
        })
    }

    /// The left sides of (1) and (2).
    #[inline(always)]
    fn turned_back(&self, quantity: Quantity, value: [f64; 3]) -> [f64; 3] {
        let q = match quantity {
            Quantity::Position => self.image_m,
            Quantity::Velocity => [0.0; 3],
        };
        turned(std::array::from_fn(|axis| value[axis] - q[axis]), -self.errors.rotation_rad)
    }

    /// What is to be added to the bias so that it counts from the anchor's point itself, m.
    pub(super) fn frame_bias_m(&self, rotation_rad: f64) -> [f64; 3] {
        turned([0, 1, 2].map(|axis| self.image_m[axis] - self.anchor.point_m[axis]), -rotation_rad)
    }

    /// What a sample is off by from the model, with the curve's motion at its true instant.
    #[inline(always)]
    pub(super) fn residual(&self, quantity: Quantity, sample: &Sample, motion: &Motion) -> [f64; 3] {
        let expected = self.expected(quantity, self.time_s(sample.time_s), motion);
        let measured = self.turned_back(quantity, sample.value);
        std::array::from_fn(|axis| measured[axis] - expected[axis])
    }

    /// The sample in linear form.
    #[inline(always)]
    pub(super) fn row(&self, quantity: Quantity, sample: &Sample, motion: &Motion) -> Row {
        let Self { anchor, errors, .. } = self;
        let mut columns = [[0.0; COLUMNS]; 3];
        if self.is_datum {
            for axis in 0..3 {
                let zero = if quantity == Quantity::Position { self.centre[axis] } else { 0.0 };
                columns[axis][VALUE] = sample.value[axis] - zero;
            }
            return Row { gain: 1.0, columns };
        }
        let gain = 1.0 + errors.scale;
        let time_s = self.time_s(sample.time_s);
        let measured = self.turned_back(quantity, sample.value);
        let expected = self.expected(quantity, time_s, motion);
        let across = [-expected[1], expected[0], 0.0]; // J
        for axis in 0..3 {
            let (clock, scale, zero) = match quantity {
                Quantity::Position => (
                    -(gain * motion[1][axis] + errors.drift_m_s[axis]),
                    motion[0][axis] - anchor.point_m[axis],
                    gain * (anchor.point_m[axis] - self.centre[axis]),
                ),
                Quantity::Velocity => (-gain * motion[2][axis], motion[1][axis], 0.0),
            };
            let moved =
                errors.clock_offset_s * clock + errors.scale * scale + errors.rotation_rad * across[axis];
            let value = measured[axis] + zero + moved;
            columns[axis] = match quantity {
                Quantity::Position => {
                    [1.0, time_s - anchor.time_s, 0.0, clock, scale, across[axis], value, 0.0]
                }
                Quantity::Velocity => [0.0, 1.0, 1.0, clock, scale, across[axis], value, 0.0],
            }; // (3)
        }
        Row { gain, columns }
    }

    /// Standard deviations in the turned frame: of x and y the mean variance, where they are turned.
    #[inline(always)]
    pub(super) fn sigma(&self, sample: &Sample) -> [f64; 3] {
        let [x, y, z] = sample.sigma;
        if self.errors.rotation_rad == 0.0 {
            return [x, y, z];
        }
        let level = (0.5 * (x * x + y * y)).sqrt();
        [level, level, z]
    }
}
