//! How far, how fast and how hard things move: what parameters are measured against.

use crate::recordings::problem::Record;
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_plant::stepper::{CompileError, Options, Plant, Segment, ahead, segments};

/// Root mean square and peak of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Span {
    /// Root mean square over all runs.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
}

/// Typical displacement, speed, acceleration and force at every place of a model, from simulations.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    bodies: usize,
    /// For each pair of places, ground last: displacement (m or rad), speed, acceleration of one against the other.
    motion: Vec<[Span; 3]>,
    /// Force in each element, N or N m.
    elements: Vec<Span>,
    /// Each input, in its unit, and each output.
    inputs: Vec<Span>,
    outputs: Vec<Span>,
    /// Smallest sample time, s.
    pub period: f64,
    /// Longest run, s.
    pub duration: f64,
    /// How many times further things were measured to move than these simulations do, at least 1.
    pub reach: f64,
    /// Whether a force that is read is what drives the device: what is constant in it is then a force of the device, and no offset of a sensor.
    pub reads_drive: bool,
}

/// Sums of squares and peaks on the way to a [`Span`].
#[derive(Clone, Copy, Default)]
struct Sum(f64, f64);

impl Sum {
    fn add(&mut self, x: f64) {
        self.0 += x * x;
        self.1 = self.1.max(x.abs());
    }
    fn span(self, count: usize) -> Span {
        Span { rms: (self.0 / count.max(1) as f64).sqrt(), peak: self.1 }
    }
}

/// What drives a model, for its scales.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// Samples of each input, in the model's order.
    pub inputs: Vec<Vec<f64>>,
    /// Sample time, s.
    pub period: f64,
    /// Bodies that do not start at rest at 0: body, position in m or rad, velocity in m/s or rad/s.
    pub begins: Vec<(usize, f64, f64)>,
}

impl From<&Record> for Run {
    fn from(record: &Record) -> Run {
        Run { inputs: record.inputs.clone(), period: record.period, begins: record.begins.clone() }
    }
}

impl Scales {
    /// Scales of a model on runs.
    ///
    /// Where the model runs away, what came before counts.
    ///
    /// # Errors
    /// When the model cannot be simulated.
    pub fn of(model: &Model, runs: &[Run]) -> Result<Scales, CompileError> {
        let (n, elements) = (model.bodies.len(), model.elements.len());
        let mut motion = vec![[Sum::default(); 3]; (n + 1) * (n + 1)];
        let mut forces = vec![Sum::default(); elements];
        let mut inputs = vec![Sum::default(); model.inputs.len()];
        let mut outputs = vec![Sum::default(); model.outputs.len()];
        let (mut count, mut shortest, mut longest) = (0, f64::INFINITY, 0.0_f64);
        for Run { inputs: columns, period, begins } in runs {
            if let Some(missing) = model.inputs.get(columns.len()) {
                return Err(CompileError::MissingInput(missing.name.clone()));
            }
            let samples = columns.iter().map(Vec::len).min().unwrap_or(0);
            let caught_up = ahead(model, columns, *period);
            let (model, columns) = caught_up.as_ref().map_or((model, columns), |(model, columns)| (model, columns));
            let mut plant = Plant::new(model, *period, &Options::default())?;
            shortest = shortest.min(*period);
            longest = longest.max(samples as f64 * period);
            let driven: Vec<Vec<Segment>> =
                model.inputs.iter().zip(columns).map(|(i, c)| segments(i.hold, &c[..samples], *period)).collect();
            plant.start_at(&columns.iter().map(|c| c.first().copied().unwrap_or(0.0)).collect::<Vec<_>>());
            begins.iter().for_each(|(body, position, velocity)| plant.set_motion(*body, *position, *velocity));
            let mut now = vec![Segment::default(); columns.len()];
            let mut read = vec![0.0; model.outputs.len()];
            for k in 0..samples {
                let at: Vec<[f64; 3]> =
                    (0..=n).map(|b| if b < n { [plant.position(b), plant.velocity(b), plant.acceleration(b)] } else { [0.0; 3] }).collect();
                if at.iter().flatten().any(|x| x.is_nan() || x.abs() > tuning().recordings.runaway) {
                    break;
                }
                for a in 0..=n {
                    for b in a + 1..=n {
                        for d in 0..3 {
                            motion[a * (n + 1) + b][d].add(at[a][d] - at[b][d]);
                        }
                    }
                }
                for (e, sum) in forces.iter_mut().enumerate() {
                    sum.add(plant.element_force(e));
                }
                for ((sum, column), input) in inputs.iter_mut().zip(columns).zip(&model.inputs) {
                    sum.add(input.gain * column[k]);
                }
                plant.outputs(&mut read);
                outputs.iter_mut().zip(&read).for_each(|(sum, y)| sum.add(*y));
                count += 1;
                if k + 1 < samples {
                    now.iter_mut().zip(&driven).for_each(|(s, column)| *s = column.get(k).copied().unwrap_or_default());
                    plant.step(&now);
                }
            }
        }
        let spans = |sums: Vec<Sum>| sums.into_iter().map(|s| s.span(count)).collect::<Vec<Span>>();
        Ok(Scales {
            bodies: n,
            motion: motion.into_iter().map(|m| m.map(|s| s.span(count))).collect(),
            elements: spans(forces),
            inputs: spans(inputs),
            outputs: spans(outputs),
            period: shortest,
            duration: longest,
            reach: 1.0,
            reads_drive: false,
        })
    }

