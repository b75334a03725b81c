//! A robot whose joints are driven through networks: against one axis, closed forms, and its own solution at smaller steps.

mod robot_common;

use backdrive_plant::model::{Hold, Model};
use backdrive_plant::robot::Tree;
use backdrive_plant::stepper::{Options, Plant, Segment, segments, simulate};
use robot_common::{rods, rods_urdf, share};

const RODS: [(f64, f64); 2] = [(1.7, 0.6), (0.8, 0.45)];

fn model(text: &str) -> Model {
    Model::from_toml(text, "arm.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// A model with these rods; `keys` of its [robot], and what else the file has.
fn arm(rods: &[(f64, f64)], keys: &str, rest: &str) -> Model {
    model(&format!("[robot]\nxml = '''{}'''\n{keys}\n{rest}", rods_urdf(rods)))
}

fn options(substeps: usize) -> Options {
    Options { substeps: Some(substeps), ..Options::default() }
}

fn held(count: usize) -> Vec<Segment> {
    vec![Segment::held(0.0); count]
}

/// A drive with everything in it: a motor with friction and cogging, a gear with play, a soft shaft.
const DRIVE: &str = "
[[elements]]
kind = 'backlash'
between = ['motor', 'joint0']
gap = 0.01
stiffness = 800
damping = 0.4
[[elements]]
kind = 'stribeck'
between = ['motor', 'ground']
coulomb = 0.5
static = 0.8
velocity = 0.1
[[elements]]
kind = 'cogging'
between = ['motor', 'ground']
amplitude = 0.2
period = 0.1
phase = 0.3
[[elements]]
kind = 'dahl'
between = ['joint0', 'ground']
stiffness = 300
coulomb = 0.3
[[elements]]
kind = 'coulomb'
between = ['joint0', 'ground']
force = 0.2
[[inputs]]
name = 'torque'
kind = 'force'
on = 'motor'
delay = 0.0015
saturation = 6
[[outputs]]
name = 'motor_angle'
kind = 'position'
of = 'motor'
delay = 0.002
[[outputs]]
name = 'joint_angle'
kind = 'position'
of = 'joint0'
[[outputs]]
name = 'joint_acceleration'
kind = 'acceleration'
of = 'joint0'
[[outputs]]
name = 'shaft'
kind = 'force'
element = 'element0'
";

fn shaken(count: usize) -> Vec<f64> {
    (0..count).map(|i| 5.0 * (i as f64 * 0.031).sin() + 3.0 * (i as f64 * 0.0041).sin()).collect()
}

#[test]
fn an_arm_of_one_joint_is_the_model_of_one_axis() {
    let (mass, length) = (1.7, 0.6);
    let inertia = mass * length * length / 3.0;
    // Across the axis, so that gravity asks nothing of it.
    let robot = arm(&[(mass, length)], "gravity = [0.0, -9.81, 0.0]", &format!("[bodies]\nmotor = 0.02\n{DRIVE}"));
    let axis = model(&format!("motion = 'rotation'\n[bodies]\njoint0 = {inertia}\nmotor = 0.02\n{DRIVE}"));
    let drive = shaken(3000);
    for substeps in [2, 5] {
        let found = simulate(&robot, &[&drive], 1e-3, &options(substeps)).unwrap();
        let expected = simulate(&axis, &[&drive], 1e-3, &options(substeps)).unwrap();
        assert!(expected[1].iter().any(|x| x.abs() > 0.5), "it moves");
        for (found, expected) in found.iter().zip(&expected) {
            assert!(share(found, expected) < 1e-12, "{}", share(found, expected));
        }
    }
    let alone = Plant::new(&axis, 1e-3, &Options::default()).unwrap().substeps();
    assert_eq!(Plant::new(&robot, 1e-3, &Options::default()).unwrap().substeps(), alone, "it chooses the same steps");
}

#[test]
fn a_rod_under_gravity_is_an_axis_with_its_torque() {
    let (mass, length) = (1.7, 0.6);
    let friction = "[[elements]]\nkind = 'coulomb'\nbetween = ['joint0', 'ground']\nforce = 0.3\n[[outputs]]\nname = 'q'\nkind = 'position'\nof = 'joint0'\n\
                    [[inputs]]\nname = 'push'\nkind = 'force'\non = 'joint0'\n";
    let robot = arm(&[(mass, length)], "", friction);
    // m g l/2 cos q.
    let torque = format!(
        "[[elements]]\nkind = 'cogging'\nbetween = ['joint0', 'ground']\namplitude = {}\nperiod = {}\nphase = {}\n",
        mass * 9.81 * 0.5 * length,
        2.0 * std::f64::consts::PI,
        std::f64::consts::FRAC_PI_2
    );
    let axis = model(&format!("motion = 'rotation'\n[bodies]\njoint0 = {}\n{torque}{friction}", mass * length * length / 3.0));
    let drive = vec![0.0; 4000];
    let run = |model: &Model| simulate(model, &[&drive], 1e-3, &options(2)).unwrap().remove(0);
    let (found, expected) = (run(&robot), run(&axis));
    assert!(share(&found, &expected) < 1e-9, "{}", share(&found, &expected));
}

/// Two joints with dry friction, each through a motor and a soft gear.
fn geared(friction: f64) -> Model {
    let mut text = String::from("[bodies]\n\"motor0\" = 0.3\n\"motor1\" = 0.1\n");
    for i in 0..2 {
        text += &format!(
            "[[elements]]\nkind = 'spring'\nbetween = ['motor{i}', 'joint{i}']\nstiffness = {}\n\
             [[elements]]\nkind = 'damper'\nbetween = ['motor{i}', 'joint{i}']\ndamping = 0.5\n\
             [[elements]]\nkind = 'coulomb'\nbetween = ['motor{i}', 'ground']\nforce = {}\n\
             [[elements]]\nkind = 'coulomb'\nbetween = ['joint{i}', 'ground']\nforce = {}\n\
             [[inputs]]\nname = 'torque{i}'\nkind = 'force'\non = 'motor{i}'\n\
             [[outputs]]\nname = 'q{i}'\nkind = 'position'\nof = 'joint{i}'\n",
            2000.0 / (1.0 + i as f64),
            friction,
            0.2 * friction
        );
    }
    arm(&RODS, "pose = { joint0 = -1.2, joint1 = 0.4 }", &text)
}

#[test]
fn what_sticks_does_not_creep() {
    // Friction of both joints carries more than gravity asks in this pose (about 5 N m at the first).
    let mut plant = Plant::new(&geared(14.0), 1e-3, &options(4)).unwrap();
    let push = |plant: &mut Plant, torques: [f64; 2], periods: usize| {
        (0..periods).for_each(|_| plant.step(&torques.map(Segment::held)));
        [0, 1, 2, 3].map(|body| (plant.position(body), plant.velocity(body)))
    };
    let thrown = push(&mut plant, [40.0, -25.0], 150);
    assert!(thrown.iter().all(|(x, _)| x.abs() > 1e-3), "{thrown:?}");
    let still = push(&mut plant, [0.0, 0.0], 3000);
    assert!(still.iter().all(|(_, v)| *v == 0.0), "it has come to rest: {still:?}");
    assert_eq!(push(&mut plant, [0.0, 0.0], 5000), still, "to the last bit");
    // A push that friction can hold moves nothing that is in reach of it.
    let held = push(&mut plant, [4.0, 2.0], 2000);
    assert_eq!((held[0].0, held[1].0), (still[0].0, still[1].0));
    assert!(plant.energy().kinetic == 0.0);
}

/// Largest difference of any output from the solution at very small steps, as a share of it.
fn errors(model: &Model, drives: &[Vec<f64>], substeps: [usize; 3], converged: usize) -> [f64; 3] {
    let run = |n: usize| simulate(model, drives, 2e-3, &options(n)).unwrap().concat();
    let exact = run(converged);
    substeps.map(|n| share(&run(n), &exact))
}

#[test]
fn halving_the_step_leaves_a_quarter_of_the_error() {
    // Without friction, driven by torques that are held: of second order.
    let model = geared(0.0);
    let drives = [vec![20.0; 400], (0..400).map(|i| (i as f64 * 0.05).sin() * 8.0).collect()];
    let errors = errors(&model, &drives, [4, 8, 16], 256);
    assert!(errors[0] / errors[1] > 3.5 && errors[1] / errors[2] > 3.5 && errors[2] < 1e-4, "{errors:?}");
}

#[test]
fn with_friction_that_holds_and_lets_go_it_converges_too() {
    let model = geared(3.0);
    let drives = [(0..400).map(|i| (i as f64 * 0.03).sin() * 20.0).collect(), (0..400).map(|i| (i as f64 * 0.05).sin() * 8.0).collect()];
    let errors = errors(&model, &drives, [4, 16, 64], 512);
    assert!(errors[0] < 1e-3 && errors[2] < errors[0] / 8.0, "{errors:?}");
}

#[test]
fn energy_that_went_in_is_there_or_was_taken() {
    let model = geared(3.0);
    let imbalance = |substeps: usize| {
        let mut plant = Plant::new(&model, 2e-3, &options(substeps)).unwrap();
        plant.track_energy();
        let mut worst = 0.0f64;
        for i in 0..500 {
            plant.step(&[20.0 * (i as f64 * 0.03).sin(), 8.0 * (i as f64 * 0.05).sin()].map(Segment::held));
            let e = plant.energy();
            worst = worst.max((e.kinetic + e.stored + e.dissipated - e.work_in).abs());
        }
        assert!(plant.energy().dissipated > 5.0, "{:?}", plant.energy());
        worst
    };
    let errors = [4, 8, 16].map(imbalance);
    assert!(errors[0] < 0.1 && errors[0] / errors[1] > 3.0 && errors[1] / errors[2] > 3.0, "{errors:?}");
}

#[test]
fn seven_joints_that_all_rub_keep_their_balance() {
    // Heavy at the shoulder, light at the wrist, with friction on both sides of every gear: what contacts leave unsolved would be missing energy.
    let rods: Vec<(f64, f64)> = (0..7).map(|i| (4.0 / 2f64.powi(i), 0.3 - 0.03 * f64::from(i))).collect();
    let (mut bodies, mut rest) = (String::from("[bodies]\n"), String::new());
    for i in 0..7 {
        bodies += &format!("m{i} = {}\n", 0.2 / f64::from(1 << i));
        rest += &format!("[[elements]]\nkind = 'spring'\nbetween = ['m{i}', 'joint{i}']\nstiffness = {}\n", 2000.0 / f64::from(1 << i));
        for body in ["m", "joint"] {
            rest += &format!("[[elements]]\nkind = 'coulomb'\nbetween = ['{body}{i}', 'ground']\nforce = {}\n", 2.0 / f64::from(1 << i));
        }
        rest += &format!("[[inputs]]\nname = 'u{i}'\nkind = 'force'\non = 'm{i}'\n");
    }
    let model = arm(&rods, "", &(bodies + &rest));
    let imbalance = |substeps: usize| {
        let mut plant = Plant::new(&model, 1e-3, &options(substeps)).unwrap();
        plant.track_energy();
        let mut worst = 0.0f64;
        for period in 0..1000 {
            let torque = |i: i32| Segment::held(12.0 / 2f64.powi(i) * (2e-3 * f64::from(period) * f64::from(3 + i)).sin());
            plant.step(&[0, 1, 2, 3, 4, 5, 6].map(torque));
            let e = plant.energy();
            worst = worst.max((e.kinetic + e.stored + e.dissipated - e.work_in).abs());
        }
        assert!(plant.energy().dissipated > 5.0 && plant.is_finite(), "{:?}", plant.energy());
        worst
    };
    let errors = [2, 8].map(imbalance);
    assert!(errors[0] < 1e-3 && errors[0] / errors[1] > 8.0, "{errors:?}");
}

#[test]
fn leading_a_joint_is_work() {
    let text = "[[inputs]]\nname = 'm'\nkind = 'motion'\non = 'joint0'\n[[elements]]\nkind = 'coulomb'\nbetween = ['joint1', 'ground']\nforce = 0.4\n\
                [[elements]]\nkind = 'damper'\nbetween = ['joint0', 'joint1']\ndamping = 0.1\n";
    let model = arm(&RODS, "", text);
    let imbalance = |substeps: usize| {
        let mut plant = Plant::new(&model, 2e-3, &options(substeps)).unwrap();
        plant.track_energy();
        let motion: Vec<f64> = (0..501).map(|i| 0.4 * (1.0 - (0.01 * i as f64).cos()).powi(2)).collect();
        let mut worst = 0.0f64;
        for segment in segments(Hold::Cubic, &motion, 2e-3) {
            plant.step(&[segment]);
            let e = plant.energy();
            worst = worst.max((e.kinetic + e.stored + e.dissipated - e.work_in).abs());
        }
        assert!(plant.energy().dissipated > 0.3 && plant.energy().work_in.abs() > 1.0, "{:?}", plant.energy());
        worst
    };
    let errors = [4, 8, 16].map(imbalance);
    assert!(errors[2] < 5e-2 && errors[0] / errors[2] > 3.0, "{errors:?}");
}

#[test]
fn a_frictionless_arm_neither_gains_nor_loses_energy() {
    // Three rods that tumble: the error of the energy is proportional to the square of the step, and does not grow with time.
    let model = arm(&[(1.7, 0.6), (0.8, 0.45), (0.5, 0.3)], "", "");
    let worst = |substeps: usize| {
        let mut plant = Plant::new(&model, 1e-3, &options(substeps)).unwrap();
        for (body, velocity) in [1.0, -2.0, 3.0].into_iter().enumerate() {
            plant.set_motion(body, 0.3, velocity);
        }
        let total = |plant: &Plant| plant.energy().kinetic + plant.energy().stored;
        let first = total(&plant);
        let mut worst = [0.0f64; 2];
        for period in 0..20_000 {
            plant.step(&held(0));
            let half = usize::from(period >= 10_000);
            worst[half] = worst[half].max((total(&plant) - first).abs());
        }
        assert!(plant.energy().kinetic > 0.1 && plant.is_finite());
        worst
    };
    // J, of some 10 that go to and fro.
    let (coarse, fine) = (worst(1), worst(4));
    assert!(coarse[0] < 0.1 && coarse[1] < 1.5 * coarse[0], "{coarse:?}");
    assert!(fine[0] < coarse[0] / 8.0 && fine[1] < 1.5 * fine[0], "{coarse:?} {fine:?}");
}

#[test]
fn accelerations_and_reactions_are_those_of_the_tree() {
    let tree = Tree::new(&rods(&RODS)).unwrap();
    let mut work = tree.workspace();
    // Free: the result of forward dynamics.
    let pose = "pose = { joint0 = 0.4, joint1 = -0.9 }";
    let push = "[[inputs]]\nname = 'push'\nkind = 'force'\non = 'joint0'\n";
    let mut plant = Plant::new(&arm(&RODS, pose, push), 1e-3, &options(2)).unwrap();
    plant.set_motion(0, 0.2, 1.5);
    plant.set_motion(1, -0.3, -2.0);
    plant.step(&[Segment::held(3.0)]);
    let (q, v) = ([0.4 + plant.position(0), -0.9 + plant.position(1)], [plant.velocity(0), plant.velocity(1)]);
    let mut accelerations = [0.0; 2];
    tree.forward_dynamics(&q, &v, &[3.0, 0.0], &mut work, &mut accelerations);
    assert!(share(&[plant.acceleration(0), plant.acceleration(1)], &accelerations) < 1e-12);
    // Prescribed motion: the result of inverse dynamics.
    let mut led = String::new();
    for i in 0..2 {
        led += &format!(
            "[[inputs]]\nname = 'm{i}'\nkind = 'motion'\non = 'joint{i}'\n[[outputs]]\nname = 'r{i}'\nkind = 'reaction'\nof = 'joint{i}'\n"
        );
    }
    let mut plant = Plant::new(&arm(&RODS, pose, &led), 1e-3, &options(2)).unwrap();
    plant.step(&[Segment { c: [0.1, 2.0, 3.0, -4.0] }, Segment { c: [-0.2, 1.0, -5.0, 7.0] }]);
    let s: f64 = 1e-3;
    let q = [0.4 + 0.1 + 2.0 * s + 3.0 * s * s - 4.0 * s.powi(3), -0.9 - 0.2 + s - 5.0 * s * s + 7.0 * s.powi(3)];
    let v = [2.0 + 6.0 * s - 12.0 * s * s, 1.0 - 10.0 * s + 21.0 * s * s];
    let a = [6.0 - 24.0 * s, -10.0 + 42.0 * s];
    let mut torques = [0.0; 2];
    tree.inverse_dynamics(&q, &v, &a, &mut work, &mut torques);
    assert!(share(&[plant.reaction(0), plant.reaction(1)], &torques) < 1e-12);
}

#[test]
fn a_joint_that_is_led_moves_the_others() {
    // The first joint swings as prescribed; the second hangs on it, and does what the whole tree does when the first is pushed with the reaction.
    let led = arm(
        &RODS,
        "",
        "[[inputs]]\nname = 'm'\nkind = 'motion'\non = 'joint0'\n[[outputs]]\nname = 'r'\nkind = 'reaction'\nof = 'joint0'\n[[outputs]]\nname = 'q'\nkind = 'position'\nof = 'joint1'\n",
    );
    let motion: Vec<f64> = (0..600).map(|i| 0.2 * (1.0 - (i as f64 * 6e-3).cos()).powi(2)).collect();
    let error = |substeps: usize| {
        let found = simulate(&led, &[&motion], 1e-3, &options(substeps)).unwrap();
        let replayed = simulate(&model_pushed(), &[&found[0]], 1e-3, &options(substeps)).unwrap();
        share(&replayed[0], &motion).max(share(&replayed[1], &found[1]))
    };
    let errors = [2, 8].map(error);
    assert!(errors[0] < 1e-4 && errors[1] < 3e-5, "{errors:?}");
}

#[test]
fn an_arm_falls_onto_its_stops_and_rests_there() {
    let mut text = String::new();
    for (i, gap) in [0.3, 0.5].into_iter().enumerate() {
        text += &format!(
            "[[elements]]\nname = 'stop{i}'\nkind = 'contact'\nbetween = ['ground', 'joint{i}']\nstiffness = 1e7\ndamping = 300\ngap = {gap}\n\
             [[elements]]\nkind = 'damper'\nbetween = ['joint{i}', 'ground']\ndamping = 0.2\n\
             [[outputs]]\nname = 'f{i}'\nkind = 'force'\nelement = 'stop{i}'\n"
        );
    }
    let mut plant = Plant::new(&arm(&RODS, "", &text), 1e-3, &Options::default()).unwrap();
    let total = |plant: &Plant| plant.energy().kinetic + plant.energy().stored;
    let first = total(&plant);
    for _ in 0..4000 {
        plant.step(&held(0));
        assert!(total(&plant) < first + 1e-3, "a stop gives no energy: {} {first}", total(&plant));
    }
    assert!((plant.position(0) + 0.3).abs() < 1e-5 && (plant.position(1) + 0.5).abs() < 1e-5 && plant.velocity(0).abs() < 1e-6);
    // The stops carry what gravity asks.
    let tree = Tree::new(&rods(&RODS)).unwrap();
    let (mut outputs, mut gravity) = ([0.0; 2], [0.0; 2]);
    plant.outputs(&mut outputs);
    tree.gravity(&[plant.position(0), plant.position(1)], &mut tree.workspace(), &mut gravity);
    assert!(share(&outputs, &gravity) < 1e-4, "{outputs:?} {gravity:?}");
}

fn model_pushed() -> Model {
    let outputs: String = (0..2).map(|i| format!("[[outputs]]\nname = 'q{i}'\nkind = 'position'\nof = 'joint{i}'\n")).collect();
    arm(&RODS, "", &format!("[[inputs]]\nname = 'push'\nkind = 'force'\non = 'joint0'\nhold = 'cubic'\n{outputs}"))
}
