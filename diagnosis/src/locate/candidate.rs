//! The force at a place over time, and the laws that it follows.

use super::channel::Channel;
use super::character::Character;
use super::context::Context;
use super::estimate::Estimate;
use super::law::Variable;
use super::period::scan;
use super::regression::Samples;
use super::reversals::Reversals;
use crate::tuning::tuning;
use backdrive_signal::derivative;
use backdrive_signal::statistics::rms;

use super::smoother::Smoothed;
use super::types::{Candidate, Course};
use crate::hypothesis::Place;
use backdrive_plant::model::InputKind;

impl Context<'_> {
    /// The places that a channel stands for: a force on a driven body against ground is an error of the input as well.
    pub(super) fn candidates(&self, estimate: &Estimate) -> Vec<Candidate> {
        let named = |end: Option<usize>| self.model.place_name(end).to_string();
        let signal = |name: &str| Place::Signal(name.to_string());
        let mut places: Vec<(Place, Vec<Vec<f64>>)> = Vec::new();
        match estimate.channel {
            Channel::Force(ends) => {
                places.push((Place::Between(named(ends[0]), named(ends[1])), Vec::new()));
                if let [Some(body), None] | [None, Some(body)] = ends {
                    let driven = self.model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Force && i.on == body);
                    places.extend(
                        driven.map(|(index, i)| (signal(&i.name), self.trajectories.iter().map(|t| t.drive[index].clone()).collect())),
                    );
                }
            }
            Channel::Motion(input) => {
                places.push((signal(&self.model.inputs[input].name), self.trajectories.iter().map(|t| t.drive[input].clone()).collect()));
            }
            Channel::Sensor(output) => {
                let readings = self.trajectories.iter().map(|t| {
                    let row = t.rows.iter().position(|r| *r == output);
                    row.map_or_else(|| vec![0.0; t.len], |row| t.predicted[row].clone())
                });
                places.push((signal(&self.model.outputs[output].name), readings.collect()));
            }
        }
        places.into_iter().filter_map(|(place, signals)| self.candidate(estimate, place, signals)).collect()
    }

    fn courses(&self, estimate: &Estimate, smoothed: &[Smoothed]) -> Vec<Course> {
        let ends = match estimate.channel {
            Channel::Force(ends) => Some(ends),
            Channel::Motion(input) => Some([Some(self.model.inputs[input].on), None]),
            Channel::Sensor(_) => None,
        };
        let one = |(run, smoothed): (usize, &Smoothed)| {
            let trajectory = &self.trajectories[run];
            let (displacement, velocity) = ends.map_or_else(Default::default, |ends| {
                let (x, v) = trajectory.across(ends);
                let (dx, dv) = self.motions(estimate.channel, estimate.order, run, smoothed);
                let add = |of: Vec<f64>, columns: &[Vec<f64>]| {
                    let at = |end: Option<usize>, k: usize| end.map_or(0.0, |b| columns[b][k]);
                    of.iter().enumerate().map(|(k, x)| x + at(ends[0], k) - at(ends[1], k)).collect::<Vec<f64>>()
                };
                (add(x, &dx), add(v, &dv))
            });
            Course {
                run: self.runs[run].name.to_string(),
                period: trajectory.period,
                force: smoothed.value.clone(),
                deviation: smoothed.deviation.clone(),
                displacement,
                velocity,
            }
        };
        smoothed.iter().enumerate().map(one).collect()
    }

    fn samples(&self, courses: &[Course], signals: &[Vec<f64>]) -> Samples {
        let joined = |of: fn(&Course) -> &Vec<f64>| courses.iter().flat_map(|c| of(c).iter().copied()).collect::<Vec<f64>>();
        let rates = |columns: &mut dyn Iterator<Item = (&Vec<f64>, f64)>| {
            columns.flat_map(|(c, period)| derivative(c, period)).collect::<Vec<f64>>()
        };
        let (mut x, mut v) = (joined(|c| &c.displacement), joined(|c| &c.velocity));
        let mut acceleration = rates(&mut courses.iter().map(|c| (&c.velocity, c.period)));
        if !signals.is_empty() {
            // At a signal only what the signal does counts: what moves there is the body's.
            (x, v, acceleration) = (Vec::new(), Vec::new(), Vec::new());
        }
        let mut starts = Vec::new();
        let (mut time, mut run) = (Vec::new(), Vec::new());
        for (index, course) in courses.iter().enumerate() {
            starts.push(time.len());
            time.extend((0..course.force.len()).map(|k| k as f64 * course.period));
            run.extend(std::iter::repeat_n(index, course.force.len()));
        }
        let period = courses.first().map_or(1.0, |c| c.period);
        let reversals = Reversals::of(&x, &starts, period, tuning().locate.turn * rms(&x));
        Samples {
            force: joined(|c| &c.force),
            x,
            v,
            acceleration,
            signal: signals.iter().flatten().copied().collect(),
            signal_rate: rates(&mut signals.iter().zip(courses).map(|(s, c)| (s, c.period))),
            time,
            run,
            reversals,
        }
    }

    fn candidate(&self, estimate: &Estimate, place: Place, signals: Vec<Vec<f64>>) -> Option<Candidate> {
        let courses = self.courses(estimate, &estimate.smoothed);
        let samples = self.samples(&courses, &signals);
        let ripples = scan(&samples.x, &samples.v, &samples.force);
        let mut laws = samples.laws(ripples.first());
        let scales = [self.scales(estimate.channel)[0], self.scales(estimate.channel)[1], estimate.size];
        let runs = self.trajectories.len();
        let systems = (0..runs)
            .map(|run| self.system(estimate.channel, estimate.order, run, scales, estimate.force_error))
            .collect::<Option<Vec<_>>>()?;
        let mut of_forms = [0usize; 3];
        for law in &mut laws {
            // The best of few parameters and the best of many.
            let form = &mut of_forms[law.form as usize];
            if law.held_out_share <= 0.02 || *form >= self.options.laws_of_a_form || law.variable == Variable::Time {
                continue;
            }
            *form += 1;
            let known: Vec<&[f64]> = pieces(&law.fitted, &courses);
            let (_, likelihood) = self.most_likely_intensity(&systems, &estimate.forces, &known, Some(estimate.intensity));
            let remainder: Vec<f64> = samples.force.iter().zip(&law.fitted).map(|(f, g)| f - g).collect();
            let price = 0.5 * law.numbers as f64 * samples.independent(&remainder).max(2.0).ln();
            law.evidence = Some(likelihood - estimate.log_likelihood - price);
        }
        laws.sort_by(|a, b| match (a.evidence, b.evidence) {
            (Some(a), Some(b)) => b.total_cmp(&a),
            (Some(_), None) => std::cmp::Ordering::Less,
            (None, Some(_)) => std::cmp::Ordering::Greater,
            (None, None) => b.held_out_share.total_cmp(&a.held_out_share),
        });
        let gain = laws.first().and_then(|l| l.evidence).unwrap_or(0.0).max(0.0);
        let all: Vec<f64> = courses.iter().flat_map(|c| c.deviation.iter().copied()).collect();
        Some(Candidate {
            place,
            log_likelihood: estimate.log_likelihood,
            jump_gain: None,
            evidence: estimate.log_likelihood + gain,
            rms: rms(&samples.force),
            deviation: rms(&all),
            character: Character::of(&samples, &laws, courses.first().map_or(1.0, |c| c.period)),
            ripples,
            laws,
            courses,
        })
    }

    /// Lets the force of a leading place jump where its motion reverses, and keeps that where the recordings like it better.
    pub(super) fn allow_jumps(&self, candidate: &mut Candidate, estimate: &Estimate) {
        let Channel::Force(_) = estimate.channel else { return };
        if matches!(candidate.place, Place::Signal(_)) {
            return;
        }
        let scales = self.scales(estimate.channel);
        let samples = self.samples(&candidate.courses, &[]);
        let mut offset = 0;
        let mut smoothed = Vec::new();
        let mut before = 0.0;
        for (run, course) in candidate.courses.iter().enumerate() {
            let len = course.force.len();
            let at = samples.reversals.at.iter().filter(|k| (offset..offset + len).contains(*k)).map(|k| k - offset);
            // The turning point is known to a sample or two.
            let jumps: Vec<usize> = at.flat_map(|k| k.saturating_sub(1)..(k + 3).min(len)).collect();
            offset += len;
            let Some(system) = self.system(estimate.channel, estimate.order, run, scales, estimate.force_error) else { return };
            let data = self.data(&estimate.forces, run, &[]);
            let Some(state) = system.smooth(estimate.intensity, data, &jumps, 2.0 * candidate.rms) else { return };
            before += estimate.smoothed[run].log_likelihood;
            smoothed.push(state);
        }
        let gain = smoothed.iter().map(|s| s.log_likelihood).sum::<f64>() - before;
        candidate.jump_gain = Some(gain);
        if gain > 0.0 {
            candidate.courses = self.courses(estimate, &smoothed);
            let all: Vec<f64> = candidate.courses.iter().flat_map(|c| c.deviation.iter().copied()).collect();
            candidate.deviation = rms(&all);
        }
    }
}

/// The parts of a column that belong to each run.
fn pieces<'a>(column: &'a [f64], courses: &[Course]) -> Vec<&'a [f64]> {
    let mut rest = column;
    courses
        .iter()
        .map(|course| {
            let (own, after) = rest.split_at(course.force.len().min(rest.len()));
            rest = after;
            own
        })
        .collect()
}
