//! A device, or a way, beside its model.

use serde::Serialize;

/// How well a device's model predicts the recorded signals of the device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartCheck {
    /// In contact: `master`, `slave`, or `force path`: the way from F_s to the reflected part of F_f, with its gain and delay. All along the recording:
    /// `master's motor`, `master's motion`, `handle's motion`, `slave's motion`, `slave's force`.
    pub part: &'static str,
    /// Number of the axis.
    pub axis: usize,
    /// What is compared: a position, the force on the slave, or the force that is applied or reflected to the master.
    pub quantity: &'static str,
    /// Root mean square of recorded less predicted, in contact; m, rad, N or N m.
    pub error_rms: f64,
    /// Root mean square of what the reflected force did to the master, or of the contact force; same unit.
    pub effect_rms: f64,
    /// What the sensor's rounding and noise alone explain of the error, same unit.
    pub floor_rms: f64,
    /// Steps in which the device's sensor gave no number, where those are more than a few lost messages.
    #[serde(skip_serializing_if = "is_none")]
    pub silent: usize,
    /// Times between which the device does not do what its model does, s from the begin of the recording; `None` where it is all of what was compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub span_s: Option<[f64; 2]>,
    /// Whether the model predicts the device: the error is within three times the noise floor, or below [`AGREES_WITHIN`] of the effect.
    pub agrees: bool,
}

fn is_none(steps: &usize) -> bool {
    *steps == 0
}

/// Share of the effect below which an error is small.
pub const AGREES_WITHIN: f64 = 0.02;

impl std::fmt::Display for PartCheck {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.said(f)?;
        self.span_s.map_or(Ok(()), |[from, to]| write!(f, ", from {from:.3} s to {to:.3} s"))
    }
}

impl PartCheck {
    fn said(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.silent > 0 {
            return write!(f, "the {} of {} was recorded as NaN in {} steps", self.quantity, self.part, self.silent);
        }
        let share = 100.0 * self.error_rms / self.effect_rms.max(f64::MIN_POSITIVE);
        match self.part {
            "master" => write!(f, "the master's model does not explain {share:.1} % of the motion induced by the reflected force"),
            "master's motor" => {
                write!(f, "{share:.1} % of the force applied to the master does not follow from the force command by its model")
            }
            "handle's motion" => write!(f, "the master's model does not explain {share:.1} % of the motion of the held body"),
            "master's motion" => write!(f, "the master's model does not explain {share:.1} % of its motion"),
            "slave's motion" => write!(f, "the slave's model does not explain {share:.1} % of its motion"),
            "slave's force" => write!(f, "the slave's model does not explain {share:.1} % of its force"),
            "slave" => write!(f, "the slave's model does not explain {share:.1} % of the contact force"),
            _ => write!(f, "{share:.1} % of the reflected force is not lambda times the contact force with the delay of the graph"),
        }
    }
}
