//! What the recordings themselves say, before any physics: their clock, their sensors, and what that limits.

use crate::floor;
use crate::problem::{Problem, Record};
use backdrive_plant::model::{InputKind, OutputKind};
use serde::Serialize;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// Good to know.
    Note,
    /// Limits what can be claimed.
    Caution,
    /// Nothing can be claimed of this signal.
    Unusable,
}

/// A finding about a recording or one of its signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remark {
    /// How much it matters.
    pub weight: Weight,
    /// The recording; empty where it is about all of them.
    pub record: String,
    /// The signal; empty where it is about the clock.
    pub signal: String,
    /// What was looked at: `clock`, `gaps`, `constant`, `encoder`, `filtered`, `saturated`, `sign`, `unit`, `loop`, `repeats`.
    pub about: &'static str,
    /// One sentence.
    pub text: String,
}

/// Distance from the even grid, in sample periods, above which a clock is called uneven.
const JITTER: f64 = 0.05;
/// Share of samples at a signal's two extremes above which it looks clipped.
const CLIPPED: f64 = 0.02;

/// Looks at every recording of a problem, those held out included: nothing here fits anything.
pub fn audit(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for record in problem.fit.iter().chain(&problem.held_out) {
        clock(record, &mut all);
        for (input, samples) in problem.model.inputs.iter().zip(&record.inputs) {
            signal(record, &input.name, samples, &mut all);
            if input.kind == InputKind::Force {
                clipped(record, &input.name, samples, &mut all);
            }
        }
        for (output, samples) in problem.model.outputs.iter().zip(&record.outputs) {
            match samples {
                None => add(&mut all, Weight::Caution, record, &output.name, "missing", "was not recorded".to_string()),
                Some(samples) => {
                    signal(record, &output.name, samples, &mut all);
                    sensor(record, &output.name, output.resolution, samples, &mut all);
                }
            }
        }
    }
    repeats(problem, &mut all);
    closed_loop(problem, &mut all);
    all
}

fn add(all: &mut Vec<Remark>, weight: Weight, record: &Record, signal: &str, about: &'static str, text: String) {
    all.push(Remark { weight, record: record.name.clone(), signal: signal.to_string(), about, text });
}

fn clock(record: &Record, all: &mut Vec<Remark>) {
    let jitter = &record.jitter;
    if jitter.largest > JITTER * record.period {
        let text = format!(
            "the clock is off its grid by {:.1} % of a sample rms and {:.0} % at worst; delays below that are not claimed",
            100.0 * jitter.rms / record.period,
            100.0 * jitter.largest / record.period
        );
        add(all, Weight::Caution, record, "", "clock", text);
    }
    if !jitter.gaps.is_empty() {
        let missing: usize = jitter.gaps.iter().map(|g| g.missing).sum();
        let text = format!("{missing} samples are missing in {} gaps, the first after {:.4} s", jitter.gaps.len(), jitter.gaps[0].after);
        add(all, Weight::Caution, record, "", "gaps", text);
    }
}

fn signal(record: &Record, name: &str, samples: &[f64], all: &mut Vec<Remark>) {
    let (low, high) = extremes(samples);
    if high <= low {
        add(all, Weight::Unusable, record, name, "constant", format!("is {low} throughout"));
    }
}

