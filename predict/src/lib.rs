//! A model on recordings: simulated ([`simulate`], for joints with position servos [`servos`]), refitted with its structure unchanged ([`fit`]), and what
//! leaving a part out costs ([`left_out`]).

mod error;
pub mod fit;
pub mod held;
pub mod left_out;
pub mod servos;
pub mod simulate;

pub use error::PredictError;
