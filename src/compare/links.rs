//! What the link and the hand do in a comparison: the usual values, their bounds, and the conditions that follow.

use backdrive_stability::compare::{Condition, Varied};

/// Delays, ms each way.
pub const DELAYS_MS: [f64; 5] = [0.0, 20.0, 50.0, 100.0, 200.0];
/// Delays that vary: mean and largest deviation, ms each way.
pub const JITTER_MS: [[f64; 2]; 1] = [[120.0, 40.0]];
/// Shares of the packets that are lost each way.
pub const LOSS: [f64; 2] = [0.05, 0.3];
/// Factors on stiffness and damping of the grip.
pub const GRIPS: [f64; 2] = [0.7, 1.3];
/// Delay at which loss and grips are tried, ms each way.
pub const AT_MS: f64 = 20.0;

/// Longest delay of a link, ms.
const LONGEST_MS: f64 = 5000.0;

/// What the link and the hand do.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    /// Delays, ms each way.
    pub delays_ms: Vec<f64>,
    /// Delays that vary: mean and largest deviation, ms each way.
    pub jitter_ms: Vec<[f64; 2]>,
    /// Shares of the packets that are lost each way, 0 to 1.
    pub loss: Vec<f64>,
    /// Factors on stiffness and damping of the grip.
    pub grips: Vec<f64>,
    /// Delay at which loss and grips are tried, ms each way.
    pub at_ms: f64,
}

impl Default for Links {
    fn default() -> Links {
        Links { delays_ms: DELAYS_MS.to_vec(), jitter_ms: JITTER_MS.to_vec(), loss: LOSS.to_vec(), grips: GRIPS.to_vec(), at_ms: AT_MS }
    }
}

impl Links {
    /// Each within its bounds.
    ///
    /// # Errors
    /// One is not: a sentence.
    pub fn check(&self) -> Result<(), String> {
        let named = |name: &str, result: Result<f64, String>| result.map_err(|why| format!("{name} {why}"));
        self.delays_ms.iter().try_for_each(|ms| named("delays", delay(*ms)).map(drop))?;
        self.jitter_ms.iter().try_for_each(|both| jitter(*both).map(drop).map_err(|why| format!("jitter: {why}")))?;
        self.loss.iter().try_for_each(|share| named("loss", loss(*share)).map(drop))?;
        match self.grips.iter().find(|factor| !(factor.is_finite() && **factor > 0.0)) {
            Some(factor) => Err(format!("grips: {factor} must be above 0")),
            None => named("at", delay(self.at_ms)).map(drop),
        }
    }

    /// The conditions of a comparison, in their order.
    pub fn conditions(&self) -> Vec<Condition> {
        let ms = |ms: f64| 1e-3 * ms;
        let at = Condition::delay(ms(self.at_ms));
        let delays = self.delays_ms.iter().map(|d| Condition::delay(ms(*d)));
        let jitter = self.jitter_ms.iter();
        let jitter = jitter.map(|[mean, most]| Condition { varied: Varied::Jitter, jitter_s: ms(*most), ..Condition::delay(ms(*mean)) });
        let loss = self.loss.iter().map(|loss| Condition { varied: Varied::Loss, loss: *loss, ..at.clone() });
        let grips = self.grips.iter().filter(|g| **g != 1.0).map(|g| Condition { varied: Varied::Grip, grip_scale: *g, ..at.clone() });
        delays.chain(jitter).chain(loss).chain(grips).collect()
    }
}

/// A delay in ms within its bounds.
///
/// # Errors
/// It is not.
pub fn delay(ms: f64) -> Result<f64, String> {
    match (0.0..=LONGEST_MS).contains(&ms) {
        true => Ok(ms),
        false => Err(format!("must be from 0 to {LONGEST_MS} ms")),
    }
}

/// Mean and deviation of a delay in ms within their bounds.
///
/// # Errors
/// They are not.
pub fn jitter([mean, deviation]: [f64; 2]) -> Result<[f64; 2], String> {
    let (mean, deviation) = (delay(mean)?, delay(deviation)?);
    match deviation > mean {
        true => Err("the deviation must not be above the mean: no packet arrives before it was sent".to_string()),
        false => Ok([mean, deviation]),
    }
}

/// A share of packets that may be lost.
///
/// # Errors
/// It is none.
pub fn loss(share: f64) -> Result<f64, String> {
    match (0.0..1.0).contains(&share) {
        true => Ok(share),
        false => Err("must be a share from 0 to below 1, such as 0.05, or none".to_string()),
    }
}
