//! The steps of a search: each says which structures it wants fitted, given what was found; a file each. Their order is the schedule's.

mod anew;
mod elsewhere;
mod exchanges;
mod extensions;
mod finer;
mod given;
mod given_back;
mod laws;
mod more;
mod near;
mod pairs;
mod plain;
mod relatives;
mod richer;
mod ripples;
mod scans;
mod singles;
mod split;
mod step;

pub(super) use anew::Anew;
pub(super) use elsewhere::Elsewhere;
pub(super) use exchanges::Exchanges;
pub(super) use finer::Finer;
pub(super) use given::Given;
pub(super) use given_back::GivenBack;
pub(super) use laws::Laws;
pub(super) use more::More;
pub(super) use pairs::{MorePairs, Pairs};
pub(super) use plain::Plain;
pub(super) use relatives::Relatives;
pub(super) use richer::Richer;
pub(super) use ripples::Ripples;
pub(super) use scans::Scans;
pub(super) use singles::Singles;
pub(super) use split::Split;
pub(super) use step::{Race, Step};
