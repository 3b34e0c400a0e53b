//! Shorter steps where Gauss-Newton swings.

/// Shortens steps that swing to and fro (Aitken's relaxation): a clock offset that rests on a gap moves half the
/// track, and Gauss-Newton overshoots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relaxation {
    share: f64,
    /// The last step, whole.
    pub(super) last: f64,
}

impl Default for Relaxation {
    fn default() -> Self {
        Self { share: 1.0, last: 0.0 }
    }
}

impl Relaxation {
    const SHORTEST: f64 = 0.25;

    /// The part of `step` that is taken.
    pub(super) fn shorten(&mut self, step: f64) -> f64 {
        let difference = self.last - step;
        self.share = if self.last == 0.0 || difference == 0.0 {
            1.0
        } else {
            (self.share * self.last / difference).clamp(Self::SHORTEST, 1.0)
        };
        self.last = step;
        self.share * step
    }
}
