//! From a model to the parameters that a substep needs.

use super::compiled::{Compiled, Share};
use super::constraints::{Constraints, Work};
use super::contact::{FrictionContact, Joint};
use super::dense;
use super::drive::Drive;
use super::error::CompileError;
use super::instant::Endpoint;
use super::links::Links;
use super::motion::Motion;
use super::options::Options;
use super::path::PathElement;
use super::points::Points;
use super::propagator::Propagator;
use super::sensor::Sense;
use super::slots::{Columns, GROUND, MAX_BODIES, MAX_ELEMENTS, SLOTS, Slots, Square, prescribed_slot};
use super::sparse::Sparse;
use super::state::Plant;
use crate::elements::{Range, Role};
use crate::load;
use crate::model::{Element, InputKind, Model, OutputKind, Place};
use nalgebra::DMatrix;

/// The constant matrices of a network.
struct Network {
    slots: Vec<usize>,
    /// Body of each free place, for messages.
    free_bodies: Vec<usize>,
    points: Points,
    prescribed: usize,
    mass: Square,
    damping: Square,
    stiffness: Square,
    constant: Slots,
}

impl Network {
    fn ends(&self, element: &Element) -> [usize; 2] {
        element.between.map(|place| place.map_or(GROUND, |body| self.slots[body]))
    }

    /// Whether an element ends at a point of a robot: what it is in the joints' coordinates changes with the pose.
    fn at_a_point(&self, element: &Element) -> bool {
        self.ends(element).iter().any(|place| self.points.places().contains(place))
    }
}

fn square() -> Square {
    Box::new([[0.0; SLOTS]; SLOTS])
}

/// Adds a coefficient between two places. Ground's row and column collect what has no effect.
fn join(matrix: &mut Square, first: usize, second: usize, value: f64) {
    matrix[first][first] += value;
    matrix[second][second] += value;
    matrix[first][second] -= value;
    matrix[second][first] -= value;
}

/// The block between the free places.
fn block(matrix: &Square, free: usize) -> DMatrix<f64> {
    DMatrix::from_fn(free, free, |i, j| matrix[i][j])
}

fn columns(matrix: &DMatrix<f64>) -> Columns {
    let mut columns = Columns::new(matrix.ncols());
    for j in 0..matrix.ncols() {
        for i in 0..matrix.nrows() {
            columns[j][i] = matrix[(i, j)];
        }
    }
    columns
}

fn number(place: impl Fn() -> String, key: &'static str, value: f64, expected: &'static str, holds: bool) -> Result<(), CompileError> {
    if holds { Ok(()) } else { Err(CompileError::Number { place: place(), key, expected, value }) }
}

