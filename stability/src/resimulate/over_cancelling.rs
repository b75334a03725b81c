//! Whether the canceller subtracts more at rest than the force puts in: then the loop runs away without oscillating.
//!
//! Kuchenbecker & Niemeyer's canceller subtracts Ghat_f F_f. Where the real grip is firmer than its model assumes,
//! |Ghat(0)| > |G(0)|, the loop becomes positive feedback at DC, and its limit is
//! `mu lambda = 1 / [K_e (|Ghat(0)| - |G(0)|)]` with K_e the static stiffness of slave and environment in series.

use super::edge::{Edge, Search, edge};
use super::{ResimulateError, RunOptions, Scenario};
use crate::outcome::Outcome;
use crate::resimulate::grip;
use backdrive_control::device::{Device, DeviceOptions, DeviceRole};
use backdrive_nodes::graph::{DeviceFiles, NodeKind, Settings};
use backdrive_plant::linear::{LinearError, LinearModel, Operating};
use std::sync::atomic::AtomicBool;

/// Amplitude at which "large" is evaluated, as a share of the travel: hysteresis and presliding show their soft side.
const LARGE_SHARE: f64 = 0.01;
/// The same where a device has no travel, m or rad.
const LARGE: f64 = 1e-3;
/// Over-cancelling that matters only beyond this mu*lambda is not worth a warning.
const HIGHEST: f64 = 50.0;

/// One grip, one axis, one amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticBalance {
    /// Name of the axis.
    pub axis: String,
    /// Factor on the master's grip.
    pub scale: f64,
    /// Amplitude across elements that are not linear, m or rad.
    pub amplitude: f64,
    /// |G(0)|: m/N or rad/(N m) of the master with this grip; infinite where nothing holds it.
    pub master: f64,
    /// |Ghat(0)| of the canceller's model with the grip it assumes.
    pub model: f64,
    /// The mu*lambda beyond which the loop runs away; `None` where the canceller does not subtract too much.
    pub dc_limit: Option<f64>,
}

/// What the canceller does at rest, over the grips.
#[derive(Debug, Clone)]
pub struct OverCancelling {
    /// K_e, static stiffness from the slave's command to the contact force, per axis, N/m or N m/rad, at the depth of the scenario's own push; 0 on
    /// an axis that touches nothing.
    pub environment_stiffness: Vec<f64>,
    /// Every grip at a small and a large amplitude; empty without a canceller, and with a high-pass, which takes nothing out at rest.
    pub balances: Vec<StaticBalance>,
    /// The verdict at the gain asked for each grip that over-cancels there, with its growth per second.
    pub at_asked: Vec<(f64, Outcome)>,
    /// What the user has to know, where there is something.
    pub warning: Option<String>,
}

