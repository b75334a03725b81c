use super::*;
use crate::canceller::Canceller;
use crate::changing_grip::{ChangingGrip, GripChange};
use crate::core::{Core, Events, Port, Tick};
use crate::device::{Device, DeviceOptions, DeviceRole};
use crate::mechanism::Mechanism;
use crate::scaling::{GainChange, GainPlan};
use backdrive_msgs::{Gains, MAX_AXES, Sample};
use backdrive_plant::model::{Fragment, Model};
use std::path::Path;

const PERIOD: f64 = 1.0 / 5000.0;

fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant").join(file)).unwrap()
}

fn master(name: &str) -> Model {
    Model::from_toml(&read(&format!("models/{name}.toml")), name).unwrap()
}

fn grip(firmness: f64) -> Fragment {
    let mut grip = Fragment::from_toml(&read("grips/normal.toml"), "normal.toml").unwrap();
    grip.scale(firmness);
    grip
}

fn bank(model: &Model) -> HandBank {
    HandBank::new(model, Some(&grip(1.0)), &HandSettings::default(), PERIOD, &DeviceOptions::default()).unwrap()
}

/// A master held by hands one after another, pushed by the force of a contact that comes and goes, its hand moving as well; what a canceller sees of it.
struct Played {
    scheduled: Scheduled,
    device: ChangingGrip,
    step: usize,
    force: f64,
    events: Events,
}

impl Played {
    fn new(model: &Model, firmness: f64, changes: &[GripChange]) -> Played {
        let mut device = ChangingGrip::new(model, Some(&grip(firmness)), changes, PERIOD, &DeviceOptions::default()).unwrap();
        device.start(&[0.0], &[0.0]);
        Played { scheduled: Scheduled::new(bank(model), None, PERIOD), device, step: 0, force: 0.0, events: Events::default() }
    }

    /// Goes on with this peak of a force that is a step every 0.1 s; the hand moves by 2 mm at 1 Hz.
    fn play(&mut self, seconds: f64, peak: f64) -> Estimate {
        for _ in 0..(seconds / PERIOD) as usize {
            self.step += 1;
            let time = self.step as f64 * PERIOD;
            self.device.step(&[self.force], &[2e-3 * (std::f64::consts::TAU * time).sin()]);
            let mut measured = [0.0; MAX_AXES];
            measured[0] = self.device.measured(0);
            let mut force = [0.0; MAX_AXES];
            force[0] = self.force;
            self.scheduled.step(&force, Some(&measured), &mut self.events);
            self.force = if ((time * 10.0) as usize).is_multiple_of(2) { peak } else { 0.3 * peak };
        }
        self.scheduled.estimate(0).unwrap()
    }
}

#[test]
fn a_constant_hand_is_found_within_its_uncertainty() {
    for name in ["impulse-engine-linear", "impulse-engine"] {
        for firmness in [0.5, 0.8, 1.0, 1.3, 2.0] {
            let estimate = Played::new(&master(name), firmness, &[]).play(1.0, -4.0);
            let error = estimate.softness * firmness - 1.0;
            println!("{name}, {firmness}: {:.4} +- {:.4}", estimate.firmness(), estimate.deviation / estimate.softness.powi(2));
            assert!(error.abs() < 0.03, "{name}, {firmness}: {estimate:?}");
            assert!((estimate.softness - 1.0 / firmness).abs() < 2.0 * estimate.deviation, "{name}, {firmness}: {estimate:?}");
            assert!(estimate.deviation * firmness < 0.1, "{name}, {firmness}: {estimate:?}");
        }
    }
}

