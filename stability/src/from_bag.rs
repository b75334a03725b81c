//! A session from a bag of ours: the graph in the bag tells which topic is which signal.

use crate::session::{AxisSignals, Session};
use crate::unjudged::Unjudged;
use backdrive_bags::{BagError, Reader};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::scaling::Backward;
use backdrive_msgs::{Message, Sample, flag};
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::tomlfile::FileError;
use std::path::PathBuf;

/// Why a bag cannot be read as a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A roles file cannot be read.
    #[error(transparent)]
    Roles(#[from] FileError),
    /// A signal that no answer can do without.
    #[error("{}: {signal} is missing: {why}; without it {without}", path.display())]
    Missing {
        /// The bag.
        path: PathBuf,
        /// Such as `F_s, the force of the environment on the slave`.
        signal: &'static str,
        /// Why.
        why: String,
        /// What cannot be told without it.
        without: &'static str,
    },
    /// The messages make no rows.
    #[error("{}: {what}", path.display())]
    Rows {
        /// The bag.
        path: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// A storage that is not read.
    #[error("{}: {what}", path.display())]
    Storage {
        /// File or folder.
        path: PathBuf,
        /// What it is, and how to convert it.
        what: String,
    },
}

/// The signals of a session: what they are, and what cannot be told without them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SignalRole {
    Master,
    Force,
    Command,
    Contact,
    Slave,
    Dither,
    Intent,
    Induced,
    SlaveForce,
    Hand,
    /// Another sensor, which no answer needs.
    Sensor,
}

impl SignalRole {
    /// For messages.
    pub(crate) fn text(self) -> &'static str {
        match self {
            SignalRole::Master => "x_m, the master's measured position",
            SignalRole::Force => "F_f, the force applied to the master",
            SignalRole::Command => "x_c, the slave's commanded position",
            SignalRole::Contact => "F_s, the force of the environment on the slave",
            SignalRole::Slave => "x_s, the slave's position",
            SignalRole::Dither => "the dither",
            SignalRole::Intent => "x_u, the operator's intent",
            SignalRole::Induced => "the canceller's predicted induced motion",
            SignalRole::SlaveForce => "tau_s, the force of the slave's motor",
            SignalRole::Hand => "F_h, the force of the hand on the master",
            SignalRole::Sensor => "another sensor",
        }
    }

    /// What cannot be told where it is missing.
    pub(crate) fn without(self) -> &'static str {
        match self {
            SignalRole::Master => "neither the induced motion nor the loop can be told, nor whether the master oscillates",
            SignalRole::Force => "neither how the master answers a force nor the loop can be told",
            SignalRole::Command => "neither how the slave answers a command nor the loop can be told",
            SignalRole::Contact => "neither what the slave touches nor the loop can be told",
            SignalRole::Slave => "the environment's impedance is told against the command in place of the slave's motion",
            SignalRole::Dither => "the master's answer to a force can be told against a recorded operator only",
            SignalRole::Intent => "the loop cannot be run again with this hand, and rest is told by the signals alone",
            SignalRole::Induced => "what was cancelled is not known from the record",
            SignalRole::SlaveForce => "the law that couples the two motors cannot be told",
            SignalRole::Sensor => "its faults are not known",
            SignalRole::Hand => "a coupling that carries the hand's force to the slave cannot be told",
        }
    }
}

/// A topic that is read, and the values of its samples by step.
struct Heard {
    topic: String,
    role: SignalRole,
    /// Step, flags, then position and effort of every axis.
    rows: Vec<(u64, u32, Vec<[f64; 2]>)>,
}

/// A bag may hold this many steps more than messages before its steps count as damaged.
const MOST_EMPTY_STEPS: u64 = 10_000_000;

