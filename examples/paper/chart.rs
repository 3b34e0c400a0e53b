//! One figure of line charts, one below the other, as SVG.

use std::ops::Range;

use plotters::prelude::*;
use plotters::style::ShapeStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of a panel, px; the page scales it down, which hides that coordinates are whole numbers.
const PANEL: (u32, u32) = (2400, 900);
/// Sizes of letters, px.
const LABEL: (&str, u32) = ("sans-serif", 40);
const DESCRIPTION: (&str, u32) = ("sans-serif", 44);

/// A line.
pub(crate) struct Line {
    /// Its name in the legend, where it has one.
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) colour: RGBColor,
    pub(crate) width_px: u32,
    pub(crate) dashed: bool,
}

/// One chart.
pub(crate) struct Panel {
    pub(crate) y_label: &'static str,
    pub(crate) x: Range<f64>,
    pub(crate) y: Range<f64>,
    pub(crate) lines: Vec<Line>,
    /// Instants with a vertical line, s, and what they are.
    pub(crate) marks_s: Vec<(f64, &'static str)>,
    pub(crate) legend: SeriesLabelPosition,
}

type Failure = Box<dyn std::error::Error>;

/// Draws panels of one common time axis.
///
/// # Errors
/// What the drawing library says.
pub(crate) fn draw(panels: &[Panel]) -> Result<String, Failure> {
    let mut svg = String::new();
    {
        let root =
            SVGBackend::with_string(&mut svg, (PANEL.0, PANEL.1 * panels.len() as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        for (i, (area, panel)) in root.split_evenly((panels.len(), 1)).iter().zip(panels).enumerate() {
            draw_panel(area, panel, i + 1 == panels.len())?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn draw_panel(area: &Area<'_>, panel: &Panel, last: bool) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(area)
        .margin(24)
        .margin_top(72)
        .margin_right(60)
        .x_label_area_size(if last { 120 } else { 60 })
        .y_label_area_size(180)
        .build_cartesian_2d(panel.x.clone(), panel.y.clone())?;
    let decimals = usize::from(panel.y.end - panel.y.start < 10.0);
    chart
        .configure_mesh()
        .x_desc(if last { "time since release, s" } else { "" })
        .y_desc(panel.y_label)
        .axis_desc_style(DESCRIPTION)
        .label_style(LABEL)
        .bold_line_style(ShapeStyle::from(&RGBColor(225, 225, 225)).stroke_width(2))
        .max_light_lines(0)
        .x_labels(10)
        .y_labels(8)
        .y_label_formatter(&|y| label(*y, decimals))
        .draw()?;
    let grey = RGBColor(120, 120, 120);
    for &(t, name) in &panel.marks_s {
        let ends = vec![(t, panel.y.start), (t, panel.y.end)];
        chart.draw_series([PathElement::new(ends, ShapeStyle::from(&grey).stroke_width(3))])?;
        let (x, y) = chart.backend_coord(&(t, panel.y.end));
        let (left, top) = area.get_base_pixel();
        let style = LABEL.into_font().color(&grey).pos(Pos::new(HPos::Center, VPos::Bottom));
        area.draw_text(name, &style, (x - left, y - top - 8))?;
    }
    for line in &panel.lines {
        draw_line(&mut chart, panel, line)?;
    }
    chart
        .configure_series_labels()
        .position(panel.legend.clone())
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(LABEL)
        .legend_area_size(90)
        .margin(24)
        .draw()?;
    Ok(())
}

/// A number of an axis; no minus before nothing.
fn label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.chars().all(|c| "-0.".contains(c)) { text.trim_start_matches('-').to_owned() } else { text }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

/// The line where it is inside the panel.
fn draw_line(chart: &mut Chart<'_, '_>, panel: &Panel, line: &Line) -> Result<(), Failure> {
    let style = ShapeStyle::from(&line.colour).stroke_width(line.width_px);
    let inside = |p: &(f64, f64)| panel.x.contains(&p.0) && panel.y.contains(&p.1);
    let runs = line.points.chunk_by(|a, b| inside(a) == inside(b)).filter(|run| inside(&run[0]));
    for (i, run) in runs.enumerate() {
        let points = run.iter().copied();
        let drawn = if line.dashed {
            chart.draw_series(DashedLineSeries::new(points, 18, 12, style))?
        } else {
            chart.draw_series(LineSeries::new(points, style))?
        };
        if i == 0 && !line.name.is_empty() {
            // half of a line that is dashed
            let to = if line.dashed { 38 } else { 76 };
            drawn
                .label(&line.name)
                .legend(move |(x, y)| PathElement::new(vec![(x + 4, y), (x + to, y)], style));
        }
    }
    Ok(())
}
