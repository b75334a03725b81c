use super::*;
use crate::as_recorded::{as_recorded, is_modelled};
use crate::cause_kind::CauseKind;
use crate::device::{DeviceFound, NumberFound, PhysicsFound};
use crate::fixtures::{contact, difference};
use crate::named::named;
use backdrive_diagnosis::hypothesis::Family;

const PERIOD_S: f64 = 2e-4;

fn of_slave(as_if: AsIf, way: Option<&str>) -> Difference {
    difference("slave", NodeKind::Slave, Quantity::Effort, as_if, way)
}

#[test]
fn only_a_way_that_is_late_becomes_an_impairment() {
    let way = |as_if| of_slave(as_if, Some("command")).impairment(PERIOD_S, 7);
    let late = way(AsIf::Changed { gain: 1.0, late: 50 }).unwrap();
    assert!((late.delay_s - 0.01).abs() < 1e-12 && late.jitter_s == 0.0 && late.loss == 0.0 && late.seed == 7);
    let uneven = way(AsIf::Unsteady { late: 10, jitter: 20, missing: 0.05 }).unwrap();
    assert!((uneven.delay_s - 2e-3).abs() < 1e-12 && (uneven.jitter_s - 4e-3).abs() < 1e-12);
    assert_eq!(uneven.loss, 0.0, "a sample that is overtaken looks like a small loss");
    assert_eq!(way(AsIf::Unsteady { late: 10, jitter: 20, missing: 0.3 }).unwrap().loss, 0.3);
    assert_eq!(way(AsIf::Unsteady { late: 0, jitter: 0, missing: 0.05 }).unwrap().loss, 0.05);
    assert!(way(AsIf::Dead { from_row: 3 }).is_none() && way(AsIf::Otherwise).is_none());
    assert!(of_slave(AsIf::Changed { gain: 1.0, late: 50 }, None).impairment(PERIOD_S, 7).is_none(), "a late sensor is no late way");
}

#[test]
fn a_delay_adds_to_the_one_in_the_graph_on_its_own_way_only() {
    let mut graph = contact(&[("to = \"slave.command\"", "to = \"slave.command\"\nimpair = { delay_s = 0.02, loss = 0.4 }")]);
    let slave = graph.nodes.iter().position(|n| n.kind == NodeKind::Slave).unwrap();
    let before = graph.connections.clone();
    let found = of_slave(AsIf::Unsteady { late: 50, jitter: 25, missing: 0.2 }, Some("command"));
    delay(&mut graph, slave, &found);
    for (was, is) in before.iter().zip(&graph.connections) {
        if (is.to.0, is.to.1.as_str()) == (slave, "command") {
            let impairment = is.impairment.unwrap();
            assert!((impairment.delay_s - 0.03).abs() < 1e-12 && (impairment.jitter_s - 5e-3).abs() < 1e-12);
            assert_eq!(impairment.loss, 0.4, "the larger loss counts, not the sum");
        } else {
            assert_eq!(was.impairment, is.impairment);
        }
    }
}

#[test]
fn each_thing_that_a_signal_does_is_a_cause_of_its_own() {
    let graph = contact(&[]);
    let kind = |as_if, way| named(&of_slave(as_if, way), &graph).0;
    let expected = [
        (AsIf::Dead { from_row: 100 }, CauseKind::DeadSensor),
        (AsIf::Railed { low: f64::NEG_INFINITY, high: 3.0 }, CauseKind::RailedSensor),
        (AsIf::Stepped { step: 0.1 }, CauseKind::CoarseSensor),
        (AsIf::Noisy { deviation: 0.1 }, CauseKind::CoarseSensor),
        (AsIf::Changed { gain: -1.0, late: 0 }, CauseKind::WrongSign),
        (AsIf::Changed { gain: -1.0, late: 9 }, CauseKind::WrongSign),
        (AsIf::Changed { gain: 1.5, late: 0 }, CauseKind::ScaledSensor),
        (AsIf::Changed { gain: 1.5, late: 9 }, CauseKind::ScaledSensor),
        (AsIf::Changed { gain: 1.02, late: 9 }, CauseKind::LateSensor),
        (AsIf::Otherwise, CauseKind::Unknown),
    ];
    for (as_if, cause) in expected {
        assert_eq!(kind(as_if, None), cause, "{as_if:?}");
    }
    assert_eq!(kind(AsIf::Changed { gain: 1.0, late: 9 }, Some("command")), CauseKind::Delay);
    assert_eq!(kind(AsIf::Unsteady { late: 0, jitter: 0, missing: 0.1 }, Some("command")), CauseKind::Loss);
    assert_eq!(kind(AsIf::Unsteady { late: 0, jitter: 3, missing: 0.5 }, Some("command")), CauseKind::Loss);
    assert_eq!(kind(AsIf::Unsteady { late: 9, jitter: 3, missing: 0.5 }, Some("command")), CauseKind::Delay);
    let (_, place, _) = named(&of_slave(AsIf::Changed { gain: 1.0, late: 9 }, Some("command")), &graph);
    assert_eq!(place, "slave.command", "a late way is named by the input at its end");
}

