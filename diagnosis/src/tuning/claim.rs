//! What is claimed.

use super::table::group;

group! {
    /// What is claimed of the structures that were found.
    Claim {
        /// Advantage over the structure without it above which an effect is claimed: difference of the information criterion with effective samples.
        least_advantage: f64 = 30.0, "criterion", Statistics("10 is very strong evidence for one alternative (Kass & Raftery 1995); some hundred hypotheses are tried, each at several starts, which adds 2 ln 500 = 12");
        /// Share of the cost that an effect has to remove.
        least_share: f64 = 0.02, "-", Numerics("what coarse substeps and an inexact simulator may cost");
        /// Advantage below which two structures cannot be distinguished.
        alike: f64 = 6.0, "criterion", Statistics("strong evidence begins there (Kass & Raftery 1995)");
        /// Standard deviations of its size within which an effect may be nothing.
        may_be_nothing: f64 = 3.0, "standard deviations", Statistics("one in 400 by chance, of effects that screening picked from some hundred");
        /// Delay or lag, as a share of a sample period, below which it is a matter of timing and no missing physics.
        timing: f64 = 0.05, "sample periods", Statistics("rounding of times, and when a sensor is read within its period, come to that");
        /// Blocks into which a held-out recording is cut to see whether an explanation predicts all of it better, at most.
        blocks: usize = 48, "blocks", Statistics("enough for a standard error, and each longer than most residuals correlate");
        /// Samples of such a block, at least.
        block_samples: usize = 20, "samples", Statistics("its mean square is then known to a third");
        /// Standard errors by which an effect has to predict unseen recordings better, block by block.
        sure: f64 = 2.0, "standard errors", Statistics("one in forty by chance, of what the fits have preferred already");
        /// Share of gains and losses of the blocks that has to speak for an effect where it shows in few of them.
        one_sided: f64 = 0.9, "-", Judgement("noise takes from the other blocks a tenth of what a short event gives");
        /// Least improvement on unseen recordings that is of use: of the root mean square, over the noise standard deviation or over itself, whichever is larger.
        useful: f64 = 0.01, "-", Judgement("below 1 % of the noise neither a controller nor a user can distinguish the models");
        /// Standard deviations by which the recordings have to say that an input runs on between its samples, where the model file does not say that it is held.
        runs_on: f64 = 5.0, "standard deviations", Statistics("one in two million by chance; physics that is left out may look like a little of it");
        /// Residual of the held-out recordings, over that of the fitted ones and over the noise, above which what was fitted does not explain them.
        far_on_unseen: f64 = 2.0, "rms", Judgement("four times the variance: parameters that the fitted recordings determine badly cost less");
        /// Share of what a simpler law leaves beyond the noise that a law which contains it has to remove.
        richer_removes: f64 = 0.2, "-", Judgement("a tenth of the amplitude; on a real device a law with more numbers always gains a little");
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
        /// Log-odds of a finding: a constant, then one for each of its figures, see [`crate::belief::confidence::Figures`].
        confidence: [f64; 12] = [-1.26, 0.465, 0.0936, 0.0, 0.295, 1.15, 0.0, -0.239, -1.37, -0.996, -0.755, 0.0], "log-odds", Measured("a logistic regression on drawn cases: `diagnosis/tests/concealed/calibrate.py fit`; docs/diagnosis.md lists them");
        /// Log-odds that some physics of a finding's family is at its place, as `confidence`.
        family_confidence: [f64; 12] = [-3.18, 1.6, 0.357, 0.0, 0.0, 1.02, -0.0964, 0.0, 0.0, -0.368, 0.0, 0.162], "log-odds", Measured("`diagnosis/tests/concealed/calibrate.py fit-family`, as `confidence`");
        /// Advantage over a rival, in units of the criterion, that makes it e times less likely than another one.
        softened: f64 = 20.0, "criterion", Judgement("an information criterion requires 2; a simulator never equals the device");
        /// Confidence that a finding has at most where held-out recordings are predicted worse with it than by the model as given.
        as_likely: f64 = 0.5, "probability", Judgement("as likely as not");
        /// Confidence from which a finding is asserted apart from those that the recordings leave open.
        asserted: f64 = 0.9, "probability", Judgement("as sure as a claim is called sure");
        /// Alternatives that are listed.
        alternatives: usize = 6, "structures", Cost("more are not readable");
        /// Share of a finding's confidence from which a rival is named in the sentence.
        near_rival: f64 = 0.5, "-", Judgement("at least half as sure");
        /// Rivals that are named, and whose models are written.
        rivals: usize = 3, "structures", Cost("files beside the verdict");
        /// Cost over that of the claim up to which a rival's model is written.
        rival_cost: f64 = 2.0, "-", Judgement("what is built on the verdict has to stand with these, too");
    }
}
