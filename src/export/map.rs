//! A track on the map: lines of one phase each and marks, in longitude, latitude and altitude.

use serde_json::{Map as Object, Value, json};

use super::Exported;
use crate::map::place;
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::math::polyline::{Rank, Vertex, thin};
use crate::math::robust;
use crate::source::RecordedEvent;
use crate::time::Time;
use crate::track::{Phase, TrackPoint};

/// Most vertices of all lines together: what a map still draws at once.
const MOST_VERTICES: usize = 20_000;

/// A longer step than this many median ones is not drawn across. In a track of this program all steps are alike;
/// ten in a row are lost in other channels without an outage, as in [`crate::estimate::coverage`].
const OWN_STEPS: f64 = 1.5;
const FOREIGN_STEPS: f64 = 10.0;

/// A track as a map shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Which track this is and how it was made.
    pub provenance: Vec<(String, String)>,
    /// Its lines, in order of time; where the phase changes, the next begins at the last point of the one before.
    pub lines: Vec<MapLine>,
    /// Its characteristic points, in order of time.
    pub marks: Vec<MapMark>,
}

/// A part of the track with one phase and method.
#[derive(Clone, Debug, PartialEq)]
pub struct MapLine {
    /// What saw it, where that is known.
    pub phase: Option<Phase>,
    /// Longitude and latitude, degrees, and altitude above the ellipsoid, m, of each vertex.
    pub places: Vec<[f64; 3]>,
    /// What there is to say of it, units in the names.
    pub properties: Object<String, Value>,
}

/// A characteristic point.
#[derive(Clone, Debug, PartialEq)]
pub struct MapMark {
    /// What it is called.
    pub name: String,
    /// Longitude and latitude, degrees, and altitude above the ellipsoid, m.
    pub place: [f64; 3],
    /// What there is to say of it, units in the names.
    pub properties: Object<String, Value>,
}

impl Map {
    /// The track and its characteristic points, on a map whose zero of x, y and z (east, north, up) lies at a latitude
    /// and longitude, degrees, and an altitude, m.
    #[must_use]
    pub fn new(exported: Exported<'_>, events: &[RecordedEvent], origin: [f64; 3]) -> Self {
        let recorded = exported.recorded;
        let points = &recorded.track.points;
        let frame = LocalFrame::new(Geodetic::from_degrees(origin));
        let runs = runs(points, recorded.has_phases);
        let kept = kept(points, &runs);
        let t0 = recorded.origin();
        let line = |run: &Run| {
            let inside = |i: usize| kept.partition_point(|&k| k < i);
            let before = run.joined.then(|| run.first - 1);
            let vertices = before.into_iter().chain(kept[inside(run.first)..inside(run.end)].iter().copied());
            let seen = &points[run.first..run.end];
            let mut properties = Object::new();
            if recorded.has_phases {
                properties.insert("phase".into(), seen[0].phase.name().into());
                properties.insert("method".into(), seen[0].method.name().into());
            }
            let ends = [("from", seen[0].time), ("to", seen[seen.len() - 1].time)];
            for (end, time) in ends {
                properties.insert(format!("{end}_ns"), time.ns().to_string().into());
                properties.insert(format!("{end}_s"), time.seconds_since(t0).into());
            }
            properties.insert("points".into(), seen.len().into());
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                let largest = seen.iter().map(|p| p.state.position_sigma[axis]).fold(f64::NAN, f64::max);
                // not a number where nobody knows: null
                properties.insert(format!("{name}_sigma_max_m"), json!(micro(largest)));
            }
            MapLine {
                phase: recorded.has_phases.then_some(seen[0].phase),
                places: vertices.filter_map(|i| place(&frame, points[i].state.position)).collect(),
                properties,
            }
        };
        let mut lines: Vec<MapLine> = runs.iter().map(line).collect();
        lines.retain(|line| !line.places.is_empty());
        let mut provenance = exported.provenance();
        let [latitude, longitude, altitude] = origin;
        provenance.push((
            "origin_latitude_longitude_deg_altitude_m".into(),
            format!("{latitude}, {longitude}, {altitude}"),
        ));
        let marks = events.iter().filter_map(|event| mark(event, &frame, t0)).collect();
        Self { provenance, lines, marks }
    }

    /// How many vertices its lines have together.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.lines.iter().map(|line| line.places.len()).sum()
    }
}

fn mark(event: &RecordedEvent, frame: &LocalFrame, t0: Time) -> Option<MapMark> {
    let mut properties = Object::new();
    properties.insert("time_ns".into(), event.time.ns().to_string().into());
    properties.insert("t_s".into(), event.time.seconds_since(t0).into());
    properties.insert("t_sigma_s".into(), event.time_sigma_s.into());
    for (axis, name) in ["vx_m_s", "vy_m_s", "vz_m_s"].into_iter().enumerate() {
        properties.insert(name.into(), event.velocity[axis].into());
    }
    Some(MapMark { name: event.name.clone(), place: place(frame, event.position)?, properties })
}

