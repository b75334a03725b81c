//! Ten inertial parameters of each moving body, in which the torque of a motion is linear.
//!
//! Mass, mass times centre of mass, and the matrix of inertia about the origin of the body's frame (Atkeson, An & Hollerbach, Estimation of inertial
//! parameters of manipulator loads and links, IJRR 5(3), 1986).

use backdrive_plant::robot::{Inertia, LinkInertia, Robot, Tree};
use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, Vector3};

/// How many there are for a body.
pub const COUNT: usize = 10;
/// How thin a body is taken to be at the least, as a share of its extent.
const THIN: f64 = 0.1;
/// Their names, each followed by the joint's number: `m1`, `mx1`, ..., `Izz1`.
pub const NAMES: [&str; COUNT] = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];

/// A matrix over the parameters of a body.
pub type Basis = SMatrix<f64, COUNT, COUNT>;

/// The parameters of a body: kg, kg m (three), kg m² (xx, xy, xz, yy, yz, zz, about the origin of its frame).
pub type Parameters = [f64; COUNT];

/// Of an inertia about the frame's origin.
pub fn of_inertia(inertia: &Inertia) -> Parameters {
    let (c, i) = (inertia.first_moment, inertia.rotational);
    [inertia.mass, c.x, c.y, c.z, i[(0, 0)], i[(0, 1)], i[(0, 2)], i[(1, 1)], i[(1, 2)], i[(2, 2)]]
}

/// Of a link of a robot file; of one without inertia all are 0.
pub fn of_link(inertia: Option<&LinkInertia>) -> Parameters {
    inertia.map_or([0.0; COUNT], |i| of_inertia(&Inertia::new(i.mass, i.centre, i.about_centre)))
}

/// As a robot file has it; of no mass it is none.
pub fn to_link(p: &Parameters) -> Option<LinkInertia> {
    if p.iter().all(|x| *x == 0.0) {
        return None;
    }
    let centre = if p[0] > 0.0 { Vector3::new(p[1], p[2], p[3]) / p[0] } else { Vector3::zeros() };
    let about_origin = Matrix3::new(p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9]);
    let c = centre.cross_matrix();
    let about_centre = about_origin + p[0] * (c * c);
    Some(LinkInertia { mass: p[0], centre, about_centre: 0.5 * (about_centre + about_centre.transpose()) })
}

/// A point mass at a place of the frame, per kg.
pub fn of_point(place: &Vector3<f64>) -> Parameters {
    of_inertia(&Inertia::new(1.0, *place, Matrix3::zeros()))
}

/// The pseudo-inertia: a body can have these parameters if it is positive definite (Wensing, Kim & Slotine, Linear matrix inequalities for physically
/// consistent inertial parameter identification, RA-L 3(1), 2018).
pub fn pseudo_inertia(p: &Parameters) -> Matrix4<f64> {
    let half = 0.5 * (p[4] + p[7] + p[9]);
    Matrix4::new(
        half - p[4],
        -p[5],
        -p[6],
        p[1], //
        -p[5],
        half - p[7],
        -p[8],
        p[2], //
        -p[6],
        -p[8],
        half - p[9],
        p[3], //
        p[1],
        p[2],
        p[3],
        p[0],
    )
}

/// Changes of a body's parameters of equal size, in the metric that bodies have whatever frame and unit they are written in. The size of a change is ½
/// tr((J⁻¹ δJ)²), with J the pseudo-inertia (Lee & Park, A geometric algorithm for robust multibody inertial parameter identification, RA-L 3(4), 2018). So a
/// slender link is not easily as stout as a drum, and a rotor's inertia not easily taken for that of a link about its own axis.
///
/// `size`: that of a change of each parameter where the body is half as heavy again; thinner than a tenth of its extent no body is taken to be.
pub fn basis(p: &Parameters, size: &Parameters) -> Basis {
    let mass = p[0].max(0.5 * size[0]);
    let reach = (size[4] / size[0].max(f64::MIN_POSITIVE)).sqrt();
    let centre = if p[0] > 0.0 { Vector3::new(p[1], p[2], p[3]) / p[0] } else { Vector3::zeros() };
    let about_origin: Matrix3<f64> = pseudo_inertia(p).fixed_view::<3, 3>(0, 0).into_owned();
    let spread = (about_origin - centre * centre.transpose() * p[0]).symmetric_eigen();
    let least = mass * (THIN * reach).powi(2);
    let thick = Matrix3::from_diagonal(&spread.eigenvalues.map(|x| x.max(least)));
    let spread = spread.eigenvectors * thick * spread.eigenvectors.transpose();
    let mut body = Matrix4::zeros();
    body.fixed_view_mut::<3, 3>(0, 0).copy_from(&(spread + centre * centre.transpose() * mass));
    body.fixed_view_mut::<3, 1>(0, 3).copy_from(&(centre * mass));
    body.fixed_view_mut::<1, 3>(3, 0).copy_from(&(centre * mass).transpose());
    body[(3, 3)] = mass;
    let plain = || Basis::from_diagonal(&SVector::from(*size));
    let Some(inverse) = body.try_inverse() else { return plain() };
    let unit = |i: usize| {
        let mut one = [0.0; COUNT];
        one[i] = size[i];
        inverse * pseudo_inertia(&one)
    };
    let units: [Matrix4<f64>; COUNT] = std::array::from_fn(unit);
    let metric = Basis::from_fn(|i, j| 0.5 * (units[i] * units[j]).trace());
    // In sizes, whose metric is well conditioned; then in the parameters' own units.
    match metric.cholesky().and_then(|c| c.l().transpose().try_inverse()) {
        Some(inverse) => plain() * inverse,
        None => plain(),
    }
}