/// Compares the canceller's model with the master at rest, for every grip.
///
/// # Errors
/// A device that cannot be simulated or linearised; `cancel` was set.
pub fn over_cancelling(
    scenario: &Scenario,
    scales: &[f64],
    asked: Option<f64>,
    options: &RunOptions,
    cancel: &AtomicBool,
) -> Result<OverCancelling, ResimulateError> {
    let environment_stiffness = environment_stiffness(scenario, options, cancel)?;
    let none =
        OverCancelling { environment_stiffness: environment_stiffness.clone(), balances: Vec::new(), at_asked: Vec::new(), warning: None };
    let graph = scenario.graph();
    let settings = |kind: NodeKind| graph.node_of(kind).map(|n| &n.settings);
    let (Some(Settings::Master(master)), Some(Settings::Canceller(canceller, high_pass_hz, hand))) =
        (settings(NodeKind::Master), settings(NodeKind::Canceller))
    else {
        return Ok(none);
    };
    // A canceller that estimates the hand does not assume a grip.
    if canceller.model.is_none() || *high_pass_hz > 0.0 || hand.is_some() {
        return Ok(none);
    }
    let mut every: Vec<f64> = scales.to_vec();
    if !every.contains(&1.0) {
        every.push(1.0);
    }
    every.sort_by(f64::total_cmp);
    let mut balances = Vec::new();
    for scale in &every {
        let mut held = master.clone();
        if let Some(grip) = &mut held.fragment {
            grip::scale(grip, *scale);
        }
        for (axis, stiffness) in environment_stiffness.iter().enumerate() {
            let travel = held.model.as_ref().and_then(|m| m.axes.get(axis)).and_then(|a| a.travel);
            let large = travel.map_or(LARGE, |[low, high]| LARGE_SHARE * (high - low));
            for amplitude in [Operating::small().amplitude, large] {
                let real = compliance(&held, axis, amplitude).map_err(|error| ResimulateError::Linear { what: "the master", error })?;
                let model = compliance(canceller, axis, amplitude)
                    .map_err(|error| ResimulateError::Linear { what: "the canceller's model", error })?;
                let excess = stiffness * (model - real);
                // What rounding leaves of two equal models is none.
                let dc_limit = (excess > 1e-9 * stiffness * real).then(|| 1.0 / excess);
                let axis = graph.node_of(NodeKind::Master).and_then(|n| n.axis_names.get(axis).cloned()).unwrap_or_default();
                balances.push(StaticBalance { axis, scale: *scale, amplitude, master: real, model, dc_limit });
            }
        }
    }
    let mut at_asked = Vec::new();
    for scale in &every {
        let limit = lowest_limit(balances.iter().filter(|b| b.scale == *scale));
        if let (Some(asked), Some(limit)) = (asked, limit)
            && asked > limit
        {
            let options = RunOptions { grip_scale: *scale, keep_signals: false, ..*options };
            at_asked.push((*scale, scenario.run(scenario.gain(asked), &options, cancel)?.outcome));
        }
    }
    let warning = warning(&balances, &at_asked);
    Ok(OverCancelling { environment_stiffness, balances, at_asked, warning })
}

fn lowest_limit<'a>(balances: impl Iterator<Item = &'a StaticBalance>) -> Option<f64> {
    balances.filter_map(|b| b.dc_limit).min_by(f64::total_cmp)
}

fn warning(balances: &[StaticBalance], at_asked: &[(f64, Outcome)]) -> Option<String> {
    let at = |scale: f64| lowest_limit(balances.iter().filter(|b| b.scale == scale)).filter(|limit| *limit < HIGHEST);
    let seen = |scale: f64| match at_asked.iter().find(|(s, _)| *s == scale) {
        Some((_, Outcome::Unstable { growth_per_s })) => format!("; at the requested gain it grows by {growth_per_s:.2} per second"),
        Some((_, outcome)) => format!("; at the requested gain: {outcome}"),
        None => String::new(),
    };
    if let Some(limit) = at(1.0) {
        return Some(format!(
            "the master with its grip is stiffer than the canceller assumes, so the canceller subtracts too much at rest: above mu*lambda \
             = {limit:.3} the loop diverges without oscillating{}",
            seen(1.0)
        ));
    }
    let scale = balances.iter().map(|b| b.scale).filter(|s| *s > 1.0 && at(*s).is_some()).min_by(f64::total_cmp)?;
    let limit = at(scale)?;
    Some(format!(
        "a grip {:.0} % stiffer would be stiffer than the canceller assumes, which would subtract too much at rest: above mu*lambda = \
         {limit:.3} the loop would diverge without oscillating{}",
        (scale - 1.0) * 100.0,
        seen(scale)
    ))
}

/// |x_m/F_f| at rest, m/N: infinite where nothing holds the device.
pub(super) fn compliance(files: &DeviceFiles, axis: usize, amplitude: f64) -> Result<f64, LinearError> {
    let Some(mut model) = files.model.clone() else { return Ok(0.0) };
    let axes = model.axes.clone();
    if let Some(fragment) = &files.fragment {
        for axis in axes.iter().filter(|a| !a.holds_user) {
            model.attach(fragment, axis.user, "grip");
        }
    }
    let Some(axis) = axes.get(axis) else { return Ok(0.0) };
    let linear = LinearModel::new(&model, &Operating::amplitude(amplitude))?;
    match linear.response(axis.feedback, axis.measured, &[0.0]) {
        Ok(response) => Ok(response.first().map_or(0.0, |g| (g * axis.scale).norm())),
        Err(LinearError::Infinite { .. }) => Ok(f64::INFINITY),
        Err(error) => Err(error),
    }
}

/// Time for the slave to come to rest after a command that has stopped, s.
const REST_S: f64 = 0.5;

