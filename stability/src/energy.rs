//! Energy: what each port of the loop took and gave, what the master's friction took of it, and the classical bounds.
//!
//! The passivity observer (Hannaford & Ryu 2002) sums the work at a port. At the master's it is the work that the displayed environment
//! takes, `E_m(n) = -sum F_f(k) (x_m(k+1) - x_m(k))`: exact, for F_f is held from k to k+1. At the slave's, where F_s is sampled and
//! not held, the trapezium: `E_s(n) = -sum (F_s(k) + F_s(k+1))/2 (x_s(k+1) - x_s(k))`. Negative: the port has given more than it took.
//!
//! Passivity is sufficient for a stable loop and not necessary: an active port on a master with friction may rest all the same.

use crate::master_run::{Wanted, run_master};
use crate::phases::{contacts, holds};
use crate::session::{AxisSignals, Session};
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::elements::{Role, Side};
use backdrive_plant::linear::{Friction, LinearModel, Operating};
use backdrive_plant::model::{InputKind, Model, OutputKind, Place};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;

/// What the energy method says of the session's own gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnergyVerdict {
    /// The displayed environment never gave more than it took and gives nothing while the hand holds still: stable.
    Passive,
    /// It gives energy all the time while the hand holds still.
    Active,
    /// Neither.
    CannotTell,
}

/// The energy method's answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnergyAnswer {
    /// Of the worst axis.
    pub verdict: EnergyVerdict,
    /// Why, in a sentence or two.
    pub reason: String,
    /// One per axis of the session.
    pub axes: Vec<AxisEnergy>,
}

/// Energies of one axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisEnergy {
    /// Name of the axis.
    pub name: String,
    /// Verdict on this axis.
    pub verdict: EnergyVerdict,
    /// Why.
    pub reason: String,
    /// Times of every series below, s; every so many rows, and the last.
    pub time_s: Vec<f64>,
    /// The master's port: what the displayed environment took, without the dither's work.
    pub master: PortEnergy,
    /// The slave's port: what the real environment took.
    pub slave: PortEnergy,
    /// What the channel between them took, at the master's scale: the master's port less (lambda/mu) times the slave's. Ideal: 0.
    pub two_port: PortEnergy,
    /// What the dither put into the master, J; `None` without a dither.
    pub dither_work_j: Option<f64>,
    /// Time in contact while the hand held still, transients left out, s.
    pub hold_s: f64,
    /// Rows without a value, which count as no work.
    pub missing_rows: usize,
    /// What the master's elements took, by the model; empty where that cannot be told.
    pub elements: Vec<ElementEnergy>,
    /// RMS of the model's position against the measured one over the latter's RMS; `None` without a model run.
    pub model_misfit: Option<f64>,
    /// Why there are no elements; `None` where there are.
    pub elements_reason: Option<String>,
    /// The classical bounds; `None` where they cannot be told.
    pub bounds: Option<Bounds>,
    /// Why there are none; `None` where there are.
    pub bounds_reason: Option<String>,
}

/// A passivity observer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PortEnergy {
    /// At the end, J.
    pub final_j: f64,
    /// Least, J.
    pub minimum_j: f64,
    /// When, s.
    pub minimum_at_s: f64,
    /// What the position sensor's rounding may have made of it by the end, J (three standard deviations of independent roundings).
    pub rounding_j: f64,
    /// Its trend while the hand held still in contact; `None` without such a hold.
    pub hold: Option<Trend>,
    /// By [`AxisEnergy::time_s`], J.
    pub energy_j: Vec<f64>,
}

/// A mean power and its 95 % interval, W.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trend {
    /// Mean, W (J/s).
    pub mean_w: f64,
    /// Half the width of its interval, from the scatter of eight pieces of the hold, W.
    pub half_width_w: f64,
}

/// What an element of the master took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementEnergy {
    /// Name in the model.
    pub name: String,
    /// Kind in the model.
    pub kind: String,
    /// Whether it is dry friction or hysteresis, not a damper.
    pub friction: bool,
    /// At the end, J.
    pub final_j: f64,
    /// While the hand held still in contact, W; `None` without such a hold.
    pub hold_w: Option<f64>,
    /// By [`AxisEnergy::time_s`], J.
    pub energy_j: Vec<f64>,
}

