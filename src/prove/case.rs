//! One proof: draw and seal, record, diagnose, raise the gain, and only then look at the truth.

use super::chosen::{Chosen, Task, choose, estimating};
use super::edges::Canceller;
use super::files::{absolute, at, ours, read, write};
use super::hidden::{Hidden, program};
use super::live::{LiveRun, hide};
use super::raise::{ESTIMATED, Gain, Hand, Raised, raise};
use super::score::{Finding, Handed, Mark, findings, is_nonlinear, mark, name_of};
use super::session::hand_over;
use crate::cli;
use crate::failure::Failure;
use crate::output;
use crate::progress::busy;
use backdrive_diagnosis::verdict::{MODEL_FILE, VERDICT_FILE, Verdict, Word};
use backdrive_sealed::seal::hash;
use backdrive_sealed::truth::Truth;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use toml_edit::{Array, DocumentMut, Item, value};

/// Factor on the time for a search where the hand is not shown: its curve makes every fit longer.
const LONGER: f64 = 2.5;

/// Noise floors from which on an effect counts as one that shows.
pub const SHOWS: f64 = 3.0;

/// What a user has without a diagnosis: the honest measure of a canceller is its stable gain over the best of these.
const OTHERS: [&str; 3] = ["none", "second order", "linear, refitted"];

/// Kinds of physics, by the names of the hidden laws.
pub const KINDS: [(&str, &[&str]); 3] = [
    ("dry friction", &["coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", "load_friction", "warm_friction", "gear_loss"]),
    ("hysteresis", &["hysteretic_spring", "bouc_wen", "dahl", "lugre", "maxwell_slip", "preisach_lugre", "bristle_field"]),
    ("backlash", &["backlash", "rounded_gap"]),
];

/// What is drawn and how it is shown.
pub struct Draw {
    /// Of what is concealed.
    pub seed: u64,
    /// How many effects.
    pub effects: usize,
    /// Whether the bags hold what the hand wants.
    pub shows_hand: bool,
    /// Whether the nominal numbers are refitted to a session of the hidden plant first.
    pub refitted: bool,
}

/// A nominal model as the graph and the diagnosis get it, and the grip beside it; `None` where its file holds the hand.
struct Nominal {
    model: PathBuf,
    grip: Option<PathBuf>,
}

/// What a proof gave.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its folder's name.
    pub name: String,
    /// Whether the bags hold what the hand wants.
    pub shows_hand: bool,
    /// Whether the nominal numbers were refitted to a session of the hidden plant first.
    pub refitted: bool,
    /// SHA-256 of the truth, as printed before anything was recorded.
    pub sealed: String,
    /// The verdict in a word.
    pub word: Word,
    /// And in a sentence.
    pub sentence: String,
    /// What was found.
    pub findings: Vec<Finding>,
    /// What was concealed.
    pub concealed: Vec<String>,
    /// How right that is, effect by effect.
    pub marks: Vec<Mark>,
    /// Whether something nonlinear was concealed.
    pub nonlinear: bool,
    /// Error on recordings that no fit has seen, as shares of their deviation: as given, refitted, diagnosed.
    pub held_out: [Option<f64>; 3],
    /// The refitted one of these over the noise floor: how far the recordings are from what the nominal model with other numbers can do.
    pub refit_floors: Option<f64>,
    /// Stable mu*lambda by canceller and grip.
    pub gains: Vec<Gain>,
    /// Time that the loop with the canceller that estimates the hand takes to settle after a change of the grip, at half its stable gain, s: the median.
    pub recovery_s: Option<f64>,
    /// The live graph at gains about the edges without a canceller and with the diagnosed and the chosen one.
    pub live: Vec<LiveRun>,
    /// Share of the diagnosed estimate that was chosen where the grip is uncertain, 0 for no canceller; `None` where no gain was raised.
    pub share: Option<f64>,
}

