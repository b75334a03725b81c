//! What would stop it: changes, each with a re-simulation, ranked by what they leave of force and motion.

use crate::cause::Cause;
use crate::cause_kind::CauseKind;
use crate::change::{Change, is_friction_to_ground};
use crate::difference::Difference;
pub use crate::fine::is_fine;
use crate::options::Word;
use crate::throw::Throw;
use crate::trial::{Hand, Trial};
use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{DeviceFiles, NodeKind, Settings};
use backdrive_stability::resimulate::{Gain, ResimulateError, RunOptions};
use backdrive_stability::session::Session;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// A remedy is robust if it holds with hands that grip so firmly, as factors on the grip of the bag: a user changes the grip by as much from one moment to
/// the next.
const GRIPS: [f64; 2] = [0.7, 1.5];

/// And on walls so stiff, as factors on what the slave touched.
const WALLS: [f64; 2] = [0.5, 2.0];

/// And at a gain so much higher.
const MARGIN: f64 = 1.25;

/// A lower gain is this share of the critical gain.
const BELOW: f64 = 0.8;

/// Damping that is tried, N s/m, or as many thousandths of N m s/rad.
const DAMPING: [f64; 5] = [2.0, 5.0, 10.0, 20.0, 50.0];

/// Share of dry friction that a compensation covers: with more, a friction that is lower than assumed would be driven.
const COMPENSATED: f64 = 0.8;

/// Laws that are tried instead of scaling.
const COUPLINGS: [LawKind; 4] = [LawKind::Wave, LawKind::Passivity, LawKind::PositionPosition, LawKind::VirtualCoupling];

/// Corner of a high-pass that is tried, Hz.
const HIGH_PASS_HZ: f64 = 1.0;

/// A remedy.
#[derive(Debug, Clone, Serialize)]
pub struct Remedy {
    /// What to do; several things together where one is not enough.
    pub changes: Vec<Change>,
    /// In words.
    pub text: String,
    /// What the loop does then, with the hand of the bag.
    pub outcome: String,
    /// Whether it is stable then, with the hand of the bag and at its gain.
    pub stops: bool,
    /// Whether it is stable with grips of 0.7 to 1.5 times, on walls of 0.5 to 2 times, with every cause at either end of its interval, and at a gain a
    /// quarter higher too.
    pub robust: bool,
    /// Share of the reflected force that is left, 0 to 1: against lambda times the contact force, with the lambda of the bag.
    pub force_kept: f64,
    /// Share of the hand's free motion that reaches the slave, 0 to 1: against the master without force.
    pub motion_kept: f64,
    /// How it moves or pushes the device harder than was recorded, where it does.
    pub throws: Option<Throw>,
    /// Whether it puts right what was found to be wrong.
    pub repairs_cause: bool,
    /// What does it on the command line of `backdrive run` and `backdrive replay`, where all of it can be done there.
    #[serde(skip)]
    pub options: Option<Vec<Word>>,
    /// What the loop did then; of the best remedy only.
    #[serde(skip)]
    pub signals: Option<Session>,
}

impl Remedy {
    /// Remaining share of force and motion together, 0 to 1.
    pub fn kept(&self) -> f64 {
        self.force_kept * self.motion_kept
    }
}

