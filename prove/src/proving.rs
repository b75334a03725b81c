//! One case: draw and seal, record, diagnose, raise the gain, and only then look at the truth.

use crate::case::{Case, SHOWS};
use crate::chosen::{Chosen, Task, choose, estimating};
use crate::edges::Canceller;
use crate::error::ProveError;
use crate::files::{absolute, at, ours, read, write};
use crate::gain::ESTIMATED;
use crate::hidden::Hidden;
use crate::live::hide;
use crate::options::Options;
use crate::raise::{Raised, raise};
use crate::score::{Handed, findings, is_nonlinear, mark, name_of};
use crate::session::hand_over;
use crate::watch::{Watch, busy};
use backdrive_diagnosis::verdict::{MODEL_FILE, VERDICT_FILE, Verdict, Word};
use backdrive_sealed::seal::hash;
use backdrive_sealed::truth::Truth;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml_edit::{Array, DocumentMut, Item, value};

/// Factor on the time for a search where the hand is not shown: its curve makes every fit longer.
const LONGER: f64 = 2.5;

/// What is drawn and how it is shown.
pub struct Draw {
    /// Of what is concealed.
    pub seed: u64,
    /// How many effects.
    pub effects: usize,
    /// Whether the bags hold what the hand wants.
    pub shows_hand: bool,
    /// Whether the nominal parameters are refitted to a session of the hidden plant first.
    pub refitted: bool,
}

/// A nominal model as the graph and the diagnosis get it, and the grip beside it; `None` where its file holds the hand.
struct Nominal {
    model: PathBuf,
    grip: Option<PathBuf>,
}

/// Runs one case; its files stay in `folder`.
pub fn prove(options: &Options, folder: &Path, drawn: &Draw, watch: &dyn Watch) -> Result<Case, ProveError> {
    let template: DocumentMut =
        read(&options.session)?.parse().map_err(|e| ProveError::input(format!("{}: {e}", options.session.display())))?;
    let hidden = hidden_plant(options, folder, &template)?;
    let digest = draw(options, &hidden, drawn)?;
    let hand = if drawn.shows_hand { "" } else { "; the hand is not measured" };
    let masked = if drawn.refitted { "; the nominal parameters were refitted" } else { "" };
    watch.sealed(&format!("{}: sealed, SHA-256 {digest}{hand}{masked}", folder.display()))?;

    // From here to the verdict only the hidden plant's process opens the truth.
    let record = |nominal: &Nominal, name: &str| {
        let graph = folder.join(format!("{name}.toml"));
        write(&graph, &graph_of(template.clone(), options, &hidden, nominal, &digest)?)?;
        let (recorded, session) = (folder.join("recorded"), folder.join(name));
        busy(watch, &at(folder, "recording the session"), || {
            ours(&options.backdrive, folder, &format!("run-{name}"), &[&"run", &graph, &"--out", &recorded, &"--overwrite"])
        })?;
        busy(watch, &at(folder, "copying the bags"), || hand_over(&recorded, &session, drawn.shows_hand, options.hand_bandwidth_hz))?;
        Ok::<PathBuf, ProveError>(session)
    };
    let mut nominal = Nominal { model: hidden.model.clone(), grip: hidden.grip.clone() };
    if drawn.refitted {
        let before = record(&nominal, "before")?;
        let model = PathBuf::from(absolute(&folder.join("nominal.toml"))?);
        busy(watch, &at(folder, "refitting the nominal parameters"), || refit(options, folder, "fit-before", &before, &model))?;
        nominal = Nominal { model, grip: None };
    }
    let session = record(&nominal, "session")?;
    let found = folder.join("diagnosis");
    let effort = (options.effort * if drawn.shows_hand { 1.0 } else { LONGER }).to_string();
    let patience = options.patience_s.to_string();
    let arguments: [&dyn AsRef<std::ffi::OsStr>; 8] =
        [&"diagnose", &session, &"--out", &found, &"--effort", &effort, &"--patience", &patience];
    busy(watch, &at(folder, "diagnosing"), || ours(&options.backdrive, folder, "diagnose", &arguments))?;
    let path = found.join(VERDICT_FILE);
    let verdict: Verdict =
        serde_json::from_str(&read(&path)?).map_err(|e| ProveError::input(format!("{}: is not a verdict: {e}", path.display())))?;

    let (cancellers, share) = match options.gains {
        false => (Vec::new(), None),
        true => cancellers(options, folder, &Session { nominal, session, found }, &verdict, watch)?,
    };
    // The verdict is written; now the truth is opened.
    let truth = open_truth(&hidden, &digest)?;
    let raised = raise(options, folder, &hidden, &truth, &cancellers, watch)?;
    Ok(case(folder, drawn, digest, &verdict, &truth, raised, share))
}

