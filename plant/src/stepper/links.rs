//! A robot at work: what its links make of a substep.
//!
//! Over a substep h, with `M` the mass matrix of the links, `C` their Coriolis matrix and `g` gravity, all in the middle `q + h v/2`,
//!
//! `M (v₁ - v₀)/h + C(v₀) v₁ + g = F`, `q₁ = q₀ + h (v₀ + v₁)/2`.
//!
//! `C(v₀) v₁ = C(v₁) v₀`, and the middle is also `q₁ - h v₁/2`, so the rule is the same backwards in time: of second order, and without a drift of the energy.
//! It is linear in `v₁`, so it joins what the elements already are to a substep, and dry friction and stiff elements are solved with it, over all joints
//! at once. (Polarising a quadratic force so is Kahan's method, see E. Celledoni, R. McLachlan, B. Owren and G. Quispel, J. Phys. A 46 (2013) 025201.)

use super::compiled::Compiled;
use super::dense;
use super::motion::Motion;
use super::points::Points;
use super::slots::{Columns, SLOTS, Slots, Square, prescribed_slot};
use crate::robot::{Arm, Point, Tree, Twist, Workspace};
use nalgebra::DMatrix;

/// The links of a robot at work.
#[derive(Debug, Clone)]
pub(super) struct Links {
    tree: Tree,
    work: Workspace,
    /// Place of each coordinate.
    slots: Vec<usize>,
    pose: Vec<f64>,
    /// Inertia of the network without the links.
    own_mass: Square,
    q: Vec<f64>,
    v: Vec<f64>,
    gravity: Vec<f64>,
    mass: DMatrix<f64>,
    coriolis: DMatrix<f64>,
    /// Coriolis forces and gravity by place, at the last instant that was evaluated, N m or N.
    pub(super) bias: Slots,
    /// Energy in gravity there, less that at the pose, J.
    pub(super) potential: f64,
    potential_at_pose: f64,
    /// Points of links, each with its distance along its axis at the pose, m.
    points: Vec<(Point, f64)>,
    columns: Vec<Twist>,
    row: Vec<f64>,
    /// Space for the equations of a substep.
    system: Columns,
}

impl Links {
    /// `slots`: place of each body of the model; `free` of them are not on a motion input; `own_mass`: inertia of the network without the links.
    pub(super) fn new(arm: &Arm, slots: &[usize], free: usize, own_mass: Square) -> Links {
        let (mut tree, count) = (arm.tree.clone(), arm.tree.len());
        if arm.gravity_compensated {
            tree.weightless();
        }
        let mut work = tree.workspace();
        let potential_at_pose = tree.potential_energy(&arm.pose, &mut work);
        tree.place(&arm.pose, &mut work);
        let at_pose = |point: &Point| tree.distance_here(point, &work);
        Links {
            potential_at_pose,
            points: arm.points.iter().map(|point| (point.clone(), at_pose(point))).collect(),
            columns: vec![Twist::default(); count],
            row: vec![0.0; count],
            system: Columns::new(free),
            slots: arm.bodies.iter().map(|body| slots[*body]).collect(),
            pose: arm.pose.clone(),
            own_mass,
            q: vec![0.0; count],
            v: vec![0.0; count],
            gravity: vec![0.0; count],
            mass: DMatrix::zeros(count, count),
            coriolis: DMatrix::zeros(count, count),
            bias: [0.0; SLOTS],
            potential: 0.0,
            tree,
            work,
        }
    }

    /// How many coordinates there are.
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Inertia of the network with the links at these coordinates.
    pub(super) fn mass_at(&mut self, coordinates: &[f64]) -> Square {
        self.tree.place(coordinates, &mut self.work);
        let mut mass = self.own_mass.clone();
        self.join_mass(&mut mass);
        mass
    }

    /// The rows of the points as the links are placed, and with `displacement` where the points are, m.
    pub(super) fn find_points(&mut self, points: &mut Points, displacement: &mut Slots) {
        for (index, place) in points.places().enumerate() {
            let Some((point, at_pose)) = self.points.get(index) else { return };
            displacement[place] = self.tree.distance_here(point, &self.work) - at_pose;
            self.tree.gradient_here(point, &self.work, &mut self.columns, &mut self.row);
            for (slot, value) in self.slots.iter().zip(&self.row) {
                points.rows[index][*slot] = *value;
            }
        }
    }

    /// The points at the end of a substep, with their velocities.
    pub(super) fn bring_points(&mut self, points: &mut Points, x: &mut Slots, v: &mut Slots) {
        for (i, slot) in self.slots.iter().enumerate() {
            self.q[i] = self.pose[i] + x[*slot];
        }
        self.tree.place(&self.q, &mut self.work);
        self.find_points(points, x);
        points.carry(v);
    }

    /// The inertia of the links as they are placed, beside the network's own.
    fn join_mass(&mut self, mass: &mut Square) {
        self.tree.mass_matrix_here(&mut self.work, &mut self.mass);
        for (i, a) in self.slots.iter().enumerate() {
            for (j, b) in self.slots.iter().enumerate() {
                mass[*a][*b] = self.own_mass[*a][*b] + self.mass[(i, j)];
            }
        }
    }

