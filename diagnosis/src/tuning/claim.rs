//! What is claimed.

use super::table::group;

group! {
    /// What is claimed of the structures that were found.
    Claim {
        /// Advantage over the structure without it above which an effect is claimed: difference of the information criterion with effective samples.
        least_advantage: f64 = 30.0, "criterion", Statistics("10 is very strong evidence for one alternative (Kass & Raftery 1995); some hundred hypotheses are tried, each at several starts, which adds 2 ln 500 = 12");
        /// Share of the cost that an effect has to remove.
        least_share: f64 = 0.02, "-", Numerics("what coarse substeps and an inexact simulator may cost");
        /// Advantage below which two structures cannot be told apart.
        alike: f64 = 6.0, "criterion", Statistics("strong evidence begins there (Kass & Raftery 1995)");
        /// Mean squared residual on unseen recordings, over that without the effect, above which an effect is not claimed.
        unseen: f64 = 1.005, "-", Judgement("an effect that is there helps everywhere; half a percent for what does not move it");
        /// Share of the excess misfit that has to be removed for a verdict of missing physics, where the noise is not reached.
        explained: f64 = 0.99, "-", Judgement("a tenth of the residual amplitude remains");
        /// Whiteness statistic above which something is missing however small the residual is.
        wanders: f64 = 12.0, "standard deviations", Judgement("fits of the right structure were seen below 3, and at 2 to 3 times that where they were cut short");
        /// Correlation time above which residuals above the noise are unexplained.
        correlated: f64 = 3.0, "samples", Judgement("twice noise.white_correlation");
        /// Cost of the refit over that of the given parameters above which these are not called wrong.
        refit_gains: f64 = 0.99, "-", Judgement("one percent of the misfit is no error of a parameter that matters");
        /// Excursion of a signal, in noise standard deviations, above which the device moved at all.
        excited: f64 = 5.0, "noise standard deviations", Statistics("noise alone does not reach it");
        /// Probability of the given parameters under the fit's below which they are called wrong, and of records' own parameters below which they disagree.
        significance: f64 = 1e-3, "probability", Statistics("one false alarm in a thousand diagnoses");
        /// Standard deviation of a parameter as a logarithm above which the recordings do not determine it.
        undetermined: f64 = 0.7, "logarithm", Statistics("a 95 % interval of a factor of 16 from end to end");
        /// The same of a parameter that is not fitted as its logarithm and was not stated, as a share of its range.
        undetermined_range: f64 = 0.25, "-", Statistics("a 95 % interval is then the whole range");
        /// Excursion above which a sample belongs to a glitch, in median deviations of the residual.
        glitch: f64 = 8.0, "median deviations", Statistics("white noise does not reach it");
        /// Samples without an excursion that end a glitch.
        glitch_gap: usize = 40, "samples", Judgement("a sensor's filter rings that long");
        /// Longest glitch.
        glitch_longest: usize = 160, "samples", Judgement("four times glitch_gap");
        /// Samples that glitches have, at least.
        glitch_samples: usize = 3, "samples", Statistics("two may be a transmission error that moves no fit");
        /// Share of the samples that glitches have, at most.
        glitch_share: f64 = 0.02, "-", Judgement("what is off more often is no glitch");
        /// Factor of the softened weight of a rival in a confidence: advantage per unit of log-odds.
        softened: f64 = 20.0, "criterion", Judgement("an information criterion says 2; a simulator is never the device");
        /// Weight in a confidence of a richer law of the same family at the same place.
        richer: f64 = 0.1, "-", Judgement("it contains the claimed law");
        /// Weight in a confidence of a hypothesis that promised as much and was not fitted.
        unfitted: f64 = 0.02, "-", Judgement("it lost its race before its fit");
        /// Such hypotheses that count, at most.
        unfitted_most: f64 = 10.0, "hypotheses", Judgement("their weight is then that of one rival at 1.6 softened");
        /// Alternatives that are listed.
        alternatives: usize = 6, "structures", Cost("nobody reads more");
        /// Least factor on a confidence where the residual is not noise.
        least_adequacy: f64 = 0.05, "-", Judgement("one in twenty may still be right");
        /// Share of a finding's promise from which a hypothesis that was not fitted promised as much.
        as_promising: f64 = 0.9, "-", Judgement("screening errs by more than that");
        /// Share of a finding's confidence from which a rival is named in the sentence.
        near_rival: f64 = 0.5, "-", Judgement("at least half as sure");
        /// Rivals that are named, and whose models are written.
        rivals: usize = 3, "structures", Cost("files beside the verdict");
        /// Cost over that of the claim up to which a rival's model is written.
        rival_cost: f64 = 2.0, "-", Judgement("what is built on the verdict has to stand with these, too");
    }
}
