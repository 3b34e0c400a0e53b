//! How good a track is: held against its own samples, one by one ([`residuals()`]) and phase by phase
//! ([`phases()`]), and against a reference ([`compare`]).

mod comparison;
mod errors;
mod interpolation;
mod phases;
mod residuals;

pub use comparison::{Comparison, CrossingErrors, Jump, Kind, Stretch, Worst, compare, largest_jump};
pub use errors::{Bands, Errors};
pub use interpolation::Interpolated;
pub use phases::{PhaseSummary, phases};
pub use residuals::{Misfit, Residual, residuals};

/// 95 % of a normal distribution lie within this many standard deviations.
pub const BAND_SIGMAS: f64 = 1.959_963_984_540_054;
