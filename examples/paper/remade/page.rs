//! The tables in `docs/paper.md`, each between `<!-- NAME -->` and `<!-- end NAME -->`.

use super::{acceleration, claims, orders, sea_trial, segments, table_1};

/// The tables with their names.
fn tables() -> [(&'static str, String); 9] {
    [
        ("claims", claims::table()),
        ("table 1", table_1::table()),
        ("accelerations", acceleration::table()),
        ("orders", orders::table()),
        ("conditions", orders::condition_table()),
        ("segments", segments::table()),
        ("joins", segments::join_table()),
        ("characteristic points", sea_trial::table()),
        ("forty ahead", sea_trial::forty_ahead_table()),
    ]
}

/// The page with its tables made anew.
///
/// # Errors
/// The name of a table that has no place in it.
pub(crate) fn filled(page: &str) -> Result<String, String> {
    let mut page = page.to_owned();
    for (name, table) in tables() {
        let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end {name} -->"));
        let missing = || format!("the page has no place for the table \"{name}\"");
        let from = page.find(&begin).ok_or_else(missing)? + begin.len();
        let to = from + page[from..].find(&end).ok_or_else(missing)?;
        page.replace_range(from..to, &format!("\n{table}\n"));
    }
    Ok(page)
}
