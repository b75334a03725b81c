//! The few SVG words the plots are written in.

use crate::escape::escape;
use std::fmt::Write;

/// A rectangle in pixels of the drawing; y grows downwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub w: f64,
    pub h: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.x + self.w
    }
    pub fn bottom(&self) -> f64 {
        self.y + self.h
    }
    /// Whether the two share area.
    pub fn overlaps(&self, other: &Rect) -> bool {
        self.x < other.right() && other.x < self.right() && self.y < other.bottom() && other.y < self.bottom()
    }
}

/// A coordinate to a tenth of a pixel, without a trailing zero.
pub fn px(value: f64) -> String {
    let tenths = (value * 10.0).round();
    if !tenths.is_finite() {
        return "0".into(); // an infinite coordinate never gets here: what is drawn was cut to the window before
    }
    let tenths = tenths as i64;
    let sign = if tenths < 0 { "-" } else { "" };
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    if rest == 0 { format!("{sign}{whole}") } else { format!("{sign}{whole}.{rest}") }
}

/// Where a text is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// SVG being written.
#[derive(Default)]
pub struct Svg {
    pub out: String,
}

impl Svg {
    /// Appends markup. Writing to a String cannot fail.
    pub fn raw(&mut self, markup: std::fmt::Arguments) {
        let _ = self.out.write_fmt(markup);
    }

    pub fn line(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) {
        self.raw(format_args!(
            "<line class=\"{class}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>\n",
            px(from.0),
            px(from.1),
            px(to.0),
            px(to.1)
        ));
    }

    pub fn rect(&mut self, class: &str, r: Rect) {
        self.raw(format_args!(
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n",
            px(r.x),
            px(r.y),
            px(r.w.max(0.0)),
            px(r.h.max(0.0))
        ));
    }

    pub fn path(&mut self, class: &str, style: &str, d: &str) {
        if !d.is_empty() {
            let style = if style.is_empty() { String::new() } else { format!(" style=\"{style}\"") };
            self.raw(format_args!("<path class=\"{class}\"{style} d=\"{d}\"/>\n"));
        }
    }

    pub fn text(&mut self, class: &str, at: (f64, f64), anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        self.raw(format_args!("<text class=\"{class}\" x=\"{}\" y=\"{}\"{anchor}>{}</text>\n", px(at.0), px(at.1), escape(text)));
    }
}

/// Appends one stroke through the points to a path.
pub fn stroke(d: &mut String, points: &[(f64, f64)]) {
    for (i, p) in points.iter().enumerate() {
        let word = match i {
            0 => "M",
            1 => "L",
            _ => " ",
        };
        let _ = write!(d, "{word}{} {}", px(p.0), px(p.1));
    }
}

/// Advance widths of a sans-serif face in thousandths of its size, for U+0020 to U+007E (Helvetica's metrics).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 278,
    278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722,
    667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556,
    556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

/// How much wider than Helvetica's the usual sans-serif faces are at most (DejaVu Sans, Verdana).
const WIDEST: f64 = 1.17;

/// The width that a text will take at most, px, for a font of `size` px.
pub fn text_width(text: &str, size: f64) -> f64 {
    let thousandths: f64 = text
        .chars()
        .map(|c| match c {
            ' '..='~' => f64::from(WIDTHS.get(c as usize - 32).copied().unwrap_or(600)),
            '\u{0300}'..='\u{036f}' => 0.0,
            '⁰'..='⁹' | '²' | '³' | '¹' | '⁻' => 380.0,
            c if (c as u32) < 0x2e80 => 640.0,
            _ => 1000.0,
        })
        .sum();
    thousandths / 1000.0 * size * WIDEST
}

/// A text cut into lines of at most `width` px at spaces; a word that is longer by itself is cut with an ellipsis.
pub fn wrap(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let word = shorten(word, size, width);
        let longer = if line.is_empty() { word.clone() } else { format!("{line} {word}") };
        if line.is_empty() || text_width(&longer, size) <= width {
            line = longer;
        } else {
            lines.push(std::mem::replace(&mut line, word));
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// A text cut to `width` px, with an ellipsis if anything went.
pub fn shorten(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let mut kept = String::new();
    for c in text.chars() {
        if text_width(&format!("{kept}{c}…"), size) > width {
            break;
        }
        kept.push(c);
    }
    kept.push('…');
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_never_malformed() {
        assert_eq!(px(1.04), "1");
        assert_eq!(px(-0.04), "0");
        assert_eq!(px(-0.25), "-0.3");
        assert_eq!(px(12.55), "12.6");
        assert_eq!(px(f64::INFINITY), "0");
    }

    #[test]
    fn text_is_wrapped_and_shortened_within_its_width() {
        let lines = wrap("the quick brown fox jumps over extraordinarily-long-unbreakable-words", 12.0, 80.0);
        assert!(lines.len() > 2 && lines.iter().all(|l| text_width(l, 12.0) <= 80.0), "{lines:?}");
        assert_eq!(shorten("short", 12.0, 80.0), "short");
        assert!(wrap("", 12.0, 80.0).is_empty());
    }
}
