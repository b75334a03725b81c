use super::*;
use crate::fixtures::trial;
use crate::options::{Named, Word, options};
use backdrive_stability::session::AxisSignals;

const GAIN: Gain = Gain { mu: 1.0, lambda: 0.3 };

fn remedy(changes: Vec<Change>) -> Remedy {
    Remedy {
        text: String::new(),
        changes,
        outcome: String::new(),
        stops: true,
        robust: true,
        force_kept: 0.8,
        motion_kept: 0.8,
        throws: None,
        repairs_cause: false,
        options: None,
        signals: None,
    }
}

fn cause(kind: CauseKind, seen: bool, repairs: Vec<Change>) -> Cause {
    let text = String::new;
    Cause {
        kind,
        place: text(),
        evidence: text(),
        without: text(),
        holds_without: true,
        edge_without: None,
        share: None,
        seen,
        confidence: 0.5,
        repairs,
    }
}

fn axis(master: &[f64], force: &[f64]) -> Session {
    let axis = AxisSignals { master: master.to_vec(), force: force.to_vec(), contact: vec![-1.0; force.len()], ..AxisSignals::default() };
    Session {
        name: String::new(),
        period_s: 1e-3,
        axes: vec![axis],
        mu: vec![1.0; force.len()],
        lambda: vec![0.3; force.len()],
        notes: Vec::new(),
        sensors: Vec::new(),
        cut_short: None,
        parts: Vec::new(),
        elsewhere: None,
        bridged_s: 0.02,
    }
}

#[test]
fn the_best_remedy_stops_it_without_a_throw_and_keeps_most() {
    let damping = || vec![Change::Damping { damping: 5.0 }];
    let throw = Throw::of(&axis(&[0.0, 5.0], &[1.0, 1.0]), &axis(&[0.0, 1.0], &[1.0, 1.0]));
    assert!(throw.is_some());
    let worse = [
        Remedy { repairs_cause: true, ..remedy(damping()) },
        remedy(damping()),
        Remedy { force_kept: 0.5, ..remedy(damping()) },
        Remedy { robust: false, force_kept: 0.5, ..remedy(damping()) },
        Remedy { force_kept: 1.0, motion_kept: 1.0, ..remedy(vec![Change::Grip { factor: 2.0 }]) },
        Remedy { throws: throw, force_kept: 1.0, motion_kept: 1.0, repairs_cause: true, ..remedy(damping()) },
        Remedy { stops: false, robust: false, force_kept: 1.0, motion_kept: 1.0, repairs_cause: true, ..remedy(damping()) },
    ];
    let ranks: Vec<f64> = worse.iter().map(rank).collect();
    assert!(ranks.windows(2).all(|pair| pair[0] > pair[1]), "{ranks:?}");
    let (one, two) = (remedy(damping()), remedy([damping(), damping()].concat()));
    assert!(rank(&one) > rank(&two), "of two that do as well the simpler one");
}

#[test]
fn what_was_seen_to_be_wrong_is_repaired_one_by_one_and_all_together() {
    let was = trial(&[]);
    let way = Change::WayRepaired { node: "slave".into(), port: "command".into() };
    let sensor = Change::SensorRepaired { node: "master".into() };
    let causes = [cause(CauseKind::Delay, true, vec![way.clone()]), cause(CauseKind::ScaledSensor, true, vec![sensor.clone()])];
    let all = candidates(&was, GAIN, None, &causes);
    assert_eq!(all[0], (vec![way.clone()], true));
    assert_eq!(all[1], (vec![sensor.clone()], true));
    assert_eq!(all[2], (vec![way, sensor], true));
    assert!(candidates(&was, GAIN, None, &[]).iter().all(|(_, repairs_cause)| !repairs_cause));
}

