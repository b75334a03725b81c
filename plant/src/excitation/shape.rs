//! The kinds of excitation and their parameters.

/// How the frequency of a sweep runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spacing {
    /// As many seconds for each octave.
    #[default]
    Log,
    /// As many seconds for each hertz.
    Linear,
}

/// Which multiples of the inverse period a multisine has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Grid {
    /// All of them.
    #[default]
    Full,
    /// The odd ones: what appears on the even ones is an even nonlinearity of the device.
    Odd,
}

/// The kinds of excitation.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A sine of rising (or falling) frequency.
    Sweep {
        /// Unit of the input.
        amplitude: f64,
        /// Hz at the beginning.
        from: f64,
        /// Hz at the end.
        to: f64,
        /// s.
        duration: f64,
        /// How the frequency runs.
        spacing: Spacing,
        /// The amplitude is multiplied by (frequency/from) to this power: -1 for a displacement of constant speed.
        tilt: f64,
    },
    /// A sum of sines on the lines of a period, with random phases.
    Multisine {
        /// Root mean square, unit of the input; `None` where the peak is given.
        rms: Option<f64>,
        /// Largest magnitude, unit of the input; `None` where the root mean square is given.
        peak: Option<f64>,
        /// Lowest frequency, Hz.
        from: f64,
        /// Highest frequency, Hz.
        to: f64,
        /// s; the lines are multiples of its inverse.
        period: f64,
        /// How many periods of each level.
        periods: u32,
        /// The whole, all its periods, is repeated once for each of these, multiplied by it: one record of several amplitudes.
        levels: Vec<f64>,
        /// Which lines.
        grid: Grid,
        /// Of the phases.
        seed: u64,
        /// Rounds of lowering the peak at the same power, 0 to leave the phases random.
        crest: u32,
    },
    /// Slow ramps between reversals at constant speed: friction, hysteresis and their memory.
    Triangle {
        /// Unit of the input.
        amplitude: f64,
        /// Periods, s, one after the other: several speeds.
        period: Vec<f64>,
        /// Cycles of each period.
        cycles: u32,
        /// Closed inner loops in each rising branch: reversals within reversals.
        nested: u32,
        /// Size of an inner loop over the amplitude.
        inner: f64,
    },
    /// Steps up, back, down and back, for each level.
    Steps {
        /// Levels, unit of the input.
        amplitude: Vec<f64>,
        /// s on each level.
        hold: f64,
        /// s from level to level; 0 for a jump.
        rise: f64,
        /// How often the whole is repeated.
        count: u32,
    },
    /// Half-sine pulses, as the force of a tip that hits something.
    Impacts {
        /// Peaks, unit of the input; negative pushes back.
        amplitude: Vec<f64>,
        /// Length of a pulse, s.
        width: f64,
        /// From pulse to pulse, s.
        interval: f64,
        /// Pulses of each peak.
        count: u32,
        /// Lower pulses behind each, of half the height each, as of a tip that bounces.
        bounces: u32,
    },
    /// Whole cycles of sines, of each frequency at each amplitude.
    Sines {
        /// Unit of the input.
        amplitude: Vec<f64>,
        /// Hz.
        frequency: Vec<f64>,
        /// Cycles of each.
        cycles: u32,
    },
}
