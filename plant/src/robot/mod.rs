//! Arms: a tree of rigid links beside the network of elements.
//!
//! A [`Robot`] is the content of a robot file: links with their inertia, joints with their axes, all names resolved. A [`Tree`] is the same made
//! ready for computing: links that are fixed to each other are one body, and every moving joint is one coordinate. It knows
//! - where every link is, and how it moves with the coordinates ([`Tree::place`], [`Tree::jacobian`]),
//! - what force a motion takes (recursive Newton-Euler, [`Tree::inverse_dynamics`]) and what motion a force makes (articulated bodies,
//!   [`Tree::forward_dynamics`]),
//! - the mass matrix (composite bodies, [`Tree::mass_matrix`]) and the matrix of Coriolis forces ([`Tree::coriolis_matrix`]),
//! - what gravity asks of the joints, and the energies,
//! - how a [`Point`] of a link moves, and so what a force on it does to the joints.
//!
//! The algorithms are those of R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008 (RBDA below). Nothing is allocated while computing: a
//! [`Workspace`] is made once and handed in. Units are SI: a coordinate and its force are rad and N m of a revolute joint, m and N of a prismatic one.

mod arm;
mod articulated;
mod check;
mod coriolis;
mod description;
mod energy;
mod error;
mod file;
mod forward_dynamics;
mod found;
mod gravity_stiffness;
mod inertia;
mod inverse_dynamics;
mod kinematics;
mod mass_matrix;
mod mjcf;
mod payload;
mod point;
mod spatial;
mod tree;
mod urdf;
mod xml;

pub use arm::Arm;
pub use description::{Actuator, Joint, JointKind, Limits, Link, LinkInertia, Robot};
pub use error::{Part, RobotError};
pub use file::RobotFile;
pub use found::Remark;
pub use inertia::Inertia;
pub use payload::Payload;
pub use point::Point;
pub use spatial::{Placement, Twist, Wrench};
pub use tree::{Coordinate, Tree, Workspace};
