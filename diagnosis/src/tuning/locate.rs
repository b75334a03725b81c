//! How the missing force is estimated at every place.

use super::table::group;

group! {
    /// How the missing force is estimated at every place, and when two places or laws differ.
    Locate {
        /// Samples at which the force behind a finding is estimated, at most.
        samples: usize = 8000, "samples", Cost("for the plots beside a finding");
        /// Samples of a run, at least.
        fewest_samples: usize = 16, "samples", Numerics("the smoother's end effects");
        /// Least noise standard deviation of an output, as a share of its signal.
        least_noise: f64 = 1e-5, "-", Numerics("the linearised simulation is not more exact");
        /// Correlation time of the force error of a nonlinear element.
        force_error_correlation: f64 = 20.0, "samples", Judgement("a force that is off stays off for a part of the motion");
        /// Standard error of the forces of nonlinear elements while the motion is not known, as a share of them.
        first_force_error: f64 = 2.0, "-", Judgement("the nominal motion may be anything");
        /// The same, tried, once it is known.
        force_errors: [f64; 3] = [0.01, 0.1, 0.5], "-", Statistics("the likelihood chooses among them");
        /// Samples in which the unknown force moves by its scale at unit intensity.
        slow: f64 = 100.0, "samples", Statistics("the likelihood chooses the intensity; this is only its unit");
        /// Numbers that the covariances of a run may take; longer runs are smoothed with the steady gain.
        covariances: usize = 8_000_000, "numbers", Cost("64 MB");
        /// Samples after which a backward covariance has settled.
        settled: usize = 400, "samples", Numerics("1e-3 of a covariance that decays over 60 samples");
        /// Normalised residual (rms) up to which nothing is said to show.
        quiet: f64 = 1.02, "rms", Statistics("half of noise.at_noise's excess");
        /// Difference of normalised residuals below which two places cannot be separated.
        indistinct: f64 = 0.3, "rms", Judgement("of a misfit of 2 and more: as much as the linearisation errs by");
        /// Displacement that makes a turning point, in rms displacements.
        turn: f64 = 0.05, "-", Judgement("smaller reversals are noise");
        /// Share of the force that a richer law has to explain beyond another one.
        clearly: f64 = 0.03, "-", Judgement("the estimated force errs by that");
        /// Ratio of amplitudes below which no exponent is reported.
        range: f64 = 1.5, "-", Statistics("an exponent of 1 +- 0.2 needs forces known to 8 % over less");
        /// Distance over which dry friction builds up, in rms displacements.
        slip: f64 = 1e-3, "-", Numerics("smooth enough for a linearisation along the motion");
        /// Passes over the travel that a ripple makes, at least.
        ripple_turns: f64 = 2.0, "passes", Statistics("one pass cannot be distinguished from a trend");
        /// Ripples distinguished, at most.
        ripples: usize = 3, "ripples", Cost("motors have cogging, commutation, and a gear");
    }
}