#[test]
fn the_diagnosis_of_the_master_decides_the_cause_by_its_first_effect_or_its_most_changed_parameter() {
    let graph = contact(&[]);
    let device = |physics: Vec<PhysicsFound>, numbers: Vec<NumberFound>| {
        let mut found = difference("master", NodeKind::Master, Quantity::Position, AsIf::Otherwise, None);
        found.device =
            Some(DeviceFound { word: "missing".into(), sentence: "it differs".into(), physics, numbers, tuned: Vec::new(), files: None });
        let (kind, place, _) = named(&found, &graph);
        (kind, place)
    };
    let effect = |family, of_signal| PhysicsFound {
        physics: "effect".into(),
        place: "handle".into(),
        family: Some(family),
        of_signal,
        size: None,
        confidence: 0.9,
    };
    let of = |family, of_signal| device(vec![effect(family, of_signal), effect(Family::Hysteresis, false)], Vec::new()).0;
    assert_eq!(of(Family::Friction, false), CauseKind::DryFriction);
    assert_eq!(of(Family::Contact, false), CauseKind::Backlash);
    assert_eq!(of(Family::Compliance, false), CauseKind::Compliance);
    assert_eq!(of(Family::Lag, true), CauseKind::LateSensor);
    assert_eq!(of(Family::Lag, false), CauseKind::OtherPhysics, "a lag of the force is no late sensor");
    let number = |path: &str, declared: f64, found: f64, of_grip| NumberFound { path: path.into(), declared, found, of_grip };
    let small = number("elements.cable.stiffness", 100.0, 110.0, false);
    assert_eq!(
        device(Vec::new(), vec![small.clone(), number("bodies.handle", 1.0, 0.5, false)]),
        (CauseKind::Inertia, "bodies.handle".into())
    );
    assert_eq!(device(Vec::new(), vec![number("elements.grip.stiffness", 1.0, 3.0, true), small.clone()]).0, CauseKind::Grip);
    assert_eq!(device(Vec::new(), vec![small]).0, CauseKind::OtherPhysics);
    assert_eq!(device(Vec::new(), Vec::new()).0, CauseKind::Unknown);
}

#[test]
fn the_recorded_loop_has_every_difference_that_has_a_model() {
    let graph = contact(&[]);
    let late = of_slave(AsIf::Changed { gain: 1.0, late: 50 }, Some("command"));
    let scaled = difference("master", NodeKind::Master, Quantity::Position, AsIf::Changed { gain: 1.2, late: 0 }, None);
    let odd = difference("canceller", NodeKind::Canceller, Quantity::Position, AsIf::Otherwise, None);
    assert_eq!([&late, &scaled, &odd].map(is_modelled), [true, true, false]);
    let recorded = as_recorded(&graph, &[late, scaled, odd]);
    let delays: Vec<f64> = recorded.graph.connections.iter().filter_map(|c| Some(c.impairment?.delay_s)).collect();
    assert!(delays.len() == 1 && (delays[0] - 0.01).abs() < 1e-12, "{delays:?}");
    assert_eq!(recorded.distortions.len(), 1);
    let distortion = &recorded.distortions[0];
    assert_eq!((distortion.node.as_str(), distortion.gain, distortion.late), ("master", 1.2, 0));
    let unchanged = as_recorded(&graph, &[]);
    assert!(unchanged.distortions.is_empty() && unchanged.cores().is_none());
}
