//! Every constant that decides what is tried, how well it is fitted and what is claimed: with its unit, its value and its evidence.
//!
//! `cargo run -p backdrive-diagnosis --example tuning` prints this table. `docs/tuning.md` has the measurements of
//! `diagnosis/tests/concealed/sensitivity.py`. What belongs to one law (ranges, starting values) is in its file in `physics/`, and what follows from a
//! formula is in the formula.

mod claim;
mod coupling;
pub mod document;
mod equation_error;
mod experiment;
mod fit;
mod intervals;
mod locate;
mod noise;
mod recordings;
mod screening;
mod search;
mod table;

pub use claim::Claim;
pub use coupling::Coupling;
pub use equation_error::EquationError;
pub use experiment::Experiment;
pub use fit::Fit;
pub use intervals::Intervals;
pub use locate::Locate;
pub use noise::Noise;
pub use recordings::Recordings;
pub use screening::Screening;
pub use search::Search;
use std::sync::OnceLock;
pub use table::{Evidence, Group, Quantity, Row};

/// All of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tuning {
    /// What recordings are taken for.
    pub recordings: Recordings,
    /// When residuals count as noise.
    pub noise: Noise,
    /// How a structure is fitted.
    pub fit: Fit,
    /// How laws are looked at on forces along a measured motion.
    pub equation_error: EquationError,
    /// How a model is coupled to the measured motion.
    pub coupling: Coupling,
    /// How hypotheses are screened.
    pub screening: Screening,
    /// How much is tried, and when it ends.
    pub search: Search,
    /// How sure parameters are.
    pub intervals: Intervals,
    /// What is claimed.
    pub claim: Claim,
    /// How the missing force is estimated at every place.
    pub locate: Locate,
    /// How the next experiment is chosen.
    pub experiment: Experiment,
}

static IN_USE: OnceLock<Tuning> = OnceLock::new();

/// The tuning in use.
pub fn tuning() -> &'static Tuning {
    IN_USE.get_or_init(Tuning::default)
}

impl Tuning {
    fn groups(&mut self) -> [(&'static str, &mut dyn Group); 11] {
        [
            ("recordings", &mut self.recordings),
            ("noise", &mut self.noise),
            ("fit", &mut self.fit),
            ("equation_error", &mut self.equation_error),
            ("coupling", &mut self.coupling),
            ("screening", &mut self.screening),
            ("search", &mut self.search),
            ("intervals", &mut self.intervals),
            ("claim", &mut self.claim),
            ("locate", &mut self.locate),
            ("experiment", &mut self.experiment),
        ]
    }

    /// Every entry.
    pub fn rows(&self) -> Vec<Row> {
        self.clone().groups().into_iter().flat_map(|(name, group)| group.rows(name)).collect()
    }

    /// One entry by its name, such as `claim.alike`; `None` where there is none of it.
    pub fn quantity(&mut self, name: &str) -> Option<&mut dyn Quantity> {
        let (group, field) = name.split_once('.')?;
        let (_, group) = self.groups().into_iter().find(|(name, _)| *name == group)?;
        group.quantity(field)
    }

    /// Puts this tuning to use, for a study of how much verdicts depend on it. It has to be called before anything is diagnosed.
    ///
    /// # Errors
    /// When another one is in use: this one is returned in the error.
    #[allow(clippy::result_large_err)]
    pub fn adopt(self) -> Result<(), Tuning> {
        IN_USE.set(self)
    }
}
