//! Changes to a loop that would stop it, as things that can be done to any graph.

use crate::coupled::couple;
use crate::faulty::{Distortion, Side};
use crate::knob::Knob;
use crate::trial::Trial;
use backdrive_control::coupling::LawKind;
use backdrive_control::hand::HandSettings;
use backdrive_diagnosis::hypothesis::Family;
use backdrive_diagnosis::physics::physics_named;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_plant::elements::Law;
use backdrive_plant::model::{Element, Fragment, Model};
use backdrive_stability::by_itself::recorded::Quantity;
use backdrive_stability::outcome::Unit;
use backdrive_stability::resimulate::grip;
use serde::Serialize;

/// One change.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "change", rename_all = "snake_case")]
pub enum Change {
    /// The force scale times a factor.
    Gain {
        /// Factor on lambda.
        factor: f64,
        /// lambda then.
        lambda: f64,
    },
    /// The canceller's prediction made of another model, with another grip.
    Canceller {
        /// What it is, for a person.
        of: String,
        /// The model; `None` where nothing is cancelled.
        #[serde(skip)]
        model: Option<Box<Model>>,
        /// The grip; `None` where the model holds the hand.
        #[serde(skip)]
        grip: Option<Box<Fragment>>,
        /// Corner of its high-pass, Hz; 0 for none.
        high_pass_hz: f64,
    },
    /// A canceller that estimates the hand while the loop runs, with the master's model and grip.
    EstimatedHand {
        /// The model.
        #[serde(skip)]
        model: Box<Model>,
        /// The grip about which it looks.
        #[serde(skip)]
        grip: Box<Fragment>,
    },
    /// Corner of the canceller's high-pass.
    HighPass {
        /// Hz; 0 for none.
        hz: f64,
    },
    /// A way has only the delay in the graph.
    WayRepaired {
        /// Node at its end.
        node: String,
        /// Input port at its end.
        port: String,
    },
    /// Delays that the graph states times a factor.
    Delays {
        /// Factor.
        factor: f64,
    },
    /// A sensor behaves like its model.
    SensorRepaired {
        /// The node that reads it.
        node: String,
    },
    /// One number of a device is that of its model.
    NumberRepaired {
        /// The device's node.
        node: String,
        /// Which number.
        knob: Knob,
        /// The value that it has.
        value: f64,
    },
    /// A device is as its model states.
    DeviceRepaired {
        /// Its node.
        node: String,
        /// What is repaired, for a person.
        what: String,
        /// The device as its graph states it.
        #[serde(skip)]
        files: Box<DeviceFiles>,
    },
    /// Signals that are renewed too seldom have a higher rate.
    Renewals {
        /// Factor.
        factor: f64,
        /// Their rate then, Hz.
        hz: f64,
    },
    /// Signals that are renewed too seldom go on a straight line to each new value instead of a step.
    Interpolated,
    /// A stiffer servo of the follower.
    Servo {
        /// Factor on its forces.
        factor: f64,
    },
    /// The follower's command leads on the side to which it moves, by what its sliding friction bends its servo.
    FeedForward {
        /// m or rad.
        by: f64,
        /// Which of them.
        unit: Unit,
    },
    /// A sine on the follower's command.
    Dither {
        /// Amplitude, m or rad.
        by: f64,
        /// Hz.
        hz: f64,
        /// Unit of the amplitude.
        unit: Unit,
    },
    /// The follower without its dry friction: not to be had, but it shows what the friction does.
    FollowerWithoutFriction,
    /// What the slave touches is stiffer or softer.
    Wall {
        /// Factor on its forces.
        factor: f64,
    },
    /// Sensors that neither round nor are noisy.
    FinerSensors,
    /// The motor compensates dry friction between the master's bodies and ground, where it is known.
    FrictionCompensated {
        /// Share of the friction that is compensated, 0 to 1.
        share: f64,
    },
    /// Damping at the handle, played by the motor.
    Damping {
        /// N s/m or N m s/rad.
        damping: f64,
    },
    /// A firmer or softer hand.
    Grip {
        /// Factor on its stiffness and damping.
        factor: f64,
    },
    /// Another rate of the loop.
    Rate {
        /// Hz.
        hz: f64,
    },
    /// Another law between master and slave, without a canceller.
    Coupling {
        /// Which.
        law: LawKind,
    },
    /// Motors without limits of force and rate.
    StrongerMotor,
    /// No limit at all, of motors or of travel: not to be had, but it shows what a limit hides.
    NoLimits,
}

