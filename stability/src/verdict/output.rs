//! The answer for programs.

use super::types::Answer;
use super::word::{Method, Word};
use crate::energy::{EnergyAnswer, EnergyVerdict};
use crate::outcome::Outcome;
use serde_json::{Value, json};

impl Answer {
    /// For scripts.
    pub fn json(&self) -> Value {
        let again = self.resimulated.as_ref();
        // One margin: to the headline's stability limit. The margins of the measured response are added where they belong to the same limit.
        let margins = self.margins.as_ref().filter(|_| self.margins_are_of_the_edge());
        let cycle = again.filter(|_| self.from == Method::Resimulation).map(|a| a.outcome);
        let cycle = if self.from == Method::Recording { self.recorded_outcome } else { cycle };
        let (limit_cycle, growth) = match cycle {
            Some(Outcome::LimitCycle { amplitude_m, frequency_hz, unit }) => {
                (json!({ "amplitude_m": amplitude_m, "frequency_hz": frequency_hz, "unit": unit }), Value::Null)
            }
            Some(Outcome::Unstable { growth_per_s }) => (Value::Null, json!(growth_per_s)),
            Some(Outcome::Stable | Outcome::Limited { .. } | Outcome::NotJudged { .. }) | None => (Value::Null, Value::Null),
        };
        json!({
            "bag": self.bag,
            "gain": self.gain.product(),
            "mu": self.gain.mu,
            "lambda": self.gain.lambda,
            "recorded_gain": self.recorded_gain,
            "verdict": self.verdict,
            "reason": self.reason,
            "from": self.from,
            "critical_gain": self.critical_gain,
            "at_least": self.at_least,
            "limited_from": self.limited_from,
            "critical_gain_ci95": self.critical_gain_ci95,
            "critical_frequency_hz": self.critical_frequency_hz,
            "margins": {
                "gain_db": self.gain_margin_db(),
                "phase_deg": margins.and_then(|m| m.phase_deg),
                "delay_ms": margins.and_then(|m| m.delay_ms),
                "modulus": margins.map(|m| m.modulus),
            },
            "limit_cycle": limit_cycle,
            "growth_per_s": growth,
            "methods": self.methods(),
            "grips": again.map(|a| a.grips.iter().map(|g| json!({
                "scale": g.scale,
                "critical_gain": g.edge.critical_gain,
                "frequency_hz": g.edge.frequency_hz,
                "at_least": g.edge.at_least,
                "verdict": g.at_asked.map(|o| Word::of(&o)),
            })).collect::<Vec<_>>()),
            "models": { "parts": self.checks, "loop": self.loop_check },
            "disagreement": self.disagreements,
            "warnings": self.warnings,
            "advice": self.advice,
            "held_back": self.held_back,
            "decided_by": self.decided_by,
            "witnesses": self.witnesses,
            "energy": { "recorded": self.recorded_energy_numbers() },
            "transparency": self.transparency_numbers(),
            "coupling": self.coupled,
            "axes_together": match &self.loops {
                Some(Ok(loops)) => json!({
                    "together": loops.together,
                    "alone": loops.alone.iter().map(|(axis, limit)| json!({ "axis": axis, "limit": limit })).collect::<Vec<_>>(),
                    "encirclements": loops.encirclements,
                    "touched": loops.touched,
                    "alone_misleads": loops.alone_misleads(),
                }),
                Some(Err(why)) => json!({ "why_not": why }),
                None => Value::Null,
            },
            "sensors": self.sensors,
        })
    }

    /// The result of each method by itself.
    fn methods(&self) -> Value {
        let frequency = self.frequency_answer.as_ref();
        let again = self.resimulated.as_ref();
        let energy = |e: &EnergyAnswer| json!({ "verdict": e.verdict, "reason": e.reason });
        json!({
            "frequency": frequency.map(|f| json!({
                "verdict": f.verdict,
                "reason": f.reason,
                "critical_gain": f.critical_gain,
                "at_least": f.at_least,
                "critical_gain_ci95": f.critical_gain_ci95,
                "frequency_hz": f.frequency_hz,
                "margins": self.margins,
                "amplitude_dependent": f.amplitude_dependent,
                "method": self.frequency.as_ref().map(|f| &f.method),
                "delays": self.frequency.as_ref().map(|f| &f.delays),
                "levels": self.frequency.as_ref().map(|f| f.levels.iter().map(|l| json!({ "dither_rms": l.amplitude_rms, "edge": l.edge })).collect::<Vec<_>>()),
                "axes": self.frequency.as_ref().and_then(|f| f.levels.last()).map(|l| l.axes.iter().map(|a| json!({ "axis": a.name, "edge": a.edge })).collect::<Vec<_>>()),
            })),
            "resimulation": match again {
                Some(a) => json!({
                    "verdict": Word::of(&a.outcome),
                    "outcome": a.outcome,
                    "script": a.script,
                    "critical_gain": a.edge.critical_gain,
                    "frequency_hz": a.edge.frequency_hz,
                    "at_least": a.edge.at_least,
                    "limited_from": a.edge.limited_from,
                    "returns_to_stable": a.edge.returns_to_stable,
                    "reason": a.edge.reason,
                }),
                None => json!({ "verdict": Word::CannotTell, "reason": self.no_resimulation }),
            },
            "energy": match again {
                Some(a) => energy(&a.energy),
                None => energy(&self.recorded_energy),
            },
            "recording": self.recorded_outcome.map(|o| json!({ "verdict": Word::of(&o), "outcome": o })),
        })
    }

    fn recorded_energy_numbers(&self) -> Vec<Value> {
        let axes = self.recorded_energy.axes.iter();
        axes.map(|a| {
            json!({
                "axis": a.name,
                "verdict": a.verdict,
                "master_final_j": a.master.final_j,
                "master_minimum_j": a.master.minimum_j,
                "slave_final_j": a.slave.final_j,
                "slave_minimum_j": a.slave.minimum_j,
                "hold_power_w": a.master.hold.map(|t| t.mean_w),
                "elements": a.elements.iter().map(|e| json!({ "name": e.name, "kind": e.kind, "friction": e.friction, "taken_j": e.final_j })).collect::<Vec<_>>(),
                "bounds": a.bounds,
            })
        })
        .collect()
    }

    fn transparency_numbers(&self) -> Vec<Value> {
        let axes = self.transparency.iter();
        axes.map(|t| {
            json!({
                "axis": t.name,
                "impedance_error": t.impedance.as_ref().map(|i| i.error),
                "band_hz": t.impedance.as_ref().map(|i| i.band_hz),
                "position_free_rms": t.position_free_rms,
                "position_contact_rms": t.position_contact_rms,
                "force_contact_rms": t.force_contact_rms,
                "induced_ratio": t.induced_ratio,
                "cancellation": t.cancellation.as_ref().map(|c| json!({ "quality": c.quality, "correlation": c.correlation })),
                "notes": t.notes,
            })
        })
        .collect()
    }

    /// The energy method's word at the gain asked.
    pub fn energy_verdict(&self) -> EnergyVerdict {
        self.resimulated.as_ref().map_or(self.recorded_energy.verdict, |r| r.energy.verdict)
    }
}
