//! Derivatives of a motion by parameters, carried along with the motion (forward mode).
//!
//! The plant moves under the unchanged model. Beside it each parameter has a lane: the derivatives of all positions and velocities with respect to it,
//! and the memories of the elements for a parameter that is a small step larger. The derivatives obey the linear equations of a substep with the
//! sticking and sliding of the plant's own (a tangent linear model). A substep of a lane thus solves no law and searches no contact that sticks; it only
//! differences each law once along the lane's own direction. Where dry friction comes to rest and goes on the other way, the moment of rest moves along,
//! too.

mod contacts;
mod lane;
mod lanes;
mod paths;
mod shared;
mod solution;

use crate::model::Model;
use crate::stepper::options::Options;
use crate::stepper::segment::Segment;
use crate::stepper::state::Plant;
use lane::Lane;
use lanes::Lanes;

/// Lanes that are carried abreast, at most.
pub const LANES: usize = 8;

/// Derivatives of a plant's motion by up to [`LANES`] parameters.
#[derive(Debug, Clone)]
pub struct Tangents(Wide);

#[derive(Debug, Clone)]
enum Wide {
    Four(Box<Lanes<4>>),
    Eight(Box<Lanes<8>>),
}

impl Tangents {
    /// Follows `plant`, which was compiled from `model` for samples `period` seconds apart and has not moved yet. Each parameter is given by a model that
    /// differs from `model` in it alone, and by how much it differs: small enough for a straight line. `None` where a model differs in more than its bodies
    /// and elements, or where there are more than [`LANES`]. Also for a linear model, whose exact solution has no substeps to follow, and for a robot, whose
    /// inertia changes on the way.
    pub fn new(plant: &Plant, model: &Model, moved: &[(Model, f64)], period: f64) -> Option<Tangents> {
        let options = Options { substeps: Some(plant.substeps), ..Options::default() };
        let alike = |m: &Model| m.inputs == model.inputs && m.outputs == model.outputs && m.elements.len() == model.elements.len();
        if plant.exact.is_some() || plant.links.is_some() || moved.len() > LANES || moved.iter().any(|(m, step)| !alike(m) || *step == 0.0)
        {
            return None;
        }
        let lanes: Option<Vec<Lane>> =
            moved.iter().map(|(m, step)| Lane::new(plant, model, m, Plant::new(m, period, &options).ok()?, *step)).collect();
        Some(Tangents(if moved.len() <= 4 {
            Wide::Four(Box::new(Lanes::new(plant, lanes?)))
        } else {
            Wide::Eight(Box::new(Lanes::new(plant, lanes?)))
        }))
    }

    /// As [`Plant::start_at`] of the plant.
    pub fn start_at(&mut self, first: &[f64]) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.start_at(first),
            Wide::Eight(lanes) => lanes.start_at(first),
        }
    }

    /// As [`Plant::set_motion`] of the plant: the motion at the start depends on no parameter.
    pub fn set_motion(&mut self, body: usize, position: f64, velocity: f64) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.set_motion(body, position, velocity),
            Wide::Eight(lanes) => lanes.set_motion(body, position, velocity),
        }
    }

    /// Advances the plant by one period, and its derivatives along.
    pub fn step(&mut self, plant: &mut Plant, inputs: &[Segment]) {
        match &mut self.0 {
            Wide::Four(lanes) => plant.step_followed(inputs, lanes.as_mut()),
            Wide::Eight(lanes) => plant.step_followed(inputs, lanes.as_mut()),
        }
    }

    /// Derivatives of the plant's outputs, whose values now are `values`: `derivatives[lane][output]`.
    pub fn outputs(&mut self, plant: &Plant, values: &[f64], derivatives: &mut [Vec<f64>]) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.outputs(plant, values, derivatives),
            Wide::Eight(lanes) => lanes.outputs(plant, values, derivatives),
        }
    }
}
