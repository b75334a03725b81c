use super::*;
use crate::coupling::{Conditions, passivity, position_position, wave, wave_line};

const PERIOD: f64 = 1e-3;

/// Forces act within the step in which they are computed.
const AT_ONCE: Conditions = Conditions { period_s: PERIOD, round_trip_s: 0.4, held_steps: 0 };

/// A wall that only pushes, with damping, at 5 mm.
fn wall(position: f64, velocity: f64) -> f64 {
    if position > 0.005 { -(4000.0 * (position - 0.005) + 10.0 * velocity).max(0.0) } else { 0.0 }
}

#[test]
fn waves_store_all_that_hand_and_wall_put_in_and_give_out_no_more() {
    for (index, link) in LINKS.into_iter().enumerate() {
        let settings = wave::Settings::DEFAULT;
        let (mut near, mut far) = (wave::NearSide::new(&settings), wave::FarSide::new(&settings));
        let rows = driven(&mut near, &mut far, link, PERIOD, &shaken(6000, PERIOD), wall);
        let (mut put_in, mut worked) = (0.0, 0.0);
        for (step, [v_m, f_m, v_s, f_s]) in rows.iter().enumerate() {
            put_in += (-f_m * v_m + f_s * v_s) * PERIOD;
            worked += f_s.abs() * v_s.abs() * PERIOD;
            assert!(put_in > -1e-9, "link {index}, step {step}: {put_in} J more came out than went in");
        }
        assert!(worked > 1e-4, "link {index}: the slave pressed");
        assert!(put_in > far.stored(), "link {index}: stored {} J of {put_in} J", far.stored());
    }
}

#[test]
fn a_link_that_falls_silent_lets_no_wave_go_on() {
    let (mut sender, mut receiver, mut way) = (wave_line::Sender::default(), wave_line::Receiver::default(), Way::constant(10));
    let (mut sent, mut given, mut held, mut held_on) = (0.0, 0.0, 0.0, 0.0);
    for step in 0..500_u64 {
        if step < 100 {
            way.send(step, sender.send(1.0, PERIOD));
            sent += 0.5 * PERIOD;
        }
        let packet = way.take(step);
        held = packet.map_or(held, |p| p.velocity);
        held_on += 0.5 * held * held * PERIOD;
        let out = receiver.receive(packet.as_ref(), PERIOD);
        given += 0.5 * out * out * PERIOD;
    }
    assert!((given - sent).abs() < 1e-9, "{given} J of {sent} J came out");
    // What the budget is there for: a wave that is held on is not passive.
    assert!(held_on > 4.0 * sent);
}

#[test]
fn observed_energy_never_falls_below_zero_at_either_port() {
    for (index, link) in LINKS.into_iter().enumerate() {
        for harvest in [0.0, 10.0] {
            let settings = passivity::Settings { harvest, ..passivity::Settings::DEFAULT };
            let (mut near, mut far) = (passivity::NearSide::new(&settings, &AT_ONCE), passivity::FarSide::new(&settings, &AT_ONCE));
            let rows = driven(&mut near, &mut far, link, PERIOD, &shaken(6000, PERIOD), wall);
            let mut put_in = 0.0;
            for (step, [v_m, f_m, v_s, f_s]) in rows.iter().enumerate() {
                put_in += (-f_m * v_m + f_s * v_s) * PERIOD;
                assert!(put_in > -1e-12, "link {index}, step {step}: {put_in} J");
            }
            for port in [near.observer(), far.observer()] {
                assert!(port.budget() >= -1e-15, "link {index}: {port:?}");
            }
            assert!(near.observer().energy_out <= far.observer().energy_in + 1e-15);
            assert!(far.observer().energy_out <= near.observer().energy_in + 1e-15);
        }
    }
}

#[test]
fn forces_that_act_later_are_counted_when_they_act() {
    let conditions = Conditions { held_steps: 2, ..AT_ONCE };
    for (index, link) in LINKS.into_iter().enumerate() {
        let settings = passivity::Settings::DEFAULT;
        let (mut near, mut far) = (passivity::NearSide::new(&settings, &conditions), passivity::FarSide::new(&settings, &conditions));
        let rows = driven(&mut near, &mut far, link, PERIOD, &shaken(6000, PERIOD), wall);
        let (mut at_master, mut put_in, mut least) = (0.0, 0.0, 0.0_f64);
        for step in 2..rows.len() {
            let worked = rows[step - 2][1] * rows[step][0] * PERIOD;
            at_master += worked;
            put_in += rows[step][3] * rows[step][2] * PERIOD - worked;
            least = least.min(put_in);
        }
        let observed = near.observer();
        assert!((at_master - (observed.energy_out - observed.energy_in)).abs() < 1e-9, "link {index}: {at_master} J, {observed:?}");
        // Not more than two steps of motion beyond what was foreseen.
        assert!(least > -2e-5, "link {index}: {least} J were created");
    }
}

