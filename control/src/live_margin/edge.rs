//! The reported stability limit of the running loop.

use backdrive_msgs::margin;

/// The stability limit of the running loop, as the gain of the force at the present position scale.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Edge {
    /// Nothing is touched, or not for a whole window.
    #[default]
    Free,
    /// In contact, but not for enough windows yet.
    Settling,
    /// In contact, but too many contact forces come late or not at all for a whole window.
    Late,
    /// In contact, and the critical gain is above this lambda; its value is not known.
    Above {
        /// Force scale, no unit.
        lambda: f64,
    },
    /// It is here.
    At {
        /// Force scale, no unit.
        lambda: f64,
        /// Standard deviation of lambda, as a share of it.
        deviation: f64,
        /// What it would oscillate at there, Hz; 0 for a loop that runs away without oscillating.
        frequency_hz: f64,
    },
}

/// A core's report on the loop's margin; the fields of [`backdrive_msgs::Margin`] that are its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarginEstimate {
    /// The axis that is nearest to its stability limit, from 0.
    pub axis: u32,
    /// One of [`backdrive_msgs::margin`].
    pub known: u32,
    /// mu*lambda now in force.
    pub gain: f64,
    /// See [`backdrive_msgs::Margin::factor`].
    pub factor: f64,
    /// See [`backdrive_msgs::Margin::deviation`].
    pub deviation: f64,
    /// See [`backdrive_msgs::Margin::frequency_hz`].
    pub frequency_hz: f64,
    /// See [`backdrive_msgs::Margin::decay_per_s`].
    pub decay_per_s: f64,
}

impl MarginEstimate {
    /// The report on an axis at the scales now in force. Without a dither there is no stability limit: `edge` is `None`.
    pub fn of(axis: usize, edge: Option<Edge>, mu: f64, lambda: f64, ring: Option<f64>) -> MarginEstimate {
        let (known, factor, deviation, frequency_hz) = match edge {
            None => (margin::NO_DITHER, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::Free) => (margin::FREE, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::Settling) => (margin::SETTLING, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::Late) => (margin::LATE, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::At { lambda: edge, deviation, frequency_hz }) if lambda > 0.0 => {
                (margin::KNOWN, edge / lambda, deviation, frequency_hz)
            }
            // A bound below the gain that is in force is no information.
            Some(Edge::Above { lambda: edge }) if lambda > 0.0 && edge > lambda => (margin::ABOVE, edge / lambda, f64::NAN, f64::NAN),
            Some(_) => (margin::NOISY, f64::NAN, f64::NAN, f64::NAN),
        };
        let decay_per_s = ring.unwrap_or(f64::NAN);
        MarginEstimate { axis: axis as u32, known, gain: mu * lambda, factor, deviation, frequency_hz, decay_per_s }
    }

    /// Whether it is the worse news of two axes: a known margin before a bound, that before what is not known.
    pub fn is_tighter_than(&self, other: &MarginEstimate) -> bool {
        let (own, others) = (rank(self.known), rank(other.known));
        own > others || own == others && self.factor < other.factor
    }
}

/// How much is known, ascending.
fn rank(known: u32) -> usize {
    let ascending = [margin::NO_DITHER, margin::FREE, margin::SETTLING, margin::LATE, margin::NOISY, margin::ABOVE, margin::KNOWN];
    ascending.iter().position(|one| *one == known).unwrap_or(0)
}