/// Runs one case; its files stay in `folder`.
pub fn prove(options: &cli::Prove, folder: &Path, drawn: &Draw, stop: &AtomicBool) -> Result<Case, Failure> {
    let template: DocumentMut =
        read(&options.session)?.parse().map_err(|e| Failure::input(format!("{}: {e}", options.session.display())))?;
    let hidden = hidden_plant(options, folder, &template)?;
    let digest = draw(options, &hidden, drawn)?;
    let hand = if drawn.shows_hand { "" } else { "; nobody measures the hand" };
    let masked = if drawn.refitted { "; the nominal numbers were refitted" } else { "" };
    output::line(format_args!("{}: sealed, SHA-256 {digest}{hand}{masked}", folder.display()))?;

    // From here to the verdict only the hidden plant's process opens the truth.
    let record = |nominal: &Nominal, name: &str| {
        let graph = folder.join(format!("{name}.toml"));
        write(&graph, &graph_of(template.clone(), options, &hidden, nominal, &digest)?)?;
        let (recorded, session) = (folder.join("recorded"), folder.join(name));
        busy(&at(folder, "recording the session"), || {
            ours(folder, &format!("run-{name}"), &[&"run", &graph, &"--out", &recorded, &"--overwrite"])
        })?;
        busy(&at(folder, "handing the bags over"), || hand_over(&recorded, &session, drawn.shows_hand, options.hand_bandwidth))?;
        Ok::<PathBuf, Failure>(session)
    };
    let mut nominal = Nominal { model: hidden.model.clone(), grip: hidden.grip.clone() };
    if drawn.refitted {
        let before = record(&nominal, "before")?;
        let model = PathBuf::from(absolute(&folder.join("nominal.toml"))?);
        busy(&at(folder, "refitting the nominal parameters"), || refit(folder, "fit-before", &before, &model))?;
        nominal = Nominal { model, grip: None };
    }
    let session = record(&nominal, "session")?;
    let found = folder.join("diagnosis");
    let effort = (options.effort * if drawn.shows_hand { 1.0 } else { LONGER }).to_string();
    let patience = options.patience.to_string();
    let arguments: [&dyn AsRef<std::ffi::OsStr>; 8] =
        [&"diagnose", &session, &"--out", &found, &"--effort", &effort, &"--patience", &patience];
    busy(&at(folder, "diagnosing"), || ours(folder, "diagnose", &arguments))?;
    let path = found.join(VERDICT_FILE);
    let verdict: Verdict =
        serde_json::from_str(&read(&path)?).map_err(|e| Failure::input(format!("{}: is no verdict: {e}", path.display())))?;

    let (cancellers, share) = match options.no_gains {
        true => (Vec::new(), None),
        false => cancellers(options, folder, &Session { nominal, session, found }, &verdict, stop)?,
    };
    // The verdict is written; now the truth is opened.
    let truth = open_truth(&hidden, &digest)?;
    let raised = raise(options, folder, &hidden, &truth, &cancellers, stop)?;
    Ok(case(folder, drawn, digest, &verdict, &truth, raised, share))
}

/// The hidden plant of a case, with a folder made for its truth.
fn hidden_plant(options: &cli::Prove, folder: &Path, template: &DocumentMut) -> Result<Hidden, Failure> {
    let sealed = folder.join("sealed");
    if sealed.exists() {
        return Err(Failure::input(format!(
            "{}: is there already; a truth is sealed once, so name another folder with --out",
            sealed.display()
        )));
    }
    let rate_hz = template.get("rate_hz").and_then(|i| i.as_float().or(i.as_integer().map(|n| n as f64))).unwrap_or(5000.0);
    let hidden = Hidden {
        program: options.plant.clone().unwrap_or_else(program),
        model: PathBuf::from(absolute(&options.model)?),
        grip: Some(PathBuf::from(absolute(&options.grip)?)),
        truth: PathBuf::from(absolute(&sealed.join("truth.json"))?),
        rate_hz,
    };
    std::fs::create_dir_all(&sealed).map_err(|e| Failure::write(&sealed, e))?;
    Ok(hidden)
}

/// What was handed over, and the folder of its diagnosis.
struct Session {
    nominal: Nominal,
    session: PathBuf,
    found: PathBuf,
}