    /// The same where positions were measured: `measured` has the largest magnitude of each output, in the model's order.
    pub fn with_measured(self, model: &Model, measured: &[f64]) -> Scales {
        let positions =
            model.outputs.iter().zip(measured).zip(&self.outputs).filter(|((o, _), _)| matches!(o.kind, OutputKind::Position(_)));
        let ratios = positions.map(|((_, measured), simulated)| measured / simulated.peak).filter(|r| r.is_finite());
        Scales { reach: ratios.fold(1.0, f64::max).min(tuning().recordings.travel), ..self }
    }

    /// Displacement, speed and acceleration of one place against another, ground being `None`.
    pub fn motion(&self, between: [Option<usize>; 2]) -> [Span; 3] {
        let [a, b] = between.map(|end| end.unwrap_or(self.bodies));
        let (a, b) = (a.min(b), a.max(b));
        self.motion.get(a * (self.bodies + 1) + b).copied().unwrap_or_default()
    }

    /// Force in an element.
    pub fn element(&self, index: usize) -> Span {
        self.elements.get(index).copied().unwrap_or_default()
    }

    /// An input behind its gain.
    pub fn input(&self, index: usize) -> Span {
        self.inputs.get(index).copied().unwrap_or_default()
    }

    /// An output.
    pub fn output(&self, index: usize) -> Span {
        self.outputs.get(index).copied().unwrap_or_default()
    }

    /// Reference force of a place, N or N m: the largest rms of the force of its elements, its inputs and its bodies' inertia. It is at least a share of
    /// the largest force anywhere, because a refit without the missing effect may have decoupled the place.
    pub fn force(&self, model: &Model, between: [Option<usize>; 2]) -> f64 {
        let same = |ends: &[Option<usize>; 2]| *ends == between || *ends == [between[1], between[0]];
        let elements = model.elements.iter().enumerate().filter(|(_, e)| same(&e.between)).map(|(i, _)| self.element(i).rms);
        let of_body = |end: &Option<usize>| {
            end.map(|body| {
                let driven = model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Force && i.on == body);
                let attached = model.elements.iter().enumerate().filter(|(_, e)| e.between.contains(&Some(body)));
                let inertial = model.bodies.get(body).map_or(0.0, |b| b.inertia) * self.motion([*end, None])[2].rms;
                driven.map(|(i, _)| self.input(i).rms).chain(attached.map(|(i, _)| self.element(i).rms)).fold(inertial, f64::max)
            })
        };
        let at_bodies = between.iter().filter_map(of_body).fold(f64::INFINITY, f64::min);
        let here = elements.fold(0.0, f64::max).max(if at_bodies.is_finite() { at_bodies } else { 0.0 });
        let largest = self.largest_force(model);
        if here > 0.0 { here.max(tuning().screening.least_force * largest) } else { largest }
    }

    /// Largest force anywhere, N or N m.
    fn largest_force(&self, model: &Model) -> f64 {
        let driven = model.inputs.iter().zip(&self.inputs).filter(|(i, _)| i.kind == InputKind::Force).map(|(_, s)| s.rms);
        self.elements.iter().map(|s| s.rms).chain(driven).fold(0.0, f64::max)
    }
}
