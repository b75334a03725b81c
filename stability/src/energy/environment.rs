//! How stiff slave and environment are together at rest.

use crate::session::AxisSignals;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::linear::{Friction, LinearModel, Operating};
use backdrive_plant::model::{InputKind, OutputKind};
use std::ops::Range;

/// K_e by the models: the force of the environment per commanded metre at DC, about where the slave pressed hardest, N/m.
pub(super) fn environment_stiffness(graph: &Graph, index: usize, signals: &AxisSignals) -> Result<f64, String> {
    let node = graph.node_of(NodeKind::Slave).ok_or("the graph has no slave node")?;
    let Settings::Slave(files) = &node.settings else { return Err("the graph's slave has no settings".to_owned()) };
    let mut model = files.model.clone().ok_or("the slave has no model")?;
    let fragment = files.fragment.as_ref().ok_or("the slave has no environment")?;
    let axis = model.axes.get(index).cloned().ok_or_else(|| format!("the slave's model has no axis {index}"))?;
    if model.inputs.get(axis.feedback).is_some_and(|input| input.kind == InputKind::Force) {
        return Err("the slave is driven by a controller's force, so its stiffness does not follow from its model".to_owned());
    }
    let attached = model.attach(fragment, axis.user, &fragment.network.name);
    let tip = signals.slave.as_ref().unwrap_or(&signals.command);
    let pressed = signals.contact.iter().zip(tip).filter(|(f, x)| f.is_finite() && x.is_finite());
    let at = pressed.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).map_or(0.0, |(_, x)| *x);
    let about = attached.elements.iter().filter_map(|e| match model.elements.get(*e)?.between {
        [Some(body), None] if body == axis.user => Some((*e, at)),
        [None, Some(body)] if body == axis.user => Some((*e, -at)),
        _ => None,
    });
    let operating = Operating { amplitude: 1e-6, frequency_hz: 10.0, friction: Friction::Ignored, about: about.collect() };
    let (first, second) = (attached.port_first.clone(), attached.port_second.clone());
    let start = model.outputs.len();
    for elements in [first, second] {
        model.outputs.push(backdrive_plant::model::Output {
            name: format!("{}.port{}", attached.prefix, model.outputs.len()),
            kind: OutputKind::Force(elements),
            gain: 1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        });
    }
    let linear = LinearModel::new(&model, &operating).map_err(|e| e.to_string())?;
    let at_dc = |output: usize| linear.response(axis.feedback, output, &[0.0]).map_err(|e| e.to_string());
    let value = |responses: Vec<nalgebra::Complex<f64>>| responses.first().map_or(f64::NAN, |r| r.re);
    Ok(value(at_dc(start)?) - value(at_dc(start + 1)?))
}

/// Slope of -F_s over x_c in contact, by least squares, N/m.
pub(crate) fn contact_slope(axis: &AxisSignals, touching: &[Range<usize>]) -> Option<f64> {
    let rows = || touching.iter().flat_map(|r| r.clone());
    let pairs: Vec<(f64, f64)> = rows()
        .filter_map(|row| Some((*axis.command.get(row)?, *axis.contact.get(row)?)))
        .filter(|(x, f)| x.is_finite() && f.is_finite() && *f != 0.0)
        .collect();
    let n = pairs.len() as f64;
    if pairs.len() < 10 {
        return None;
    }
    let (mx, mf) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let xf: f64 = pairs.iter().map(|p| (p.0 - mx) * (p.1 - mf)).sum();
    let xx: f64 = pairs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    (xx > 0.0).then(|| -xf / xx)
}
