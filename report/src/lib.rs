//! Self-contained reports: one HTML file with SVG plots that opens offline. Knows data only, nothing of robots.
//!
//! A [`Page`] holds a lead sentence, sections, [`Table`]s and [`Figure`]s of [`Plot`]s, and becomes one file: no script is needed, no
//! font or style is fetched, the same data give the same bytes. It reads in light and dark, on a narrow screen and in print.
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
//! The plots are written here and not by the plotters crate: that draws a point outside the limits at the edge (so a curve that leaves the
//! window leaves it with a false slope), rounds to whole pixels, writes each dash as an element of its own, and puts colours where no style
//! sheet reaches them (so no dark scheme). What is needed instead is small: [`plot`] is the data, `ticks` chooses the numbers at the axes,
//! `thin` makes long series short without losing their extremes, `place` finds free room for labels, `draw` writes the SVG.

mod draw;
mod escape;
mod figure;
mod number;
mod page;
mod place;
pub mod plot;
mod style;
mod svg;
mod table;
mod thin;
mod ticks;

pub use figure::Figure;
pub use number::{number, percent, si};
pub use page::Page;
pub use plot::{Colour, Dash, Plot, Series};
pub use style::Tone;
pub use table::{Align, Cell, Table};
