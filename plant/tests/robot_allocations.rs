//! A robot is computed, and an arm stepped, without asking for memory.

mod counting;
mod robot_common;

use backdrive_plant::model::Model;
use backdrive_plant::robot::{Tree, Twist};
use backdrive_plant::stepper::{Options, Plant, Segment};
use counting::asked;
use nalgebra::{DMatrix, Vector3};
use robot_common::{Draw, rods_urdf};

#[test]
fn nothing_is_allocated_on_the_way() {
    let tree = Tree::new(&Draw::new(4).robot(14)).unwrap();
    let n = tree.len();
    let (mut work, q, v) = (tree.workspace(), vec![0.3; n], vec![0.7; n]);
    let (mut out, mut matrix, mut columns) = (vec![0.0; n], DMatrix::zeros(n, n), vec![Twist::default(); n]);
    let computing = asked(|| {
        tree.inverse_dynamics(&q, &v, &v, &mut work, &mut out);
        tree.forward_dynamics(&q, &v, &v, &mut work, &mut out);
        tree.mass_matrix(&q, &mut work, &mut matrix);
        tree.coriolis_matrix(&q, &v, &mut work, &mut matrix);
        tree.gravity_stiffness(&q, &mut work, &mut matrix);
        tree.jacobian(14, &Vector3::x(), &work, &mut columns);
        tree.potential_energy(&q, &mut work);
    });
    assert_eq!(computing, 0);

    let friction: String = (0..3)
        .map(|i| format!("[[elements]]\nkind = 'stribeck'\nbetween = ['joint{i}', 'ground']\ncoulomb = 0.5\nstatic = 0.8\nvelocity = 0.1\n[[outputs]]\nname = 'a{i}'\nkind = 'acceleration'\nof = 'joint{i}'\ndelay = 0.002\n"))
        .collect();
    let text = format!(
        "[robot]\nxml = '{}'\n{friction}[[inputs]]\nname = 'u'\nkind = 'force'\non = 'joint0'\n",
        rods_urdf(&[(1.0, 0.5), (1.0, 0.4), (0.5, 0.3)])
    );
    let mut plant = Plant::new(&Model::from_toml(&text, "arm").unwrap(), 1e-3, &Options::default()).unwrap();
    plant.step(&[Segment::held(1.0)]);
    let mut outputs = [0.0; 3];
    let stepping = asked(|| {
        for i in 0..500 {
            plant.step(&[Segment::held(10.0 * (0.1 * f64::from(i)).sin())]);
            plant.outputs(&mut outputs);
        }
    });
    assert_eq!(stepping, 0);
}
