//! Every experiment that may be chosen, simulated with each rival, and how well each separates them.

use super::menu::{Choice, InputRange, choices};
use super::rivals::Rival;
use super::sensor;
use super::setup::{Sensors, Setup, Trial};
use super::types::{Experiment, Reason, repeats};
use super::words::{self, short};
use crate::output_error::structure::Structure;
use crate::output_error::work::{Budget, Steps};
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_plant::write::round_significant;
use rayon::prelude::*;

/// Whether no recording can tell two structures apart.
pub(super) fn same(a: &Structure, b: &Structure) -> bool {
    let classes = |s: &Structure| {
        let mut all: Vec<String> = s.added.iter().map(|h| h.class.clone()).collect();
        all.sort();
        all
    };
    classes(a) == classes(b)
}

/// Two rivals, by their index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub a: usize,
    pub b: usize,
    /// Whether only the first has to fail to imitate the second, which contains it.
    pub directed: bool,
    /// Least separation at which an experiment decides between them, standard deviations in one run of the excitation.
    pub least: f64,
}

/// An experiment with what each rival predicts for it.
pub(super) struct Case {
    pub trial: Trial,
    /// Of each rival, in noise standard deviations.
    pub predictions: Vec<Vec<f64>>,
}

/// How well a case, by its index, separates each pair of rivals, standard deviations.
pub(super) struct Evaluated {
    pub case: usize,
    pub pairs: Vec<(Pair, f64)>,
}

impl Evaluated {
    pub(super) fn of(&self, pair: Pair) -> f64 {
        self.pairs.iter().find(|p| p.0 == pair).map_or(0.0, |p| p.1)
    }

    /// Squared separation of the worst of some pairs per second.
    pub(super) fn score(&self, pairs: &[Pair], cases: &[Case]) -> f64 {
        let worst = pairs.iter().map(|p| self.of(*p)).fold(f64::INFINITY, f64::min);
        worst * worst / (cases[self.case].trial.seconds() + tuning().experiment.setting_up)
    }
}

impl Trial {
    /// Its length, s.
    pub(super) fn seconds(&self) -> f64 {
        self.record.len as f64 * self.record.period
    }
}

/// A problem with the recorded ranges of its inputs.
pub(super) struct Planner<'a> {
    pub setup: Setup<'a>,
    ranges: Vec<Option<InputRange>>,
    rate_hz: f64,
    longest: f64,
    /// Counts at which simulating, and evaluating, come to an end.
    ends: (Steps, Steps),
}

