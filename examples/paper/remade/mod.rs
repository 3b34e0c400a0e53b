//! Zhang 2025 remade: its Table 1 and what its figures show, in numbers. Pure: no files, no prints.
//!
//! The paper's data are not to be had; [`trial`] says what stands in for them.

pub(crate) mod acceleration;
pub(crate) mod claims;
pub(crate) mod markdown;
pub(crate) mod orders;
pub(crate) mod raw_time;
pub(crate) mod sea_trial;
pub(crate) mod segments;
pub(crate) mod table_1;
pub(crate) mod tables;
pub(crate) mod tracks;
pub(crate) mod trial;
