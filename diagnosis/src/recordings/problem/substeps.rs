//! How many substeps per sample first steps of fits take: as many as the measured motion turns in a sample asks for.

use super::Problem;
use crate::tuning::tuning;

impl Problem {
    /// Substeps per sample of first steps and of screening, at most.
    pub fn coarse_substeps(&self) -> usize {
        tuning().fit.coarse_substeps.max(self.following())
    }

    /// Substeps per sample of fits on their way, at most.
    pub fn middle_substeps(&self) -> usize {
        tuning().fit.middle_substeps.max(2 * self.following())
    }

    /// Substeps in which the motion turns by a part of its period that a law can be stepped over. Its angular frequency is that of its steps from sample to
    /// sample divided by its size, both root mean square and without the noise. It is taken at the output with the largest ratio of signal to noise.
    fn following(&self) -> usize {
        let fit = &tuning().fit;
        let best = (0..self.model.outputs.len()).filter_map(|output| self.turning(output)).max_by(|a, b| a.1.total_cmp(&b.1));
        let angle = best.map_or(0.0, |(angle, _)| angle);
        ((angle / fit.turn).ceil() as usize).clamp(1, fit.following_substeps)
    }

    /// By how much an output turns from sample to sample, rad, and its size over its noise.
    fn turning(&self, output: usize) -> Option<(f64, f64)> {
        let noise = self.noise_sd.get(output)?;
        let (mut steps, mut size, mut count) = (0.0, 0.0, 0.0);
        for samples in self.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()) {
            let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
            size += samples.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>();
            steps += samples.iter().zip(samples.iter().skip(1)).map(|(a, b)| (b - a) * (b - a)).sum::<f64>();
            count += samples.len() as f64;
        }
        let noise = noise * noise * count;
        let (steps, size) = (steps - 2.0 * noise, size - noise);
        (steps > 0.0 && size > 0.0 && noise > 0.0).then(|| ((steps / size).sqrt(), size / noise))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::problem::Record;
    use backdrive_plant::model::Model;
    use backdrive_plant::recording::Recording;
    use backdrive_plant::set::Initial;

    #[test]
    fn a_sine_asks_for_as_many_substeps_as_it_turns() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        // A sine of this many samples in a period.
        let of = |samples: f64| {
            let t: Vec<f64> = (0..3000).map(|i| 1e-3 * f64::from(i)).collect();
            let x: Vec<f64> = (0..3000).map(|i| (std::f64::consts::TAU * f64::from(i) / samples).sin()).collect();
            let signals = vec![("f".to_string(), x.clone()), ("x".to_string(), x)];
            let record = Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap();
            let mut problem =
                Problem::new(text.to_string(), "cart.toml".into(), model.clone(), vec![record], Vec::new(), Initial::Rest).unwrap();
            problem.lag = vec![0];
            (problem.coarse_substeps(), problem.middle_substeps())
        };
        assert_eq!(of(300.0), (1, 2));
        // 0.70 rad in a sample.
        assert_eq!(of(9.0), (2, 4));
        assert_eq!(of(4.1), (4, 8));
    }
}