impl Session {
    /// Reads a bag of ours in one pass; `graph` is the one that made it.
    ///
    /// Rows are steps, from the first that any signal has to the last. What a topic lacks is NaN and counted in the notes.
    ///
    /// # Errors
    /// A damaged bag; x_m, F_f, x_c or F_s missing; steps that make no rows.
    pub fn from_bag(reader: &Reader, graph: &Graph) -> Result<Session, SessionError> {
        let path = reader.path().to_owned();
        let node = |kind: NodeKind| graph.nodes.iter().position(|n| n.kind == kind);
        let missing =
            |role: SignalRole, why: String| SessionError::Missing { path: path.clone(), signal: role.text(), why, without: role.without() };
        let no_node = |role: SignalRole, kind: NodeKind| missing(role, format!("the graph has no {} node", kind.name()));

        let master = node(NodeKind::Master).ok_or_else(|| no_node(SignalRole::Master, NodeKind::Master))?;
        // Scaling, or a coupling in its place.
        let scaling =
            graph.nodes.iter().position(|n| n.kind.closes_loop()).ok_or_else(|| no_node(SignalRole::Command, NodeKind::Scaling))?;
        let slave = node(NodeKind::Slave).ok_or_else(|| no_node(SignalRole::Contact, NodeKind::Slave))?;
        let axes = graph.nodes[master].axes.min(graph.nodes[slave].axes);
        let mut notes = Vec::new();

        let mut heard: Vec<Heard> = Vec::new();
        let mut hear = |node: usize, port: &str, role: SignalRole| {
            heard.push(Heard { topic: graph.topic_of(node, port).name, role, rows: Vec::new() });
        };
        hear(master, "measured", SignalRole::Master);
        hear(scaling, "command", SignalRole::Command);
        hear(slave, "measured", SignalRole::Contact);
        // Only its flags: whether the guard acted.
        hear(scaling, "force", SignalRole::Force);
        if matches!(&graph.nodes[scaling].settings, Settings::Scaling { dither, .. } if !dither.is_empty()) {
            hear(scaling, "dither", SignalRole::Dither);
        }
        match node(NodeKind::Operator) {
            Some(operator) => hear(operator, "intent", SignalRole::Intent),
            None => notes.push(format!("the graph has no operator: {}", SignalRole::Intent.without())),
        }
        let cancels = |n: usize| matches!(&graph.nodes[n].settings, Settings::Canceller(files, ..) if files.model.is_some());
        if let Some(canceller) = node(NodeKind::Canceller).filter(|n| cancels(*n)) {
            hear(canceller, "induced", SignalRole::Induced);
        }

        let gains_topic = format!("/{}/gains", graph.nodes[scaling].name);
        let mut gains: Vec<(u64, f64, f64)> = Vec::new();
        let places: Vec<Option<usize>> = reader.topics().iter().map(|t| heard.iter().position(|h| h.topic == t.name)).collect();
        let gains_index = reader.topics().iter().position(|t| t.name == gains_topic);
        for entry in reader.messages()? {
            let entry = entry?;
            let place = places.get(entry.topic.index).copied().flatten();
            if place.is_none() && gains_index != Some(entry.topic.index) {
                continue;
            }
            match (entry.message(&path)?, place.and_then(|p| heard.get_mut(p))) {
                (Some(Message::Sample(sample)), Some(heard)) => heard.rows.push((sample.step, sample.flags, values(&sample, axes))),
                (Some(Message::Gains(g)), None) => gains.push((g.step, g.mu, g.lambda)),
                _ => {}
            }
        }
        for topic in &heard {
            if !topic.rows.is_empty() {
                continue;
            }
            let why = match reader.topic(&topic.topic) {
                Ok(_) => format!("its topic {} has no message", topic.topic),
                Err(_) => format!("the bag has no topic {}", topic.topic),
            };
            match topic.role {
                SignalRole::Master | SignalRole::Command | SignalRole::Contact => return Err(missing(topic.role, why)),
                SignalRole::Force => notes.push(format!("{why}: whether the guard acted is not known")),
                role => notes.push(format!("{} is missing: {why}; {}", role.text(), role.without())),
            }
        }
        if !reader.ended_cleanly() {
            notes.push("the bag was cut off; what it holds is used".to_owned());
        }

        let steps = || heard.iter().filter(|h| h.role != SignalRole::Force).flat_map(|h| h.rows.iter().map(|r| r.0));
        let (first, last) = (steps().min().unwrap_or(0), steps().max().unwrap_or(0));
        let messages = heard.iter().map(|h| h.rows.len() as u64).sum::<u64>();
        if last - first > messages + MOST_EMPTY_STEPS {
            let what = format!("steps run from {first} to {last} in {messages} messages; the bag is damaged (`backdrive bag recover`)");
            return Err(SessionError::Rows { path, what });
        }
        let rows = (last - first) as usize + 1;
        let mut signals: Vec<AxisSignals> = (0..axes).map(|axis| blank(graph, master, axis, rows)).collect();
        for topic in &heard {
            note_holes(topic, rows, &mut notes);
            for (axis, signals) in signals.iter_mut().enumerate() {
                lay(topic, axis, first, signals);
            }
        }
        for axis in &mut signals {
            drop_silent(axis, &mut notes);
            for (role, column) in required(axis) {
                if column.iter().all(|x| x.is_nan()) {
                    return Err(missing(role, format!("axis {} was never measured", axis.name)));
                }
            }
        }
        let (mu, lambda) = gain_rows(graph, first, rows, &mut gains, &mut notes);
        let name = path.display().to_string();
        let cut_short = cut_short(reader, graph.timing.steps.unwrap_or(0) as usize, rows);
        Ok(Session {
            name,
            period_s: graph.period_s(),
            axes: signals,
            mu,
            lambda,
            notes,
            sensors: Vec::new(),
            cut_short,
            bridged_s: graph.stale_after_s,
        })
    }
}

