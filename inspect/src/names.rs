//! The information in the name of a column: quantity, joint, side, unit.

use crate::quantity::{Quantity, Side};
use backdrive_plant::recording::units::{self, Unit};

/// The information in a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// What it is; `None` where no word states it.
    pub quantity: Option<Quantity>,
    /// Which device of a pair.
    pub side: Option<Side>,
    /// The rest of the name without all known words: the joint. Empty where nothing is left.
    pub joint: String,
    /// The unit that the name hints at, as in `pos_deg_1`.
    pub hint: Option<Unit>,
}

const COMMAND: &str =
    " command commands commanded cmd target goal desired des setpoint sp ref reference action actions demand qref qdes qcmd targets ";
const POSITION: &str =
    " position positions pos posmot posse q angle angles theta phi state states encoder enc x displacement disp location qpos height ";
const VELOCITY: &str = " velocity velocities vel velmot velse qd dq qdot speed speeds omega v xdot dx qvel ";
const ACCELERATION: &str = " acceleration accelerations acc accel qdd ddq qddot ";
const EFFORT: &str = " torque torques tau effort efforts force forces load moment gauge f fx fy fz ";
const CURRENT: &str = " current currents curr i iq amp amps ampere ";
const VOLTAGE: &str = " voltage volt volts u vbus pwm ";
const TEMPERATURE: &str = " temperature temp temperatures ";
const COUNTER: &str = " frame index idx seq sequence step run row id sample iteration episode task counter tick ";
const TIME: &str = " t time timestamp timestamps stamp clock duration times ";
const LEADER: &str = " leader master ";
const FOLLOWER: &str = " follower slave puppet ";
/// Words that name neither a quantity nor a joint.
const FILLERS: &str = " actual act measured meas raw filtered filt est estimated observation recording present abs rel joint joints mot se data the of is signal value values \
                       pulse minus ";
/// Units as they stand in names, in their case.
const UNITS: &str = " deg rad mm cm Nm N A mA V m s ms us ns rpm in lb kip um counts Hz mrad rev mNm kN C ";

fn is_in(list: &str, word: &str) -> bool {
    list.contains(&format!(" {word} "))
}

/// Words of a name: cut at signs, between small and capital letters, and between letters and digits.
fn words(name: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut last = ' ';
    for c in name.chars() {
        // `tau_J`, `qMeasured`, `m1`; not within `Nm` or `mA`.
        let begins = !c.is_alphanumeric()
            || !last.is_alphanumeric()
            || c.is_ascii_digit() != last.is_ascii_digit()
            || (c.is_uppercase() && last.is_lowercase() && out.last().is_some_and(|w| w.len() > 1 || w == "q"));
        if begins {
            out.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = out.last_mut()
        {
            word.push(c);
        }
        last = c;
    }
    out.retain(|word| !word.is_empty());
    out
}

/// Reads a name; `before` is what stands before it, as the topic of a field, whose words say a quantity but no joint.
pub fn read(name: &str, before: &str) -> Named {
    let words = words(name);
    let lower: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
    let mut joint: Vec<&str> = Vec::new();
    let (mut quantity, mut is_command, mut side, mut hints): (Option<Quantity>, bool, Option<Side>, Vec<&str>) = Default::default();
    let quantities: [(&str, Quantity); 9] = [
        (POSITION, Quantity::Position),
        (VELOCITY, Quantity::Velocity),
        (ACCELERATION, Quantity::Acceleration),
        (EFFORT, Quantity::Effort),
        (CURRENT, Quantity::Current),
        (VOLTAGE, Quantity::Voltage),
        (TEMPERATURE, Quantity::Temperature),
        (COUNTER, Quantity::Counter),
        (TIME, Quantity::Time),
    ];
    let of = |word: &str| quantities.iter().find(|(list, _)| is_in(list, word)).map(|(_, quantity)| *quantity);
    for (place, (word, small)) in words.iter().zip(&lower).enumerate() {
        if is_in(COMMAND, small) {
            is_command = true;
        } else if is_in(LEADER, small) {
            side = Some(Side::Leader);
        } else if is_in(FOLLOWER, small) {
            side = Some(Side::Follower);
        } else if place > 0 && is_in(UNITS, word) {
            hints.push(word);
        } else if let Some(found) = of(small) {
            // "current position" is no current; a counter's word beside another quantity is none.
            let is_weak =
                |quantity: Option<Quantity>| matches!(quantity, None | Some(Quantity::Current | Quantity::Counter | Quantity::Time));
            if is_weak(quantity) {
                quantity = Some(found);
            }
        } else if !is_in(FILLERS, small) {
            joint.push(small);
        }
    }
    for word in self::words(before).iter().map(|word| word.to_lowercase()) {
        // CRTK calls the topics of commands servo_jp, servo_jf and so on.
        is_command |= is_in(COMMAND, &word) || word == "servo";
        side = side.or(if is_in(LEADER, &word) { Some(Side::Leader) } else { is_in(FOLLOWER, &word).then_some(Side::Follower) });
        quantity = quantity.or(of(&word).filter(|found| *found != Quantity::Time));
    }
    let quantity = match (is_command, quantity) {
        (true, None | Some(Quantity::Position)) => Some(Quantity::Command),
        // A target of another kind is no position command, and nothing that a sensor measures.
        (true, Some(Quantity::Velocity | Quantity::Acceleration | Quantity::Effort | Quantity::Current)) => Some(Quantity::Unknown),
        (_, quantity) => quantity,
    };
    let hint = match hints.as_slice() {
        [] => None,
        [one] => units::parse(one).ok(),
        [.., a, b] => units::parse(&format!("{a}/{b}")).ok().or_else(|| units::parse(b).ok()),
    };
    Named { quantity, side, joint: joint.join("_"), hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(name: &str) -> (Option<Quantity>, String) {
        let named = read(name, "");
        (named.quantity, named.joint)
    }

    #[test]
    fn names_of_many_logs_are_read() {
        assert_eq!(said("shoulder_pan.command"), (Some(Quantity::Command), "shoulder_pan".to_string()));
        assert_eq!(said("actual_qd_0"), (Some(Quantity::Velocity), "0".to_string()));
        assert_eq!(said("tau_J[2]"), (Some(Quantity::Effort), "j_2".to_string()));
        assert_eq!(said("current_position"), (Some(Quantity::Position), String::new()));
        assert_eq!(said("qref_m"), (Some(Quantity::Command), String::new()));
        assert_eq!(said("state"), (Some(Quantity::Position), String::new()));
        let kuka = read("velmot_deg_s_3", "");
        assert_eq!((kuka.quantity, kuka.joint.as_str(), kuka.hint.map(|u| u.name)), (Some(Quantity::Velocity), "3", Some("deg/s")));
        assert_eq!(read("position[0]", "/leader/joint_states").side, Some(Side::Leader));
        assert_eq!(read("data[1]", "/forward_position_controller/commands").quantity, Some(Quantity::Command));
        assert_eq!(read("position[0]", "/slave/servo_jp").quantity, Some(Quantity::Command));
        assert_eq!(said("target_qd_1").0, Some(Quantity::Unknown));
    }
}