impl Change {
    /// Makes the change.
    pub fn apply(&self, trial: &mut Trial) {
        match self {
            Change::Gain { factor, .. } => trial.graph.gains.lambda *= factor,
            Change::Canceller { model, grip, high_pass_hz, .. } => cancellers(&mut trial.graph, |files, corner| {
                files.model = model.as_deref().cloned();
                files.fragment = grip.as_deref().cloned();
                *corner = *high_pass_hz;
            }),
            Change::EstimatedHand { model, grip } => {
                for node in &mut trial.graph.nodes {
                    if let Settings::Canceller(files, corner, hand) = &mut node.settings {
                        (files.model, files.fragment) = (Some((**model).clone()), Some((**grip).clone()));
                        (*corner, *hand) = (0.0, Some(HandSettings::default()));
                    }
                }
            }
            Change::HighPass { hz } => cancellers(&mut trial.graph, |_, corner| *corner = *hz),
            Change::WayRepaired { node, port } => {
                let Some(index) = trial.graph.nodes.iter().position(|n| n.name == *node) else { return };
                trial.graph.connections.iter_mut().filter(|c| c.to.0 == index && c.to.1 == *port).for_each(|c| c.impairment = None);
                trial.distortions.retain(|d| d.node != *node || d.hold.is_none() && d.filter.is_none());
            }
            Change::Delays { factor } => {
                for connection in &mut trial.graph.connections {
                    if let Some(impairment) = &mut connection.impairment {
                        impairment.delay_s *= factor;
                        impairment.jitter_s *= factor;
                        impairment.loss *= factor;
                    }
                    if connection.delay > 1 {
                        connection.delay = ((connection.delay as f64 * factor) as u64).max(1);
                    }
                }
            }
            Change::SensorRepaired { node } => trial.distortions.retain(|d| d.node != *node),
            Change::NumberRepaired { node, knob: Knob::CommandDelay, value } => undelayed(&mut trial.graph, node, *value),
            Change::NumberRepaired { node, knob, value } => device(&mut trial.graph, node, |files| knob.undo(files, *value)),
            Change::DeviceRepaired { node, files: stated, .. } => device(&mut trial.graph, node, |files| *files = (**stated).clone()),
            Change::Servo { factor } => followers(&mut trial.graph, |files| Knob::Servo.put(files, *factor)),
            Change::FollowerWithoutFriction => followers(&mut trial.graph, |files| {
                files.model.iter_mut().for_each(|m| m.elements.retain(|e| !is_friction_to_ground(e)));
            }),
            Change::FeedForward { by, .. } => commanded(trial, |d| d.lead = *by),
            Change::Dither { by, hz, .. } => commanded(trial, |d| d.dither = [*by, *hz]),
            Change::Renewals { factor, .. } => {
                for hold in trial.distortions.iter_mut().filter_map(|d| d.hold.as_mut()) {
                    hold.rows = (hold.rows / factor).max(1.0);
                }
            }
            Change::Interpolated => trial.distortions.iter_mut().filter(|d| d.hold.is_some()).for_each(|d| d.ramps = true),
            Change::Wall { factor } => {
                for node in trial.graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Slave) {
                    if let Settings::Slave(files) = &mut node.settings {
                        files.fragment.iter_mut().for_each(|f| f.scale(*factor));
                    }
                }
            }
            Change::FinerSensors => {
                for node in &mut trial.graph.nodes {
                    if let Settings::Master(files) | Settings::Slave(files) = &mut node.settings {
                        files.real_sensors = false;
                    }
                }
                trial.distortions.retain(|d| d.step == 0.0 && d.noise == 0.0);
            }
            Change::Coupling { law } => couple(&mut trial.graph, *law),
            Change::Damping { damping } => damped(&mut trial.graph, *damping),
            Change::FrictionCompensated { share } => {
                for element in masters(&mut trial.graph).flat_map(|m| &mut m.elements).filter(|e| is_friction_to_ground(e)) {
                    element.law = element.law.scaled(1.0 - share);
                }
            }
            Change::Grip { factor } => firmer(&mut trial.graph, *factor),
            Change::Rate { hz } => {
                let times = hz / trial.graph.timing.rate_hz;
                trial.graph.timing.rate_hz = *hz;
                trial.graph.timing.steps = trial.graph.timing.steps.map(|s| (s as f64 * times).round() as u64);
                for distortion in &mut trial.distortions {
                    distortion.late = (distortion.late as f64 * times).round() as usize;
                    distortion.dead_from = distortion.dead_from.map(|row| (row as f64 * times).round() as usize);
                    if let Some(hold) = &mut distortion.hold {
                        (hold.rows, hold.phase) = (hold.rows * times, hold.phase * times);
                    }
                }
                // Delays of whole steps are of the network where there are several, and of the clock where there is one.
                for connection in trial.graph.connections.iter_mut().filter(|c| c.delay > 1) {
                    connection.delay = (connection.delay as f64 * times).round() as u64;
                }
            }
            Change::StrongerMotor | Change::NoLimits => {
                for node in &mut trial.graph.nodes {
                    let (Settings::Master(files) | Settings::Slave(files)) = &mut node.settings else { continue };
                    for axis in files.model.iter_mut().flat_map(|m| m.axes.iter_mut()) {
                        (axis.force, axis.force_rate) = (None, None);
                        if *self == Change::NoLimits {
                            (axis.travel, axis.speed) = (None, None);
                        }
                    }
                }
            }
        }
    }

    /// Whether it puts right what was found to differ from the graph, and does nothing else.
    pub fn is_repair(&self) -> bool {
        use Change::*;
        matches!(self, WayRepaired { .. } | SensorRepaired { .. } | NumberRepaired { .. } | DeviceRepaired { .. })
    }

    /// Whether it does the same as another, however the two are called.
    pub fn does_the_same(&self, other: &Change) -> bool {
        match (self, other) {
            (
                Change::Canceller { model: a, grip: g, high_pass_hz: h, .. },
                Change::Canceller { model: b, grip: i, high_pass_hz: j, .. },
            ) => a == b && g == i && h == j,
            _ => self == other,
        }
    }
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Change::Gain { lambda, factor } => write!(f, "lower lambda to {lambda:.3} ({:.0} % of the recorded value)", 100.0 * factor),
            Change::Canceller { of, model: None, .. } => write!(f, "{of}"),
            Change::Canceller { of, high_pass_hz, .. } if *high_pass_hz > 0.0 => {
                write!(f, "use {of} in the canceller, only above {high_pass_hz:.1} Hz (high_pass_hz)")
            }
            Change::EstimatedHand { .. } => {
                write!(f, "give the canceller the master's model, and let it estimate the hand during the run (hand = \"estimated\")")
            }
            Change::Canceller { of, .. } => write!(f, "use {of} in the canceller"),
            Change::HighPass { hz } if *hz > 0.0 => {
                write!(f, "filter the canceller's estimate with a high-pass of {hz:.1} Hz (high_pass_hz)")
            }
            Change::HighPass { .. } => write!(f, "remove the high-pass from the canceller's estimate (high_pass_hz = 0)"),
            Change::WayRepaired { node, port } => {
                write!(
                    f,
                    "repair the connection to {node}.{port}: no more delay, jitter, loss or filter than the graph states, and its full rate"
                )
            }
            Change::Delays { factor } if *factor == 0.0 => write!(f, "remove the delays, jitter and loss that the graph states"),
            Change::Delays { factor } => {
                write!(f, "reduce delays, jitter and loss to {:.0} % of what the graph states", 100.0 * factor)
            }
            Change::SensorRepaired { node } => write!(f, "repair the sensor that {node} reads"),
            Change::NumberRepaired { node, knob, .. } => write!(f, "{}", knob.repair(node)),
            Change::DeviceRepaired { node, what, .. } => write!(f, "repair {node}: {what}"),
            Change::Servo { factor } => write!(f, "make the follower's servo {factor:.0} times as stiff"),
            Change::FeedForward { by, unit } => {
                write!(
                    f,
                    "let the follower's command lead by {} on the side to which it moves: a feed-forward of its sliding friction",
                    unit.text(*by)
                )
            }
            Change::Dither { by, hz, unit } => write!(f, "add a dither of {} at {hz:.0} Hz to the follower's command", unit.text(*by)),
            Change::FollowerWithoutFriction => write!(f, "remove the follower's dry friction"),
            Change::Renewals { hz, .. } => write!(f, "renew the signal that is held at {hz:.0} Hz"),
            Change::Interpolated => write!(f, "interpolate the held signal on a straight line to each new value, instead of a step"),
            Change::Wall { factor } => write!(f, "touch something {factor:.1} times as stiff"),
            Change::Coupling { law } => {
                let law = law.name();
                write!(f, "couple master and slave by {} instead of scaling and canceller (--coupling {law})", law.replace('_', " "))
            }
            Change::FinerSensors => write!(f, "use a position sensor with a finer resolution"),
            Change::FrictionCompensated { share } => {
                write!(f, "compensate {:.0} % of the master's dry friction with its motor", 100.0 * share)
            }
            Change::Damping { damping } => write!(f, "inject damping of {damping:.1} N s/m at the handle"),
            Change::Grip { factor } if *factor > 1.0 => write!(f, "hold the handle with {factor:.1} times the grip stiffness"),
            Change::Grip { factor } => write!(f, "hold the handle more softly, with {factor:.1} times the grip stiffness"),
            Change::Rate { hz } => write!(f, "run the loop at {hz:.0} Hz"),
            Change::NoLimits => write!(f, "remove all limits"),
            Change::StrongerMotor => write!(f, "use a stronger motor"),
        }
    }
}

