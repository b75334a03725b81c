//! The steps of a search, a file each: each names the structures to fit, given what was found. The schedule sets their order.

mod beside_the_best;
mod exchanges;
mod extensions;
mod finer;
mod from_nominal;
mod laws;
mod more;
mod near;
mod one_parameter;
mod other_places;
mod pairs;
mod relatives;
mod restored_defaults;
mod richer;
mod ripples;
mod scans;
mod singles;
mod split;
mod step;

pub(super) use beside_the_best::BesideTheBest;
pub(super) use exchanges::Exchanges;
pub(super) use finer::Finer;
pub(super) use from_nominal::FromNominal;
pub(super) use laws::Laws;
pub(super) use more::More;
pub(super) use one_parameter::OneParameter;
pub(super) use other_places::OtherPlaces;
pub(super) use pairs::{MorePairs, Pairs};
pub(super) use relatives::Relatives;
pub(super) use restored_defaults::RestoredDefaults;
pub(super) use richer::Richer;
pub(super) use ripples::Ripples;
pub(super) use scans::Scans;
pub(super) use singles::Singles;
pub(super) use split::Split;
pub(super) use step::{Race, Step};