/// Refuses what a model file could not say, in models that were built by hand.
fn check(model: &Model) -> Result<(), CompileError> {
    for body in &model.bodies {
        let holds = body.inertia.is_finite() && body.inertia >= 0.0;
        number(|| format!("body `{}`", body.name), "inertia", body.inertia, "at least 0", holds)?;
    }
    let exists = |place: &Place| place.is_none_or(|body| body < model.bodies.len());
    for element in &model.elements {
        let reason = |reason: String| CompileError::Element { element: element.name.clone(), reason };
        if !element.between.iter().all(exists) {
            return Err(CompileError::Dangling(format!("element `{}`", element.name)));
        }
        let kind = element.law.kind();
        let values = element.law.values();
        for (parameter, list) in kind.parameters.iter().zip(&values) {
            for value in list {
                let expected = match parameter.range {
                    _ if !value.is_finite() => "a finite number".to_owned(),
                    Range::NonNegative if *value < 0.0 => "at least 0".to_owned(),
                    Range::Positive if *value <= 0.0 => "above 0".to_owned(),
                    Range::Between(low, high) if !(low..=high).contains(value) => format!("from {low} to {high}"),
                    _ => continue,
                };
                return Err(reason(format!("{} must be {expected}, not {value}", parameter.key)));
            }
        }
        (kind.build)(&values).map_err(reason)?;
        let at_a_point = element.between.iter().flatten().any(|body| model.is_point(*body));
        if let Role::Linear(linear) = element.law.role()
            && at_a_point
            && linear.inertance != 0.0
        {
            let message = "an inerter cannot end at a point of the robot; attach it to a joint, or to a separate body that a spring attaches to the \
                    point";
            return Err(reason(message.to_owned()));
        }
    }
    for input in &model.inputs {
        let place = || format!("input `{}`", input.name);
        if input.on >= model.bodies.len() {
            return Err(CompileError::Dangling(place()));
        }
        number(place, "gain", input.gain, "a finite number", input.gain.is_finite())?;
        number(place, "saturation", input.saturation, "at least 0", input.saturation >= 0.0)?;
        let expected = match input.kind {
            InputKind::Force => "at least 0 and finite",
            InputKind::Motion => "at least 0 where the motion to come is not known",
        };
        number(place, "delay", input.delay, expected, input.delay >= 0.0 && input.delay.is_finite())?;
        number(place, "bandwidth", input.bandwidth, "above 0", input.bandwidth > 0.0)?;
        number(place, "back_emf", input.back_emf, "a finite number", input.back_emf.is_finite())?;
        number(place, "offset", input.offset, "a finite number", input.offset.is_finite())?;
        if model.is_point(input.on) && (input.kind == InputKind::Motion || input.back_emf != 0.0) {
            return Err(CompileError::AtPoint { input: input.name.clone(), point: model.bodies[input.on].name.clone() });
        }
    }
    for output in &model.outputs {
        let place = || format!("output `{}`", output.name);
        let known = match &output.kind {
            OutputKind::Position(body) | OutputKind::Velocity(body) | OutputKind::Acceleration(body) | OutputKind::Reaction(body) => {
                *body < model.bodies.len()
            }
            OutputKind::Force(elements) => elements.iter().all(|element| *element < model.elements.len()),
        };
        if !known {
            return Err(CompileError::Dangling(place()));
        }
        number(place, "gain", output.gain, "a finite number", output.gain.is_finite())?;
        number(place, "delay", output.delay, "at least 0 and finite", output.delay >= 0.0 && output.delay.is_finite())?;
        number(place, "offset", output.offset, "a finite number", output.offset.is_finite())?;
        number(place, "resolution", output.resolution, "at least 0 and finite", output.resolution >= 0.0 && output.resolution.is_finite())?;
        number(place, "noise", output.noise, "at least 0 and finite", output.noise >= 0.0 && output.noise.is_finite())?;
        if let OutputKind::Reaction(body) = output.kind
            && !model.inputs.iter().any(|input| input.kind == InputKind::Motion && input.on == body)
        {
            return Err(CompileError::NoReaction { output: output.name.clone(), body: model.bodies[body].name.clone() });
        }
    }
    Ok(())
}

/// Delays of more periods than this would only fill memory.
const LONGEST_DELAY_PERIODS: f64 = 1e6;

fn check_sizes(model: &Model, period: f64, options: &Options) -> Result<(), CompileError> {
    if !(period.is_finite() && period > 0.0) {
        return Err(CompileError::Period(period));
    }
    if let Some(n) = options.substeps.filter(|n| !(1..=100_000).contains(n)) {
        return Err(CompileError::Substeps(n));
    }
    if model.elements.len() > MAX_ELEMENTS {
        return Err(CompileError::TooMany { what: "elements", count: model.elements.len(), limit: MAX_ELEMENTS });
    }
    let inputs = model.inputs.iter().map(|input| ("input", &input.name, input.delay));
    for (what, name, delay) in inputs.chain(model.outputs.iter().map(|output| ("output", &output.name, output.delay))) {
        number(|| format!("{what} `{name}`"), "delay", delay, "at most a million sample periods", delay / period <= LONGEST_DELAY_PERIODS)?;
    }
    Ok(())
}

