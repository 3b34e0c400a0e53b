//! What became of the fixes: when, how far they are off, how many.

use super::{GROUP, Parts};
use crate::estimate::usbl::{Judged, Reason};
use crate::quality::BAND_SIGMAS;
use crate::report::html::data::thin;
use crate::report::html::drawing::{AXES, Drawing, PHASE, Rejected};
use crate::report::html::tables;
use crate::report::html::{Column, Columns, Ink, Level, Part, Plot, Series, Style, Table, value};
use crate::sample::{Quantity, Sample};

/// Most rows of one series.
const ROWS: usize = 4000;

/// 95 % of the lengths of three independent errors of one sigma each are below this: the root of the quantile of
/// chi-square with three degrees of freedom, 7.815.
const LENGTH_95: f64 = 2.795;

/// Why fixes are thrown out, in the order of their signs: what plots call it, and what stands beside a row of a strip.
const REASONS: [(Reason, &str, &str); 3] = [
    (Reason::OffByItself, "off by itself", "by itself"),
    (Reason::OffAsCycle, "off with its exchange", "exchange"),
    (Reason::OffDepth, "off the depth sensor", "depth"),
];

/// The fixes with their verdicts that hold `wanted`, in order of time.
fn of(parts: Parts<'_>, wanted: impl Fn(&Judged) -> bool) -> Vec<(&Sample, &Judged)> {
    let all = parts.dive.fixes.iter().zip(&parts.dive.judged);
    let mut found: Vec<_> = all.filter(|(_, judged)| wanted(judged)).collect();
    found.sort_by(|a, b| a.0.time_s.total_cmp(&b.0.time_s));
    found
}

