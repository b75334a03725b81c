//! What recordings are taken for.

use super::table::group;

group! {
    /// What recordings are taken for: their noise, what the audit remarks, and the model's scales on them.
    Recordings {
        /// Orders of difference by which the noise of a signal is estimated: a smooth signal vanishes in one of them.
        noise_orders: usize = 6, "orders", Numerics("each squares the samples per period that a smooth signal needs; from six on rounding decides");
        /// Blocks of a signal, over which the median is taken.
        noise_blocks: usize = 40, "blocks", Statistics("steps and reversals of friction fall in less than half of them");
        /// Least noise standard deviation, as a share of the signal.
        least_noise: f64 = 1e-6, "-", Numerics("seven digits of a CSV file");
        /// Samples of a record, at least.
        fewest_samples: usize = 50, "samples", Statistics("fewer say nothing of a device with three parameters and noise");
        /// Factor by which a parameter that the file states may be off.
        stated_range: f64 = 50.0, "-", Judgement("a wrong unit is a factor of 57 (degrees) and more, and is the audit's");
        /// Factor by which the measured travel may exceed that of the nominal model, for the scales of hypotheses.
        travel: f64 = 4.0, "-", Judgement("more looks like a sensor's offset");
        /// Magnitude beyond which a simulation has run away.
        runaway: f64 = 1e9, "SI units", Numerics("no device is there, and squares are still finite");
        /// Distance of samples from the even grid above which a clock is called uneven.
        jitter: f64 = 0.05, "sample periods", Judgement("a delay of that size is what a diagnosis would find instead");
        /// Share of samples at a signal's two extremes above which it looks clipped.
        clipped: f64 = 0.02, "-", Statistics("a sine has 0.9 % of its samples within 1e-4 of its range at either end");
        /// Correlation of a command's noise with a sensor's above which a controller closes the loop.
        closed_loop: f64 = 0.5, "-", Statistics("0.1 is chance at 400 samples");
        /// Ratio of sample times in a set above which it is remarked.
        sample_times: f64 = 2.0, "-", Judgement("the faster recording has an octave above the band of the slower one");
        /// Distance, as a factor, of a ratio or factor from that of two units within which it is taken for them.
        unit_near: f64 = 1.3, "-", Judgement("nominal parameters are off by up to that; units are a factor of 2.5 apart at least");
        /// Sample time from which another unit of time is tried.
        slow: f64 = 0.02, "s", Judgement("no force-reflecting device is sampled at less than 50 Hz");
        /// Share of the residual's power that another unit of time has to remove.
        time_unit_removes: f64 = 0.75, "-", Judgement("half of the amplitude");
        /// Correlation of measured and predicted signals in that unit.
        time_unit_correlates: f64 = 0.85, "-", Judgement("as time_unit_removes: 0.87 goes with it for a model that is scaled right");
        /// Correlation of measured and predicted signals from which a factor between them means something.
        unit_correlates: f64 = 0.9, "-", Judgement("a model of another structure is scaled by chance below that");
        /// Factor beyond which a signal is called to be in another unit.
        unit_far: f64 = 20.0, "-", Judgement("no parameter of a data sheet is that wrong");
        /// Factor by which the recordings may differ in it.
        unit_alike: f64 = 1.5, "-", Judgement("a unit is the same in all");
    }
}