fn followers(graph: &mut Graph, change: impl Fn(&mut DeviceFiles)) {
    for node in &mut graph.nodes {
        if let Settings::Slave(files) = &mut node.settings {
            change(files);
        }
    }
}

/// Puts a distortion on the command of each axis of each slave.
fn commanded(trial: &mut Trial, change: impl Fn(&mut Distortion)) {
    let slaves = trial.graph.nodes.iter().filter(|n| n.kind == NodeKind::Slave);
    let all: Vec<Distortion> = slaves
        .flat_map(|node| {
            (0..node.axes).map(|axis| Distortion { side: Side::Input(0), ..Distortion::none(&node.name, Quantity::Position, axis) })
        })
        .map(|mut one| {
            change(&mut one);
            one
        })
        .collect();
    trial.distortions.extend(all);
}

/// Takes a delay off a slave's command: in front of its servo, and what is more than the delay there off the connection.
fn undelayed(graph: &mut Graph, node: &str, delay_s: f64) {
    let mut rest = 0.0;
    for node in graph.nodes.iter_mut().filter(|n| n.name == node) {
        let Settings::Slave(DeviceFiles { model: Some(model), .. }) = &mut node.settings else { continue };
        let feedbacks: Vec<usize> = model.axes.iter().map(|a| a.feedback).collect();
        for input in feedbacks {
            if let Some(input) = model.inputs.get_mut(input) {
                let taken = delay_s.min(input.delay.max(0.0));
                input.delay -= taken;
                rest = delay_s - taken;
            }
        }
    }
    let Some(index) = graph.nodes.iter().position(|n| n.name == node) else { return };
    for way in graph.connections.iter_mut().filter(|c| c.to.0 == index && c.to.1 == "command") {
        if let Some(impairment) = &mut way.impairment {
            impairment.delay_s = (impairment.delay_s - rest).max(0.0);
        }
    }
}

