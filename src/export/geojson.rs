//! GeoJSON (RFC 7946), which maps and GIS programs open: a feature a line, coloured by phase, and one a
//! characteristic point.

use std::io::{self, Write};

use serde_json::{Map as Object, Value};

use super::Map;
use crate::map::{feature, web_color};

/// Writes the map. How the track was made stands in the foreign member `trackfuse`.
///
/// # Errors
/// That of the writer.
pub fn write_geojson(map: &Map, out: &mut impl Write) -> io::Result<()> {
    let lines = map.lines.iter().map(|line| {
        let mut properties = line.properties.clone();
        if let Some(phase) = line.phase {
            // by the convention of simplestyle, which web maps heed
            properties.insert("stroke".into(), web_color(phase).into());
        }
        feature(&line.places, properties)
    });
    let marks = map.marks.iter().map(|mark| {
        let mut properties = Object::new();
        properties.insert("name".into(), mark.name.clone().into());
        properties.extend(mark.properties.clone());
        feature(&[mark.place], properties)
    });
    let provenance: Object<String, Value> =
        map.provenance.iter().map(|(key, value)| (key.clone(), value.clone().into())).collect();
    // one feature a line: people look into such files, and version them
    write!(
        out,
        "{{\"type\":\"FeatureCollection\",\"trackfuse\":{},\"features\":[",
        Value::Object(provenance)
    )?;
    for (i, feature) in lines.chain(marks).enumerate() {
        write!(out, "{}\n{feature}", if i == 0 { "" } else { "," })?;
    }
    writeln!(out, "\n]}}")
}