/// The moving bodies of a robot: for each coordinate the link that the joint carries, and its parameters with all that is fixed to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies {
    /// Link that each coordinate's joint carries.
    pub link: Vec<usize>,
    /// Links fixed to it.
    pub fixed: Vec<Vec<usize>>,
    /// Parameters of both together, in the frame of the link.
    pub nominal: Vec<Parameters>,
    /// Size that a change of each parameter has where the body is half as heavy again.
    pub scale: Vec<Parameters>,
    /// Changes of the parameters that are as large as each other, in columns: see [`basis`].
    pub basis: Vec<Basis>,
    /// Where a payload would be on the last body: the farthest frame that is fixed to it; `None` where none is.
    pub tip: Option<Vector3<f64>>,
}

impl Bodies {
    /// Of a robot.
    pub fn of(robot: &Robot, tree: &Tree) -> Bodies {
        let mut work = tree.workspace();
        tree.place(&tree.references(), &mut work);
        let link: Vec<usize> = tree.coordinates().iter().filter_map(|c| robot.joints.get(c.joint)).map(|j| j.child).collect();
        let mut fixed = vec![Vec::new(); link.len()];
        let mut nominal: Vec<Parameters> = link.iter().map(|l| of_link(robot.links[*l].inertia.as_ref())).collect();
        let mut tip: Option<Vector3<f64>> = None;
        for (index, other) in robot.links.iter().enumerate() {
            let Some((body, carrier)) = carried_by(robot, &link, index) else { continue };
            if carrier == index {
                continue;
            }
            let (Some(base), Some(place)) = (tree.link_placement(carrier, &work), tree.link_placement(index, &work)) else { continue };
            let inside = base.inverse().then(&place);
            fixed[body].push(index);
            if let Some(i) = &other.inertia {
                let added = of_inertia(&Inertia::new(i.mass, i.centre, i.about_centre).outside(&inside));
                nominal[body].iter_mut().zip(added).for_each(|(a, b)| *a += b);
            }
            if body + 1 == link.len() && inside.translation.norm() > tip.map_or(1e-6, |t| t.norm()) {
                tip = Some(inside.translation);
            }
        }
        let masses: Vec<f64> = nominal.iter().map(|p| p[0]).filter(|m| *m > 0.0).collect();
        let usual = if masses.is_empty() { 1.0 } else { masses.iter().sum::<f64>() / masses.len() as f64 };
        let scale = (0..link.len())
            .map(|k| {
                let p = &nominal[k];
                let mass = if p[0] > 0.1 * usual { p[0] } else { 0.1 * usual };
                let next = robot.joints.iter().filter(|j| j.parent == link[k]).map(|j| j.origin.translation.norm()).fold(0.0, f64::max);
                let gyration = (0.5 * (p[4] + p[7] + p[9]).max(0.0) / mass).sqrt();
                let reach = gyration.max(0.5 * next).max(0.02);
                let mut s = [mass * reach * reach; COUNT];
                s[0] = mass;
                s[1..4].fill(mass * reach);
                s
            })
            .collect();
        let basis = nominal.iter().zip(&scale).map(|(p, s)| basis(p, s)).collect();
        Bodies { link, fixed, nominal, scale, basis, tip }
    }

    /// Parameters of a body after a change, given along its [`Bodies::basis`].
    pub fn changed(&self, body: usize, along: &[f64]) -> Parameters {
        std::array::from_fn(|i| self.nominal[body][i] + along.iter().enumerate().map(|(b, x)| self.basis[body][(i, b)] * x).sum::<f64>())
    }

    /// The robot with these parameters of its moving bodies. What is fixed to a body keeps its own inertia where that leaves the body one that it can
    /// have; else the body has it all.
    pub fn applied(&self, robot: &Robot, parameters: &[Parameters]) -> Robot {
        let mut out = robot.clone();
        for (k, wanted) in parameters.iter().enumerate() {
            let own = of_link(robot.links[self.link[k]].inertia.as_ref());
            let mut new = [0.0; COUNT];
            for (i, x) in new.iter_mut().enumerate() {
                *x = own[i] + wanted[i] - self.nominal[k][i];
            }
            let unchanged = wanted.iter().zip(&self.nominal[k]).all(|(a, b)| a == b);
            if unchanged {
                continue;
            }
            if pseudo_inertia(&new).cholesky().is_none() {
                new = *wanted;
                for link in &self.fixed[k] {
                    out.links[*link].inertia = None;
                }
            }
            out.links[self.link[k]].inertia = to_link(&new);
        }
        out
    }
}

/// The moving body that a link is part of, and the link that carries it; `None` for the base.
fn carried_by(robot: &Robot, link: &[usize], index: usize) -> Option<(usize, usize)> {
    let mut at = index;
    // No more steps than links: a robot is a tree.
    for _ in 0..=robot.links.len() {
        if let Some(body) = link.iter().position(|l| *l == at) {
            return Some((body, at));
        }
        at = robot.joints.iter().find(|j| j.child == at)?.parent;
    }
    None
}
