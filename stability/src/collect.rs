//! Collects what the answers need while messages go by, from a live run, a replay or a bag.

use crate::judgement::judge;
use crate::outcome::{Closes, Outcome, Trace, Unit};
use crate::session::{AxisSignals, Session};
use crate::unjudged::{Gaps, Unjudged};
use backdrive_control::coupling::Law;
use backdrive_msgs::{Gains, Message, Sample, flag};
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};

/// What a topic carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// x_u, the hand's intended motion.
    Intent,
    /// x_m and F_f: the master's measured position, and the force applied to it.
    Master,
    /// The predicted induced motion that is subtracted.
    Induced,
    /// The exogenous part of F_f.
    Dither,
    /// x_c, where the slave shall be.
    Command,
    /// F_s and x_s: the environment's force on the slave, and where the slave is.
    Slave,
}

/// A sample so far ahead of the others is damage, not a gap, steps.
const MOST_AHEAD: usize = 10_000_000;

/// One column per signal and axis, one row per step, NaN where nothing came.
#[derive(Debug, Clone, Default)]
struct Columns {
    intent: Vec<f64>,
    master: Vec<f64>,
    force: Vec<f64>,
    induced: Vec<f64>,
    dither: Vec<f64>,
    command: Vec<f64>,
    contact: Vec<f64>,
    slave: Vec<f64>,
}

/// Hears samples and lays them into rows by their step.
#[derive(Debug, Clone)]
pub struct Collector {
    topics: Vec<(String, Signal)>,
    gains_topic: Option<String>,
    /// Names, travel, resolution; its columns are empty.
    blank: Session,
    axes: Vec<Columns>,
    /// Flags of the master's and the slave's samples, together.
    flags: Vec<u32>,
    /// (row, mu, lambda) as reported.
    gains: Vec<(usize, f64, f64)>,
    /// The first step heard is row 0.
    origin: Option<u64>,
    /// Rows that the graph asks for; 0 where it runs until it is stopped.
    planned: usize,
    /// Whether there is a loop to ask about.
    has: HasLoop,
}

/// Whether a graph has a loop whose stability can be asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HasLoop {
    /// No master, nothing that closes the loop, or no slave: there is none.
    No,
    /// Only contact closes it, and the slave meets nothing that the graph knows of.
    OnlyIfTouched,
    /// There is something that closes it.
    Yes,
}

impl HasLoop {
    fn of(graph: &Graph) -> HasLoop {
        let [master, slave] = [NodeKind::Master, NodeKind::Slave].map(|kind| graph.node_of(kind));
        match (master, graph.loop_node(), slave.map(|n| (&n.settings, n.command.is_some()))) {
            (Some(_), Some(_), Some((Settings::Slave(files), false)))
                if closes(graph) == Closes::InContact && files.fragment.is_none() && !touches(files) =>
            {
                HasLoop::OnlyIfTouched
            }
            (Some(_), Some(_), Some(_)) => HasLoop::Yes,
            _ => HasLoop::No,
        }
    }
}

/// What closes the loop of a graph: of all laws only position forward and force back leaves it open in free motion.
pub(crate) fn closes(graph: &Graph) -> Closes {
    match graph.loop_node().map(|node| &node.settings) {
        Some(Settings::Coupling { law, .. }) if *law != Law::Direct => Closes::Always,
        _ => Closes::InContact,
    }
}

/// Whether what a slave touches is part of its model.
fn touches(files: &DeviceFiles) -> bool {
    files.model.iter().flat_map(|model| &model.axes).any(|axis| !axis.touches.is_empty())
}

