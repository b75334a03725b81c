//! `backdrive stability`: would the loop of a bag be stable at another gain, and how far away is the edge.

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use crate::progress;
use crate::summary::graph_of;
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::edge::Search;
use backdrive_stability::resimulate::recover::{recorded_intents, recover_intent};
use backdrive_stability::resimulate::script::Script;
use backdrive_stability::resimulate::sweep::sweep;
use backdrive_stability::resimulate::{Gain, ResimulateError, Run, RunOptions, Scenario};
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::{Answer, AnswerError, Question, Swapped, Word, answer};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

/// One gain of a sweep.
pub type Point = (f64, Run);

/// Answers.
pub fn stability(options: &cli::Stability) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;

    let loaded = progress::busy(&format!("reading {}", options.recording.display()), || Loaded::read(options))?;
    let question = loaded.question(options)?;
    if let Some(html) = &options.html {
        // A report that cannot be written is told before the work, not after it.
        output::writable(html)?;
    }
    let curve = match &options.sweep {
        Some(gains) => Some(curve(&question, &gains.0, &cancel)?),
        None => None,
    };
    let bar = progress::work();
    let hear = |what: &str, done: usize, all: usize| {
        bar.set_message(what.to_string());
        bar.set_length(all.max(1) as u64);
        bar.set_position(done as u64);
    };
    let found = answer(&question, &hear, &cancel);
    bar.finish_and_clear();
    let found = match found {
        Ok(found) => Some(found),
        // What was done until then is printed.
        Err(AnswerError::Resimulate(ResimulateError::Cancelled)) => None,
        Err(e) => return Err(Failure::input(format!("{}: {e}", options.recording.display()))),
    };
    if options.json {
        let mut all = found.as_ref().map_or(json!({ "bag": question.session.name, "verdict": "interrupted" }), Answer::json);
        if let Some(curve) = &curve {
            all["sweep"] = Value::Array(curve.iter().flatten().map(point_json).collect());
        }
        output::line(format_args!("{all}"))?;
    } else {
        if let Some(curve) = &curve {
            output::line(curve_text(curve))?;
        }
        if let Some(found) = &found {
            output::line(text(found))?;
        }
    }
    let interrupted = || Failure { code: code::INTERRUPTED, message: "stopped; what was done until then is above".to_string() };
    let found = found.ok_or_else(interrupted)?;
    if let Some(html) = &options.html {
        let points: Vec<&Point> = curve.iter().flatten().flatten().collect();
        let page = crate::stability_page::page(&found, question.session, &points);
        output::file(html, page.html())?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if cancel.load(Ordering::SeqCst) {
        return Err(interrupted());
    }
    Ok(match found.verdict {
        Word::Stable => 0,
        Word::CannotTell => code::CANNOT_TELL,
        _ => code::NEGATIVE,
    })
}

/// Gain products that can be asked about. Beyond them the rounding of forces and positions decides, not the loop.
const SENSIBLE: [f64; 2] = [1e-6, 1e6];

/// What a bag holds.
struct Loaded {
    session: Session,
    recorded: Option<Graph>,
    asked: Option<Graph>,
    intents: Option<Vec<Intent>>,
}

