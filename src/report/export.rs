//! The report of `export`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::export::csv;
use crate::source::Recorded;

/// The report of `export`: the table itself, or where it was written. Nanoseconds are strings, since JSON numbers
/// lose them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ExportReport {
    /// Version of the program.
    pub version: String,
    /// The log that was read.
    pub log: String,
    /// The topic of the track.
    pub topic: String,
    /// What it was written as: `csv`, `parquet`, `geojson`, `kml` or `tum`.
    pub format: String,
    /// T0, ns since the epoch of the track's clock.
    pub t0_ns: String,
    /// Frame of the track.
    pub frame_id: String,
    /// The file that the table was written to; null for stdout.
    pub output: Option<String>,
    /// Its length in bytes; null for stdout.
    pub bytes: Option<String>,
    /// Points of the track.
    pub points: usize,
    /// The table's columns, each with its unit.
    pub columns: Vec<String>,
    /// A row a point, each cell as in the CSV, empty where there is no value; null where it was written to a file.
    pub rows: Option<Vec<Vec<String>>>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

impl ExportReport {
    /// The report on a track, without its rows and without an output.
    #[must_use]
    pub fn new(log: String, topic: &str, format: &str, track: &Recorded) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            log,
            topic: topic.into(),
            format: format.into(),
            t0_ns: track.origin().ns().to_string(),
            frame_id: track.track.frame_id.clone(),
            output: None,
            bytes: None,
            points: track.track.points.len(),
            columns: csv::COLUMNS.map(Into::into).into(),
            rows: None,
            warnings: track.warnings.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_schema_in_the_tree_is_the_one_of_this_code() {
        super::super::tests::assert_schema(&schemars::schema_for!(super::ExportReport), "export");
    }
}
