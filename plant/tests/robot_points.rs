//! Points of a robot's links as places of the network: against closed forms, the balance of energy, the linear model and smaller steps.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod robot_common;

use backdrive_plant::describe::describe;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment, simulate};
use naming::assert_names;
use robot_common::{rods_urdf, share};

const RODS: [(f64, f64); 2] = [(1.7, 0.6), (0.8, 0.45)];
/// Where the chain of rods stands, rad: it lifts, then bends back.
const POSE: [f64; 2] = [0.4, -0.9];

/// The rods with points at the end of the last: `tip.x`, `tip.y`, `tip.z` and, along a slant in the plane, `slant`.
fn arm(keys: &str, rest: &str) -> Model {
    let text = format!(
        "[robot]\nxml = '''{}'''\npose = {{ joint0 = {}, joint1 = {} }}\n{keys}\n[point.tip]\nlink = 'rod1'\nat = [0.45, 0, 0]\n\
         [point.slant]\nlink = 'rod1'\nat = [0.45, 0, 0]\naxis = [3.0, 0.0, 4.0]\n{rest}",
        rods_urdf(&RODS),
        POSE[0],
        POSE[1]
    );
    Model::from_toml(&text, "arm.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn signal(table: &str, keys: &[(&str, &str)]) -> String {
    let line = |(key, value): &(&str, &str)| format!("{key} = {value}\n");
    format!("[[{table}]]\n{}", keys.iter().map(line).collect::<String>())
}

fn output(name: &str, kind: &str, of: &str) -> String {
    signal("outputs", &[("name", &format!("'{name}'")), ("kind", &format!("'{kind}'")), ("of", &format!("'{of}'"))])
}

fn options(substeps: usize) -> Options {
    Options { substeps: Some(substeps), ..Options::default() }
}

/// x and z of the tip at coordinates of the rods, m.
fn tip(q: [f64; 2]) -> [f64; 2] {
    let sum = q[0] + q[1];
    [0.6 * q[0].cos() + 0.45 * sum.cos(), 0.6 * q[0].sin() + 0.45 * sum.sin()]
}

/// Rows of the Jacobian of x and z.
fn jacobian(q: [f64; 2]) -> [[f64; 2]; 2] {
    let sum = q[0] + q[1];
    let outer = [-0.45 * sum.sin(), 0.45 * sum.cos()];
    [[-0.6 * q[0].sin() + outer[0], outer[0]], [0.6 * q[0].cos() + outer[1], outer[1]]]
}

/// The rods, their joints on prescribed motion, with a push on the tip.
fn led() -> Model {
    let mut rest = String::new();
    for joint in ["joint0", "joint1"] {
        rest +=
            &signal("inputs", &[("name", &format!("'{joint}'")), ("kind", "'motion'"), ("on", &format!("'{joint}'")), ("hold", "'cubic'")]);
    }
    rest += &signal("inputs", &[("name", "'push'"), ("kind", "'force'"), ("on", "'slant'")]);
    for kind in ["position", "velocity", "acceleration"] {
        for of in ["tip.x", "tip.y", "tip.z", "slant"] {
            rest += &output(&format!("{kind}_{of}"), kind, of);
        }
    }
    for joint in ["joint0", "joint1"] {
        rest += &output(&format!("held_{joint}"), "reaction", joint);
    }
    arm("gravity = [0, 0, 0]", &rest)
}

#[test]
fn a_point_goes_where_the_geometry_says() {
    let mut plant = Plant::new(&led(), 1e-3, &options(1)).unwrap();
    // Parabolas, which a cubic line is exact for.
    let (rate, pull) = ([0.7, -1.1], [2.0, 1.5]);
    let at = |i: usize, t: f64| rate[i] * t + 0.5 * pull[i] * t * t;
    let line = |i: usize, from: f64| Segment { c: [at(i, from), rate[i] + pull[i] * from, 0.5 * pull[i], 0.0] };
    plant.start_at(&[0.0, 0.0]);
    let mut values = [0.0; 14];
    for step in 0..200 {
        let t = step as f64 * 1e-3;
        plant.step(&[line(0, t), line(1, t), Segment::held(0.0)]);
    }
    plant.outputs(&mut values);
    let t: f64 = 0.2;
    let q = [POSE[0] + at(0, t), POSE[1] + at(1, t)];
    let v = [rate[0] + pull[0] * t, rate[1] + pull[1] * t];
    let (now, then, j) = (tip(q), tip(POSE), jacobian(q));
    let sum = v[0] + v[1];
    // d/dt of the Jacobian times the rates: each link's end goes round its joint.
    let round = |angle: f64, length: f64, rate: f64| [-length * angle.cos() * rate * rate, -length * angle.sin() * rate * rate];
    let (upper, fore) = (round(q[0], 0.6, v[0]), round(q[0] + q[1], 0.45, sum));
    let [x, z] = [0, 1].map(|k| {
        let along = |u: [f64; 2]| j[k][0] * u[0] + j[k][1] * u[1];
        [now[k] - then[k], along(v), along(pull) + upper[k] + fore[k]]
    });
    for kind in 0..3 {
        let expected = [x[kind], 0.0, z[kind], 0.6 * x[kind] + 0.8 * z[kind]];
        let found = &values[4 * kind..4 * kind + 4];
        assert!(share(found, &expected) < 1e-9, "kind {kind}: {found:?} {expected:?}");
    }
}

#[test]
fn a_push_on_a_point_is_its_transposed_jacobian_on_the_joints() {
    let mut plant = Plant::new(&led(), 1e-3, &options(1)).unwrap();
    let turned = [0.3, 0.5];
    plant.start_at(&turned);
    for _ in 0..3 {
        plant.step(&[Segment::held(turned[0]), Segment::held(turned[1]), Segment::held(7.0)]);
    }
    let mut values = [0.0; 14];
    plant.outputs(&mut values);
    let j = jacobian([POSE[0] + turned[0], POSE[1] + turned[1]]);
    let expected = [0, 1].map(|i| -7.0 * (0.6 * j[0][i] + 0.8 * j[1][i]));
    assert!(share(&values[12..], &expected) < 1e-12, "{values:?} {expected:?}");
}

/// What a hand and a wall are, at the tip: a spring with rest, a damper, a wall, dry friction across, and a palm behind a spring.
const HELD: &str = "
[bodies]
palm = 0.4
[[elements]]
name = 'spring'
kind = 'spring'
between = ['slant', 'palm']
stiffness = 300
[[elements]]
name = 'tie'
kind = 'spring'
between = ['palm', 'ground']
stiffness = 80
rest = 0.02
[[elements]]
name = 'damper'
kind = 'damper'
between = ['tip.z', 'ground']
damping = 3
[[elements]]
name = 'wall'
kind = 'contact'
between = ['tip.x', 'ground']
stiffness = 2000
damping = 4
gap = 0.01
[[elements]]
name = 'rub'
kind = 'coulomb'
between = ['tip.z', 'palm']
force = 0.4
[[inputs]]
name = 'push'
kind = 'force'
on = 'tip.x'
[[inputs]]
name = 'torque'
kind = 'force'
on = 'joint1'
[[outputs]]
name = 'x'
kind = 'position'
of = 'tip.x'
[[outputs]]
name = 'z'
kind = 'position'
of = 'tip.z'
[[outputs]]
name = 'wall_force'
kind = 'force'
element = 'wall'
";

fn shaken(count: usize) -> Vec<Vec<f64>> {
    let wave = |i: usize, size: f64, rate: f64| size * (i as f64 * rate).sin();
    vec![(0..count).map(|i| wave(i, 6.0, 0.021)).collect(), (0..count).map(|i| wave(i, 1.5, 0.013)).collect()]
}

#[test]
fn no_energy_comes_from_nowhere_at_a_point() {
    let model = arm("", HELD);
    let off = |substeps: usize| {
        let mut plant = Plant::new(&model, 1e-3, &options(substeps)).unwrap();
        plant.track_energy();
        let first = plant.energy();
        let input = shaken(1500);
        let (mut worst, mut moved) = (0.0_f64, 0.0_f64);
        for (push, torque) in input[0].iter().zip(&input[1]) {
            plant.step(&[Segment::held(*push), Segment::held(*torque)]);
            let now = plant.energy();
            let gained = now.kinetic + now.stored - first.kinetic - first.stored;
            worst = worst.max((gained + now.dissipated - now.work_in).abs());
            moved = moved.max(now.kinetic).max(now.dissipated);
        }
        worst / moved
    };
    let [coarse, fine] = [4, 8].map(off);
    println!("energy off the balance, as a share: {coarse:.1e}, {fine:.1e} at half the step");
    assert!(coarse < 1e-3 && fine < 0.5 * coarse, "{coarse} {fine}");
}

#[test]
fn the_energy_of_springs_at_points_neither_grows_nor_fades() {
    let springs = "
[[elements]]
kind = 'spring'
between = ['tip.x', 'ground']
stiffness = 60
[[elements]]
kind = 'cubic_spring'
between = ['tip.z', 'ground']
stiffness = 40
cubic = 900
";
    let mut plant = Plant::new(&arm("gravity = [0, 0, -1]", springs), 1e-3, &options(1)).unwrap();
    plant.set_motion(0, 0.3, 0.0);
    let of = |plant: &Plant| plant.energy().kinetic + plant.energy().stored;
    let first = of(&plant);
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    for step in 0..20_000 {
        plant.step(&[]);
        let off = (of(&plant) - first).abs();
        if step < 4000 {
            early = early.max(off);
        } else if step >= 16_000 {
            late = late.max(off);
        }
    }
    println!("energy {first} J off by {early:.1e} J in the first 4 s and {late:.1e} J in the last 4 of 20");
    assert!(early < 1e-3 * first && late < 1.5 * early, "{first} {early} {late}");
}

#[test]
fn half_the_step_has_a_quarter_of_the_error() {
    // Without the wall and the friction, whose corners are of first order.
    let smooth = HELD.replace("gap = 0.01", "gap = 10").replace("force = 0.4", "force = 0");
    let model = arm("", &smooth);
    let run = |substeps: usize| simulate(&model, &shaken(400), 1e-3, &options(substeps)).unwrap();
    let exact = run(64);
    let off = |substeps: usize| {
        let found = run(substeps);
        found[..2].iter().zip(&exact).fold(0.0_f64, |most, (a, b)| most.max(share(a, b)))
    };
    let [coarse, middle, fine] = [1, 2, 4].map(off);
    println!("off by {coarse:.1e}, {middle:.1e}, {fine:.1e}");
    assert!(coarse / middle > 3.5 && middle / fine > 3.5 && fine < 1e-5, "{coarse} {middle} {fine}");
}

#[test]
fn what_sticks_at_a_point_does_not_creep() {
    let stuck = "
[[elements]]
kind = 'coulomb'
between = ['tip.x', 'ground']
force = 5
[[elements]]
kind = 'coulomb'
between = ['tip.z', 'ground']
force = 5
[[inputs]]
name = 'push'
kind = 'force'
on = 'slant'
";
    let mut plant = Plant::new(&arm("gravity_compensated = true", stuck), 1e-3, &Options::default()).unwrap();
    // Behind the two joints come tip.x, tip.y, tip.z and slant.
    let tip = [2, 4];
    for step in 0..3000 {
        plant.step(&[Segment::held(4.0 * (step as f64 * 0.01).sin())]);
    }
    let at_rest = tip.map(|body| plant.position(body).abs());
    assert!(at_rest.iter().all(|x| *x < 1e-10), "{at_rest:?}");
    // 9 N along the slant are 5.4 and 7.2 N.
    for _ in 0..100 {
        plant.step(&[Segment::held(9.0)]);
    }
    assert!(plant.position(5) > 1e-3, "{}", plant.position(5));
}

#[test]
fn weight_that_motors_hold_is_no_weight() {
    let rest =
        format!("{}{}", signal("inputs", &[("name", "'push'"), ("kind", "'force'"), ("on", "'tip.z'")]), output("z", "position", "tip.z"));
    let [held, floating, falling] = ["gravity_compensated = true", "gravity = [0, 0, 0]", ""].map(|keys| arm(keys, &rest));
    let push: Vec<f64> = (0..500).map(|i| if i < 200 { 0.0 } else { 2.0 }).collect();
    let run = |model: &Model| simulate(model, std::slice::from_ref(&push), 1e-3, &options(2)).unwrap();
    let (found, expected, fallen) = (run(&held), run(&floating), run(&falling));
    assert!(found[0][..200].iter().all(|z| *z == 0.0), "it moves by itself");
    assert_eq!(found, expected);
    assert!(found[0][499] > 0.01 && fallen[0][199] < -0.1);
    assert!(describe(&held, &Operating::small()).to_string().contains("the motors hold the weight of the links"));
}

#[test]
fn the_linear_model_is_that_of_the_motion() {
    let springs = "
[[elements]]
kind = 'spring'
between = ['tip.x', 'ground']
stiffness = 900
[[elements]]
kind = 'spring'
between = ['tip.z', 'ground']
stiffness = 500
[[elements]]
name = 'damper'
kind = 'damper'
between = ['slant', 'ground']
damping = 20
[[elements]]
kind = 'damper'
between = ['tip.x', 'ground']
damping = 15
[[inputs]]
name = 'push'
kind = 'force'
on = 'slant'
[[outputs]]
name = 'z'
kind = 'position'
of = 'tip.z'
[[outputs]]
name = 'damping'
kind = 'force'
element = 'damper'
";
    let model = arm("gravity_compensated = true", springs);
    let linear = LinearModel::new(&model, &Operating::small()).unwrap();
    // Modes: det(Jᵀ K J - w² M) = 0 with the mass matrix of the rods.
    let (m0, m1, l0, l1) = (1.7, 0.8, 0.6, 0.45);
    let cos = POSE[1].cos();
    let across = m1 * l0 * 0.5 * l1 * cos;
    let m11 = m1 * l1 * l1 / 3.0;
    let mass = [[m0 * l0 * l0 / 3.0 + m11 + m1 * l0 * l0 + 2.0 * across, m11 + across], [m11 + across, m11]];
    let j = jacobian(POSE);
    let k = |a: usize, b: usize| 900.0 * j[0][a] * j[0][b] + 500.0 * j[1][a] * j[1][b];
    for mode in linear.modes().unwrap() {
        let w = mode.omega_squared;
        let of = |a: usize, b: usize| k(a, b) - w * mass[a][b];
        let (left, right) = (of(0, 0) * of(1, 1), of(0, 1) * of(1, 0));
        assert!((left - right).abs() < 1e-9 * (k(0, 0) * k(1, 1)), "{w}: {left} {right}");
    }
    // A small sine in time has the gain of the linear response, for the motion and for the force of an element.
    let hz = 4.0;
    let push: Vec<f64> = (0..4000).map(|i| 1e-4 * (std::f64::consts::TAU * hz * i as f64 * 1e-3).sin()).collect();
    let mut smooth = model.clone();
    smooth.inputs[0].hold = backdrive_plant::model::Hold::Cubic;
    let found = simulate(&smooth, &[push], 1e-3, &options(4)).unwrap();
    for (output, found) in found.iter().enumerate() {
        let gain = linear.response(0, output, &[hz]).unwrap()[0].norm() * 1e-4;
        let largest = found[3000..].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!((largest / gain - 1.0).abs() < 2e-3, "{output}: {largest} {gain}");
    }
}

#[test]
fn a_model_with_points_is_written_and_read_again() {
    let rest = format!("{HELD}[[axes]]\nname = 'x'\nuser = 'tip.x'\ntouches = ['wall']\nfeedback = 'push'\nmeasured = 'x'\n");
    let model = arm("gravity_compensated = true", &rest);
    let text = model.to_toml();
    let again = Model::from_toml(&text, "again.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(again, model);
    assert_eq!(again.to_toml(), text);
    let shown = describe(&model, &Operating::small()).to_string();
    assert_names(&shown, &["[tip.x]"]);
}

#[test]
fn what_cannot_be_a_point_is_refused_with_its_place() {
    let xml = rods_urdf(&RODS);
    let robot = format!("[robot]\nxml = '''{xml}'''\n");
    let point = |keys: &str| format!("{robot}[point.tip]\n{keys}\n");
    let on_tip = |rest: &str| format!("{robot}[point.tip]\nlink = 'rod1'\naxis = [1, 0, 0]\n{rest}");
    let cases = [
        (point("link = 'rod7'"), "point.tip.link: unknown link \"rod7\""),
        (point("at = [0, 0, 0]"), "point.tip"),
        (point("link = 'rod1'\naxis = [0, 0, 0]"), "point.tip.axis: is not a direction"),
        (point("link = 'rod1'\naxis = [1, 0]"), "expected three numbers: a direction"),
        (point("link = 'rod1'\nat = [0.1]"), "expected three numbers, m: the point in the frame of its link"),
        (point("link = 'rod1'\nplace = 3"), "place"),
        (format!("{robot}[point.joint0]\nlink = 'rod1'\naxis = [1, 0, 0]\n"), "is called \"joint0\" already"),
        ("[point.tip]\nlink = 'rod1'\n[bodies]\na = 1.0\n".to_owned(), "only a model with a [robot] has points"),
        (on_tip("[bodies]\ntip = 0.2\n"), "is a point of the robot, which has the inertia of its link"),
        (on_tip("[[inputs]]\nname = 'm'\nkind = 'motion'\non = 'tip'\n"), "whose position follows from the joints"),
        (on_tip("[[inputs]]\nname = 'f'\nkind = 'force'\non = 'tip'\nback_emf = 0.1\n"), "a point of the robot has no motor"),
    ];
    for (text, with) in cases {
        let said = Model::from_toml(&text, "arm.toml").expect_err(&text).to_string();
        assert_names(&said, &[with, "arm.toml"]);
    }
    let text = on_tip("[[elements]]\nkind = 'inerter'\nbetween = ['tip', 'ground']\ninertance = 0.1\n");
    let model = Model::from_toml(&text, "arm.toml").unwrap();
    let said = Plant::new(&model, 1e-3, &Options::default()).expect_err("an inerter").to_string();
    assert!(said.contains("an inerter cannot end at a point of the robot"), "{said}");
    let mut isolated = model.clone();
    assert!(isolated.lock(&["tip".into()]).unwrap_err().contains("is a point of the robot"));
}