/// Changes the files of a master or a slave.
fn device(graph: &mut Graph, node: &str, change: impl Fn(&mut DeviceFiles)) {
    for node in graph.nodes.iter_mut().filter(|n| n.name == node) {
        if let Settings::Master(files) | Settings::Slave(files) = &mut node.settings {
            change(files);
        }
    }
}

fn cancellers(graph: &mut Graph, mut change: impl FnMut(&mut backdrive_nodes::graph::DeviceFiles, &mut f64)) {
    for node in &mut graph.nodes {
        if let Settings::Canceller(files, corner, _) = &mut node.settings {
            change(files, corner);
        }
    }
}

/// Models of the masters.
fn masters(graph: &mut Graph) -> impl Iterator<Item = &mut Model> {
    graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Master).filter_map(|node| match &mut node.settings {
        Settings::Master(files) => files.model.as_mut(),
        _ => None,
    })
}

/// Dry friction of a body against ground: a motor can compensate it.
pub(crate) fn is_friction_to_ground(element: &Element) -> bool {
    let is_friction = physics_named(element.law.kind().name).is_some_and(|physics| physics.family == Family::Friction);
    is_friction && element.between.contains(&None)
}

/// A damper between each handle and ground.
fn damped(graph: &mut Graph, damping: f64) {
    for model in masters(graph) {
        let users: Vec<usize> = model.axes.iter().map(|a| a.user).collect();
        for (number, user) in users.into_iter().enumerate() {
            model.elements.push(Element {
                name: format!("injected_damping_{number}"),
                between: [Some(user), None],
                law: Law::Damper(backdrive_plant::elements::Damper { damping }),
            });
        }
    }
}

