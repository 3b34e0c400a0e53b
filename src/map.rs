//! What every map of a track has alike: places, colours, and features of GeoJSON (RFC 7946).

use serde_json::{Value, json};

use crate::math::geodesy::LocalFrame;
use crate::track::Phase;

/// The colour of a phase, and what it is called: such that people tell them apart whatever their sight (Okabe & Ito
/// 2008), on dark and on light ground.
pub(crate) fn phase_color(phase: Phase) -> ([u8; 3], &'static str) {
    match phase {
        Phase::Single => ([86, 180, 233], "sky blue"),
        Phase::Overlap => ([0, 158, 115], "green"),
        Phase::Bridged => ([230, 159, 0], "orange"),
        Phase::Extrapolated => ([213, 94, 0], "vermilion"),
    }
}

/// The colour as the styles of web maps have it.
pub(crate) fn web_color(phase: Phase) -> String {
    let [r, g, b] = phase_color(phase).0;
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Longitude and latitude to 1e-9 degrees, altitude to 0.1 mm; `None` where the numbers are too large for a place.
pub(crate) fn place(frame: &LocalFrame, enu: [f64; 3]) -> Option<[f64; 3]> {
    let [latitude, longitude, altitude] = frame.to_geodetic(enu).to_degrees();
    let place =
        [(longitude * 1e9).round() / 1e9, (latitude * 1e9).round() / 1e9, (altitude * 1e4).round() / 1e4];
    place.iter().all(|v| v.is_finite()).then_some(place)
}

/// A point where there is one place, else a line.
pub(crate) fn feature(places: &[[f64; 3]], properties: impl Into<Value>) -> Value {
    json!({"type": "Feature", "geometry": geometry(places), "properties": properties.into()})
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
