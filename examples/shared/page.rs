//! The page whose tables the study makes, each between `<!-- NAME -->` and `<!-- end NAME -->`.

/// Tables with their names.
pub(crate) type Tables = Vec<(String, String)>;

/// The page with these tables in their places; the others stay.
///
/// # Errors
/// The name of a table that has no place in it.
pub(crate) fn filled(page: &str, tables: &Tables) -> Result<String, String> {
    let mut page = page.to_owned();
    for (name, table) in tables {
        let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end {name} -->"));
        let missing = || format!("the page has no place for the table \"{name}\"");
        let from = page.find(&begin).ok_or_else(missing)? + begin.len();
        let to = from + page[from..].find(&end).ok_or_else(missing)?;
        page.replace_range(from..to, &format!("\n{table}\n"));
    }
    Ok(page)
}
