//! When residuals count as noise.

use super::table::group;

group! {
    /// When residuals count as noise. They are normalised: divided by the noise standard deviation of their output.
    Noise {
        /// Correlation time below which residuals may be white.
        white_correlation: f64 = 1.5, "samples", Statistics("white noise has 1; correlations below twice their standard error are not summed, and of 1000 samples one in 44 exceeds it, by which it adds 0.15");
        /// Whiteness statistic below which residuals may be white.
        white_statistic: f64 = 4.0, "standard deviations", Statistics("a chi-square, normalised: the tail beyond 4 is 1 in 4000 with 100 blocks, 1 in 630 with 12 (scipy.stats.chi2)");
        /// Block lengths over which the whiteness statistic sums residuals.
        blocks: [usize; 4] = [4, 16, 64, 256], "samples", Statistics("sums over blocks see slow residuals that neighbours do not show; factors of four leave no gap between them");
        /// Blocks of a record below which the whiteness statistic leaves it out.
        fewest_blocks: usize = 12, "blocks", Statistics("a chi-square of fewer is far from the normal distribution that the statistic is read by");
        /// Normalised residual (rms) up to which a fit has reached the noise.
        at_noise: f64 = 1.04, "rms", Judgement("the noise standard deviation is itself estimated, to about 2 % from 1000 samples, and rounding adds as much");
        /// Mean squared normalised residual below which a fit on its way counts as at the noise: coupled, or before its last steps.
        complete: f64 = 1.2, "mean square", Judgement("at_noise squared, and a tenth for the steps that are left");
        /// Normalised residual (rms) above which an output is not explained.
        unexplained: f64 = 1.15, "rms", Judgement("seven times that error of the noise estimate");
        /// Normalised residual (rms) above which a model is far from the noise, and fits start coupled to the measured motion.
        far: f64 = 2.0, "rms", Judgement("three quarters of the squares are then not noise");
        /// Mean squared normalised residual up to which a structure may be complete.
        near: f64 = 2.0, "mean square", Judgement("as much as the noise is unexplained");
        /// Normalised residual (rms) above which the nominal refit is brought to its end only after the search.
        very_far: f64 = 5.0, "rms", Cost("its last steps decide nothing while a 25 times larger misfit is unexplained");
    }
}
