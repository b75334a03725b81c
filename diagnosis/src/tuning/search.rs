//! How much is tried, in which order, and when it ends.

use super::table::group;

group! {
    /// How much is tried and when it ends. Shares are of the work that a search may do ([`Search::work`] times the effort asked for).
    Search {
        /// Work of a search with an effort of 1.
        work: u64 = 1_200_000_000, "simulation steps", Cost("about 20 s on two threads of a laptop");
        /// Wall-clock limit of a search, where nothing else is said.
        patience: u64 = 600, "s", Cost("far longer than the default effort takes on a slow machine");
        /// Simulation steps of two threads of a laptop in a second: for progress bars only.
        steps_per_second: f64 = 60e6, "simulation steps", Judgement("one over tens of nanoseconds, which a step of a small network takes, on two threads");
        /// Fits that run side by side before their work is added up.
        abreast: usize = 16, "fits", Cost("two for each of eight processors; fixed, so that a verdict does not depend on their number");
        /// Share of what is left that one of many fits side by side may take.
        of_one: f64 = 0.25, "of what is left", Cost("one fit of a slow law must not starve the others");
        /// Share after which no step is begun.
        last_step: f64 = 0.6, "of the work", Cost("the rest is for bringing the best to their ends");
        /// Share after which no step for rivals of the best is begun.
        last_rival: f64 = 0.88, "of the work", Cost("a simpler law that does as well is worth more than another effect");
        /// Share at which fits of rivals end.
        rivals_end: f64 = 0.92, "of the work", Cost("as last_rival");
        /// Share at which the best are at their ends.
        best_end: f64 = 0.95, "of the work", Cost("the rest is for the nominal model");
        /// Share at which the nominal model is at its end.
        nominal_end: f64 = 0.97, "of the work", Cost("the rest is for holding structures against unseen recordings");
        /// Share in which fits that coarse substeps have blurred go on, whatever is left.
        refitted: f64 = 0.1, "of the work", Numerics("a structure must not win by the error of its substeps");
        /// Share of a step that tries other laws or places for the best, far from the noise.
        share_of_relatives: f64 = 0.08, "of the work", Cost("another effect may be what is missing");
        /// Share in which a law is brought near at other places, before it is held against the best.
        share_of_elsewhere: f64 = 0.05, "of the work", Cost("some steps at each of some places");
        /// Share in which joints are split and brought near, and the same for fitting them on.
        share_of_splits: f64 = 0.1, "of the work", Cost("as share_of_relatives");
        /// Share in which sizes of play are scanned and fitted, and the same for fitting them on.
        share_of_scans: f64 = 0.15, "of the work", Cost("as share_of_relatives");
        /// Sizes that are tried, from the largest down.
        scan_points: usize = 36, "sizes", Cost("a simulation each");
        /// Factor from one of them to the next.
        scan_ratio: f64 = 0.85, "-", Judgement("the valley of a play is about as wide as a third of it");
        /// Factor on the strength of the coupling there.
        scan_coupling: f64 = 10.0, "-", Judgement("a slightly later contact must not lead to another minimum");
        /// Substeps per sample of fits there, at most.
        scan_substeps: usize = 16, "substeps", Cost("sides met to a tenth of a sample time");
        /// Sizes that are fitted.
        scanned: usize = 4, "structures", Cost("some steps each");
        /// Share of a step that tries other effects, while the best leaves more than noise.
        share_of_effects: f64 = 0.25, "of the work", Cost("laws of many parameters must not starve all other steps");
        /// Structures that also start beside the stated parameters as given.
        from_the_given: usize = 10, "structures", Cost("one fit each, of some steps");
        /// The same where the best leaves as much as the noise and more.
        from_the_given_far: usize = 2, "structures", Cost("what leaves so much lacks another effect, whatever it starts from");
        /// Share of the step that resolves laws more finely, far from the noise.
        share_of_finer: f64 = 0.15, "of the work", Cost("as share_of_relatives");
        /// Work in which every law at a place takes its first step.
        laws: u64 = 120_000_000, "simulation steps", Cost("a tenth of the work");
        /// Work in which each record is fitted by itself.
        per_record: u64 = 100_000_000, "simulation steps", Cost("an eighth of the work, after the search");
        /// Share of the work for refits that begin with few of the stated parameters.
        few_first: f64 = 0.05, "-", Cost("a sixth of what single effects get; models of usual stiffness need a hundredth");
        /// Steps in which an effect that may be nothing is taken back, as shares of its size.
        taken_back: [f64; 4] = [0.6, 0.3, 0.1, 0.02], "-", Numerics("each fit starts from the one before: the last step is within what the next can follow");
        /// Work in which the next experiment is looked for.
        experiment: u64 = 100_000_000, "simulation steps", Cost("an eighth of the work, after the search");
        /// Share of the best promise that a single effect has to reach, beyond the first few.
        promise: f64 = 0.5, "-", Cost("those that promise less are tried beside others");
        /// Samples on which first steps are taken, at least, where recordings may be cut.
        first_samples: usize = 4000, "samples", Cost("first steps only rank structures");
        /// Mean square residual there, as a share of that of the whole recordings.
        first_share: f64 = 0.5, "-", Judgement("what is to be explained has to be seen there; half of it is not by chance");
        /// Structures of a step that go on after their first steps.
        further: usize = 4, "structures", Cost("first steps do not rank surely");
        /// Structures of a step that are fitted to their end.
        ended: usize = 3, "structures", Cost("one fit each");
        /// Structures that another effect is added to: in the first step that does, and once those of it are used up.
        bases: [usize; 2] = [3, 5], "structures", Cost("the best may have been the wrong first effect");
        /// Effects that are tried beside each of them, those that promise most.
        beside: [usize; 2] = [5, 7], "structures", Cost("screening is of first order");
        /// Single effects fitted at a time, where a coupled fit makes first steps cheap.
        singles_coupled: usize = 30, "structures", Cost("first steps");
        /// Single effects fitted at a time, otherwise.
        singles: usize = 5, "structures", Cost("first steps");
        /// Ripples fitted without coupling.
        ripples: usize = 4, "structures", Cost("first steps");
        /// Other laws at the place of the best, where fits are not coupled.
        laws_uncoupled: usize = 6, "structures", Cost("first steps");
        /// Places whose laws are all tried, where fits are coupled.
        places: usize = 2, "places", Cost("as many laws as there are for each");
        /// Structures that start from an uncoupled simulation beside coupled ones.
        uncoupled: usize = 2, "structures", Cost("first steps");
        /// Single effects from each base that are tried whatever they promise.
        ranks_always: usize = 3, "structures", Cost("screening is of first order");
        /// Single effects from each base that are tried at most, where fits are coupled.
        ranks_coupled: usize = 14, "structures", Cost("as singles_coupled");
        /// The same otherwise.
        ranks_uncoupled: usize = 8, "structures", Cost("as singles_first");
        /// Share of its cost that a fit may gain by its next step, at most, where fits are ranked.
        may_gain: f64 = 0.6, "-", Judgement("a prediction from a linearisation is optimistic");
        /// The same where coupled fits are dropped.
        may_gain_coupled: f64 = 0.95, "-", Cost("a fit on its way is not behind yet");
        /// Share after which screening beside a structure takes the best structure only.
        last_other_base: f64 = 0.5, "of the work", Cost("as last_step");
        /// Structures that go on after their first steps whatever the best has reached.
        always: usize = 3, "structures", Cost("after two steps a fit may be far from its end");
        /// Predicted cost over the best's up to which a coupled fit goes on.
        behind: f64 = 2.5, "-", Cost("costs along the measured motion differ by little");
        /// Predicted cost over the best's up to which an uncoupled fit goes on, once the best is at the noise.
        behind_at_noise: f64 = 1.3, "-", Cost("no structure far behind can win any more");
        /// The same before the best is at the noise.
        behind_far: f64 = 4.0, "-", Cost("twice the residual");
        /// Excerpts of a stated parameter that a law beside it may take over.
        taken_over: [f64; 3] = [0.25, 0.5, 0.9], "-", Judgement("two dampers in series are separated along a narrow valley: starts along it");
        /// Share of the compliance of a joint that a spring has which is put into it, at its starts.
        condensed_softness: [f64; 3] = [0.2, 0.5, 0.8], "-", Judgement("less is no compliance of use, more leaves nothing of the model's own spring");
        /// Inertia of the body there, in that of the lighter end.
        condensed_inertia: [f64; 6] = [0.02, 0.06, 0.15, 0.35, 0.7, 1.2], "-", Judgement("from steps of two and more in its frequency a fit finds the resonance between");
        /// Its damping ratio.
        condensed_damping: f64 = 0.1, "-", Judgement("more than devices have: a wide resonance is found from further off");
        /// Starts of each joint that are fitted.
        condensed_starts: usize = 3, "starts", Cost("first steps");
        /// Starts beside the stated parameters as given that are fitted on.
        condensed_far: usize = 4, "starts", Cost("as many fits as the nominal model's first");
        /// Structures beside which joints are split.
        condensed_bases: usize = 2, "structures", Cost("as many starts for each");
        /// Steps to something simpler at the end, at most.
        simpler: usize = 3, "steps", Cost("one fit for each effect and law");
        /// Structures of each number of effects that are held against unseen recordings.
        finalists: usize = 8, "structures", Cost("one simulation each");
        /// Distance from the best, in mean squared residuals over the correlation time, up to which it does.
        open_advantage: f64 = 20.0, "criterion", Statistics("beyond twice claim.alike nothing changes any more");
        /// Structures whose parameters the nominal model starts from at the end.
        nominal_from: usize = 2, "structures", Cost("one fit each");
        /// Structures that are brought to their ends.
        last_fits: usize = 6, "structures", Cost("one fit each");
        /// Share of the nominal model's residual (mean square) that it has to leave when coupled to the measured motion.
        coupled_leaves: f64 = 0.3, "-", Judgement("where coupling explains more than that, it explains what is missing, too");
        /// The same in mean squares of the noise.
        coupled_leaves_noise: f64 = 3.0, "mean square", Judgement("three times the noise is enough to separate effects");
        /// Factors on the coupling, tried in this order until the nominal model leaves enough.
        couplings: [f64; 5] = [0.2, 1.0, 0.2, 0.04, 0.008], "-", Judgement("the first on parts of the recordings, the others on the whole");
    }
}
