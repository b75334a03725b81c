//! The data themselves: lines, points, bands, discs, bars.

use super::layout::{Look, Panel};
use crate::escape::escape;
use crate::place::Room;
use crate::plot::{Kind, Series};
use crate::svg::{Rect, Svg, px, stroke};
use crate::thin;
use crate::ticks::{Scale, drawable};
use std::collections::HashSet;

/// Whether anything of a series can stand on these axes.
pub fn has_data(s: &Series, x: &Scale, y: &Scale) -> bool {
    s.x.iter().zip(&s.y).any(|(a, b)| drawable(*a, x.log) && drawable(*b, y.log))
}

/// Draws series into a panel and notes where they are.
pub struct Marks<'a> {
    panel: &'a Panel,
    room: &'a mut Room,
}

impl<'a> Marks<'a> {
    pub fn new(panel: &'a Panel, room: &'a mut Room) -> Self {
        Self { panel, room }
    }

    pub fn draw(&mut self, svg: &mut Svg, s: &Series, look: &Look) {
        svg.raw(format_args!("<g>"));
        if !s.name.is_empty() {
            svg.raw(format_args!("<title>{}</title>", escape(&s.name)));
        }
        svg.out.push('\n');
        let panel = self.panel;
        let n = s.len().0;
        let points = s.x.iter().zip(&s.y).take(n).map(|(x, y)| (panel.at_x(*x), panel.at_y(*y)));
        match &s.kind {
            Kind::Line => self.line(svg, look, points),
            Kind::Points => {
                let kept = thin::points(points.filter(|p| p.0.is_finite() && p.1.is_finite()), panel.frame);
                kept.iter().for_each(|p| self.room.take_point(*p));
                mark(svg, look, &kept, if kept.len() > 400 { look.width * 1.2 } else { look.width * 1.9 });
            }
            Kind::Band { upper } => {
                let three = points.zip(upper).map(|(p, u)| (p.0, p.1, panel.at_y(*u)));
                for polygon in thin::band(three) {
                    let mut d = String::new();
                    stroke(&mut d, &polygon);
                    d.push('Z');
                    svg.path(&format!("b {}", look.class), "", &d);
                    svg.path(&format!("be {}", look.class), "", &d);
                }
            }
            Kind::Discs { radius } => self.discs(svg, s, look, radius, n),
            Kind::Bars => self.bars(svg, look, points.collect()),
        }
        svg.out.push_str("</g>\n");
    }

    fn line(&mut self, svg: &mut Svg, look: &Look, points: impl Iterator<Item = (f64, f64)>) {
        let thinned = thin::line(points, self.panel.frame);
        let mut d = String::new();
        let mut alone = Vec::new();
        for part in &thinned.strokes {
            self.room.take_line(part);
            match part.as_slice() {
                [only] => alone.push(*only),
                _ => stroke(&mut d, part),
            }
        }
        svg.path(&format!("l {}", look.class), &look.stroke(thinned.dense), &d);
        // A sample between two gaps has no line to be on: a dot.
        mark(svg, &Look { shape: 0, ..look.clone() }, &alone, look.width.max(1.5) * 1.2);
    }

    /// All discs in one group with one opacity, so that their union is seen and not how many lie on each other.
    fn discs(&mut self, svg: &mut Svg, s: &Series, look: &Look, radius: &[f64], n: usize) {
        let (panel, frame) = (self.panel, self.panel.frame);
        let half = |scale: &Scale, length: f64, centre: f64, r: f64| (scale.share(centre + r) - scale.share(centre - r)) / 2.0 * length;
        let mut seen = HashSet::new();
        svg.raw(format_args!("<g class=\"d {}\">\n", look.class));
        for ((re, im), r) in s.x.iter().zip(&s.y).zip(radius).take(n) {
            let (cx, cy) = (panel.at_x(*re), panel.at_y(*im));
            let (rx, ry) = (half(&panel.x, frame.w, *re, *r), half(&panel.y, frame.h, *im, *r));
            // NaN (no centre, no radius, a logarithmic axis that ends within the disc) fails these comparisons.
            let near = cx + rx > frame.x && cx - rx < frame.right() && cy + ry > frame.y && cy - ry < frame.bottom();
            if !(near && rx > 0.0 && ry > 0.0 && rx < 1e6 && ry < 1e6) {
                continue;
            }
            if seen.insert([cx, cy, rx].map(|v| v.round() as i64)) {
                svg.raw(format_args!("<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\"/>\n", px(cx), px(cy), px(rx), px(ry)));
            }
        }
        svg.out.push_str("</g>\n");
    }

    fn bars(&mut self, svg: &mut Svg, look: &Look, points: Vec<(f64, f64)>) {
        let frame = self.panel.frame;
        let mut xs: Vec<f64> = points.iter().map(|p| p.0).filter(|x| x.is_finite()).collect();
        xs.sort_by(f64::total_cmp);
        let apart =
            xs.windows(2).filter_map(|w| if let [a, b] = w { Some(b - a).filter(|d| *d > 0.0) } else { None }).fold(frame.w, f64::min);
        let w = (0.75 * apart).clamp(1.0, 48.0);
        let foot = if self.panel.y.log { frame.bottom() } else { self.panel.at_y(0.0).clamp(frame.y, frame.bottom()) };
        for p in points.iter().filter(|p| p.0.is_finite() && p.1.is_finite()) {
            let y = p.1.clamp(frame.y - 10.0, frame.bottom() + 10.0);
            let bar = Rect { x: p.0 - w / 2.0, y: y.min(foot), w, h: (y - foot).abs() };
            self.room.take_line(&[(p.0, foot), (p.0, y)]);
            svg.rect(&format!("q {}", look.class), bar);
        }
    }
}

/// Marks of one shape as one path: disc, square, triangle, diamond, cross, triangle on its tip.
pub fn mark(svg: &mut Svg, look: &Look, points: &[(f64, f64)], r: f64) {
    use std::fmt::Write;
    let shape = |dx: f64, dy: f64, rest: String| (dx, dy, rest);
    let (dx, dy, rest) = match look.shape % 6 {
        0 => shape(-r, 0.0, format!("a{0} {0} 0 1 0 {1} 0a{0} {0} 0 1 0 -{1} 0z", px(r), px(2.0 * r))),
        1 => shape(-0.9 * r, -0.9 * r, format!("h{0}v{0}h-{0}z", px(1.8 * r))),
        2 => shape(0.0, -1.2 * r, format!("l{0} {1}h-{2}z", px(1.1 * r), px(2.0 * r), px(2.2 * r))),
        3 => shape(0.0, -1.3 * r, format!("l{0} {0}l-{0} {0}l-{0} -{0}z", px(1.3 * r))),
        4 => {
            let (a, b) = (px(0.8 * r), px(0.7 * r));
            shape(-0.35 * r, -1.15 * r, format!("h{b}v{a}h{a}v{b}h-{a}v{a}h-{b}v-{a}h-{a}v-{b}h{a}z"))
        }
        _ => shape(0.0, 1.2 * r, format!("l{0} -{1}h-{2}z", px(1.1 * r), px(2.0 * r), px(2.2 * r))),
    };
    let mut d = String::new();
    for p in points {
        let _ = write!(d, "M{} {}{rest}", px(p.0 + dx), px(p.1 + dy));
    }
    svg.path(&format!("p {}", look.class), "", &d);
}
