//! A model shown ([`show`]), and on recordings: simulated ([`simulate`], for joints with position servos [`servos`]), refitted with its structure unchanged
//! ([`fit`]), and exported with what leaving a part out costs ([`export`], [`left_out`]).

mod error;
pub mod export;
pub mod fit;
pub mod held;
pub mod left_out;
pub mod servos;
pub mod show;
pub mod simulate;

pub use error::PredictError;