/// Bounds on the stiffness that the master displays at DC, K = mu lambda K_e.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// Static stiffness of slave and environment, K_e = -dF_s/dx_c, N/m.
    pub environment_n_per_m: f64,
    /// Where it is from.
    pub environment_from: String,
    /// K at the session's gain, N/m.
    pub displayed_n_per_m: f64,
    /// Viscous damping of the master's own elements to ground, back-EMF among them, b, N s/m.
    pub damping_ns_per_m: f64,
    /// That of the grip, N s/m: it is not in b.
    pub grip_damping_ns_per_m: f64,
    /// Coulomb friction of the master's own elements to ground, f_c, N.
    pub coulomb_n: f64,
    /// Step of the position sensor, Delta, m.
    pub encoder_step_m: f64,
    /// Delay of the loop beyond the hold's T/2, t_d, s: of the connections; the slave's own lag comes on top.
    pub delay_s: f64,
    /// Colgate & Schenkel 1997, b > K (T/2 + t_d) + |B| with B = 0: the largest K, N/m.
    pub colgate_n_per_m: f64,
    /// The gain mu*lambda that it allows.
    pub colgate_gain: f64,
    /// The same with the grip's damping added to b.
    pub colgate_gain_with_grip: f64,
    /// Whether the session's gain is within.
    pub within_colgate: bool,
    /// Abbott & Okamura 2005, K <= min(2 b/(T + 2 t_d), 2 f_c/Delta): the largest K, N/m.
    pub abbott_n_per_m: f64,
    /// The gain mu*lambda that it allows.
    pub abbott_gain: f64,
    /// 2 f_c/Delta alone, N/m; `None` for an ideal sensor, where it is no bound.
    pub abbott_friction_n_per_m: Option<f64>,
    /// Whether the session's gain is within.
    pub within_abbott: bool,
    /// What to know beside them.
    pub notes: Vec<String>,
}

/// Points of a plotted series, about.
const POINTS: usize = 1000;
/// Pieces of the holds, from whose scatter a trend's interval comes.
const PIECES: usize = 8;

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

/// A passivity observer over a record: energy at each row, the first being 0.
///
/// `force` is held from its row to the next; what is not a number does no work.
pub fn observe_held(force: &[f64], position: &[f64]) -> Vec<f64> {
    observe(force, position, |now, _| now)
}

/// The same for a force that is sampled and not held.
pub fn observe_sampled(force: &[f64], position: &[f64]) -> Vec<f64> {
    observe(force, position, |now, next| 0.5 * (now + next))
}

fn observe(force: &[f64], position: &[f64], mean: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let mut energy = 0.0;
    let rows = force.len().min(position.len());
    let mut series = Vec::with_capacity(rows);
    for row in 0..rows {
        series.push(energy);
        if row + 1 < rows {
            let work = -mean(force[row], force[row + 1]) * (position[row + 1] - position[row]);
            energy += if work.is_finite() { work } else { 0.0 };
        }
    }
    series
}

/// Work at the motor per N of F_f and m of x_m: 1 where the model's axis measures what its motor moves, in the same unit.
fn work_factor(graph: Option<&Graph>, axis: usize) -> f64 {
    let model = graph.and_then(master_model).map(|m| m.0);
    let Some((model, axis)) = model.and_then(|m| m.axes.get(axis).map(|a| (m, a))) else { return 1.0 };
    match (model.inputs.get(axis.feedback), model.outputs.get(axis.measured)) {
        (Some(input), Some(output)) if axis.scale * output.gain != 0.0 => input.gain / (axis.scale * output.gain),
        _ => 1.0,
    }
}

fn master_model(graph: &Graph) -> Option<(&Model, Option<&backdrive_plant::model::Fragment>)> {
    match &graph.node_of(NodeKind::Master)?.settings {
        Settings::Master(files) => files.model.as_ref().map(|model| (model, files.fragment.as_ref())),
        _ => None,
    }
}

