//! Registration: all sources' systematic errors, solved jointly with the spline.

mod bordered;
mod curve;
mod fit;
mod knots;
mod model;
mod noise;
mod normal;
mod selection;
mod smoothing;
mod unknowns;

pub use curve::RegisteredCurve;
pub use fit::{Registered, Settings, register};
pub use model::Anchor;
pub use noise::Level;
pub use selection::Inclusion;
pub use unknowns::{Kind, Priors, SourceErrors};
