//! The sentence for each kind of event, for a person. A kind without a line here shows its own name.

use backdrive_msgs::measured;
use backdrive_msgs::text::Text;
use std::fmt::Write;

/// Kind, the text before the number, and after it. Without a second part the number is not shown.
const SENTENCES: &[(&str, &str, Option<&str>)] = &[
    ("canceller_off", "the canceller's prediction is not finite: it no longer subtracts, since", Some("s")),
    ("canceller_switched_off", "the canceller is left out of the loop, faded out over", Some("s")),
    ("canceller_switched_on", "the canceller is back in the loop, faded in over", Some("s")),
    ("connection_broken", "a message could not be sent or received", None),
    ("controller_off", "the controller's force is not finite: it commands none any more, since", Some("s")),
    ("device_answers", "all joints of the device answer again", None),
    ("device_current_limit", "the current of a joint is beyond its limit, so the device is released:", Some("A")),
    ("device_force_back", "the device's torque is back", None),
    ("device_force_stale", "no force or no reading has come for", Some("steps: the device's torque decays to zero")),
    ("device_gone", "the device's port is gone: unplugged? Steps without a reading:", Some("")),
    ("device_silent", "joints of the device do not answer; steps without a whole reading:", Some("")),
    ("device_too_hot", "a joint is too hot, so the device is released:", Some("degrees Celsius")),
    ("drive_back", "a controller's forces arrive again, after", Some("steps without any")),
    ("drive_stale", "no force has come for", Some("steps: the slave's motor force decays to zero")),
    ("force_back", "forces arrive again, after", Some("steps without any")),
    ("force_outdated", "the slave gets no commands, or the link to it is silent: the master's force decays to zero", None),
    ("force_stale", "no force has come for", Some("steps: the master's force decays to zero")),
    ("guard_growing", "an oscillation grows: the guard lowers lambda to", Some("")),
    ("guard_persistent", "an oscillation does not die: the guard lowers lambda to", Some("")),
    ("guard_runaway", "force and master diverge together: the guard lowers lambda to", Some("")),
    ("guard_thin_margin", "the dither shows that the stability limit is near: the guard lowers lambda to", Some("")),
    ("hand_holds", "estimated grip stiffness, relative to the canceller's file", Some("")),
    ("input_gone", "an input's publisher is silent and is no longer waited for", None),
    ("input_back", "an input that was silent is back", None),
    ("joined_late", "joined a graph that was already running, at step", Some("")),
    ("peer_timeout", "an input has not come within", Some("s: the run ends")),
    ("realtime_refused", "not all real-time settings are permitted", None),
    ("recorder_lost", "the recorder found holes in sequence numbers; messages lost:", Some("")),
    ("samples_late", "samples came after later ones and were dropped:", Some("")),
    ("samples_lost", "an input has a hole in its sequence numbers; samples lost:", Some("")),
    ("slave_follows", "commands arrive again: the slave follows", None),
    ("slave_holds", "no command has come for", Some("steps: the slave holds")),
    ("state_not_finite", "the simulated state is not finite at", Some("s: the model or its step size does not fit")),
    ("steps_skipped", "too late: continues at the current step; steps skipped:", Some("steps")),
    ("valve_fully_open", "the rig asks for more than its valve gives, at", Some("s")),
];

/// One sentence for an event.
pub fn sentence(kind: &str, value: f64) -> Text<128> {
    let mut line = Line { bytes: [0; 128], len: 0 };
    // What does not fit is cut; a full line is no failure.
    let _ = match SENTENCES.iter().find(|(k, ..)| *k == kind) {
        Some((_, before, after)) => match (after, measured(value)) {
            (Some(after), Some(value)) => write!(line, "{before} {} {after}", Number(value)),
            _ => write!(line, "{before}"),
        },
        None => {
            let words = kind.split('_').try_for_each(|word| write!(line, "{}{word}", if line.len == 0 { "" } else { " " }));
            words.and_then(|()| measured(value).map_or(Ok(()), |value| write!(line, ": {}", Number(value))))
        }
    };
    let text = std::str::from_utf8(&line.bytes[..line.len]).unwrap_or("");
    Text::new(text.trim_end())
}

/// A number as a person writes it: whole ones whole, others with four digits.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let value = self.0;
        if value.fract() == 0.0 && value.abs() < 1e15 {
            return write!(f, "{value:.0}");
        }
        let digits = if value.is_finite() { (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize } else { 0 };
        write!(f, "{value:.digits$}")
    }
}

/// Text of fixed size: a step may not allocate.
struct Line {
    bytes: [u8; 128],
    len: usize,
}

impl Write for Line {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        let mut fits = text.len().min(self.bytes.len() - self.len);
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        self.bytes[self.len..self.len + fits].copy_from_slice(&text.as_bytes()[..fits]);
        self.len += fits;
        if fits == text.len() { Ok(()) } else { Err(std::fmt::Error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_and_unknown_kinds_read_as_sentences() {
        assert_eq!(sentence("force_stale", 21.0).as_str(), "no force has come for 21 steps: the master's force decays to zero");
        assert_eq!(sentence("guard_growing", 0.123456).as_str(), "an oscillation grows: the guard lowers lambda to 0.1235");
        assert_eq!(sentence("hot_motor", 81.25).as_str(), "hot motor: 81.25");
        assert_eq!(sentence("hot_motor", f64::NAN).as_str(), "hot motor");
        assert_eq!(sentence(&"x".repeat(300), 1.0).as_str().len(), 128);
    }

    #[test]
    fn the_table_is_sorted_and_fits() {
        assert!(SENTENCES.iter().all(|(kind, before, after)| kind.len() <= 32 && before.len() + after.map_or(0, str::len) < 115));
    }
}
