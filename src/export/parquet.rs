//! Apache Parquet: the columns of the CSV with types, null where there is no value, and the track's provenance in
//! the file's metadata. `pandas.read_parquet`, DuckDB, MATLAB and others open it.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::Exported;
use super::csv::{COLUMNS, numbers};
use crate::time::Time;
use crate::track::TrackPoint;

/// Rows of a group, which are in memory together: 20 MB.
const GROUP: usize = 1 << 17;

/// Writes the track as a table with the columns [`COLUMNS`]: `time_ns` as 64-bit integers (on the datum's clock,
/// which need not be UTC, so that they are no dates), `phase` and `method` as text, all others as 64-bit floats.
///
/// # Errors
/// That of the writer.
pub fn write_parquet(exported: Exported<'_>, out: &mut (impl Write + Send)) -> io::Result<()> {
    let recorded = exported.recorded;
    let metadata = exported.provenance().into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
    let properties = WriterProperties::builder()
        .set_created_by(concat!("trackfuse version ", env!("CARGO_PKG_VERSION")).into())
        .set_key_value_metadata(Some(metadata))
        // words come again and again, numbers don't
        .set_dictionary_enabled(false)
        .set_column_dictionary_enabled("phase".into(), true)
        .set_column_dictionary_enabled("method".into(), true)
        .build();
    let schema = schema().map_err(told)?;
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties)).map_err(told)?;
    for points in recorded.track.points.chunks(GROUP) {
        let mut group = file.next_row_group().map_err(told)?;
        write_group(points, recorded.origin(), recorded.has_phases, &mut group).map_err(told)?;
        group.close().map_err(told)?;
    }
    file.close().map(|_| ()).map_err(told)
}

fn schema() -> Result<Type, ParquetError> {
    let column = |name: &str| {
        let (physical, logical) = match name {
            "time_ns" => (Physical::INT64, None),
            "phase" | "method" => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            _ => (Physical::DOUBLE, None),
        };
        let always = ["time_ns", "t_s"].contains(&name);
        let repetition = if always { Repetition::REQUIRED } else { Repetition::OPTIONAL };
        let column = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        column.with_repetition(repetition).build().map(Arc::new)
    };
    let columns = COLUMNS.iter().map(|name| column(name)).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder("track").with_fields(columns).build()
}

fn write_group<W: Write + Send>(
    points: &[TrackPoint],
    t0: Time,
    has_phases: bool,
    group: &mut SerializedRowGroupWriter<'_, W>,
) -> Result<(), ParquetError> {
    for (i, name) in COLUMNS.into_iter().enumerate() {
        let Some(mut column) = group.next_column()? else { break };
        let labels = |label: fn(&TrackPoint) -> &'static str| {
            let known = points.iter().filter(|_| has_phases);
            let values: Vec<ByteArray> = known.map(|p| label(p).into()).collect();
            (values, vec![i16::from(has_phases); points.len()])
        };
        match name {
            "time_ns" => {
                let values: Vec<i64> = points.iter().map(|p| p.time.ns()).collect();
                column.typed::<Int64Type>().write_batch(&values, None, None)?;
            }
            "t_s" => {
                let values: Vec<f64> = points.iter().map(|p| p.time.seconds_since(t0)).collect();
                column.typed::<DoubleType>().write_batch(&values, None, None)?;
            }
            "phase" | "method" => {
                let (values, known) =
                    labels(if name == "phase" { |p| p.phase.name() } else { |p| p.method.name() });
                column.typed::<ByteArrayType>().write_batch(&values, Some(&known), None)?;
            }
            _ => {
                // behind the two times
                let all = points.iter().map(|p| numbers(p)[i - 2]);
                let known: Vec<i16> = all.clone().map(|v| i16::from(v.is_finite())).collect();
                let values: Vec<f64> = all.filter(|v| v.is_finite()).collect();
                column.typed::<DoubleType>().write_batch(&values, Some(&known), None)?;
            }
        }
        column.close()?;
    }
    Ok(())
}

fn told(error: ParquetError) -> io::Error {
    io::Error::other(error)
}
