//! What the nominal device does under its working force: the measure of every size.

use super::options::DrawOptions;
use crate::effects::Effect;
use crate::network::{InputKind, Network, Place};
use crate::plant::{PlantError, SealedPlant};
use crate::truth::Truth;
use std::f64::consts::PI;

/// s, how long the probe lasts.
const DURATION_S: f64 = 0.8;

/// s, the probe's sampling period at least: a shorter one only costs time.
const PERIOD_S: f64 = 1e-3;

/// Hz, where the force's sweep begins and ends: the hand's motion and the crossover of a position-force loop.
const SWEEP_HZ: [f64; 2] = [1.5, 80.0];

/// Hz, of moved bodies: a hand's working motion.
const MOTION_HZ: f64 = 2.0;

/// Least change of an output, as a share of its range, for an effect to show.
const SHOWS: f64 = 0.03;

/// The nominal device under a sweep of the working force while moved bodies go to and fro.
pub(super) struct Probe {
    period_s: f64,
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    /// m and m/s of every body, N of every element: half of the range of positions, amplitudes of the others.
    travel: Vec<Vec<f64>>,
    speed: Vec<Vec<f64>>,
    force: Vec<f64>,
    working_force: f64,
}

impl Probe {
    pub fn new(nominal: &Network, options: &DrawOptions) -> Result<Probe, PlantError> {
        let period_s = options.period_s.max(PERIOD_S);
        let steps = ((DURATION_S / period_s).ceil() as usize).max(50);
        let inputs = (0..=steps).map(|k| excitation(nominal, options, k as f64 * period_s)).collect();
        let mut probe = Probe {
            period_s,
            inputs,
            outputs: Vec::new(),
            travel: Vec::new(),
            speed: Vec::new(),
            force: Vec::new(),
            working_force: options.working_force_n,
        };
        let mut plant = SealedPlant::new(nominal, &Truth::nothing(nominal), period_s)?;
        let bodies = nominal.bodies.len();
        // Relative motions between all places; ground is the last one.
        let mut motions = vec![vec![Vec::new(); bodies + 1]; bodies + 1];
        let mut speeds = motions.clone();
        let mut forces = vec![Vec::new(); nominal.elements.len()];
        probe.outputs = play(&mut plant, &probe.inputs, |plant| {
            for a in 0..=bodies {
                for b in 0..=bodies {
                    motions[a][b].push(plant.position(a) - plant.position(b));
                    speeds[a][b].push(plant.speed(a) - plant.speed(b));
                }
            }
            for (element, force) in forces.iter_mut().enumerate() {
                force.push(plant.force(element));
            }
        })
        .unwrap_or_default();
        probe.travel = motions.iter().map(|row| row.iter().map(|motion| half_range(motion)).collect()).collect();
        probe.speed = speeds.iter().map(|row| row.iter().map(|speed| amplitude(speed)).collect()).collect();
        probe.force = forces.iter().map(|force| amplitude(force)).collect();
        Ok(probe)
    }

    fn index(&self, place: Place) -> usize {
        place.unwrap_or(self.travel.len() - 1)
    }

    /// m, half of the range of the displacement between two places.
    pub fn travel(&self, between: [Place; 2]) -> f64 {
        self.travel[self.index(between[0])][self.index(between[1])]
    }

    /// m/s, amplitude of the relative speed of two places.
    pub fn speed(&self, between: [Place; 2]) -> f64 {
        self.speed[self.index(between[0])][self.index(between[1])]
    }

    /// N, amplitude of an element's force.
    pub fn element_force(&self, element: usize) -> f64 {
        self.force[element]
    }

    /// N, amplitude of the force that moves a body: the working force where a force acts on the device, else the largest of
    /// the joints' forces on it.
    pub fn body_force(&self, body: usize, network: &Network) -> f64 {
        if network.inputs.iter().any(|input| input.kind == InputKind::Force) {
            return self.working_force;
        }
        let joined = network.elements.iter().enumerate().filter(|(_, element)| element.between.contains(&Some(body)));
        joined.map(|(index, _)| self.force[index]).fold(0.0, f64::max)
    }

    /// Half of the range of an output.
    pub fn output_range(&self, output: usize) -> f64 {
        half_range(&self.outputs.iter().map(|row| row[output]).collect::<Vec<_>>())
    }

    /// Whether the effect alone changes an output of the nominal device by a share of its range, and the device stays finite.
    pub fn shows(&self, nominal: &Network, effect: &Effect) -> bool {
        let truth = Truth { effects: vec![effect.clone()], ..Truth::nothing(nominal) };
        let Ok(mut plant) = SealedPlant::new(nominal, &truth, self.period_s) else { return false };
        let Some(with) = play(&mut plant, &self.inputs, |_| ()) else { return false };
        (0..nominal.outputs.len()).any(|output| {
            let change: Vec<f64> = with.iter().zip(&self.outputs).map(|(with, without)| with[output] - without[output]).collect();
            rms(&change) > SHOWS * self.output_range(output) && self.output_range(output) > 0.0
        })
    }
}

/// Every input at a time: forces sweep, one after the other so that no two are alike; moved bodies go to and fro from rest.
fn excitation(network: &Network, options: &DrawOptions, time: f64) -> Vec<f64> {
    let value = |(index, input): (usize, &crate::network::Input)| match input.kind {
        InputKind::Force => {
            let rate = (SWEEP_HZ[1] / SWEEP_HZ[0]).ln() / DURATION_S;
            let phase = 2.0 * PI * SWEEP_HZ[0] * ((rate * time).exp() - 1.0) / rate;
            options.working_force_n * (phase + 0.7 * index as f64).sin()
        }
        InputKind::Motion => options.working_motion_m * 0.5 * (1.0 - (2.0 * PI * MOTION_HZ * time).cos()),
    };
    network.inputs.iter().enumerate().map(value).collect()
}

/// The exact outputs under the inputs; `None` where the device runs away.
fn play(plant: &mut SealedPlant, inputs: &[Vec<f64>], mut look: impl FnMut(&SealedPlant)) -> Option<Vec<Vec<f64>>> {
    let mut rows = Vec::with_capacity(inputs.len());
    for row in inputs {
        plant.step(row).ok()?;
        look(plant);
        rows.push(plant.exact_outputs().to_vec());
    }
    Some(rows)
}

fn half_range(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    if low < high { 0.5 * (high - low) } else { 0.0 }
}

/// Of the sine with the same mean square.
fn amplitude(values: &[f64]) -> f64 {
    2.0_f64.sqrt() * rms(values)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
