//! How the next experiment is chosen.

use super::table::group;

group! {
    /// How the next experiment is chosen. Its menu of excitations is in `experiment/menu.rs`.
    Experiment {
        /// Separation at which an experiment decides between explanations.
        wanted: f64 = 5.0, "standard deviations", Statistics("its square is the difference of costs; half of it beyond claim.alike's doubt");
        /// Repeats of an experiment, at most.
        most_repeats: u64 = 10, "repeats", Judgement("more repeats are not practical");
        /// Rivals that are separated, at most.
        rivals: usize = 4, "structures", Cost("each pair is simulated for each excitation");
        /// Experiments that are compared by a true refit.
        finalists: usize = 3, "experiments", Cost("two fits each");
        /// Steps in which one explanation tries to imitate another where a sensor is added, at most.
        imitating_steps: usize = 8, "Gauss-Newton steps", Cost("one simulation per parameter each");
        /// Time that it takes to set an experiment up.
        setting_up: f64 = 2.0, "s", Judgement("without it the shortest would always be chosen");
        /// Largest ratio of predicted to recorded peaks of positions and speeds.
        reach: f64 = 1.3, "-", Judgement("the device was shown to stand what was recorded");
        /// Largest ratio of a planned to a recorded force, where the device's own limit allows it.
        force: f64 = 1.5, "-", Judgement("as reach");
        /// Mean of a force, as a share of its peak, below which it counts as none.
        small_mean: f64 = 0.3, "-", Judgement("what is larger is weight or preload, and is kept");
        /// Share of the sampling rate that excitations keep below.
        band: f64 = 0.1, "-", Numerics("ten samples per period: the first harmonic behind a zero-order hold is then smaller by 1.6 % (sinc 0.1)");
        /// Samples of an excitation, at most.
        longest: f64 = 16_000.0, "samples", Cost("as long as the recordings");
        /// Share of the work for simulating everything, and for simulating and evaluating it.
        shares: [f64; 2] = [0.4, 0.75], "of the work", Cost("the rest is for refits");
        /// Substeps per sample for choosing, and for the figures of the best, at most.
        substeps: [usize; 2] = [4, 16], "substeps", Cost("as fit.middle_substeps");
        /// Standard deviation of a parameter, as a share of it, from which it is taken as open.
        open: f64 = 0.05, "-", Judgement("5 % is the accuracy of a data sheet");
        /// Explanations that no fit was made of and that are fitted before anything is claimed, at most.
        contenders: usize = 8, "structures", Cost("simple laws at a place and its neighbours");
        /// How far such an explanation may be behind to be fitted to its end.
        contender_behind: f64 = 40.0, "criterion", Judgement("twice claim.softened: with few substeps and steps not taken yet a fit is known no better");
        /// Starts from which each of them is tried.
        contender_starts: usize = 3, "starts", Cost("the first are the most plausible");
        /// Work for these fits.
        contender_work: u64 = 30_000_000, "simulation steps", Cost("a fortieth of the work");
        /// Noise of a sensor that is not there, as a share of what it would read, where no other of its kind is.
        sensor_noise: f64 = 0.01, "-", Judgement("a common sensor");
    }
}