fn assemble(model: &Model) -> Result<Network, CompileError> {
    if model.bodies.len() > MAX_BODIES {
        return Err(CompileError::TooMany { what: "bodies", count: model.bodies.len(), limit: MAX_BODIES });
    }
    let mut mover: Vec<Option<usize>> = vec![None; model.bodies.len()];
    for (index, input) in model.inputs.iter().enumerate().filter(|(_, input)| input.kind == InputKind::Motion) {
        if let Some(first) = mover[input.on].replace(index) {
            return Err(CompileError::MovedTwice {
                body: model.bodies[input.on].name.clone(),
                first: model.inputs[first].name.clone(),
                second: input.name.clone(),
            });
        }
    }
    let (mut slots, mut free_bodies, mut prescribed) = (Vec::new(), Vec::new(), 0);
    for (body, mover) in mover.iter().enumerate() {
        if model.is_point(body) {
            // Behind the free bodies, when it is known how many these are.
            slots.push(GROUND);
        } else if mover.is_some() {
            slots.push(prescribed_slot(prescribed));
            prescribed += 1;
        } else {
            slots.push(free_bodies.len());
            free_bodies.push(body);
        }
    }
    let points = model.arm.as_ref().map_or(&[][..], |arm| &arm.points);
    for (index, point) in points.iter().enumerate() {
        slots[point.body] = free_bodies.len() + index;
    }
    let points = Points::new(free_bodies.len(), points.len(), prescribed);
    let mut network =
        Network { slots, free_bodies, points, prescribed, mass: square(), damping: square(), stiffness: square(), constant: [0.0; SLOTS] };
    for (body, slot) in model.bodies.iter().zip(&network.slots) {
        network.mass[*slot][*slot] += body.inertia;
    }
    for element in &model.elements {
        let [first, second] = element.between.map(|place| place.map_or(GROUND, |body| network.slots[body]));
        if let Role::Linear(linear) = element.law.role()
            && first != second
            && !network.at_a_point(element)
        {
            join(&mut network.mass, first, second, linear.inertance);
            join(&mut network.damping, first, second, linear.damping);
            join(&mut network.stiffness, first, second, linear.stiffness);
            network.constant[first] -= linear.force;
            network.constant[second] += linear.force;
        }
    }
    for input in model.inputs.iter().filter(|input| input.kind == InputKind::Force) {
        let slot = network.slots[input.on];
        network.damping[slot][slot] += input.back_emf;
    }
    Ok(network)
}

/// Phase per substep of the fastest mode, rad: its shape is resolved and its frequency right to 3e-4.
const PHASE_PER_SUBSTEP: f64 = 0.6;
/// Decay per substep of the fastest damped motion; the rule rings above 2.
const DECAY_PER_SUBSTEP: f64 = 3.0;
/// Longest substep with nonlinear elements, s.
const LONGEST_SUBSTEP_S: f64 = 5e-4;
/// The same where an element's slope is only an estimate, and it may be steeper for some of the time.
const LONGEST_SUBSTEP_UNBOUNDED_S: f64 = 1.25e-4;
/// Shortest substep that is chosen, s. What is faster than that is stable, but not resolved.
const SHORTEST_SUBSTEP_S: f64 = 4e-6;

fn choose_substeps(network: &Network, model: &Model, poses: &[Pose], period: f64) -> usize {
    let (mut stiffness, mut damping) = (network.stiffness.clone(), network.damping.clone());
    let mut longest = LONGEST_SUBSTEP_S;
    let along_paths = |element: &&Element| element.law.role() == Role::Path || network.at_a_point(element);
    for element in model.elements.iter().filter(along_paths) {
        let [first, second] = network.ends(element);
        if first != second {
            let slopes = element.law.slopes();
            if !slopes.bounded {
                longest = LONGEST_SUBSTEP_UNBOUNDED_S;
            }
            join(&mut stiffness, first, second, slopes.stiffness);
            join(&mut damping, first, second, slopes.damping);
        }
    }
    let free = network.free_bodies.len();
    let fastest = largest_ratio(poses, &stiffness, free).sqrt();
    let quickest_decay = largest_ratio(poses, &damping, free);
    let longest = longest.min(PHASE_PER_SUBSTEP / fastest).min(DECAY_PER_SUBSTEP / quickest_decay).max(SHORTEST_SUBSTEP_S);
    let count = (period / longest - 1e-9).ceil();
    if count.is_finite() { count.clamp(1.0, 100_000.0) as usize } else { 1 }
}