#[test]
fn a_change_is_seen_within_a_quarter_of_a_second_and_known_within_a_second() {
    for (before, after) in [(0.5, 2.0), (2.0, 0.5), (1.0, 1.5)] {
        let model = master("impulse-engine");
        let change = [GripChange { at_s: 1.0, scale: after / before }];
        let mut played = Played::new(&model, before, &change);
        played.play(1.0, -4.0);
        let estimate = played.play(0.25, -4.0);
        // The force has gone up and down once and again since.
        let error = (estimate.softness * after - 1.0).abs();
        assert!(error < 0.3 && error < 2.0 * estimate.deviation * after, "from {before} to {after}: {estimate:?}");
        let later = played.play(0.75, -4.0);
        println!("from {before} to {after}: {:.3} after 0.25 s, {:.3} after 1 s", estimate.firmness(), later.firmness());
        assert!((later.softness * after - 1.0).abs() < 0.08, "from {before} to {after}: {later:?}");
        let told: Vec<(&str, f64, u32)> = played.events.drain().collect();
        let last = told.last().copied().unwrap_or(("", 0.0, 0));
        assert!(last.0 == "hand_holds" && (last.1 / after - 1.0).abs() < 0.25, "{told:?}");
    }
}

#[test]
fn without_a_force_nothing_is_known_and_what_was_known_fades() {
    let mut played = Played::new(&master("impulse-engine"), 1.0, &[]);
    assert_eq!(played.play(0.5, 0.0).deviation, f64::INFINITY);
    let known = played.play(1.0, -4.0);
    let later = played.play(1.0, 0.0);
    let much_later = played.play(2.0, 0.0);
    assert!(
        later.deviation > 2.0 * known.deviation && much_later.deviation > 2.0 * later.deviation,
        "{known:?}, {later:?}, {much_later:?}"
    );
}

#[test]
fn until_something_is_known_the_firmest_hand_is_cancelled_and_half_of_what_it_does_at_rest() {
    let model = master("impulse-engine-linear");
    let bank = bank(&model);
    let firmest = 1.0 / bank.softness()[0];
    assert!(firmest >= HandSettings::default().firmest);
    assert!(bank.softness().windows(2).all(|w| w[0] < w[1]));
    let mut own = Device::new(&model, Some(&grip(firmest)), DeviceRole::Master, PERIOD, &DeviceOptions::default()).unwrap();
    let mut scheduled = Scheduled::new(bank, None, PERIOD);
    let mut force = [0.0; MAX_AXES];
    scheduled.step(&force, None, &mut Events::default());
    own.start(&[0.0], &[]);
    force[0] = 2.0;
    let mut induced = 0.0;
    for step in 0..15_000 {
        induced = scheduled.step(&force, None, &mut Events::default())[0];
        own.step(&force[..1], &[]);
        // Fast is what happens within 2 ms, to 1 Hz: all but 3 per cent of it.
        let share = induced / own.measured(0);
        assert!(step != 10 || (share - 0.97).abs() < 0.01, "{share}");
    }
    // At rest the handle gives way by F/k, and the linkage and the cable by their own.
    let gives = 2.0 / (400.0 * firmest) + 2.0 / 3950.0 + 2.0 / 39500.0;
    assert!((induced / gives - 0.5 * 0.97).abs() < 0.005, "{induced} of {gives}");
}

#[test]
fn what_is_left_acts_as_no_canceller_far_below_its_edge() {
    let mut scheduled = Scheduled::new(bank(&master("impulse-engine-linear")), Some(2.0), PERIOD);
    for gain in [0.1, 0.6, 1.0, 3.0, 10.0, 100.0] {
        scheduled.set_gain(gain);
        let left = (1.0 - scheduled.share()) * gain;
        // All of a low gain, of a higher one no more than 0.3 of the critical gain, of a very high one the share that is never cancelled.
        let expected = if gain < 0.6 { gain } else { f64::max(0.6, 0.03 * gain) };
        assert!((left - expected).abs() < 1e-12, "{gain}: {left}");
    }
    let unknown = Scheduled::new(bank(&master("impulse-engine-linear")), None, PERIOD);
    assert_eq!(unknown.share(), 0.97);
}

