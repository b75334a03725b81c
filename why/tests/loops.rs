//! Loops with a fault that their graph does not have: a run with the fault, whose bag holds the graph and the models without it. Each is a kind of
//! fault, not a case: what is asked for is its name, its place and its size.

#[path = "../examples/sealed_causes/bag.rs"]
mod bag;

use backdrive_nodes::graph::{Direction, Graph, NodeKind, Overrides};
use backdrive_nodes::stage::Impairment;
use backdrive_stability::by_itself::compared::AsIf;
use backdrive_stability::by_itself::recorded::Quantity;
use backdrive_stability::by_itself::shapes::{Filter, Renewal};
use backdrive_why::answer::Answer;
use backdrive_why::cause_kind::CauseKind;
use backdrive_why::change::{Change, firmer};
use backdrive_why::faulty::{Distortion, Side};
use backdrive_why::happening::Happening;
use backdrive_why::knob::Knob;
use backdrive_why::trial::Trial;
use std::path::{Path, PathBuf};

/// What is said of the contact task at `lambda`, run with a fault.
fn said(lambda: f64, cancels: bool, more: Overrides, fault: impl Fn(&mut Trial)) -> Answer {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/contact.toml");
    let canceller = if cancels { None } else { Some(PathBuf::from("none")) };
    let declared = Graph::load(&path, &Overrides { lambda: Some(lambda), canceller, ..more }).unwrap();
    let mut truth = Trial::of(declared.clone());
    fault(&mut truth);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("loop.mcap");
    bag::record(&declared, &truth, &file);
    bag::asked(&file)
}

/// Something soft, at which the loop without a fault bears a gain of 20.
fn soft() -> Overrides {
    let environment = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/environments/soft-tissue.toml");
    Overrides { environment: Some(environment), ..Overrides::default() }
}

fn first(answer: &Answer) -> (CauseKind, String) {
    let cause = answer.causes.first().unwrap_or_else(|| panic!("{:?} {:?}", answer.happening, answer.differs));
    (cause.kind, cause.evidence.clone())
}

/// The number found of a device.
fn number(answer: &Answer, knob: Knob) -> f64 {
    let mut all = answer.differences.iter().flat_map(|d| d.device.iter().flat_map(|device| &device.tuned));
    all.find(|n| n.knob == knob).unwrap_or_else(|| panic!("{:?}", answer.differs)).value
}

#[test]
fn a_sensor_of_the_wrong_sign_is_named_though_the_loop_never_touches_and_its_repair_comes_first() {
    let answer = said(1.0, false, Overrides::default(), |t| {
        t.distortions.push(Distortion { gain: -1.0, ..Distortion::none("master", Quantity::Position, 0) });
    });
    assert!(matches!(answer.happening, Happening::NotJudged { .. }), "{:?}", answer.happening);
    assert_eq!(first(&answer).0, CauseKind::WrongSign, "{:?}", answer.causes);
    let remedy = &answer.remedies[0];
    assert!(remedy.stops && matches!(&remedy.changes[..], [Change::SensorRepaired { node }] if node == "master"), "{}", remedy.text);
}

#[test]
fn commands_that_are_held_have_their_rate_and_what_a_higher_one_gives() {
    let answer = said(6.0, false, soft(), |t| {
        let stage = NodeKind::Scaling.port("command", Direction::Output).unwrap().0;
        let hold = Some(Renewal { rows: 5000.0 / 30.0, phase: 0.0 });
        t.distortions.push(Distortion { stage, hold, ..Distortion::none("scaling", Quantity::Position, 0) });
    });
    assert!(answer.happening.is_trouble(), "{}", answer.happens);
    let (kind, evidence) = first(&answer);
    assert!(kind == CauseKind::Rate && evidence.contains("30.0 Hz"), "{kind:?} {evidence}");
    assert!(answer.remedies.iter().any(|r| matches!(r.changes[..], [Change::Renewals { .. }])));
    assert!(answer.remedies.iter().any(|r| matches!(r.changes[..], [Change::Interpolated])));
}

