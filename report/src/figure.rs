//! Figures: one plot, plots stacked over one x axis, or several of these side by side.

use crate::data;
use crate::escape::escape;
use crate::number::si;
use crate::plot::{Kind, Plot, Series};
use crate::table::Table;

/// What stands before the data of each stack.
pub(crate) const DATA: &str = "<script type=\"application/json\">";

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

    /// The data of each stack for the script that draws them, what no axis can show in words, and the numbers for a reader without
    /// scripts.
    pub(crate) fn html(&self) -> String {
        let cells: Vec<&Vec<Plot>> = self.cells.iter().filter(|plots| !plots.is_empty()).collect();
        if cells.is_empty() {
            return String::new();
        }
        let mut out = format!("<div class=\"{}\">\n", if cells.len() > 1 { "cells" } else { "cell" });
        let mut remarks = Vec::new();
        for plots in &cells {
            out += &stack(plots, cells.len() > 1, &mut remarks);
        }
        out += "</div>\n";
        for remark in remarks {
            out += &format!("<p class=\"remark\">{}</p>\n", escape(&remark));
        }
        out += &format!(
            "<noscript>\n<p>This figure is drawn by a script in the page. Without scripts, the ranges of its curves:</p>\n{}</noscript>\n",
            numbers(&cells).html()
        );
        out
    }
}

fn stack(plots: &[Plot], beside: bool, remarks: &mut Vec<String>) -> String {
    let (data, left_out) = data::stack(plots, beside);
    remarks.extend(left_out);
    let title = plots.first().map_or("", |p| p.title.as_str());
    let heading = if title.is_empty() { String::new() } else { format!("<p class=\"title\">{}</p>\n", escape(title)) };
    let square = if plots.iter().any(|p| p.equal_aspect) { " square" } else { "" };
    let empty = plots.iter().all(|p| p.series.iter().all(|s| !has_data(s)) && p.regions.is_empty() && p.annotations.is_empty());
    let nothing = if empty { "<p class=\"remark\">There are no data for this figure.</p>\n" } else { "" };
    // Within a script element `<` and `&` would be markup to an XML parser, and `</script` would end it in HTML.
    let json = serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026");
    format!("<div class=\"stack{square}\">\n{heading}{nothing}{DATA}{json}</script>\n</div>\n")
}

fn has_data(s: &Series) -> bool {
    s.x.iter().zip(&s.y).any(|(x, y)| x.is_finite() && y.is_finite())
}

/// From where to where each curve, marker and marked point goes.
fn numbers(cells: &[&Vec<Plot>]) -> Table {
    let mut table = Table::new(["", "axis", "from", "to", "along", "from", "to"]);
    let span = |values: &[f64]| {
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        (finite().reduce(f64::min).unwrap_or(f64::NAN), finite().reduce(f64::max).unwrap_or(f64::NAN))
    };
    for plot in cells.iter().copied().flatten() {
        let x = cells.iter().find(|c| c.iter().any(|p| std::ptr::eq(p, plot))).and_then(|c| c.first()).map_or(&plot.x, |p| &p.x);
        for s in &plot.series {
            let upper = match &s.kind {
                Kind::Band { upper } => upper.as_slice(),
                _ => &[],
            };
            let (low, high) = span(&[s.y.as_slice(), upper].concat());
            let (from, to) = span(&s.x);
            if low.is_nan() {
                continue;
            }
            let name = if s.name.is_empty() { plot.title.clone() } else { s.name.clone() };
            let cell = |v: f64, unit: &str| si(v, unit);
            table.push([
                name,
                plot.y.label.clone(),
                cell(low, &plot.y.unit),
                cell(high, &plot.y.unit),
                x.label.clone(),
                cell(from, &x.unit),
                cell(to, &x.unit),
            ]);
        }
        for m in plot.markers.iter().filter(|m| !m.label.is_empty()) {
            let axis = if m.vertical { x } else { &plot.y };
            table.push([m.label.clone(), axis.label.clone(), si(m.at, &axis.unit)]);
        }
        for p in plot.annotations.iter().filter(|p| !p.label.is_empty()) {
            let (at_x, at_y) = (si(p.x, &x.unit), si(p.y, &plot.y.unit));
            table.push([p.label.clone(), plot.y.label.clone(), at_y.clone(), at_y, x.label.clone(), at_x.clone(), at_x]);
        }
    }
    table
}
