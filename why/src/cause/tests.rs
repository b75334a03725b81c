use super::*;
use crate::fixtures::{contact, difference, trial};
use backdrive_stability::by_itself::compared::AsIf;
use backdrive_stability::by_itself::recorded::Quantity;
use backdrive_stability::outcome::Unit;

const CYCLE: Happening = Happening::LimitCycle { amplitude_m: 1e-3, frequency_hz: 40.0, unit: Unit::Metre };

const AGAIN: Outcome = Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz: 40.0, unit: Unit::Metre };

fn hand() -> Hand {
    Hand { intents: None, steps: 1000, rate_hz: 5000.0 }
}

fn judged(kind: CauseKind, weight: f64) -> (Cause, f64) {
    let cause = Cause {
        kind,
        place: String::new(),
        evidence: String::new(),
        without: String::new(),
        holds_without: true,
        edge_without: None,
        share: None,
        seen: true,
        confidence: 0.0,
        repairs: Vec::new(),
    };
    (cause, weight)
}

/// What is asked of the loop of a graph that shakes at mu*lambda = 0.3.
fn asked<'a>(graph: &'a Graph, was: &'a Trial, hand: &'a Hand, happening: &'a Happening, edge: Option<f64>) -> Asked<'a> {
    let gain = Gain { mu: 1.0, lambda: 0.3 };
    Asked { graph, was, differences: &[], hand, gain, happening, edge, reproduced: true, shakes_again: true, again: &AGAIN, always: &[] }
}

#[test]
fn confidences_are_shares_of_the_weights_and_the_gain_is_the_rest() {
    let (graph, was, hand) = (contact(&[]), trial(&[]), hand());
    let of = |edge, all: Vec<(Cause, f64)>| weighed(&asked(&graph, &was, &hand, &CYCLE, edge), all);
    let alone = of(Some(0.1), Vec::new());
    assert_eq!((alone.len(), alone[0].kind, alone[0].confidence), (1, CauseKind::GainTooHigh, 1.0));
    assert_eq!((alone[0].holds_without, alone[0].edge_without), (true, Some(0.1)));
    let both = of(Some(0.1), vec![judged(CauseKind::Delay, 6.0)]);
    assert_eq!(both[0].kind, CauseKind::Delay, "what was seen comes before the gain");
    let sum: f64 = both.iter().map(|c| c.confidence).sum();
    assert!((sum - 1.0).abs() < 1e-12 && both[0].confidence > 0.9, "{sum} {}", both[0].confidence);
    let weak = of(Some(0.1), vec![judged(CauseKind::Delay, NO_EVIDENCE)]);
    assert_eq!(weak[0].kind, CauseKind::GainTooHigh, "a thing without which the loop does as before explains nothing");
    // Above the limit of the loop the gain would not be too high.
    let limit_above = of(Some(1.0), vec![judged(CauseKind::Delay, 1.0)]);
    let gain = limit_above.iter().find(|c| c.kind == CauseKind::GainTooHigh).unwrap();
    assert!(!gain.holds_without && gain.confidence < limit_above[0].confidence);
}

#[test]
fn what_is_not_reproduced_is_less_sure_and_no_trouble_has_no_cause() {
    let (graph, was, hand) = (contact(&[]), trial(&[]), hand());
    let other = Asked { reproduced: false, ..asked(&graph, &was, &hand, &CYCLE, Some(0.1)) };
    let sum: f64 = weighed(&other, vec![judged(CauseKind::Delay, 6.0)]).iter().map(|c| c.confidence).sum();
    assert!((sum - 0.6).abs() < 1e-12, "{sum}");
    assert!(weighed(&asked(&graph, &was, &hand, &Happening::Nothing, None), vec![judged(CauseKind::Delay, 6.0)]).is_empty());
    // Where the loop does not shake in its re-simulation nothing was learned of its gain.
    let still = Asked { shakes_again: false, ..asked(&graph, &was, &hand, &CYCLE, Some(0.1)) };
    assert_eq!(weighed(&still, vec![judged(CauseKind::Unknown, 1.0)])[0].kind, CauseKind::Unknown);
}

#[test]
fn a_node_that_nothing_explains_is_an_unknown_cause_once() {
    let (graph, was, hand) = (contact(&[]), trial(&[]), hand());
    let odd = |quantity| difference("slave", NodeKind::Slave, quantity, AsIf::Otherwise, None);
    let differences = [odd(Quantity::Effort), odd(Quantity::Position)];
    let lost = Asked { reproduced: false, differences: &differences, ..asked(&graph, &was, &hand, &CYCLE, None) };
    let all = unknown(&lost);
    assert_eq!(all.len(), 1);
    assert_eq!((all[0].0.kind, all[0].0.place.as_str(), all[0].0.seen), (CauseKind::Unknown, "slave", true));
    assert!(unknown(&Asked { reproduced: true, ..lost }).is_empty(), "the loop does what was recorded without it");
}

