//! A robot made ready for computing: bodies that move against each other, numbered from the base outwards.

use super::articulated::ArticulatedInertia;
use super::description::{JointKind, Robot};
use super::error::RobotError;
use super::inertia::Inertia;
use super::spatial::{Placement, Twist, Wrench};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// A tree of moving bodies. What is fixed to a body is part of it. Coordinates are numbered from the base outwards, branch by branch in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    pub(super) bodies: Vec<Body>,
    /// Of each link of the robot: the body that it is part of (`None` for the base), and where it is in it.
    pub(super) links: Vec<(Option<usize>, Placement)>,
    pub(super) coordinates: Vec<Coordinate>,
    /// Seen from the base, m/s².
    pub(super) gravity: Vector3<f64>,
}

/// One coordinate of a tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name of the joint.
    pub name: String,
    /// Index of the joint in [`Robot::joints`].
    pub joint: usize,
    /// Revolute or prismatic.
    pub kind: JointKind,
}

/// A body and the joint that carries it. Its frame is that of the joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    /// `None` for the base.
    pub(super) parent: Option<usize>,
    /// The bodies that it carries, directly or not, are the next ones, up to this one (excluded).
    pub(super) branch_end: usize,
    /// Its frame in the parent's when the joint is not displaced.
    pub(super) origin: Placement,
    /// S: velocity per unit of the coordinate's rate, in its frame.
    pub(super) axis: Twist,
    /// The axis as a cross product, and that twice; of a revolute joint.
    turn: Option<[Matrix3<f64>; 2]>,
    pub(super) reference: f64,
    pub(super) armature: f64,
    pub(super) inertia: Inertia,
}

/// Space for computing, and what was computed last. It belongs to the tree that made it.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// Each body's frame in its parent's, and in the base's.
    pub(super) in_parent: Vec<Placement>,
    pub(super) in_base: Vec<Placement>,
    pub(super) velocity: Vec<Twist>,
    pub(super) acceleration: Vec<Twist>,
    pub(super) force: Vec<Wrench>,
    /// Velocities and accelerations of a second motion.
    pub(super) other_velocity: Vec<Twist>,
    pub(super) composite: Vec<Inertia>,
    pub(super) articulated: Vec<ArticulatedInertia>,
    /// Of articulated bodies: U, D and u.
    pub(super) resistance: Vec<Wrench>,
    pub(super) give: Vec<f64>,
    pub(super) surplus: Vec<f64>,
}

impl Body {
    /// Its frame in the parent's at this coordinate.
    #[inline]
    pub(super) fn in_parent(&self, coordinate: f64) -> Placement {
        let displaced = coordinate - self.reference;
        match &self.turn {
            Some([cross, twice]) => {
                // Rodrigues' formula.
                let (sin, cos) = displaced.sin_cos();
                let turned = Matrix3::identity() + cross * sin + twice * (1.0 - cos);
                Placement { rotation: self.origin.rotation * turned, translation: self.origin.translation }
            }
            None => {
                let shift = self.axis.linear * displaced;
                Placement { rotation: self.origin.rotation, translation: self.origin.translation + self.origin.rotation * shift }
            }
        }
    }
}

impl Tree {
    /// Makes a robot ready for computing.
    ///
    /// # Errors
    /// Where the links are no tree, a number is none that a body can have, or a joint moves nothing that has inertia.
    pub fn new(robot: &Robot) -> Result<Tree, RobotError> {
        let tree = Tree::unchecked(robot, robot.check()?);
        let mut matrix = DMatrix::zeros(tree.len(), tree.len());
        let rest: Vec<f64> = tree.bodies.iter().map(|body| body.reference).collect();
        tree.mass_matrix(&rest, &mut tree.workspace(), &mut matrix);
        match (0..tree.len()).find(|i| matrix[(*i, *i)].is_nan() || matrix[(*i, *i)] <= 0.0) {
            None => Ok(tree),
            Some(i) => {
                let joint = tree.coordinates[i].joint;
                let child = robot.joints.get(joint).and_then(|j| robot.links.get(j.child)).map_or("?", |link| link.name.as_str());
                let message =
                    format!("nothing that it moves has inertia: give link \"{child}\", or one that it carries, a mass and an inertia");
                Err(robot.fault_of_joint(joint, message))
            }
        }
    }

    /// `order`: joints, each before what it carries.
    fn unchecked(robot: &Robot, order: Vec<usize>) -> Tree {
        let mut links = vec![(None, Placement::default()); robot.links.len()];
        let (mut bodies, mut coordinates): (Vec<Body>, Vec<Coordinate>) = (Vec::new(), Vec::new());
        for index in order {
            let joint = &robot.joints[index];
            let (carrier, place): (Option<usize>, Placement) = links[joint.parent];
            let origin = place.then(&joint.origin);
            let inertia =
                robot.links[joint.child].inertia.map_or_else(Inertia::default, |i| Inertia::new(i.mass, i.centre, i.about_centre));
            let (axis, turn) = match joint.kind {
                JointKind::Fixed => {
                    links[joint.child] = (carrier, origin);
                    if let Some(body) = carrier {
                        bodies[body].inertia += inertia.outside(&origin);
                    }
                    continue;
                }
                JointKind::Revolute => {
                    let cross = joint.axis.cross_matrix();
                    (Twist { angular: joint.axis, linear: Vector3::zeros() }, Some([cross, cross * cross]))
                }
                JointKind::Prismatic => (Twist { angular: Vector3::zeros(), linear: joint.axis }, None),
            };
            links[joint.child] = (Some(bodies.len()), Placement::default());
            coordinates.push(Coordinate { name: joint.name.clone(), joint: index, kind: joint.kind });
            let (reference, armature) = (joint.reference, joint.armature);
            bodies.push(Body { parent: carrier, branch_end: 0, origin, axis, turn, reference, armature, inertia });
        }
        for i in (0..bodies.len()).rev() {
            bodies[i].branch_end = bodies[i].branch_end.max(i + 1);
            if let Some(parent) = bodies[i].parent {
                bodies[parent].branch_end = bodies[parent].branch_end.max(bodies[i].branch_end);
            }
        }
        Tree { bodies, links, coordinates, gravity: robot.gravity }
    }

    /// How many coordinates there are.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// What each coordinate is, in their order.
    pub fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    /// Coordinates at which no joint is displaced.
    pub fn references(&self) -> Vec<f64> {
        self.bodies.iter().map(|body| body.reference).collect()
    }

    /// Inertia of what only moves with this coordinate, kg m² or kg; replaces the robot's own.
    pub fn set_armature(&mut self, coordinate: usize, armature: f64) {
        if let Some(body) = self.bodies.get_mut(coordinate) {
            body.armature = armature;
        }
    }

    /// Without gravity: as the joints feel it where forces of their motors hold the links' weight in every pose.
    pub fn weightless(&mut self) {
        self.gravity = Vector3::zeros();
    }

    /// Mass of all bodies that move, kg.
    pub fn moving_mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.inertia.mass).sum()
    }

    /// Space for computing.
    pub fn workspace(&self) -> Workspace {
        let count = self.len();
        Workspace {
            in_parent: vec![Placement::default(); count],
            in_base: vec![Placement::default(); count],
            velocity: vec![Twist::default(); count],
            acceleration: vec![Twist::default(); count],
            force: vec![Wrench::default(); count],
            other_velocity: vec![Twist::default(); count],
            composite: vec![Inertia::default(); count],
            articulated: vec![ArticulatedInertia::zero(); count],
            resistance: vec![Wrench::default(); count],
            give: vec![0.0; count],
            surplus: vec![0.0; count],
        }
    }
}