impl<'a> Planner<'a> {
    pub(super) fn new(problem: &'a Problem, noise_sd: &[f64], budget: &Budget<'a>) -> Result<Planner<'a>, Reason> {
        let ranges: Vec<Option<InputRange>> = (0..problem.model.inputs.len()).map(|i| InputRange::of(problem, i)).collect();
        let lengths = problem.fit.iter().map(|r| (r.len as f64 * r.period, r.period));
        let longest = lengths.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((longest, period)) = longest.filter(|_| ranges.iter().any(Option::is_some)) else {
            return Err(Reason("no input moves in any recording, so no excitation can be planned".to_string()));
        };
        let end = |share: f64| budget.spent() + (share * budget.left() as f64) as Steps;
        let ends = (end(tuning().experiment.shares[0]), end(tuning().experiment.shares[1]));
        let setup = Setup {
            problem,
            sensors: Sensors::of(problem, noise_sd),
            extra: Vec::new(),
            substeps: tuning().experiment.substeps[0],
            budget: budget.clone(),
        };
        Ok(Planner { setup, ranges, rate_hz: round_significant(1.0 / period, 6), longest, ends })
    }

    /// Every excitation on which all rivals can be simulated, within the recorded ranges.
    pub(super) fn cases(&self, rivals: &[Rival]) -> Vec<Case> {
        let choices = choices(self.setup.problem, &self.ranges, 1.0 / self.rate_hz, self.longest);
        let one = |budget: &Budget<'a>, choice: &Choice| {
            let setup = self.setup.within(budget);
            let mut trial = setup.trial(choice, &self.ranges, self.rate_hz)?;
            let far = |trial: &Trial| rivals.first().and_then(|rival| rival.excursion(&setup, trial));
            let reached = far(&trial)?;
            if reached > tuning().experiment.reach {
                trial = setup.smaller(&trial, 0.9 * tuning().experiment.reach / reached, &self.ranges, self.rate_hz)?;
                far(&trial).filter(|reached| *reached <= 1.1 * tuning().experiment.reach)?;
            }
            let predictions = rivals.iter().map(|r| r.prediction(&setup, &trial)).collect::<Option<Vec<_>>>()?;
            Some(Case { trial, predictions })
        };
        self.setup.budget.until(self.ends.0).abreast(&choices, one).into_iter().flatten().flatten().collect()
    }

    /// How well experiments separate the rivals, to first order in their parameters. An experiment whose difference of predictions is smaller than what
    /// another separates is not evaluated. Sorts `cases` by that difference, largest first.
    pub(super) fn evaluate(&self, rivals: &[Rival], cases: &mut [Case], pairs: &[Pair]) -> Vec<Evaluated> {
        let potential = |case: &Case| {
            let one = |p: &Pair| {
                let difference: f64 = case.predictions[p.a].iter().zip(&case.predictions[p.b]).map(|(x, y)| (x - y).powi(2)).sum();
                difference / rivals[p.a].unit.max(rivals[p.b].unit)
            };
            pairs.iter().map(one).fold(f64::INFINITY, f64::min) / (case.trial.seconds() + tuning().experiment.setting_up)
        };
        cases.sort_by(|a, b| potential(b).total_cmp(&potential(a)));
        let mut all: Vec<Evaluated> = Vec::new();
        let mut at = 0;
        while at < cases.len() && (at == 0 || self.setup.budget.spent() < self.ends.1) {
            let best = all.iter().filter(|e| e.pairs.iter().all(|p| p.1 >= p.0.least)).map(|e| e.score(pairs, cases)).fold(0.0, f64::max);
            if pairs.is_empty() || potential(&cases[at]) < best {
                break;
            }
            let next: Vec<usize> = (at..cases.len().min(at + 4)).collect();
            at += next.len();
            all.par_extend(next.par_iter().map(|s| {
                let case = &cases[*s];
                let one = |(r, rival): (usize, &Rival)| rival.jacobian(&self.setup, &case.trial, &rival.own, &case.predictions[r]);
                let jacobians: Vec<Vec<Vec<f64>>> = rivals.par_iter().enumerate().map(one).collect();
                let left = |Pair { a, b, directed, .. }: Pair| {
                    let difference: Vec<f64> = case.predictions[b].iter().zip(&case.predictions[a]).map(|(x, y)| x - y).collect();
                    let one = rivals[a].unexplained(&jacobians[a], &difference);
                    if directed { one } else { one.min(rivals[b].unexplained(&jacobians[b], &difference)) }
                };
                let sd = |p: &Pair| (*p, (left(*p) / rivals[p.a].unit.max(rivals[p.b].unit)).sqrt());
                Evaluated { case: *s, pairs: pairs.iter().map(sd).collect() }
            }));
        }
        all
    }

    /// The experiment with a further sensor that separates two rivals which no excitation does.
    ///
    /// # Errors
    /// Why they cannot be separated, where no sensor would.
    pub(super) fn with_sensor(
        &self,
        rivals: &[Rival],
        cases: &[Case],
        Pair { a, b, directed, .. }: Pair,
        reached: f64,
    ) -> Result<Experiment, Reason> {
        let (a, b) = (&rivals[a], &rivals[b]);
        let [one, other] = words::names(a.structure, b.structure);
        let mut said = format!("No excitation separates {one} and {other} with the present sensors");
        if same(a.structure, b.structure) {
            said.push_str(&format!(": {}", words::same_force(a.structure, b.structure)));
        } else {
            said.push_str(&format!(" (at most {} standard deviations)", short(reached)));
        }
        // Some of the excitations, from the longest on.
        let mut all: Vec<&Case> = cases.iter().collect();
        all.sort_by(|x, y| y.trial.seconds().total_cmp(&x.trial.seconds()));
        let spread: Vec<&Case> = all.iter().step_by((all.len() / 4).max(1)).take(4).copied().collect();
        let trials: Vec<&Trial> = spread.iter().map(|c| &c.trial).collect();
        let best = if directed { None } else { sensor::best(&self.setup, &trials, [a, b]) };
        let Some((sensor, case)) =
            best.filter(|s| s.separation >= tuning().experiment.wanted).and_then(|s| Some((s.clone(), *spread.get(s.trial)?)))
        else {
            if !directed {
                said.push_str("; an additional sensor of position, velocity or element force does not help");
            }
            return Err(Reason(format!("{said}.")));
        };
        said.push_str(&format!(
            "; measuring {} as well would ({} standard deviations with {}).",
            sensor.words,
            short(sensor.separation),
            words::described(&self.setup.problem.model, &case.trial)
        ));
        let difference: Vec<f64> = Vec::new();
        let between = rivals.iter().map(|r| r.structure.name()).collect();
        let level = sensor.separation * (a.unit.max(b.unit) / case.trial.record.len.max(1) as f64).sqrt();
        let plan = self.experiment(case, said, between, sensor.separation, &difference, level);
        Ok(Experiment {
            output: sensor.new.of.clone().or_else(|| sensor.new.element.clone()).unwrap_or_default(),
            sensor: Some(sensor.new),
            ..plan
        })
    }

    /// The experiment that separates a pair best; `inseparable` is a pair that it does not.
    pub(super) fn separating(
        &self,
        rivals: &[Rival],
        case: &Case,
        Pair { a, b, directed, .. }: Pair,
        separation: f64,
        inseparable: Option<Pair>,
    ) -> Experiment {
        let difference: Vec<f64> = case.predictions[a].iter().zip(&case.predictions[b]).map(|(x, y)| x - y).collect();
        let unit = rivals[a].unit.max(rivals[b].unit);
        let level = separation * (unit / difference.len().max(1) as f64).sqrt();
        let [one, other] = words::names(rivals[a].structure, rivals[b].structure);
        let output = self.most(case, &difference);
        let repeats = repeats(separation);
        let again = if repeats > 1 { format!(", {repeats} times") } else { String::new() };
        let mut sentence = format!(
            "Play {}{again}: the predictions of {one} and {other} then differ by {} standard deviations ({} noise standard deviations \
                rms, mostly in {output}), {}",
            words::described(&self.setup.problem.model, &case.trial),
            short(separation * f64::from(repeats).sqrt()),
            short(level),
            if directed { "the simpler one refitted to it" } else { "each refitted to it" }
        );
        if let Some(why) = words::separator(rivals[a].structure, rivals[b].structure) {
            sentence.push_str(&format!("; {why}"));
        }
        sentence.push('.');
        if let Some(Pair { a: c, b: d, .. }) = inseparable {
            let [one, other] = words::names(rivals[c].structure, rivals[d].structure);
            sentence.push_str(&format!(" It does not separate {one} and {other}."));
        }
        let between = rivals.iter().map(|r| r.structure.name()).collect();
        self.experiment(case, sentence, between, separation, &difference, level)
    }

    /// The output with the largest share of a change, which is in noise standard deviations.
    fn most(&self, case: &Case, change: &[f64]) -> String {
        let size = |column: &[f64]| column.iter().map(|x| x * x).sum::<f64>();
        let columns = change.chunks_exact(case.trial.record.len.max(1)).zip(self.setup.outputs(&case.trial.record));
        let most = columns.max_by(|a, b| size(a.0).total_cmp(&size(b.0)));
        most.and_then(|(_, o)| self.setup.problem.model.outputs.get(o)).map_or_else(String::new, |o| o.name.clone())
    }

    pub(super) fn experiment(
        &self,
        case: &Case,
        sentence: String,
        between: Vec<String>,
        separation: f64,
        change: &[f64],
        level: f64,
    ) -> Experiment {
        let model = &self.setup.problem.model;
        Experiment {
            input: model.inputs.get(case.trial.choice.input).map_or_else(String::new, |i| i.name.clone()),
            text: words::file(model, &case.trial, "next", &sentence, self.rate_hz),
            excitation: case.trial.choice.excitation.to_string(),
            sentence,
            between,
            separation,
            level,
            output: self.most(case, change),
            sensor: None,
            repeats: repeats(separation),
            duration: case.trial.seconds(),
            rate_hz: self.rate_hz,
        }
    }
}
