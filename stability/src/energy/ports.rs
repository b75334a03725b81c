//! The observers of an axis: the master's port, the slave's, and the channel between them.

use super::master::master_model;
use super::observer::{decimate, observe_held, observe_sampled, rounding, trend};
use super::types::{AxisEnergy, EnergyVerdict, PortEnergy};
use crate::phases::holds;
use crate::session::{AxisSignals, Session};
use backdrive_nodes::graph::Graph;

/// The observers of an axis, and by how much the master's has been below 0 beyond what rounding explains, J; `None` where it never was.
pub(super) fn ports(session: &Session, axis: &AxisSignals, factor: f64) -> (AxisEnergy, Option<f64>) {
    let period_s = session.period_s;
    let rows = session.len();
    let holds = holds(axis, period_s);
    let dither = |row: usize| axis.dither.as_ref().and_then(|d| d.get(row)).copied().filter(|d| d.is_finite()).unwrap_or(0.0);
    let reflected: Vec<f64> = axis.force.iter().enumerate().map(|(row, f)| factor * (f - dither(row))).collect();
    let master = observe_held(&reflected, &axis.master);
    let tip = axis.slave.as_ref().unwrap_or(&axis.command);
    let slave = observe_sampled(&axis.contact, tip);
    let mut two_port = Vec::with_capacity(rows);
    let mut energy = 0.0;
    for row in 0..master.len().min(slave.len()) {
        two_port.push(energy);
        if row + 1 < rows {
            let ratio = session.lambda.get(row).copied().unwrap_or(f64::NAN) / session.mu.get(row).copied().unwrap_or(f64::NAN);
            let taken = master[row + 1] - master[row] - ratio * (slave[row + 1] - slave[row]);
            energy += if taken.is_finite() { taken } else { 0.0 };
        }
    }
    let rounding = rounding(&reflected, axis.resolution);
    let port = |series: &[f64], rounding: &[f64]| PortEnergy {
        final_j: series.last().copied().unwrap_or(0.0),
        minimum_j: series.iter().copied().fold(0.0, f64::min),
        minimum_at_s: series.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map_or(0.0, |(row, _)| row as f64 * period_s),
        rounding_j: rounding.last().copied().unwrap_or(0.0),
        hold: trend(series, &holds, period_s),
        energy_j: decimate(series),
    };
    let dither_work = axis.dither.as_ref().map(|d| {
        let played: Vec<f64> = d.iter().map(|d| factor * d).collect();
        -observe_held(&played, &axis.master).last().copied().unwrap_or(0.0)
    });
    let whole = |row: &usize| {
        let values = [axis.force.get(*row), axis.master.get(*row), axis.contact.get(*row), tip.get(*row)];
        values.iter().all(|v| v.is_some_and(|v| v.is_finite()))
    };
    let found = AxisEnergy {
        name: axis.name.clone(),
        verdict: EnergyVerdict::CannotTell,
        reason: String::new(),
        time_s: decimate(&(0..rows).map(|row| row as f64 * period_s).collect::<Vec<f64>>()),
        master: port(&master, &rounding),
        slave: port(&slave, &[]),
        two_port: port(&two_port, &rounding),
        dither_work_j: dither_work,
        hold_s: holds.iter().map(|h| (h.end - h.start) as f64).sum::<f64>() * period_s,
        missing_rows: (0..rows).filter(|row| !whole(row)).count(),
        elements: Vec::new(),
        model_misfit: None,
        elements_reason: None,
        bounds: None,
        bounds_reason: None,
    };
    let beyond = master.iter().zip(&rounding).map(|(e, r)| -(e + r)).fold(0.0, f64::max);
    (found, (beyond > 0.0).then_some(beyond))
}

/// Work at the motor per N of F_f and m of x_m: 1 where the model's axis measures what its motor moves, in the same unit.
pub(super) fn work_factor(graph: Option<&Graph>, axis: usize) -> f64 {
    let model = graph.and_then(master_model).map(|m| m.0);
    let Some((model, axis)) = model.and_then(|m| m.axes.get(axis).map(|a| (m, a))) else { return 1.0 };
    match (model.inputs.get(axis.feedback), model.outputs.get(axis.measured)) {
        (Some(input), Some(output)) if axis.scale * output.gain != 0.0 => input.gain / (axis.scale * output.gain),
        _ => 1.0,
    }
}
