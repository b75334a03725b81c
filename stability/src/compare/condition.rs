//! What the link and the hand do in a comparison.

use backdrive_nodes::graph::Graph;
use backdrive_nodes::stage::Impairment;
use serde::Serialize;

/// What is varied; everything else is as in the comparison's middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Varied {
    /// The delay of the link.
    Delay,
    /// A delay that varies.
    Jitter,
    /// Packets are lost.
    Loss,
    /// How firm the hand holds the master.
    Grip,
}

/// What the link and the hand do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Condition {
    /// What is varied.
    pub varied: Varied,
    /// Mean delay of each way, s.
    pub delay_s: f64,
    /// Largest deviation from the mean, evenly distributed, s.
    pub jitter_s: f64,
    /// Share of the packets that are lost, 0 to 1, each way.
    pub loss: f64,
    /// Factor on stiffness and damping of the grip.
    pub grip_scale: f64,
}

impl Condition {
    /// Constant delay, no loss, unchanged grip.
    pub fn delay(delay_s: f64) -> Condition {
        Condition { varied: Varied::Delay, delay_s, jitter_s: 0.0, loss: 0.0, grip_scale: 1.0 }
    }

    /// In a few words.
    pub fn text(&self) -> String {
        let delay = format!("{:.0} ms", 1e3 * self.delay_s);
        match self.varied {
            Varied::Delay => delay,
            Varied::Jitter => format!("{:.0} +- {:.0} ms", 1e3 * self.delay_s, 1e3 * self.jitter_s),
            Varied::Loss => format!("{delay}, {:.0} % lost", 100.0 * self.loss),
            Varied::Grip => format!("{delay}, grip x {}", self.grip_scale),
        }
    }

    /// Lets the link of a graph's coupling do it.
    pub(super) fn impair(&self, graph: &mut Graph) {
        let impairment = Impairment {
            delay_s: (self.delay_s - self.jitter_s).max(0.0),
            jitter_s: 2.0 * self.jitter_s,
            loss: self.loss,
            seed: graph.seed,
        };
        let ideal = self.delay_s == 0.0 && self.jitter_s == 0.0 && self.loss == 0.0;
        graph.impair_link((!ideal).then_some(impairment));
    }
}
