//! What is to be drawn.

/// What is to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawOptions {
    /// How many effects, 0 to 3.
    pub effects: usize,
    /// Whether only effects that no linear model can imitate are drawn.
    pub nonlinear_only: bool,
    /// Per cent, 0 to 50, by which nominal parameters are wrong at most. With effects, those near one are wrong in the direction in which a fit
    /// without it would have moved them; without effects, any of them in any direction.
    pub masked_percent: f64,
    /// Per cent, 0 to 50, by which the grip's stiffness and damping differ from the nominal ones at most.
    pub grip_percent: f64,
    /// Encoder step of every output as a share of its range under the working force, at most; 0 leaves the model's own.
    pub encoder_share: f64,
    /// Standard deviation of the noise of every output as a share of its range under the working force, at most.
    pub noise_share: f64,
    /// N, amplitude of the force in use.
    pub working_force_n: f64,
    /// m, amplitude of a moved body in use.
    pub working_motion_m: f64,
    /// s, sampling period of the graph.
    pub period_s: f64,
}

impl Default for DrawOptions {
    /// One effect of any kind; parameters wrong by up to 15 %, a grip by up to 20 %. Encoder steps of up to 1/5000 and noise of up to 1/1000 of the
    /// range; a contact task of 3 N and 5 mm at 5 kHz.
    fn default() -> DrawOptions {
        DrawOptions {
            effects: 1,
            nonlinear_only: false,
            masked_percent: 15.0,
            grip_percent: 20.0,
            encoder_share: 2e-4,
            noise_share: 1e-3,
            working_force_n: 3.0,
            working_motion_m: 5e-3,
            period_s: 2e-4,
        }
    }
}