impl Loaded {
    fn read(options: &cli::Stability) -> Result<Loaded, Failure> {
        let path = &options.recording;
        let changes = options.parts.overrides();
        if let Some(roles) = &options.roles {
            if changes != Overrides::default() {
                return Err(Failure::input(format!(
                    "{}: holds no graph, so no part of it can be exchanged; leave the part's option out",
                    path.display()
                )));
            }
            let roles = Roles::load(roles)?;
            let session = Session::from_roles(path, &roles).map_err(Failure::input)?;
            return Ok(Loaded { session, recorded: None, asked: None, intents: None });
        }
        if path.is_dir() {
            return Err(Failure::input(which_bag(path)));
        }
        let reader = Reader::open(path).map_err(Failure::input)?;
        let hint = |f: Failure| Failure { message: format!("{}; a bag that we did not record needs --roles FILE", f.message), ..f };
        let recorded = graph_of(&reader, &Overrides::default()).map_err(hint)?;
        let asked = graph_of(&reader, &changes)?;
        let mut session = Session::from_bag(&reader, &recorded).map_err(Failure::input)?;
        if !reader.ended_cleanly() {
            session.notes.push("the bag was not closed: what it holds is used, and `backdrive bag recover` makes a clean copy".to_string());
        }
        let mut intents = recorded_intents(&session);
        if intents.is_none() && options.script.is_none() {
            match recover_intent(&session, &recorded) {
                Ok(found) => {
                    let worst = |values: &[f64]| values.iter().fold(0.0_f64, |a, b| a.max(*b));
                    session.notes.push(format!(
                        "the hand was not recorded: it was recovered from x_m and F_f by the master's model, which leaves {:.2} % of x_m's range; \
                         dry friction hides where it was within {:.2} mm",
                        100.0 * worst(&found.residual),
                        1e3 * worst(&found.ambiguity)
                    ));
                    intents = Some(found.intents);
                }
                Err(e) => session.notes.push(format!("the hand was not recorded and could not be recovered: {e}")),
            }
        }
        Ok(Loaded { session, recorded: Some(recorded), asked: Some(asked), intents })
    }

    fn question(&self, options: &cli::Stability) -> Result<Question<'_>, Failure> {
        let parts = &options.parts;
        // The sensors and limits of a device belong to its model.
        let mut swapped = Swapped {
            master: parts.master.is_some() || parts.grip.is_some(),
            canceller: parts.canceller.is_some() || parts.canceller_grip.is_some() || parts.high_pass.is_some(),
            slave: parts.slave.is_some() || parts.environment.is_some(),
        };
        if let Some(asked) = &self.asked {
            swapped.canceller &= asked.node_of(NodeKind::Canceller).is_some();
        }
        let own = self.own_gain();
        let gain = match (options.gain, options.mu, options.lambda) {
            (Some(product), ..) => Gain { mu: own.mu, lambda: product / own.mu },
            (None, mu, lambda) => Gain { mu: mu.unwrap_or(own.mu), lambda: lambda.unwrap_or(own.lambda) },
        };
        if gain.product() <= 0.0 {
            return Err(Failure::input(format!(
                "{}: was recorded at mu*lambda = {}; say with --gain which gain is asked about",
                options.recording.display(),
                gain.product()
            )));
        }
        if !(SENSIBLE[0]..=SENSIBLE[1]).contains(&gain.product()) {
            return Err(Failure::input(format!(
                "mu*lambda = {:e} is beyond any sense: gains from {:e} to {:e} can be asked about, and edges are looked for from {:e} to {}",
                gain.product(),
                SENSIBLE[0],
                SENSIBLE[1],
                Search::default().floor,
                Search::default().highest
            )));
        }
        let script = options.script.as_deref().map(Script::from_graph).transpose()?;
        let search = Search::default();
        Ok(Question {
            session: &self.session,
            recorded: self.recorded.as_ref(),
            asked: self.asked.as_ref(),
            swapped,
            intents: self.intents.clone(),
            script,
            gain,
            grips: options.grips.clone(),
            search,
        })
    }

    /// The gain of most of the recording.
    fn own_gain(&self) -> Gain {
        let median = |column: &[f64]| {
            let mut values: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let graph = self.recorded.as_ref().map(|g| (g.gains.mu, g.gains.lambda));
        let mu = median(&self.session.mu).or(graph.map(|g| g.0)).unwrap_or(1.0);
        let lambda = median(&self.session.lambda).or(graph.map(|g| g.1)).unwrap_or(1.0);
        Gain { mu: if mu == 0.0 { 1.0 } else { mu }, lambda }
    }
}

