//! What to do after a diagnosis, with the commands that do it.

use crate::offered::{Builder, Offered, Step, plain};
use backdrive_answers::found::{Diagnosed, Found};
use backdrive_answers::sentences::next_experiment;
use backdrive_bags::Reader;
use backdrive_diagnosis::arms::sentences::unexplained;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::verdict::{ArmJoint, MODEL_FILE, Verdict, Word};
use backdrive_nodes::graph::{NodeKind, Overrides, Settings};
use backdrive_report::percent;
use backdrive_stability::summary::graph_of;
use std::path::{Path, PathBuf};

/// The graph on which a canceller is tried, where it is at hand.
const CONTACT: &str = "launch/contact.toml";
/// A model that leaves this much more of a joint's torque than the refitted one is not recommended.
const WORSE: f64 = 1.02;

/// What to do, the most useful first, with commands to copy. `out` is the folder of the model that was written.
pub fn next(found: &Found, out: &Path) -> Vec<Step> {
    match &found.device {
        Diagnosed::OneAxis(diagnosis) => of_one_axis(diagnosis, out, &found.read),
        Diagnosed::Arm(both) => of_arm(&both.1.verdict, out),
        Diagnosed::Servo(both) => of_servo(both.1.verdict.word, out),
    }
}

/// The same for a device of one axis; `files` are those that were read.
fn of_one_axis(found: &Diagnosis, out: &Path, files: &[PathBuf]) -> Vec<Step> {
    let held = &found.verdict.held_out;
    let model = out.join(MODEL_FILE);
    // A canceller takes the model of a master: one that states where it is held, pushed and read.
    let is_master = !found.problem.model.axes.is_empty();
    let (before, after) = (held.nrmse_before.unwrap_or(f64::NAN), held.nrmse_after.unwrap_or(f64::NAN));
    let worth = format!("its error is {} of the measured signal, that of the model as given {}", percent(after), percent(before));
    let place = if is_master { "a canceller" } else { "a feed-forward or a simulation" };
    let use_it = if is_master { vec![contact(&model)] } else { vec![simulated(&model, files, Path::new("predicted.csv"))] };
    let mut steps = Vec::new();
    match found.verdict.word {
        Word::Missing | Word::Parameters => {
            let text = format!("Use {} to predict the motion, such as in {place}: {worth}.", model.display());
            steps.push(Step::new(text, use_it));
            if let Some(asked) = Some(is_master).filter(|is| *is).and_then(|_| in_the_loop(&model, files)) {
                let text = "Compute the stability limit with it, from the recording of a contact.";
                steps.push(Step::new(text, [Some(asked)]));
            }
        }
        Word::Ambiguous => steps
            .push(Step::new(format!("{} may be used ({worth}), but also test the result with the rivals below.", model.display()), use_it)),
        Word::NothingMissing => steps.push(Step::said("Keep the model: the recordings show no missing effect.")),
        Word::Unexplained => steps
            .push(Step::said("Do not use a law yet: check when and where the residual appears, and first check the sensors named there.")),
        Word::CannotTell => {}
    }
    if let Some(next) = &found.verdict.next_experiment {
        steps.push(Step::said(format!("Next recording: {}", next_experiment(next))));
    }
    if let Some(remark) = found.remarks.iter().find(|r| r.weight > Weight::Note && !r.signal.is_empty()) {
        steps.push(Step::said(format!("Check this signal: {remark}")));
    }
    if found.search.cut {
        let text = "Let the search complete: the same command with a longer time limit.";
        steps.push(Step::new(text, [again("--patience", 600.0)]));
    } else if found.search.exhausted {
        let text = "Search more: the same command with twice the effort.";
        steps.push(Step::new(text, [again("--effort", 1.0)]));
    }
    steps
}

