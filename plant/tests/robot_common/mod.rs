//! Random trees of links, the same for every test.

#![allow(dead_code)] // each test program uses its own part

use backdrive_plant::robot::{Joint, JointKind, Link, LinkInertia, Placement, Robot, Tree};
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub struct Draw(ChaCha8Rng);

impl Draw {
    pub fn new(seed: u64) -> Draw {
        Draw(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    pub fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-size, size))
    }

    pub fn numbers(&mut self, count: usize, size: f64) -> Vec<f64> {
        (0..count).map(|_| self.between(-size, size)).collect()
    }

    pub fn rotation(&mut self) -> Matrix3<f64> {
        *Rotation3::from_euler_angles(self.between(-3.0, 3.0), self.between(-1.5, 1.5), self.between(-3.0, 3.0)).matrix()
    }

    /// A body of a few points: its inertia is one that a body can have.
    pub fn inertia(&mut self) -> LinkInertia {
        let points: Vec<(f64, Vector3<f64>)> = (0..5).map(|_| (self.between(0.1, 1.0), self.vector(0.2))).collect();
        let mass: f64 = points.iter().map(|p| p.0).sum();
        let centre = points.iter().map(|p| p.0 * p.1).sum::<Vector3<f64>>() / mass;
        let about_centre: Matrix3<f64> = points.iter().map(|(m, p)| -*m * (p - centre).cross_matrix() * (p - centre).cross_matrix()).sum();
        LinkInertia { mass, centre, about_centre: 0.5 * (about_centre + about_centre.transpose()) }
    }

    /// A tree of `joints` joints, some of them fixed, each on any link that is there already.
    pub fn robot(&mut self, joints: usize) -> Robot {
        let mut robot = Robot { name: "random".into(), gravity: self.vector(10.0), ..Robot::default() };
        robot.links.push(Link { name: "base".into(), inertia: None });
        for i in 0..joints {
            let kind = [JointKind::Revolute, JointKind::Revolute, JointKind::Prismatic, JointKind::Fixed][self.below(4)];
            let parent = if self.below(3) == 0 { self.below(robot.links.len()) } else { robot.links.len() - 1 };
            let mut joint = Joint::new(&format!("joint{i}"), kind, parent, robot.links.len());
            joint.origin = Placement { rotation: self.rotation(), translation: self.vector(0.4) };
            joint.axis = self.vector(1.0).normalize();
            joint.reference = self.between(-0.5, 0.5);
            joint.armature = self.between(0.0, 0.1);
            robot.joints.push(joint);
            robot.links.push(Link { name: format!("link{i}"), inertia: Some(self.inertia()) });
        }
        robot
    }
}

pub fn mass_matrix(tree: &Tree, q: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(tree.len(), tree.len());
    tree.mass_matrix(q, &mut tree.workspace(), &mut matrix);
    matrix
}

/// Largest difference, as a share of the largest number.
pub fn share(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(1e-300, |most: f64, x| most.max(x.abs()));
    found.iter().zip(expected).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / largest
}

/// A chain of thin rods that turn about -y and hang along x at 0, so that a positive angle lifts against gravity: masses (kg) and lengths (m).
pub fn rods(rods: &[(f64, f64)]) -> Robot {
    let mut robot = Robot { name: "rods".into(), ..Robot::default() };
    robot.links.push(Link { name: "base".into(), inertia: None });
    let mut reach = 0.0;
    for (i, (mass, length)) in rods.iter().enumerate() {
        let mut joint = Joint::new(&format!("joint{i}"), JointKind::Revolute, i, i + 1);
        joint.origin = Placement::at(Vector3::new(reach, 0.0, 0.0));
        joint.axis = -Vector3::y();
        reach = *length;
        robot.joints.push(joint);
        let across = mass * length * length / 12.0;
        let about_centre = Matrix3::from_diagonal(&Vector3::new(0.0, across, across));
        let inertia = LinkInertia { mass: *mass, centre: Vector3::new(0.5 * length, 0.0, 0.0), about_centre };
        robot.links.push(Link { name: format!("rod{i}"), inertia: Some(inertia) });
    }
    robot
}

/// The same chain as a URDF.
pub fn rods_urdf(rods: &[(f64, f64)]) -> String {
    let mut text = "<robot name=\"rods\"><link name=\"base\"/>".to_owned();
    let (mut reach, mut parent) = (0.0, "base".to_owned());
    for (i, (mass, length)) in rods.iter().enumerate() {
        let across = mass * length * length / 12.0;
        text += &format!(
            "<link name=\"rod{i}\"><inertial><origin xyz=\"{} 0 0\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"{across}\" iyz=\"0\" izz=\"{across}\"/></inertial></link>\
             <joint name=\"joint{i}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"rod{i}\"/>\
             <origin xyz=\"{reach} 0 0\"/><axis xyz=\"0 -1 0\"/></joint>",
            0.5 * length
        );
        (reach, parent) = (*length, format!("rod{i}"));
    }
    text + "</robot>"
}