/// The cancellers whose gain is raised, and the share of the diagnosed estimate that was chosen.
fn cancellers(
    options: &cli::Prove,
    folder: &Path,
    of: &Session,
    verdict: &Verdict,
    stop: &AtomicBool,
) -> Result<(Vec<Canceller>, Option<f64>), Failure> {
    let Session { nominal, session, found } = of;
    let fit = || all_cancellers(options, folder, nominal, session, found);
    let mut cancellers = busy(&at(folder, "fitting models to compare with"), fit)?;
    let (diagnosed, scaled) = (found.join(MODEL_FILE), folder.join("chosen.toml"));
    let rivals: Vec<PathBuf> = verdict.rival_models.iter().map(|name| found.join(name)).collect();
    let task = Task { graph: &options.contact, high_pass_hz: options.high_pass };
    // What is unexplained is in the device and in no model at hand: what it does to the loop nobody can say, so nothing is cancelled. So is what
    // an explanation leaves over that a proof would count as an effect.
    let left = floors(verdict.held_out.nrmse_after, verdict);
    let is_explained = verdict.word != Word::Unexplained && left.is_some_and(|floors| floors < SHOWS);
    let choose = || choose(&diagnosed, &rivals, &scaled, &task, stop);
    let chosen = if is_explained { busy(&at(folder, "choosing how much to cancel"), choose)? } else { Chosen::nothing() };
    cancellers.push(Canceller::fixed("chosen", (chosen.share > 0.0).then_some(scaled), None));
    let models: Vec<PathBuf> = std::iter::once(diagnosed).chain(rivals).collect();
    let try_all = || estimating(ESTIMATED, &models, &task, stop);
    let estimated = if is_explained { busy(&at(folder, "trying the estimated hand on every explanation"), try_all)? } else { None };
    cancellers.push(estimated.unwrap_or_else(|| Canceller::fixed(ESTIMATED, None, None)));
    Ok((cancellers, Some(chosen.share)))
}

/// An error on recordings that no fit has seen, over the noise floor.
fn floors(error: Option<f64>, verdict: &Verdict) -> Option<f64> {
    error.zip(verdict.held_out.noise_floor).map(|(left, floor)| left / floor).filter(|x| x.is_finite())
}

/// The truth, which must be what was sealed.
fn open_truth(hidden: &Hidden, digest: &str) -> Result<Truth, Failure> {
    let bytes = backdrive_plant::input_file::read(&hidden.truth).map_err(|e| Failure::input(format!("{}: {e}", hidden.truth.display())))?;
    if hash(&bytes) != digest {
        return Err(Failure::input(format!("{}: is not what was sealed", hidden.truth.display())));
    }
    Truth::from_json(&bytes).map_err(Failure::input)
}

/// What was found beside what was concealed.
fn case(folder: &Path, drawn: &Draw, sealed: String, verdict: &Verdict, truth: &Truth, raised: Raised, share: Option<f64>) -> Case {
    let (held, findings) = (&verdict.held_out, findings(verdict));
    let handed = Handed { hand_hidden: !drawn.shows_hand, refitted: drawn.refitted };
    Case {
        name: folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        shows_hand: drawn.shows_hand,
        refitted: drawn.refitted,
        share,
        sealed,
        word: verdict.word,
        sentence: verdict.sentence.clone(),
        concealed: truth.effects.iter().map(name_of).collect(),
        marks: truth.effects.iter().map(|e| mark(e, verdict.word, &findings, handed)).collect(),
        nonlinear: is_nonlinear(truth),
        held_out: [held.nrmse_before, held.nrmse_refit, held.nrmse_after],
        refit_floors: floors(held.nrmse_refit, verdict),
        findings,
        gains: raised.gains,
        live: raised.live,
        recovery_s: raised.recovery_s,
    }
}

impl Case {
    /// The stable gain with a canceller and a hand.
    pub fn gain(&self, canceller: &str, hand: Hand) -> Option<f64> {
        self.gains.iter().find(|g| g.canceller == canceller && g.hand == hand).map(|g| g.stable_to)
    }

    /// The stable gain with a canceller over that with the better of the two linear ones.
    pub fn over_linear(&self, canceller: &str, hand: Hand) -> Option<f64> {
        let linear = self.gain("second order", hand)?.max(self.gain("linear, refitted", hand)?);
        Some(self.gain(canceller, hand)? / linear).filter(|r| r.is_finite())
    }

    /// The same over the best of what a user has without a diagnosis: no canceller, or one of the two linear ones.
    pub fn over_others(&self, canceller: &str, hand: Hand) -> Option<f64> {
        let best = OTHERS.iter().map(|other| self.gain(other, hand)).try_fold(0.0_f64, |best, gain| Some(best.max(gain?)))?;
        Some(self.gain(canceller, hand)? / best).filter(|r| r.is_finite())
    }

    /// The hands with which gains were measured, the session's first.
    pub fn hands(&self) -> Vec<Hand> {
        let mut hands = Vec::new();
        for gain in &self.gains {
            if !hands.contains(&gain.hand) {
                hands.push(gain.hand);
            }
        }
        hands
    }