fn micro(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Points of one phase and method without an outage, `first..end`.
struct Run {
    first: usize,
    end: usize,
    /// Whether the point before it belongs to its line too.
    joined: bool,
}

fn runs(points: &[TrackPoint], has_phases: bool) -> Vec<Run> {
    let step = |i: usize| points[i].time.seconds_since(points[i - 1].time);
    let mut steps: Vec<f64> = (1..points.len()).map(step).filter(|s| *s > 0.0).collect();
    let most = if has_phases { OWN_STEPS } else { FOREIGN_STEPS };
    let longest_s = most * robust::median(&mut steps).unwrap_or(0.0);
    let mut runs: Vec<Run> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let joined = i > 0 && step(i) <= longest_s;
        let same =
            |before: &TrackPoint| !has_phases || (before.phase, before.method) == (point.phase, point.method);
        match runs.last_mut() {
            Some(run) if joined && same(&points[i - 1]) => run.end = i + 1,
            _ => runs.push(Run { first: i, end: i + 1, joined }),
        }
    }
    runs
}

/// The points, by index, that stay when lines are thinned: the ends of lines before all others.
fn kept(points: &[TrackPoint], runs: &[Run]) -> Vec<usize> {
    let vertex = |i: usize| {
        let run = &runs[runs.partition_point(|run| run.end <= i)];
        let is_end = i == run.first || i + 1 == run.end;
        let rank = if is_end { Rank::Border } else { Rank::Inner };
        Vertex { position: points[i].state.position, rank, label: i }
    };
    thin(points.len(), vertex, MOST_VERTICES).iter().map(|vertex| vertex.label).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::source::Recorded;
    use crate::track::{Method, State, Track};

    fn recorded(points: Vec<TrackPoint>, has_phases: bool) -> Recorded {
        Recorded {
            track: Track { frame_id: "enu".into(), points },
            sources: Vec::new(),
            is_own: has_phases,
            has_phases,
            t0: None,
            fix_origin: None,
            made_of: Vec::new(),
            provenance: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }

    fn point(time_s: f64, phase: Phase) -> TrackPoint {
        let position = [time_s, (7.0 * time_s).sin(), -time_s];
        let state = State { position, position_sigma: [0.1 * time_s; 3], ..State::default() };
        TrackPoint {
            time: Time::from_ns(0).plus_seconds(time_s),
            state,
            phase,
            method: Method::Spline,
            seen_by: 1,
        }
    }

    fn map(recorded: &Recorded) -> Map {
        Map::new(Exported { topic: "/fused/track", recorded }, &[], [59.4, 10.5, 3.0])
    }

    #[test]
    fn lines_are_of_one_phase_meet_where_it_changes_and_leave_out_silence() {
        let phases = [Phase::Single, Phase::Single, Phase::Overlap, Phase::Overlap, Phase::Extrapolated];
        let mut points: Vec<_> = phases.iter().enumerate().map(|(i, p)| point(i as f64, *p)).collect();
        points.extend([9.0, 10.0].map(|t| point(t, Phase::Extrapolated)));
        let map = map(&recorded(points, true));
        let lines: Vec<_> = map
            .lines
            .iter()
            .map(|l| {
                (
                    l.properties["phase"].as_str().unwrap(),
                    l.places.len(),
                    l.properties["from_s"].as_f64().unwrap(),
                )
            })
            .collect();
        assert_eq!(
            lines,
            [("single", 2, 0.0), ("overlap", 3, 2.0), ("extrapolated", 2, 4.0), ("extrapolated", 2, 9.0)]
        );
        assert_eq!(map.lines[0].places[1], map.lines[1].places[0]);
        assert_eq!(map.lines[1].properties["x_sigma_max_m"], 0.3);
    }

    #[test]
    fn zero_lies_at_the_origin_and_z_is_altitude() {
        let map = map(&recorded(vec![point(0.0, Phase::Single), point(1.0, Phase::Single)], true));
        assert_eq!(map.lines[0].places[0], [10.5, 59.4, 3.0]);
        assert!((map.lines[0].places[1][2] - 2.0).abs() < 1e-3);
    }

    #[test]
    fn a_long_track_is_thinned_and_keeps_its_ends() {
        let points = (0..50_000).map(|i| point(f64::from(i) * 0.01, Phase::Single)).collect();
        let recorded = recorded(points, true);
        let map = map(&recorded);
        assert_eq!(map.vertices(), MOST_VERTICES);
        let frame = LocalFrame::new(Geodetic::from_degrees([59.4, 10.5, 3.0]));
        let end = recorded.track.points.last().unwrap().state.position;
        assert_eq!(map.lines[0].places.last(), place(&frame, end).as_ref());
        assert_eq!(map.lines[0].properties["points"], 50_000);
    }

    #[test]
    fn a_channel_without_phases_is_drawn_across_lost_samples_and_has_no_sigmas() {
        let mut points: Vec<_> = [0.0, 1.0, 2.0, 3.0, 8.0, 30.0].map(|t| point(t, Phase::Single)).into();
        points.iter_mut().for_each(|p| p.state.position_sigma = [f64::NAN; 3]);
        let map = map(&recorded(points, false));
        assert_eq!(map.lines.iter().map(|l| l.places.len()).collect::<Vec<_>>(), [5, 1]);
        assert_eq!(map.lines[0].properties["x_sigma_max_m"], Value::Null);
        assert!(map.lines[0].properties.get("phase").is_none());
    }
}
