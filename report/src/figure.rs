//! Figures: one plot, plots stacked over one x axis, or several of these side by side.

use crate::draw;
use crate::plot::Plot;
use crate::style::{COLOURS, PLOT_STYLE};

/// One drawing, or several side by side where there is room.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Each cell is a stack of plots over one x axis.
    cells: Vec<Vec<Plot>>,
}

impl From<Plot> for Figure {
    fn from(plot: Plot) -> Self {
        Self { cells: vec![vec![plot]] }
    }
}

/// Widths of the drawings in px of their own: for a whole row, for equal aspect alone in its row, for half a row and narrow screens.
const WHOLE: f64 = 860.0;
const SQUARE: f64 = 620.0;
const HALF: f64 = 440.0;

impl Figure {
    /// Plots one above the other that share the x axis of the first (its label, its limits or those of all data, logarithmic or not),
    /// as magnitude and phase.
    pub fn stacked(plots: impl IntoIterator<Item = Plot>) -> Self {
        Self { cells: vec![plots.into_iter().collect()] }
    }

    /// Figures side by side on wide screens, one below the other on narrow ones.
    pub fn beside<F: Into<Figure>>(figures: impl IntoIterator<Item = F>) -> Self {
        Self { cells: figures.into_iter().flat_map(|f| f.into().cells).collect() }
    }

    /// A single SVG of the first cell, with its colours and styles, to be used by itself; empty if there is no plot.
    pub fn svg(&self) -> String {
        let Some(plots) = self.cells.first() else { return String::new() };
        let style = format!("<style>\n{COLOURS}{PLOT_STYLE}</style>\n");
        draw::stack(plots, large_width(plots))
            .replacen("<svg class=\"plot\"", "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\"", 1)
            .replacen("</title>", &format!("</title>\n{style}"), 1)
    }

    /// The drawings. A lone cell is drawn twice, for wide and for narrow screens: shrunk to a third, its numbers could not be read.
    pub(crate) fn html(&self) -> String {
        match self.cells.as_slice() {
            [] => String::new(),
            [plots] => {
                let large = draw::stack(plots, large_width(plots));
                format!("<div class=\"large\">\n{large}</div>\n<div class=\"small\">\n{}</div>\n", draw::stack(plots, HALF))
            }
            cells => {
                let cells: String = cells.iter().map(|plots| format!("<div>\n{}</div>\n", draw::stack(plots, HALF))).collect();
                format!("<div class=\"plots\">\n{cells}</div>\n")
            }
        }
    }
}

fn large_width(plots: &[Plot]) -> f64 {
    if plots.iter().any(|p| p.equal_aspect) { SQUARE } else { WHOLE }
}
