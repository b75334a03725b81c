//! From plots to SVG: layout of a stack over one x axis, then each panel from back to front.

mod labels;
mod layout;
mod marks;

use crate::escape::escape;
use crate::place::Room;
use crate::plot::{Annotation, Kind, Plot, Region};
use crate::style::Tone;
use crate::svg::{Anchor, Rect, Svg, px, shorten, text_width};
use crate::ticks::{Scale, Ticks};
use layout::{Entry, FONT, Panel, SMALL};

/// Draws plots one above the other, `width` px of their own wide.
pub fn stack(plots: &[Plot], width: f64) -> String {
    let layout = layout::layout(plots, width);
    let mut svg = Svg::default();
    let names: Vec<&str> = plots.iter().map(|p| p.title.as_str()).filter(|t| !t.is_empty()).collect();
    svg.raw(format_args!(
        "<svg class=\"plot\" viewBox=\"0 0 {} {}\" style=\"max-width:{}px\" role=\"img\" aria-label=\"{}\">\n",
        px(width),
        px(layout.height),
        px(width * 1.16),
        escape(&names.join("; "))
    ));
    let last = layout.panels.len().saturating_sub(1);
    let mut remarks = layout.remarks;
    for (i, (plot, panel)) in plots.iter().zip(&layout.panels).enumerate() {
        remarks.extend(draw_panel(&mut svg, plot, panel, &layout.x_ticks, i == last));
    }
    if let Some(panel) = layout.panels.last() {
        let label = axis_label(&layout.x_label, &layout.x_ticks.unit);
        let at = (panel.frame.right(), panel.frame.bottom() + 34.0);
        svg.text("a", at, Anchor::End, &shorten(&label, FONT, panel.frame.w));
    }
    let mut y = layout.height + 4.0;
    for remark in &remarks {
        for line in crate::svg::wrap(remark, SMALL, width - 12.0) {
            svg.text("w", (6.0, y + 8.0), Anchor::Start, &line);
            y += 15.0;
        }
    }
    svg.out.push_str("</svg>\n");
    if remarks.is_empty() {
        return svg.out;
    }
    // What could not be drawn is known only now: the drawing grows by its lines.
    let box_of = |h: f64| format!("viewBox=\"0 0 {} {}\"", px(width), px(h));
    svg.out.replacen(&box_of(layout.height), &box_of(y), 1)
}

/// `position (mm)`, or what there is of it.
fn axis_label(label: &str, unit: &str) -> String {
    match (label.is_empty(), unit.is_empty()) {
        (_, true) => label.to_string(),
        (true, false) => unit.to_string(),
        _ => format!("{label} ({unit})"),
    }
}

/// Draws one panel; what could not be shown in it comes back as remarks.
fn draw_panel(svg: &mut Svg, plot: &Plot, panel: &Panel, x_ticks: &Ticks, with_x: bool) -> Vec<String> {
    let frame = panel.frame;
    let mut room = Room::new(frame);
    let names = [&panel.x_label, &panel.x_unit, &plot.y.label, &plot.y.unit].map(|s| s.replace('|', "/"));
    svg.raw(format_args!(
        "<g data-axes=\"{} {} {} {} {} {} {} {} {} {}\" data-names=\"{}\">\n",
        px(frame.x),
        px(frame.y),
        px(frame.w),
        px(frame.h),
        panel.x.lo,
        panel.x.hi,
        u8::from(panel.x.log),
        panel.y.lo,
        panel.y.hi,
        u8::from(panel.y.log),
        escape(&names.join("|"))
    ));
    for (i, line) in panel.title.iter().enumerate() {
        svg.text("t", (frame.x, panel.top + 14.0 + 18.0 * i as f64), Anchor::Start, line);
    }
    draw_legend(svg, &panel.legend);
    let y_label = axis_label(&plot.y.label, &panel.y_ticks.unit);
    if !y_label.is_empty() {
        svg.text("a", (frame.x, frame.y - 6.0), Anchor::Start, &shorten(&y_label, FONT, frame.w));
    }

    window(svg, frame);
    let regions = draw_regions(svg, panel);
    draw_grid(svg, panel, x_ticks, &mut room);
    let mut marks = marks::Marks::new(panel, &mut room);
    for (series, look) in plot.series.iter().zip(&panel.looks) {
        marks.draw(svg, series, look);
    }
    for marker in &plot.markers {
        labels::marker_line(svg, panel, marker);
    }
    svg.out.push_str("</svg>\n");
    svg.rect("f", frame);
    draw_tick_labels(svg, panel, x_ticks, with_x);

    if !plot.series.is_empty() || plot.regions.is_empty() {
        let nothing = plot.series.iter().all(|s| !marks::has_data(s, &panel.x, &panel.y));
        if nothing && plot.annotations.is_empty() {
            svg.text("k", (frame.x + frame.w / 2.0, frame.y + frame.h / 2.0), Anchor::Middle, "no data");
        }
    }
    let remarks = labels::draw(svg, plot, panel, &regions, &mut room);
    svg.out.push_str("</g>\n");
    remarks
}

/// Opens a window on the frame: what is drawn in it until `</svg>` is clipped at its edges.
fn window(svg: &mut Svg, r: Rect) {
    let (x, y, w, h) = (px(r.x), px(r.y), px(r.w), px(r.h));
    svg.raw(format_args!("<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" viewBox=\"{x} {y} {w} {h}\" overflow=\"hidden\">\n"));
}

