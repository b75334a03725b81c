//! How a model is coupled to the measured motion, and on which parts of the recordings.

use super::table::group;

group! {
    /// How a model is coupled to the measured motion (an observer), and which parts of the recordings are simulated then.
    Coupling {
        /// Normalised residual (rms), over noise.far, above which the coupling has its full strength.
        full_above: f64 = 3.0, "-", Judgement("near the noise a strong coupling hides what is small");
        /// Strength below that.
        weak: f64 = 0.3, "-", Judgement("as full_above");
        /// Factor on the strength with which coupled fits go on.
        looser: f64 = 0.1, "-", Judgement("residuals are then more and more simulation errors");
        /// Factor on the strength with which a part's initial motion is found.
        firm: f64 = 30.0, "-", Judgement("a segment has to begin at the measured state");
        /// Samples of a part, at least.
        shortest: usize = 256, "samples", Cost("shorter parts spend their time on transients");
        /// Share of a part that does not count, where it does not begin with its recording.
        transient: f64 = 0.3, "-", Judgement("laws with a memory begin without one");
        /// Residual energy of a recording's beginning, as a share of its best part's, that is enough to take the beginning.
        beginning: f64 = 0.4, "-", Cost("a beginning has no transient that does not count");
    }
}