/// What of a folder to name.
fn which_bag(folder: &std::path::Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut bags: Vec<String> = entries.filter(|p| p.extension().is_some_and(|e| e == "mcap")).map(|p| p.display().to_string()).collect();
    bags.sort();
    let name = folder.display();
    match &bags[..] {
        [] => format!("{name}: is a folder without a bag; name the .mcap file of a run"),
        [one] => format!("{name}: is a folder; name the bag in it, {one}, or with --roles FILE the folder as a rosbag2 recording"),
        [first, rest @ ..] => format!(
            "{name}: is a folder of {} bags; name one of them, such as {first}, or with --roles FILE the folder as a rosbag2 recording",
            rest.len() + 1
        ),
    }
}

/// Runs the loop again at every gain.
fn curve(question: &Question, gains: &[f64], cancel: &AtomicBool) -> Result<Vec<Option<Point>>, Failure> {
    let no = |why: &str| Failure::input(format!("{}: a sweep runs the loop again, and {why}", question.session.name));
    let graph = question.asked.ok_or_else(|| no("this bag holds no models"))?;
    if question.intents.is_none() && question.script.is_none() {
        return Err(no("its hand was not recorded and could not be recovered; name one with --script"));
    }
    let rows = question.session.len() as u64;
    let mut scenario = Scenario::new(graph.clone(), question.intents.clone(), Some(rows)).map_err(Failure::input)?;
    if let Some(script) = &question.script {
        scenario = scenario.with_script(script);
    }
    let bar = progress::work();
    bar.set_message("sweep");
    bar.set_length(gains.len() as u64);
    let done = sweep(&scenario, gains, &RunOptions::default(), &|done| bar.set_position(done as u64), cancel);
    bar.finish_and_clear();
    done.map_err(Failure::input)
}

fn point_json((gain, run): &Point) -> Value {
    json!({ "gain": gain, "verdict": run.outcome.word(), "outcome": run.outcome, "contact_s": run.contact_s })
}

/// Ranges of gains with one verdict.
fn curve_text(curve: &[Option<Point>]) -> String {
    let done: Vec<&Point> = curve.iter().flatten().collect();
    let mut lines = Vec::new();
    let mut from = 0;
    for i in 0..done.len() {
        let last = i + 1 == done.len() || done[i + 1].1.outcome.word() != done[i].1.outcome.word();
        if last {
            let (a, b) = (done[from], done[i]);
            let ends = match (&a.1.outcome, &b.1.outcome) {
                (Outcome::Stable, _) => "stable".to_string(),
                (x, y) if from < i => format!("{x} ... {y}"),
                (x, _) => x.to_string(),
            };
            lines.push(format!("sweep    {:>8.3} to {:>8.3}  {ends}", a.0, b.0));
            from = i + 1;
        }
    }
    if done.len() < curve.len() {
        lines.push(format!("sweep    stopped after {} of {} gains", done.len(), curve.len()));
    }
    lines.join("\n")
}

fn interval((low, high): (f64, Option<f64>)) -> String {
    match high {
        Some(high) => format!("{low:.3} to {high:.3}"),
        None => format!("{low:.3} or more"),
    }
}

