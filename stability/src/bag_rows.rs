//! The rows of a session from the messages of a bag.

use crate::collect::closes;
use crate::outcome::Unit;
use crate::session::{AxisSignals, Session};
use crate::signal_role::{SessionError, SignalRole, cut_short, required};
use backdrive_bags::{Entry, Reader};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::scaling::Backward;
use backdrive_msgs::{Message, Sample, flag};
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use std::path::PathBuf;

/// Where in a bag the signals of its graph are.
pub(crate) struct Place {
    path: PathBuf,
    master: usize,
    pub(crate) axes: usize,
    /// Topics that are read.
    wanted: Vec<(String, SignalRole)>,
    /// By topic of the bag: its place in `wanted`.
    places: Vec<Option<usize>>,
    /// Of the topic of the gains in the bag.
    gains: Option<usize>,
    notes: Vec<String>,
}

impl Place {
    pub(crate) fn of(reader: &Reader, graph: &Graph) -> Result<Place, SessionError> {
        let path = reader.path().to_owned();
        let node = |kind: NodeKind| graph.nodes.iter().position(|n| n.kind == kind);
        let no_node = |role: SignalRole, kind: NodeKind| missing(&path, role, format!("the graph has no {} node", kind.name()));

        let master = node(NodeKind::Master).ok_or_else(|| no_node(SignalRole::Master, NodeKind::Master))?;
        // Scaling, or a coupling in its place.
        let scaling =
            graph.nodes.iter().position(|n| n.kind.closes_loop()).ok_or_else(|| no_node(SignalRole::Command, NodeKind::Scaling))?;
        let slave = node(NodeKind::Slave).ok_or_else(|| no_node(SignalRole::Contact, NodeKind::Slave))?;
        let axes = graph.nodes[master].axes.min(graph.nodes[slave].axes);
        let mut notes = Vec::new();

        let mut wanted = Vec::new();
        let mut hear = |node: usize, port: &str, role: SignalRole| wanted.push((graph.topic_of(node, port).name, role));
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
        let places = reader.topics().iter().map(|t| wanted.iter().position(|(topic, _)| *topic == t.name)).collect();
        let gains = reader.topics().iter().position(|t| t.name == gains_topic);
        Ok(Place { path, master, axes, wanted, places, gains, notes })
    }

    /// The place in what is heard of a message's topic; `None` where it is none that is read, the gains aside.
    pub(crate) fn heard(&self, entry: &Entry) -> Option<usize> {
        self.places.get(entry.topic.index).copied().flatten()
    }

    /// The message, if its topic is read or reports the gains.
    pub(crate) fn message(&self, entry: &Entry) -> Result<Option<Message>, SessionError> {
        if self.heard(entry).is_none() && self.gains != Some(entry.topic.index) {
            return Ok(None);
        }
        Ok(entry.message(&self.path)?)
    }
}

fn missing(path: &std::path::Path, role: SignalRole, why: String) -> SessionError {
    SessionError::Missing { path: path.to_owned(), signal: role.text(), why, without: role.without() }
}

/// The samples of a topic, one after the other.
#[derive(Default)]
struct Heard {
    steps: Vec<u64>,
    flags: Vec<u32>,
    /// Position and effort of every axis, axis after axis, sample after sample.
    values: Vec<[f64; 2]>,
}

/// A bag may hold this many steps more than messages before its steps count as damaged.
pub(crate) const MOST_EMPTY_STEPS: u64 = 10_000_000;

/// What was heard of the topics of a place.
pub(crate) struct Rows {
    heard: Vec<Heard>,
    /// Step, mu, lambda.
    pub(crate) gains: Vec<(u64, f64, f64)>,
}

impl Rows {
    pub(crate) fn of(place: &Place) -> Rows {
        Rows { heard: place.wanted.iter().map(|_| Heard::default()).collect(), gains: Vec::new() }
    }

    /// Hears a message of the bag.
    pub(crate) fn take(&mut self, place: &Place, entry: &Entry) -> Result<(), SessionError> {
        match (place.message(entry)?, place.heard(entry)) {
            (Some(Message::Sample(sample)), Some(index)) => self.hear(place, index, &sample),
            (Some(Message::Gains(g)), None) => self.gains.push((g.step, g.mu, g.lambda)),
            _ => {}
        }
        Ok(())
    }

    /// Hears a sample of the topic at this place.
    pub(crate) fn hear(&mut self, place: &Place, index: usize, sample: &Sample) {
        let Some(heard) = self.heard.get_mut(index) else { return };
        heard.steps.push(sample.step);
        heard.flags.push(sample.flags);
        let at = |list: &[f64], axis: usize| list.get(axis).copied().filter(|_| axis < sample.len()).unwrap_or(f64::NAN);
        heard.values.extend((0..place.axes).map(|axis| [at(&sample.position, axis), at(&sample.effort, axis)]));
    }

