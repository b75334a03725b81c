//! Free room for labels.

use crate::svg::Rect;

/// Cells of this many px, of which the grid knows whether data cross them.
const CELL: f64 = 4.0;

/// Above and below the letters, px.
const EDGE: f64 = 3.0;

/// What of a plot is taken: by data (to be avoided) and by labels (not to be touched).
pub struct Room {
    window: Rect,
    columns: usize,
    taken: Vec<bool>,
    labels: Vec<Rect>,
}

impl Room {
    pub fn new(window: Rect) -> Self {
        let columns = (window.w / CELL).ceil().max(1.0) as usize;
        let rows = (window.h / CELL).ceil().max(1.0) as usize;
        Self { window, columns, taken: vec![false; columns * rows], labels: Vec::new() }
    }

    fn cell(&self, x: f64, y: f64) -> Option<usize> {
        if x < self.window.x || y < self.window.y || x >= self.window.right() || y >= self.window.bottom() {
            return None;
        }
        Some(((y - self.window.y) / CELL) as usize * self.columns + ((x - self.window.x) / CELL) as usize)
    }

    /// Notes a stroke of data, or of anything that a label had better not cross.
    pub fn take_line(&mut self, stroke: &[(f64, f64)]) {
        for w in stroke.windows(2) {
            let [a, b] = w else { continue };
            let steps = ((b.0 - a.0).abs().max((b.1 - a.1).abs()) / CELL).ceil().clamp(1.0, 2000.0) as usize;
            for i in 0..=steps {
                let t = i as f64 / steps as f64;
                self.take_point((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
            }
        }
        if let [only] = stroke {
            self.take_point(*only);
        }
    }

    pub fn take_point(&mut self, p: (f64, f64)) {
        if let Some(taken) = self.cell(p.0, p.1).and_then(|i| self.taken.get_mut(i)) {
            *taken = true;
        }
    }

    /// Notes a label that was put down.
    pub fn take_label(&mut self, r: Rect) {
        self.labels.push(r);
    }

    /// How bad a label would lie here: out of the window or on another label far worse than on data.
    fn cost(&self, r: &Rect) -> f64 {
        let mut cost = 0.0;
        if r.x < self.window.x || r.y < self.window.y || r.right() > self.window.right() || r.bottom() > self.window.bottom() {
            cost += 3000.0;
        }
        cost += 1000.0 * self.labels.iter().filter(|l| l.overlaps(r)).count() as f64;
        // The letters are lower than their rectangle: data may touch its upper and lower edge.
        let (top, high) = (r.y + EDGE, (r.h - 2.0 * EDGE).max(0.0));
        let (nx, ny) = ((r.w / CELL).ceil() as usize, (high / CELL).ceil() as usize);
        for i in 0..=nx {
            for j in 0..=ny {
                let at = ((r.x + i as f64 * CELL).min(r.right()), (top + j as f64 * CELL).min(top + high));
                if self.cell(at.0, at.1).and_then(|c| self.taken.get(c)).is_some_and(|t| *t) {
                    cost += 1.0;
                }
            }
        }
        cost
    }

    /// The best of the candidates, the earlier one where two are as good; it is taken. `None` if each lies on a label or outside.
    pub fn place(&mut self, candidates: impl Iterator<Item = Rect>) -> Option<Rect> {
        let mut best: Option<(f64, Rect)> = None;
        for (i, r) in candidates.enumerate() {
            let cost = self.cost(&r) + 0.05 * i as f64;
            if best.as_ref().is_none_or(|b| cost < b.0) {
                best = Some((cost, r));
            }
        }
        let (cost, r) = best?;
        if cost >= 1000.0 {
            return None;
        }
        self.take_label(r);
        Some(r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_avoid_data_and_each_other() {
        let mut room = Room::new(Rect { x: 0.0, y: 0.0, w: 100.0, h: 100.0 });
        room.take_line(&[(0.0, 20.0), (100.0, 20.0)]);
        let at = |y: f64| Rect { x: 10.0, y, w: 40.0, h: 12.0 };
        let spots = [at(12.0), at(40.0), at(44.0), at(70.0), at(95.0)];
        assert_eq!(room.place(spots.into_iter()), Some(at(40.0)));
        assert_eq!(room.place(spots.into_iter()), Some(at(70.0)));
        assert_eq!(room.place(spots.into_iter()), Some(at(12.0)), "data are hidden before labels");
        assert_eq!(room.place(spots.into_iter()), None);
    }
}
