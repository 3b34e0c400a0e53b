//! Plots as values: what is drawn of which columns, and how. The browser does the drawing.

use serde::Serialize;

/// A colour of the page's palette, which has a light and a dark shade of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "of", content = "index")]
pub enum Ink {
    /// That of each phase.
    Phases,
    /// That of a source, by its index.
    Source(usize),
    /// That of an axis.
    Axis(usize),
    /// That of what was thrown out, by the index of the reason; it has a sign of its own, too.
    Rejected(usize),
    /// That of text.
    Plain,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Style {
    /// A line.
    Line,
    /// A dot a sample.
    Dots,
    /// A sign a sample that was thrown out. It doesn't stretch the plot: what lies beyond stands at the edge.
    Outliers,
    /// The band alone.
    Band,
}

/// A standard deviation, and the width of the band that is drawn of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Its column.
    pub sigma: usize,
    /// Standard deviations from the line to the band's edge.
    pub sigmas: f64,
}

/// Two columns of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// What it is called.
    pub label: String,
    /// Index of the table in [`super::Page::tables`].
    pub table: usize,
    /// Column of the abscissa.
    pub x: usize,
    /// Column of the ordinate.
    pub y: usize,
    /// How it is drawn.
    pub style: Style,
    /// In which colour.
    pub ink: Ink,
    /// The band about it.
    pub band: Option<Band>,
    /// Column of the phase, 0 to 3 in the order of [`crate::track::Phase`]: the line has its colours, and the ground too.
    pub phase: Option<usize>,
}

/// A dashed line across a plot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Where, in the ordinate's unit.
    pub value: f64,
}

/// One plot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// The abscissa, with its unit.
    pub x_label: &'static str,
    /// The ordinate, with its unit.
    pub y_label: String,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Dashed lines.
    pub levels: Vec<Level>,
    /// Table and column of the phase on the ground, where no series has it; the time is the table's first column.
    pub ground: Option<(usize, usize)>,
    /// What stands at the ordinates 0, 1 .. in place of numbers; empty for numbers.
    pub names: Vec<&'static str>,
    /// The part of the abscissa that is shown at first; `None` for all.
    pub range: Option<(f64, f64)>,
    /// The part of the ordinate that is shown; `None` for what the series need.
    pub y_range: Option<(f64, f64)>,
    /// Plots with the same name share their cursor and zoom.
    pub group: &'static str,
}

/// A place in the view of space, with its name and its 95 % ellipsoid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// What it is called; empty for an ellipsoid alone.
    pub name: String,
    /// Where, m.
    pub at: [f64; 3],
    /// Half the axes of the ellipsoid, m; `None` where nobody knows.
    pub half_axes: Option<[f64; 3]>,
    /// Its phase, as that of a series.
    pub phase: usize,
}

/// Places in the view of space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cloud {
    /// What they are called.
    pub label: String,
    /// Their table; its columns 1 to 3 are x, y and z.
    pub table: usize,
    /// Dots or outliers.
    pub style: Style,
    /// In which colour.
    pub ink: Ink,
}

/// A view of space, turned and zoomed by hand, with equal axes in metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Space {
    /// What it shows.
    pub title: String,
    /// Table of the track; its columns 1 to 3 are x, y and z.
    pub track: usize,
    /// Column of its phase.
    pub phase: usize,
    /// Its first column of three standard deviations, and how wide a band is.
    pub band: Band,
    /// What was measured.
    pub clouds: Vec<Cloud>,
    /// Characteristic points.
    pub marks: Vec<Mark>,
}
