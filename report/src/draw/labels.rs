//! What is written into a panel: labels of regions, marker lines and points, each where it hides least.

use super::layout::{FONT, Panel, region_label_fits};
use super::{DrawnRegion, label_width};
use crate::number::number;
use crate::place::Room;
use crate::plot::{Marker, Plot};
use crate::style::Tone;
use crate::svg::{Anchor, Rect, Svg, px, shorten};

/// Height of a label, px.
const HEIGHT: f64 = 15.0;

/// The line of a marker; its label comes later, on top of everything.
pub fn marker_line(svg: &mut Svg, panel: &Panel, marker: &Marker) {
    let f = panel.frame;
    let class = format!("v {}", marker.tone.class());
    if marker.vertical && panel.x.holds(marker.at) {
        let x = panel.at_x(marker.at);
        svg.line(&class, (x, f.y), (x, f.bottom()));
    } else if !marker.vertical && panel.y.holds(marker.at) {
        let y = panel.at_y(marker.at);
        svg.line(&class, (f.x, y), (f.right(), y));
    }
}

/// Writes all labels of a panel. What lies beyond the axes or finds no free place comes back as remarks.
pub fn draw(svg: &mut Svg, plot: &Plot, panel: &Panel, regions: &[DrawnRegion], room: &mut Room) -> Vec<String> {
    let frame = panel.frame;
    let mut remarks = Vec::new();
    for marker in plot.markers.iter().filter(|m| m.vertical && panel.x.holds(m.at)) {
        let x = panel.at_x(marker.at);
        room.take_line(&[(x, frame.y), (x, frame.bottom())]);
    }
    let points: Vec<_> = plot.annotations.iter().map(|a| a.place(panel)).collect();
    for (x, y) in points.iter().flatten() {
        room.take_label(Rect { x: x - 4.0, y: y - 4.0, w: 8.0, h: 8.0 });
    }

    for drawn in regions.iter().filter(|d| !d.region.label.is_empty() && region_label_fits(d.region, d.span)) {
        let w = label_width(&drawn.region.label);
        let x = drawn.span.x + (drawn.span.w - w) / 2.0;
        let rows = [4.0, 12.0, 22.0].map(|up| frame.bottom() - HEIGHT - up).into_iter().chain([frame.y + 4.0]);
        let spots = rows.flat_map(|y| [x, drawn.span.x + 2.0, drawn.span.right() - w - 2.0].map(|x| (x, y)));
        let spot = room.place(spots.map(|(x, y)| Rect { x, y, w, h: HEIGHT }));
        let said = || format!("{}: from {} to {}", drawn.region.label, number(drawn.region.from), number(drawn.region.to));
        write(svg, spot, &drawn.region.label, drawn.region.tone, &mut remarks, said);
    }

    for (marker, text) in plot.markers.iter().filter(|m| !m.label.is_empty()).map(|m| (m, shorten(&m.label, FONT, frame.w * 0.8))) {
        let w = label_width(&text);
        let (scale, name) = if marker.vertical { (&panel.x, &panel.x_label) } else { (&panel.y, &plot.y.label) };
        let said = || format!("{}: at {} {}", marker.label, name, number(marker.at)).replace("  ", " ");
        if !scale.holds(marker.at) {
            remarks.push(format!("{}, beyond the axis", said()));
            continue;
        }
        let spots: Vec<(f64, f64)> = if marker.vertical {
            let x = panel.at_x(marker.at);
            let rows = (0..((frame.h / HEIGHT) as usize)).map(|i| frame.y + 3.0 + i as f64 * HEIGHT);
            rows.flat_map(|y| [(x + 3.0, y), (x - w - 3.0, y)]).collect()
        } else {
            let y = panel.at_y(marker.at);
            let steps = 0..12;
            let xs = steps.map(|i| frame.right() - w - 4.0 - f64::from(i) * (frame.w - w - 8.0).max(0.0) / 11.0);
            xs.flat_map(|x| [(x, y - HEIGHT - 2.0), (x, y + 3.0)]).collect()
        };
        let spot = room.place(spots.into_iter().map(|(x, y)| Rect { x, y, w, h: HEIGHT }));
        write(svg, spot, &text, marker.tone, &mut remarks, said);
    }

    for (annotation, point) in plot.annotations.iter().zip(&points) {
        let said = || format!("{}: at ({}, {})", annotation.label, number(annotation.x), number(annotation.y));
        let Some((x, y)) = *point else {
            if annotation.x.is_finite() && annotation.y.is_finite() {
                remarks.push(format!("{}, beyond the axes", said()));
            }
            continue;
        };
        let ring = format!("o {}", annotation.tone.class());
        svg.raw(format_args!("<circle class=\"{ring}\" cx=\"{}\" cy=\"{}\" r=\"4\"/>\n", px(x), px(y)));
        if annotation.label.is_empty() {
            continue;
        }
        let text = shorten(&annotation.label, FONT, frame.w * 0.9);
        let w = label_width(&text);
        let around = |d: f64| {
            let s = 0.7 * d;
            [
                (x + s, y - s - HEIGHT),
                (x + s, y + s),
                (x - s - w, y - s - HEIGHT),
                (x - s - w, y + s),
                (x + d, y - HEIGHT / 2.0),
                (x - d - w, y - HEIGHT / 2.0),
                (x - w / 2.0, y - d - HEIGHT),
                (x - w / 2.0, y + d),
            ]
        };
        let inside = |(x, y): (f64, f64)| Rect {
            x: x.min(frame.right() - w).max(frame.x),
            y: y.min(frame.bottom() - HEIGHT).max(frame.y),
            w,
            h: HEIGHT,
        };
        let spot = room.place([7.0, 18.0, 34.0, 55.0, 80.0, 110.0].into_iter().flat_map(around).map(inside));
        if let Some(r) = spot {
            // From the ring to the nearest point of the label, where that is some way off.
            let to = (x.clamp(r.x, r.right()), y.clamp(r.y + 2.0, r.bottom() - 2.0));
            let away = (to.0 - x).hypot(to.1 - y);
            if away > 14.0 {
                let share = 5.0 / away;
                svg.line("u", (x + share * (to.0 - x), y + share * (to.1 - y)), to);
            }
        }
        write(svg, spot, &text, annotation.tone, &mut remarks, said);
    }
    remarks
}

/// Writes a label into its place, or a remark instead.
fn write(svg: &mut Svg, spot: Option<Rect>, text: &str, tone: Tone, remarks: &mut Vec<String>, said: impl Fn() -> String) {
    match spot {
        Some(r) => svg.text(&format!("i tone {}", tone.class()), (r.x + r.w / 2.0, r.y + 11.5), Anchor::Middle, text),
        None => remarks.push(said()),
    }
}
