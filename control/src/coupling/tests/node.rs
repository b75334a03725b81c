use crate::core::{Core, Events, Port, Tick};
use crate::coupling::node::{FarNode, NearNode};
use crate::coupling::{Conditions, Law, LawKind};
use crate::scaling::GainPlan;
use backdrive_msgs::{Sample, flag};

const PERIOD: f64 = 1e-3;
const CONDITIONS: Conditions = Conditions { period_s: PERIOD, round_trip_s: 0.0, held_steps: 2 };

fn tick(step: u64) -> Tick {
    Tick { step, time_s: step as f64 * PERIOD, period_s: PERIOD }
}

fn plan(mu: f64, lambda: f64) -> GainPlan {
    GainPlan { mu, lambda, ramp_s: 0.01, changes: Vec::new() }
}

fn port(step: u64, position: f64, effort: f64, flags: u32) -> Port {
    let mut sample = Sample::new(1);
    (sample.step, sample.flags) = (step, flags);
    (sample.position[0], sample.velocity[0], sample.effort[0]) = (position, 0.0, effort);
    Port { sample: Some(sample), age_steps: 0 }
}

fn step(core: &mut dyn Core, at: u64, inputs: &[Port]) -> [Sample; 2] {
    let mut outputs = [Sample::new(1), Sample::new(1)];
    core.step(&tick(at), inputs, &mut outputs, &mut Events::default());
    outputs
}

#[test]
fn scales_are_applied_outside_the_law() {
    let mut near = NearNode::new(1, &Law::Direct, plan(2.0, 0.25), &CONDITIONS, 100.0, 0.02);
    let [force, to_far] = step(&mut near, 0, &[port(0, 0.003, f64::NAN, 0), port(0, 0.0, -8.0, 0), Port::EMPTY]);
    assert_eq!((force.effort[0], to_far.position[0]), (-2.0, 0.006));
    assert_eq!(near.gains(), Some((2.0, 0.25)));
}

#[test]
fn silence_of_the_link_takes_the_force_away_and_lets_the_slave_hold() {
    let mut near = NearNode::new(1, &Law::Direct, plan(1.0, 1.0), &CONDITIONS, 100.0, 0.02);
    let mut far = FarNode::new(1, &Law::Direct, &CONDITIONS, 0.02);
    let (mut forces, mut commands, mut flags) = (Vec::new(), Vec::new(), Vec::new());
    for at in 0..60 {
        let heard = at.min(10);
        let [force, _] = step(&mut near, at, &[port(at, 0.001, f64::NAN, 0), port(heard, 0.0, -1.0, 0), Port::EMPTY]);
        let [command, back] = step(&mut far, at, &[port(at, 0.0, -1.0, 0), port(heard, 0.001, 0.0, 0)]);
        forces.push(force.effort[0]);
        commands.push(command.position[0]);
        flags.push(back.flags & flag::STALE);
    }
    // The last packet is of step 10, and stale after 20 ms.
    assert!(forces[..30].iter().all(|f| *f == -1.0) && forces[30..].iter().all(|f| f.is_nan()), "{forces:?}");
    assert!(commands[..30].iter().all(|x| *x == 0.001) && commands[30..].iter().all(|x| x.is_nan()), "{commands:?}");
    assert!(flags[..30].iter().all(|f| *f == 0) && flags[30..].iter().all(|f| *f == flag::STALE));
    // What a slave that holds feels is not the hand's doing.
    let [force, _] = step(&mut near, 60, &[port(60, 0.001, f64::NAN, 0), port(60, 0.0, -1.0, flag::STALE), Port::EMPTY]);
    assert_eq!(force.flags & flag::STALE, flag::STALE);
}

#[test]
fn a_slave_that_is_silent_is_reported_to_the_master() {
    let mut far = FarNode::new(1, &Law::Direct, &CONDITIONS, 0.01);
    let flags: Vec<u32> =
        (0..40).map(|at| step(&mut far, at, &[port(at.min(5), 0.0, -1.0, 0), port(at, 0.001, 0.0, 0)])[1].flags & flag::STALE).collect();
    assert!(flags[..15].iter().all(|f| *f == 0) && flags[15..].iter().all(|f| *f == flag::STALE), "{flags:?}");
    // It comes back.
    let [_, back] = step(&mut far, 40, &[port(40, 0.0, -1.0, 0), port(40, 0.001, 0.0, 0)]);
    assert_eq!((back.flags & flag::STALE, back.effort[0]), (0, -1.0));
}

#[test]
fn before_the_first_packet_the_slave_stays() {
    let mut far = FarNode::new(1, &LawKind::Wave.usual(), &CONDITIONS, 0.02);
    let [command, back] = step(&mut far, 0, &[port(0, 0.004, 0.0, 0), Port::EMPTY]);
    assert_eq!(command.position[0], 0.004);
    assert!(back.position[0].is_nan());
    let [command, _] = step(&mut far, 1, &[port(1, 0.0035, 0.0, 0), Port::EMPTY]);
    assert_eq!(command.position[0], 0.004, "where it was, not where it sags to");
}

#[test]
fn what_is_no_number_harms_no_law() {
    for (name, kind) in LawKind::ALL {
        let law = kind.usual();
        let mut near = NearNode::new(1, &law, plan(1.0, 0.5), &CONDITIONS, 100.0, 0.02);
        let mut far = FarNode::new(1, &law, &CONDITIONS, 0.02);
        for at in 0..50 {
            let broken = at == 20;
            let value = |x: f64| if broken { f64::NAN } else { x };
            let [force, there] =
                step(&mut near, at, &[port(at, 0.001, 0.0, 0), port(at, 0.0, value(-1.0), 0), port(at, 0.0, value(1.0), 0)]);
            let [command, _] = step(&mut far, at, &[port(at, 0.0, value(-1.0), 0), port(at, value(there.position[0]), there.effort[0], 0)]);
            assert!(force.effort[0].is_finite() && command.position[0].is_finite(), "{name} at step {at}");
        }
    }
}