impl Collector {
    /// Ready for the messages of a graph; `name` is for messages about what was collected.
    pub fn of(graph: &Graph, name: &str) -> Collector {
        let node = |kind: NodeKind| graph.nodes.iter().position(|n| n.kind == kind);
        let coupler = graph.loop_node().map_or(NodeKind::Scaling, |n| n.kind);
        let ports = [
            (NodeKind::Operator, "intent", Signal::Intent),
            (NodeKind::Master, "measured", Signal::Master),
            (NodeKind::Canceller, "induced", Signal::Induced),
            (NodeKind::Scaling, "dither", Signal::Dither),
            (coupler, "command", Signal::Command),
            (NodeKind::Slave, "measured", Signal::Slave),
        ];
        let spoken = |signal: Signal, node: usize| match (&graph.nodes[node].settings, signal) {
            (Settings::Canceller(files, ..), Signal::Induced) => files.model.is_some() || graph.nodes[node].command.is_some(),
            (Settings::Scaling { dither, .. }, Signal::Dither) => dither.iter().any(|d| !d.is_empty()),
            _ => true,
        };
        let topics = ports.iter().filter_map(|(kind, port, signal)| {
            let node = node(*kind).filter(|n| spoken(*signal, *n))?;
            Some((graph.topic_of(node, port).name, *signal))
        });
        let master = graph.node_of(NodeKind::Master);
        let model = master.and_then(|node| match &node.settings {
            Settings::Master(files) => files.model.as_ref(),
            _ => None,
        });
        let axes = (0..master.map_or(0, |n| n.axes)).map(|index| {
            let axis = model.and_then(|m| m.axes.get(index));
            let output = axis.and_then(|a| model.and_then(|m| m.outputs.get(a.measured)));
            AxisSignals {
                name: master.and_then(|n| n.axis_names.get(index).cloned()).unwrap_or_else(|| format!("axis{index}")),
                travel: axis.and_then(|a| a.travel),
                resolution: axis.zip(output).map_or(0.0, |(a, o)| a.scale.abs() * o.resolution),
                noise: axis.zip(output).map_or(0.0, |(a, o)| a.scale.abs() * o.noise),
                unit: model.map_or(Unit::Unknown, |m| Unit::of(m.motion)),
                closes: closes(graph),
                ..AxisSignals::default()
            }
        });
        let axes: Vec<AxisSignals> = axes.collect();
        Collector {
            topics: topics.collect(),
            gains_topic: node(coupler).map(|n| format!("/{}/gains", graph.nodes[n].name)),
            axes: vec![Columns::default(); axes.len()],
            blank: Session {
                name: name.to_string(),
                period_s: graph.period_s(),
                axes,
                mu: Vec::new(),
                lambda: Vec::new(),
                notes: Vec::new(),
                sensors: Vec::new(),
                cut_short: None,
                parts: Vec::new(),
                elsewhere: None,
                bridged_s: graph.stale_after_s,
            },
            planned: graph.timing.steps.unwrap_or(0) as usize,
            has: HasLoop::of(graph),
            flags: Vec::new(),
            gains: vec![(0, graph.gains.mu, graph.gains.lambda)],
            origin: None,
        }
    }

    /// Room for this number of rows.
    pub fn reserve(&mut self, rows: usize) {
        self.flags.reserve(rows);
        for columns in &mut self.axes {
            [&mut columns.intent, &mut columns.master, &mut columns.force, &mut columns.contact].into_iter().for_each(|c| c.reserve(rows));
        }
    }

    /// The topics that it listens to, with what they carry.
    pub fn topics(&self) -> &[(String, Signal)] {
        &self.topics
    }

    /// Hears a message on any topic; those that do not matter are ignored.
    pub fn take(&mut self, topic: &str, message: &Message) {
        match message {
            Message::Sample(sample) => {
                if let Some((_, signal)) = self.topics.iter().find(|(name, _)| name == topic) {
                    let signal = *signal;
                    self.hear(signal, sample);
                }
            }
            Message::Gains(gains) if self.gains_topic.as_deref() == Some(topic) => self.hear_gains(gains),
            Message::Gains(_) | Message::Event(_) | Message::Status(_) | Message::Margin(_) => {}
        }
    }

    /// Hears the gains in force from a step on.
    pub fn hear_gains(&mut self, gains: &Gains) {
        let row = self.origin.map_or(0, |origin| gains.step.saturating_sub(origin) as usize);
        self.gains.push((row, gains.mu, gains.lambda));
    }

    /// Hears a sample of a signal.
    #[inline]
    pub fn hear(&mut self, signal: Signal, sample: &Sample) {
        let origin = *self.origin.get_or_insert(sample.step);
        let Some(row) = sample.step.checked_sub(origin).map(|r| r as usize).filter(|r| *r < self.flags.len() + MOST_AHEAD) else { return };
        for (index, columns) in self.axes.iter_mut().enumerate() {
            let of = |values: &[f64]| values.get(index).copied().unwrap_or(f64::NAN);
            match signal {
                Signal::Intent => put(&mut columns.intent, row, of(&sample.position)),
                Signal::Master => {
                    put(&mut columns.master, row, of(&sample.position));
                    put(&mut columns.force, row, of(&sample.effort));
                }
                Signal::Induced => put(&mut columns.induced, row, of(&sample.position)),
                Signal::Dither => put(&mut columns.dither, row, of(&sample.effort)),
                Signal::Command => put(&mut columns.command, row, of(&sample.position)),
                Signal::Slave => {
                    put(&mut columns.contact, row, of(&sample.effort));
                    put(&mut columns.slave, row, of(&sample.position));
                }
            }
        }
        if matches!(signal, Signal::Master | Signal::Slave) {
            if self.flags.len() <= row {
                self.flags.resize(row + 1, 0);
            }
            self.flags[row] |= sample.flags;
        }
    }

