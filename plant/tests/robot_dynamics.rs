//! The mechanics of trees of links against closed forms and against each other.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod robot_common;

use backdrive_plant::robot::{Inertia, Joint, JointKind, Link, LinkInertia, Part, Placement, Robot, Tree, Twist};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use naming::assert_names;
use robot_common::{Draw, mass_matrix, rods, share};

const GRAVITY: f64 = 9.81;

fn forward(tree: &Tree, q: &[f64], v: &[f64], tau: &[f64]) -> Vec<f64> {
    let mut a = vec![0.0; tree.len()];
    tree.forward_dynamics(q, v, tau, &mut tree.workspace(), &mut a);
    a
}

fn bias(tree: &Tree, q: &[f64], v: &[f64]) -> Vec<f64> {
    let mut tau = vec![0.0; tree.len()];
    tree.bias(q, v, &mut tree.workspace(), &mut tau);
    tau
}

#[test]
fn a_rod_is_a_pendulum() {
    let (mass, length) = (1.7, 0.6);
    let tree = Tree::new(&rods(&[(mass, length)])).unwrap();
    for q in [-2.0, 0.0, 0.4, 1.9] {
        // m l²/3 a = τ - m g l/2 cos q.
        let exact = (0.3 - mass * GRAVITY * 0.5 * length * f64::cos(q)) / (mass * length * length / 3.0);
        assert!((forward(&tree, &[q], &[2.0], &[0.3])[0] - exact).abs() < 1e-13 * exact.abs());
    }
}

#[test]
fn two_rods_are_the_double_pendulum_of_lagrange() {
    let ((m1, l1), (m2, l2)) = ((1.7, 0.6), (0.8, 0.45));
    let tree = Tree::new(&rods(&[(m1, l1), (m2, l2)])).unwrap();
    let (q, v, a) = ([0.7, -1.3], [1.1, -2.2], [0.4, 3.0]);
    // Lagrange's equations with relative angles; thin rods, centres in their middle.
    let (h, c2) = (0.5 * m2 * l1 * l2, f64::cos(q[1]));
    let m11 = m1 * l1 * l1 / 3.0 + m2 * l1 * l1 + m2 * l2 * l2 / 3.0 + 2.0 * h * c2;
    let (m12, m22) = (m2 * l2 * l2 / 3.0 + h * c2, m2 * l2 * l2 / 3.0);
    let s2 = f64::sin(q[1]);
    let fall = 0.5 * m2 * l2 * GRAVITY * f64::cos(q[0] + q[1]);
    let expected = [
        m11 * a[0] + m12 * a[1] - h * s2 * (2.0 * v[0] * v[1] + v[1] * v[1]) + (0.5 * m1 + m2) * l1 * GRAVITY * f64::cos(q[0]) + fall,
        m12 * a[0] + m22 * a[1] + h * s2 * v[0] * v[0] + fall,
    ];
    let mut tau = [0.0; 2];
    tree.inverse_dynamics(&q, &v, &a, &mut tree.workspace(), &mut tau);
    assert!(share(&tau, &expected) < 1e-14, "{tau:?} {expected:?}");
    assert!(share(mass_matrix(&tree, &q).as_slice(), &[m11, m12, m12, m22]) < 1e-14);
    assert!(share(&forward(&tree, &q, &v, &tau), &a) < 1e-13);
}

#[test]
fn the_algorithms_agree_with_each_other_on_random_trees() {
    let mut draw = Draw::new(1);
    for round in 0..60 {
        let tree = Tree::new(&draw.robot(1 + round % 15)).unwrap();
        let n = tree.len();
        let [q, v, a, u] = [2.0, 3.0, 5.0, 3.0].map(|size| draw.numbers(n, size));
        let mut work = tree.workspace();
        let mut tau = vec![0.0; n];
        tree.inverse_dynamics(&q, &v, &a, &mut work, &mut tau);
        let matrix = mass_matrix(&tree, &q);
        let assembled = &matrix * DVector::from_vec(a.clone()) + DVector::from_vec(bias(&tree, &q, &v));
        assert!(n == 0 || share(assembled.as_slice(), &tau) < 1e-12, "round {round}");
        // Articulated bodies against the mass matrix and its inverse.
        let found = forward(&tree, &q, &v, &tau);
        if n > 0 {
            let solved = matrix.clone().cholesky().unwrap().solve(&(DVector::from_vec(tau) - DVector::from_vec(bias(&tree, &q, &v))));
            assert!(share(&found, &a) < 1e-9 && share(&found, solved.as_slice()) < 1e-9, "round {round}: {}", share(&found, &a));
        }
        // The Coriolis matrix is symmetric in its two motions, and gives the forces.
        let (mut of_v, mut of_u) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        tree.coriolis_matrix(&q, &v, &mut work, &mut of_v);
        tree.coriolis_matrix(&q, &u, &mut work, &mut of_u);
        let (vector_v, vector_u) = (DVector::from_vec(v.clone()), DVector::from_vec(u));
        let mut forces = vec![0.0; n];
        tree.coriolis(&q, &v, &mut work, &mut forces);
        if n > 0 && forces.iter().any(|f| f.abs() > 1e-9) {
            assert!(share((&of_v * &vector_v).as_slice(), &forces) < 1e-12, "round {round}");
            assert!(share((&of_v * &vector_u).as_slice(), (&of_u * &vector_v).as_slice()) < 1e-11, "round {round}");
        }
        // dM/dt - 2 C is skew.
        let step = 1e-6;
        let moved = |sign: f64| -> Vec<f64> { q.iter().zip(&v).map(|(q, v)| q + sign * step * v).collect() };
        let rate = (mass_matrix(&tree, &moved(1.0)) - mass_matrix(&tree, &moved(-1.0))) / (2.0 * step);
        let skew = rate - &of_v - of_v.transpose();
        assert!(skew.amax() < 1e-6 * (1.0 + matrix.amax()), "round {round}: {}", skew.amax());
    }
}

