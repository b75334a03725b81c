//! Energy: what each port of the loop took and gave, what the master's friction took of it, and the classical bounds.
//!
//! The passivity observer (Hannaford & Ryu 2002) sums the work at a port. At the master's it is the work that the displayed environment
//! takes, `E_m(n) = -sum F_f(k) (x_m(k+1) - x_m(k))`: exact, for F_f is held from k to k+1. At the slave's, where F_s is sampled and
//! not held, the trapezium: `E_s(n) = -sum (F_s(k) + F_s(k+1))/2 (x_s(k+1) - x_s(k))`. Negative: the port has given more than it took.
//!
//! Passivity is sufficient for a stable loop and not necessary: an active port on a master with friction may rest nevertheless.

mod bounds;
mod environment;
mod judge;
mod master;
mod observer;
mod ports;
mod types;

pub use bounds::loop_delay_s;
pub use observer::{observe_held, observe_sampled};
pub use types::{AxisEnergy, Bounds, ElementEnergy, EnergyAnswer, EnergyVerdict, PortEnergy, Trend};

use crate::master_run::{Wanted, run_master};
use crate::phases::{contacts, holds};
use crate::session::Session;
use backdrive_nodes::graph::Graph;
use bounds::bounds;
use judge::judge;
use observer::{decimate, trend};
use ports::{ports, work_factor};

/// The energy method on a session. `graph` is the one that made it, where it is ours: friction and bounds come from its models.
/// `stiffness` is K_e, N/m, where it is known better than from the model: such as from the measured H_se at low frequency.
pub fn energy(session: &Session, graph: Option<&Graph>, stiffness: Option<f64>) -> EnergyAnswer {
    let run = match graph {
        Some(graph) => run_master(session, graph, Wanted { force: true, energy: true }),
        None => Err("there is no model of the master".to_owned()),
    };
    let mut axes = Vec::new();
    for (index, axis) in session.axes.iter().enumerate() {
        let (mut found, beyond_j) = ports(session, axis, work_factor(graph, index));
        let holds = holds(axis, session.period_s);
        match &run {
            Err(reason) => found.elements_reason = Some(reason.clone()),
            Ok(run) => {
                for element in run.taken.iter().filter(|e| e.taken_j.last().is_some_and(|e| *e != 0.0)) {
                    found.elements.push(ElementEnergy {
                        name: element.name.clone(),
                        kind: element.kind.to_owned(),
                        friction: element.friction,
                        final_j: element.taken_j.last().copied().unwrap_or(0.0),
                        hold_w: trend(&element.taken_j, &holds, session.period_s).map(|t| t.mean_w),
                        energy_j: decimate(&element.taken_j),
                    });
                }
                found.model_misfit = run.position.get(index).and_then(|model| misfit(model, &axis.master));
            }
        }
        match bounds(session, axis, index, graph, stiffness) {
            Ok(bounds) => found.bounds = Some(bounds),
            Err(reason) => found.bounds_reason = Some(reason),
        }
        judge(&mut found, beyond_j, !contacts(axis, session.period_s).is_empty());
        axes.push(found);
    }
    let rank = |v: EnergyVerdict| match v {
        EnergyVerdict::Passive => 0,
        EnergyVerdict::CannotTell => 1,
        EnergyVerdict::Active => 2,
    };
    let worst = axes.iter().max_by_key(|a| rank(a.verdict));
    let (verdict, reason) = match worst {
        Some(axis) if axes.len() > 1 => (axis.verdict, format!("axis {}: {}", axis.name, axis.reason)),
        Some(axis) => (axis.verdict, axis.reason.clone()),
        None => (EnergyVerdict::CannotTell, "the session has no axis".to_owned()),
    };
    EnergyAnswer { verdict, reason, axes }
}

fn misfit(model: &[f64], measured: &[f64]) -> Option<f64> {
    let pairs = || model.iter().zip(measured).filter(|(_, x)| x.is_finite());
    let size: f64 = pairs().map(|(_, x)| x * x).sum();
    let gap: f64 = pairs().map(|(m, x)| (m - x).powi(2)).sum();
    (size > 0.0).then(|| (gap / size).sqrt())
}