/// Tries what would stop a loop; the best first. `recorded` is the loop as recorded, `causes` are the likeliest first, and
/// `doubts` are how large or small they may be: see [`doubts`].
///
/// # Errors
/// A loop that cannot be run; `cancel` was set.
pub fn remedies(
    was: &Trial,
    recorded: &Session,
    hand: &Hand,
    gain: Gain,
    edge: Option<f64>,
    (causes, doubts): (&[Cause], &[Change]),
    cancel: &AtomicBool,
) -> Result<Vec<Remedy>, ResimulateError> {
    let free = free_motion(was, hand, gain, cancel)?;
    let mut tried = candidates(was, gain, edge, causes);
    // Of a loop that was not judged it is only known that what differs is to be put right.
    if causes.iter().all(|c| c.kind != CauseKind::GainTooHigh) {
        tried.retain(|(changes, repairs)| *repairs && changes.iter().all(Change::is_repair));
    }
    let one = |(changes, repairs_cause): &(Vec<Change>, bool)| -> Result<Option<Remedy>, ResimulateError> {
        let mut trial = was.clone();
        changes.iter().for_each(|c| c.apply(&mut trial));
        let own = Gain { mu: gain.mu, lambda: lambda_of(changes, gain.lambda) };
        let run = match trial.run(hand, own, &RunOptions { keep_signals: true, ..RunOptions::default() }, cancel) {
            Ok(run) => run,
            Err(ResimulateError::Cancelled) => return Err(ResimulateError::Cancelled),
            // What cannot be built is no remedy.
            Err(_) => return Ok(None),
        };
        let stops = is_fine(&trial, hand, own, &run, cancel)?;
        let robust = stops && robust(&trial, hand, own, (lowers(changes), doubts), cancel)?;
        let (force_kept, motion_kept) =
            run.signals.as_ref().map_or((0.0, 0.0), |s| (force_kept(s, gain.lambda), motion_kept(s, &free, gain.mu)));
        Ok(Some(Remedy {
            text: changes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", and "),
            changes: changes.clone(),
            outcome: run.outcome.to_string(),
            stops,
            robust,
            force_kept,
            motion_kept,
            throws: run.signals.as_ref().and_then(|signals| Throw::of(signals, recorded)),
            repairs_cause: *repairs_cause,
            options: None,
            signals: run.signals,
        }))
    };
    let all: Vec<Option<Remedy>> = tried.par_iter().map(one).collect::<Result<_, ResimulateError>>()?;
    let mut all: Vec<Remedy> = all.into_iter().flatten().collect();
    all.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    // Of several strengths of the same kind that stop it the best is enough.
    let mut kinds = Vec::new();
    all.retain(|r| {
        let kind = r.changes.first().map(std::mem::discriminant);
        let again = r.changes.len() == 1
            && matches!(
                r.changes.first(),
                Some(Change::Damping { .. } | Change::Grip { .. } | Change::Gain { .. } | Change::Renewals { .. })
            )
            && kinds.contains(&kind);
        kinds.push(kind);
        !again
    });
    all.iter_mut().skip(1).for_each(|r| r.signals = None);
    Ok(all)
}

/// Whether a loop holds with other grips, on other walls, with every cause as large or small as it may be, and at a higher gain unless lowering it is what
/// was done.
pub(crate) fn robust(
    trial: &Trial,
    hand: &Hand,
    gain: Gain,
    (lowers, doubts): (bool, &[Change]),
    cancel: &AtomicBool,
) -> Result<bool, ResimulateError> {
    let grips = GRIPS.iter().map(|factor| Change::Grip { factor: *factor });
    let walls = WALLS.iter().map(|factor| Change::Wall { factor: *factor });
    for other in grips.chain(walls).chain(doubts.iter().cloned()) {
        let mut changed = trial.clone();
        other.apply(&mut changed);
        if !holds(&changed, hand, gain, cancel)? {
            return Ok(false);
        }
    }
    let higher = Gain { lambda: gain.lambda * MARGIN, ..gain };
    Ok(lowers || holds(trial, hand, higher, cancel)?)
}

/// Each number of a device that was found, at either end of its interval.
pub fn doubts(differences: &[Difference]) -> Vec<Change> {
    let numbers = differences.iter().flat_map(|d| d.device.iter().flat_map(|device| &device.tuned).map(move |n| (&d.node, n)));
    let unsure = numbers.filter(|(_, n)| !n.knob.is_time() && n.give.is_finite() && n.give.abs() < 0.5 * n.value.abs());
    let ends = unsure.flat_map(|(node, n)| {
        let share = n.give / n.value.abs();
        [1.0 + share, 1.0 - share].map(|factor| Change::NumberRepaired { node: node.clone(), knob: n.knob, value: 1.0 / factor })
    });
    ends.collect()
}

