//! GeoJSON (RFC 7946), which maps and GIS programs open: a feature a line, coloured by phase, and one a
//! characteristic point.

use std::io::{self, Write};

use serde_json::{Map as Object, Value, json};

use super::Map;
use crate::publish::phase_color;

/// Writes the map. How the track was made stands in the foreign member `trackfuse`.
///
/// # Errors
/// That of the writer.
pub fn write_geojson(map: &Map, out: &mut impl Write) -> io::Result<()> {
    let lines = map.lines.iter().map(|line| {
        let mut properties = line.properties.clone();
        if let Some(phase) = line.phase {
            // by the convention of simplestyle, which web maps heed
            let [r, g, b] = phase_color(phase).0;
            properties.insert("stroke".into(), format!("#{r:02x}{g:02x}{b:02x}").into());
        }
        feature(&geometry(&line.places), &properties)
    });
    let marks = map.marks.iter().map(|mark| {
        let mut properties = Object::new();
        properties.insert("name".into(), mark.name.clone().into());
        properties.extend(mark.properties.clone());
        feature(&json!({"type": "Point", "coordinates": mark.place}), &properties)
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

fn feature(geometry: &Value, properties: &Object<String, Value>) -> Value {
    json!({"type": "Feature", "geometry": geometry, "properties": properties})
}

fn geometry(places: &[[f64; 3]]) -> Value {
    let mut lines = cut_at_antimeridian(places);
    match (lines.len(), places) {
        (1, [place]) => json!({"type": "Point", "coordinates": place}),
        (1, _) => json!({"type": "LineString", "coordinates": lines.remove(0)}),
        _ => json!({"type": "MultiLineString", "coordinates": lines}),
    }
}

/// Lines that don't cross the antimeridian, as RFC 7946 wants them (3.1.9): each ends on it, and the next begins
/// there, on the other side.
fn cut_at_antimeridian(places: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
    let mut lines = vec![Vec::new()];
    let mut before: Option<[f64; 3]> = None;
    for &place in places {
        if let Some(from) = before.filter(|from| (place[0] - from[0]).abs() > 180.0) {
            let side = 180.0_f64.copysign(from[0]);
            let (up_to, beyond) = (side - from[0], place[0] + side);
            let share = if up_to + beyond == 0.0 { 0.0 } else { up_to / (up_to + beyond) };
            let crossing = |longitude| {
                [longitude, from[1] + share * (place[1] - from[1]), from[2] + share * (place[2] - from[2])]
            };
            if let Some(line) = lines.last_mut() {
                line.push(crossing(side));
            }
            lines.push(vec![crossing(-side)]);
        }
        if let Some(line) = lines.last_mut() {
            line.push(place);
        }
        before = Some(place);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_across_the_antimeridian_is_cut_there_at_the_right_latitude() {
        let there =
            [[179.0, 10.0, 0.0], [179.999, 10.0, 0.0], [-179.997, 10.004, -4.0], [-179.0, 11.0, -5.0]];
        let lines = cut_at_antimeridian(&there);
        assert_eq!(lines.len(), 2);
        let ends = [lines[0][2], lines[1][0]];
        for (end, longitude) in ends.iter().zip([180.0, -180.0]) {
            let off = [end[0] - longitude, end[1] - 10.001, end[2] + 1.0];
            assert!(off.iter().all(|d| d.abs() < 1e-9), "{end:?}");
        }
        let back: Vec<_> = there.into_iter().rev().collect();
        assert_eq!(cut_at_antimeridian(&back)[0].last().unwrap()[0], -180.0);
        assert_eq!(cut_at_antimeridian(&there[..2]).len(), 1);
    }

    #[test]
    fn a_single_place_is_a_point() {
        assert_eq!(geometry(&[[1.0, 2.0, 3.0]])["type"], "Point");
        assert_eq!(geometry(&[[1.0, 2.0, 3.0], [1.0, 2.1, 3.0]])["type"], "LineString");
    }
}