fn extremes(samples: &[f64]) -> (f64, f64) {
    samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

/// Samples that stay at an extreme for longer than a smooth turn would.
fn clipped(record: &Record, name: &str, samples: &[f64], all: &mut Vec<Remark>) {
    let (low, high) = extremes(samples);
    let near = 1e-4 * (high - low);
    let moving = samples.windows(2).filter(|w| (w[1] - w[0]).abs() > near).count() as f64 / samples.len() as f64;
    let share = |x: f64| samples.iter().filter(|s| (**s - x).abs() < near).count() as f64 / samples.len() as f64;
    let (at_low, at_high) = (share(low), share(high));
    // A square wave is at its extremes all of the time and does not count.
    if at_low.max(at_high) > CLIPPED && moving > 0.3 {
        let text = format!("stays at {low:.4} or {high:.4} for {:.0} % of the time: its source may be limited", 100.0 * (at_low + at_high));
        add(all, Weight::Note, record, name, "saturated", text);
    }
}

fn sensor(record: &Record, name: &str, stated: f64, samples: &[f64], all: &mut Vec<Remark>) {
    match floor::step_of(samples) {
        Some(step) if stated > 0.0 && ((step / stated) - (step / stated).round()).abs() > 0.02 => {
            let text = format!("moves in steps of {step:.4e}, the model says {stated:.4e}");
            add(all, Weight::Caution, record, name, "encoder", text);
        }
        Some(step) if stated == 0.0 => add(all, Weight::Note, record, name, "encoder", format!("moves in steps of {step:.4e}")),
        Some(_) => {}
        None => {
            if stated > 0.0 && off_grid(samples, stated) {
                let text =
                    format!("is not on the grid of {stated:.4e} that the model says: it was filtered or converted before it was recorded");
                add(all, Weight::Caution, record, name, "filtered", text);
            }
            if let Some(share) = quiet_top(samples)
                && share < 1e-4
            {
                let text = "has nothing in the upper half of its band, not even noise: it was low-pass filtered before it was recorded"
                    .to_string();
                add(all, Weight::Caution, record, name, "filtered", text);
            }
        }
    }
}

/// Whether samples lie anywhere between the steps of a grid.
fn off_grid(samples: &[f64], step: f64) -> bool {
    let (low, high) = extremes(samples);
    // Seven digits of a file blur fine grids.
    if 1e-6 * low.abs().max(high.abs()) > 0.05 * step {
        return false;
    }
    let off = samples.iter().filter(|x| ((*x / step) - (*x / step).round()).abs() > 0.1).count();
    off as f64 > 0.2 * samples.len() as f64
}

/// Power above three quarters of the Nyquist frequency over that of a floor of white noise at the level of the quarter below it;
/// `None` for short signals. A sensor's own noise reaches up to the end.
fn quiet_top(samples: &[f64]) -> Option<f64> {
    if samples.len() < 256 {
        return None;
    }
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(samples.len());
    let n = samples.len() as f64;
    // A window, or the ends' step would fill the band.
    let mut input: Vec<f64> =
        samples.iter().enumerate().map(|(i, x)| x * (std::f64::consts::PI * (i as f64 + 0.5) / n).sin().powi(4)).collect();
    let mut output = transform.make_output_vec();
    transform.process(&mut input, &mut output).ok()?;
    let power: Vec<f64> = output.iter().map(|c| c.norm_sqr()).collect();
    let mean = |from: f64, to: f64| {
        let range = (from * power.len() as f64) as usize..(to * power.len() as f64) as usize;
        let part = power.get(range).unwrap_or(&[]);
        part.iter().sum::<f64>() / part.len().max(1) as f64
    };
    let (middle, top) = (mean(0.25, 0.5), mean(0.75, 1.0));
    (middle > 0.0).then(|| top / middle)
}

/// Recordings of the same excitation: how well the device repeats itself.
fn repeats(problem: &Problem, all: &mut Vec<Remark>) {
    for (i, a) in problem.fit.iter().enumerate() {
        for b in &problem.fit[..i] {
            let same = a.len == b.len
                && a.inputs.iter().zip(&b.inputs).all(|(x, y)| {
                    let spread = x.iter().map(|x| x * x).sum::<f64>();
                    let apart = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>();
                    spread > 0.0 && apart < 1e-6 * spread
                });
            if !same {
                continue;
            }
            for (o, output) in problem.model.outputs.iter().enumerate() {
                let (Some(Some(x)), Some(Some(y))) = (a.outputs.get(o), b.outputs.get(o)) else { continue };
                let apart = (x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / (2 * x.len()) as f64).sqrt();
                let weight = if apart > 3.0 * problem.floor[o] { Weight::Caution } else { Weight::Note };
                let text =
                    format!("repeats {} to {apart:.3e}, {:.1} noise floors: no model can do better", b.name, apart / problem.floor[o]);
                add(all, weight, a, &output.name, "repeats", text);
            }
        }
    }
}

/// Whether a force answers what is measured: noise of the output then shows in the input one sample later.
fn closed_loop(problem: &Problem, all: &mut Vec<Remark>) {
    for record in &problem.fit {
        for (input, u) in problem.model.inputs.iter().zip(&record.inputs).filter(|(i, _)| i.kind == InputKind::Force) {
            for (output, y) in problem.model.outputs.iter().zip(&record.outputs) {
                let Some(y) = y else { continue };
                if !matches!(output.kind, OutputKind::Position(_) | OutputKind::Velocity(_)) {
                    continue;
                }
                let found = answers(u, y);
                if found > 0.5 {
                    let text = format!(
                        "follows the noise of {} (correlation {found:.2}): a controller closes the loop, and what it hides is looked for in the force",
                        output.name
                    );
                    add(all, Weight::Note, record, &input.name, "loop", text);
                }
            }
        }
    }
}

/// Largest correlation of the finest grain of `u` with that of `y` at the same sample or up to two samples before.
fn answers(u: &[f64], y: &[f64]) -> f64 {
    let grain = |x: &[f64]| -> Vec<f64> { x.windows(5).map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).collect() };
    let (a, b) = (grain(u), grain(y));
    let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let norm = size(&a) * size(&b);
    if norm <= 0.0 {
        return 0.0;
    }
    (0..=2).map(|lag| a.iter().skip(lag).zip(&b).map(|(x, y)| x * y).sum::<f64>().abs() / norm).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn a_force_that_answers_a_measured_noise_is_seen() {
        let e = noise(4000, 1);
        let y: Vec<f64> = e.iter().enumerate().map(|(i, e)| (i as f64 * 0.01).sin() + 0.01 * e).collect();
        let answer: Vec<f64> = y.iter().enumerate().map(|(i, y)| (i as f64 * 0.013).cos() - 50.0 * y).collect();
        let free: Vec<f64> = noise(4000, 2).iter().enumerate().map(|(i, e)| (i as f64 * 0.013).cos() + 0.1 * e).collect();
        assert!(answers(&answer, &y) > 0.9);
        assert!(answers(&free, &y) < 0.1);
    }

    #[test]
    fn a_filtered_signal_has_a_quiet_top() {
        let white: Vec<f64> = noise(4096, 3);
        assert!(quiet_top(&white).unwrap() > 0.5);
        let mut filtered = white.clone();
        for _ in 0..4 {
            let mut state = 0.0;
            for x in &mut filtered {
                state += 0.2 * (*x - state);
                *x = state;
            }
        }
        // Four poles at a fifth: well down, but not to nothing as a brick wall.
        assert!(quiet_top(&filtered).unwrap() < 0.2);
    }
}
