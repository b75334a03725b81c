//! The kinds of steps of a search.

/// What is tried next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wave {
    Ripples,
    First,
    GivenBack,
    Laws,
    Singles,
    Plain,
    Elsewhere,
    Relatives,
    Finer,
    Pairs,
    Exchanges,
    Richer,
    MoreSingles,
    MorePairs,
    More,
    Anew,
}

impl Wave {
    pub fn name(self) -> &'static str {
        match self {
            Wave::Ripples => "fitting ripples",
            Wave::First | Wave::Singles => "fitting single effects",
            Wave::GivenBack => "giving back what numbers took on",
            Wave::Laws => "fitting other laws in the same place",
            Wave::Plain => "fitting laws of one number",
            Wave::Elsewhere => "fitting the same law in other places",
            Wave::Relatives => "fitting simpler relatives",
            Wave::Finer => "drawing a law more finely",
            Wave::Pairs => "fitting pairs",
            Wave::Exchanges => "exchanging effects",
            Wave::Richer => "fitting richer laws",
            Wave::MoreSingles => "fitting more single effects",
            Wave::MorePairs => "fitting more pairs",
            Wave::More => "fitting more effects at once",
            Wave::Anew => "screening beside the best",
        }
    }

    /// Share of the time that it may take where the best leaves much over.
    pub fn aside(self) -> f64 {
        match self {
            Wave::Relatives | Wave::Elsewhere => 0.08,
            Wave::Finer => 0.15,
            _ => 1.0,
        }
    }

    /// How many are fitted further, and how many to their end.
    pub fn keep(self) -> [usize; 2] {
        match self {
            Wave::First | Wave::Laws | Wave::Elsewhere | Wave::Relatives => [3, 3],
            Wave::Singles | Wave::Plain | Wave::Exchanges | Wave::MoreSingles | Wave::Anew => [4, 2],
            Wave::Pairs | Wave::MorePairs | Wave::GivenBack => [5, 3],
            Wave::Finer | Wave::Ripples => [3, 2],
            Wave::Richer => [2, 1],
            Wave::More => [4, 3],
        }
    }
}
