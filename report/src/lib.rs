//! Self-contained reports: one HTML file with figures that opens offline. Knows data only, nothing of robots.
//!
//! A [`Page`] holds a lead sentence, sections, [`Table`]s and [`Figure`]s of [`Plot`]s, and becomes one file: nothing is fetched, the same data give
//! the same bytes. It reads in light and dark, on a narrow screen and in print. Figures show their values at the pointer, show and hide curves by
//! their legend, and zoom; a reader without scripts gets their numbers in a table.
//!
//! ```
//! use backdrive_report::{Page, Plot, Tone};
//!
//! let time: Vec<f64> = (0..1000).map(|k| k as f64 * 1e-3).collect();
//! let position: Vec<f64> = time.iter().map(|t| 2e-3 * (12.0 * t).sin() * (-t).exp()).collect();
//! let mut page = Page::new("A decaying swing");
//! page.lead(Tone::Good, "The swing dies out.")
//!     .section("Response")
//!     .figure(Plot::new("Position").x_axis("time", "s").y_axis("position", "m").line("x_m", &time, &position), "Let go at 0 s.");
//! assert!(page.html().contains("The swing dies out."));
//! ```
//!
//! Apache ECharts draws (`vendor/` gives the reason and its build); it stands in the page, once, if there is a figure. This crate decides which
//! figures a page has and their content: `plot` is the data, `limits` chooses the ranges of the axes, `thin` makes long series short without losing
//! their extremes. `data` writes them into the page, and `figures.js` there hands them to the library.

mod data;
mod escape;
mod figure;
mod limits;
mod number;
mod page;
mod plot;
mod style;
mod table;
mod thin;

pub use figure::Figure;
pub use number::{number, percent, si};
pub use page::Page;
pub use plot::{Colour, Dash, Plot, Series};
pub use style::Tone;
pub use table::{Align, Cell, Table};
