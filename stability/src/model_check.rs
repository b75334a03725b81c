//! Do the models in the graph do what the recording shows? Each device is run alone, open loop, on what it was given in
//! the recording, and what it puts out is compared with what was recorded.
//!
//! Open loop, because a closed loop that is stable hides what its parts do wrong, and one that is not multiplies it. A device that differs from its
//! model is the first sign of missing effects; which device it is, is the first step of finding it.

use crate::part_check::{AGREES_WITHIN, PartCheck};
use crate::session::Session;
use backdrive_control::core::{Events, Port, Tick};
use backdrive_msgs::Sample;
use backdrive_nodes::build::{BuildError, plan};
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};

/// Checks the master and the slave of a graph on a session's signals. A device without a model is left out.
///
/// # Errors
/// A device that cannot be built.
pub fn check(graph: &Graph, session: &Session) -> Result<Vec<PartCheck>, BuildError> {
    let mut checks = Vec::new();
    let touching = |axis: usize| {
        let contact = &session.axes[axis].contact;
        move |row: usize| contact.get(row).is_some_and(|f| *f != 0.0)
    };
    if let Some(master) = graph.nodes.iter().find(|n| n.kind == NodeKind::Master)
        && let Settings::Master(DeviceFiles { model: Some(model), real_sensors, .. }) = &master.settings
        && session.axes.iter().all(|a| a.intent.is_some())
    {
        let force: Vec<&[f64]> = session.axes.iter().map(|a| a.force.as_slice()).collect();
        let intent: Vec<&[f64]> = session.axes.iter().map(|a| a.intent.as_deref().unwrap_or_default()).collect();
        let (hand, none) = (Given::Position(&intent), vec![]);
        let with = answer(graph, &master.name, &[hand, Given::Effort(&force)], session)?;
        let without = answer(graph, &master.name, &[hand, Given::Effort(&none)], session)?;
        for (index, axis) in session.axes.iter().enumerate() {
            let output = &model.outputs[model.axes[index].measured];
            let floor =
                if *real_sensors { model.axes[index].scale.abs() * rounding_and_noise(output.resolution, output.noise) } else { 0.0 };
            let (predicted, free): (Vec<f64>, Vec<f64>) =
                (with.iter().map(|s| s.position[index]).collect(), without.iter().map(|s| s.position[index]).collect());
            checks.extend(compare(
                Compared { part: "master", axis: index, quantity: "position", floor },
                touching(index),
                &axis.master,
                &predicted,
                &free,
            ));
        }
    }
    if let Some((place, slave)) = graph.nodes.iter().enumerate().find(|(_, n)| n.kind == NodeKind::Slave)
        && matches!(&slave.settings, Settings::Slave(DeviceFiles { model: Some(_), .. }))
    {
        let way = graph.connections.iter().find(|c| c.to.0 == place && c.to.1 == "command");
        let unsteady = way.and_then(|c| c.impairment).is_some_and(|i| i.jitter_s > 0.0 || i.loss > 0.0);
        let late = way.map_or(0, |c| c.delay + c.impairment.map_or(0, |i| (i.delay_s / session.period_s).round() as u64)) as usize;
        // A controller's force is not determined by the command alone.
        if way.is_some() && !unsteady {
            let command: Vec<Vec<f64>> = session.axes.iter().map(|a| delayed(&a.command, late)).collect();
            let command: Vec<&[f64]> = command.iter().map(Vec::as_slice).collect();
            let out = answer(graph, &slave.name, &[Given::Position(&command)], session)?;
            for (index, axis) in session.axes.iter().enumerate() {
                let predicted: Vec<f64> = out.iter().map(|s| s.effort[index]).collect();
                let nothing = vec![0.0; predicted.len()];
                checks.extend(compare(
                    Compared { part: "slave", axis: index, quantity: "contact force", floor: 0.0 },
                    touching(index),
                    &axis.contact,
                    &predicted,
                    &nothing,
                ));
            }
        }
    }
    checks.extend(force_path(graph, session));
    Ok(checks)
}

/// Whether the reflected force is lambda times the contact force, with the delay of the graph.
fn force_path(graph: &Graph, session: &Session) -> Vec<PartCheck> {
    let Some(scaling) = graph.nodes.iter().position(|n| n.kind == NodeKind::Scaling) else { return Vec::new() };
    let way = |to: &str| graph.connections.iter().find(|c| c.to.1 == to && (c.to.0 == scaling || c.from.0 == scaling));
    let ways = [way("contact"), way("force")];
    if ways.iter().flatten().filter_map(|c| c.impairment).any(|i| i.jitter_s > 0.0 || i.loss > 0.0) {
        return Vec::new();
    }
    let steps =
        |c: &backdrive_nodes::graph::Connection| c.delay + c.impairment.map_or(0, |i| (i.delay_s / session.period_s).round() as u64);
    let late: u64 = ways.iter().flatten().map(|c| steps(c)).sum();
    let mut checks = Vec::new();
    for (index, axis) in session.axes.iter().enumerate() {
        let felt = delayed(&axis.contact, late as usize);
        let dither = |row: usize| axis.dither.as_ref().and_then(|d| d.get(row)).copied().filter(|d| d.is_finite()).unwrap_or(0.0);
        let reflected: Vec<f64> = (0..axis.force.len()).map(|row| axis.force[row] - dither(row)).collect();
        let predicted: Vec<f64> = (0..felt.len()).map(|row| session.lambda.get(row).copied().unwrap_or(f64::NAN) * felt[row]).collect();
        let nothing = vec![0.0; predicted.len()];
        let counts = |row: usize| {
            let clamped = axis.clamped.get(row).copied().unwrap_or(false);
            // Gains are reported only now and then, so a ramp is not known exactly.
            let ramps = session.lambda.get(row) != session.lambda.get(row.saturating_sub(1000));
            felt.get(row).is_some_and(|f| *f != 0.0) && !clamped && !ramps && predicted[row].is_finite()
        };
        let what = Compared { part: "force path", axis: index, quantity: "reflected force", floor: 0.0 };
        checks.extend(compare(what, counts, &reflected, &predicted, &nothing));
    }
    checks
}