#[test]
fn a_wrong_torque_constant_is_one_factor_on_all_forces_of_the_device() {
    let answer = said(1.7, false, Overrides::default(), |t| Knob::Motor.apply(t, "master", 1.6));
    assert!(answer.happening.is_trouble(), "{}", answer.happens);
    assert_eq!(first(&answer).0, CauseKind::TorqueConstant, "{:?}", answer.causes);
    assert!((number(&answer, Knob::Motor) / 1.6 - 1.0).abs() < 0.01, "{:?}", answer.differs);
    assert!(answer.causes[0].share.is_some_and(|share| share > 0.99), "{:?}", answer.causes[0]);
}

#[test]
fn a_firmer_grip_and_a_delay_are_both_named() {
    let answer = said(1.0, true, Overrides { high_pass_hz: Some(0.0), ..Overrides::default() }, |t| {
        firmer(&mut t.graph, 1.5);
        let master = t.graph.nodes.iter().position(|n| n.kind == NodeKind::Master).unwrap();
        let late = Some(Impairment { delay_s: 8e-3, jitter_s: 0.0, loss: 0.0, seed: 3 });
        t.graph.connections.iter_mut().filter(|c| c.to.0 == master && c.to.1 == "force").for_each(|c| c.impairment = late);
    });
    assert!(answer.happening.is_trouble(), "{}", answer.happens);
    let kinds: Vec<CauseKind> = answer.causes.iter().take(3).map(|c| c.kind).collect();
    assert!(kinds.contains(&CauseKind::Grip) && kinds.contains(&CauseKind::Delay), "{:?}", answer.causes);
    assert!((number(&answer, Knob::Grip) / 1.5 - 1.0).abs() < 0.02, "{:?}", answer.differs);
    assert!(answer.differs.iter().any(|d| d.contains("8.00 ms")), "{:?}", answer.differs);
}

#[test]
fn a_low_pass_in_the_force_path_is_no_late_sensor() {
    for (order, corner_hz) in [(1, 30.0), (2, 55.0)] {
        let answer = said(14.0, false, soft(), |t| {
            let filter = Some(Filter { order, corner_hz });
            let (stage, side) = (NodeKind::Master.port("force", Direction::Input).unwrap().0, Side::Input(1));
            t.distortions.push(Distortion { stage, side, filter, ..Distortion::none("master", Quantity::Effort, 0) });
        });
        assert!(answer.differs.iter().any(|d| d.contains(&format!("order {order}"))), "{:?}", answer.differs);
        let corner = answer.differences.iter().find_map(|d| match d.compared.as_if {
            AsIf::Filtered { corner_hz, .. } => Some(corner_hz),
            _ => None,
        });
        assert!(corner.is_some_and(|hz| (hz / corner_hz - 1.0).abs() < 0.03), "{corner:?}");
        assert!(!answer.happening.is_trouble() || first(&answer).0 == CauseKind::FilterLag, "{:?}", answer.causes);
    }
}

#[test]
fn a_stated_rate_that_is_too_low_is_the_rate_and_less_gain_is_a_remedy() {
    let answer = said(1.5, false, Overrides { rate_hz: Some(100.0), ..Overrides::default() }, |_| {});
    assert!(answer.happening.is_trouble(), "{}", answer.happens);
    let (kind, evidence) = first(&answer);
    assert!(kind == CauseKind::Rate && evidence.contains("100 Hz"), "{kind:?} {evidence}");
    assert!(answer.remedies.iter().any(|r| r.stops && matches!(r.changes[..], [Change::Gain { .. }])));
}

#[test]
fn a_weak_servo_and_a_stiff_wall_are_the_slaves() {
    let answer = said(1.0, false, Overrides::default(), |t| {
        Knob::Servo.apply(t, "slave", 0.05);
        Knob::Wall.apply(t, "slave", 3.0);
    });
    assert!((number(&answer, Knob::Servo) / 0.05 - 1.0).abs() < 0.05, "{:?}", answer.differs);
    assert!((number(&answer, Knob::Wall) / 3.0 - 1.0).abs() < 0.05, "{:?}", answer.differs);
}