/// The observers of an axis, and by how much the master's has been below 0 beyond what rounding explains, J; `None` where it never was.
fn ports(session: &Session, axis: &AxisSignals, factor: f64) -> (AxisEnergy, Option<f64>) {
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

/// What rounding the position to `step` may have done to the observer of a held force by each row: summing by parts, the roundings
/// e(k) enter as -F(n) e(n+1) + F(0) e(0) + sum e(k) (F(k) - F(k-1)), each with a standard deviation of step/sqrt(12). J.
fn rounding(force: &[f64], step: f64) -> Vec<f64> {
    let (mut squares, mut before, first) = (0.0, f64::NAN, force.iter().copied().find(|f| f.is_finite()).unwrap_or(0.0));
    force
        .iter()
        .map(|now| {
            if now.is_finite() {
                if before.is_finite() {
                    squares += (now - before) * (now - before);
                }
                before = *now;
            }
            let ends = if before.is_finite() { before * before + first * first } else { 0.0 };
            3.0 * step / 12.0_f64.sqrt() * (squares + ends).sqrt()
        })
        .collect()
}

/// Mean power over pieces of equal length of all holds, with its 95 % interval (Student).
fn trend(series: &[f64], holds: &[Range<usize>], period_s: f64) -> Option<Trend> {
    let whole: usize = holds.iter().map(|h| h.end - h.start).sum();
    let length = whole / PIECES;
    if length < 2 {
        return None;
    }
    let mut powers = Vec::new();
    for hold in holds {
        let mut from = hold.start;
        while from + length < hold.end.min(series.len()) {
            powers.push((series[from + length] - series[from]) / (length as f64 * period_s));
            from += length;
        }
    }
    let n = powers.len() as f64;
    if powers.len() < 3 {
        return None;
    }
    let mean_w = powers.iter().sum::<f64>() / n;
    let variance = powers.iter().map(|p| (p - mean_w).powi(2)).sum::<f64>() / (n - 1.0);
    let quantile = StudentsT::new(0.0, 1.0, n - 1.0).map_or(2.5, |t| t.inverse_cdf(0.975));
    Some(Trend { mean_w, half_width_w: quantile * (variance / n).sqrt() })
}

fn judge(axis: &mut AxisEnergy, beyond_j: Option<f64>, touched: bool) {
    const MAY_REST: &str = "passivity is sufficient and not necessary: friction may still bring the master to rest";
    let friction: f64 = axis.elements.iter().filter(|e| e.friction).filter_map(|e| e.hold_w).sum();
    let gives = |hold: &Trend| hold.mean_w + hold.half_width_w < 0.0 && -hold.mean_w * axis.hold_s > axis.master.rounding_j;
    (axis.verdict, axis.reason) = match (touched, axis.master.hold, beyond_j) {
        (false, ..) => (EnergyVerdict::CannotTell, "nothing was touched".to_owned()),
        (_, Some(hold), _) if gives(&hold) => {
            let all: f64 = axis.elements.iter().filter_map(|e| e.hold_w).sum();
            let taken = if all > 0.0 {
                format!(
                    " (by the model its elements take {} there, dry friction and hysteresis {} of it)",
                    in_unit(all, "W"),
                    in_unit(friction, "W")
                )
            } else {
                String::new()
            };
            let power = -hold.mean_w;
            (
                EnergyVerdict::Active,
                format!("the displayed environment gives {} while the hand holds still{taken}; {MAY_REST}", in_unit(power, "W")),
            )
        }
        (_, Some(_), None) => {
            let reason = "the displayed environment never gave more than it took, and gives nothing while the hand holds still";
            (EnergyVerdict::Passive, reason.to_owned())
        }
        (_, hold, beyond) => {
            let gave = beyond
                .map_or("never gave more than it took".to_owned(), |j| format!("at times gave {} more than it took", in_unit(j, "J")));
            let held = if hold.is_some() { "gives none while the hand holds still" } else { "the hand never held still in contact" };
            (EnergyVerdict::CannotTell, format!("the displayed environment {gave}, but {held}; {MAY_REST}"))
        }
    };
}

/// A power or an energy with three digits and the prefix that suits it.
fn in_unit(value: f64, unit: &str) -> String {
    let (factor, prefix) = match value.abs() {
        x if x >= 1.0 => (1.0, ""),
        x if x >= 1e-3 => (1e3, "m"),
        _ => (1e6, "µ"),
    };
    format!("{:.3} {prefix}{unit}", factor * value)
}

fn misfit(model: &[f64], measured: &[f64]) -> Option<f64> {
    let pairs = || model.iter().zip(measured).filter(|(_, x)| x.is_finite());
    let size: f64 = pairs().map(|(_, x)| x * x).sum();
    let gap: f64 = pairs().map(|(m, x)| (m - x).powi(2)).sum();
    (size > 0.0).then(|| (gap / size).sqrt())
}

fn decimate(series: &[f64]) -> Vec<f64> {
    let every = series.len().div_ceil(POINTS).max(1);
    let mut points: Vec<f64> = series.iter().step_by(every).copied().collect();
    if let Some(last) = series.last().filter(|_| !(series.len() - 1).is_multiple_of(every)) {
        points.push(*last);
    }
    points
}

fn bounds(session: &Session, axis: &AxisSignals, index: usize, graph: Option<&Graph>, stiffness: Option<f64>) -> Result<Bounds, String> {
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
        return Err(format!("the static stiffness of slave and environment is {environment} N/m: there is no wall to display"));
    }
    let mut gains: Vec<f64> = touching.iter().flat_map(|r| r.clone()).map(|row| gain_at(session, row)).filter(|g| g.is_finite()).collect();
    gains.sort_by(f64::total_cmp);
    let gain = gains.get(gains.len() / 2).copied().ok_or("nothing was touched at a known gain")?;

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
                notes.push(format!("what {} ({}) adds to b and f_c is not counted", element.name, element.law.kind().name));
            }
        }
    }
    sum
}

