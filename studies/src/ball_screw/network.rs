//! The paper's network, eqs (14)-(16): two inputs, 50 hidden neurons (a digit of that number may be lost), one output, all sigmoids,
//! trained by error back propagation.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const HIDDEN: usize = 50;

/// Weights; the last input of each layer is 1.
pub(super) struct Network {
    hidden: Vec<[f64; 3]>,
    output: Vec<f64>,
}

fn sigmoid(net: f64) -> f64 {
    1.0 / (1.0 + (-net).exp())
}

impl Network {
    pub fn new(seed: u64) -> Network {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut weight = |scale: f64| scale * (2.0 * rng.random::<f64>() - 1.0);
        Network {
            hidden: (0..HIDDEN).map(|_| [weight(4.0), weight(4.0), weight(2.0)]).collect(),
            output: (0..=HIDDEN).map(|_| weight(0.3)).collect(),
        }
    }

    fn layers(&self, input: [f64; 2]) -> ([f64; HIDDEN], f64) {
        let mut hidden = [0.0; HIDDEN];
        for (o, w) in hidden.iter_mut().zip(&self.hidden) {
            *o = sigmoid(w[0] * input[0] + w[1] * input[1] + w[2]);
        }
        let net = self.output[HIDDEN] + hidden.iter().zip(&self.output).map(|(o, w)| o * w).sum::<f64>();
        (hidden, sigmoid(net))
    }

    /// Output for two inputs of about -1 to 1: 0 to 1.
    pub fn value(&self, input: [f64; 2]) -> f64 {
        self.layers(input).1
    }

    /// One pattern: W(t+1) = W(t) + η δ O, with δ = (target - O) O (1 - O) at the output and eq (15) behind it.
    pub fn learn(&mut self, input: [f64; 2], target: f64, rate: f64) {
        let (hidden, output) = self.layers(input);
        let delta = (target - output) * output * (1.0 - output);
        for (k, o) in hidden.iter().enumerate() {
            let delta_hidden = o * (1.0 - o) * delta * self.output[k];
            self.output[k] += rate * delta * o;
            for (w, i) in self.hidden[k].iter_mut().zip([input[0], input[1], 1.0]) {
                *w += rate * delta_hidden * i;
            }
        }
        self.output[HIDDEN] += rate * delta;
    }

    /// Epochs over all patterns in random order.
    pub fn train(&mut self, patterns: &[([f64; 2], f64)], epochs: usize, seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for epoch in 0..epochs {
            // Slower towards the end, so that it settles.
            let rate = 0.5 * (1.0 - 0.9 * epoch as f64 / epochs as f64);
            for _ in 0..patterns.len() {
                if let Some((input, target)) = patterns.get(rng.random_range(0..patterns.len())) {
                    self.learn(*input, *target, rate);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn learning_goes_down_the_gradient() {
        let (input, target) = ([0.3, -0.6], 0.8);
        let loss = |n: &Network| 0.5 * (target - n.value(input)).powi(2);
        let base = Network::new(1);
        let mut learnt = Network::new(1);
        let rate = 1e-6;
        learnt.learn(input, target, rate);
        for k in [0, 7, 49] {
            for i in 0..3 {
                let mut bumped = Network::new(1);
                bumped.hidden[k][i] += 1e-6;
                let slope = (loss(&bumped) - loss(&base)) / 1e-6;
                assert!(((learnt.hidden[k][i] - base.hidden[k][i]) / rate + slope).abs() < 1e-5);
            }
            let mut bumped = Network::new(1);
            bumped.output[k] += 1e-6;
            assert!(((learnt.output[k] - base.output[k]) / rate + (loss(&bumped) - loss(&base)) / 1e-6).abs() < 1e-5);
        }
    }
}