/// The same for an arm.
fn of_arm(verdict: &Verdict, out: &Path) -> Vec<Step> {
    let mut steps = Vec::new();
    let model = out.join(MODEL_FILE);
    let (name, export) = (model.display(), Builder::verb("export").reads(&model).option("--to", "urdf"));
    let use_it = || [export.option_writes("--out", Path::new("arm.diagnosed.urdf")).build()];
    let worse: Vec<String> = verdict.arm.iter().flat_map(|arm| &arm.joints).filter_map(worse_than_refitted).collect();
    match verdict.word {
        Word::Missing | Word::Parameters | Word::Ambiguous if !worse.is_empty() => steps.push(Step::said(format!(
            "Do not use {name}: it leaves more torque unexplained than the refitted model without these effects, {}.",
            worse.join(", ")
        ))),
        Word::Missing | Word::Parameters => steps.push(Step::new(
            format!("Use {name}, such as in a feed-forward or a simulation; this writes it for other programs:"),
            use_it(),
        )),
        Word::Ambiguous => steps
            .push(Step::new(format!("{name} may be used, but the first effect could be a different one: see the table below."), use_it())),
        Word::NothingMissing => steps.push(Step::said("Keep the model: the logs show no missing effect.")),
        Word::Unexplained => steps.push(Step::said(
            "Do not use a law yet: see below when and where the residual appears, and first check the sensors of the joints named there.",
        )),
        Word::CannotTell => {}
    }
    if verdict.word != Word::Unexplained {
        for joint in verdict.arm.iter().flat_map(|a| &a.joints) {
            if let Some(open) = unexplained(joint) {
                steps.push(Step::said(format!("Check the residual {open}.")));
            }
        }
    }
    if let Some(next) = &verdict.next_experiment {
        steps.push(Step::said(format!("Next recording: {}", next.sentence())));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(2) {
        steps.push(Step::said(format!("Check this signal: {}: {}", remark.place, remark.message)));
    }
    steps
}

/// Of a joint whose torque the diagnosed model predicts worse than the refitted one: both shares.
fn worse_than_refitted(joint: &ArmJoint) -> Option<String> {
    let shares = || format!("at {} {} instead of {}", joint.joint, percent(joint.diagnosed), percent(joint.refit));
    (joint.diagnosed > WORSE * joint.refit).then(shares)
}

/// The same for servo joints, where the model may be used.
fn of_servo(word: Word, out: &Path) -> Vec<Step> {
    let model = out.join(MODEL_FILE);
    let usable = matches!(word, Word::Missing | Word::Parameters | Word::NothingMissing);
    let show = || Builder::verb("model show").reads(&model).build();
    usable.then(|| Step::new(format!("Use {}; this shows its parameters:", model.display()), [show()])).into_iter().collect()
}

/// The contact task with the model in its canceller.
fn contact(model: &Path) -> Option<Offered> {
    let run = Builder::verb("run").reads(Path::new(CONTACT)).option_reads("--canceller", model);
    run.option("--high-pass", 1).option_writes("--bag", Path::new("with-diagnosed.mcap")).build()
}

/// The model's prediction of a recording, into a table of this name or one like it.
pub fn simulated(model: &Path, files: &[PathBuf], table: &Path) -> Option<Offered> {
    // A set names the columns; the model beside it is the first of the files.
    let recording = files.iter().rev().find(|file| file.extension().is_some_and(|e| e != "toml"))?;
    let set = recording.parent().map(|folder| folder.join("set.toml")).filter(|set| set.exists());
    let simulate = Builder::verb("simulate").reads(model).reads(recording).option_writes("--out", table);
    match set {
        Some(set) => simulate.option_reads("--columns", &set).build(),
        None => simulate.build(),
    }
}

/// The question of the stability limit with the model in the canceller, of the first recording that holds a loop with one.
fn in_the_loop(model: &Path, files: &[PathBuf]) -> Option<Offered> {
    let changes = Overrides { canceller: Some(model.to_path_buf()), canceller_grip: Some("none".into()), ..Overrides::default() };
    let bags = files.iter().filter(|file| file.extension().is_some_and(|e| e == "mcap"));
    let bag = bags.into_iter().find(|bag| {
        let graph = Reader::open(bag).ok().and_then(|reader| graph_of(&reader, &changes).ok());
        graph.is_some_and(|graph| {
            let touches = graph.node_of(NodeKind::Slave).is_some_and(|n| matches!(&n.settings, Settings::Slave(f) if f.fragment.is_some()));
            touches && graph.gains.mu * graph.gains.lambda > 0.0 && graph.node_of(NodeKind::Operator).is_some()
        })
    })?;
    let asked = Builder::verb("stability").reads(bag).option_reads("--canceller", model).option("--canceller-grip", "none");
    asked.option("--high-pass", 1).option_writes("--html", Path::new("stability.html")).build()
}

/// The diagnosis again, an option with twice its value.
fn again(name: &str, usual: f64) -> Option<Offered> {
    let again: Builder = Builder::again();
    let now = again.value_of(name).and_then(|text| text.parse::<f64>().ok()).unwrap_or(usual);
    again.option(name, plain(2.0 * now)).build().filter(|offered| offered.is("diagnose"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_s_model_that_predicts_worse_than_the_refitted_one_is_named_with_both_shares() {
        let joint = |refit: f64, diagnosed: f64| {
            let text = serde_json::json!({ "joint": "elbow", "torque_rms": 1.0, "as_given": 5.48, "refit": refit, "diagnosed": diagnosed,
                "loop_refit": null, "loop_diagnosed": null });
            serde_json::from_value::<ArmJoint>(text).unwrap()
        };
        assert_eq!(worse_than_refitted(&joint(0.951, 1.187)).as_deref(), Some("at elbow 119 % instead of 95.1 %"));
        assert_eq!(worse_than_refitted(&joint(0.206, 0.013)), None);
        assert_eq!(worse_than_refitted(&joint(0.029, 0.029)), None);
    }
}