#[test]
fn where_too_little_moved_a_firmer_hand_is_cancelled() {
    let mut axis = Played::new(&master("impulse-engine-linear"), 1.0, &[]).scheduled;
    let estimate = |deviation: f64| Estimate { softness: 1.5, deviation };
    let axis = axis.axis_mut(0).unwrap();
    assert_eq!(axis.cancelled(&estimate(f64::INFINITY), false), 0.0);
    let guess = axis.cancelled(&estimate(0.3), false);
    assert!((guess - 1.5 * (1.0 - 5.0 * 0.1)).abs() < 1e-12, "{guess}");
    assert_eq!(axis.cancelled(&estimate(0.15), false), 1.5);
    // It stays known while nothing moves, and not beyond a change.
    assert_eq!(axis.cancelled(&estimate(0.3), false), 1.5);
    assert!(axis.cancelled(&estimate(0.3), true) < 1.5);
}

#[test]
fn what_nothing_holds_has_no_hand_to_estimate() {
    let options = DeviceOptions::default();
    let made = HandBank::new(&master("impulse-engine"), None, &HandSettings::default(), PERIOD, &options);
    assert!(matches!(made, Err(crate::device::DeviceError::NoHand(_))));
}

#[test]
fn a_hand_that_is_part_of_the_model_is_a_hand() {
    let (held, _) = master("impulse-engine").held_by(&grip(1.0));
    let attached = bank(&master("impulse-engine"));
    let own = HandBank::new(&held, None, &HandSettings::default(), PERIOD, &DeviceOptions::default()).unwrap();
    let (mut own, mut attached) = (own, attached);
    for bank in [&mut own, &mut attached] {
        bank.start(&[0.0]);
        (0..500).for_each(|_| bank.step(&[-1.0]));
    }
    for hand in 0..own.softness().len() {
        assert_eq!(own.position(hand, 0), attached.position(hand, 0));
        assert!(hand == 0 || own.position(hand, 0) < own.position(hand - 1, 0), "a softer hand gives way more");
    }
}

#[test]
fn what_is_cancelled_follows_the_gains_of_the_plan_and_those_asked_for_since() {
    let plan = GainPlan { mu: 0.5, lambda: 1.0, ramp_s: 0.01, changes: vec![GainChange { at_s: 0.05, mu: 1.0, lambda: 4.0 }] };
    let mut canceller = Canceller::scheduled(bank(&master("impulse-engine-linear")), Some(2.0), plan, 0.0, PERIOD);
    let mut events = Events::default();
    let mut induced = |step: u64, canceller: &mut Canceller| {
        let mut measured = Sample::new(1);
        (measured.step, measured.position[0], measured.effort[0]) = (step, 0.0, -2.0);
        let mut outputs = [Sample::new(1), Sample::new(1)];
        let tick = Tick { step, time_s: step as f64 * PERIOD, period_s: PERIOD };
        canceller.step(&tick, &[Port { sample: Some(measured), age_steps: 0 }], &mut outputs, &mut events);
        outputs[1].position[0].abs()
    };
    let at = |seconds: f64| (seconds / PERIOD) as u64;
    let all: Vec<f64> = (0..at(0.1)).map(|step| induced(step, &mut canceller)).collect();
    // Nothing at 0.5, a quarter of 2; at 4 a share of 0.85, which comes with the ramp and not in a step.
    assert!(all[..at(0.05) as usize].iter().all(|x| *x == 0.0));
    let (ramped, end) = (all[at(0.056) as usize], all[at(0.062) as usize]);
    assert!(ramped > 0.0 && ramped < 0.9 * end, "{ramped} {end}");
    let largest = all.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    assert!(largest < 0.2 * end, "{largest} {end}");
    let asked = Gains { layout: 0, source: 0, step: 0, sequence: 0, stamp_ns: 0, mu: 0.5, lambda: 1.0, ramp_s: 0.01 };
    canceller.set_gains(&asked);
    let later: Vec<f64> = (at(0.1)..at(0.2)).map(|step| induced(step, &mut canceller)).collect();
    assert_eq!(later.last(), Some(&0.0));
}
