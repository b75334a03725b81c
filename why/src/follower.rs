//! A follower that goes in stairs while its command moves evenly: how large they are, whether the friction in its model makes them, and what would smooth
//! its motion. No force has to come back to the hand for this: the slave is run by itself on its recorded commands.

use crate::cause::Cause;
use crate::cause_kind::CauseKind;
use crate::change::{Change, is_friction_to_ground};
use crate::difference::Difference;
use crate::happening::Happening;
use crate::named::named;
use crate::remedy::Remedy;
use crate::stairs::{Stairs, stairs};
use crate::trial::Trial;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::elements::Law;
use backdrive_plant::model::{InputKind, Model};
use backdrive_signal::statistics::rms;
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use backdrive_stability::outcome::Unit;

/// A slave on its recorded commands.
struct Follower<'a> {
    was: Trial,
    node: String,
    topic: String,
    recorded: &'a Recorded,
    command: Vec<f64>,
    period_s: f64,
}

impl Follower<'_> {
    /// Its stairs after changes, and how far it is from its command, as a root mean square; `None` where it cannot be run.
    fn with(&self, changes: &[Change]) -> Option<(Option<Stairs>, f64)> {
        let mut trial = self.was.clone();
        changes.iter().for_each(|c| c.apply(&mut trial));
        let put = trial.alone(&self.node, self.recorded).ok()?;
        let put = put.iter().find(|p| p.topic == self.topic)?;
        let slave: Vec<f64> = put.samples.iter().map(|s| Quantity::Position.of(s, 0)).collect();
        let contact: Vec<f64> = put.samples.iter().map(|s| Quantity::Effort.of(s, 0)).collect();
        let free = |row: usize| contact.get(row).is_none_or(|f| *f == 0.0 || !f.is_finite());
        let apart = rms(self.command.iter().zip(&slave).map(|(c, s)| c - s).filter(|x| x.is_finite()));
        Some((stairs(&self.command, &slave, free, self.period_s), apart))
    }
}

/// Largest part of the stairs that counts as gone.
const GONE: f64 = 0.1;

/// Causes and remedies of a slave that goes in stairs, and whether its loop as recorded does so in its re-simulation.
pub fn explained(
    graph: &Graph,
    was: Trial,
    differences: &[Difference],
    recorded: &Recorded,
    happening: &Happening,
) -> (Vec<Cause>, Vec<Remedy>, bool) {
    let Happening::FollowerStairs { step, unit, .. } = happening else { return Default::default() };
    let Some(index) = graph.nodes.iter().position(|n| n.kind == NodeKind::Slave) else { return Default::default() };
    let Some(way) = graph.connections.iter().find(|c| c.to.0 == index && c.to.1 == "command") else { return Default::default() };
    let Some(command) = recorded.track(&way.topic.name).map(|t| t.column(Quantity::Position, 0).to_vec()) else {
        return Default::default();
    };
    let node = graph.nodes[index].name.clone();
    let topic = graph.topic_of(index, "measured").name;
    let rate_hz = graph.timing.rate_hz;
    let follower = Follower { was, node: node.clone(), topic, recorded, command, period_s: graph.period_s() };
    let Some((again, apart)) = follower.with(&[]) else { return Default::default() };
    let reproduced = again.is_some_and(|s| s.step > 0.5 * step && s.step < 2.0 * step);
    let model = follower.was.graph.nodes.get(index).and_then(|n| match &n.settings {
        Settings::Slave(files) => files.model.clone(),
        _ => None,
    });
    let mut causes = Vec::new();
    let here = differences.iter().find(|d| d.node == node && d.way.is_none());
    let smooth = Change::FollowerWithoutFriction;
    let without = follower.with(std::slice::from_ref(&smooth));
    let left = |stairs: Option<Stairs>| stairs.map_or(0.0, |s| (s.step / step).min(1.0));
    let told = |stairs: Option<Stairs>| match stairs {
        None => "it follows without stairs".to_string(),
        Some(s) => format!("stairs of {}, {:.1} times a second", unit.text(s.step), s.frequency_hz),
    };
    if let Some((kind, rubs)) = model.as_ref().and_then(|m| friction_of(m, *unit)).filter(|_| reproduced) {
        let share = without.as_ref().map_or(0.0, |(stairs, _)| 1.0 - left(*stairs));
        let evidence = match here {
            Some(difference) => named(difference, graph).2,
            None => format!("the model of {node} has {kind}, and on the recorded commands it makes the same stairs"),
        };
        causes.push(Cause {
            kind: CauseKind::Stiction,
            place: node.clone(),
            evidence: format!("{evidence}: {rubs}"),
            without: without.as_ref().map_or("not known".to_string(), |(stairs, _)| told(*stairs)),
            holds_without: share > 1.0 - GONE,
            edge_without: None,
            share: Some(share),
            seen: true,
            confidence: 0.95 * share,
            repairs: Vec::new(),
        });
    } else if let Some(difference) = here {
        let (kind, place, evidence) = named(difference, graph);
        causes.push(Cause {
            kind,
            place,
            evidence,
            without: "not known: the slave as found does not make these stairs".to_string(),
            holds_without: false,
            edge_without: None,
            share: None,
            seen: true,
            confidence: 0.3,
            repairs: Vec::new(),
        });
    }
    let mut remedies = Vec::new();
    if reproduced {
        for changes in tries(model.as_ref(), *unit, rate_hz) {
            let Some((stairs, now)) = follower.with(&changes) else { continue };
            let stops = left(stairs) < GONE;
            let closer = 100.0 * (1.0 - now / apart.max(f64::MIN_POSITIVE));
            remedies.push(Remedy {
                text: changes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", and "),
                outcome: format!("{}, and its distance to the command is {closer:.0} % smaller", told(stairs)),
                changes,
                stops,
                robust: false,
                force_kept: 1.0,
                motion_kept: (1.0 - now / apart.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
                throws: None,
                repairs_cause: stops,
                options: None,
                signals: None,
            });
        }
        remedies.sort_by(|a, b| (b.stops, b.motion_kept).partial_cmp(&(a.stops, a.motion_kept)).unwrap_or(std::cmp::Ordering::Equal));
    }
    (causes, remedies, reproduced)
}

