//! A page, and how it is written.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::Serialize;

use super::secured::{embedded, policy};
use super::{Columns, Plot, Space, Table};
use crate::printable::printable;

/// uPlot with its licence, which asks to go with every copy, behind what tells it how sharp to draw.
const UPLOT: &str = concat!(
    include_str!("theme.js"),
    "/*\n",
    include_str!("uplot/LICENSE"),
    "*/\n",
    include_str!("uplot/uPlot.iife.min.js")
);
const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const STYLE: &str = include_str!("page.css");
/// In the order in which they need each other.
const SCRIPTS: [&str; 3] = [include_str!("plot.js"), include_str!("space.js"), include_str!("page.js")];

/// A report for a browser.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// What it is about.
    pub title: String,
    /// What made it.
    pub made_by: String,
    /// The answer, a paragraph each: what a reader wants to know who reads nothing else.
    pub answer: Vec<String>,
    /// What a person must read.
    pub warnings: Vec<String>,
    /// What is good to know.
    pub notes: Vec<String>,
    /// The rest.
    pub sections: Vec<Section>,
    /// What the plots draw.
    pub tables: Vec<Columns>,
    /// What `--json` prints.
    pub json: serde_json::Value,
}

/// A heading, and what stands below it.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its name in links.
    pub id: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What stands below.
    pub parts: Vec<Part>,
}

/// A part of a section.
#[derive(Clone, Debug)]
pub enum Part {
    /// A paragraph.
    Text(String),
    /// Text of a file.
    Code(String),
    /// A table.
    Table(Table),
    /// Plots in so many columns, fewer where the page is narrow.
    Plots(usize, Vec<Plot>),
    /// A view of space.
    Space(Space),
}

/// What the scripts draw, in the order of the elements that wait for it.
#[derive(Default, Serialize)]
struct Drawings<'a> {
    tables: &'a [Columns],
    plots: Vec<&'a Plot>,
    spaces: Vec<&'a Space>,
}

impl Page {
    /// The page as HTML: the same page gives the same bytes.
    #[must_use]
    pub fn render(&self) -> String {
        let mut drawings = Drawings { tables: &self.tables, ..Drawings::default() };
        for part in self.sections.iter().flat_map(|s| &s.parts) {
            match part {
                Part::Plots(_, plots) => drawings.plots.extend(plots),
                Part::Space(space) => drawings.spaces.push(space),
                Part::Text(_) | Part::Code(_) | Part::Table(_) => {}
            }
        }
        let script = SCRIPTS.concat();
        let title = printable(&self.title);
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(policy(&[UPLOT, &script], &[UPLOT_STYLE, STYLE]));
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content=(self.made_by);
                    title { (title) }
                    style { (PreEscaped(UPLOT_STYLE)) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header {
                        p.made-by { (self.made_by) }
                        h1 { (title) }
                        @for sentence in &self.answer { p.answer { (printable(sentence)) } }
                    }
                    (self.warnings_and_notes())
                    nav { @for section in &self.sections { a href={ "#" (section.id) } { (section.title) } " " } }
                    noscript { p.notice { "The plots need JavaScript. All numbers stand in the tables." } }
                    main { @for section in &self.sections { (section.markup()) } }
                    script type="application/json" id="report" { (PreEscaped(embedded(&self.json))) }
                    script type="application/json" id="drawings" { (PreEscaped(embedded(&drawings))) }
                    script { (PreEscaped(UPLOT)) }
                    script { (PreEscaped(&script)) }
                }
            }
        };
        page.into_string() + "\n"
    }

    fn warnings_and_notes(&self) -> Markup {
        let (warnings, notes) = (&self.warnings, &self.notes);
        html! {
            @if !warnings.is_empty() {
                section.warnings #warnings {
                    h2 { @if warnings.len() == 1 { "Warning" } @else { (warnings.len()) " warnings" } }
                    ul { @for warning in warnings { li { (printable(warning)) } } }
                }
            }
            @if !notes.is_empty() {
                section.notes { ul { @for note in notes { li { (printable(note)) } } } }
            }
        }
    }
}