#[test]
fn without_its_controllers_the_same_exchange_creates_energy() {
    // Position forward and force back over the same link: what observer and controller are there for.
    let direct = crate::coupling::Law::Direct;
    let (mut near, mut far) = (direct.near(&AT_ONCE), direct.far(&AT_ONCE));
    let rows = driven(near.as_mut(), far.as_mut(), LINKS[2], PERIOD, &shaken(6000, PERIOD), wall);
    let mut put_in = 0.0;
    let least = rows.iter().fold(0.0_f64, |least, [v_m, f_m, v_s, f_s]| {
        put_in += (-f_m * v_m + f_s * v_s) * PERIOD;
        least.min(put_in)
    });
    assert!(least < -1e-3, "{least} J at the least");
}

#[test]
fn a_slave_with_energy_to_spare_is_where_it_shall_be() {
    let settings = passivity::Settings { harvest: 200.0, ..passivity::Settings::DEFAULT };
    let (mut near, mut far) = (passivity::NearSide::new(&settings, &AT_ONCE), passivity::FarSide::new(&settings, &AT_ONCE));
    let motion = shaken(600, PERIOD);
    let rows = driven(&mut near, &mut far, (0, 1, 0, 0.0), PERIOD, &motion, |_, _| 0.0);
    let come: f64 = rows.iter().map(|row| row[2] * PERIOD).sum();
    assert!((come - motion[599]).abs() < 1e-9, "{come} of {}", motion[599]);
}

/// A hand (mass, damper, spring to its intended place) and a wall on both ends of a law; the energy of its motion after `steps`.
fn swings(settings: &position_position::Settings, delay: u64, steps: u64) -> (f64, f64) {
    let conditions = Conditions { period_s: PERIOD, round_trip_s: (2 * delay + 1) as f64 * PERIOD, held_steps: 1 };
    let mut near = position_position::NearSide::new(settings, &conditions);
    let mut far = position_position::FarSide::new(settings, &conditions);
    let (mut there, mut back) = (Way::constant(delay), Way::constant(delay + 1));
    let (mass, stiffness, damping) = (0.3, 50.0, 0.5);
    let (mut x, mut v, mut tip, mut speed) = (0.0, 0.0, 0.0, 0.0);
    let (mut put_in, mut least) = (0.0_f64, 0.0_f64);
    let mut late = 0.0_f64;
    for step in 0..steps {
        let own = Own { position: x, velocity: v, moved: v * PERIOD, force: 0.0, power_scale: 1.0 };
        let (force, packet) = near.step(&own, back.take(step).as_ref(), PERIOD);
        there.send(step, packet);
        let felt = -1000.0 * tip - 2.0 * speed;
        let own = Own { position: tip, velocity: speed, moved: 0.0, force: felt, power_scale: 1.0 };
        let (command, packet) = far.step(&own, there.take(step).as_ref(), PERIOD);
        back.send(step, packet);
        (speed, tip) = ((command - tip) / PERIOD, command);
        let wanted = if step < 1000 { 0.01 } else { 0.0 };
        // Implicit in the hand's own damper and spring, the law's force held constant.
        v = (mass * v + PERIOD * (force - stiffness * (x - wanted))) / (mass + PERIOD * (damping + stiffness * PERIOD));
        x += PERIOD * v;
        put_in += (-force * v + felt * speed) * PERIOD;
        least = least.min(put_in);
        if step > steps - 1000 {
            late = late.max(0.5 * mass * v * v);
        }
    }
    (late, least)
}

#[test]
fn with_the_stated_damping_it_rests_and_no_energy_is_created_whatever_the_delay() {
    let settings = position_position::Settings::DEFAULT;
    for delay in [0, 5, 20, 50, 100, 200] {
        let (late, least) = swings(&settings, delay, 40_000);
        assert!(late < 1e-9, "delay {delay} ms each way: {late} J still swing");
        assert!(least > -1e-6, "delay {delay} ms each way: {least} J were created");
    }
    // A fifth of what is needed creates energy, and without damping it swings up.
    let with = |damping: f64| swings(&position_position::Settings { damping: Some(damping), ..settings }, 100, 40_000);
    let (_, least) = with(0.2 * settings.least_damping(0.2));
    assert!(least < -1e-4, "too little damping: {least} J");
    let (late, least) = with(0.0);
    assert!(late > 1e-3 && least < -1e-3, "no damping: {late} J still swing, {least} J");
}

/// Implicit steps: half the step, half the error.
#[test]
fn waves_converge_with_the_step() {
    let force = |divide: u64| {
        let settings = wave::Settings::DEFAULT;
        let (mut near, mut far) = (wave::NearSide::new(&settings), wave::FarSide::new(&settings));
        let period_s = PERIOD / divide as f64;
        let link = (20 * divide, 20 * divide, 0, 0.0);
        let motion: Vec<f64> = (0..=1000 * divide).map(|k| 0.002 * (1.0 - (8.0 * k as f64 * period_s).cos())).collect();
        let rows = driven(&mut near, &mut far, link, period_s, &motion, |x, v| -1000.0 * x - 5.0 * v);
        rows[1000 * divide as usize][1]
    };
    let (coarse, fine, finest) = (force(1), force(2), force(4));
    let ratio = (coarse - fine) / (fine - finest);
    assert!((1.6..2.6).contains(&ratio), "errors fall by {ratio} per halving: {coarse} {fine} {finest}");
}
