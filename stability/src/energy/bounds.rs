//! The classical bounds on the stiffness that the master displays.

use super::environment::{contact_slope, environment_stiffness};
use super::master::master_model;
use super::types::Bounds;
use crate::phases::contacts;
use crate::session::{AxisSignals, Session};
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_plant::elements::Role;
use backdrive_plant::elements::Side;
use backdrive_plant::model::{Model, Place};

pub(super) fn bounds(
    session: &Session,
    axis: &AxisSignals,
    index: usize,
    graph: Option<&Graph>,
    stiffness: Option<f64>,
) -> Result<Bounds, String> {
    let graph = graph.ok_or("there is no model of the master")?;
    let (model, grip) = master_model(graph).ok_or("the graph's master has no model")?;
    let place = model.axes.get(index).ok_or_else(|| format!("the master's model has no axis {index}"))?;
    let (Some(input), Some(output)) = (model.inputs.get(place.feedback), model.outputs.get(place.measured)) else {
        return Err("the axis names an input or output that the model does not have".to_owned());
    };
    let touching = contacts(axis, session.period_s);
    let (environment, environment_from) = match stiffness {
        Some(stiffness) => (stiffness, "as given".to_owned()),
        None => environment_stiffness(graph, index, axis)
            .map(|k| (k, "model of slave and environment, where the slave pressed hardest".to_owned()))
            .or_else(|why| {
                let slope = contact_slope(axis, &touching).ok_or(why.clone())?;
                Ok::<_, String>((slope, format!("slope of F_s over x_c in contact ({why})")))
            })?,
    };
    if !(environment.is_finite() && environment > 0.0) {
        return Err(format!("the static stiffness of slave and environment is {environment} N/m: there is no stiff contact to display"));
    }
    let mut gains: Vec<f64> = touching.iter().flat_map(|r| r.clone()).map(|row| gain_at(session, row)).filter(|g| g.is_finite()).collect();
    gains.sort_by(f64::total_cmp);
    let gain = gains.get(gains.len() / 2).copied().ok_or("there was no contact at a known gain")?;

    let mut notes = Vec::new();
    let own = to_ground(model, place.user, &mut notes);
    let grip_damping = match grip.filter(|_| !place.holds_user) {
        None => 0.0,
        Some(grip) => grip.network.elements.iter().map(|e| linear_damping(&e.law)).sum(),
    };
    // K in the units of the motor's body: what it is pushed with per metre that it moves.
    let per_loop = (input.gain * place.scale * output.gain).abs();
    let b = own.damping + model.inputs.iter().filter(|i| i.on == input.on).map(|i| i.back_emf).sum::<f64>();
    let step = output.resolution / output.gain.abs().max(f64::MIN_POSITIVE);
    let period_s = session.period_s;
    let delay_s = loop_delay_s(graph);
    let time = 0.5 * period_s + delay_s;
    let colgate = b / time / per_loop;
    let friction_limit = (step > 0.0).then(|| 2.0 * own.coulomb / step / per_loop);
    let abbott = friction_limit.map_or(colgate, |f| f.min(colgate));
    let displayed = gain * environment;
    if own.coulomb > 0.0 && step == 0.0 {
        notes.push("the sensor is ideal: 2 f_c/Delta is no bound".to_owned());
    }
    Ok(Bounds {
        environment_n_per_m: environment,
        environment_from,
        displayed_n_per_m: displayed,
        damping_ns_per_m: b,
        grip_damping_ns_per_m: grip_damping,
        coulomb_n: own.coulomb,
        encoder_step_m: step,
        delay_s,
        colgate_n_per_m: colgate,
        colgate_gain: colgate / environment,
        colgate_gain_with_grip: (b + grip_damping) / time / per_loop / environment,
        within_colgate: displayed < colgate,
        abbott_n_per_m: abbott,
        abbott_gain: abbott / environment,
        abbott_friction_n_per_m: friction_limit,
        within_abbott: displayed <= abbott,
        notes,
    })
}

fn gain_at(session: &Session, row: usize) -> f64 {
    session.mu.get(row).copied().unwrap_or(f64::NAN) * session.lambda.get(row).copied().unwrap_or(f64::NAN)
}

/// What resists a master against ground.
#[derive(Debug, Clone, Copy, Default)]
struct ToGround {
    damping: f64,
    coulomb: f64,
}

fn linear_damping(law: &backdrive_plant::elements::Law) -> f64 {
    match law.role() {
        Role::Linear(linear) => linear.damping,
        Role::Friction | Role::Path => 0.0,
    }
}

/// Sums over the elements to ground of the bodies that hang together with `user`.
fn to_ground(model: &Model, user: usize, notes: &mut Vec<String>) -> ToGround {
    let mut chain = vec![false; model.bodies.len()];
    if let Some(start) = chain.get_mut(user) {
        *start = true;
    }
    // A chain of n bodies is known after n rounds.
    for _ in 0..model.bodies.len() {
        for element in &model.elements {
            if let [Some(a), Some(b)] = element.between
                && (chain[a] || chain[b])
            {
                (chain[a], chain[b]) = (true, true);
            }
        }
    }
    let mut sum = ToGround::default();
    for element in &model.elements {
        let body: Place = match element.between {
            [Some(body), None] | [None, Some(body)] => Some(body),
            _ => None,
        };
        if !body.and_then(|b| chain.get(b).copied()).unwrap_or(false) {
            continue;
        }
        match element.law.role() {
            Role::Linear(linear) => sum.damping += linear.damping,
            Role::Friction => {
                // At speed, without load.
                let level = |side| element.law.unloaded_level(side, Some(f64::INFINITY));
                sum.coulomb += level(Side::Forwards).min(level(Side::Backwards));
            }
            Role::Path => {
                notes.push(format!("the contribution of {} ({}) to b and f_c is not included", element.name, element.law.kind().name));
            }
        }
    }
    sum
}

/// Delay of the connections round the loop, impairments' fixed delays among them, s.
pub fn loop_delay_s(graph: &Graph) -> f64 {
    let through_canceller =
        graph.connections.iter().any(|c| graph.nodes[c.from.0].kind == NodeKind::Canceller && graph.nodes[c.to.0].kind.closes_loop());
    let in_loop = |kind: NodeKind, port: &str| match (kind, port) {
        (NodeKind::Canceller, "measured") => through_canceller,
        (NodeKind::Coupling, "from_near" | "from_far") => true,
        (NodeKind::Scaling | NodeKind::Coupling, "motion" | "contact") | (NodeKind::Slave, "command" | "force") => true,
        (NodeKind::Controller, "command") | (NodeKind::Master, "force") => true,
        _ => false,
    };
    let loop_connections = graph.connections.iter().filter(|c| in_loop(graph.nodes[c.to.0].kind, &c.to.1));
    loop_connections.map(|c| c.delay as f64 * graph.period_s() + c.impairment.map_or(0.0, |i| i.delay_s)).sum()
}
