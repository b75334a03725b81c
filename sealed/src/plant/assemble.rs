//! From a device to a plant that steps.

use super::dense::{self, add_between, pick};
use super::drive::Drive;
use super::error::PlantError;
use super::joint::Joint;
use super::kick::Kick;
use super::loading;
use super::sensor::Sensor;
use super::state::{Names, SealedPlant};
use crate::laws::{Damper, Law};
use crate::network::{InputKind, Network};
use crate::truth::Truth;

/// Substeps of a period at most: more and a second takes minutes.
const SUBSTEPS_AT_MOST: usize = 20_000;

/// A dead time of more periods than this is a mistake.
const PERIODS_OF_DELAY: usize = 100_000;

pub(super) fn assemble(device: &Network, truth: &Truth, period_s: f64, (phase, least): (f64, usize)) -> Result<SealedPlant, PlantError> {
    let delays = device
        .inputs
        .iter()
        .map(|input| (&input.name, input.delay))
        .chain(device.outputs.iter().map(|output| (&output.name, output.delay)));
    for (signal, delay_s) in delays {
        if delay_s > period_s * PERIODS_OF_DELAY as f64 {
            return Err(PlantError::Delay { signal: signal.clone(), delay_s, most: PERIODS_OF_DELAY });
        }
    }
    let mut joints = Vec::new();
    let (mut memory, mut dry) = (0, 0);
    // The force that a motor loses to its speed is a damper to ground on its body.
    let back_emf = device.inputs.iter().filter(|input| input.kind == InputKind::Force && input.back_emf > 0.0);
    let lost = back_emf.map(|input| ([Some(input.on), None], Law::Damper(Damper { damping: input.back_emf })));
    for (between, law) in device.elements.iter().map(|element| (element.between, element.law.clone())).chain(lost) {
        let force = law.to_force();
        let remembered = force.memory();
        joints.push(Joint {
            between,
            memory: memory..memory + remembered,
            loaded_by: loading::loading(device, between, force.load()),
            last: 0.0,
            path_force: 0.0,
            damping: 0.0,
            dry: force.is_dry().then(|| {
                dry += 1;
                dry - 1
            }),
            force,
        });
        memory += remembered;
    }

    let bodies = device.bodies.len();
    let mass = mass_matrix(device, &joints);
    let free: Vec<usize> = (0..bodies).filter(|body| !device.is_moved(*body)).collect();
    let mass_inverse =
        dense::inverse(&pick(&mass, bodies, &free), free.len()).ok_or_else(|| PlantError::NoInertia(device.nominal.name.clone()))?;
    let fastest = fastest(&mass_inverse, &free, &joints, bodies);
    let needed = (period_s * fastest / phase).ceil().max(least as f64);
    if needed.is_nan() || needed > SUBSTEPS_AT_MOST as f64 {
        return Err(PlantError::TooStiff { device: device.nominal.name.clone(), rad_per_s: fastest, period_s });
    }
    let substeps = needed as usize;
    let substep_s = period_s / substeps as f64;

    let sensors = device.outputs.iter().enumerate().map(|(index, output)| {
        let noise = truth.sensors.iter().find(|sensor| sensor.output == output.name).map_or(0.0, |sensor| sensor.noise);
        Sensor::new(output, noise, truth.noise_seed, index, period_s)
    });
    Ok(SealedPlant {
        names: Names {
            bodies: device.bodies.iter().map(|body| body.name.clone()).collect(),
            elements: device.elements.iter().map(|element| element.name.clone()).collect(),
            inputs: device.inputs.iter().map(|input| input.name.clone()).collect(),
            outputs: device.outputs.iter().map(|output| output.name.clone()).collect(),
        },
        drives: device.inputs.iter().map(|input| Drive::new(input, period_s)).collect(),
        sensors: sensors.collect(),
        memory: vec![0.0; memory],
        scratch: vec![0.0; memory],
        positions: vec![0.0; bodies],
        middle: vec![0.0; bodies],
        speeds: vec![0.0; bodies],
        accelerations: vec![0.0; bodies],
        applied: vec![0.0; bodies],
        element_forces: vec![0.0; joints.len()],
        reactions: vec![0.0; bodies],
        exact: vec![0.0; device.outputs.len()],
        measured: vec![0.0; device.outputs.len()],
        kick: Kick::new(mass, mass_inverse, free, &joints, dry, substep_s),
        joints,
        substeps,
        substep_s,
    })
}

/// Inertias and inertances over all bodies, row by row, kg.
fn mass_matrix(device: &Network, joints: &[Joint]) -> Vec<f64> {
    let n = device.bodies.len();
    let mut mass = vec![0.0; n * n];
    for (index, body) in device.bodies.iter().enumerate() {
        mass[index * n + index] += body.inertia;
    }
    for joint in joints {
        add_between(&mut mass, n, joint.between, joint.force.inertance());
    }
    mass
}

/// rad/s, a bound of the fastest motion: the trace of inverse mass times stiffness is the sum of all squared frequencies.
fn fastest(mass_inverse: &[f64], free: &[usize], joints: &[Joint], bodies: usize) -> f64 {
    let mut stiffness = vec![0.0; bodies * bodies];
    for joint in joints {
        add_between(&mut stiffness, bodies, joint.between, joint.force.stiffness());
    }
    // Both are symmetric, so the trace of the product is the sum over all entries.
    let stiffness = pick(&stiffness, bodies, free);
    let trace: f64 = mass_inverse.iter().zip(&stiffness).map(|(inverse, stiffness)| inverse * stiffness).sum();
    trace.max(0.0).sqrt()
}
