//! A graph run: from a file or a bag ([`source`]), in one process or several ([`way`]), once for each experiment ([`experiments`]), or again from
//! the recorded hand ([`replay`]). What came of it is [`Done`]. Who calls it watches ([`Watch`]).

mod done;
mod error;
pub mod experiments;
pub mod replay;
pub mod source;
mod watch;
pub mod way;

pub use done::{Done, Fault};
pub use error::RunError;
pub use watch::{Silent, Watch};
