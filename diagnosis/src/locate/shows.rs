//! When, at which frequencies and in which state the residual shows, and which places cannot be separated.

use super::channel::Channel;
use super::classes;
use super::context::Context;
use super::law::Variable;
use super::trajectory::Trajectory;
use super::types::{Candidate, Class, Where};
use crate::tuning::tuning;

impl Context<'_> {
    /// Log-likelihood of the recordings with no unknown anywhere: white noise alone.
    pub(super) fn log_likelihood_without(&self) -> f64 {
        let of = |t: &Trajectory| {
            let column = |(row, r): (&usize, &Vec<f64>)| {
                let noise = self.noise[*row];
                r.iter().map(|r| -0.5 * (r / noise).powi(2) - noise.ln() - 0.5 * std::f64::consts::TAU.ln()).sum::<f64>()
            };
            t.rows.iter().zip(&t.residual).map(column).sum::<f64>()
        };
        self.trajectories.iter().map(of).sum()
    }

    /// Root mean square of the normalised residuals of the nominal model.
    pub(super) fn mismatch(&self) -> f64 {
        let squares = self.trajectories.iter().flat_map(|t| t.rows.iter().zip(&t.residual)).map(|(row, r)| {
            let noise = self.noise[*row];
            (r.iter().map(|r| (r / noise).powi(2)).sum::<f64>(), r.len())
        });
        let (sum, count) = squares.fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        (sum / count.max(1) as f64).sqrt()
    }

    /// Groups places, best first, with those that give the same readings within the noise.
    pub(super) fn classes(&self, ranking: &[Candidate], channels: &[(Channel, usize)]) -> Vec<Class> {
        let Some(trajectory) = self.trajectories.first() else { return Vec::new() };
        let noise: Vec<f64> = trajectory.rows.iter().map(|r| self.noise[*r]).collect();
        let responses = |spectrum: &classes::Spectrum, (channel, order): (Channel, usize)| {
            let equations = self.linearisation.equations(channel, order, &trajectory.rows);
            spectrum.iter().map(|(f, _)| classes::response(&equations, *f)).collect::<Option<Vec<_>>>()
        };
        let mut classes: Vec<Class> = Vec::new();
        // Of each class's first place: the spectrum of its force, and what the outputs make of it.
        let mut firsts = Vec::new();
        for index in 0..ranking.len() {
            let alike = classes.iter().zip(&firsts).position(|(class, (spectrum, own)): (&Class, &(classes::Spectrum, Option<Vec<_>>))| {
                let Some(first) = class.members.first() else { return false };
                if channels[*first].0 == channels[index].0 {
                    return true;
                }
                let (Some(own), Some(other)) = (own, responses(spectrum, channels[index])) else { return false };
                classes::distance(spectrum, own, &other, &noise) < tuning().locate.indistinct
            });
            match alike {
                Some(class) => classes[class].members.push(index),
                None => {
                    let columns: Vec<(&[f64], f64)> = ranking[index].courses.iter().map(|c| (c.force.as_slice(), c.period)).collect();
                    let spectrum = classes::spectrum(&columns);
                    let own = responses(&spectrum, channels[index]);
                    firsts.push((spectrum, own));
                    classes.push(Class { members: vec![index] });
                }
            }
        }
        classes
    }

    /// When, in which band and in which state the residual of the nominal model shows.
    pub(super) fn shows(&self, ranking: &[Candidate]) -> Where {
        let mut columns: Vec<(Vec<f64>, f64)> = Vec::new();
        for t in &self.trajectories {
            columns.extend(t.rows.iter().zip(&t.residual).map(|(row, r)| (r.iter().map(|r| r / self.noise[*row]).collect(), t.period)));
        }
        let borrowed: Vec<(&[f64], f64)> = columns.iter().map(|(c, p)| (c.as_slice(), *p)).collect();
        let mut bands = classes::spectrum(&borrowed);
        bands.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = bands.iter().map(|b| b.1).sum();
        let at_share = |share: f64| {
            let mut sum = 0.0;
            bands.iter().find(|b| {
                sum += b.1;
                sum >= share * all
            })
        };
        let band_hz = [at_share(0.05).map_or(0.0, |b| b.0), at_share(0.95).map_or(0.0, |b| b.0)];
        let state = ranking.first().map_or_else(String::new, describe);
        Where { time: self.spans(), band_hz, state }
    }

    /// Spans that hold four fifths of the power of the residual, where they are at most a third of the time.
    fn spans(&self) -> Vec<[f64; 2]> {
        let Some(longest) = self.trajectories.iter().map(|t| t.len).max() else { return Vec::new() };
        let block = (longest / 100).max(4);
        let mut blocks: Vec<(f64, f64, f64)> = Vec::new();
        for t in &self.trajectories {
            for start in (0..t.len).step_by(block) {
                let end = (start + block).min(t.len);
                let power = |(row, r): (&usize, &Vec<f64>)| r[start..end].iter().map(|r| (r / self.noise[*row]).powi(2)).sum::<f64>();
                let sum = t.rows.iter().zip(&t.residual).map(power).sum::<f64>();
                blocks.push((sum, start as f64 * t.period, end as f64 * t.period));
            }
        }
        let all: f64 = blocks.iter().map(|b| b.0).sum();
        let count = blocks.len();
        blocks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut sum = 0.0;
        let mut chosen: Vec<[f64; 2]> = Vec::new();
        for (power, from, to) in blocks {
            if sum >= 0.8 * all {
                break;
            }
            sum += power;
            chosen.push([from, to]);
        }
        if chosen.len() * 3 > count {
            return Vec::new();
        }
        chosen.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut merged: Vec<[f64; 2]> = Vec::new();
        for span in chosen {
            match merged.last_mut() {
                Some(last) if span[0] <= last[1] => last[1] = last[1].max(span[1]),
                _ => merged.push(span),
            }
        }
        merged
    }
}

/// Where a force shows, in words.
fn describe(candidate: &Candidate) -> String {
    let place = &candidate.place;
    let Some(law) = candidate.laws.first() else { return format!("a force at {place}") };
    let what = match law.variable {
        Variable::Constant => "constantly",
        Variable::Direction => "with the direction of motion, at its reversals",
        Variable::Velocity => "with velocity",
        Variable::Displacement => "with displacement",
        Variable::Acceleration => "with acceleration",
        Variable::DisplacementByDirection => "with displacement, differently in each direction",
        Variable::SinceReversal => "after reversals, over a distance",
        Variable::TimeSinceReversal => "after reversals, over a time",
        Variable::Ripple => "periodically in position",
        Variable::Signal => "with the signal",
        Variable::SignalRate => "with the signal's rate of change",
        Variable::Time => "in time",
    };
    format!("{what}, at {place}")
}
