//! Presliding hysteresis with non-local memory: a Preisach operator in Everett form, its transition curves, and how they are
//! identified from measured loops. Choi, Han & Kim 2006, eqs (7)-(13); Mayergoyz 1991.
//!
//! `f_p = ½ ∬ μ(α, β) γ_αβ[z] dα dβ` over relays γ of ±1, from rest with as many up as down, so that the virgin curve is odd.
//! With relays of 0 and 1, as printed, the same sum would be a one-sided force. What the operator needs of μ is the force that is
//! gained on the way from a turning point, `F(α, β) = f_α - f_αβ`: [`Transition::rise`].

mod dahl_loop;
mod identify;
mod operator;
mod relays;
mod transition;

pub use dahl_loop::DahlLoop;
pub use identify::{Fit, MeasuredLoop, fit};
pub use operator::{MEMORY, Operator, TURNS, everett_sum};
pub use relays::Relays;
pub use transition::{Rise, Transition};

pub(crate) use operator::{advance, force, slope};
