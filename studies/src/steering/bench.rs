//! The rig: the node of `launch/steering-rig.toml` with another specimen, run in one thread, and the admittance from what it recorded.

use super::device::Compensator;
use crate::StudyError;
use backdrive_msgs::Message;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use backdrive_nodes::sequence::Sequence;
use backdrive_plant::correlation::{admittance, fundamental};
use backdrive_plant::excitation::{Excitation, Shape};
use backdrive_plant::linear::log_frequencies;
use nalgebra::Complex;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::path::Path;

/// Frequencies of the paper, Hz: 33 from 0.1 to 35, evenly spaced in their logarithm; 3.24, 8.09, 20.21 and 24.27 are among them.
pub fn grid() -> Vec<f64> {
    log_frequencies(0.1, 35.0, 33)
}

/// Demanded stroke at a frequency (Hz), m: `scale` times 10 mm where the speed stays below 60 mm/s, then 60 mm/s, and never below 1 mm. The paper's
/// are lost (L).
pub fn stroke(frequency_hz: f64, scale: f64) -> f64 {
    scale * (0.06 / (TAU * frequency_hz)).clamp(1e-3, 10e-3)
}

/// Time that is not measured, for what the start of a sine sets off, s.
pub const SETTLE_S: f64 = 0.7;

/// Cycles that are measured.
pub fn cycles(frequency_hz: f64) -> usize {
    (0.5 * frequency_hz).ceil().max(1.0) as usize
}

/// What the rig recorded at one frequency, the measured cycles only.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Hz.
    pub frequency_hz: f64,
    /// Time between samples, s.
    pub period_s: f64,
    /// Demanded displacement, m.
    pub demand: Vec<f64>,
    /// Displacement of the ram, m.
    pub displacement: Vec<f64>,
    /// Velocity of the ram, m/s.
    pub velocity: Vec<f64>,
    /// Force of the ram on the specimen, N.
    pub force: Vec<f64>,
}

/// The estimates at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Hz.
    pub frequency_hz: f64,
    /// Amplitude of the ram's displacement, m.
    pub amplitude: f64,
    /// The ram's displacement over the demand.
    pub tracking: Complex<f64>,
    /// F/(s x), N s/m.
    pub admittance: Complex<f64>,
}

/// A specimen's admittance over the grid, at strokes of one scale.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Index into the oils.
    pub oil: usize,
    /// In rising frequency.
    pub points: Vec<Point>,
}

impl Recorded {
    /// The paper's way: gain and phase from the demand to displacement and to force by correlation, and the admittance from this pair.
    pub fn point(&self) -> Option<Point> {
        let phasor = |samples: &[f64]| fundamental(samples, self.frequency_hz, self.period_s);
        let (demand, displacement, force) = (phasor(&self.demand)?, phasor(&self.displacement)?, phasor(&self.force)?);
        let (tracking, answer) = (displacement / demand, force / demand);
        let amplitude = displacement.norm();
        Some(Point { frequency_hz: self.frequency_hz, amplitude, tracking, admittance: admittance(answer, tracking, self.frequency_hz) })
    }
}

/// The rig of the launch file.
pub struct Bench {
    graph: Graph,
}

impl Bench {
    /// Reads `launch/steering-rig.toml`.
    ///
    /// # Errors
    /// When the file, or one that it names, is missing or wrong.
    pub fn load() -> Result<Bench, StudyError> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/steering-rig.toml");
        Ok(Bench { graph: Graph::load(&path, &Overrides::default())? })
    }

    /// Moves a device with an oil by one sine of a demanded amplitude, m.
    ///
    /// # Errors
    /// When the rig cannot be built with it.
    pub fn record(&self, device: &Compensator, oil: usize, frequency_hz: f64, amplitude: f64) -> Result<Recorded, StudyError> {
        let mut graph = self.graph.clone();
        let rate = graph.timing.rate_hz;
        let measured = cycles(frequency_hz);
        let before = (SETTLE_S * frequency_hz).ceil() as usize;
        let shape = Shape::Sines { amplitude: vec![amplitude], frequency: vec![frequency_hz], cycles: (before + measured) as u32 };
        let samples = Excitation::of(shape).samples(rate).map_err(|e| StudyError::File(format!("sine of {frequency_hz} Hz: {e}")))?;
        let steps = ((before + measured) as f64 / frequency_hz * rate).floor() as usize;
        graph.timing.steps = Some(steps as u64);
        // Each run has a noise of its own.
        graph.seed = (1e6 * frequency_hz) as u64 + oil as u64;
        for node in graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Rig) {
            if let Settings::Rig(files, _, demand) = &mut node.settings {
                files.fragment = Some(device.fragment(oil));
                *demand = vec![samples.clone()];
            }
        }
        let failed = |e: String| StudyError::File(format!("{}: {e}", graph.path.display()));
        let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(&graph, &n.name));
        let plans = plans.collect::<Result<_, _>>().map_err(|e| failed(e.to_string()))?;
        let mut sequence = Sequence::new(plans, &graph.timing).map_err(|e| failed(e.to_string()))?;
        let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
        let skip = steps - ((measured as f64 / frequency_hz * rate).floor() as usize).min(steps);
        let empty = Vec::with_capacity(steps - skip);
        let mut found = Recorded {
            frequency_hz,
            period_s: 1.0 / rate,
            demand: empty.clone(),
            displacement: empty.clone(),
            velocity: empty.clone(),
            force: empty,
        };
        let mut take = |topic: usize, message: &Message| {
            let Message::Sample(sample) = message else { return };
            if (sample.step as usize) < skip {
                return;
            }
            match names[topic].as_str() {
                "/rig/setpoint_jp" => found.demand.push(sample.position[0]),
                "/rig/measured_js" => {
                    found.displacement.push(sample.position[0]);
                    found.velocity.push(sample.velocity[0]);
                    found.force.push(sample.effort[0]);
                }
                _ => {}
            }
        };
        sequence.run(steps as u64, Some(&mut take));
        Ok(found)
    }

    /// The admittance of a device with an oil at strokes of a scale, over these frequencies.
    ///
    /// # Errors
    /// As [`Bench::record`], or when a run gives no estimate.
    pub fn curve(&self, device: &Compensator, oil: usize, scale: f64, frequencies: &[f64]) -> Result<Curve, StudyError> {
        let one = |f: &f64| {
            let recorded = self.record(device, oil, *f, stroke(*f, scale))?;
            recorded.point().ok_or_else(|| StudyError::File(format!("no estimate at {f} Hz: the run did not stay finite")))
        };
        Ok(Curve { oil, points: frequencies.par_iter().map(one).collect::<Result<_, _>>()? })
    }

    /// The curves of all oils.
    ///
    /// # Errors
    /// As [`Bench::curve`].
    pub fn curves(&self, device: &Compensator, scale: f64, frequencies: &[f64]) -> Result<Vec<Curve>, StudyError> {
        (0..4).map(|oil| self.curve(device, oil, scale, frequencies)).collect()
    }
}
