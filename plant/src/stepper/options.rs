//! How a model is to be stepped.

/// How a model is to be stepped.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options {
    /// Substeps in each period; `None` chooses them from the model.
    pub substeps: Option<usize>,
    /// Seed of the noise that outputs add; `None` adds none.
    pub add_noise: Option<u64>,
    /// Whether outputs are rounded to their resolution.
    pub quantise: bool,
}
