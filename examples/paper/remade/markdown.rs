//! A table in Markdown.

/// Head and rows.
pub(crate) fn table<const N: usize>(head: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let above = [head.map(str::to_owned), std::array::from_fn(|_| "---".to_owned())];
    above.into_iter().chain(rows).map(|cells| line(&cells)).collect()
}
