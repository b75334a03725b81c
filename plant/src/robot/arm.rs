//! A robot in a network: its joints are bodies of the network.

use super::description::{JointKind, Robot};
use super::error::RobotError;
use super::found::Remark;
use super::tree::{Tree, Workspace};
use nalgebra::DMatrix;

/// Poses that an arm is looked at in, where a bound over all of them is wanted.
const POSES: usize = 24;
/// How far a prismatic joint without limits is taken to move, m.
const REACH: f64 = 1.0;

/// A robot whose joints are bodies of a network. The position of such a body is the joint's coordinate less that of the pose; its own inertia is the
/// joint's armature; the inertia of the links, their Coriolis forces and gravity come from the tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The robot file's text.
    pub xml: String,
    /// What the file says.
    pub robot: Robot,
    /// The robot ready for computing, without armatures.
    pub tree: Tree,
    /// Body of the network that each coordinate is.
    pub bodies: Vec<usize>,
    /// Coordinates when every position of the network is 0, rad or m.
    pub pose: Vec<f64>,
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
        Ok(Arm { xml, robot, tree, bodies, pose, remarks: Vec::new() })
    }

    /// The mass matrix of the links over all bodies of a network, at the pose, kg m² or kg.
    pub fn inertia_at_pose(&self, bodies: usize) -> DMatrix<f64> {
        self.over_bodies(bodies, |work, matrix| self.tree.mass_matrix(&self.pose, work, matrix))
    }

    /// Stiffness that gravity makes, over all bodies of a network, at the pose, N m/rad and the like.
    pub fn gravity_stiffness_at_pose(&self, bodies: usize) -> DMatrix<f64> {
        self.over_bodies(bodies, |work, matrix| self.tree.gravity_stiffness(&self.pose, work, matrix))
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