/// What depends on a robot's pose; the only one of a network without a robot.
struct Pose {
    mass: DMatrix<f64>,
    /// Its Cholesky factor.
    factor: DMatrix<f64>,
    points: Points,
}

/// The largest of all poses of a robot.
fn largest_ratio(poses: &[Pose], matrix: &Square, free: usize) -> f64 {
    poses.iter().fold(0.0, |largest: f64, pose| largest.max(dense::largest_ratio(&pose.factor, &folded(matrix, free, &pose.points))))
}

/// The block between the free places, with what a matrix has at points brought to the joints that carry them: `Tᵀ matrix T`.
fn folded(matrix: &Square, free: usize, points: &Points) -> DMatrix<f64> {
    let places: Vec<usize> = (0..free).chain(points.places()).collect();
    let to_places = DMatrix::from_fn(places.len(), free, |place, slot| points.share(places[place], slot));
    let all = DMatrix::from_fn(places.len(), places.len(), |i, j| matrix[places[i]][places[j]]);
    if points.is_empty() { all } else { to_places.transpose() * all * to_places }
}

/// Every element by what a stepper makes of it.
fn parts(model: &Model, network: &Network) -> (Vec<Share>, Vec<FrictionContact>, Vec<PathElement>) {
    let ends = |element: &Element| network.ends(element);
    let (mut elements, mut frictions, mut paths) = (Vec::new(), Vec::new(), Vec::new());
    for element in &model.elements {
        let [first, second] = ends(element);
        elements.push(match element.law.role() {
            Role::Linear(linear) if !network.at_a_point(element) => Share::Linear(linear, first, second),
            Role::Friction => {
                frictions.push(FrictionContact::new(first, second, &element.law));
                Share::Friction(frictions.len() - 1)
            }
            Role::Path | Role::Linear(_) => {
                paths.push(PathElement::new(first, second, &element.law));
                Share::Path(paths.len() - 1)
            }
        });
    }
    for (index, share) in elements.iter().enumerate() {
        if let Share::Friction(contact) = share {
            frictions[*contact].joint = joint(model, index, &elements, ends);
        }
    }
    (elements, frictions, paths)
}

/// The joint that loads the friction contact that is this element of the model.
fn joint(model: &Model, element: usize, shares: &[Share], ends: impl Fn(&Element) -> [usize; 2]) -> Joint {
    let mut joint = Joint::default();
    for (index, sign) in load::joint(model, element) {
        let [first, second] = ends(&model.elements[index]);
        (joint.first, joint.second) = if sign > 0.0 { (first, second) } else { (second, first) };
        match shares[index] {
            Share::Linear(linear, ..) => {
                joint.stiffness += linear.stiffness;
                joint.force += sign * linear.force;
            }
            Share::Path(path) => joint.paths.push((path, sign)),
            Share::Friction(_) => {}
        }
    }
    joint
}

impl Plant {
    /// Compiles a model for samples `period_s` seconds apart.
    ///
    /// # Errors
    /// When the model cannot be stepped; the error names what is wrong with it.
    pub fn new(model: &Model, period_s: f64, options: &Options) -> Result<Plant, CompileError> {
        plant(model, period_s, options)
    }
}