#[test]
fn gravity_and_energies_belong_together() {
    let mut draw = Draw::new(2);
    for round in 0..20 {
        let tree = Tree::new(&draw.robot(8)).unwrap();
        let n = tree.len();
        let (q, v) = (draw.numbers(n, 2.0), draw.numbers(n, 3.0));
        let mut work = tree.workspace();
        let mut gravity = vec![0.0; n];
        tree.gravity(&q, &mut work, &mut gravity);
        assert!(n == 0 || share(&gravity, &bias(&tree, &q, &vec![0.0; n])) < 1e-14);
        for i in 0..n {
            let mut at = |step: f64| {
                let mut q = q.clone();
                q[i] += step;
                tree.potential_energy(&q, &mut work)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((slope - gravity[i]).abs() < 1e-6, "round {round}: {slope} {}", gravity[i]);
        }
        let v_vector = DVector::from_vec(v.clone());
        let expected = 0.5 * v_vector.dot(&(mass_matrix(&tree, &q) * &v_vector));
        assert!((tree.kinetic_energy(&q, &v, &mut work) - expected).abs() <= 1e-12 * expected);
    }
}

#[test]
fn a_jacobian_is_the_motion_of_its_point() {
    let mut draw = Draw::new(3);
    for _ in 0..20 {
        let robot = draw.robot(9);
        let tree = Tree::new(&robot).unwrap();
        let (n, link, point) = (tree.len(), robot.links.len() - 1, draw.vector(0.3));
        let q = draw.numbers(n, 2.0);
        let mut work = tree.workspace();
        let mut columns = vec![Twist::default(); n];
        tree.place(&q, &mut work);
        tree.jacobian(link, &point, &work, &mut columns);
        for i in 0..n {
            let mut at = |step: f64| -> Placement {
                let mut q = q.clone();
                q[i] += step;
                tree.place(&q, &mut work);
                tree.link_placement(link, &work).unwrap()
            };
            let (after, before) = (at(1e-5), at(-1e-5));
            let linear = (after.point(&point) - before.point(&point)) / 2e-5;
            assert!((linear - columns[i].linear).norm() < 1e-8);
            let turning = (after.rotation - before.rotation) / 2e-5 * (0.5 * (after.rotation + before.rotation)).transpose();
            let angular = Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)]);
            assert!((angular - columns[i].angular).norm() < 1e-8);
        }
    }
}

