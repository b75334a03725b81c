//! The controller as a node.

use super::{AxisModel, ControllerError, Differentiator, ReferenceFilter, Settings, State, Working};
use crate::core::{Core, Events, Port, Tick};
use crate::freshness::{Freshness, bridged_steps};
use backdrive_msgs::{MAX_AXES, Sample, flag};
use backdrive_plant::model::Model;

/// Inputs `command` (position: where the tip shall be), `measured` (position of the tip, one step old); output `force` (effort for the
/// slave's motor).
///
/// Before the first command it holds the axis where it is. Without a new command it holds the last one; without a measurement it publishes nothing,
/// and the slave removes its force. The command is cut to the travel and speed of the model's axis.
pub struct Controller {
    axes: Vec<OneAxis>,
    command: Freshness,
    measured: Freshness,
    /// Step of the newest measurement.
    measured_at: u64,
    stale_steps: u64,
    trusted: bool,
}

struct OneAxis {
    law: Working,
    reference: ReferenceFilter,
    velocity: Differentiator,
    target: Option<f64>,
    state: State,
    scale: f64,
    travel: [f64; 2],
    reach: f64,
}

impl Controller {
    /// For `axes` axes; `model` is what it knows of them.
    ///
    /// # Errors
    /// When the law needs a model that is not there, or one that it cannot use.
    pub fn new(
        axes: usize,
        settings: &Settings,
        model: Option<&Model>,
        stale_after_s: f64,
        period_s: f64,
    ) -> Result<Controller, ControllerError> {
        let one = |axis: usize| {
            let known = model.map(|model| AxisModel::new(model, axis)).transpose()?;
            Ok(OneAxis {
                law: Working::new(&settings.law, known.as_ref())?,
                reference: ReferenceFilter::new(settings.reference_hz, period_s),
                velocity: Differentiator::new(settings.velocity_hz),
                target: None,
                state: State::default(),
                scale: known.as_ref().map_or(1.0, |k| k.scale),
                travel: known.as_ref().and_then(|k| k.travel).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
                reach: known.as_ref().and_then(|k| k.speed).unwrap_or(f64::INFINITY) * period_s,
            })
        };
        Ok(Controller {
            axes: (0..axes.min(MAX_AXES)).map(one).collect::<Result<_, _>>()?,
            command: Freshness::default(),
            measured: Freshness::default(),
            measured_at: 0,
            stale_steps: bridged_steps(stale_after_s, period_s),
            trusted: true,
        })
    }
}

impl Core for Controller {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let [command, measured] = inputs else { return };
        let mut flags = 0;
        if let Some(command) = self.command.new_sample(command, |s| s.position[0]) {
            for (axis, own) in self.axes.iter_mut().enumerate() {
                let wanted = command.position[axis];
                if !wanted.is_finite() {
                    continue;
                }
                let mut target = wanted.clamp(own.travel[0], own.travel[1]);
                if let Some(before) = own.target {
                    target = target.clamp(before - own.reach, before + own.reach);
                }
                if target != wanted {
                    flags |= flag::LIMITED;
                }
                own.target = Some(target);
            }
        }
        if self.command.begun() && self.command.stale_steps > self.stale_steps {
            flags |= flag::STALE;
        }
        if let Some(measured) = self.measured.new_sample(measured, |s| s.position[0]) {
            let elapsed_s = measured.step.saturating_sub(self.measured_at).max(1) as f64 * tick.period_s;
            self.measured_at = measured.step;
            for (axis, own) in self.axes.iter_mut().enumerate() {
                if measured.position[axis].is_finite() {
                    own.state.position = measured.position[axis] / own.scale;
                    own.state.velocity = own.velocity.step(own.state.position, elapsed_s);
                }
            }
        }
        if !self.measured.begun() || self.measured.stale_steps > self.stale_steps || !self.trusted {
            return;
        }
        let mut efforts = [0.0; MAX_AXES];
        for (own, effort) in self.axes.iter_mut().zip(&mut efforts) {
            // Before the first command the axis is to stay where it was first seen.
            let first = own.state.position * own.scale;
            let target = *own.target.get_or_insert(first);
            let reference = own.reference.step(target / own.scale);
            *effort = own.law.effort(&reference, &own.state, tick.period_s);
        }
        if !efforts.iter().all(|f| f.is_finite()) {
            self.trusted = false;
            events.push("controller_off", tick.time_s, 2);
            return;
        }
        outputs[0].effort[..self.axes.len()].copy_from_slice(&efforts[..self.axes.len()]);
        outputs[0].flags = flags;
    }
}
