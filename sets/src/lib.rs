//! Sets of recordings: [`open`]ed and checked as a diagnosis or a fit takes them, made of the [`experiments`] of a graph, and begun
//! for recordings of one's own ([`init`]).

pub mod checks;
mod error;
pub mod experiments;
pub mod init;
pub mod open;
mod recordings;

pub use error::SetError;
pub use recordings::Recordings;
