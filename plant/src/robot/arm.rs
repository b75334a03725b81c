//! A robot in a network: its joints are bodies of the network.

use super::description::{JointKind, Robot};
use super::error::RobotError;
use super::found::Remark;
use super::point::Point;
use super::spatial::Twist;
use super::tree::{Tree, Workspace};
use nalgebra::DMatrix;

/// Poses at which an arm is evaluated, where a bound over all of them is wanted.
const POSES: usize = 24;
/// How far a prismatic joint without limits is taken to move, m.
const REACH: f64 = 1.0;

/// A robot whose joints are bodies of a network. The position of such a body is the joint's coordinate less that of the pose. Its own inertia is the
/// joint's armature; the inertia of the links, their Coriolis forces and gravity come from the tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The robot file's text.
    pub xml: String,
    /// The content of the file.
    pub robot: Robot,
    /// The robot ready for computing, without armatures.
    pub tree: Tree,
    /// Body of the network that each coordinate is.
    pub bodies: Vec<usize>,
    /// Coordinates when every position of the network is 0, rad or m.
    pub pose: Vec<f64>,
    /// Points of links that are bodies of the network, too.
    pub points: Vec<Point>,
    /// Whether the joints' motors hold the weight of the links: forces `g(q)` of the present pose, as a controller with a right model adds them.
    pub gravity_compensated: bool,
    /// What of the file was left aside.
    pub remarks: Vec<Remark>,
}

impl Arm {
    /// A robot whose coordinates are the bodies from `first_body` on, posed where no joint is displaced.
    ///
    /// # Errors
    /// Where the robot cannot be computed.
    pub fn new(xml: String, robot: Robot, first_body: usize) -> Result<Arm, RobotError> {
        let mut tree = Tree::new(&robot)?;
        (0..tree.len()).for_each(|i| tree.set_armature(i, 0.0));
        let (bodies, pose) = ((first_body..first_body + tree.len()).collect(), tree.references());
        Ok(Arm { xml, robot, tree, bodies, pose, points: Vec::new(), gravity_compensated: false, remarks: Vec::new() })
    }

    /// The mass matrix of the links over all bodies of a network, at the pose, kg m² or kg.
    pub fn inertia_at_pose(&self, bodies: usize) -> DMatrix<f64> {
        self.over_bodies(bodies, |work, matrix| self.tree.mass_matrix(&self.pose, work, matrix))
    }

    /// Stiffness that gravity makes, over all bodies of a network, at the pose, N m/rad and the like; none where motors hold the links' weight in every pose.
    pub fn gravity_stiffness_at_pose(&self, bodies: usize) -> DMatrix<f64> {
        if self.gravity_compensated {
            return DMatrix::zeros(bodies, bodies);
        }
        self.over_bodies(bodies, |work, matrix| self.tree.gravity_stiffness(&self.pose, work, matrix))
    }

    /// How each point's displacement changes with each body of a network, at the pose: 0 but for the joints.
    pub fn gradients_at_pose(&self, bodies: usize) -> Vec<Vec<f64>> {
        let mut work = self.tree.workspace();
        self.tree.place(&self.pose, &mut work);
        let (mut columns, mut row) = (vec![Twist::default(); self.tree.len()], vec![0.0; self.tree.len()]);
        let over_bodies = |point| {
            self.tree.gradient_here(point, &work, &mut columns, &mut row);
            let mut all = vec![0.0; bodies];
            self.bodies.iter().zip(&row).for_each(|(body, value)| all[*body] = *value);
            all
        };
        self.points.iter().map(over_bodies).collect()
    }

    /// Whether a body of the network is a joint or a point, whose motion the links determine.
    pub fn moves(&self, body: usize) -> bool {
        self.bodies.contains(&body) || self.is_point(body)
    }

    /// Whether a body of the network is a point of a link.
    pub fn is_point(&self, body: usize) -> bool {
        self.points.iter().any(|point| point.body == body)
    }

    fn over_bodies(&self, bodies: usize, compute: impl Fn(&mut Workspace, &mut DMatrix<f64>)) -> DMatrix<f64> {
        let mut own = DMatrix::zeros(self.tree.len(), self.tree.len());
        compute(&mut self.tree.workspace(), &mut own);
        let mut all = DMatrix::zeros(bodies, bodies);
        for (i, a) in self.bodies.iter().enumerate() {
            for (j, b) in self.bodies.iter().enumerate() {
                all[(*a, *b)] = own[(i, j)];
            }
        }
        all
    }

    /// Poses spread over what the joints can do, the same every time; the first is the arm's own.
    pub fn poses(&self) -> Vec<Vec<f64>> {
        let spread = |k: usize, i: usize| {
            // Multiples of irrational numbers, each coordinate its own.
            let share = (k as f64 * ((i + 2) as f64).sqrt()).fract();
            let coordinate = &self.tree.coordinates()[i];
            let half = if coordinate.kind == JointKind::Prismatic { REACH } else { std::f64::consts::PI };
            let limits = self.robot.joints.get(coordinate.joint).and_then(|joint| joint.limits.range);
            let [low, high] = limits.unwrap_or([self.pose[i] - half, self.pose[i] + half]);
            low + share * (high - low)
        };
        let others = (1..=POSES).map(|k| (0..self.pose.len()).map(|i| spread(k, i)).collect());
        std::iter::once(self.pose.clone()).chain(others).collect()
    }
}
