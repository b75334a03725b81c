//! A search on forces: what it found, simulated and refined as every search has it.

use super::explore::{Chosen, Explored, LawColumns, Looked, Same, better, explore};
use super::on_forces::OnForces;
use super::room::Room;
use crate::belief::compare::unseen;
use crate::belief::on_forces::{Belief, belief, nearest};
use crate::belief::statistics::levels;
use crate::hypothesis::Hypothesis;
use crate::options::Options;
use crate::output_error::candidate::{Candidate, candidate, key_of, sort};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::{FreeParameter, Role, Structure};
use crate::output_error::work::{Budget, Limit};
use crate::recordings::problem::{Problem, Record};
use crate::search::{Search, Tried};
use crate::tuning::tuning;

/// Searches on forces; `None` where force and motion are not both known. The problem that comes back is the one in the band of the fits.
pub(crate) fn search_on_forces(
    problem: &Problem,
    options: &Options,
    limit: Limit,
    report: &(dyn Fn(&str) + Sync),
) -> Option<(Problem, Search)> {
    if !super::is_known(problem) {
        return None;
    }
    report("looking at every law on the forces along the motion");
    let rooms: Vec<Room> = super::corners(problem).into_iter().filter_map(|corner| Room::of(problem, corner, &options.without)).collect();
    let laws = |room: &Room| (0..room.laws.len()).map(|law| room.named(law).id.clone()).collect::<Vec<_>>();
    if rooms.windows(2).any(|pair| laws(&pair[0]) != laws(&pair[1])) {
        return None;
    }
    let mut explored = explore(&rooms, options.effects_of_one_axis(), 0)?;
    report("simulating those that predict left-out stretches best");
    let band = clearest(&rooms, &explored)?;
    let room = rooms.get(band)?;
    let (sensor, problem) = (sensor_noise(problem, room.corner), room.problem.clone());
    let budget = Budget::new(options.work(), limit);
    let mean = |errors: Vec<f64>| errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let noise = mean(room.left_out(explored.best().chosen.get(band)?)?).sqrt();
    let is_beyond = is_beyond_these_laws(&problem, noise);
    let mut evaluator = Evaluator { budget: budget.clone(), ..Evaluator::new(&problem) };
    for (own, record) in evaluator.noise_sd.iter_mut().enumerate().filter(|(o, _)| problem.fit.iter().any(|r| r.outputs[*o].is_some())) {
        let least = problem.fit.iter().filter_map(|r| r.spread.get(own)).fold(0.0f64, |a, b| a.max(*b));
        *record = noise.max(tuning().recordings.least_noise * least);
    }
    let fitted = |l: &Looked| fitted(&evaluator, room, l.chosen.get(band)?);
    while let Some(rest) = without_what_is_nothing(&explored, &fitted(explored.best())?, room) {
        explored.enough = rest;
    }
    let best = explored.best();
    let nominal = fitted(explored.nothing())?;
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let start = nominal.structure.values(&problem, &given, &[], &[]);
    let levels_given = levels(&evaluator, &evaluator.residuals(&nominal.structure, &start)?);
    let chosen = shortlist(&rooms, &explored);
    let mut found: Vec<Candidate> = chosen.iter().filter(|l| !l.laws.is_empty()).filter_map(|l| fitted(l)).collect();
    let samples = evaluator.len();
    sort(&mut found, samples);
    let id = |law: &usize| room.named(*law).id.clone();
    let companions = best.laws.iter().flat_map(|law| room.laws[*law].hypotheses.iter().skip(1).map(|h| room.hypotheses[*h].id.clone()));
    let beliefs: Vec<(String, Belief)> = best.laws.iter().map(|law| (id(law), belief(&rooms, &explored, *law))).collect();
    let is_alike = |l: &&&Looked| {
        let ahead = better(l, best);
        l.laws != best.laws
            && (l.laws.len() == best.laws.len() || l.cost() <= best.cost())
            && ahead.in_errors() < tuning().equation_error.sure
    };
    let alike: Vec<String> = match beliefs.iter().all(|(_, b)| b.law >= tuning().equation_error.claimed) {
        true => Vec::new(),
        false => chosen.iter().filter(is_alike).map(|l| key_of(added(room, l, band).iter().map(|(h, _)| h))).collect(),
    };
    let claimed = key_of(added(room, best, band).iter().map(|(h, _)| h));
    let same_force = best.laws.iter().filter_map(|law| Some(same_force(room, *law, room.same_force(&best.laws, *law)?))).collect();
    // As far as the refinement by simulation brings it.
    let refined = found.iter().find(|c| c.structure.name() == claimed).map_or(1.0, |c| c.levels.iter().fold(0.0f64, |a, b| a.max(*b)));
    let forces = OnForces {
        corner_hz: room.corner,
        bands_hz: rooms.iter().map(|r| r.corner).collect(),
        claimed,
        beliefs,
        companions: companions.collect(),
        same_force,
        left: refined * noise / sensor,
        is_beyond,
        alike,
    };
    let took = |l: &Looked| better(explored.nothing(), l).share;
    let alone = explored.all.iter().filter(|l| l.laws.len() == 1);
    let tried = alone.map(|l| Tried { id: id(&l.laws[0]), promised: 1.0 - 1.0 / (1.0 + took(l).max(0.0)), taken: None }).collect();
    let unseen_samples = problem.held_out.iter().map(|r| r.len).sum();
    let search = Search {
        errors: Vec::new(),
        holds: Vec::new(),
        noise_sd: evaluator.noise_sd.clone(),
        levels_given,
        found,
        tried,
        hypotheses: room.hypotheses.len(),
        samples,
        unseen_samples,
        detectable: Vec::new(),
        simulations: budget.simulations(),
        work: budget.spent(),
        exhausted: false,
        journal: Vec::new(),
        cut: budget.was_cut(),
        nominal,
        forces: Some(forces),
    };
    drop(evaluator);
    Some((problem, search))
}

