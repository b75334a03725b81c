//! The loops of several axes together, computed from the models: the generalised Nyquist criterion.
//!
//! `L(jω)` is the matrix of the loops per unit of gain, from the forces on the master round to the reflected ones, and `k` = μλ. The closed loop is stable
//! where `det(I - k L(jω))` does not wind about 0 from -∞ to ∞; `L` itself is stable, because its parts are. An equivalent condition uses the eigenvalues of
//! `k L`, the eigenloci, which must not encircle +1 taken together (A. MacFarlane and I. Postlethwaite, Int. J. Control 25 (1977) 81-127; proven by C.
//! Desoer and Y.-T. Wang, IEEE Trans. Automatic Control 25 (1980) 187-196). Our sign: a force comes back with its sign, so +1 stands where textbooks have
//! -1.
//!
//! Where an axis is analysed alone, the others open, its loop is the element on the diagonal. **Even if each of these is stable, all of them closed may
//! not be**: the path from one axis to another and back is in none of them. `tests` has a loop whose axes are stable to eight times the gain at which
//! they are not together.
//!
//! The models are linear here, about their pose and about the contact that was recorded; dry friction is left out, whose loss makes a loop more stable.

mod eigenloci;
mod models;
#[cfg(test)]
mod tests;

use crate::frequency::crossing;
use crate::session::Session;
use backdrive_nodes::graph::Graph;
use eigenloci::{Matrix, alone, encirclements, tracked};
use models::loops;
use serde::Serialize;

/// Lines in a decade: closer than the modes of a device are wide.
const LINES: f64 = 300.0;
/// The lowest line, Hz: below what moves in a held device.
const LOWEST_HZ: f64 = 0.02;
/// No larger gain is asked for: what crosses there is rounding.
const LARGEST: f64 = 1e6;
/// A loop per unit of gain below which nothing comes back.
const NOTHING: f64 = 1e-3;
/// An axis alone is no measure of all where it has this many times their gain.
const MISLEADING: f64 = 1.1;

/// Where a loop stops being stable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    /// mu*lambda; `None` where no gain makes it unstable.
    pub critical_gain: Option<f64>,
    /// Hz there; 0 where it runs away without oscillating.
    pub frequency_hz: Option<f64>,
}

/// The answer for all axes and for each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoupledLoops {
    /// All loops closed.
    pub together: Limit,
    /// Each closed alone, the others open: name of the axis and its limit.
    pub alone: Vec<(String, Limit)>,
    /// How often the eigenloci encircle +1 clockwise at the gain asked: the number of unstable poles. 0 where it is stable.
    pub encirclements: i64,
    /// Axes that touched something in the recording; the models are those of that contact.
    pub touched: Vec<String>,
    /// Lines of the eigenloci, Hz; not in files.
    #[serde(skip)]
    pub hz: Vec<f64>,
    /// Of each eigenlocus its real and imaginary part at these lines, per unit of gain; not in files.
    #[serde(skip)]
    pub loci: Vec<Vec<[f64; 2]>>,
}

impl CoupledLoops {
    /// The lowest gain at which an axis alone is at its stability limit; infinite where none is.
    pub fn lowest_alone(&self) -> f64 {
        self.alone.iter().filter_map(|(_, limit)| limit.critical_gain).fold(f64::INFINITY, f64::min)
    }

    /// Whether by the models next to nothing comes back round the loops: the canceller has the very model that the master has, or no force is reflected.
    pub fn is_cancelled(&self) -> bool {
        !self.loci.is_empty() && self.loci.iter().flatten().all(|[re, im]| re.hypot(*im) < NOTHING)
    }

    /// Whether the axes analysed one by one would allow gains at which all together are not stable.
    pub fn alone_misleads(&self) -> bool {
        self.together.critical_gain.is_some_and(|gain| self.lowest_alone() > MISLEADING * gain)
    }
}

/// The loops of a graph in the contact of a session of it, at `gain` = mu*lambda. `None` of a single axis.
///
/// # Errors
/// In a sentence, why the models give no answer.
pub fn coupled_loops(graph: &Graph, session: &Session, gain: f64) -> Result<Option<CoupledLoops>, String> {
    if session.axes.len() < 2 {
        return Ok(None);
    }
    let hz = lines(session.period_s);
    let (l, touched) = loops(graph, session, &hz)?;
    Ok(Some(of_loops(&hz, &l, session, touched, gain)))
}

/// From [`LOWEST_HZ`] to half the rate, evenly in the logarithm.
fn lines(period_s: f64) -> Vec<f64> {
    let highest = 0.5 / period_s;
    let count = (LINES * (highest / LOWEST_HZ).log10()).ceil().max(2.0);
    (0..=count as usize).map(|i| LOWEST_HZ * (highest / LOWEST_HZ).powf(i as f64 / count)).collect()
}

fn of_loops(hz: &[f64], l: &[Matrix], session: &Session, touched: Vec<bool>, gain: f64) -> CoupledLoops {
    let name = |axis: usize| session.axes.get(axis).map_or_else(|| format!("axis {axis}"), |a| a.name.clone());
    let axes = l.first().map_or(0, Matrix::nrows);
    CoupledLoops {
        together: limit(hz, l),
        alone: (0..axes).map(|axis| (name(axis), limit(hz, &alone(l, axis)))).collect(),
        encirclements: encirclements(l, gain),
        loci: tracked(l),
        hz: hz.to_vec(),
        touched: touched.iter().enumerate().filter(|(_, touched)| **touched).map(|(axis, _)| name(axis)).collect(),
    }
}

fn limit(hz: &[f64], l: &[Matrix]) -> Limit {
    let found = crossing(hz, l, &vec![true; hz.len()]).filter(|crossing| crossing.factor < LARGEST);
    Limit { critical_gain: found.map(|c| c.factor), frequency_hz: found.map(|c| c.frequency_hz) }
}
