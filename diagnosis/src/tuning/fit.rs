//! How a structure is fitted.

use super::table::group;
use crate::output_error::effort::Effort;

group! {
    /// How a structure is fitted: damped Gauss-Newton steps (Levenberg-Marquardt) with secant updates of the derivatives.
    Fit {
        /// A fit that is brought to its end: steps, and the predicted decrease of the next one at which it has ended.
        to_the_end: Effort = Effort { steps: 40, tolerance: 0.3 }, "steps, mean squares", Statistics("a parameter at one standard deviation from its optimum costs 1");
        /// The same for one that is already beaten.
        beaten_steps: usize = 6, "steps", Cost("it only has to show that it does no better");
        /// A fit in the middle stage of a race.
        middle: Effort = Effort { steps: 5, tolerance: 1.0 }, "steps, mean squares", Cost("first steps");
        /// First steps: in the early stage of a race, beside which others are screened, with a looser coupling, of the parameters of single recordings.
        early: Effort = Effort { steps: 3, tolerance: 2.0 }, "steps, mean squares", Cost("first steps");
        /// First steps of every structure of a race.
        first: Effort = Effort { steps: 2, tolerance: 3.0 }, "steps, mean squares", Cost("first steps");
        /// First step of every structure of a race that is coupled to the measured motion.
        first_coupled: Effort = Effort { steps: 1, tolerance: 3.0 }, "steps, mean squares", Cost("coupled, one step goes far");
        /// Steps of the next stages of such a race.
        coupled_steps: [usize; 3] = [1, 2, 3], "steps", Cost("more for fewer structures");
        /// Steps of the nominal model's first fit, from the given parameters and from where it was coupled: on the worst recordings, then on all.
        nominal_first: [usize; 2] = [12, 3], "steps", Cost("it starts far off");
        /// Steps of effects alone, where they begin beside stated parameters that may be right.
        effects_first: usize = 6, "steps", Cost("as beaten_steps");
        /// The nominal model's refit far from the noise.
        nominal_far: Effort = Effort { steps: 8, tolerance: 3.0 }, "steps, mean squares", Cost("its last thousandths say nothing there");
        /// The nominal model's fit coupled to the measured motion.
        nominal_coupled: Effort = Effort { steps: 12, tolerance: 1.0 }, "steps, mean squares", Cost("coupled simulations are short");
        /// The nominal model where a view of its residuals is taken without coupling.
        nominal_view: Effort = Effort { steps: 2, tolerance: 1.0 }, "steps, mean squares", Cost("it was fitted before");
        /// Share of the cost below which a predicted decrease counts as none far from the noise.
        relative_tolerance: f64 = 1e-3, "-", Cost("far from the noise another structure gains more");
        /// Decrease of the cost below which a step far from the noise is a weak one.
        weak_decrease: f64 = 2e-3, "-", Cost("far from the noise another structure gains more");
        /// Weak steps in a row that end a fit.
        weak_steps: usize = 3, "Gauss-Newton steps", Cost("as weak_decrease");
        /// First damping.
        damping: f64 = 1e-3, "-", Numerics("of the scaled normal equations' unit diagonal; a step is then Gauss-Newton's to a thousandth");
        /// Factor on the damping after a step that did not lower the cost.
        more_damping: f64 = 8.0, "-", Numerics("Marquardt 1963 uses 10");
        /// Factor on the damping after a step that did as predicted.
        less_damping: f64 = 0.1, "-", Numerics("Marquardt 1963");
        /// Factor on the damping after a step that did less than half of what was predicted.
        keep_damping: f64 = 0.4, "-", Numerics("between less_damping and none");
        /// Share of the predicted decrease below which derivatives are recomputed.
        as_predicted: f64 = 0.3, "-", Numerics("a quarter is the usual level below which a model of the cost is not trusted (Nocedal & Wright 2006, ch. 4)");
        /// Steps that derivatives are carried along by the secant update, at most.
        secant_steps: usize = 4, "Gauss-Newton steps", Cost("each spares one simulation per parameter; Broyden updates lose accuracy with each");
        /// Largest step of a parameter that is fitted as its logarithm.
        longest_log: f64 = 1.5, "logarithm", Numerics("a factor of 4.5: beyond it no linearisation holds");
        /// Largest step of another parameter, as a share of its range.
        longest: f64 = 0.5, "-", Numerics("as longest_log");
        /// The difference of a law along the direction of a derivative that is carried along with the motion.
        carried: f64 = 1e-3, "differences", Numerics("above the rounding of a law, far below the width of its kinks");
        /// Substeps of derivatives that are carried along, at most.
        carried_substeps: usize = 4, "substeps", Cost("a direction of descent need not be as exact as the residuals; where it misleads, fine differences follow");
        /// Relative difference by which derivatives are taken.
        difference: f64 = 1e-3, "-", Numerics("well above the simulations' rounding, and a thousandth of a parameter is linear");
        /// Difference of a delay, in sample periods.
        difference_of_delay: f64 = 0.7, "sample periods", Numerics("behind a zero-order hold less than a sample has no gradient");
        /// Factor by which differences become wider where narrow ones mislead.
        wider: f64 = 8.0, "-", Numerics("a slip that begins a step later is a jump to narrow differences and a slope to wide ones");
        /// Widest difference of a fit that is brought to its end, in differences.
        widest: f64 = 64.0, "-", Numerics("twice wider: 6 % of a parameter");
        /// Widest difference of a fit on its way.
        widest_midway: f64 = 8.0, "-", Cost("once wider");
        /// Standard deviation of a stated parameter before data, as a logarithm.
        prior: f64 = 2.0, "logarithm", Judgement("a factor of seven without surprise: only parameters that the recordings do not determine feel it");
        /// Largest value of an unknown input, in sizes of what was measured.
        unknown_range: f64 = 100.0, "-", Judgement("its standard deviation before data is a hundredth of that: about the size of what was measured");
        /// Distance from a bound, as a share of the range, within which a parameter is reported at its bound.
        at_bound: f64 = 1e-6, "-", Numerics("fits clamp exactly; the rest is rounding");
        /// Largest start position of a body, in sizes of what was measured; its largest start velocity crosses that size in a sample period over so many.
        start_range: f64 = 20.0, "-", Judgement("devices start inside the range that they move in");
        /// Samples from whose first ones a start is read off, by a parabola.
        start_samples: usize = 16, "samples", Judgement("twenty sample periods are short relative to the device dynamics, and determine a velocity");
        /// Standard deviation of those before data, as a share of their largest value.
        start_prior: f64 = 0.3, "-", Judgement("wider than any start that was measured");
        /// Spacing of the weights of an unknown input that are moved together for derivatives.
        knots_apart: usize = 6, "knots", Numerics("a cubic B-spline acts over four; two more for what the device remembers");
        /// Angle by which the measured motion may turn in a substep of first steps.
        turn: f64 = 0.4, "rad", Numerics("a law stepped over by that is in error by about a twelfth of its square, a percent");
        /// Most substeps that first steps take for that.
        following_substeps: usize = 4, "substeps", Cost("as coarse_substeps");
        /// Substeps per sample of first steps and of screening, at most, where the motion is slow.
        coarse_substeps: usize = 1, "substeps", Cost("first steps only have to find the valley; see screening.substep_error");
        /// Substeps per sample of fits on their way, at most.
        middle_substeps: usize = 2, "substeps", Cost("as coarse_substeps");
        /// Substeps per sample of a fit that is brought to its end, at most.
        fine_substeps: usize = 64, "substeps", Numerics("what the stiffest physics asks for; models ask for fewer");
        /// Normalised residuals beyond so many of their median deviation count linearly, where dry friction acts on a prescribed body.
        robust: f64 = 6.0, "median deviations", Statistics("Huber 1964; white noise reaches 6 in 1 of 500 million");
    }
}
