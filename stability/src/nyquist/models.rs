//! The matrix of the loops from the models of a graph: master with its hands, canceller, slave with what it touched, and the delays between them.

use super::eigenloci::Matrix;
use crate::session::{AxisSignals, Session};
use backdrive_control::device::{Device, DeviceOptions, DeviceRole};
use backdrive_nodes::graph::{Connection, DeviceFiles, Graph, NodeKind, Settings};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{InputKind, Output, OutputKind};
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};

/// `L = H_se (G_f - Ĝ_f) e^{-sT}` per unit of mu*lambda at each line, rows and columns by axis, and which axes touched in the session.
pub(super) fn loops(graph: &Graph, session: &Session, hz: &[f64]) -> Result<(Vec<Matrix>, Vec<bool>), String> {
    let settings = |kind: NodeKind| graph.node_of(kind).map(|node| &node.settings);
    let Some(Settings::Scaling { .. }) = settings(NodeKind::Scaling) else {
        return Err("the loop contains a coupling, whose law is more than a gain".to_string());
    };
    let (Some(Settings::Master(master)), Some(Settings::Slave(slave))) = (settings(NodeKind::Master), settings(NodeKind::Slave)) else {
        return Err("the graph has no master or no slave".to_string());
    };
    let period_s = session.period_s;
    let mut motion = master_responses(master, "master", hz, period_s)?;
    match settings(NodeKind::Canceller) {
        Some(Settings::Canceller(_, _, Some(_))) => {
            return Err("the canceller estimates the hand, so it is not a linear part of the loop".to_string());
        }
        Some(Settings::Canceller(files, high_pass_hz, None)) if files.model.is_some() => {
            let predicted = master_responses(files, "canceller", hz, period_s)?;
            for ((motion, predicted), hz) in motion.iter_mut().zip(predicted).zip(hz) {
                *motion -= predicted * high_pass(*high_pass_hz, *hz, period_s);
            }
        }
        _ => {}
    }
    let (contact, touched) = slave_responses(slave, session, hz)?;
    let axes = session.axes.len();
    if motion.iter().chain(&contact).any(|m| m.shape() != (axes, axes)) {
        return Err(format!("the models do not have the {axes} axes of the recording"));
    }
    let late = delay_s(graph)?;
    let round = |((motion, contact), hz): ((&Matrix, &Matrix), &f64)| contact * motion * Complex::new(0.0, -TAU * hz * late).exp();
    Ok((motion.iter().zip(&contact).zip(hz).map(round).collect(), touched))
}

/// From forces that are held over each period to what is measured at its end, m/N and the like.
fn master_responses(files: &DeviceFiles, part: &str, hz: &[f64], period_s: f64) -> Result<Vec<Matrix>, String> {
    let mut model = files.model.clone().ok_or_else(|| format!("{part}: an external program without a model"))?;
    for (index, axis) in model.axes.clone().iter().enumerate().filter(|(_, axis)| !axis.holds_user) {
        if let Some(grip) = &files.fragment {
            model.attach(grip, axis.user, &format!("grip{index}"));
        }
    }
    let inputs: Vec<usize> = model.axes.iter().map(|axis| axis.feedback).collect();
    let outputs: Vec<usize> = model.axes.iter().map(|axis| axis.measured).collect();
    let wrong = |error| format!("{part}: {error}");
    let linear = LinearModel::new(&model, &Operating::small()).map_err(wrong)?;
    let at = |hz: &f64| {
        let mut g = linear.responses(&inputs, &outputs, *hz).map_err(wrong)?;
        let turn = Complex::new(0.0, TAU * hz * period_s);
        let held = (Complex::new(1.0, 0.0) - (-turn).exp()) / turn;
        for (mut row, axis) in g.row_iter_mut().zip(&model.axes) {
            row *= held * axis.scale;
        }
        Ok(g)
    };
    hz.iter().map(at).collect()
}

/// The canceller's first-order high-pass, the bilinear image of s/(s + 2π corner).
fn high_pass(corner_hz: f64, hz: f64, period_s: f64) -> Complex<f64> {
    let one = Complex::new(1.0, 0.0);
    if corner_hz <= 0.0 {
        return one;
    }
    let warped = (PI * corner_hz * period_s).min(1.5).tan();
    let back = Complex::new(0.0, -TAU * hz * period_s).exp();
    (one - back) / (one + warped - back * (1.0 - warped))
}

