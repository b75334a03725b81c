//! The loop with a part exchanged.

use crate::session::Session;
use backdrive_control::canceller::Canceller;
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::device::{Device, DeviceError, DeviceOptions, DeviceRole};
use backdrive_control::hand::{HandBank, HandSettings};
use backdrive_control::scaling::GainPlan;
use backdrive_msgs::{MAX_AXES, Sample};
use backdrive_nodes::graph::DeviceFiles;
use backdrive_plant::linear::{LinearError, LinearModel, Operating};
use backdrive_plant::model::{InputKind, Output, OutputKind};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;

/// Parts that replace those that recorded the session.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExchangedParts<'a> {
    /// Another canceller: its model with grip (no model: nothing is cancelled), the corner of its high-pass, Hz (0: none), and how it
    /// estimates the hand (`None`: it does not).
    pub canceller: Option<(&'a DeviceFiles, f64, Option<&'a HandSettings>)>,
    /// Another master with its grip: G_f comes from its model, linear at a small amplitude.
    pub master: Option<&'a DeviceFiles>,
    /// Another slave with its environment: H_se comes from its model, linear about where the slave was.
    pub slave: Option<&'a DeviceFiles>,
}

impl ExchangedParts<'_> {
    pub(super) fn any(&self) -> bool {
        self.canceller.is_some() || self.master.is_some() || self.slave.is_some()
    }
}

/// Why a part cannot be exchanged.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// The canceller's model does not work.
    #[error("canceller: {0}")]
    Canceller(DeviceError),
    /// A device has no model.
    #[error("{0}: has no model to take the response from; give a model file")]
    NoModel(&'static str),
    /// A controller drives the slave, and the model alone does not determine its response.
    #[error("slave: a controller drives it, so its response does not follow from its model alone; run the graph with it instead")]
    Driven,
    /// What the slave touches is at a point of it.
    #[error(
        "slave: its environment is not attached at its axes (environment_on, touches), so its response in contact does not follow from \
            their positions; run the graph with it instead"
    )]
    Touches,
    /// The model has not as many axes as the session.
    #[error("{part}: the model has {model} axes, the session has {session}")]
    Axes {
        /// `master`, `slave` or `canceller`.
        part: &'static str,
        /// Axes of the model.
        model: usize,
        /// Axes of the session.
        session: usize,
    },
    /// The model has no response.
    #[error("{part}: {error}")]
    Linear {
        /// `master` or `slave`.
        part: &'static str,
        /// Why.
        error: LinearError,
    },
}

/// Induced motion that a canceller predicts from the forces of a session: one column per axis, m or rad.
pub(super) fn induced(
    session: &Session,
    files: &DeviceFiles,
    high_pass_hz: f64,
    hand: Option<&HandSettings>,
) -> Result<Vec<Vec<f64>>, PartError> {
    let (n, axes) = (session.len(), session.axes.len());
    let options = DeviceOptions { substeps: files.substeps, noise_seed: None, quantise: false };
    if let Some(model) = files.model.as_ref().filter(|model| model.axes.len() != axes) {
        return Err(PartError::Axes { part: "canceller", model: model.axes.len(), session: axes });
    }
    let mut core = match (&files.model, hand) {
        (Some(model), Some(hand)) => {
            let bank = HandBank::new(model, files.fragment.as_ref(), hand, session.period_s, &options);
            let first = |gains: &[f64]| gains.first().copied().unwrap_or(f64::NAN);
            let recorded = GainPlan { mu: first(&session.mu), lambda: first(&session.lambda), ramp_s: 0.0, changes: Vec::new() };
            Canceller::scheduled(bank.map_err(PartError::Canceller)?, hand.edge_without, recorded, high_pass_hz, session.period_s)
        }
        (model, _) => {
            let held = |model| Device::new(model, files.fragment.as_ref(), DeviceRole::Master, session.period_s, &options);
            Canceller::new(model.as_ref().map(held).transpose().map_err(PartError::Canceller)?, high_pass_hz, session.period_s)
        }
    };
    let mut columns = vec![vec![f64::NAN; n]; axes];
    let mut events = Events::default();
    for row in 0..n {
        let mut measured = Sample::new(axes.min(MAX_AXES));
        measured.step = row as u64;
        for (i, axis) in session.axes.iter().enumerate().take(MAX_AXES) {
            (measured.position[i], measured.effort[i]) = (axis.master[row], axis.force[row]);
        }
        let mut outputs = [Sample::new(axes.min(MAX_AXES)), Sample::new(axes.min(MAX_AXES))];
        let tick = Tick { step: row as u64, time_s: row as f64 * session.period_s, period_s: session.period_s };
        core.step(&tick, &[Port { sample: Some(measured), age_steps: 0 }], &mut outputs, &mut events);
        for (i, column) in columns.iter_mut().enumerate().take(MAX_AXES) {
            column[row] = outputs[1].position[i];
        }
    }
    Ok(columns)
}

