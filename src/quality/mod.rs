//! How good a track is: held against its own samples, phase by phase ([`phases()`]), and against a reference
//! ([`compare`]).

mod comparison;
mod errors;
mod interpolation;
mod phases;

pub use comparison::{Comparison, CrossingErrors, Jump, Kind, Stretch, Worst, compare, largest_jump};
pub use errors::{Bands, Errors};
pub use interpolation::Interpolated;
pub use phases::{PhaseSummary, phases};

/// 95 % of a normal distribution lie within this many standard deviations.
pub const BAND_SIGMAS: f64 = 1.959_963_984_540_054;