/// That a law and a richer one are the same force beside a spring whose zero is free.
fn same_force(room: &Room, law: usize, other: usize) -> String {
    let (law, other) = (room.named(law), room.named(other));
    format!(
        "{} may as well be {}: beside a spring whose zero is not measured both are the same force, and no motion separates them. Measure the position in which \
         the spring pulls with no force",
        law.physics.words, other.physics.words
    )
}

/// Where refined by simulation a law of the claimed structure comes out as nothing: the place of the structure without it.
fn without_what_is_nothing(explored: &Explored, refined: &Candidate, room: &Room) -> Option<usize> {
    let is_nothing = |(number, value): (&FreeParameter, &f64)| {
        let Role::Added(h, p) = number.role else { return None };
        let hypothesis = refined.structure.added.get(h)?;
        let parameter = hypothesis.parameters.get(p).filter(|p| p.key == hypothesis.physics.size && p.neutral.is_some())?;
        let at_neutral = number.at_bound(*value).is_some() && number.at_bound(parameter.neutral?) == number.at_bound(*value);
        at_neutral.then(|| hypothesis.id.clone())
    };
    let nothing = refined.structure.free.iter().zip(&refined.fit.values).find_map(is_nothing)?;
    let rest: Vec<usize> = explored.best().laws.iter().copied().filter(|law| room.named(*law).id != nothing).collect();
    explored.all.iter().position(|l| l.laws == rest && l.laws.len() < explored.best().laws.len())
}

/// Noise standard deviation of the force's sensor in a band.
fn sensor_noise(problem: &Problem, corner: f64) -> f64 {
    let measured = |record: &Record| {
        crate::output_error::evaluator::measured(record).filter_map(|output| problem.noise_sd.get(output)).fold(0.0f64, |a, b| a.max(*b))
    };
    let in_band = |record: &Record| measured(record) * super::band::low_pass(record, corner).share_of_white().sqrt();
    problem.fit.iter().map(in_band).fold(f64::MIN_POSITIVE, f64::max)
}

/// Whether the best of the laws leaves so much, of the force and beside the sensor's noise, that it has to be one of those that are only simulated.
fn is_beyond_these_laws(problem: &Problem, left: f64) -> bool {
    let tuning = &tuning().equation_error;
    let outputs =
        problem.noise_sd.iter().enumerate().filter(|(o, _)| problem.fit.iter().any(|r| r.outputs.get(*o).is_some_and(Option::is_some)));
    outputs.into_iter().all(|(output, sensor)| {
        let spread = problem.fit.iter().filter_map(|r| r.spread.get(output)).fold(0.0f64, |a, b| a.max(*b));
        left > tuning.much_left * spread && left > tuning.beyond * sensor
    })
}

/// The band in which the claimed structure takes the largest share; the highest where nothing is claimed.
fn clearest(rooms: &[Room], explored: &Explored) -> Option<usize> {
    let best = explored.best();
    let share = |at: usize| {
        let sum = |laws: &[_]| Some(rooms.get(at)?.left_out(laws)?.iter().sum::<f64>());
        Some(sum(best.chosen.get(at)?)? / sum(&[])?)
    };
    let all = (0..rooms.len()).rev().filter_map(|at| Some((at, share(at)?)));
    all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}

/// Hypotheses of laws that were looked at together, with the parameters that they have in a band.
fn added(room: &Room, looked: &Looked, band: usize) -> Vec<(Hypothesis, Vec<f64>)> {
    let fit = looked.chosen.get(band).and_then(|chosen| room.fit(chosen));
    fit.map(|(_, all)| all.into_iter().map(|(h, values)| (room.hypotheses[h].clone(), values)).collect()).unwrap_or_default()
}

/// What is simulated: what is claimed, what is without each of its laws, the nearest without each law and kind, and what predicts best.
fn shortlist<'e>(rooms: &[Room], explored: &'e Explored) -> Vec<&'e Looked> {
    let best = explored.best();
    let mut all: Vec<&Looked> = vec![best];
    let mut take = |l: Option<&'e Looked>| {
        if let Some(l) = l.filter(|l| all.iter().all(|other| other.laws != l.laws)) {
            all.push(l);
        }
    };
    for law in &best.laws {
        let rest: Vec<usize> = best.laws.iter().copied().filter(|l| l != law).collect();
        take(explored.all.iter().find(|l| l.laws == rest));
        take(nearest(rooms, explored, *law, Same::Law));
        take(nearest(rooms, explored, *law, Same::Kind));
    }
    explored.all.iter().take(2).for_each(|l| take(Some(l)));
    all.truncate(tuning().equation_error.simulated);
    all
}

/// Laws simulated along the motion, with all parameters refined.
fn fitted(evaluator: &Evaluator, room: &Room, chosen: &[Chosen]) -> Option<Candidate> {
    let problem = evaluator.problem;
    let (_, all) = room.fit(chosen)?;
    let (added, values): (Vec<Hypothesis>, Vec<Vec<f64>>) = all.into_iter().map(|(h, v)| (room.hypotheses[h].clone(), v)).unzip();
    let structure = Structure::new(problem, &problem.fit, added);
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let start = structure.values(problem, &given, &values, &[]);
    let fit = evaluator.fit(&structure, &start, tuning().fit.to_the_end)?;
    let mut one = candidate(evaluator, structure, fit);
    one.unseen = unseen(problem, &problem.held_out, &one.structure, &one.fit.values, &evaluator.noise_sd);
    Some(one)
}
