//! The study as Markdown.

use std::fmt::Write;

use super::family::{Family, METHODS, Part, PointErrors, Pool};

/// All tables, one behind the other.
pub(crate) fn render(families: &[Family]) -> String {
    let mut page = String::new();
    for (quantity, title) in [(0, "Position, m"), (1, "Velocity, m/s")] {
        by_method(&mut page, families, quantity, title);
    }
    bands(&mut page, families);
    unseen(&mut page, families);
    points(&mut page, families);
    page
}

/// A header and a line a family.
fn table(
    page: &mut String,
    title: &str,
    columns: &[String],
    families: &[Family],
    cells: impl Fn(&Family) -> Vec<String>,
) {
    // writing to a String can't fail
    let _ = writeln!(page, "**{title}**\n\n| family | runs | {} |", columns.join(" | "));
    let _ = writeln!(page, "|---|---|{}", "---|".repeat(columns.len()));
    for family in families {
        let _ = writeln!(page, "| {} | {} | {} |", family.name, family.runs, cells(family).join(" | "));
    }
    page.push('\n');
}

fn by_method(page: &mut String, families: &[Family], quantity: usize, title: &str) {
    let title = format!("{title}: 3-D RMSE against the truth, tether / overlap / beacon");
    let columns = METHODS.map(|(name, _)| name.to_owned());
    table(page, &title, &columns, families, |family| {
        let parts = [Part::Tether, Part::Overlap, Part::Beacon];
        let cell = |pools: &[[Pool; 2]; 4]| {
            let of = |part: Part| short(pools[part as usize][quantity].rmse());
            parts.map(of).join(" / ")
        };
        family.pools.iter().map(cell).collect()
    });
}

fn bands(page: &mut String, families: &[Family]) {
    let title = "Share of the truth inside the default method's 95 % bands, %: position · velocity";
    let columns = ["tether", "overlap", "beacon", "unseen", "runs that warn"].map(String::from);
    table(page, title, &columns, families, |family| {
        let Some(pools) = family.pools.last() else { return Vec::new() };
        let percent = |pool: &Pool| pool.inside().map_or("-".into(), |s| format!("{:.1}", 100.0 * s));
        let cell = |part: Part| pools[part as usize].each_ref().map(percent).join(" · ");
        let mut cells = [Part::Tether, Part::Overlap, Part::Beacon, Part::Unseen].map(cell).to_vec();
        cells.push(family.warned.to_string());
        cells
    });
}

fn unseen(page: &mut String, families: &[Family]) {
    let title = "The unseen phase: median over the runs of the 3-D RMSE (in brackets: a tenth is worse)";
    let columns = ["default m", "default m/s", "error / sigma", "plain PCF m"].map(String::from);
    table(page, title, &columns, families, |family| {
        let Some(pools) = family.pools.last() else { return Vec::new() };
        let [position, velocity] = &pools[Part::Unseen as usize];
        let cell = |runs: &[f64]| format!("{} ({})", short(quantile(runs, 0.5)), short(quantile(runs, 0.9)));
        vec![
            cell(&position.rmses),
            cell(&velocity.rmses),
            short(position.normalised()),
            cell(&family.plain_unseen_m),
        ]
    });
}

fn points(page: &mut String, families: &[Family]) {
    let title = "Characteristic points (Zhang 2025, eq. 13) of the default method: median error of time · speed, %, and runs \
                 that never get there";
    let columns = ["first", "second", "third"].map(String::from);
    table(page, title, &columns, families, |family| {
        let percent = |runs: &[f64]| quantile(runs, 0.5).map_or("-".into(), |e| format!("{:.2}", 100.0 * e));
        let cell = |p: &PointErrors| format!("{} · {}, {}", percent(&p.time), percent(&p.speed), p.missed);
        family.points.iter().map(cell).collect()
    });
}

fn quantile(values: &[f64], share: f64) -> Option<f64> {
    trackfuse::math::robust::quantile(&mut values.to_vec(), share)
}

fn short(value: Option<f64>) -> String {
    value.map_or("-".into(), |v| if v < 0.0995 { format!("{v:.3}") } else { format!("{v:.2}") })
}
