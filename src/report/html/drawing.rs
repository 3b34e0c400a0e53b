//! The track and the sources' samples as plots over time and in space.

use super::data::thin;
use super::{Band, Cloud, Columns, Ink, Mark, Part, Plot, Series, Space, Style};
use crate::fusion::Fusion;
use crate::quality::BAND_SIGMAS;
use crate::sample::{Quantity, Sample, Source};
use crate::time::Time;
use crate::track::{Phase, State, TrackPoint};

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Most rows of the track, of all sources' samples together, and of one series.
const TRACK_ROWS: usize = 4000;
const SAMPLE_ROWS: usize = 16_000;
const SERIES_ROWS: usize = 4000;

/// Columns of the track: time, then three each.
const POSITION: usize = 1;
const VELOCITY: usize = 4;
const ACCELERATION: usize = 7;
const POSITION_SIGMA: usize = 10;
const VELOCITY_SIGMA: usize = 13;
pub(super) const PHASE: usize = 16;

/// Characteristic points in the view of space, the first ones: more can't be told apart.
const MARKS: usize = 40;

/// What there is to draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn<'a> {
    /// The track.
    pub(super) fusion: &'a Fusion,
    /// The sources as they were read, in the order of their bits.
    pub(super) sources: &'a [Source],
    /// What of them was rejected.
    pub(super) rejected: &'a [Rejected],
    /// Points of the track a second.
    pub(super) rate_hz: f64,
    /// The instant that samples count from.
    pub(super) origin: Time,
    /// T0, from which the page's times count.
    pub(super) t0: Time,
}

/// Samples that the track doesn't rest on.
#[derive(Clone, Debug)]
pub(super) struct Rejected {
    /// What they are called.
    pub(super) label: &'static str,
    /// What they are of.
    pub(super) quantity: Quantity,
    /// In order of time.
    pub(super) samples: Vec<Sample>,
    /// How they are drawn.
    pub(super) style: Style,
    /// In which colour.
    pub(super) ink: Ink,
}

impl Drawn<'_> {
    /// Seconds since T0 of seconds since the origin.
    pub(super) fn since_t0(&self, time_s: f64) -> f64 {
        time_s + self.origin.seconds_since(self.t0)
    }
}

/// What the plots draw, as it is gathered.
pub(super) struct Drawing<'a> {
    pub(super) parts: Drawn<'a>,
    tables: Vec<Columns>,
    pub(super) track: usize,
    /// By source and quantity.
    samples: Vec<[Option<usize>; 2]>,
    rejected: Vec<Option<usize>>,
}

impl<'a> Drawing<'a> {
    pub(super) fn new(parts: Drawn<'a>) -> Self {
        let mut drawing =
            Self { parts, tables: Vec::new(), track: 0, samples: Vec::new(), rejected: Vec::new() };
        drawing.track = drawing.add_track();
        for source in parts.sources {
            let tables = Quantity::ALL.map(|q| drawing.add_samples(source.series(q), SAMPLE_ROWS));
            drawing.samples.push(tables);
        }
        drawing.rejected =
            parts.rejected.iter().map(|r| drawing.add_samples(&r.samples, SAMPLE_ROWS)).collect();
        drawing
    }

    pub(super) fn into_tables(self) -> Vec<Columns> {
        self.tables
    }

    pub(super) fn add(&mut self, columns: Columns) -> usize {
        self.tables.push(columns);
        self.tables.len() - 1
    }

    /// Time since T0 and three numbers a sample, at most the share of a source's series in `budget`; `None` without
    /// any.
    pub(super) fn add_samples(&mut self, samples: &[Sample], budget: usize) -> Option<usize> {
        if samples.is_empty() {
            return None;
        }
        let budget = (budget / (2 * self.parts.sources.len()).max(1)).clamp(20, SERIES_ROWS);
        let axis = |axis: usize| move |i: usize| samples[i].value[axis];
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let kept = thin(samples.len(), &[&x, &y, &z], budget);
        let parts = self.parts;
        let time = move |i: usize| parts.since_t0(samples[i].time_s);
        let rows: Vec<_> = kept.into_iter().map(Some).collect();
        Some(self.add(Columns::of(&rows, &[&time, &x, &y, &z])))
    }