/// Whether the end of a run of `planned` steps (0: until it was stopped) is not in its bag, which holds `rows` steps of it.
pub fn cut_short(reader: &Reader, planned: usize, rows: usize) -> Option<Unjudged> {
    if planned > rows {
        return Some(Unjudged::CutShort { steps: rows, of: planned });
    }
    let recovered = reader.completeness().is_some_and(|c| c.recovered);
    // A bag that was recovered and has every step of the plan is whole.
    (!reader.ended_cleanly() || (recovered && planned == 0)).then_some(Unjudged::NotClosed)
}

fn values(sample: &Sample, axes: usize) -> Vec<[f64; 2]> {
    let at = |list: &[f64], axis: usize| list.get(axis).copied().filter(|_| axis < sample.len()).unwrap_or(f64::NAN);
    (0..axes).map(|axis| [at(&sample.position, axis), at(&sample.effort, axis)]).collect()
}

fn blank(graph: &Graph, master: usize, axis: usize, rows: usize) -> AxisSignals {
    let node = &graph.nodes[master];
    let model = match &node.settings {
        Settings::Master(files) => files.model.as_ref(),
        _ => None,
    };
    let known = model.and_then(|m| m.axes.get(axis).and_then(|a| m.outputs.get(a.measured).map(|output| (a, output))));
    let empty = || vec![f64::NAN; rows];
    AxisSignals {
        name: node.axis_names.get(axis).cloned().unwrap_or_else(|| format!("axis{axis}")),
        master: empty(),
        force: empty(),
        command: empty(),
        contact: empty(),
        clamped: vec![false; rows],
        travel: known.and_then(|(axis, _)| axis.travel),
        resolution: known.map_or(0.0, |(axis, output)| axis.scale.abs() * output.resolution),
        noise: known.map_or(0.0, |(axis, output)| axis.scale.abs() * output.noise),
        ..AxisSignals::default()
    }
}

/// Puts the samples of a topic where they belong.
fn lay(topic: &Heard, axis: usize, first: u64, signals: &mut AxisSignals) {
    const POSITION: usize = 0;
    const EFFORT: usize = 1;
    let rows = signals.master.len();
    let put = |column: &mut Vec<f64>, quantity: usize| {
        column.resize(rows, f64::NAN);
        for (step, _, values) in &topic.rows {
            let row = step.checked_sub(first).map(|r| r as usize);
            if let (Some(slot), Some(value)) = (row.and_then(|r| column.get_mut(r)), values.get(axis)) {
                *slot = value[quantity];
            }
        }
    };
    let filled = !topic.rows.is_empty();
    match topic.role {
        SignalRole::Master => {
            put(&mut signals.master, POSITION);
            put(&mut signals.force, EFFORT);
        }
        SignalRole::Command => put(&mut signals.command, POSITION),
        SignalRole::Contact => {
            put(&mut signals.contact, EFFORT);
            put(signals.slave.get_or_insert_default(), POSITION);
        }
        SignalRole::Dither if filled => put(signals.dither.get_or_insert_default(), EFFORT),
        SignalRole::Intent if filled => put(signals.intent.get_or_insert_default(), POSITION),
        SignalRole::Induced if filled => put(signals.induced.get_or_insert_default(), POSITION),
        SignalRole::Dither | SignalRole::Intent | SignalRole::Induced => {}
        // Of the scaling's force only the flags count, and the slave's motion comes with its contact force.
        SignalRole::Force | SignalRole::Slave => {}
        // Of motors no bag of ours tells; a slave's servo is in its model.
        SignalRole::SlaveForce | SignalRole::Hand | SignalRole::Sensor => {}
    }
    for (step, flags, _) in &topic.rows {
        let row = step.checked_sub(first).map(|r| r as usize);
        if flags & (flag::LIMITED | flag::STALE | flag::GUARDED) != 0
            && let Some(slot) = row.and_then(|r| signals.clamped.get_mut(r))
        {
            *slot = true;
        }
        if flags & flag::STALE != 0
            && let Some(row) = row.filter(|r| *r < rows)
        {
            signals.stale.resize(rows, false);
            signals.stale[row] = true;
        }
    }
}

