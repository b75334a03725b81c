//! A high-pass, one value per step.

/// First-order high-pass, the bilinear image of s / (s + 2 pi corner).
#[derive(Debug, Clone, Copy)]
pub(crate) struct HighPass {
    feed: f64,
    keep: f64,
    input: f64,
    output: f64,
}

impl HighPass {
    pub(crate) fn new(corner_hz: f64, period_s: f64) -> HighPass {
        let warped = (std::f64::consts::PI * corner_hz * period_s).min(1.5).tan();
        HighPass { feed: 1.0 / (1.0 + warped), keep: (1.0 - warped) / (1.0 + warped), input: 0.0, output: 0.0 }
    }

    pub(crate) fn step(&mut self, value: f64) -> f64 {
        self.output = self.keep * self.output + self.feed * (value - self.input);
        self.input = value;
        self.output
    }
}

/// The same of third order: three of first order in a row. It takes a slow intent of the hand out of a position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steep([HighPass; 3]);

impl Steep {
    pub(crate) fn new(corner_hz: f64, period_s: f64) -> Steep {
        Steep([HighPass::new(corner_hz, period_s); 3])
    }

    pub(crate) fn step(&mut self, value: f64) -> f64 {
        self.0.iter_mut().fold(value, |x, filter| filter.step(x))
    }
}
