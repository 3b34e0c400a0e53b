//! Mathematics that knows no sea: numbers in, numbers out.

pub mod autocorrelation;
pub mod banded;
pub mod chebyshev;
mod elimination;
pub mod gaussian_basis;
pub mod geodesy;
pub mod least_squares;
pub mod log_histogram;
pub mod polyline;
pub mod robust;
pub mod scalar;
pub mod simd;