/// K_e per axis: how much more the environment pushes when the command goes a little deeper, at rest, at the depth of the push.
fn environment_stiffness(scenario: &Scenario, options: &RunOptions, cancel: &AtomicBool) -> Result<Vec<f64>, ResimulateError> {
    let graph = scenario.graph();
    let run = scenario.run(scenario.own_gain(), &RunOptions { keep_signals: true, ..*options }, cancel)?;
    let (Some(session), Some(Settings::Slave(files))) = (run.signals, graph.node_of(NodeKind::Slave).map(|n| &n.settings)) else {
        return Ok(Vec::new());
    };
    let Some(model) = &files.model else { return Ok(vec![0.0; session.axes.len()]) };
    let device_options = DeviceOptions { substeps: files.substeps, noise_seed: None, quantise: false };
    let period_s = graph.period_s();
    let slave = Device::new(model, files.fragment.as_ref(), DeviceRole::Slave, period_s, &device_options)
        .map_err(|error| ResimulateError::Device { what: "the slave", error })?;
    let push = |axis: &crate::session::AxisSignals| {
        let still = |k: &usize| axis.intent.as_ref().is_none_or(|x| *k > 0 && x[*k] == x[*k - 1]);
        let mut depths: Vec<f64> = (0..axis.contact.len())
            .filter(|k| axis.contact[*k] != 0.0 && axis.command[*k].is_finite() && still(k))
            .map(|k| axis.command[k])
            .collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied()
    };
    let depths: Vec<Option<f64>> = session.axes.iter().map(push).collect();
    let commands: Vec<f64> = depths.iter().map(|d| d.unwrap_or(0.0)).collect();
    let rest = |slave: &mut Device, from: &[f64], to: &[f64]| {
        let steps = (REST_S / period_s).ceil().max(1.0) as usize;
        for step in 1..=2 * steps {
            let share = (step as f64 / steps as f64).min(1.0);
            let command: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect();
            slave.step(&command, &[]);
        }
    };
    let mut pushed = slave.clone();
    let zero = vec![0.0; commands.len()];
    pushed.start(&zero, &[]);
    rest(&mut pushed, &zero, &commands);
    let stiffness = |axis: usize| {
        let Some(depth) = depths[axis] else { return 0.0 };
        // A thousandth of the way to where it pushes.
        let step = (1e-3 * depth.abs()).max(1e-6);
        let force = |by: f64| {
            let mut moved = pushed.clone();
            let mut command = commands.clone();
            command[axis] += by;
            rest(&mut moved, &commands, &command);
            moved.port_force(axis)
        };
        let k = -(force(step) - force(-step)) / (2.0 * step);
        if k.is_finite() { k.max(0.0) } else { 0.0 }
    };
    Ok((0..commands.len().min(slave.axes())).map(stiffness).collect())
}

/// The canceller beside none.
#[derive(Debug, Clone)]
pub struct AgainstNone {
    /// The stability limit without a canceller.
    pub without: Edge,
    /// Where the canceller makes it worse.
    pub warning: Option<String>,
}

/// Whether the canceller raises the stability limit at all: a wrong model can make the loop worse than none. `None` where nothing is cancelled.
///
/// # Errors
/// A run that cannot be done; `cancel` was set.
pub fn against_none(
    scenario: &Scenario,
    with: &Edge,
    search: &Search,
    options: &RunOptions,
    done: &(dyn Fn(usize, usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Option<AgainstNone>, ResimulateError> {
    let cancels = |settings: &Settings| matches!(settings, Settings::Canceller(files, ..) if files.model.is_some());
    if !scenario.graph().nodes.iter().any(|n| cancels(&n.settings)) {
        return Ok(None);
    }
    let without = edge(&scenario.without_canceller(), search, options, done, cancel)?;
    // Of a limit below the searched range only that is known.
    let ends = |edge: &Edge| edge.critical_gain.unwrap_or(if edge.at_least > 0.0 { edge.at_least } else { search.lowest });
    let (end, end_without) = (ends(with), ends(&without));
    let warning = (with.outcome_beyond.is_some() && end < end_without * (1.0 - search.tolerance)).then(|| {
        format!(
            "the loop is less stable with the canceller (up to mu*lambda = {end:.3}) than without ({end_without:.3}): its model does \
            not fit the master or the grip"
        )
    });
    Ok(Some(AgainstNone { without, warning }))
}