/// A few lines for a person.
fn text(found: &Answer) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<8} {text}");
    };
    let gain = found.gain;
    line(
        "verdict",
        format!("{} at mu*lambda = {:.4} (mu {}, lambda {:.4})", found.verdict.text().to_uppercase(), gain.product(), gain.mu, gain.lambda),
    );
    line("why", found.reason.clone());
    let recorded = found.recorded_gain.map_or(String::new(), |[low, high]| match high - low < 1e-9 {
        true => format!("; recorded at {low:.4}"),
        false => format!("; recorded at {low:.4} to {high:.4}"),
    });
    match (found.critical_gain, found.at_least) {
        (Some(critical), _) => {
            let ci = found.critical_gain_ci95.map_or(String::new(), |ci| format!(" (95 %: {})", interval(ci)));
            let hz = match found.critical_frequency_hz {
                Some(hz) if hz > 0.0 => format!(" at {hz:.1} Hz"),
                Some(_) => ", where it runs away without oscillating".to_string(),
                None => String::new(),
            };
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            line("edge", format!("mu*lambda = {critical:.3}{ci}{hz}{by}{recorded}"));
        }
        (None, Some(_)) if found.limited_from.is_some() => {
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            let from = found.limited_from.unwrap_or_default();
            line("edge", format!("from mu*lambda = {from:.3} on a clamp acts or the travel is left, before any oscillation{by}{recorded}"));
        }
        (None, Some(least)) => line("edge", format!("none up to mu*lambda = {least:.3}{recorded}")),
        _ => {}
    }
    let gain_db = found.gain_margin_db();
    let to_clamp = found.limited_from.map(|from| 20.0 * (from / gain.product()).log10());
    let at_least =
        found.at_least.filter(|_| found.critical_gain.is_none() && to_clamp.is_none()).map(|least| 20.0 * (least / gain.product()).log10());
    let of = |value: Option<f64>, unit: &str| value.map_or("unlimited".to_string(), |v| format!("{v:.2} {unit}"));
    let to_edge = match (gain_db, at_least) {
        (Some(db), _) => Some(format!("gain {db:.2} dB to the edge")),
        (None, Some(db)) if db > 0.0 => Some(format!("gain at least {db:.2} dB")),
        _ if to_clamp.is_some() => to_clamp.map(|db| format!("gain {db:.2} dB to where a clamp acts or the travel is left")),
        _ => None,
    };
    // Margins of another edge than the one told would contradict it.
    let measured = found.margins.as_ref().filter(|_| found.margins_are_of_the_edge());
    if measured.is_none()
        && let Some(to_edge) = &to_edge
    {
        line("margins", to_edge.clone());
    }
    if let Some(m) = measured {
        line(
            "margins",
            format!(
                "{}, phase {}, delay {}, modulus {:.3} (measured)",
                to_edge.unwrap_or_else(|| "gain not known".to_string()),
                of(m.phase_deg, "deg"),
                of(m.delay_ms, "ms"),
                m.modulus
            ),
        );
    }
    if let Some(f) = &found.frequency_answer {
        line("measured", f.reason.clone());
    }
    match (&found.resimulated, &found.no_resimulation) {
        (Some(again), _) => {
            line("re-run", format!("{}; {}", again.outcome, again.edge.reason));
            let grips: Vec<String> = again
                .grips
                .iter()
                .map(|g| match g.edge.critical_gain {
                    Some(gain) => format!("x{}: {gain:.2}", g.scale),
                    None if g.edge.at_least == 0.0 => format!("x{}: not known", g.scale),
                    None => format!("x{}: above {:.2}", g.scale, g.edge.at_least),
                })
                .collect();
            if !grips.is_empty() {
                line("grips", format!("edge by factor on the grip: {}", grips.join(", ")));
            }
            line("energy", again.energy.reason.clone());
        }
        (None, Some(why)) => {
            line("re-run", format!("not possible: {why}"));
            line("energy", found.recorded_energy.reason.clone());
        }
        _ => {}
    }
    for t in &found.transparency {
        let mut parts = Vec::new();
        if let Some(i) = &t.impedance {
            parts.push(format!("impedance off by a factor of {:.2} over {:.0}-{:.0} Hz", i.error.exp(), i.band_hz[0], i.band_hz[1]));
        }
        if let Some(ratio) = t.induced_ratio {
            parts.push(format!("induced motion {:.0} % of the hand's", 100.0 * ratio));
        }
        if let Some(c) = &t.cancellation {
            parts.push(format!("{:.1} % of it cancelled in the first 50 ms", 100.0 * c.quality));
        }
        if !parts.is_empty() {
            line("felt", format!("{}: {}", t.name, parts.join("; ")));
        }
    }
    for d in &found.disagreements {
        line("differs", d.text.clone());
    }
    for warning in &found.warnings {
        line("note", warning.to_string());
    }
    if let Some(advice) = &found.advice {
        line("record", advice.clone());
    }
    out.trim_end().to_string()
}