    /// What kind of physics is concealed first: dry friction, hysteresis, backlash, something else; `None` where nothing is.
    pub fn kind(&self) -> Option<&'static str> {
        let name = self.concealed.first()?.split(' ').next()?;
        let kind = KINDS.iter().find(|(_, names)| names.contains(&name));
        Some(kind.map_or("other physics", |(kind, _)| kind))
    }

    /// Whether the recordings show what is concealed: the nominal model, with whatever numbers fit best, stays [`SHOWS`] noise floors and more away
    /// from recordings that no fit has seen. Below that its numbers take the effect on.
    pub fn shows(&self) -> bool {
        self.refit_floors.is_none_or(|floors| floors >= SHOWS)
    }

    /// Whether everything concealed was found by its family and place, and nothing where nothing was.
    pub fn is_right(&self) -> bool {
        if self.marks.is_empty() { self.findings.is_empty() } else { self.marks.iter().all(|m| m.family) }
    }

    /// A few lines for a person.
    pub fn text(&self) -> String {
        let list = |names: &[String]| if names.is_empty() { "nothing".to_string() } else { names.join(", ") };
        let found: Vec<String> = self.findings.iter().map(|f| format!("{} {}", f.physics, f.place.join("-"))).collect();
        let percent = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{:.2} %", 100.0 * x));
        let here = self.gains.iter().filter(|g| g.hand == Hand::SESSION);
        let gains: Vec<String> =
            here.map(|g| format!("{} {}{:.2}", g.canceller, if g.whole_range { "above " } else { "" }, g.stable_to)).collect();
        let [given, refitted, diagnosed] = self.held_out.map(percent);
        let floors = self.refit_floors.map_or_else(String::new, |floors| format!(" ({floors:.1} noise floors)"));
        let mut text = format!(
            "  concealed   {}\n  found       {} ({})\n  held out    {given} as given, {refitted} refitted{floors}, {diagnosed} diagnosed",
            list(&self.concealed),
            list(&found),
            self.word.name(),
        );
        if !gains.is_empty() {
            text += &format!("\n  stable to   {}", gains.join(", "));
            let worth = |hand: &Hand| Some(format!("{hand} {:.2}", self.over_others(ESTIMATED, *hand)?));
            let worths: Vec<String> = self.hands().iter().filter_map(worth).collect();
            text += &format!("\n  {ESTIMATED}, over the best of none, second order and linear refitted: {}", worths.join(", "));
            if let Some(time) = self.recovery_s {
                text += &format!("; settles {time:.2} s after a change of the grip");
            }
        }
        if !self.live.is_empty() {
            let agree = self.live.iter().filter(|run| run.agrees()).count();
            text += &format!("\n  live graph  {agree} of {} runs about those edges did what they say", self.live.len());
        }
        text
    }

    /// For programs.
    pub fn json(&self) -> Value {
        json!({
            "case": self.name, "sealed": self.sealed, "shows_hand": self.shows_hand, "nominal_refitted": self.refitted, "verdict": self.word, "sentence": self.sentence,
            "findings": self.findings, "concealed": self.concealed, "marks": self.marks, "nonlinear": self.nonlinear,
            "held_out": self.held_out, "refit_floors": self.refit_floors, "stable_gain": self.gains, "live": self.live, "share": self.share,
            "over_others": self.hands().iter().map(|hand| json!({ "hand": hand, "diagnosed": self.over_others("diagnosed", *hand),
                "chosen": self.over_others("chosen", *hand), "hand_estimated": self.over_others(ESTIMATED, *hand) })).collect::<Vec<_>>(),
            "recovery_s": self.recovery_s, "ratio": self.over_linear("diagnosed", Hand::SESSION),
        })
    }
}

