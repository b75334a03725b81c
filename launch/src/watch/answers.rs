//! What is asked of a run from outside: gains, the canceller, remarks, the end.

use super::state::Supervisor;
use crate::asks::{Answer, Ask, Asked, MOST_TEXT};
use crate::options::Command;
use crate::report::Cause;
use crate::slot::Phase;
use backdrive_nodes::protocol::{Note, ToNode};
use std::time::{Duration, Instant};

/// Over this time the reflected force is removed before a run that is stopped from outside ends, s.
const RELEASE_S: f64 = 0.005;

/// Time from the removal of the force to the end of the run: the bag then shows that it was removed.
const RELEASED: Duration = Duration::from_millis(150);

impl Supervisor {
    pub(crate) fn answer(&mut self, (ask, reply): Asked) {
        let answer = match self.asked(ask) {
            Ok(text) => Answer { done: true, text },
            Err(text) => Answer { done: false, text },
        };
        // Who asked may be gone.
        let _ = reply.send(answer);
    }

    fn asked(&mut self, ask: Ask) -> Result<String, String> {
        if self.stopping {
            return Err("the run is ending".to_string());
        }
        match ask {
            Ask::Gains { mu, lambda, ramp_s, by } => {
                if !(mu.is_finite() && lambda.is_finite() && ramp_s.is_finite() && ramp_s >= 0.0) {
                    return Err("gains must be finite, and the ramp not negative".to_string());
                }
                if !self.slots.iter().any(|s| s.plan.has_gains) {
                    return Err("the graph has no node with gains".to_string());
                }
                self.obey(Command::Gains { mu, lambda, ramp_s });
                let text = format!("{by} sets mu to {mu} and lambda to {lambda} over {ramp_s} s");
                self.note(0, "live_gains", &text, Some(lambda));
                Ok(text)
            }
            Ask::Canceller { on, ramp_s, by } => {
                if !(ramp_s.is_finite() && ramp_s >= 0.0) {
                    return Err("the ramp must be finite and not negative".to_string());
                }
                let has = |s: &&crate::slot::Slot| s.plan.nodes().any(|n| n.kind == "canceller") && s.phase == Phase::Running;
                let Some(slot) = self.slots.iter().find(has) else {
                    return Err("the graph has no canceller that runs".to_string());
                };
                slot.tell(&ToNode::Canceller { on, ramp_s });
                let text = format!("{by} switches the canceller {} over {ramp_s} s", if on { "on" } else { "off" });
                self.note(0, "live_canceller", &text, Some(f64::from(u8::from(on))));
                Ok(text)
            }
            Ask::Stop { mu, by } => {
                let text = format!("{by} stops the run");
                self.note(1, "live_stop", &text, None);
                self.tell(1, "live_stop", text.clone());
                match mu.filter(|mu| mu.is_finite() && self.slots.iter().any(|s| s.plan.has_gains && s.phase == Phase::Running)) {
                    Some(mu) => {
                        self.obey(Command::Gains { mu, lambda: 0.0, ramp_s: RELEASE_S });
                        self.release.get_or_insert((Instant::now() + RELEASED, by));
                    }
                    None => self.stop(Cause::Stopped { by }),
                }
                Ok(text)
            }
            Ask::Note { severity, kind, text, value } => match self.note(severity.min(2), &kind, &text, value) {
                true => Ok("noted".to_string()),
                false => Err("no node of this run can record it".to_string()),
            },
        }
    }

    /// Has a node publish an event that is not its own, so that the bag has it. Whether there is one that can.
    fn note(&self, severity: u32, kind: &str, text: &str, value: Option<f64>) -> bool {
        let ours = |s: &&crate::slot::Slot| s.phase == Phase::Running && s.plan.command.is_none() && !s.plan.records;
        let slot = self.slots.iter().filter(ours).max_by_key(|s| s.plan.has_gains);
        let cut = (0..=text.len().min(MOST_TEXT)).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0);
        if let Some(slot) = slot {
            slot.tell(&ToNode::Note(Note { severity, kind: kind.to_string(), text: text[..cut].to_string(), value }));
        }
        slot.is_some()
    }

    /// Ends the run whose force has been removed.
    pub(crate) fn released(&mut self, now: Instant) {
        if let Some((_, by)) = self.release.take_if(|(at, _)| now >= *at) {
            self.stop(Cause::Stopped { by });
        }
    }
}
