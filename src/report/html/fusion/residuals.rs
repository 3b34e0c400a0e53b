//! What is left of the samples: over time, and how alike successive ones are.

use super::super::drawing::{AXES, Drawing};
use super::overlap::misfits;
use crate::math::autocorrelation::autocorrelation;
use crate::quality::BAND_SIGMAS;
use crate::report::Report;
use crate::report::html::{Columns, Ink, Level, Part, Plot, Series, Style};
use crate::sample::{Quantity, Sample};

/// Most rows of all series together.
const ROWS: usize = 8000;

/// Lags, in samples.
const LAGS: usize = 40;

/// Two plots a source and quantity, side by side.
pub(super) fn parts(drawing: &mut Drawing<'_>, report: &Report) -> Vec<Part> {
    let p = drawing.parts;
    let text = "Left: how far each sample lies from the track, its source's estimated errors taken off; dashed are ± 1.96 sigmas \
                of the noise, which hold 95 % of the samples where the sigmas are right. Right: the autocorrelation, by \
                lag in samples; independent noise stays between the dashed lines, 1.96 / √n, with 95 %. Rejected samples \
                are in neither.";
    let mut plots = Vec::new();
    for (i, source) in p.sources.iter().enumerate() {
        for quantity in Quantity::ALL {
            let left: Vec<Sample> = misfits(&p.fusion.residuals, p.origin, i, quantity).collect();
            let Some(table) = drawing.add_samples(&left, ROWS) else { continue };
            let of = format!("{} {}", source.name, quantity.name());
            plots.push(Plot {
                title: format!("{of}: residuals"),
                x_label: "s since T0",
                y_label: quantity.unit().into(),
                series: (0..3).map(|axis| Drawing::dots(AXES[axis], table, axis, Ink::Axis(axis))).collect(),
                levels: about_zero(sigma(drawing, report, i, quantity)),
                group: "residuals",
                ..Plot::default()
            });
            plots.push(correlation(drawing, &of, &left));
        }
    }
    vec![Part::Text(text.into()), Part::Plots(2, plots)]
}

/// The noise as it was found to be, where it was stated or estimated.
fn sigma(drawing: &Drawing<'_>, report: &Report, source: usize, quantity: Quantity) -> Option<f64> {
    let stated = report.sources.get(source)?;
    let stated = match quantity {
        Quantity::Position => stated.position_sigma_m,
        Quantity::Velocity => stated.velocity_sigma_m_s,
    };
    let found = drawing.parts.fusion.registered.as_ref();
    let scale = found.and_then(|r| r.noise.get(source)).map_or(1.0, |levels| levels[quantity as usize].scale);
    stated.map(|s| s * scale).filter(|s| s.is_finite())
}

fn about_zero(sigma: Option<f64>) -> Vec<Level> {
    let edges = sigma.map(|s| [-BAND_SIGMAS * s, BAND_SIGMAS * s]);
    edges.into_iter().flatten().map(|value| Level { value }).collect()
}

fn correlation(drawing: &mut Drawing<'_>, of: &str, left: &[Sample]) -> Plot {
    let lags = LAGS.min(left.len() / 4);
    let by_axis: Vec<Vec<f64>> = (0..3)
        .map(|axis| autocorrelation(&left.iter().map(|s| s.value[axis]).collect::<Vec<_>>(), lags))
        .collect();
    let rows: Vec<Option<usize>> = (0..=lags).map(Some).collect();
    let column = |axis: usize| {
        let values = &by_axis[axis];
        move |lag: usize| values.get(lag).copied().unwrap_or(f64::NAN)
    };
    let table = drawing.add(Columns::of(&rows, &[&|lag| lag as f64, &column(0), &column(1), &column(2)]));
    let series = |axis: usize| Series {
        style: Style::Line,
        ..Drawing::dots(AXES[axis], table, axis, Ink::Axis(axis))
    };
    Plot {
        title: format!("{of}: autocorrelation"),
        x_label: "lag, samples",
        y_label: "r".into(),
        series: (0..3).map(series).collect(),
        levels: about_zero(Some((left.len() as f64).sqrt().recip())),
        group: "lags",
        ..Plot::default()
    }
}