#[test]
fn each_difference_is_left_out_alone_and_repaired_where_it_is() {
    let (graph, was, hand) = (contact(&[]), trial(&[]), hand());
    let late = difference("slave", NodeKind::Slave, Quantity::Effort, AsIf::Changed { gain: 1.0, late: 50 }, Some("command"));
    let scaled = difference("master", NodeKind::Master, Quantity::Position, AsIf::Changed { gain: 1.2, late: 0 }, None);
    let differences = [late, scaled];
    let all = suspects(&Asked { differences: &differences, ..asked(&graph, &was, &hand, &CYCLE, None) });
    let seen: Vec<&Suspect> = all.iter().filter(|s| s.seen).collect();
    let impaired = |s: &Suspect| s.without.graph.connections.iter().any(|c| c.impairment.is_some());
    assert_eq!(seen.iter().map(|s| s.kind).collect::<Vec<_>>(), [CauseKind::Delay, CauseKind::ScaledSensor]);
    assert!(!impaired(seen[0]) && seen[0].without.distortions.len() == 1, "without the delay the scale stays");
    assert!(impaired(seen[1]) && seen[1].without.distortions.is_empty());
    assert_eq!(seen[0].repairs, [Change::WayRepaired { node: "slave".into(), port: "command".into() }]);
    assert_eq!(seen[1].repairs, [Change::SensorRepaired { node: "master".into() }]);
}

#[test]
fn a_graph_is_suspected_of_what_it_states_and_of_nothing_else() {
    let of = |changes: &[(&str, &str)], happening: &Happening| {
        let (graph, was, hand) = (contact(changes), trial(changes), hand());
        let all = suspects(&asked(&graph, &was, &hand, happening, None));
        assert!(all.iter().all(|s| !s.seen));
        all.into_iter().map(|s| (s.kind, s.place)).filter(|(kind, _)| *kind != CauseKind::CoarseSensor).collect::<Vec<_>>()
    };
    assert_eq!(of(&[], &CYCLE), []);
    assert_eq!(of(&[("rate_hz = 5000", "rate_hz = 500")], &CYCLE), [(CauseKind::Rate, "rate".to_string())]);
    let delay = ("to = \"slave.command\"", "to = \"slave.command\"\nimpair = { delay_s = 0.02 }");
    assert_eq!(of(&[delay], &CYCLE), [(CauseKind::Delay, "slave.command".to_string())]);
    let grip = ("kind = \"canceller\"\nmodel = \"../plant/models/impulse-engine.toml\"\ngrip = \"../plant/grips/normal.toml\"", "");
    let soft = grip.0.replace("normal", "light");
    assert_eq!(of(&[(grip.0, &soft)], &CYCLE), [(CauseKind::Grip, "canceller".to_string())]);
    let filtered = format!("{}\nhigh_pass_hz = 2.0", grip.0);
    assert_eq!(of(&[(grip.0, &filtered)], &CYCLE), [(CauseKind::FilterLag, "canceller".to_string())]);
    let saturation = Happening::Saturation { clamped_share: 0.1, beyond_travel: false };
    assert_eq!(of(&[], &saturation), [(CauseKind::Saturation, "master".to_string())]);
}

#[test]
fn a_re_simulation_reproduces_the_same_thing_at_the_same_frequency() {
    let cycle = |frequency_hz| Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz, unit: Unit::Metre };
    let unstable = Outcome::Unstable { growth_per_s: 3.0 };
    assert!(reproduces(&CYCLE, &cycle(44.0), None) && !reproduces(&CYCLE, &cycle(80.0), None));
    assert!(reproduces(&CYCLE, &unstable, Some(41.0)) && !reproduces(&CYCLE, &unstable, None));
    assert!(!reproduces(&CYCLE, &Outcome::Stable, Some(40.0)));
    assert!(reproduces(&Happening::Nothing, &Outcome::Stable, None) && !reproduces(&Happening::Nothing, &cycle(40.0), None));
    let stairs = Happening::Stairs { amplitude_m: 1e-3, frequency_hz: 3.0, unit: Unit::Metre };
    assert!(reproduces(&stairs, &cycle(4.0), None) && !reproduces(&stairs, &cycle(40.0), None));
    assert_eq!(taken_along(&CYCLE, &Outcome::LimitCycle { amplitude_m: 2.5e-4, frequency_hz: 40.0, unit: Unit::Metre }), Some(0.75));
    assert_eq!(taken_along(&CYCLE, &Outcome::Stable), None);
}
