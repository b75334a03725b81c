//! A robot as data: the content of its file, with every name resolved and every number in SI units. Nothing is computed here.

use super::spatial::Placement;
use nalgebra::{Matrix3, Vector3};

/// A tree of links.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Short id.
    pub name: String,
    /// Acceleration of free fall, seen from the base, m/s².
    pub gravity: Vector3<f64>,
    /// Every link. The first is the base, which does not move.
    pub links: Vec<Link>,
    /// Every joint, each with the one link that it carries.
    pub joints: Vec<Joint>,
    /// Motors that the file names.
    pub actuators: Vec<Actuator>,
}

/// Free fall on earth where a file gives no other value, m/s².
pub const STANDARD_GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

impl Default for Robot {
    fn default() -> Robot {
        Robot {
            name: String::new(),
            gravity: Vector3::from(STANDARD_GRAVITY),
            links: Vec::new(),
            joints: Vec::new(),
            actuators: Vec::new(),
        }
    }
}

/// A rigid link. Its frame is that of the joint which carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Unique in the robot.
    pub name: String,
    /// `None` for a link of no mass, such as a tool's tip.
    pub inertia: Option<LinkInertia>,
}

/// Mass of a link and how it is spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the link's frame, m.
    pub centre: Vector3<f64>,
    /// About the centre of mass, along the axes of the link's frame, kg m².
    pub about_centre: Matrix3<f64>,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis; its coordinate is in rad, its force in N m.
    Revolute,
    /// Slides along its axis; its coordinate is in m, its force in N.
    Prismatic,
    /// Does not move.
    Fixed,
}

impl JointKind {
    /// Unit of the coordinate; empty where there is none.
    pub fn unit(self) -> &'static str {
        match self {
            JointKind::Revolute => "rad",
            JointKind::Prismatic => "m",
            JointKind::Fixed => "",
        }
    }
}

/// The limits of a joint in a file. The mechanics does not enforce it: a stop is an element, such as a `contact`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Between which coordinates, rad or m.
    pub range: Option<[f64; 2]>,
    /// Largest force, N m or N.
    pub effort: Option<f64>,
    /// Largest speed, rad/s or m/s.
    pub velocity: Option<f64>,
}

/// A joint between two links.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Unique in the robot.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Index of the link that carries it.
    pub parent: usize,
    /// Index of the link that it carries.
    pub child: usize,
    /// Where its frame is in the parent's when it is not displaced.
    pub origin: Placement,
    /// Unit vector in its frame.
    pub axis: Vector3<f64>,
    /// Coordinate at which it is not displaced, rad or m.
    pub reference: f64,
    /// Inertia of what only turns (slides) with the coordinate, such as a rotor seen through its gear, kg m² (kg).
    pub armature: f64,
    /// Viscous friction, N m s/rad (N s/m).
    pub damping: f64,
    /// Dry friction, N m (N).
    pub friction: f64,
    /// Of a spring that pulls the coordinate to `rest`, N m/rad (N/m).
    pub stiffness: f64,
    /// Coordinate at which that spring is slack, rad (m).
    pub rest: f64,
    /// What it may do.
    pub limits: Limits,
}

impl Joint {
    /// A joint of this kind from one link to another, at the parent's frame and about its z axis, with no inertia, friction or spring of its own.
    pub fn new(name: &str, kind: JointKind, parent: usize, child: usize) -> Joint {
        Joint {
            name: name.to_owned(),
            kind,
            parent,
            child,
            origin: Placement::default(),
            axis: Vector3::z(),
            reference: 0.0,
            armature: 0.0,
            damping: 0.0,
            friction: 0.0,
            stiffness: 0.0,
            rest: 0.0,
            limits: Limits::default(),
        }
    }
}

/// A motor on a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// Unique among the actuators.
    pub name: String,
    /// Index of the joint that it drives.
    pub joint: usize,
    /// Force on the joint per unit of command, N m or N.
    pub gear: f64,
    /// Largest force on the joint, N m or N; infinite when there is no limit.
    pub limit: f64,
}

impl Robot {
    /// Index of a link by its name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Index of a joint by its name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }
}