/// See [`Plant::new`].
fn plant(model: &Model, period: f64, options: &Options) -> Result<Plant, CompileError> {
    check_sizes(model, period, options)?;
    check(model)?;
    let mut network = assemble(model)?;
    let free = network.free_bodies.len();
    let mut links = model.arm.as_ref().map(|arm| Box::new(Links::new(arm, &network.slots, free, network.mass.clone())));
    // In other poses the links may weigh less on their joints, and their points move otherwise.
    let mut others: Vec<(Square, Points)> = Vec::new();
    if let (Some(arm), Some(links)) = (&model.arm, &mut links) {
        for pose in arm.poses() {
            let (mass, mut points) = (links.mass_at(&pose), network.points.clone());
            links.find_points(&mut points, &mut [0.0; SLOTS]);
            others.push((mass, points));
        }
    }
    if !others.is_empty() {
        (network.mass, network.points) = others.remove(0);
    }
    let mass = block(&network.mass, free);
    let massless = |row: usize| CompileError::Massless(model.bodies[network.free_bodies[row]].name.clone());
    let factor = dense::cholesky(&mass).map_err(massless)?;
    let inverse_mass = dense::inverse(&mass).ok_or(CompileError::Singular)?;
    let mut poses = vec![Pose { mass, factor, points: network.points.clone() }];
    for (mass, points) in others {
        let mass = block(&mass, free);
        poses.extend(dense::cholesky(&mass).ok().map(|factor| Pose { mass, factor, points }));
    }

    let linear = links.is_none()
        && model.elements.iter().all(|element| {
            let nothing_between = element.between[0] == element.between[1];
            nothing_between || matches!(element.law.role(), Role::Linear(_))
        });
    let delayed = model.outputs.iter().any(|output| output.delay > 0.0);
    let substeps = match options.substeps {
        Some(n) => n,
        None if linear && !delayed && Propagator::holds(free, &model.inputs) => 1,
        None => choose_substeps(&network, model, &poses, period),
    };
    let substep = period / substeps as f64;
    let mut drives: Vec<Drive> = model.inputs.iter().map(|input| Drive::new(input, network.slots[input.on], period, substep)).collect();
    for index in 1..drives.len() {
        drives[index].is_first = !drives[..index].iter().any(|other| !other.moves && other.slot == drives[index].slot);
    }

    let (elements, frictions, mut paths) = parts(model, &network);

    let stiffness = block(&network.stiffness, free);
    let damping = block(&network.damping, free);
    let theta = if largest_ratio(&poses, &network.stiffness, free).sqrt() * substep < 1.2 { 1.0 / 3.0 } else { 1.0 };
    let system = |mass: &DMatrix<f64>| mass * (2.0 / substep) + &damping + &stiffness * (theta * 0.5 * substep);
    let from_force = dense::inverse(&system(&poses[0].mass)).ok_or(CompileError::Singular)?;
    let answer = |pose: &Pose| dense::inverse(&system(&pose.mass)).map(|inverse| (columns(&inverse), pose.points.clone()));
    let from_forces: Vec<(Columns, Points)> = poses.iter().filter_map(answer).collect();
    let mut from_prescribed = vec![[[0.0; SLOTS]; 3]; network.prescribed];
    for (p, weights) in from_prescribed.iter_mut().enumerate() {
        for (matrix, weights) in [&network.stiffness, &network.damping, &network.mass].into_iter().zip(weights) {
            for (i, weight) in weights.iter_mut().enumerate().take(free) {
                *weight = -(0..free).map(|j| from_force[(i, j)] * matrix[j][prescribed_slot(p)]).sum::<f64>();
            }
        }
    }
    let constraints = Constraints::new(&from_forces, free, substep, &frictions, &mut paths);
    let sparse = links.is_none().then(|| Sparse::new(&system(&poses[0].mass), &network.stiffness, &network.damping, substep)).flatten();
    let fixed = Compiled {
        sparse,
        free,
        prescribed: network.prescribed,
        points: network.points,
        inverse_mass: columns(&inverse_mass),
        theta,
        from_position: columns(&(-(&from_force * &stiffness))),
        from_velocity: columns(&(-(&from_force * (&damping + &stiffness * (0.5 * substep))))),
        from_force: columns(&from_force),
        from_prescribed,
        elements,
        constraints,
        slots: network.slots,
        mass: network.mass,
        damping: network.damping,
        stiffness: network.stiffness,
        constant: network.constant,
    };
    let work = Box::new(Work::new(frictions.len()));
    let exact = if linear { Propagator::new(&fixed, &drives, substep) } else { None };
    let sense = Sense::new(model, &fixed.slots, &fixed.elements, substep, options);
    let mut plant = Plant {
        fixed,
        period,
        substep,
        substeps,
        periods: 0,
        x: [0.0; SLOTS],
        v: [0.0; SLOTS],
        prescribed_acceleration: [0.0; SLOTS],
        pushed: [0.0; SLOTS],
        drives,
        frictions,
        paths,
        work,
        motion: Some(Box::new(Motion::new())),
        instant: Some(Box::new(Endpoint::new())),
        sense,
        energy: None,
        exact,
        links,
    };
    plant.reset();
    Ok(plant)
}