/// Level at rest and at speed of a slave's dry friction against ground, and what stairs they would make on its servo.
fn levels(model: &Model) -> Option<(&'static str, f64, f64)> {
    model.elements.iter().filter(|e| is_friction_to_ground(e)).find_map(|e| match &e.law {
        Law::Stribeck(law) => Some((e.law.kind().name, law.at_rest, law.coulomb)),
        Law::Coulomb(law) => Some((e.law.kind().name, law.force, law.force)),
        other => {
            let level = other.values().first().and_then(|v| v.first()).copied()?;
            Some((other.kind().name, level, level))
        }
    })
}

/// Stiffness between what a command moves and the rest, N/m or N m/rad.
fn servo_stiffness(model: &Model) -> f64 {
    let moved: Vec<usize> = model.inputs.iter().filter(|i| i.kind == InputKind::Motion).map(|i| i.on).collect();
    let of_servo = model.elements.iter().filter(|e| e.between.iter().flatten().any(|body| moved.contains(body)));
    of_servo.filter_map(|e| if let Law::Spring(spring) = &e.law { Some(spring.stiffness) } else { None }).sum()
}

fn friction_of(model: &Model, unit: Unit) -> Option<(String, String)> {
    let (kind, rest, slide) = levels(model)?;
    let stiffness = servo_stiffness(model);
    let of = if unit == Unit::Metre { "N" } else { "N m" };
    let due = if stiffness > 0.0 {
        format!(
            "; on a servo of {stiffness:.4} {of} per {} they allow steps of up to {}",
            unit_name(unit),
            unit.text(2.0 * (rest - slide) / stiffness)
        )
    } else {
        String::new()
    };
    Some((kind.to_string(), format!("{rest:.3} {of} at rest and {slide:.3} {of} at speed{due}")))
}

fn unit_name(unit: Unit) -> &'static str {
    if unit == Unit::Metre { "m" } else { "rad" }
}

/// What may smooth its motion.
fn tries(model: Option<&Model>, unit: Unit, rate_hz: f64) -> Vec<Vec<Change>> {
    let mut all: Vec<Vec<Change>> = [4.0, 10.0].map(|factor| vec![Change::Servo { factor }]).to_vec();
    let Some((model, (_, rest, slide))) = model.and_then(|m| Some((m, levels(m)?))) else { return all };
    let stiffness = servo_stiffness(model);
    if stiffness > 0.0 {
        all.push(vec![Change::FeedForward { by: slide / stiffness, unit }]);
        // Slow enough for the rate, and fast beside the stairs.
        let hz = (rate_hz / 20.0).min(25.0);
        all.extend([1.0, 2.0].map(|times| vec![Change::Dither { by: times * rest / stiffness, hz, unit }]));
    }
    all
}