#[test]
fn only_what_the_loop_has_is_changed() {
    let tried = |changes: &[(&str, &str)], edge: Option<f64>| -> Vec<Change> {
        candidates(&trial(changes), GAIN, edge, &[]).into_iter().flat_map(|(changes, _)| changes).collect()
    };
    let plain = tried(&[], None);
    let laws = plain.iter().filter(|c| matches!(c, Change::Coupling { .. })).count();
    assert_eq!(laws, COUPLINGS.len(), "a scaling can be replaced by a law");
    let has = |all: &[Change], is: &dyn Fn(&Change) -> bool| all.iter().any(is);
    let delays = |c: &Change| matches!(c, Change::Delays { .. });
    assert!(!has(&plain, &delays));
    assert!(has(&tried(&[("to = \"slave.command\"", "to = \"slave.command\"\nimpair = { delay_s = 0.02 }")], None), &delays));
    // A lower gain helps where the limit is below this one, and then it lies below the limit.
    let lower = |all: &[Change]| -> Vec<f64> {
        all.iter().filter_map(|c| if let Change::Gain { lambda, .. } = c { Some(*lambda) } else { None }).collect()
    };
    assert!(lower(&plain).is_empty() && lower(&tried(&[], Some(10.0))).is_empty());
    let below = lower(&tried(&[], Some(0.2)));
    assert!(!below.is_empty() && below.iter().all(|lambda| *lambda < 0.2), "{below:?}");
    // A master without a canceller has nothing to switch off.
    let off = |c: &Change| matches!(c, Change::Canceller { model: None, .. });
    assert!(has(&plain, &off));
}

#[test]
fn every_remedy_with_options_is_made_by_them() {
    let was = trial(&[]);
    let named = Named::of(&was.graph, &was.graph, true);
    let words = |change: Change| options(&[change], &named);
    let text = |all: &[&str]| Some(all.iter().map(|word| Word::Text(word.to_string())).collect::<Vec<_>>());
    assert_eq!(words(Change::Gain { factor: 0.5, lambda: 0.15 }), text(&["--lambda", "0.1500"]));
    assert_eq!(words(Change::Rate { hz: 10_000.0 }), text(&["--rate", "10000"]));
    assert_eq!(words(Change::Coupling { law: LawKind::Wave }), text(&["--coupling", "wave", "--canceller", "none"]));
    assert_eq!(words(Change::HighPass { hz: 1.0 }), text(&["--high-pass", "1"]));
    for change in [Change::Grip { factor: 2.0 }, Change::Damping { damping: 5.0 }, Change::StrongerMotor, Change::Delays { factor: 0.5 }] {
        assert_eq!(words(change.clone()), None, "{change:?} is nothing that an option makes");
        assert_eq!(options(&[Change::Rate { hz: 1e4 }, change], &named), None, "half a remedy is none");
    }
}

#[test]
fn kept_force_and_motion_are_shares_of_what_a_perfect_loop_would_pass_on() {
    let session = |force: &[f64]| axis(&[0.0; 4], force);
    assert!((force_kept(&session(&[0.3; 4]), 0.3) - 1.0).abs() < 1e-12);
    assert!((force_kept(&session(&[0.15; 4]), 0.3) - 0.5).abs() < 1e-12);
    assert_eq!(force_kept(&session(&[9.0; 4]), 0.3), 1.0, "more than all is not better");
    assert_eq!(motion_kept(&session(&[0.0; 4]), &None, 1.0), 1.0);
    let free = |command: f64| {
        let mut session = axis(&[1.0; 4], &[0.0; 4]);
        session.axes[0].contact = vec![0.0; 4];
        session.axes[0].command = vec![command; 4];
        session
    };
    let alone = Some(free(1.0));
    assert!((motion_kept(&free(1.0), &alone, 1.0) - 1.0).abs() < 1e-12);
    assert!((motion_kept(&free(0.4), &alone, 1.0) - 0.4).abs() < 1e-12);
    assert!((motion_kept(&free(0.5), &alone, 0.5) - 1.0).abs() < 1e-12, "a loop at mu = 0.5 passes on half of it");
}

#[test]
fn a_throw_is_what_goes_beyond_the_recording() {
    let recorded = axis(&[-1.0, 1.0], &[2.0, -2.0]);
    assert!(Throw::of(&axis(&[-1.0, 1.05], &[2.1, 0.0]), &recorded).is_none(), "within what a re-simulation misses by itself");
    let moved = Throw::of(&axis(&[-1.0, 1.5], &[2.0, 0.0]), &recorded).unwrap();
    assert!((moved.beyond_m - 0.5).abs() < 1e-12);
    let pushed = Throw::of(&axis(&[0.0, 0.0], &[3.0, 0.0]), &recorded).unwrap();
    assert_eq!((pushed.beyond_m, pushed.force_n, pushed.recorded_force_n), (0.0, 3.0, 2.0));
    assert!(Throw::of(&axis(&[f64::NAN, 0.0], &[f64::NAN, 0.0]), &recorded).is_none(), "what was not recorded throws nothing");
}
