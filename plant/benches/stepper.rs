//! Time per period of three models: the nonlinear master of paper 002 held by a hand, its linear variant, and a chain
//! with presliding friction.

use backdrive_plant::elements::{Coulomb, Damper, HystereticSpring, Law, MaxwellSlip, Spring};
use backdrive_plant::model::{Body, Element, Hold, Input, InputKind, Model, Output, OutputKind, Place};
use backdrive_plant::stepper::{Options, Plant, Segment};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

const PERIOD_S: f64 = 2e-4;

fn element(between: [Place; 2], law: Law) -> Element {
    Element { name: String::new(), between, law }
}

fn input(kind: InputKind, on: usize) -> Input {
    Input::ideal("", kind, on, Hold::Zero)
}

/// Motor, drum, handle and a prescribed hand; `nonlinear` adds friction and makes the linkage hysteretic.
fn master(nonlinear: bool) -> Model {
    let spring = |k| Law::Spring(Spring { stiffness: k, rest: 0.0 });
    let damper = |b| Law::Damper(Damper { damping: b });
    let [motor, drum, handle, hand] = [Some(0), Some(1), Some(2), Some(3)];
    let mut elements = vec![
        element([motor, drum], spring(39_500.0)),
        element([motor, drum], damper(3.6)),
        element([drum, None], damper(0.2)),
        element([drum, handle], damper(1.0)),
        element([hand, handle], spring(400.0)),
        element([handle, None], damper(23.0)),
    ];
    if nonlinear {
        elements.push(element([motor, None], Law::Coulomb(Coulomb { force: 0.044 })));
        elements.push(element([drum, None], Law::Coulomb(Coulomb { force: 0.1 })));
        let linkage = HystereticSpring {
            stiffness_positive: 3900.0,
            stiffness_negative: 4000.0,
            offset_positive: 0.465,
            offset_negative: 0.0,
            bandwidth: 8500.0,
        };
        elements.push(element([drum, handle], Law::HystereticSpring(linkage)));
    } else {
        elements.push(element([drum, handle], spring(3950.0)));
    }
    Model {
        bodies: [0.01075, 0.0175, 0.04, 0.0].map(|inertia| Body { name: String::new(), inertia }).to_vec(),
        elements,
        inputs: vec![input(InputKind::Force, 0), input(InputKind::Motion, 3)],
        outputs: vec![Output {
            name: String::new(),
            kind: OutputKind::Position(0),
            gain: 1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        }],
        ..Model::default()
    }
}

fn presliding() -> Model {
    let mut model = master(false);
    if let Ok(sliders) = MaxwellSlip::new(vec![50.0; 60], (0..60).map(|i| 0.002 + 0.0016 * f64::from(i)).collect()) {
        model.elements.push(element([Some(1), None], Law::MaxwellSlip(sliders)));
    }
    model
}

/// Rods in a row, each joint driven by a motor through a soft gear, with friction on both sides.
fn arm(joints: usize) -> Option<Plant> {
    let (mut robot, mut network) = ("<robot name='arm'><link name='link0'/>".to_owned(), String::from("[bodies]\n"));
    let (mut elements, mut axis) = (String::new(), "0 1 0");
    for i in 0..joints {
        robot += &format!(
            "<link name='link{}'><inertial><origin xyz='0.1 0 0'/><mass value='1'/><inertia ixx='0.001' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/>\
             </inertial></link><joint name='j{i}' type='continuous'><parent link='link{i}'/><child link='link{}'/><origin xyz='0.2 0 0'/>\
             <axis xyz='{axis}'/></joint>",
            i + 1,
            i + 1
        );
        axis = if axis == "0 1 0" { "1 0 1" } else { "0 1 0" };
        network += &format!("m{i} = 0.1\n");
        elements += &format!("[[elements]]\nkind = 'spring'\nbetween = ['m{i}', 'j{i}']\nstiffness = 1000\n");
        for body in ["m", "j"] {
            elements += &format!("[[elements]]\nkind = 'coulomb'\nbetween = ['{body}{i}', 'ground']\nforce = 0.5\n");
        }
        elements += &format!("[[inputs]]\nname = 'u{i}'\nkind = 'force'\non = 'm{i}'\n");
    }
    let text = format!("[robot]\nxml = \"{robot}</robot>\"\n{network}{elements}");
    Plant::new(&Model::from_toml(&text, "arm").ok()?, PERIOD_S, &Options::default()).ok()
}

fn bench(criterion: &mut Criterion) {
    for (name, model, substeps) in [
        ("linear master, period", master(false), None),
        ("paper 002 master, period", master(true), None),
        ("paper 002 master, 1 substep", master(true), Some(1)),
        ("paper 002 master, 4 substeps", master(true), Some(4)),
        ("master with 60 sliders, 1 substep", presliding(), Some(1)),
    ] {
        let Ok(mut plant) = Plant::new(&model, PERIOD_S, &Options { substeps, ..Options::default() }) else { continue };
        // Forces and motions of a contact, some seconds of them.
        let inputs: Vec<[Segment; 2]> = (0..20_000)
            .map(|i| {
                let t = PERIOD_S * f64::from(i);
                let force = 2.0 * (40.0 * t * (1.0 + t)).sin();
                let hand = |t: f64| 5e-3 * (6.0 * t).sin();
                [Segment::held(force), Segment::line(hand(t), hand(t + PERIOD_S), PERIOD_S)]
            })
            .collect();
        let mut outputs = [0.0];
        let mut next = 0;
        criterion.bench_function(&format!("{name} ({} in it)", plant.substeps()), |b| {
            b.iter(|| {
                plant.step(black_box(&inputs[next]));
                plant.outputs(&mut outputs);
                next = (next + 1) % inputs.len();
                black_box(outputs[0])
            })
        });
    }
    for joints in [2, 7] {
        let Some(mut plant) = arm(joints) else { continue };
        let inputs = vec![Segment::held(1.0); joints];
        criterion.bench_function(&format!("arm of {joints} joints with motors and friction, period ({} in it)", plant.substeps()), |b| {
            b.iter(|| {
                plant.step(black_box(&inputs));
                black_box(plant.position(0))
            })
        });
    }
    let model = master(true);
    criterion.bench_function("compile paper 002 master", |b| b.iter(|| Plant::new(black_box(&model), PERIOD_S, &Options::default())));
}

criterion_group!(benches, bench);
criterion_main!(benches);
