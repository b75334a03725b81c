//! What is screened, and from where.

use super::table::group;

group! {
    /// How hypotheses are screened: each simulated once beside a base, its effect projected on the residuals.
    Screening {
        /// Least force that hypotheses at a place are measured against, as a share of the largest in the device.
        least_force: f64 = 0.1, "-", Judgement("ranges end at twenty times it: no dry friction is larger than twice what drives the device");
        /// Residuals kept, at most; of more every second, third and so on is.
        residuals: usize = 16_000, "samples", Cost("projections take as long as they are many");
        /// Size of a hypothesis' second effect beside its first.
        weak: f64 = 0.15, "-", Judgement("effects with a threshold (backlash, saturation) look different when small");
        /// Starts that pass the first of two passes, at most.
        starts: usize = 70, "starts", Cost("the second pass simulates each on all recordings");
        /// The same, at least.
        fewest_starts: usize = 24, "starts", Cost("fewer would leave whole families out");
        /// Share of the work for the first pass, on the two worst recordings.
        first_pass: f64 = 0.6, "of the work", Cost("it tries all starts");
        /// Ridge of the projection on one hypothesis' two effects.
        ridge: f64 = 1e-4, "-", Numerics("the two are nearly parallel where the law is linear");
        /// Ridge of the projection on those of two hypotheses.
        pair_ridge: f64 = 1e-3, "-", Numerics("as ridge, for four columns");
        /// Correlation below which an effect counts as imitated by the free parameters: length that is left of one.
        imitated: f64 = 1e-3, "-", Numerics("below it the projection's rounding is what is left");
        /// Share of the work for one base, near the noise.
        share_near: f64 = 0.2, "of the work", Cost("near the noise screening decides what is fitted");
        /// Share of the work for one base, far from the noise: there are two bases.
        share_far: f64 = 0.08, "of the work", Cost("as share_near");
        /// Share of the work for screening beside a structure that was found.
        share_anew: f64 = 0.06, "of the work", Cost("as share_near");
        /// Parameters of a hypothesis above which it is tried only where simpler laws do not suffice.
        parameters: usize = 6, "parameters", Cost("the laws of more are refinements of laws of fewer");
        /// Samples of the recordings' parts that are screened far from the noise, about.
        samples: usize = 5_000, "samples", Cost("a misfit far above the noise shows in few samples");
        /// Pairs among so many of the most promising hypotheses are looked at.
        pairs_among: usize = 90, "hypotheses", Cost("4005 products of columns");
        /// Squared simulation error of coarse substeps, as a share of the squared residual, above which finer ones are taken.
        substep_error: f64 = 0.02, "-", Numerics("an error of 14 % of the residual moves a cost by 2 %, as little as claim.least_share");
        /// Decrease of the cost that the best of many hypotheses promises on white noise.
        chance: f64 = 25.0, "mean squares", Statistics("the largest of 500 chi-squares of 6 degrees of freedom has a median of 22, and 25 or more in one of six (scipy.stats.chi2)");
        /// Samples in which ripples are looked for, at most.
        ripple_samples: usize = 12_000, "samples", Cost("their lines stand out in fewer");
        /// Power of a ripple's line over the median of all.
        ripple_prominence: f64 = 100.0, "-", Statistics("the highest of a thousand lines of white noise has about ten times the median");
        /// Share of the force that a ripple explains over that of the next one.
        ripple_alone: f64 = 3.0, "-", Judgement("backlash and friction make many lines of like size, cogging one");
    }
}