/// G_f of a master from its model, sampled: a force that is held from row to row moves what is measured, m/N.
pub(super) fn master_response(
    files: &DeviceFiles,
    axes: usize,
    hz: &[f64],
    period_s: f64,
) -> Result<Vec<DMatrix<Complex<f64>>>, PartError> {
    let mut model = files.model.clone().ok_or(PartError::NoModel("master"))?;
    if model.axes.len() != axes {
        return Err(PartError::Axes { part: "master", model: model.axes.len(), session: axes });
    }
    let ends: Vec<_> = model.axes.iter().map(|a| (a.feedback, a.measured, a.user, a.scale, a.holds_user)).collect();
    for (i, end) in ends.iter().enumerate() {
        if let Some(fragment) = files.fragment.as_ref().filter(|_| !end.4) {
            model.attach(fragment, end.2, &format!("grip{i}"));
        }
    }
    let linear = |error| PartError::Linear { part: "master", error };
    let held = LinearModel::new(&model, &Operating::small()).map_err(linear)?;
    responses(axes, hz, |to, from| {
        let mut g = held.response(ends[from].0, ends[to].1, hz).map_err(linear)?;
        for (g, hz) in g.iter_mut().zip(hz) {
            let turn = Complex::new(0.0, TAU * hz * period_s);
            *g *= (Complex::new(1.0, 0.0) - (-turn).exp()) / turn * ends[to].3;
        }
        Ok(g)
    })
}

/// H_se of a slave with its environment from its model, N/m, about positions `about` of its tips, m or rad.
pub(super) fn slave_response(files: &DeviceFiles, about: &[f64], hz: &[f64]) -> Result<Vec<DMatrix<Complex<f64>>>, PartError> {
    let axes = about.len();
    let mut model = files.model.clone().ok_or(PartError::NoModel("slave"))?;
    if model.axes.len() != axes {
        return Err(PartError::Axes { part: "slave", model: model.axes.len(), session: axes });
    }
    if model.axes.iter().any(|a| model.inputs[a.feedback].kind == InputKind::Force) {
        return Err(PartError::Driven);
    }
    if model.axes.iter().any(|axis| !axis.touches.is_empty()) {
        return Err(PartError::Touches);
    }
    let ends: Vec<_> = model.axes.iter().map(|a| (a.feedback, a.user)).collect();
    let mut at = Operating::small();
    let mut outputs = Vec::new();
    for (i, end) in ends.iter().enumerate() {
        let elements = files.fragment.as_ref().map_or_else(Vec::new, |f| model.attach(f, end.1, &format!("wall{i}")).elements);
        at.about.extend(elements.iter().map(|e| (*e, about[i])));
        model.outputs.push(Output {
            name: format!("contact{i}"),
            kind: OutputKind::Force(elements),
            gain: -1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        });
        outputs.push(model.outputs.len() - 1);
    }
    let linear = |error| PartError::Linear { part: "slave", error };
    let loaded = LinearModel::new(&model, &at).map_err(linear)?;
    responses(axes, hz, |to, from| loaded.response(ends[from].0, outputs[to], hz).map_err(linear))
}

fn responses(
    axes: usize,
    hz: &[f64],
    one: impl Fn(usize, usize) -> Result<Vec<Complex<f64>>, PartError>,
) -> Result<Vec<DMatrix<Complex<f64>>>, PartError> {
    let mut all = vec![DMatrix::zeros(axes, axes); hz.len()];
    for to in 0..axes {
        for from in 0..axes {
            for (m, value) in all.iter_mut().zip(one(to, from)?) {
                m[(to, from)] = value;
            }
        }
    }
    Ok(all)
}
