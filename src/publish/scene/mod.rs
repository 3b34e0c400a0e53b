//! `foxglove.SceneUpdate`: track, sources and characteristic points as one picture in space.
//!
//! One message with fixed ids, which stays: the track as lines coloured by phase, the sources thin beside it,
//! the characteristic points as spheres with their names, and 95 % ellipsoids around them and around the track's
//! last point. Viewers keep vertices as 32-bit floats, so lines count from a point nearby.

mod primitives;

pub(super) use primitives::{Color, SceneUpdate};
use primitives::{Entity, KeyValue, Label, Line, Sphere};

use super::fields::{Pose, Stamp, Xyz, drawn_in, milli};
use super::lines::{Polyline, breaks, polylines, track_lines};
use super::{Context, Published, Topic};
use crate::fusion::Fusion;
use crate::map::phase_color;
use crate::quality::BAND_SIGMAS;
use crate::sample::{Quantity, Source};
use crate::time::Time;
use crate::track::{Phase, State};

/// Most vertices of the track, and of all sources together. With what follows they stay below 20,000.
pub(super) const TRACK_VERTICES: usize = 10_000;
const SOURCE_VERTICES: usize = 9_000;
/// Most characteristic points: the first ones.
pub(super) const MARKS: usize = 250;

const TRACK_PX: f64 = 3.0;
const SOURCE_PX: f64 = 1.0;
const LABEL_PX: f64 = 14.0;

/// Diameter of a characteristic point over the picture's diagonal.
const MARK_SHARE: f64 = 0.008;

/// Those that no phase has, again and again.
fn source_color(index: usize) -> [u8; 3] {
    const COLORS: [[u8; 3]; 4] = [[204, 121, 167], [240, 228, 66], [153, 153, 153], [0, 114, 178]];
    COLORS[index % COLORS.len()]
}

const WHITE: [u8; 3] = [255, 255, 255];

/// The message, at `time`.
pub(super) fn scene_message(fusion: &Fusion, context: &Context<'_>, time: Time) -> Published {
    let drawing = Drawing::new(fusion, context, time);
    let mut entities: Vec<Entity> = (0..context.sources.len()).map(|i| drawing.source(i)).collect();
    entities.extend([drawing.track(), drawing.marks(), drawing.uncertainty()]);
    context.publish(Topic::Scene, time, SceneUpdate { entities, ..SceneUpdate::default() })
}

struct Drawing<'a> {
    fusion: &'a Fusion,
    context: &'a Context<'a>,
    frame_id: &'a str,
    stamp: Stamp,
    /// Where lines count from: whole metres, near the track.
    anchor: [f64; 3],
    /// The diagonal of all that the track passes, m.
    diagonal_m: f64,
}

impl<'a> Drawing<'a> {
    fn new(fusion: &'a Fusion, context: &'a Context<'a>, time: Time) -> Self {
        let track = fusion.track.points.iter().map(|p| p.state.position);
        let first_sample = context.sources.iter().find_map(|s| Some(s.positions.first()?.value));
        let near = track.clone().next().or(first_sample).unwrap_or_default();
        let (low, high) = track.fold((near, near), |(low, high), p| {
            (std::array::from_fn(|i| p[i].min(low[i])), std::array::from_fn(|i| p[i].max(high[i])))
        });
        let sides: [f64; 3] = std::array::from_fn(|i| high[i] - low[i]);
        Self {
            fusion,
            context,
            frame_id: drawn_in(&fusion.track.frame_id),
            stamp: Stamp::of(time),
            anchor: near.map(f64::round),
            diagonal_m: sides.iter().map(|s| s * s).sum::<f64>().sqrt(),
        }
    }

    fn entity(&self, id: impl Into<String>) -> Entity {
        Entity::new(id, self.frame_id, self.stamp)
    }

    /// The line; `None` where its numbers are too large for one.
    fn line<K>(&self, polyline: &Polyline<K>, thickness_px: f64, color: Color) -> Option<Line> {
        let from_anchor = |p: &[f64; 3]| milli(std::array::from_fn(|i| p[i] - self.anchor[i]));
        let points: Vec<Xyz> = polyline.points.iter().map(from_anchor).collect::<Option<_>>()?;
        Some(Line::strip(self.anchor.into(), points, thickness_px, color))
    }

    fn track(&self) -> Entity {
        let lines = track_lines(self.fusion, self.context, TRACK_VERTICES);
        let mut entity = self.entity("track");
        entity.lines = lines
            .iter()
            .filter_map(|line| self.line(line, TRACK_PX, Color::rgb(phase_color(line.kind).0)))
            .collect();
        let legend = |phase: Phase| KeyValue { key: phase.name().into(), value: phase_color(phase).1.into() };
        entity.metadata =
            [Phase::Single, Phase::Overlap, Phase::Bridged, Phase::Extrapolated].map(legend).into();
        entity
    }

    fn source(&self, index: usize) -> Entity {
        let Source { name, positions, .. } = &self.context.sources[index];
        let outage_s = self.fusion.coverage.outage_s(index, Quantity::Position);
        let breaks = breaks(self.fusion, positions.iter().map(|p| p.time_s), outage_s);
        let budget = SOURCE_VERTICES / self.context.sources.len();
        let lines = polylines(positions.len(), &breaks, |i| (positions[i].value, ()), budget);
        let color = Color::rgb(source_color(index));
        let mut entity = self.entity(format!("source/{name}"));
        entity.lines = lines.iter().filter_map(|line| self.line(line, SOURCE_PX, color)).collect();
        let start = lines.first().and_then(|line| milli(line.points[0]));
        entity.texts = start.into_iter().map(|at| Label::facing(at, name, LABEL_PX, color)).collect();
        entity
    }

    fn marks(&self) -> Entity {
        let mut entity = self.entity("characteristic points");
        let diameter_m = (MARK_SHARE * self.diagonal_m).max(0.05);
        for event in self.fusion.events.iter().take(MARKS) {
            let [x, y, z] = event.state.position;
            let (Some(at), Some(above)) = (milli([x, y, z]), milli([x, y, z + 2.0 * diameter_m])) else {
                continue;
            };
            let color = Color::rgb(WHITE);
            let size = Some([diameter_m; 3].into());
            entity.spheres.push(Sphere { pose: Some(Pose::at(at)), size, color: Some(color) });
            entity.texts.push(Label::facing(above, &event.name, LABEL_PX, color));
        }
        entity
    }

    /// Apart from the marks: a viewer draws all spheres of an entity see-through where one is.
    fn uncertainty(&self) -> Entity {
        let mut entity = self.entity("95 % uncertainty");
        let events = self.fusion.events.iter().take(MARKS).map(|e| (&e.state, e.phase));
        let end = self.fusion.track.points.last().map(|p| (&p.state, p.phase));
        entity.spheres = events.chain(end).filter_map(|(state, phase)| ellipsoid(state, phase)).collect();
        entity
    }
}

/// What holds the position on each axis with 95 %; `None` where nobody knows.
fn ellipsoid(state: &State, phase: Phase) -> Option<Sphere> {
    let size = milli(state.position_sigma.map(|s| 2.0 * BAND_SIGMAS * s))?;
    let color = Color::rgb(phase_color(phase).0).with_alpha(0.2);
    Some(Sphere { pose: Some(Pose::at(milli(state.position)?)), size: Some(size), color: Some(color) })
}