/// The signals that no answer can do without.
pub(crate) fn required(axis: &AxisSignals) -> [(SignalRole, &Vec<f64>); 4] {
    [
        (SignalRole::Master, &axis.master),
        (SignalRole::Force, &axis.force),
        (SignalRole::Command, &axis.command),
        (SignalRole::Contact, &axis.contact),
    ]
}

/// An optional signal that says nothing on an axis is none.
fn drop_silent(axis: &mut AxisSignals, notes: &mut Vec<String>) {
    let silent = |column: &Option<Vec<f64>>| column.as_ref().is_some_and(|c| c.iter().all(|x| x.is_nan()));
    if silent(&axis.intent) {
        axis.intent = None;
    }
    if silent(&axis.induced) {
        axis.induced = None;
    }
    if silent(&axis.slave) {
        axis.slave = None;
    }
    if axis.dither.as_ref().is_some_and(|d| d.iter().all(|x| x.is_nan() || *x == 0.0)) {
        notes.push(format!("axis {}: the dither is 0 throughout", axis.name));
        axis.dither = None;
    }
}

fn note_holes(topic: &Heard, rows: usize, notes: &mut Vec<String>) {
    if topic.rows.is_empty() || topic.role == SignalRole::Force {
        return;
    }
    let mut steps: Vec<u64> = topic.rows.iter().map(|r| r.0).collect();
    steps.sort_unstable();
    steps.dedup();
    let holes = rows.saturating_sub(steps.len());
    if holes > 0 {
        notes.push(format!("{}: {holes} of {rows} rows have no message", topic.topic));
    }
}

/// The gains in force at each row: as told, and before the first that was told as the graph's plan says.
fn gain_rows(graph: &Graph, first: u64, rows: usize, told: &mut [(u64, f64, f64)], notes: &mut Vec<String>) -> (Vec<f64>, Vec<f64>) {
    told.sort_by_key(|t| t.0); // stable: of two at one step the later counts
    if told.is_empty() {
        notes.push("the gains are the graph's plan: the bag has no message of those in force".to_owned());
    }
    let period_s = graph.period_s();
    // The scaling's own core follows the plan, so that both ramp alike.
    let mut core = Backward::new(graph.gains.clone(), Vec::new(), None, period_s);
    let mut outputs = [Sample::new(0), Sample::new(0)];
    let first_told = told.first().map_or(u64::MAX, |t| t.0);
    let (mut mu, mut lambda) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    let mut next = 0;
    let mut now = (graph.gains.mu, graph.gains.lambda);
    if first_told > first {
        for step in 0..first.min(MOST_EMPTY_STEPS) {
            core.step(&Tick { step, time_s: step as f64 * period_s, period_s }, &[Port::EMPTY; 2], &mut outputs, &mut Events::default());
        }
    }
    for step in first..first + rows as u64 {
        if step < first_told {
            core.step(&Tick { step, time_s: step as f64 * period_s, period_s }, &[Port::EMPTY; 2], &mut outputs, &mut Events::default());
            now = core.gains().unwrap_or(now);
        }
        while let Some((_, m, l)) = told.get(next).filter(|t| t.0 <= step) {
            now = (*m, *l);
            next += 1;
        }
        mu.push(now.0);
        lambda.push(now.1);
    }
    let products = || mu.iter().zip(&lambda).map(|(m, l)| m * l);
    let (low, high) = products().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), g| (a.min(g), b.max(g)));
    if high - low > 1e-9 * high.abs() {
        notes.push(format!("mu*lambda runs from {low:.4} to {high:.4}: each answer is of a piece at one gain"));
    }
    (mu, lambda)
}