/// Delay of the connections round the loop, impairments' fixed delays among them, s.
pub fn loop_delay_s(graph: &Graph) -> f64 {
    let through_canceller = graph
        .connections
        .iter()
        .any(|c| graph.nodes[c.from.0].kind == NodeKind::Canceller && graph.nodes[c.to.0].kind == NodeKind::Scaling);
    let in_loop = |kind: NodeKind, port: &str| match (kind, port) {
        (NodeKind::Canceller, "measured") => through_canceller,
        (NodeKind::Scaling, "motion" | "contact") | (NodeKind::Slave, "command" | "force") => true,
        (NodeKind::Controller, "command") | (NodeKind::Master, "force") => true,
        _ => false,
    };
    let loop_connections = graph.connections.iter().filter(|c| in_loop(graph.nodes[c.to.0].kind, &c.to.1));
    loop_connections.map(|c| c.delay as f64 * graph.period_s() + c.impairment.map_or(0.0, |i| i.delay_s)).sum()
}

/// K_e by the models: the force of the environment per commanded metre at DC, about where the slave pressed hardest, N/m.
fn environment_stiffness(graph: &Graph, index: usize, signals: &AxisSignals) -> Result<f64, String> {
    let node = graph.node_of(NodeKind::Slave).ok_or("the graph has no slave node")?;
    let Settings::Slave(files) = &node.settings else { return Err("the graph's slave has no settings".to_owned()) };
    let mut model = files.model.clone().ok_or("the slave has no model")?;
    let fragment = files.fragment.as_ref().ok_or("the slave has no environment")?;
    let axis = model.axes.get(index).cloned().ok_or_else(|| format!("the slave's model has no axis {index}"))?;
    if model.inputs.get(axis.feedback).is_some_and(|input| input.kind == InputKind::Force) {
        return Err("the slave is driven by a controller's force, and how stiff that holds it is not told from its model".to_owned());
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

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::elements::{HystereticSpring, PathLaw};

    /// A wall of stiffness k, sampled every T and held, and a hand that moves by x(t): over closed cycles the wall gives exactly
    /// k/2 sum (dx)^2, which is k T/2 times the integral of v^2 but for terms of order T^2.
    #[test]
    fn a_sampled_wall_gives_k_t_half_v_squared() {
        let (k, period_s, hz, amplitude, cycles) = (2000.0, 1e-3, 3.0, 4e-3, 6);
        let w = 2.0 * std::f64::consts::PI * hz;
        let rows = (f64::from(cycles) / hz / period_s).round() as usize;
        let x: Vec<f64> = (0..=rows).map(|i| amplitude * (w * i as f64 * period_s).sin()).collect();
        let force: Vec<f64> = x.iter().map(|x| -k * x).collect();
        let end = *observe_held(&force, &x).last().unwrap();
        let exact = -0.5 * k * x.windows(2).map(|p| (p[1] - p[0]).powi(2)).sum::<f64>();
        assert!((end - exact).abs() < 1e-12, "{end} {exact}");
        let formula = -k * period_s / 2.0 * (amplitude * w).powi(2) / 2.0 * f64::from(cycles) / hz;
        assert!((end / formula - 1.0).abs() < 1e-4, "{end} {formula}");
        // The trapezium is exact for a spring: a port that is sampled and not held neither takes nor gives.
        assert!(observe_sampled(&force, &x).last().unwrap().abs() < 1e-12);
        // A damper of K T/2 in the master takes just that: Colgate's bound.
        let damper: Vec<f64> = x.windows(2).map(|p| k * period_s / 2.0 * ((p[1] - p[0]) / period_s).powi(2) * period_s).collect();
        assert!((end + damper.iter().sum::<f64>()).abs() < 1e-12);
    }

    /// Check 6 of the main paper: beyond x* = (f_n - f_p)/(k_p - k_n), where the two lines of the hysteretic spring cross, a cycle
    /// gives energy. The observer at its port shows it, and the place where the loop's sign turns is x*.
    #[test]
    fn a_hysteretic_spring_beyond_its_crossing_is_seen_to_give_energy() {
        let (kp, kn, fp, fn_, gamma) = (3900.0, 4000.0, 0.465, -0.465, 8500.0);
        let law = HystereticSpring {
            stiffness_positive: kp,
            stiffness_negative: kn,
            offset_positive: fp,
            offset_negative: fn_,
            bandwidth: gamma,
        };
        // Energy that a cycle of 1 mm about a place takes, by the observer, once it is steady.
        let cycle = |about: f64| {
            let mut memory = vec![0.0; law.memory_len()];
            let steps = 8000;
            let x = |i: usize| about * (i as f64 / 1000.0).min(1.0) + 1e-3 * (2.0 * std::f64::consts::PI * i as f64 / steps as f64).sin();
            let (mut position, mut force) = (Vec::new(), Vec::new());
            let mut before = 0.0;
            for i in 0..4 * steps {
                let now = x(i);
                law.advance(&mut memory, before, now, 1e-4);
                force.push(-law.force(&memory, now, 0.0));
                position.push(now);
                before = now;
            }
            let energy = observe_sampled(&force, &position);
            energy[4 * steps - 1] - energy[3 * steps - 1]
        };
        let crossing = (fn_ - fp) / (kp - kn);
        assert!((crossing - 9.3e-3).abs() < 1e-12);
        assert!(cycle(0.7 * crossing) > 0.0 && cycle(11e-3) < -1e-5, "{} {}", cycle(0.7 * crossing), cycle(11e-3));
        let (mut low, mut high) = (0.7 * crossing, 1.3 * crossing);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if cycle(middle) > 0.0 { low = middle } else { high = middle }
        }
        assert!((low / crossing - 1.0).abs() < 0.01, "{low} instead of {crossing}");
    }

    #[test]
    fn rounding_is_seen_and_not_taken_for_energy() {
        let step = 2e-6;
        let round = |x: f64| (x / step).round() * step;
        let x: Vec<f64> = (0..20_000).map(|i| 1e-3 + 1e-5 * (i as f64 * 0.0137).sin()).collect();
        let force: Vec<f64> = x.iter().enumerate().map(|(i, _)| -1.0 - 0.01 * (i as f64 * 0.311).cos()).collect();
        let rounded: Vec<f64> = x.iter().map(|x| round(*x)).collect();
        let (exact, seen) = (observe_held(&force, &x), observe_held(&force, &rounded));
        let allowed = rounding(&force, step);
        let beyond = exact.iter().zip(&seen).zip(&allowed).filter(|((e, s), a)| (*e - *s).abs() > **a).count();
        assert!(beyond * 100 < exact.len(), "{beyond}");
        assert!(*allowed.last().unwrap() < 1e-3 * 1.0 * 1e-2, "the allowance is no blank cheque: {}", allowed.last().unwrap());
    }

    #[test]
    fn a_trend_has_an_interval() {
        let series: Vec<f64> = (0..8000).map(|i| -2e-3 * i as f64 * 1e-3 + 1e-5 * (i as f64 * 0.3).sin()).collect();
        let found = trend(&series, &[1000..4000, 5000..8000], 1e-3).unwrap();
        assert!((found.mean_w + 2e-3).abs() < 3.0 * found.half_width_w && found.half_width_w < 1e-4, "{found:?}");
        assert_eq!(trend(&series, &[], 1e-3), None);
    }
}
