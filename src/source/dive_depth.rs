//! The depth sensor beside the fixes: how often it tells, and whether both count from the same surface.

use super::dive_error::{DiveError, Span};
use super::dive_ship::span;
use super::load::Loaded;
use crate::estimate::usbl::{CLOSE_S, Height, height_at};
use crate::math::robust;
use crate::time::Time;

/// Fixes with a depth beside them, below which share a person must know.
const FEW: f64 = 0.8;

/// Heights further off the depth sensor's than this are of another zero, sigmas.
const FAR_SIGMAS: f64 = 4.5;

/// What the depth sensor says of the fixes.
#[derive(Debug, Default)]
pub(super) struct Beside {
    /// How many fixes have a depth beside them.
    pub(super) count: usize,
    /// What a person must read.
    pub(super) warning: Option<String>,
    /// Median of the fixes' height less the depth sensor's, m.
    pub(super) offset_m: f64,
    /// Whether that is more than noise.
    pub(super) is_far: bool,
}

/// Holds the fixes against `heights`, in order of time from `origin`.
///
/// # Errors
/// [`DiveError::DepthElsewhere`] where no fix has a height beside it.
pub(super) fn beside(fixes: &Loaded, heights: &[Height], origin: Time) -> Result<Beside, DiveError> {
    let positions = &fixes.source.positions;
    let known = positions.iter().filter_map(|fix| {
        let (z_m, sigma_m) = height_at(heights, fix.time_s)?;
        Some((fix.value[2] - z_m, fix.sigma[2].hypot(sigma_m)))
    });
    let (mut offsets_m, mut sigmas_m): (Vec<f64>, Vec<f64>) = known.unzip();
    let depths = Span::of(origin, heights.iter().map(|height| height.time_s));
    let (count, of) = (offsets_m.len(), positions.len());
    let (Some(offset_m), Some(sigma_m)) = (robust::median(&mut offsets_m), robust::median(&mut sigmas_m))
    else {
        return Err(DiveError::DepthElsewhere { fixes: span(fixes, origin), depths, most_gap_s: CLOSE_S });
    };
    let warning = ((count as f64) < FEW * of as f64).then(|| {
        format!(
            "depth: {} of {of} fixes have no depths about them, or such as are more than {CLOSE_S:.0} s apart (depths \
             {depths}): they are not held against the depth",
            of - count
        )
    });
    Ok(Beside { count, warning, offset_m, is_far: offset_m.abs() > FAR_SIGMAS * sigma_m })
}
