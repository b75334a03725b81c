//! How sure parameters are.

use super::table::group;

group! {
    /// How sure parameters are.
    Intervals {
        /// Blocks of each output in a record over which scores are summed (sandwich estimate).
        blocks: usize = 25, "blocks", Statistics("long against the correlation time, and enough for a variance to 30 %");
        /// Correlation times that a block has, at least.
        block_correlations: f64 = 4.0, "correlation times", Statistics("scores of neighbouring blocks are then independent");
        /// Work of one simulation of all recordings above which derivatives come from coarser substeps.
        slow: u64 = 10_000_000, "simulation steps", Cost("two simulations per parameter");
        /// Substeps there, at most.
        slow_substeps: usize = 8, "substeps", Cost("as slow");
        /// Factor on every interval.
        wider: f64 = 1.5, "-", Measured("two simulators of the same device differ by a little more than the noise explains: of 163 numbers in drawn cases, `diagnosis/tests/concealed/measure.py`, 88 % lie in intervals without it and 95 % with it");
        /// Standard deviations by which the fit's last step may widen an interval, at most.
        last_step: f64 = 3.0, "standard deviations", Judgement("a step beyond is no error of a fit near its end, but a fit that was cut short");
    }
}
