//! Where was the vehicle really? `trackfuse` reads an MCAP recording of an underwater trial, fuses its position and
//! velocity channels into one 3-D track, carries that track on, and writes it back beside the original channels.
//!
//! Data flows one way, bytes only at the two ends:
//!
//! ```text
//! in.mcap -> log (index, read, decode) -> source (samples: SI, s) -> estimate (pure) -> track + report -> log (append) -> out.mcap
//! ```
//!
//! | method | where | source |
//! |---|---|---|
//! | GDF, weighted mean of the sources that see | [`estimate::weighted_mean`] | Zhang 2025, eq. 1-2 |
//! | PCF, one polynomial an axis | [`estimate::polynomial`] | Zhang 2025, eq. 3-6 |
//! | SFF, Gaussian splines with a jerk penalty | [`estimate::spline`] | Zhang 2025, eq. 7-11 |
//! | moving average over GDF | [`estimate::moving_average`] | Zhang 2025, Table 1 |
//! | registration of the sources to a datum | [`estimate::registration`] | ours |
//! | extrapolation, its band from rolling origins | [`estimate::extrapolation`] | Zhang 2025, sea trial; the band is ours |
//! | characteristic points | [`estimate::characteristic_point`] | Zhang 2025, eq. 13 |
//! | USBL fixes cleaned, smoothed, predicted | [`estimate::usbl`] | Liu 2023; the smoother is ours |
//! | lines of a picture, thinned | [`math::polyline`] | Visvalingam & Whyatt 1993 |
//!
//! Zhang 2025 is Zhang Xu, sectional track fusion by functional reconstruction, doi 10.19693/j.issn.1673-3185.04263. Liu 2023
//! is Liu et al., Ship Science and Technology 45(16).
//!
//! Who may know whom: [`commands`] everything; [`log`], [`estimate`], [`report`] the shared nouns ([`sample`],
//! [`track`], [`time`]); [`estimate`] also [`math`]; [`math`] nothing of ours. [`fusion`] is the order of the
//! estimators, [`publish`] the result as messages, [`inspect`] tells what is in a log, [`simulate`] makes logs
//! with known truth.
#![forbid(unsafe_code)]

pub mod cli;
pub mod commands;
pub mod config;
pub mod estimate;
pub mod export;
pub mod fusion;
pub mod inspect;
pub mod log;
mod map;
pub mod math;
mod printable;
pub mod publish;
pub mod quality;
pub mod report;
pub mod resolve;
pub mod sample;
pub mod simulate;
pub mod source;
pub mod time;
pub mod track;
