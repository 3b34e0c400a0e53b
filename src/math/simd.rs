//! The widest vector instructions of the machine for the few hot loops.

use pulp::{Arch, Simd, WithSimd};

/// A hot loop with what it needs.
///
/// `run`, and what it calls, must be `#[inline(always)]` to profit.
pub trait Kernel {
    /// What it computes.
    type Output;

    /// Computes it.
    fn run(self) -> Self::Output;
}

struct Dispatched<K>(K);

impl<K: Kernel> WithSimd for Dispatched<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run()
    }
}

/// Runs a kernel compiled for what the machine has (AVX2 where it does), found at run time.
///
/// Results are the same to the last bit on every machine: the compiler neither fuses nor reorders
/// floating-point operations.
#[inline]
pub fn vectorised<K: Kernel>(kernel: K) -> K::Output {
    Arch::new().dispatch(Dispatched(kernel))
}
