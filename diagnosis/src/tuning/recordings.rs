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
        /// Samples of all fitted recordings, at most; of more, every n-th is taken.
        most_samples: usize = 60_000, "samples", Cost("a search simulates some thousand times; parameters from all these samples have 0.4 % of the standard error of one sample");
        /// What that may change in a prediction, in noise standard deviations.
        thinned_error: f64 = 0.1, "noise standard deviations", Statistics("it adds a hundredth to the mean square of the noise");
        /// Samples on which it is tried.
        probe: usize = 20_000, "samples", Cost("two simulations for each try");
        /// Factor by which a parameter that the file states may be off.
        stated_range: f64 = 50.0, "-", Judgement("a wrong unit is a factor of 57 (degrees) and more, and is the audit's");
        /// Factor by which the measured travel may exceed that of the nominal model, for the scales of hypotheses.
        travel: f64 = 4.0, "-", Judgement("more looks like a sensor's offset");
        /// Magnitude beyond which a simulation has run away.
        runaway: f64 = 1e9, "SI units", Numerics("no device is there, and squares are still finite");
        /// Distance of samples from the even grid up to which their times are even but for the digits they are written with.
        rounded_times: f64 = 1e-3, "sample periods", Numerics("seven digits of a time in a recording of some thousand samples");
        /// Steps of the grid on which a recording of an irregular clock is simulated, for each of its samples.
        grid_steps: usize = 4, "steps", Numerics("a cubic through four points of it reads a tenth of the sampling rate to 1e-4");
        /// Recordings in which the error of motions that drive the model is measured.
        driving_records: usize = 2, "recordings", Cost("each takes two simulations, and they say the same");
        /// Distance of single samples from their neighbours above which they are outliers, in ranges of the signal.
        outlier: f64 = 3.0, "ranges", Judgement("no motion leaves its range by three times that and is back two samples later");
        /// Distance of samples from the even grid above which a clock is called uneven.
        jitter: f64 = 0.05, "sample periods", Judgement("a delay of that size is what a diagnosis would find instead");
        /// Share of samples at a signal's two extremes above which it looks clipped.
        clipped: f64 = 0.02, "-", Statistics("a sine has 1.3 % of its samples within 1e-4 of its range from its two ends: 2 arccos(1 - 2e-4) / pi");
        /// Share of samples that differ from the one before below which a signal is a square wave, which is not clipped.
        moving: f64 = 0.3, "-", Judgement("a clipped sine moves for most of the time");
        /// Distance from the grid, in steps, beyond which a sample is off it, and the share of such samples beyond which a signal is.
        off_grid: [f64; 2] = [0.1, 0.2], "steps, -", Judgement("a recording off the grid has 80 % of its samples beyond a tenth of a step");
        /// Difference of an encoder's step from a multiple of the stated one, in stated steps, above which it is remarked.
        grid: f64 = 0.02, "steps", Judgement("data sheets give encoders exactly");
        /// Power in the top quarter of the band over that in the middle below which a signal was low-pass filtered.
        quiet_top: f64 = 1e-4, "-", Judgement("40 dB: noise of a sensor is flat, quantisation nearly");
        /// Noise standard deviation, as a share of the signal, above which it is a caution.
        noisy: f64 = 0.3, "-", Judgement("a tenth of the power");
        /// Squared difference of two excitations, as a share of theirs, below which they are repeats.
        repeated: f64 = 1e-6, "-", Numerics("three digits of a file");
        /// Difference of a period from the one before, over that of those before, above which the device has come to its rhythm.
        settles: f64 = 0.7, "-", Judgement("what the device does not repeat stays as large, what decays falls");
        /// Difference of two repeats, in noise standard deviations, above which the device does not repeat itself.
        repeats: f64 = 3.0, "noise standard deviations", Judgement("two recordings with independent noise differ by 1 in this measure");
        /// Correlation of a command's noise with a sensor's above which a controller closes the loop.
        closed_loop: f64 = 0.5, "-", Statistics("0.1 is two standard errors at 400 samples");
        /// Ratio of sample times in a set above which it is remarked.
        sample_times: f64 = 2.0, "-", Judgement("the faster recording has an octave above the band of the slower one");
        /// Distance, as a factor, of a ratio or factor from that of two units within which it is taken for them.
        unit_near: f64 = 1.3, "-", Judgement("nominal parameters are off by up to that; units are a factor of 2.5 apart at least");
        /// Sample time from which another unit of time is tried.
        slow: f64 = 0.02, "s", Judgement("no force-reflecting device is sampled at less than 50 Hz");
        /// Share of the residual's power that another unit of time has to remove.
        time_unit_removes: f64 = 0.75, "-", Judgement("half of the amplitude");
        /// Correlation of measured and predicted signals from which a factor between them means something.
        unit_correlates: f64 = 0.9, "-", Judgement("a model of another structure is scaled by chance below that");
        /// Factor beyond which a signal is called to be in another unit.
        unit_far: f64 = 20.0, "-", Judgement("no parameter of a data sheet is that wrong");
        /// Factor by which the recordings may differ in it.
        unit_alike: f64 = 1.5, "-", Judgement("a unit is the same in all");
    }
}