/// What stops it without a throw comes first, then what stops it with one, then by what is kept: what holds with other hands too counts more, and what puts
/// the cause right. To ask another grip of the hand is the last thing.
fn rank(remedy: &Remedy) -> f64 {
    let hand = remedy.changes.iter().any(|c| matches!(c, Change::Grip { .. }));
    let more = f64::from(u8::try_from(remedy.changes.len()).unwrap_or(u8::MAX));
    8.0 * f64::from(u8::from(remedy.stops)) - 4.0 * f64::from(u8::from(remedy.throws.is_some()))
        + remedy.kept() * if remedy.robust { 1.0 } else { FRAGILE }
        + 0.5 * f64::from(u8::from(remedy.repairs_cause))
        - 0.01 * more
        - if hand { 2.0 } else { 0.0 }
}

/// What a remedy keeps counts so much where it holds with this hand at this gain only.
const FRAGILE: f64 = 0.6;

fn lambda_of(changes: &[Change], lambda: f64) -> f64 {
    changes.iter().fold(lambda, |l, c| if let Change::Gain { factor, .. } = c { l * factor } else { l })
}

fn lowers(changes: &[Change]) -> bool {
    changes.iter().any(|c| matches!(c, Change::Gain { .. }))
}

fn candidates(was: &Trial, gain: Gain, edge: Option<f64>, causes: &[Cause]) -> Vec<(Vec<Change>, bool)> {
    let mut all: Vec<(Vec<Change>, bool)> = Vec::new();
    let graph = &was.graph;
    // What was seen to be wrong, one by one and all together.
    let seen: Vec<&Cause> = causes.iter().filter(|c| !c.repairs.is_empty()).collect();
    for (number, cause) in seen.iter().enumerate() {
        all.push((cause.repairs.clone(), number == 0 || cause.seen));
    }
    let together: Vec<Change> = seen.iter().filter(|c| c.seen).flat_map(|c| c.repairs.clone()).collect();
    if together.len() > 1 {
        all.push((together.clone(), true));
    }
    let master =
        graph.node_of(NodeKind::Master).and_then(|n| if let Settings::Master(files) = &n.settings { Some(files.clone()) } else { None });
    let canceller = graph
        .node_of(NodeKind::Canceller)
        .and_then(|n| if let Settings::Canceller(files, hz, _) = &n.settings { Some((files.clone(), *hz)) } else { None });
    let knows = causes.first().is_some_and(|c| {
        use CauseKind::*;
        matches!(c.kind, DryFriction | Backlash | Hysteresis | Inertia | Compliance | OtherPhysics | Grip | OverCancelling)
    });
    if let (Some(DeviceFiles { model: Some(model), fragment, .. }), Some((_, hz))) = (&master, &canceller) {
        let told = |high_pass_hz: f64| Change::Canceller {
            of: format!("the recorded model of the master, {}", model.name),
            model: Some(Box::new(model.clone())),
            grip: fragment.clone().map(Box::new),
            high_pass_hz,
        };
        // Over several axes an estimated hand needs a limit to its share, which is not known here.
        if let Some(grip) = fragment.as_ref().filter(|_| model.axes.len() == 1) {
            let estimated = Change::EstimatedHand { model: Box::new(model.clone()), grip: Box::new(grip.clone()) };
            all.push((vec![estimated], knows));
        }
        for corner in [*hz, HIGH_PASS_HZ] {
            all.push((vec![told(corner)], knows));
            if !together.is_empty() {
                all.push(([together.clone(), vec![told(corner)]].concat(), true));
            }
        }
    }
    if let Some((DeviceFiles { model: Some(_), .. }, hz)) = &canceller {
        all.push((
            vec![Change::Canceller { of: "switch the canceller off".to_string(), model: None, grip: None, high_pass_hz: 0.0 }],
            false,
        ));
        all.push((vec![Change::HighPass { hz: if *hz > 0.0 { 0.0 } else { HIGH_PASS_HZ } }], false));
    }
    if graph.connections.iter().any(|c| c.impairment.is_some() || c.delay > 1) {
        all.extend([0.5, 0.25].map(|factor| (vec![Change::Delays { factor }], false)));
    }
    if let Some(hold) = was.distortions.iter().find_map(|d| d.hold) {
        let own = graph.timing.rate_hz / hold.rows;
        all.extend([2.0, 4.0, 10.0].map(|factor| (vec![Change::Renewals { factor, hz: factor * own }], true)));
        all.push((vec![Change::Interpolated], false));
    }
    if graph.node_of(NodeKind::Scaling).is_some() {
        all.extend(COUPLINGS.map(|law| (vec![Change::Coupling { law }], false)));
    }
    all.push((vec![Change::Rate { hz: 2.0 * graph.timing.rate_hz }], false));
    all.extend(DAMPING.map(|damping| (vec![Change::Damping { damping: damping * unit_of_damping(was) }], false)));
    let rubs = |files: &DeviceFiles| files.model.iter().flat_map(|m| &m.elements).any(is_friction_to_ground);
    if master.as_ref().is_some_and(rubs) {
        all.push((vec![Change::FrictionCompensated { share: COMPENSATED }], false));
    }
    all.extend([1.5, 2.0, 0.6].map(|factor| (vec![Change::Grip { factor }], false)));
    if let Some(edge) = edge.filter(|e| *e < gain.product() / BELOW) {
        for share in [BELOW, 0.5, 0.25] {
            let factor = share * edge / gain.product();
            all.push((
                vec![Change::Gain { factor, lambda: factor * gain.lambda }],
                causes.first().is_some_and(|c| c.kind == CauseKind::GainTooHigh),
            ));
        }
    }
    let mut different: Vec<(Vec<Change>, bool)> = Vec::new();
    for (changes, repairs) in all {
        let same =
            |(other, _): &(Vec<Change>, bool)| other.len() == changes.len() && other.iter().zip(&changes).all(|(a, b)| a.does_the_same(b));
        if !different.iter().any(same) {
            different.push((changes, repairs));
        }
    }
    different
}