    /// What the links make of the substep that begins with velocities `v` and has the bodies at `motion.middle` in its middle.
    pub(super) fn enter(&mut self, fixed: &mut Compiled, substep: f64, v: &Slots, motion: &mut Motion) {
        for (i, slot) in self.slots.iter().enumerate() {
            (self.q[i], self.v[i]) = (self.pose[i] + motion.middle[*slot], v[*slot]);
        }
        self.tree.velocities(&self.q, &self.v, &mut self.work);
        if !self.points.is_empty() {
            self.find_points(&mut fixed.points, &mut motion.middle);
        }
        self.join_mass(&mut fixed.mass);
        self.tree.coriolis_matrix_here(&self.v, &mut self.work, &mut self.coriolis);
        self.tree.gravity_here(&mut self.work, &mut self.gravity);
        let free = fixed.free;
        // C(v₀) v₁, the part that is known before: of free bodies at v₀.
        self.bias_with(|slot| if slot < free { v[slot] } else { motion.end_velocity[slot] });
        for slot in self.slots.iter().filter(|slot| **slot < free) {
            motion.force[*slot] -= self.bias[*slot];
        }
        self.answer(fixed, substep);
    }

    /// Coriolis forces `C(v₀) u` and gravity, by place.
    #[inline]
    pub(super) fn bias_with(&mut self, u: impl Fn(usize) -> f64) {
        for (i, a) in self.slots.iter().enumerate() {
            let turned: f64 = self.slots.iter().enumerate().map(|(j, b)| self.coriolis[(i, j)] * u(*b)).sum();
            self.bias[*a] = self.gravity[i] + turned;
        }
    }

    /// What the bodies answer to forces in this substep.
    fn answer(&mut self, fixed: &mut Compiled, substep: f64) {
        let (n, theta) = (fixed.free, fixed.theta);
        let Compiled { mass, damping, stiffness, from_force, from_position, from_velocity, .. } = fixed;
        let system = &mut self.system;
        for i in 0..n {
            for j in 0..n {
                system[i][j] = 2.0 / substep * mass[i][j] + damping[i][j] + theta * 0.5 * substep * stiffness[i][j];
            }
        }
        for (i, a) in self.slots.iter().enumerate().filter(|(_, slot)| **slot < n) {
            for (j, b) in self.slots.iter().enumerate().filter(|(_, slot)| **slot < n) {
                // The end's velocity is the start's and twice what is solved for.
                system[*a][*b] += 2.0 * self.coriolis[(i, j)];
            }
        }
        if !dense::invert(system, n) {
            system.fill(f64::NAN);
        }
        for j in 0..n {
            for i in 0..n {
                from_force[j][i] = system[i][j];
            }
        }
        for j in 0..n {
            let (by_position, by_velocity) = (&mut from_position[j], &mut from_velocity[j]);
            by_position.fill(0.0);
            by_velocity.fill(0.0);
            // Few bodies are tied to each other.
            for k in (0..n).filter(|k| stiffness[*k][j] != 0.0 || damping[*k][j] != 0.0) {
                let (stiffness, column) = (stiffness[k][j], &from_force[k]);
                let damping = damping[k][j] + 0.5 * substep * stiffness;
                for i in 0..n {
                    by_position[i] -= column[i] * stiffness;
                    by_velocity[i] -= column[i] * damping;
                }
            }
        }
        for (p, weights) in fixed.from_prescribed.iter_mut().enumerate() {
            let slot = prescribed_slot(p);
            for (weights, matrix) in weights.iter_mut().zip([&*stiffness, &*damping, &*mass]) {
                for (i, weight) in weights.iter_mut().enumerate().take(n) {
                    *weight = -(0..n).map(|j| system[i][j] * matrix[j][slot]).sum::<f64>();
                }
            }
        }
        fixed.constraints.answer_by(&fixed.from_force, n, &fixed.points);
    }

    /// What is known of the links at an instant; `fixed.mass` is then of it, too, and so are the points.
    pub(super) fn at(&mut self, fixed: &mut Compiled, x: &mut Slots, v: &mut Slots) {
        for (i, slot) in self.slots.iter().enumerate() {
            (self.q[i], self.v[i]) = (self.pose[i] + x[*slot], v[*slot]);
        }
        self.tree.velocities(&self.q, &self.v, &mut self.work);
        self.join_mass(&mut fixed.mass);
        self.tree.bias_here(&self.v, &mut self.work, &mut self.gravity);
        for (i, slot) in self.slots.iter().enumerate() {
            self.bias[*slot] = self.gravity[i];
        }
        if !self.points.is_empty() {
            self.find_points(&mut fixed.points, x);
            fixed.points.carry(v);
            for ((point, _), drift) in self.points.iter().zip(&mut fixed.points.drift) {
                *drift = self.tree.drift_here(point, &self.v, &self.work, &mut self.columns);
            }
        }
        self.potential = self.tree.potential_energy_here(&self.work) - self.potential_at_pose;
    }
}
