//! KML 2.2, which Google Earth opens: the track as lines coloured by phase at their altitude, and the
//! characteristic points as placemarks.
//!
//! KML's altitudes are above the sea level of EGM96, ours above the ellipsoid of WGS 84; they differ by up to 107 m,
//! and no geoid is at hand: the document says so.

use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use serde_json::{Map as Object, Value};

use super::Map;
use crate::map::phase_color;
use crate::printable::printable;
use crate::track::Phase;

const LINE_PX: &str = "3";
/// Of channels without phases.
const WHITE: [u8; 3] = [255, 255, 255];

/// Writes the map.
///
/// # Errors
/// That of the writer.
pub fn write_kml(map: &Map, out: &mut impl Write) -> io::Result<()> {
    let mut xml = Writer::new_with_indent(out, b' ', 1);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let root = xml.create_element("kml").with_attribute(("xmlns", "http://www.opengis.net/kml/2.2"));
    root.write_inner_content(|xml| {
        xml.create_element("Document").write_inner_content(|xml| document(map, xml)).map(|_| ())
    })?;
    writeln!(xml.get_mut())
}

fn document<W: Write>(map: &Map, xml: &mut Writer<W>) -> io::Result<()> {
    let of = |key: &str| map.provenance.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
    text(xml, "name", of("topic"))?;
    text(xml, "description", "Altitudes are above the WGS 84 ellipsoid, not above sea level.")?;
    for phase in [Phase::Single, Phase::Overlap, Phase::Bridged, Phase::Extrapolated] {
        style(xml, phase.name(), phase_color(phase).0)?;
    }
    style(xml, "track", WHITE)?;
    extended_data(xml, map.provenance.iter().map(|(key, value)| (key.as_str(), value.clone())))?;
    for line in &map.lines {
        let name = line.phase.map_or("track", Phase::name);
        placemark(xml, name, Some(name), &line.properties, &line.places)?;
    }
    for mark in &map.marks {
        placemark(xml, &mark.name, None, &mark.properties, &[mark.place])?;
    }
    Ok(())
}

fn placemark<W: Write>(
    xml: &mut Writer<W>,
    name: &str,
    style: Option<&str>,
    properties: &Object<String, Value>,
    places: &[[f64; 3]],
) -> io::Result<()> {
    let written = xml.create_element("Placemark").write_inner_content(|xml| {
        text(xml, "name", name)?;
        if let Some(style) = style {
            text(xml, "styleUrl", &format!("#{style}"))?;
        }
        let known = properties.iter().filter(|(_, value)| !value.is_null());
        let plain = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        extended_data(xml, known.map(|(key, value)| (key.as_str(), plain(value))))?;
        let shape = if places.len() == 1 { "Point" } else { "LineString" };
        let shape = xml.create_element(shape).write_inner_content(|xml| {
            text(xml, "altitudeMode", "absolute")?;
            let places: Vec<String> =
                places.iter().map(|[lon, lat, alt]| format!("{lon},{lat},{alt}")).collect();
            text(xml, "coordinates", &places.join(" "))
        });
        shape.map(|_| ())
    });
    written.map(|_| ())
}

fn style<W: Write>(xml: &mut Writer<W>, id: &str, [r, g, b]: [u8; 3]) -> io::Result<()> {
    let style = xml.create_element("Style").with_attribute(("id", id)).write_inner_content(|xml| {
        let line = xml.create_element("LineStyle").write_inner_content(|xml| {
            text(xml, "color", &format!("ff{b:02x}{g:02x}{r:02x}"))?;
            text(xml, "width", LINE_PX)
        });
        line.map(|_| ())
    });
    style.map(|_| ())
}

fn extended_data<'a, W: Write>(
    xml: &mut Writer<W>,
    entries: impl Iterator<Item = (&'a str, String)>,
) -> io::Result<()> {
    let data = xml.create_element("ExtendedData").write_inner_content(|xml| {
        for (key, value) in entries {
            let data = xml.create_element("Data").with_attribute(("name", &*printable(key)));
            data.write_inner_content(|xml| text(xml, "value", &value))?;
        }
        Ok(())
    });
    data.map(|_| ())
}

/// An element with text, of which line breaks stay and what XML can't hold is shown as an escape.
fn text<W: Write>(xml: &mut Writer<W>, name: &str, content: &str) -> io::Result<()> {
    let lines: Vec<_> = content.split('\n').map(printable).collect();
    let content = lines.join("\n").replace(['\u{fffe}', '\u{ffff}'], "\u{fffd}");
    xml.create_element(name).write_text_content(BytesText::new(&content)).map(|_| ())
}
