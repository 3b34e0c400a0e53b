//! Tables, and the numbers in them.

use maud::{Markup, html};

use crate::printable::printable;

/// A heading, and whether numbers stand below it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    title: &'static str,
    is_number: bool,
}

impl Column {
    /// A column of words.
    #[must_use]
    pub fn words(title: &'static str) -> Self {
        Self { title, is_number: false }
    }

    /// A column of numbers; the title holds their unit.
    #[must_use]
    pub fn numbers(title: &'static str) -> Self {
        Self { title, is_number: true }
    }
}

/// A table, with a line above it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows, each as long as `columns`.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn markup(&self) -> Markup {
        let class = |i: usize| self.columns.get(i).is_some_and(|c| c.is_number).then_some("number");
        html! {
            div.table { table {
                caption { span { (printable(&self.caption)) } }
                thead { tr { @for (i, column) in self.columns.iter().enumerate() {
                    th scope="col" class=[class(i)] { (column.title) }
                } } }
                tbody { @for row in &self.rows { tr { @for (i, cell) in row.iter().enumerate() {
                    td class=[class(i)] { (printable(cell)) }
                } } } }
            } }
        }
    }
}

/// What stands for a number that there isn't.
pub(super) const NONE: &str = "–";

/// The number with so many decimals; a dash where there is none.
#[must_use]
pub fn value(v: impl Into<Option<f64>>, decimals: usize) -> String {
    match v.into().filter(|v| v.is_finite()) {
        // what is as long as a line is written with a power of ten
        Some(v) if v.abs() >= 1e12 => format!("{v:.3e}"),
        Some(v) => format!("{v:.decimals$}"),
        None => NONE.into(),
    }
}

/// `value ± sigma`, both with so many decimals; a dash for what isn't known.
#[must_use]
pub fn plus_minus(v: f64, sigma: impl Into<Option<f64>>, decimals: usize) -> String {
    format!("{} ± {}", value(v, decimals), value(sigma, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_without_a_value_is_a_dash() {
        assert_eq!(value(f64::NAN, 2), "–");
        assert_eq!(value(None, 2), "–");
        assert_eq!(plus_minus(5.4364, Some(0.85), 3), "5.436 ± 0.850");
        assert_eq!(plus_minus(1.0, f64::INFINITY, 1), "1.0 ± –");
        assert_eq!(value(-1.5e300, 3), "-1.500e300");
    }

    #[test]
    fn cells_are_text_whatever_stands_in_them() {
        let hostile = "</td><img src=x onerror=alert(1)>\u{202e}&";
        let table = Table {
            caption: hostile.into(),
            columns: vec![Column::words("topic")],
            rows: vec![vec![hostile.into()]],
        };
        let html = table.markup().into_string();
        assert!(!html.contains("<img") && !html.contains('\u{202e}'), "{html}");
        assert_eq!(html.matches("&lt;img src=x onerror=alert(1)&gt;").count(), 2, "{html}");
    }
}