/// The hand grips `factor` times as firmly, be it a fragment or part of the model.
pub fn firmer(graph: &mut Graph, factor: f64) {
    for node in graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Master) {
        let Settings::Master(files) = &mut node.settings else { continue };
        if let Some(fragment) = &mut files.fragment {
            grip::scale(fragment, factor);
            continue;
        }
        let Some(model) = &mut files.model else { continue };
        model.scale_own_hand(factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_nodes::graph::Overrides;
    use std::path::Path;

    #[test]
    fn what_a_motor_makes_up_for_is_friction_against_ground_and_nothing_else() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/contact.toml");
        let mut trial = Trial::of(Graph::load(&file, &Overrides::default()).unwrap());
        let law = |trial: &mut Trial| -> Vec<(bool, Vec<Vec<f64>>)> {
            let model = masters(&mut trial.graph).next().unwrap();
            model.elements.iter().map(|e| (is_friction_to_ground(e), e.law.values())).collect()
        };
        let before = law(&mut trial);
        Change::FrictionCompensated { share: 0.8 }.apply(&mut trial);
        let after = law(&mut trial);
        assert!(before.iter().any(|(friction, _)| *friction) && before.iter().any(|(friction, _)| !friction));
        for ((friction, was), (_, is)) in before.iter().zip(&after) {
            // The force is the first number of a friction's law.
            let left = if *friction { 0.2 } else { 1.0 };
            assert!((is[0][0] - left * was[0][0]).abs() < 1e-12, "{was:?} {is:?}");
        }
    }
}