    /// The session that they make.
    pub(crate) fn session(mut self, reader: &Reader, graph: &Graph, place: &Place) -> Result<Session, SessionError> {
        let Place { path, master, axes, wanted, .. } = place;
        let mut notes = place.notes.clone();
        for ((topic, role), heard) in wanted.iter().zip(&self.heard) {
            if !heard.steps.is_empty() {
                continue;
            }
            let why = match reader.topic(topic) {
                Ok(_) => format!("its topic {topic} has no message"),
                Err(_) => format!("the bag has no topic {topic}"),
            };
            match role {
                SignalRole::Master | SignalRole::Command | SignalRole::Contact => return Err(missing(path, *role, why)),
                SignalRole::Force => notes.push(format!("{why}: whether the guard acted is not known")),
                role => notes.push(format!("{} is missing: {why}; {}", role.text(), role.without())),
            }
        }
        if !reader.ended_cleanly() {
            notes.push("the bag was cut off; its remaining content is used".to_owned());
        }

        let dense = || wanted.iter().zip(&self.heard).filter(|((_, role), _)| *role != SignalRole::Force);
        let steps = || dense().flat_map(|(_, heard)| heard.steps.iter().copied());
        let (first, last) = (steps().min().unwrap_or(0), steps().max().unwrap_or(0));
        let messages = self.heard.iter().map(|h| h.steps.len() as u64).sum::<u64>();
        check_steps(path, first, last, messages)?;
        let rows = (last - first) as usize + 1;
        let mut signals: Vec<AxisSignals> = (0..*axes).map(|axis| blank(graph, *master, axis, rows)).collect();
        for ((topic, role), heard) in wanted.iter().zip(&self.heard) {
            note_holes(topic, *role, heard, rows, &mut notes);
            for (axis, signals) in signals.iter_mut().enumerate() {
                lay(*role, heard, [axis, *axes], first, signals);
            }
        }
        self.heard.clear();
        for axis in &mut signals {
            drop_silent(axis, &mut notes);
            for (role, column) in required(axis) {
                if column.iter().all(|x| x.is_nan()) {
                    return Err(missing(path, role, format!("axis {} was never measured", axis.name)));
                }
            }
        }
        let (mu, lambda) = gain_rows(graph, first, rows, &mut self.gains, &mut notes);
        Ok(Session {
            name: path.display().to_string(),
            period_s: graph.period_s(),
            axes: signals,
            mu,
            lambda,
            notes,
            sensors: Vec::new(),
            parts: Vec::new(),
            cut_short: cut_short(reader, graph.timing.steps.unwrap_or(0) as usize, rows),
            elsewhere: None,
            bridged_s: graph.stale_after_s,
        })
    }
}

/// Whether steps from the first to the last can be rows.
pub(crate) fn check_steps(path: &std::path::Path, first: u64, last: u64, messages: u64) -> Result<(), SessionError> {
    if last - first > messages + MOST_EMPTY_STEPS {
        let what = format!("steps run from {first} to {last} in {messages} messages; the bag is damaged (`backdrive bag recover`)");
        return Err(SessionError::Rows { path: path.to_owned(), what });
    }
    Ok(())
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
        unit: model.map_or(Unit::Unknown, |m| Unit::of(m.motion)),
        closes: closes(graph),
        ..AxisSignals::default()
    }
}

/// Puts the samples of a topic where they belong.
fn lay(role: SignalRole, heard: &Heard, [axis, axes]: [usize; 2], first: u64, signals: &mut AxisSignals) {
    const POSITION: usize = 0;
    const EFFORT: usize = 1;
    let rows = signals.master.len();
    let put = |column: &mut Vec<f64>, quantity: usize| {
        column.resize(rows, f64::NAN);
        for (step, value) in heard.steps.iter().zip(heard.values.iter().skip(axis).step_by(axes.max(1))) {
            let row = step.checked_sub(first).map(|r| r as usize);
            if let Some(slot) = row.and_then(|r| column.get_mut(r)) {
                *slot = value[quantity];
            }
        }
    };
    let filled = !heard.steps.is_empty();
    match role {
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
        // Our bags record nothing about motors; a slave's servo is in its model.
        SignalRole::SlaveForce | SignalRole::Hand | SignalRole::Sensor => {}
    }
    for (step, flags) in heard.steps.iter().zip(&heard.flags) {
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

/// An optional signal without any value on an axis counts as absent.
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
        notes.push(format!("axis {}: the dither is always 0", axis.name));
        axis.dither = None;
    }
}

fn note_holes(topic: &str, role: SignalRole, heard: &Heard, rows: usize, notes: &mut Vec<String>) {
    if heard.steps.is_empty() || role == SignalRole::Force {
        return;
    }
    let mut steps = heard.steps.clone();
    steps.sort_unstable();
    steps.dedup();
    let holes = rows.saturating_sub(steps.len());
    if holes > 0 {
        notes.push(format!("{topic}: {holes} of {rows} rows have no message"));
    }
}

/// The gains in force at each row: as reported, and before the first report as in the graph's plan.
fn gain_rows(graph: &Graph, first: u64, rows: usize, told: &mut [(u64, f64, f64)], notes: &mut Vec<String>) -> (Vec<f64>, Vec<f64>) {
    told.sort_by_key(|t| t.0); // stable: of two at one step the later counts
    if told.is_empty() {
        notes.push("the gains are those planned in the graph: the bag has no message with the actual gains".to_owned());
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
        notes.push(format!("mu*lambda changes from {low:.4} to {high:.4}: each answer uses a part at one gain"));
    }
    (mu, lambda)
}