/// A leader and a follower whose gear breaks away at 2.8 N m and slides at 0.7 N m on a servo of 60 N m/rad: steps of up to 2 (2.8 - 0.7)/60 = 70 mrad.
const STAIRS: [(&str, &str); 4] = [
    (
        "leader.toml",
        "name = 'leader'\nmotion = 'rotation'\nbodies = { handle = 0.02 }\n\
         elements = [{ name = 'damping', kind = 'damper', between = ['handle', 'ground'], damping = 0.1 }]\n\
         inputs = [{ name = 'feedback', kind = 'force', on = 'handle', hold = 'zero' }]\n\
         outputs = [{ name = 'angle', kind = 'position', of = 'handle' }]\n\
         axes = [{ name = 'rot', user = 'handle', feedback = 'feedback', measured = 'angle', travel = [-3.0, 3.0] }]\n",
    ),
    (
        "follower.toml",
        "name = 'follower'\nmotion = 'rotation'\nbodies = { command = 0.0, joint = 0.35 }\n\
         elements = [{ name = 'servo', kind = 'spring', between = ['command', 'joint'], stiffness = 60.0 },\n\
         { name = 'servo_damping', kind = 'damper', between = ['joint', 'ground'], damping = 3.0 },\n\
         { name = 'gear', kind = 'stribeck', between = ['joint', 'ground'], coulomb = 0.7, static = 2.8, velocity = 0.1 }]\n\
         inputs = [{ name = 'command', kind = 'motion', on = 'command', hold = 'linear' }]\n\
         outputs = [{ name = 'angle', kind = 'position', of = 'joint' }]\n\
         axes = [{ name = 'rot', user = 'joint', feedback = 'command', measured = 'angle', travel = [-3.0, 3.0] }]\n",
    ),
    (
        "knob.toml",
        "name = 'knob'\nkind = 'fragment'\nmotion = 'rotation'\n\
         elements = [{ name = 'wrist', kind = 'spring', between = ['port', 'hand'], stiffness = 8.0 },\n\
         { name = 'wrist_damping', kind = 'damper', between = ['port', 'hand'], damping = 0.15 }]\n",
    ),
    (
        "stairs.toml",
        "title = 'stairs'\nrate_hz = 500\nduration_s = 8.0\nclock = 'lockstep'\nseed = 1\n[gains]\nmu = 1.0\nlambda = 0.0\n\
         [[nodes]]\nname = 'operator'\nkind = 'operator'\nwaypoints = [{ t = 0.5, x = 0.0 }, { t = 7.5, x = 0.35 }]\n\
         [[nodes]]\nname = 'master'\nkind = 'master'\nmodel = 'leader.toml'\ngrip = 'knob.toml'\n[[nodes]]\nname = 'scaling'\nkind = 'scaling'\n\
         [[nodes]]\nname = 'slave'\nkind = 'slave'\nmodel = 'follower.toml'\n[[nodes]]\nname = 'recorder'\nkind = 'recorder'\nbag = 'stairs.mcap'\n\
         [[connections]]\nfrom = 'operator.intent'\nto = 'master.intent'\n[[connections]]\nfrom = 'master.measured'\nto = 'scaling.motion'\n\
         [[connections]]\nfrom = 'scaling.command'\nto = 'slave.command'\n[[connections]]\nfrom = 'slave.measured'\nto = 'scaling.contact'\ndelay = 1\n\
         [[connections]]\nfrom = 'master.measured'\nto = 'scaling.measured'\ndelay = 1\n[[connections]]\nfrom = 'scaling.force'\nto = 'master.force'\n",
    ),
];

#[test]
fn a_follower_that_goes_in_stairs_is_named_without_a_loop_and_each_remedy_is_tried() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in STAIRS {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let graph = Graph::load(&folder.path().join("stairs.toml"), &Overrides::default()).unwrap();
    let file = folder.path().join("stairs.mcap");
    bag::record(&graph, &Trial::of(graph.clone()), &file);
    let answer = bag::asked(&file);
    let Happening::FollowerStairs { step, stands, .. } = answer.happening else { panic!("{}", answer.happens) };
    assert!((0.05..0.09).contains(&step) && stands > 0.5 && answer.reproduced, "{}", answer.happens);
    assert_eq!(first(&answer).0, CauseKind::Stiction, "{:?}", answer.causes);
    let tried = |of: fn(&Change) -> bool| answer.remedies.iter().any(|r| of(&r.changes[0]));
    assert!(tried(|c| matches!(c, Change::Servo { .. })) && tried(|c| matches!(c, Change::FeedForward { .. })));
    assert!(tried(|c| matches!(c, Change::Dither { .. })));
    assert!(answer.remedies[0].stops, "{:?}", answer.remedies.iter().map(|r| (&r.text, &r.outcome)).collect::<Vec<_>>());
}
