//! The report as one page for a browser: self-contained, for paper, phone and desktop, light and dark.
//!
//! A [`Page`] is what every estimator's report is made of: a title, the answer, warnings, then sections of tables and
//! plots. [`fusion`] makes that of `fuse`, [`usbl`] that of `usbl`.
//!
//! Nothing that a log says can run in the browser: all text goes through `maud`, which escapes it; JSON is embedded
//! without a `<`; and the page's Content-Security-Policy names the hashes of its own scripts and styles, forbids all
//! others, and forbids the network altogether.
//!
//! Tables and text are made here, so that a reader without JavaScript has every number. The browser draws
//! the plots only, with uPlot (MIT, in `uplot/`), and the view of space with a projection of our own.

mod data;
mod drawing;
pub mod fusion;
mod page;
mod plot;
mod secured;
mod table;
mod tables;
pub mod usbl;

pub use data::Columns;
pub use page::{Page, Part, Section};
pub use plot::{Band, Cloud, Ink, Level, Mark, Plot, Series, Space, Style};
pub use table::{Column, Table, plus_minus, value};