/// From commands that run in straight lines to the force of what the slave touches, N/m and the like, about where it touched in the session.
fn slave_responses(files: &DeviceFiles, session: &Session, hz: &[f64]) -> Result<(Vec<Matrix>, Vec<bool>), String> {
    let given = files.model.as_ref().ok_or("slave: an external program without a model")?;
    if given.axes.iter().any(|axis| given.inputs[axis.feedback].kind == InputKind::Force) {
        return Err("a controller drives the slave, and its law is not part of the model".to_string());
    }
    let options = DeviceOptions { substeps: files.substeps, ..DeviceOptions::default() };
    let mut device =
        Device::new(given, files.fragment.as_ref(), DeviceRole::Slave, session.period_s, &options).map_err(|e| e.to_string())?;
    let axes = device.axes().min(session.axes.len());
    let mut elements: Vec<usize> = (0..axes).flat_map(|axis| device.touching(axis)).collect();
    elements.sort_unstable();
    elements.dedup();
    if elements.is_empty() {
        return Err("the slave has no environment".to_string());
    }
    let (about, touched) = contact(&mut device, session, &elements)?;
    let mut model = device.model().clone();
    let first = model.outputs.len();
    for element in &elements {
        let kind = OutputKind::Force(vec![*element]);
        let name = format!("contact of {element}");
        model.outputs.push(Output { name, kind, gain: 1.0, delay: 0.0, offset: 0.0, resolution: 0.0, noise: 0.0 });
    }
    let outputs: Vec<usize> = (first..model.outputs.len()).collect();
    let inputs: Vec<usize> = model.axes.iter().map(|axis| axis.feedback).collect();
    let at = Operating { about, ..Operating::small() };
    let wrong = |error| format!("slave: {error}");
    let linear = LinearModel::new(&model, &at).map_err(wrong)?;
    // Of each element's force what it is on the body of each axis that it counts for.
    let on_axes = Matrix::from_fn(model.axes.len(), elements.len(), |axis, e| {
        let counts = device.touching(axis).contains(&elements[e]);
        Complex::new(if counts { linear.force_share(elements[e], model.axes[axis].user) } else { 0.0 }, 0.0)
    });
    let response = |hz: &f64| {
        let turn = PI * hz * session.period_s;
        // A straight line from sample to sample.
        let line = if turn > 0.0 { (turn.sin() / turn).powi(2) } else { 1.0 };
        Ok(&on_axes * linear.responses(&inputs, &outputs, *hz).map_err(wrong)? * Complex::new(line, 0.0))
    };
    Ok((hz.iter().map(response).collect::<Result<Vec<Matrix>, String>>()?, touched))
}

/// Of elements by their index, m or rad.
type Displacements = Vec<(usize, f64)>;

/// Mean displacement across each of these elements while the slave touched with as many axes as it ever did, as its model goes along the session's
/// commands; and which axes these were.
fn contact(device: &mut Device, session: &Session, elements: &[usize]) -> Result<(Displacements, Vec<bool>), String> {
    let touches = |axis: &AxisSignals, row: usize| axis.contact.get(row).is_some_and(|f| f.is_finite() && *f != 0.0);
    let axes_at = |row: usize| session.axes.iter().filter(|axis| touches(axis, row)).count();
    let most = (0..session.len()).map(axes_at).max().unwrap_or(0);
    if most == 0 {
        return Err("the slave was not in contact in the recording, so the loop was open".to_string());
    }
    let mut sums = vec![(0.0, 0usize); elements.len()];
    let mut commands = vec![0.0; session.axes.len()];
    for row in 0..session.len() {
        for (command, axis) in commands.iter_mut().zip(&session.axes) {
            // Where nothing was recorded the slave stays where it is.
            *command = axis.command.get(row).copied().filter(|x| x.is_finite()).unwrap_or(*command);
        }
        if row == 0 {
            device.start(&commands, &[])
        } else {
            device.step(&commands, &[])
        }
        if axes_at(row) == most {
            for ((sum, count), element) in sums.iter_mut().zip(elements) {
                (*sum, *count) = (*sum + device.across(*element), *count + 1);
            }
        }
    }
    let mean = |((sum, count), element): (&(f64, usize), &usize)| (*element, sum / (*count).max(1) as f64);
    let touched = session.axes.iter().map(|axis| (0..session.len()).any(|row| axes_at(row) == most && touches(axis, row))).collect();
    Ok((sums.iter().zip(elements).map(mean).collect(), touched))
}

/// Delay once round the loop, s.
fn delay_s(graph: &Graph) -> Result<f64, String> {
    let kind = |node: usize| graph.nodes.get(node).map(|n| n.kind);
    let in_loop = |c: &&Connection| {
        matches!(
            (kind(c.to.0), c.to.1.as_str()),
            (Some(NodeKind::Canceller), "measured")
                | (Some(NodeKind::Scaling), "motion" | "contact")
                | (Some(NodeKind::Slave), "command")
                | (Some(NodeKind::Master), "force")
        )
    };
    let mut late = 0.0;
    for connection in graph.connections.iter().filter(in_loop) {
        late += connection.delay as f64 * graph.period_s();
        if let Some(impaired) = connection.impairment {
            if impaired.jitter_s > 0.0 || impaired.loss > 0.0 {
                return Err("a connection of the loop has jitter or loses samples, so it is not linear".to_string());
            }
            late += impaired.delay_s;
        }
    }
    Ok(late)
}