/// 1 for a master that moves along a line, a thousandth for one that turns.
fn unit_of_damping(was: &Trial) -> f64 {
    let motion = was.graph.node_of(NodeKind::Master).and_then(|n| match &n.settings {
        Settings::Master(files) => files.model.as_ref().map(|m| m.motion),
        _ => None,
    });
    if motion == Some(backdrive_plant::model::Motion::Rotation) { 1e-3 } else { 1.0 }
}

/// Where the hand alone takes the master: the loop with next to no force reflected.
fn free_motion(was: &Trial, hand: &Hand, gain: Gain, cancel: &AtomicBool) -> Result<Option<Session>, ResimulateError> {
    let little = Gain { lambda: 1e-6 * gain.lambda, ..gain };
    Ok(was.run(hand, little, &RunOptions { keep_signals: true, ..RunOptions::default() }, cancel)?.signals)
}

fn force_kept(session: &Session, lambda: f64) -> f64 {
    let (mut felt, mut whole) = (0.0, 0.0);
    for axis in &session.axes {
        for (force, contact) in axis.force.iter().zip(&axis.contact).filter(|(f, c)| f.is_finite() && c.is_finite() && **c != 0.0) {
            felt += force.abs();
            whole += (lambda * contact).abs();
        }
    }
    if whole > 0.0 { (felt / whole).min(1.0) } else { 1.0 }
}

/// Share of the hand's free motion that is commanded to the slave.
fn motion_kept(session: &Session, free: &Option<Session>, mu: f64) -> f64 {
    let Some(free) = free else { return 1.0 };
    let times = (free.period_s / session.period_s).max(1e-9);
    let (mut error, mut whole) = (0.0, 0.0);
    for (axis, alone) in session.axes.iter().zip(&free.axes) {
        for (row, x) in axis.command.iter().enumerate() {
            let other = (row as f64 / times) as usize;
            let touches = |a: &backdrive_stability::session::AxisSignals, r: usize| a.contact.get(r).is_none_or(|f| *f != 0.0);
            if touches(axis, row) || touches(alone, other) || !x.is_finite() {
                continue;
            }
            let wanted = mu * alone.master.get(other).copied().unwrap_or(0.0);
            error += (x - wanted) * (x - wanted);
            whole += wanted * wanted;
        }
    }
    if whole > 0.0 { (1.0 - (error / whole).sqrt()).clamp(0.0, 1.0) } else { 1.0 }
}

pub(crate) fn holds(trial: &Trial, hand: &Hand, gain: Gain, cancel: &AtomicBool) -> Result<bool, ResimulateError> {
    is_fine(trial, hand, gain, &trial.run(hand, gain, &RunOptions::default(), cancel)?, cancel)
}

#[cfg(test)]
mod tests;