fn draw_grid(svg: &mut Svg, panel: &Panel, x_ticks: &Ticks, room: &mut Room) {
    let f = panel.frame;
    for tick in &x_ticks.ticks {
        let x = panel.at_x(tick.at);
        svg.line(if tick.label.is_some() { "m" } else { "n" }, (x, f.y), (x, f.bottom()));
    }
    for tick in &panel.y_ticks.ticks {
        let y = panel.at_y(tick.at);
        svg.line(if tick.label.is_some() { "m" } else { "n" }, (f.x, y), (f.right(), y));
    }
    let crosses_zero = |s: &Scale| !s.log && s.lo < 0.0 && s.hi > 0.0;
    if crosses_zero(&panel.x) {
        let x = panel.at_x(0.0);
        svg.line("z", (x, f.y), (x, f.bottom()));
        room.take_line(&[(x, f.y), (x, f.bottom())]);
    }
    if crosses_zero(&panel.y) {
        let y = panel.at_y(0.0);
        svg.line("z", (f.x, y), (f.right(), y));
        room.take_line(&[(f.x, y), (f.right(), y)]);
    }
}

fn draw_tick_labels(svg: &mut Svg, panel: &Panel, x_ticks: &Ticks, with_x: bool) {
    let f = panel.frame;
    for tick in &panel.y_ticks.ticks {
        if let Some(label) = &tick.label {
            svg.text("k", (f.x - 7.0, panel.at_y(tick.at) + 4.0), Anchor::End, label);
        }
    }
    if with_x {
        for tick in &x_ticks.ticks {
            if let Some(label) = &tick.label {
                svg.text("k", (layout::x_label_at(panel.at_x(tick.at), label, panel.width), f.bottom() + 17.0), Anchor::Middle, label);
            }
        }
    }
}

fn draw_legend(svg: &mut Svg, legend: &[(f64, f64, Entry)]) {
    for (x, y, entry) in legend {
        let (x, y) = (*x, *y);
        let middle = y - 4.0;
        match entry {
            Entry::Series { look, kind, .. } => match kind {
                Kind::Line => {
                    svg.path(&format!("l {}", look.class), &look.stroke(false), &format!("M{} {}h24", px(x), px(middle)));
                }
                Kind::Points => marks::mark(svg, look, &[(x + 12.0, middle)], 3.4),
                Kind::Band { .. } => svg.rect(&format!("b {}", look.class), Rect { x, y: middle - 5.0, w: 24.0, h: 10.0 }),
                Kind::Discs { .. } => svg.raw(format_args!(
                    "<g class=\"d {}\"><circle cx=\"{}\" cy=\"{}\" r=\"6\"/></g>\n",
                    look.class,
                    px(x + 12.0),
                    px(middle)
                )),
                Kind::Bars => svg.rect(&format!("q {}", look.class), Rect { x: x + 6.0, y: middle - 5.0, w: 12.0, h: 10.0 }),
            },
            Entry::Region { tone, .. } => {
                let swatch = Rect { x, y: middle - 6.0, w: 24.0, h: 12.0 };
                svg.rect(&format!("r {}", tone.class()), swatch);
                svg.path(&format!("h {}", tone.class()), "", &hatch(*tone, swatch));
            }
        }
        svg.text("g", (x + 30.0, y), Anchor::Start, entry.name());
    }
}

/// A region as drawn: its span in px and whether its label is to be written into it.
pub(crate) struct DrawnRegion<'a> {
    region: &'a Region,
    span: Rect,
}

fn draw_regions<'a>(svg: &mut Svg, panel: &'a Panel) -> Vec<DrawnRegion<'a>> {
    let mut drawn = Vec::new();
    for region in &panel.regions {
        let Some(span) = panel.region_span(region) else { continue };
        let class = region.tone.class();
        svg.raw(format_args!("<g><title>{}</title>\n", escape(&region.label)));
        svg.rect(&format!("r {class}"), span);
        svg.path(&format!("h {class}"), "", &hatch(region.tone, span));
        svg.out.push_str("</g>\n");
        drawn.push(DrawnRegion { region, span });
    }
    drawn
}

/// Hatching by tone, so that regions can be told apart without colour: good has none.
fn hatch(tone: Tone, r: Rect) -> String {
    use std::fmt::Write;
    const STEP: f64 = 9.0;
    let mut d = String::new();
    let (first, last) = (((r.x - r.h) / STEP).floor() as i64, (r.right() / STEP).ceil() as i64);
    for k in first..=last {
        let c = k as f64 * STEP;
        let (from, to) = (r.x.max(c), r.right().min(c + r.h));
        match tone {
            // The lines run through all regions alike: they meet where two regions of one tone do.
            Tone::Bad if to > from => {
                let _ = write!(d, "M{} {}L{} {}", px(from), px(r.bottom() - (from - c)), px(to), px(r.bottom() - (to - c)));
            }
            Tone::Warning if to > from => {
                let _ = write!(d, "M{} {}L{} {}", px(from), px(r.y + (from - c)), px(to), px(r.y + (to - c)));
            }
            Tone::Limited if c >= r.x && c <= r.right() => {
                let _ = write!(d, "M{} {}v{}", px(c), px(r.y), px(r.h));
            }
            _ => {}
        }
    }
    if tone == Tone::Unsure {
        let mut y = (r.y / STEP).ceil() * STEP;
        while y < r.bottom() {
            let _ = write!(d, "M{} {}h{}", px(r.x), px(y), px(r.w));
            y += STEP;
        }
    }
    d
}

/// The width of a label with its rim, px.
fn label_width(text: &str) -> f64 {
    text_width(text, FONT) + 6.0
}

impl Annotation {
    fn place(&self, panel: &Panel) -> Option<(f64, f64)> {
        (panel.x.holds(self.x) && panel.y.holds(self.y)).then(|| (panel.at_x(self.x), panel.at_y(self.y)))
    }
}