    /// Whether the master has left all bounds, for good: not finite, or beyond ten travels (10 m or rad where the device has none).
    pub fn ran_away(&self) -> bool {
        self.axes.iter().zip(&self.blank.axes).any(|(columns, axis)| {
            let span = axis.travel.map_or(1.0, |[low, high]| high - low);
            columns.master.last().is_some_and(|x| !x.is_finite() || x.abs() > 10.0 * span)
        })
    }

    /// Rows that both the master and the slave have.
    fn rows(&self) -> usize {
        self.axes.iter().map(|c| c.master.len().min(c.contact.len())).min().unwrap_or(0)
    }

    /// What a verdict is drawn from, per axis. A row whose message is missing keeps the value before it.
    ///
    /// On several axes the hand holds still when it does so on all of them, because one moves the others. The intent is then the path length of the
    /// hand, summed over its axes.
    pub fn traces(&self) -> Vec<Trace> {
        let rows = self.rows();
        let clamped: Vec<bool> = self.flags.iter().take(rows).map(|f| f & flag::LIMITED != 0).collect();
        let path = (self.axes.len() > 1).then(|| way(&self.axes.iter().map(|c| held(&c.intent, c.intent.len())).collect::<Vec<_>>()));
        let trace = |(columns, axis): (&Columns, &AxisSignals)| Trace {
            period_s: self.blank.period_s,
            intent: path.clone().unwrap_or_else(|| held(&columns.intent, columns.intent.len())),
            position: held(&columns.master, rows),
            contact: held(&columns.contact, rows),
            feedback: held(&columns.force, rows),
            slave: held(&columns.slave, columns.slave.len().min(rows)),
            mu: self.gains.last().map_or(1.0, |(_, mu, _)| *mu),
            closes: axis.closes,
            unit: axis.unit,
            dither: held(&columns.dither, columns.dither.len().min(rows)),
            clamped: clamped.clone(),
            travel: axis.travel,
            resolution: axis.resolution,
            noise: axis.noise,
            gaps: self.gaps(columns),
        };
        self.axes.iter().zip(&self.blank.axes).map(trace).collect()
    }

    /// Which rows lack a fresh sample of a signal of the loop.
    fn gaps(&self, columns: &Columns) -> Gaps {
        let heard = |signal: Signal| self.topics.iter().any(|(_, s)| *s == signal);
        // The intent of an operator that pushes by a force is no position.
        let silent = |column: &Vec<f64>| !column.is_empty() && column.iter().all(|x| x.is_nan());
        let intent = (heard(Signal::Intent) && !silent(&columns.intent)).then_some(&columns.intent);
        let command = (!columns.command.is_empty()).then_some(&columns.command);
        let loops: Vec<&Vec<f64>> = [Some(&columns.master), Some(&columns.contact), intent, command].into_iter().flatten().collect();
        let rows = loops.iter().map(|c| c.len()).max().unwrap_or(0);
        let stale = |row: usize| self.flags.get(row).is_some_and(|f| f & flag::STALE != 0);
        let lacks = |row: usize| stale(row) || loops.iter().any(|c| c.get(row).is_none_or(|x| x.is_nan()));
        Gaps { at: (0..rows).map(lacks).collect(), bridged_s: self.blank.bridged_s, planned: self.planned }
    }