/// The hidden plant of a case, with a folder made for its truth.
fn hidden_plant(options: &Options, folder: &Path, template: &DocumentMut) -> Result<Hidden, ProveError> {
    let sealed = folder.join("sealed");
    if sealed.exists() {
        return Err(ProveError::input(format!(
            "{}: exists already; a truth is sealed only once, so name another folder with --out",
            sealed.display()
        )));
    }
    let rate_hz = template.get("rate_hz").and_then(|i| i.as_float().or(i.as_integer().map(|n| n as f64))).unwrap_or(5000.0);
    let hidden = Hidden {
        program: options.plant.clone(),
        model: PathBuf::from(absolute(&options.model)?),
        grip: Some(PathBuf::from(absolute(&options.grip)?)),
        truth: PathBuf::from(absolute(&sealed.join("truth.json"))?),
        rate_hz,
    };
    std::fs::create_dir_all(&sealed).map_err(|e| ProveError::write(&sealed, e))?;
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
    options: &Options,
    folder: &Path,
    of: &Session,
    verdict: &Verdict,
    watch: &dyn Watch,
) -> Result<(Vec<Canceller>, Option<f64>), ProveError> {
    let Session { nominal, session, found } = of;
    let fit = || all_cancellers(options, folder, nominal, session, found);
    let mut cancellers = busy(watch, &at(folder, "fitting models to compare with"), fit)?;
    let (diagnosed, scaled) = (found.join(MODEL_FILE), folder.join("chosen.toml"));
    let rivals: Vec<PathBuf> = verdict.rival_models.iter().map(|name| found.join(name)).collect();
    let task = Task { graph: &options.contact, high_pass_hz: options.high_pass_hz };
    // What is unexplained is in the device and in no model at hand: what it does to the loop nobody can say, so nothing is cancelled. So is what
    // an explanation leaves over that a proof would count as an effect.
    let left = floors(verdict.held_out.nrmse_after, verdict);
    let is_explained = verdict.word != Word::Unexplained && left.is_some_and(|floors| floors < SHOWS);
    let choose = || choose(&diagnosed, &rivals, &scaled, &task, watch.stop());
    let chosen = if is_explained { busy(watch, &at(folder, "choosing how much to cancel"), choose)? } else { Chosen::nothing() };
    cancellers.push(Canceller::fixed("chosen", (chosen.share > 0.0).then_some(scaled), None));
    let models: Vec<PathBuf> = std::iter::once(diagnosed).chain(rivals).collect();
    let try_all = || estimating(ESTIMATED, &models, &task, watch.stop());
    let estimated =
        if is_explained { busy(watch, &at(folder, "trying the estimated hand with every explanation"), try_all)? } else { None };
    cancellers.push(estimated.unwrap_or_else(|| Canceller::fixed(ESTIMATED, None, None)));
    Ok((cancellers, Some(chosen.share)))
}

/// An error on held-out data, in standard deviations of the sensor noise.
fn floors(error: Option<f64>, verdict: &Verdict) -> Option<f64> {
    error.zip(verdict.held_out.noise_floor).map(|(left, floor)| left / floor).filter(|x| x.is_finite())
}

/// The truth, which must be what was sealed.
fn open_truth(hidden: &Hidden, digest: &str) -> Result<Truth, ProveError> {
    let bytes =
        backdrive_plant::input_file::read(&hidden.truth).map_err(|e| ProveError::input(format!("{}: {e}", hidden.truth.display())))?;
    if hash(&bytes) != digest {
        return Err(ProveError::input(format!("{}: differs from what was sealed", hidden.truth.display())));
    }
    Truth::from_json(&bytes).map_err(ProveError::input)
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

/// Draws and seals; the digest.
fn draw(options: &Options, hidden: &Hidden, drawn: &Draw) -> Result<String, ProveError> {
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
        .map_err(|e| ProveError::machine(format!("{name}: cannot be started ({e}); build it with `cargo build --release`")))?;
    if !output.status.success() {
        return Err(ProveError::input(format!("{name}: {}", String::from_utf8_lossy(&output.stderr).trim())));
    }
    let said = String::from_utf8_lossy(&output.stdout);
    said.split_whitespace().next().map(str::to_string).ok_or_else(|| ProveError::machine(format!("{name}: printed no digest")))
}

/// A session's graph with the hidden plant in the master's place. It names the digest, and where the truth lies, which only that process opens.
fn graph_of(mut graph: DocumentMut, options: &Options, hidden: &Hidden, nominal: &Nominal, digest: &str) -> Result<String, ProveError> {
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
    hide(&mut graph, &options.backdrive, hidden, 1)?;
    Ok(graph.to_string())
}

/// The cancellers that are compared: none, the nominal model, the two linear models fitted to the session, and the diagnosed one.
fn all_cancellers(options: &Options, folder: &Path, nominal: &Nominal, session: &Path, found: &Path) -> Result<Vec<Canceller>, ProveError> {
    let second = folder.join("second-order.toml");
    let still = still(options, session)?;
    ours(&options.backdrive, folder, "fit-second-order", &[&"fit", &options.second_order, &still, &"--out", &second])?;
    let refitted = folder.join("refitted.toml");
    refit(options, folder, "fit-nominal", session, &refitted)?;
    let holds = |name, model: PathBuf| Canceller::fixed(name, Some(model), None);
    Ok(vec![
        Canceller::fixed("none", None, None),
        Canceller::fixed("nominal", Some(nominal.model.clone()), nominal.grip.clone()),
        holds("second order", second),
        holds("linear, refitted", refitted),
        holds("diagnosed", found.join(MODEL_FILE)),
    ])
}

/// The nominal model of a session with its parameters fitted to that.
fn refit(options: &Options, folder: &Path, name: &str, session: &Path, out: &Path) -> Result<(), ProveError> {
    ours(&options.backdrive, folder, name, &[&"fit", &session.join("model.toml"), &session, &"--out", &out]).map(drop)
}

/// The recordings in which the hand holds still as a set of their own: a model of second order has no hand that could move.
fn still(options: &Options, session: &Path) -> Result<PathBuf, ProveError> {
    let bad = |path: &Path, e: toml_edit::TomlError| ProveError::input(format!("{}: {e}", path.display()));
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
    write(&still, set.to_string())?;
    Ok(still)
}