/// Draws and seals; the digest.
fn draw(options: &cli::Prove, hidden: &Hidden, drawn: &Draw) -> Result<String, Failure> {
    let mut command = Command::new(&hidden.program);
    command.arg("draw").arg("--model").arg(&hidden.model);
    if let Some(grip) = &hidden.grip {
        command.arg("--grip").arg(grip);
    }
    command.args(["--seed", &drawn.seed.to_string(), "--effects", &drawn.effects.to_string(), "--rate", &hidden.rate_hz.to_string()]);
    if options.nonlinear {
        command.arg("--nonlinear");
    }
    command.arg("--out").arg(&hidden.truth);
    let name = hidden.program.display();
    let output = command
        .output()
        .map_err(|e| Failure::machine(format!("{name}: cannot be started ({e}); build it with `cargo build --release`")))?;
    if !output.status.success() {
        return Err(Failure::input(format!("{name}: {}", String::from_utf8_lossy(&output.stderr).trim())));
    }
    let said = String::from_utf8_lossy(&output.stdout);
    said.split_whitespace().next().map(str::to_string).ok_or_else(|| Failure::machine(format!("{name}: printed no digest")))
}

/// A session's graph with the hidden plant in the master's place. It names the digest, and where the truth lies, which only that process opens.
fn graph_of(mut graph: DocumentMut, options: &cli::Prove, hidden: &Hidden, nominal: &Nominal, digest: &str) -> Result<String, Failure> {
    graph["title"] = value(format!("A session with a sealed master, SHA-256 {digest}"));
    let beside = PathBuf::from(absolute(&options.session)?).parent().map(Path::to_path_buf).unwrap_or_default();
    let nodes = graph.get_mut("nodes").and_then(Item::as_array_of_tables_mut);
    for node in nodes.into_iter().flat_map(|n| n.iter_mut()) {
        for key in ["model", "environment", "grip"] {
            let path = node.get(key).and_then(Item::as_str).filter(|p| *p != "none").map(|p| beside.join(p));
            if let Some(path) = path {
                node[key] = value(absolute(&path)?);
            }
        }
        let kind = node.get("kind").and_then(Item::as_str).unwrap_or_default().to_string();
        if matches!(kind.as_str(), "master" | "canceller") {
            node["model"] = value(nominal.model.display().to_string());
            node["grip"] = value(nominal.grip.as_ref().map_or("none".to_string(), |grip| grip.display().to_string()));
        }
    }
    hide(&mut graph, hidden, 1)?;
    Ok(graph.to_string())
}

/// The cancellers that are compared: none, the nominal model, the two linear models fitted to the session, and the diagnosed one.
fn all_cancellers(options: &cli::Prove, folder: &Path, nominal: &Nominal, session: &Path, found: &Path) -> Result<Vec<Canceller>, Failure> {
    let second = folder.join("second-order.toml");
    let still = still(options, session)?;
    ours(folder, "fit-second-order", &[&"fit", &options.second_order, &still, &"--out", &second])?;
    let refitted = folder.join("refitted.toml");
    refit(folder, "fit-nominal", session, &refitted)?;
    let holds = |name, model: PathBuf| Canceller::fixed(name, Some(model), None);
    Ok(vec![
        Canceller::fixed("none", None, None),
        Canceller::fixed("nominal", Some(nominal.model.clone()), nominal.grip.clone()),
        holds("second order", second),
        holds("linear, refitted", refitted),
        holds("diagnosed", found.join(MODEL_FILE)),
    ])
}

/// The nominal model of a session with its numbers fitted to that.
fn refit(folder: &Path, name: &str, session: &Path, out: &Path) -> Result<(), Failure> {
    ours(folder, name, &[&"fit", &session.join("model.toml"), &session, &"--out", &out]).map(drop)
}

/// The recordings in which the hand holds still as a set of their own: a model of second order has no hand that could move.
fn still(options: &cli::Prove, session: &Path) -> Result<PathBuf, Failure> {
    let bad = |path: &Path, e: toml_edit::TomlError| Failure::input(format!("{}: {e}", path.display()));
    let graph: DocumentMut = read(&options.session)?.parse().map_err(|e| bad(&options.session, e))?;
    let experiments = graph.get("experiments").and_then(Item::as_array_of_tables);
    let still = |e: &&toml_edit::Table| !e.contains_key("operator") && e.get("held_out").and_then(Item::as_bool) != Some(true);
    let names = experiments.into_iter().flatten().filter(still).filter_map(|e| e.get("name").and_then(Item::as_str));
    let files: Array = names.map(|name| format!("{name}.mcap")).collect();
    let path = session.join("set.toml");
    let mut set: DocumentMut = read(&path)?.parse().map_err(|e| bad(&path, e))?;
    set["fit"] = value(files);
    // No hand moves it, so there is none to be unknown.
    set.remove("unknown");
    let still = session.join("still.toml");
    write(&still, &set.to_string())?;
    Ok(still)
}