/// The fixes that were thrown out, by reason.
pub(super) fn thrown_out(parts: Parts<'_>) -> Vec<Rejected> {
    let rejected = |(i, (reason, label, _)): (usize, &(Reason, &'static str, &str))| {
        let (style, ink) = sign(i);
        let samples = of(parts, |j| j.reason == *reason).into_iter().map(|(fix, _)| *fix).collect();
        Rejected { label, quantity: Quantity::Position, samples, style, ink }
    };
    REASONS.iter().enumerate().map(rejected).collect()
}

/// Numbers and plots.
pub(super) fn parts(drawing: &mut Drawing<'_>, parts: Parts<'_>) -> Vec<Part> {
    let mut source = parts.report.source.clone();
    // of one source there is nothing to be told apart
    source.datum = false;
    let text = "First every fix at its time, in the row of what became of it. Then its distance from the track in sigmas, those \
                of the noise that was found and of the track together: 95 % of the fixes that are right lie below the dashed \
                line. Then the kept fixes less the track, axis by axis: about 95 % lie between the dashed lines.";
    let shown = [strip(drawing, parts), lengths(drawing, parts), by_axis(drawing, parts)];
    vec![
        Part::Table(numbers(parts)),
        Part::Text(text.into()),
        Part::Plots(1, shown.into_iter().flatten().collect()),
        Part::Table(exchanges(parts)),
        Part::Table(tables::sources(&[source])),
    ]
}

/// Time since T0 and one number a fix.
fn add(drawing: &mut Drawing<'_>, rows: &[(f64, f64)]) -> Option<usize> {
    let (time, number) = (|i: usize| drawing.parts.since_t0(rows[i].0), |i: usize| rows[i].1);
    // where all numbers are the same, the times alone
    let kept: Vec<_> = thin(rows.len(), &[&number, &time], ROWS).into_iter().map(Some).collect();
    let columns = Columns::of(&kept, &[&time, &number]);
    (!rows.is_empty()).then(|| drawing.add(columns))
}

/// How fixes are drawn, and in which colour.
type Look = (Style, Ink);

const KEPT: Look = (Style::Dots, Ink::Source(0));

/// That of what was thrown out, by the index of the reason.
fn sign(reason: usize) -> Look {
    (Style::Outliers, Ink::Rejected(reason))
}

fn series(label: &str, table: usize, (style, ink): Look) -> Series {
    Series { style, ..Drawing::dots(label, table, 0, ink) }
}

fn plot(drawing: &Drawing<'_>, title: &str, y_label: &str, series: Vec<Series>) -> Plot {
    Plot {
        title: title.into(),
        x_label: "s since T0",
        y_label: y_label.into(),
        series,
        ground: Some((drawing.track, PHASE)),
        group: GROUP,
        ..Plot::default()
    }
}

/// A row for every verdict, the kept ones uppermost.
fn strip(drawing: &mut Drawing<'_>, parts: Parts<'_>) -> Option<Plot> {
    type Wanted<'a> = &'a dyn Fn(&Judged) -> bool;
    let because = REASONS.map(|(reason, ..)| move |j: &Judged| j.reason == reason);
    let plain = (Style::Dots, Ink::Plain);
    let mut all: Vec<(&str, &str, Look, Wanted<'_>)> = vec![
        ("late", "late", plain, &|j| j.late),
        ("repeated", "repeated", plain, &|j| j.reason == Reason::Repeated),
    ];
    for (i, (_, label, name)) in REASONS.iter().enumerate().rev() {
        all.push((label, name, sign(i), &because[i]));
    }
    all.push(("kept", "kept", KEPT, &|j| j.reason == Reason::Fits));
    let (mut names, mut shown) = (Vec::new(), Vec::new());
    for (label, name, look, wanted) in all {
        let row = names.len() as f64;
        let rows: Vec<(f64, f64)> = of(parts, wanted).iter().map(|(fix, _)| (fix.time_s, row)).collect();
        let Some(table) = add(drawing, &rows) else { continue };
        names.push(name);
        shown.push(series(label, table, look));
    }
    let y_range = Some((-0.6, names.len() as f64 - 0.4));
    (!names.is_empty()).then(|| Plot {
        names,
        y_range,
        ..plot(drawing, "What became of the fixes, each at its time", "", shown)
    })
}

/// The length of every residual in sigmas.
fn lengths(drawing: &mut Drawing<'_>, parts: Parts<'_>) -> Option<Plot> {
    let mut shown = Vec::new();
    let wild = REASONS.iter().enumerate().map(|(i, (reason, label, _))| (*reason, *label, sign(i)));
    for (reason, label, look) in std::iter::once((Reason::Fits, "kept", KEPT)).chain(wild) {
        let found = of(parts, |j| j.reason == reason);
        let rows: Vec<(f64, f64)> = found.iter().map(|(fix, j)| (fix.time_s, j.residual_sigmas)).collect();
        shown.extend(add(drawing, &rows).map(|table| series(label, table, look)));
    }
    (!shown.is_empty()).then(|| Plot {
        levels: vec![Level { value: LENGTH_95 }],
        ..plot(drawing, "Distance of the fixes from the track in sigmas", "sigmas", shown)
    })
}

/// The residuals of the kept fixes, axis by axis, in sigmas of the noise.
fn by_axis(drawing: &mut Drawing<'_>, parts: Parts<'_>) -> Option<Plot> {
    let scale = parts.report.track.noise_scale;
    let in_sigmas = |fix: &Sample, j: &Judged| {
        std::array::from_fn(|axis| j.residual_m[axis] / (fix.sigma[axis] * scale[axis / 2]))
    };
    let kept = of(parts, |j| j.reason == Reason::Fits);
    let left: Vec<Sample> =
        kept.into_iter().map(|(fix, j)| Sample { value: in_sigmas(fix, j), ..*fix }).collect();
    let table = drawing.add_samples(&left, 2 * ROWS)?;
    let shown = (0..3).map(|axis| Drawing::dots(AXES[axis], table, axis, Ink::Axis(axis))).collect();
    Some(Plot {
        levels: [-BAND_SIGMAS, BAND_SIGMAS].map(|value| Level { value }).into(),
        ..plot(drawing, "Kept fixes less track, axis by axis, in sigmas of the noise", "sigmas", shown)
    })
}

fn numbers(parts: Parts<'_>) -> Table {
    let (fixes, all) = (&parts.report.fixes, parts.report.source.positions);
    let counts = [
        ("kept", fixes.kept),
        ("thrown out: each off by itself", fixes.off_by_itself),
        ("thrown out with their whole exchange", fixes.off_as_cycle),
        ("thrown out: not at the depth sensor's depth", fixes.off_depth),
        ("passed over: they repeat another one", fixes.repeated),
        ("all", all),
        ("of these came late, and are not in the prediction", fixes.late),
    ];
    let row = |(what, count): (&str, usize)| {
        let share = 100.0 * count as f64 / all.max(1) as f64;
        vec![what.to_owned(), count.to_string(), value(share, 1)]
    };
    Table {
        caption: "What became of the fixes".into(),
        columns: vec![Column::words("fixes"), Column::numbers("number"), Column::numbers("%")],
        rows: counts.into_iter().filter(|(_, count)| *count > 0).map(row).collect(),
    }
}

fn exchanges(parts: Parts<'_>) -> Table {
    let report = parts.report;
    let (exchanges, [across, down]) = (&report.exchanges, report.track.noise_m);
    let row = |what: &str, value: String| vec![what.to_owned(), value];
    let per_exchange = report.source.positions as f64 / exchanges.count.max(1) as f64;
    let noise = |sigma_m: f64| format!("{} m", value(sigma_m, 2));
    let mut rows = vec![
        row("exchanges", exchanges.count.to_string()),
        row("thrown out as a whole", exchanges.thrown_out.to_string()),
        row("from one to the next", format!("{} s", value(exchanges.cycle_s, 1))),
        row("fixes in each", value(per_exchange, 1)),
        row("noise of a kept fix, x and y", noise(across)),
        row("noise of a kept fix, z", noise(down)),
    ];
    if report.track.has_common() {
        let [across, down] = report.track.common_m.map(noise);
        rows.push(row("of it common to an exchange's fixes", format!("{across} in x and y, {down} in z")));
    }
    if let Some(depth) = &report.depth {
        rows.push(row("depth channel", format!("{} depths of {}", depth.samples, depth.path)));
    }
    Table {
        caption: "The acoustic exchanges, and the noise that was found in them (1 sigma)".into(),
        columns: vec![Column::words("what"), Column::words("value")],
        rows,
    }
}