    fn add_track(&mut self) -> usize {
        let points = &self.parts.fusion.track.points;
        let t0 = self.parts.t0;
        let unknown = [f64::NAN; 3];
        let vector =
            |of: fn(&State) -> [f64; 3]| move |axis: usize| move |i: usize| of(&points[i].state)[axis];
        let [p, v, ps, vs] = [
            vector(|s| s.position),
            vector(|s| s.velocity),
            vector(|s| s.position_sigma),
            vector(|s| s.velocity_sigma),
        ];
        let a = |axis: usize| move |i: usize| points[i].state.acceleration.unwrap_or(unknown)[axis];
        let time = |i: usize| points[i].time.seconds_since(t0);
        let phase = |i: usize| points[i].phase as usize as f64;
        let moving = [p(0), p(1), p(2), v(0), v(1), v(2)];
        let moving: Vec<&dyn Fn(usize) -> f64> = moving.iter().map(|f| f as &dyn Fn(usize) -> f64).collect();
        let kept = thin(points.len(), &moving, TRACK_ROWS - TRACK_ROWS / 4);
        let rows = with_borders(points, kept, 1.5 / self.parts.rate_hz);
        let (a, ps, vs) = ([a(0), a(1), a(2)], [ps(0), ps(1), ps(2)], [vs(0), vs(1), vs(2)]);
        let mut columns: Vec<&dyn Fn(usize) -> f64> = vec![&time];
        columns.extend(moving);
        columns.extend(a.iter().map(|f| f as &dyn Fn(usize) -> f64));
        columns.extend(ps.iter().map(|f| f as &dyn Fn(usize) -> f64));
        columns.extend(vs.iter().map(|f| f as &dyn Fn(usize) -> f64));
        columns.push(&phase);
        self.add(Columns::of(&rows, &columns))
    }

    /// The series of a source's samples, or of residuals: dots of column `axis + 1`.
    pub(super) fn dots(label: &str, table: usize, axis: usize, ink: Ink) -> Series {
        let (label, style) = (label.to_owned(), Style::Dots);
        Series { label, table, x: 0, y: axis + 1, style, ink, band: None, phase: None }
    }

    /// The first so many of position, velocity and acceleration by axis, behind what the reader must know to read them;
    /// `beside` says what is drawn beside the track.
    pub(super) fn motion(&self, count: usize, beside: &str) -> Vec<Part> {
        let text = format!(
            "Lines are the track, in the colour of its phase, with its 95 % band; {beside} Drag across a plot to zoom in, \
             double-click to see all; the cursor reads all plots at one instant; a name below a plot hides or shows what \
             it names. Of long series at most about 4000 points are drawn: from stretches of equal length those with the \
             least and the greatest value of each axis, so that no outlier is left out."
        );
        let kinds = [
            ("position", "m", POSITION, Some(POSITION_SIGMA), Some(Quantity::Position)),
            ("velocity", "m/s", VELOCITY, Some(VELOCITY_SIGMA), Some(Quantity::Velocity)),
            ("acceleration", "m/s²", ACCELERATION, None, None),
        ];
        let plots = kinds.into_iter().take(count).map(|(kind, unit, column, sigma, quantity)| {
            let plot = |axis: usize| {
                let mut series: Vec<Series> = quantity.map_or(Vec::new(), |q| self.measured(q, axis));
                series.push(Series {
                    label: "track".into(),
                    table: self.track,
                    x: 0,
                    y: column + axis,
                    style: Style::Line,
                    ink: Ink::Phases,
                    band: sigma.map(|first| Band { sigma: first + axis, sigmas: BAND_SIGMAS }),
                    phase: Some(PHASE),
                });
                Plot {
                    title: format!("{} {kind}", AXES[axis]),
                    x_label: "s since T0",
                    y_label: unit.into(),
                    series,
                    group: "motion",
                    ..Plot::default()
                }
            };
            Part::Plots(1, (0..3).map(plot).collect())
        });
        [Part::Text(text)].into_iter().chain(plots).collect()
    }

