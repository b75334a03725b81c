//! How laws are looked at on forces along a measured motion.

use super::table::group;

group! {
    /// How laws are looked at on forces along a measured motion.
    EquationError {
        /// Corners of the low-pass of motion and force that are looked at, from the lowest on.
        corners: [f64; 6] = [1.5, 3.0, 6.0, 12.0, 24.0, 48.0], "Hz", Judgement("an octave apart: what a device does by hand or by its controller is between them");
        /// Highest corner, in the sample rate.
        highest_corner: f64 = 0.2, "sample rates", Numerics("a motion is differentiated twice; above that the samples do not hold it");
        /// Share of the power of the acceleration that may be noise of the motion's sensor.
        most_noise: f64 = 0.1, "-", Statistics("noise in what explains makes an inertia too small by the same share");
        /// Bands that are looked at, from the highest on, at most.
        bands: usize = 3, "bands", Judgement("an answer that hangs on the corner differs between them");
        /// Periods of the corner in the longest recording, at least.
        least_periods: f64 = 20.0, "periods", Statistics("stretches of fewer than two periods say nothing by themselves");
        /// Order of the low-pass, which is run both ways.
        order: usize = 4, "-", Judgement("as steep as identification of robots has it (Gautier); steeper ones ring");
        /// Samples in a period of the corner that are simulated.
        samples: f64 = 16.0, "samples", Numerics("a sign that changes between two samples is then off by less than the low-pass lets through");
        /// Samples in a period of the corner that are compared.
        compared: f64 = 4.0, "samples", Statistics("twice what the band holds");
        /// Stretches of each recording that are left out in turn.
        stretches: usize = 8, "stretches", Statistics("enough for a standard error, each with several reversals");
        /// Speed below which a body is at rest, in the speed that it exceeds for a tenth of the time.
        at_rest: f64 = 0.03, "-", Judgement("slower, presliding and noise of the motion decide how dry friction turns, and no law over speed");
        /// Share of the mean error of the best structure below which the error of a stretch carries no information.
        floor: f64 = 0.1, "-", Judgement("a tenth of the noise: a device that rests is predicted exactly by any law");
        /// Structures whose extensions by one more law are looked at.
        extended: usize = 8, "structures", Cost("all pairs are looked at; a third law is looked for beside the best of them");
        /// Share of the error of left-out stretches by which a richer structure has to be better, per number.
        worth: f64 = 0.015, "-", Judgement("real devices always give one percent of the error of forces to one more number");
        /// The least share by which a richer structure has to be better.
        least_gain: f64 = 0.03, "-", Judgement("as worth, for all its parameters");
        /// Standard errors of the mean, stretch by stretch, by which a richer structure has to be better.
        sure: f64 = 1.0, "standard errors", Statistics("the richer one was already chosen as the best of many, and is penalised for its parameters");
        /// Standard errors by which the force that a richer structure has more shows in what the simpler one leaves, where the errors do not decide.
        shown: f64 = 1.645, "standard errors", Statistics("one in twenty by chance, as Clark and West have it for models that contain each other");
        /// Laws that a device of one axis has.
        dozen: f64 = 16.0, "laws", Statistics("`sure` and `shown` hold for this number; where more are compared, all share the same chance");
        /// What it costs that a law is one of many, in numbers.
        picked: f64 = 1.0, "numbers", Statistics("the choice among a dozen laws contains as much information as a parameter known to 10 %; two laws are less likely than one with as many parameters");
        /// Numbers that a rival may have more than the chosen structure.
        rival_numbers: usize = 2, "numbers", Judgement("what needs more than one law more explains anything");
        /// Log-odds of a law: a constant, then one for each of its figures, see [`crate::belief::on_forces::Figures`].
        confidence: [f64; 7] = [1.927, -0.353, 1.375, 1.749, 0.507, 0.0, 0.129], "log-odds", Measured("`diagnosis/tests/concealed/calibrate_forces.py`; docs/diagnosis.md lists the cases");
        /// The same of its kind.
        kind_confidence: [f64; 7] = [1.571, 1.0, 0.947, 2.285, 0.149, 0.0, -0.135], "log-odds", Measured("as `confidence`");
        /// Confidence of all laws of a structure from which others that predict as well are not reported beside it.
        claimed: f64 = 0.9, "probability", Judgement("as sure as a claim is called sure");
        /// Share of the force that none of the laws explains above which something is missing that has no name.
        much_left: f64 = 0.3, "-", Judgement("a tenth of the variance: friction of real joints that is left out takes more");
        /// The same in the noise of the force's sensor, above which the search goes on by simulation, with the laws that are only simulated.
        beyond: f64 = 10.0, "noise standard deviations", Judgement("what a machine does beside its laws is as fast as its sensor's noise in part; a memory that no column has is slow");
        /// Share of what a search on forces leaves of them below which what a search by simulation leaves decides.
        sharper: f64 = 0.7, "-", Judgement("half the power: what stands in the columns is then not what is missing");
        /// Structures that are simulated and whose numbers are refined.
        simulated: usize = 8, "structures", Cost("fewer are hardly separated by held-out segments");
    }
}