    /// Why there is no loop whose stability could be asked about; `None` where there is one.
    pub fn no_loop(&self) -> Option<&'static str> {
        let touched = || self.axes.iter().any(|c| c.contact.iter().any(|f| f.is_finite() && *f != 0.0));
        let one_way = self.gains.iter().all(|(_, _, lambda)| *lambda == 0.0);
        match self.has {
            HasLoop::No => Some("the graph has no master, slave and coupling between them that could form one"),
            HasLoop::OnlyIfTouched | HasLoop::Yes if one_way => {
                Some("lambda is 0: no force is reflected to the hand, so there is no force feedback that could be unstable")
            }
            HasLoop::OnlyIfTouched if !touched() => Some("the slave has no environment, and this law reflects only the contact force"),
            HasLoop::OnlyIfTouched | HasLoop::Yes => None,
        }
    }

    /// The verdict on what was collected: the worst of the axes. `None` where there is no loop and nothing oscillates.
    pub fn outcome(&self) -> Option<Outcome> {
        let judged = || Outcome::worst(self.traces().iter().map(judge)).unwrap_or(Outcome::NotJudged { why: Unjudged::Empty });
        match self.no_loop() {
            None => Some(judged()),
            // A slave that oscillates by itself does so whether its force comes back or not.
            Some(_) if self.has != HasLoop::No => Some(judged()).filter(Outcome::is_unstable),
            Some(_) => None,
        }
    }

    /// The signals, one row per step.
    pub fn session(&self) -> Session {
        let rows = self.rows();
        let whole = |column: &Vec<f64>| {
            let mut column = column.clone();
            column.resize(rows, f64::NAN);
            column
        };
        let if_any = |column: &Vec<f64>| (!column.is_empty()).then(|| whole(column));
        let acted = flag::LIMITED | flag::STALE | flag::GUARDED;
        let clamped: Vec<bool> = (0..rows).map(|row| self.flags.get(row).is_some_and(|f| f & acted != 0)).collect();
        let stale: Vec<bool> = (0..rows).map(|row| self.flags.get(row).is_some_and(|f| f & flag::STALE != 0)).collect();
        let axes = self.axes.iter().zip(&self.blank.axes).map(|(columns, blank)| AxisSignals {
            intent: if_any(&columns.intent),
            master: whole(&columns.master),
            force: whole(&columns.force),
            dither: if_any(&columns.dither),
            induced: if_any(&columns.induced),
            command: whole(&columns.command),
            contact: whole(&columns.contact),
            slave: if_any(&columns.slave),
            clamped: clamped.clone(),
            stale: stale.clone(),
            ..blank.clone()
        });
        let (mut mu, mut lambda) = (vec![f64::NAN; rows], vec![f64::NAN; rows]);
        for (row, m, l) in &self.gains {
            let from = (*row).min(rows);
            mu[from..].fill(*m);
            lambda[from..].fill(*l);
        }
        Session { axes: axes.collect(), mu, lambda, ..self.blank.clone() }
    }

    /// mu*lambda as last reported.
    pub fn last_loop_gain(&self) -> f64 {
        self.gains.last().map_or(f64::NAN, |(_, mu, lambda)| mu * lambda)
    }
}

/// The way that a hand of several axes has come by each step: it holds still where this does.
pub(crate) fn way(intents: &[Vec<f64>]) -> Vec<f64> {
    let steps = intents.iter().map(Vec::len).min().unwrap_or(0);
    let mut come = 0.0;
    let moved = |step: usize| intents.iter().map(|x| (x[step] - x[step.saturating_sub(1)]).abs()).sum::<f64>();
    (0..steps)
        .map(|step| {
            come += moved(step);
            come
        })
        .collect()
}

#[inline]
fn put(column: &mut Vec<f64>, row: usize, value: f64) {
    if row == column.len() {
        column.push(value);
        return;
    }
    if row > column.len() {
        column.resize(row + 1, f64::NAN);
    }
    column[row] = value;
}

/// The column with its gaps filled by the value before them. What is not finite up to the end is no gap: the state was lost.
fn held(column: &[f64], rows: usize) -> Vec<f64> {
    let mut column = column[..rows.min(column.len())].to_vec();
    let lost_from = column.iter().rposition(|x| x.is_finite()).map_or(0, |last| last + 1);
    let mut before = column[..lost_from].iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    for value in &mut column[..lost_from] {
        if value.is_nan() {
            *value = before;
        }
        before = *value;
    }
    column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_held_and_a_lost_state_is_not() {
        let column = [f64::NAN, 1.0, f64::NAN, 2.0, f64::NAN];
        assert_eq!(held(&column, 4), [1.0, 1.0, 1.0, 2.0]);
        assert!(held(&column, 5)[4].is_nan());
        assert_eq!(held(&column, 9).len(), 5);
    }

    #[test]
    fn rows_follow_the_steps() {
        let mut column = Vec::new();
        put(&mut column, 0, 1.0);
        put(&mut column, 2, 3.0);
        assert!(column[1].is_nan());
        put(&mut column, 1, 2.0);
        assert_eq!(column, [1.0, 2.0, 3.0]);
    }
}
