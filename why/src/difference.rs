//! A place where a recording differs from its graph.

use crate::device::DeviceFound;
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::stage::Impairment;
use backdrive_stability::by_itself::compared::{AsIf, Compared};
use backdrive_stability::by_itself::recorded::Quantity;
use serde::Serialize;

/// A node whose recorded output is not what its recorded inputs make of it.
#[derive(Debug, Clone, Serialize)]
pub struct Difference {
    /// Name of the node.
    pub node: String,
    /// Its kind.
    #[serde(skip)]
    pub kind: NodeKind,
    /// The output's port.
    pub port: String,
    /// Which of its quantities.
    pub quantity: Quantity,
    /// Number of the axis.
    pub axis: usize,
    /// By how much, and what simple thing explains it.
    pub compared: Compared,
    /// Input port that is late, where a delay explains it and the way to that port is where it fits.
    pub way: Option<String>,
    /// The diagnosis of the device, where nothing simple explains it.
    pub device: Option<DeviceFound>,
}

/// A loss above this share is reported beside jitter.
const TOLD_BESIDE_JITTER: f64 = 0.1;

impl Difference {
    /// Impairments of the way to a port besides those in the graph.
    pub fn impairment(&self, period_s: f64, seed: u64) -> Option<Impairment> {
        let s = |rows: usize| rows as f64 * period_s;
        self.way.as_ref()?;
        match self.compared.as_if {
            AsIf::Changed { late, .. } => Some(Impairment { delay_s: s(late), jitter_s: 0.0, loss: 0.0, seed }),
            AsIf::Unsteady { late, jitter, missing } => {
                // Beside jitter a small loss cannot be distinguished from samples that are overtaken.
                let loss = if jitter == 0 || missing > TOLD_BESIDE_JITTER { missing } else { 0.0 };
                Some(Impairment { delay_s: s(late), jitter_s: s(jitter), loss, seed })
            }
            _ => None,
        }
    }
}

/// Gives a way in a graph the delay that was found.
pub fn delay(graph: &mut Graph, node: usize, difference: &Difference) {
    let (period_s, seed) = (graph.period_s(), graph.seed.wrapping_add(7));
    let (Some(port), Some(more)) = (&difference.way, difference.impairment(period_s, seed)) else { return };
    for connection in graph.connections.iter_mut().filter(|c| c.to.0 == node && c.to.1 == *port) {
        let was = connection.impairment.unwrap_or(Impairment { delay_s: 0.0, jitter_s: 0.0, loss: 0.0, seed });
        connection.impairment = Some(Impairment {
            delay_s: was.delay_s + more.delay_s,
            jitter_s: was.jitter_s.max(more.jitter_s),
            loss: was.loss.max(more.loss),
            seed: was.seed,
        });
    }
}

#[cfg(test)]
mod tests;