impl Section {
    /// A section.
    #[must_use]
    pub fn new(id: &'static str, title: &'static str, parts: Vec<Part>) -> Self {
        Self { id, title, parts }
    }

    fn markup(&self) -> Markup {
        html! {
            section id=(self.id) {
                h2 { (self.title) }
                @for part in &self.parts {
                    @match part {
                        Part::Text(text) => { p { (printable(text)) } }
                        Part::Code(text) => { pre { code { @for line in text.lines() { (printable(line)) "\n" } } } }
                        Part::Table(table) => { (table.markup()) }
                        Part::Plots(columns, plots) => {
                            div.plots.{ "columns-" (columns) } { @for plot in plots { (figure(&plot.title, "plot")) } }
                        }
                        Part::Space(space) => { (figure(&space.title, "space")) }
                    }
                }
            }
        }
    }
}

/// The last part of a path, whatever system it is of.
pub(super) fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Where a script draws.
fn figure(title: &str, class: &str) -> Markup {
    html! { figure { figcaption { (printable(title)) } div class=(class) {} } }
}

#[cfg(test)]
mod tests {
    use super::super::{Column, Ink, Plot, Series, Style};
    use super::*;

    const HOSTILE: &str = "</title></script><img src=x onerror=alert(1)>\"'&\u{202e}";

    /// A page that says the hostile text wherever a log could.
    fn hostile() -> Page {
        let said = || HOSTILE.to_owned();
        let series = Series {
            label: said(),
            table: 0,
            x: 0,
            y: 1,
            style: Style::Dots,
            ink: Ink::Plain,
            band: None,
            phase: None,
        };
        let plot = Plot {
            title: said(),
            x_label: "s",
            y_label: said(),
            series: vec![series],
            group: "motion",
            ..Plot::default()
        };
        let table = Table { caption: said(), columns: vec![Column::words("what")], rows: vec![vec![said()]] };
        let parts =
            vec![Part::Text(said()), Part::Code(said()), Part::Table(table), Part::Plots(1, vec![plot])];
        Page {
            title: said(),
            made_by: said(),
            answer: vec![said()],
            warnings: vec![said()],
            notes: vec![said()],
            sections: vec![Section { id: "motion", title: "Motion", parts }],
            tables: vec![Columns::of(&[Some(0)], &[&|_| 1.0, &|_| 2.0])],
            json: serde_json::json!({ said(): said() }),
        }
    }

    #[test]
    fn what_a_log_says_never_becomes_markup() {
        let page = hostile().render();
        assert!(!page.contains("<img") && !page.contains("</title></script>"), "{page}");
        assert_eq!(page.matches("<script").count(), 4, "the report, the drawings, uPlot, and ours");
        assert_eq!(page.matches("</script").count(), 4);
        assert!(page.matches("&lt;img src=x").count() >= 9, "it is still there to be read");
    }

    #[test]
    fn a_page_is_the_same_each_time_and_names_no_other_place() {
        let page = hostile().render();
        assert_eq!(page, hostile().render());
        assert_eq!(page.replace(UPLOT, "").matches("://").count(), 0);
        assert!(!STYLE.contains("url(") && !STYLE.contains("@import") && !UPLOT_STYLE.contains("url("));
    }

    #[test]
    fn scripts_and_styles_are_those_that_the_policy_names() {
        let page = hostile().render();
        let between = |from: &'static str, to: &'static str| {
            page.split(from).skip(1).filter_map(move |rest| rest.split(to).next()).collect::<Vec<_>>()
        };
        let policy = super::policy(&between("<script>", "</script>"), &between("<style>", "</style>"));
        assert!(page.contains(&policy.replace('\'', "&#39;")) || page.contains(&policy), "{policy}");
    }
}
