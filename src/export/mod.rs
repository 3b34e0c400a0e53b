//! A recorded track in the formats of other tools: tables ([`csv`], [`parquet`]), maps ([`geojson`], [`kml`]),
//! trajectories ([`tum`]).
//!
//! Each format is written from the same track, with the same columns or properties, and nothing but it: the same
//! log gives the same bytes.

pub mod csv;
pub mod geojson;
pub mod kml;
mod map;
pub mod parquet;
pub mod tum;

pub use map::{Map, MapLine, MapMark};

use crate::source::Recorded;

/// A recorded track, and which it is.
#[derive(Clone, Copy, Debug)]
pub struct Exported<'a> {
    /// Its topic in the log.
    pub topic: &'a str,
    /// The track.
    pub recorded: &'a Recorded,
}

impl Exported<'_> {
    /// Which track this is and how it was made, as a file can keep it: names and values. No name of a file and no
    /// clock is among them, so that the same track gives the same bytes.
    #[must_use]
    pub fn provenance(&self) -> Vec<(String, String)> {
        let recorded = self.recorded;
        let mut entries = vec![
            ("exported_by".to_owned(), concat!("trackfuse ", env!("CARGO_PKG_VERSION")).to_owned()),
            ("topic".to_owned(), self.topic.to_owned()),
            ("frame_id".to_owned(), recorded.track.frame_id.clone()),
            ("t0_ns".to_owned(), recorded.origin().ns().to_string()),
        ];
        entries.extend(recorded.provenance.iter().map(|(key, value)| (key.clone(), value.clone())));
        entries
    }
}