    /// What the sources measured on one axis, and what of it was rejected.
    fn measured(&self, quantity: Quantity, axis: usize) -> Vec<Series> {
        let of_source = |(i, tables): (usize, &[Option<usize>; 2])| {
            let table = tables[quantity as usize]?;
            Some(Self::dots(&self.parts.sources[i].name, table, axis, Ink::Source(i)))
        };
        let mut series: Vec<Series> = self.samples.iter().enumerate().filter_map(of_source).collect();
        series.extend(self.rejected(quantity).map(|(rejected, table)| Series {
            style: rejected.style,
            ..Self::dots(rejected.label, table, axis, rejected.ink)
        }));
        series
    }

    /// What was rejected of this quantity, and its table.
    fn rejected(&self, quantity: Quantity) -> impl Iterator<Item = (&'a Rejected, usize)> {
        let of = self.parts.rejected.iter().zip(&self.rejected).filter(move |(r, _)| r.quantity == quantity);
        of.filter_map(|(rejected, table)| Some((rejected, (*table)?)))
    }

    /// The view of space, and what stands above it.
    pub(super) fn in_space(&self) -> Vec<Part> {
        let Drawn { fusion, sources, .. } = self.parts;
        let half_axes = |sigma: [f64; 3]| {
            Some(sigma.map(|s| BAND_SIGMAS * s)).filter(|h| h.iter().all(|v| v.is_finite()))
        };
        let mark = |name: &str, state: &State, phase: Phase| Mark {
            name: name.into(),
            at: state.position,
            half_axes: half_axes(state.position_sigma),
            phase: phase as usize,
        };
        let events = fusion.events.iter().take(MARKS).map(|e| mark(&e.name, &e.state, e.phase));
        let end = fusion.track.points.last().map(|p| mark("", &p.state, p.phase));
        let frame = match fusion.track.frame_id.as_str() {
            "" => "a frame that the log doesn't name".to_owned(),
            frame => format!("frame {frame:?}"),
        };
        let of_source = |(i, tables): (usize, &[Option<usize>; 2])| {
            let (label, ink) = (sources[i].name.clone(), Ink::Source(i));
            Some(Cloud { label, table: tables[0]?, style: Style::Dots, ink })
        };
        let rejected = self.rejected(Quantity::Position).map(|(rejected, table)| {
            let Rejected { label, style, ink, .. } = rejected;
            Cloud { label: (*label).into(), table, style: *style, ink: *ink }
        });
        let space = Space {
            title: format!(
                "The track by phase, the sources' samples beside it, in {frame}; equal axes, metres"
            ),
            track: self.track,
            phase: PHASE,
            band: Band { sigma: POSITION_SIGMA, sigmas: BAND_SIGMAS },
            clouds: self.samples.iter().enumerate().filter_map(of_source).chain(rejected).collect(),
            marks: events.chain(end).filter(|m| m.at.iter().all(|v| v.is_finite())).collect(),
        };
        vec![Part::Space(space)]
    }
}

/// The rows with the points beside every change of phase and every gap longer than `max_step_s`, and a row of nothing in
/// the gaps; of changes more often than can be seen only the first ones.
pub(super) fn with_borders(
    points: &[TrackPoint],
    mut kept: Vec<usize>,
    max_step_s: f64,
) -> Vec<Option<usize>> {
    let is_gap = |i: usize| points[i].time.seconds_since(points[i - 1].time) > max_step_s;
    let gaps: Vec<usize> = (1..points.len()).filter(|&i| is_gap(i)).collect();
    let changes = (1..points.len()).filter(|&i| points[i].phase != points[i - 1].phase);
    let borders: Vec<usize> =
        changes.take(TRACK_ROWS / 16).chain(gaps.iter().copied().take(TRACK_ROWS / 16)).collect();
    kept.extend(borders.into_iter().flat_map(|i| [i - 1, i]));
    kept.sort_unstable();
    kept.dedup();
    let mut rows: Vec<Option<usize>> = Vec::with_capacity(kept.len());
    for i in kept {
        if let Some(Some(before)) = rows.last() {
            let next_gap = gaps.partition_point(|gap| gap <= before);
            if gaps.get(next_gap).is_some_and(|gap| *gap <= i) {
                rows.push(None);
            }
        }
        rows.push(Some(i));
    }
    rows
}