#[test]
fn fixed_links_are_one_body_with_what_carries_them() {
    let mut robot = rods(&[(1.0, 0.5)]);
    let tool = LinkInertia { mass: 0.4, centre: Vector3::new(0.0, 0.1, 0.0), about_centre: Matrix3::from_diagonal_element(1e-3) };
    robot.links.push(Link { name: "tool".into(), inertia: Some(tool) });
    let mut joint = Joint::new("flange", JointKind::Fixed, 1, 2);
    joint.origin = Placement::at(Vector3::new(0.5, 0.0, 0.0));
    robot.joints.push(joint);
    let tree = Tree::new(&robot).unwrap();
    assert_eq!(tree.len(), 1);
    // The rod about its end, and the tool about the axis: 0.5 m away along x; along the axis it does not matter.
    let expected = 1.0 * 0.25 / 3.0 + 1e-3 + 0.4 * 0.25;
    assert!((mass_matrix(&tree, &[0.3])[(0, 0)] - expected).abs() < 1e-14);
    let mut work = tree.workspace();
    tree.place(&[std::f64::consts::FRAC_PI_2], &mut work);
    let tip = tree.link_placement(2, &work).unwrap().translation;
    assert!((tip - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-15);
    // Seen from another frame it is the same body.
    let seen = Inertia::new(0.4, tool.centre, tool.about_centre).outside(&Placement::at(Vector3::new(0.5, 0.0, 0.0)));
    assert!((seen.rotational[(1, 1)] - (1e-3 + 0.4 * 0.25)).abs() < 1e-14);
}

#[test]
fn a_frictionless_arm_keeps_its_energy() {
    // Runge and Kutta's rule of fourth order: the error shrinks by 16 as its step halves.
    let tree = Tree::new(&rods(&[(1.7, 0.6), (0.8, 0.45), (0.5, 0.3)])).unwrap();
    let drift = |steps: usize| {
        let (mut q, mut v, h) = (vec![0.3, 0.5, -1.0], vec![1.0, -2.0, 3.0], 1.0 / steps as f64);
        let mut work = tree.workspace();
        let mut energy = |q: &[f64], v: &[f64]| tree.kinetic_energy(q, v, &mut work) + tree.potential_energy(q, &mut work);
        let first = energy(&q, &v);
        for _ in 0..steps {
            let add = |x: &[f64], by: f64, k: &[f64]| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
            let a1 = forward(&tree, &q, &v, &[0.0; 3]);
            let (q2, v2) = (add(&q, 0.5 * h, &v), add(&v, 0.5 * h, &a1));
            let a2 = forward(&tree, &q2, &v2, &[0.0; 3]);
            let (q3, v3) = (add(&q, 0.5 * h, &v2), add(&v, 0.5 * h, &a2));
            let a3 = forward(&tree, &q3, &v3, &[0.0; 3]);
            let (q4, v4) = (add(&q, h, &v3), add(&v, h, &a3));
            let a4 = forward(&tree, &q4, &v4, &[0.0; 3]);
            for i in 0..3 {
                q[i] += h / 6.0 * (v[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
                v[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
            }
        }
        (energy(&q, &v) - first).abs()
    };
    let (coarse, fine) = (drift(1000), drift(2000));
    assert!(fine < 1e-8 && coarse / fine > 12.0, "{coarse} {fine}");
}

/// The sentence that a robot is refused with.
fn refused(robot: &Robot) -> (Part, String) {
    let error = Tree::new(robot).unwrap_err();
    (error.part, error.to_string())
}

#[test]
fn what_is_no_tree_of_bodies_is_refused_in_a_sentence() {
    let good = rods(&[(1.0, 0.5), (1.0, 0.5)]);
    let with = |change: &dyn Fn(&mut Robot)| {
        let mut robot = good.clone();
        change(&mut robot);
        refused(&robot)
    };
    let (part, said) = with(&|r| r.links[2].inertia = Some(LinkInertia { mass: -1.0, ..r.links[2].inertia.unwrap() }));
    assert_eq!((part, said.as_str()), (Part::Link(2), "link \"rod1\": mass must be at least 0 kg and finite, is -1"));
    let (part, said) = with(&|r| r.links[2].inertia = None);
    assert_eq!(part, Part::Joint(1));
    assert_names(&said, &["joint \"joint1\"", "link \"rod1\""]);
    let (_, said) = with(&|r| r.joints.push(Joint::new("closing", JointKind::Revolute, 0, 2)));
    assert_names(&said, &["link \"rod1\"", "joint \"joint1\""]);
    let (_, said) = with(&|r| r.joints[0].parent = 2);
    assert_names(&said, &["link \"rod0\"", "base \"base\""]);
    let (_, said) = with(&|r| drop(r.joints.remove(0)));
    assert_names(&said, &["link \"rod0\""]);
    let (_, said) = with(&|r| r.joints[1].child = 0);
    assert_names(&said, &["base \"base\""]);
    let (_, said) = with(&|r| r.joints[1].axis = Vector3::zeros());
    assert!(said.contains("its axis must be a vector of length 1"), "{said}");
    let (_, said) = with(&|r| r.joints[1].armature = f64::NAN);
    assert!(said.contains("armature must be at least 0 and finite"), "{said}");
    let tilted =
        |i: f64| LinkInertia { about_centre: Matrix3::from_diagonal(&Vector3::new(1.0, i, 1.0)), ..good.links[2].inertia.unwrap() };
    let (_, said) = with(&|r| r.links[2].inertia = Some(tilted(-0.5)));
    assert!(said.contains("none may be below 0"), "{said}");
    assert!(Tree::new(&Robot::default()).unwrap_err().to_string().contains("has no links"));
    // What no body has but can be computed with is only doubted.
    let doubtful = Link { name: "x".into(), inertia: Some(tilted(3.0)) };
    assert!(doubtful.doubt().unwrap().contains("more than the two others together"));
    assert!(Link { name: "x".into(), inertia: Some(tilted(2.0)) }.doubt().is_none());
}