/// Standard deviation of the difference of two signals that are each rounded and noisy.
fn rounding_and_noise(resolution: f64, noise: f64) -> f64 {
    (2.0 * (resolution * resolution / 12.0 + noise * noise)).sqrt()
}

fn delayed(signal: &[f64], rows: usize) -> Vec<f64> {
    let first = signal.first().copied().unwrap_or(f64::NAN);
    (0..signal.len()).map(|i| if i < rows { first } else { signal[i - rows] }).collect()
}

/// What goes into an input port: one column per axis, or nothing.
#[derive(Clone, Copy)]
enum Given<'a> {
    Position(&'a [&'a [f64]]),
    Effort(&'a [&'a [f64]]),
}

/// What a node's core puts out on its first port when it is given columns.
fn answer(graph: &Graph, node: &str, given: &[Given], session: &Session) -> Result<Vec<Sample>, BuildError> {
    let mut plan = plan(graph, node)?;
    let mut out = Vec::new();
    let Some(stage) = plan.stages.first_mut() else { return Ok(out) };
    let axes = session.axes.len();
    // A stage has the ports that the graph connects, in the order of its kind.
    let names: Vec<&str> = stage.inputs.iter().map(|p| p.name.as_str()).collect();
    let place = |given: &Given| match given {
        Given::Position(_) => names.iter().position(|n| matches!(*n, "intent" | "command")),
        Given::Effort(_) => names.iter().position(|n| *n == "force"),
    };
    let places: Vec<Option<usize>> = given.iter().map(place).collect();
    let mut events = Events::default();
    let mut outputs: Vec<Sample> = stage.outputs.iter().map(|o| Sample::new(o.axes)).collect();
    let mut ports = vec![Port::EMPTY; names.len()];
    for row in 0..session.len() {
        for (given, place) in given.iter().zip(&places) {
            let Some(place) = place else { continue };
            let mut sample = Sample::new(axes);
            (sample.step, sample.sequence) = (row as u64, row as u64);
            for axis in 0..axes.min(sample.len()) {
                match given {
                    Given::Position(columns) => sample.position[axis] = at(columns, axis, row),
                    Given::Effort(columns) => sample.effort[axis] = columns.get(axis).map_or(0.0, |_| at(columns, axis, row)),
                }
            }
            ports[*place] = Port { sample: Some(sample), age_steps: 0 };
        }
        let tick = Tick { step: row as u64, time_s: row as f64 * session.period_s, period_s: session.period_s };
        outputs.iter_mut().for_each(|o| *o = Sample::new(axes));
        stage.core.step(&tick, &ports, &mut outputs, &mut events);
        drop(events.drain());
        out.push(outputs[0]);
    }
    Ok(out)
}

fn at(columns: &[&[f64]], axis: usize, row: usize) -> f64 {
    columns.get(axis).and_then(|c| c.get(row)).copied().unwrap_or(f64::NAN)
}

struct Compared {
    part: &'static str,
    axis: usize,
    quantity: &'static str,
    floor: f64,
}

/// Compares over the rows in contact; `None` where there are none.
fn compare(what: Compared, counts: impl Fn(usize) -> bool, recorded: &[f64], predicted: &[f64], base: &[f64]) -> Option<PartCheck> {
    let (mut error, mut effect, mut count) = (0.0, 0.0, 0.0);
    for row in (0..recorded.len()).filter(|row| counts(*row)) {
        let (e, x) = (recorded[row] - predicted[row], predicted[row] - base[row]);
        if !recorded[row].is_nan() {
            error += e * e;
            effect += x * x;
            count += 1.0;
        }
    }
    if count == 0.0 {
        return None;
    }
    let (error_rms, effect_rms) = (f64::sqrt(error / count), f64::sqrt(effect / count));
    let agrees = error_rms <= 3.0 * what.floor || error_rms <= AGREES_WITHIN * effect_rms;
    Some(PartCheck {
        part: what.part,
        axis: what.axis,
        quantity: what.quantity,
        error_rms,
        effect_rms,
        floor_rms: what.floor,
        silent: 0,
        span_s: None,
        agrees,
    })
}
