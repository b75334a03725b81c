//! An experiment in words and as a file.

use super::setup::Trial;
use crate::hypothesis::{Hypothesis, Mark};
use crate::output_error::structure::Structure;
use backdrive_plant::describe::unit_for;
use backdrive_plant::excitation::{Excitation, Shape};
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::write::round_significant;
use std::fmt::Write;

/// The excitation file of an experiment: what `backdrive simulate MODEL FILE` plays. `about` becomes its comment.
pub(super) fn file(model: &Model, trial: &Trial, name: &str, about: &str, rate_hz: f64) -> String {
    let mut text = String::new();
    for line in wrapped(about, 110) {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(
        text,
        "#\n#   backdrive simulate model.diagnosed.toml next-experiment.toml --rate {rate_hz} --out predicted.csv\n#\n# in the folder of these files,"
    );
    let _ = writeln!(text, "# or in a graph: exciter = {{ force = \"{}\" }}", trial.choice.excitation);
    let others = trial.others.iter().map(|(input, excitation)| (*input, excitation));
    for (input, excitation) in std::iter::once((trial.choice.input, &trial.choice.excitation)).chain(others) {
        let input = model.inputs.get(input).map_or("", |i| i.name.as_str());
        let _ = writeln!(text, "\n[[excitations]]\nname = {}\ninput = {}", quoted(name), quoted(input));
        text.push_str(&table(excitation));
    }
    text
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}

/// An excitation as the keys of its table.
fn table(excitation: &Excitation) -> String {
    let line = excitation.to_string();
    let (kind, keys) = line.split_once(':').unwrap_or((&line, ""));
    let mut text = format!("kind = {}\n", quoted(kind));
    for (key, value) in keys.split(',').filter_map(|pair| pair.split_once('=')) {
        let number =
            |x: &str| x.parse::<i64>().map(|i| i.to_string()).or_else(|_| x.parse::<f64>().map(|x| toml_edit::Value::from(x).to_string()));
        let list: Vec<Option<String>> = value.split('/').map(|x| number(x).ok()).collect();
        let value = match list.as_slice() {
            [Some(one)] => one.clone(),
            [_] => quoted(value),
            _ => format!("[{}]", list.into_iter().flatten().collect::<Vec<_>>().join(", ")),
        };
        let _ = writeln!(text, "{key} = {value}");
    }
    text
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

/// A number for a sentence.
pub(super) fn short(x: f64) -> String {
    round_significant(x, 2).to_string()
}

/// An excitation in words, such as `a triangle between reversals at 4 N, periods 3 and 1 s`.
pub(super) fn described(model: &Model, trial: &Trial) -> String {
    let input = model.inputs.get(trial.choice.input);
    let unit = unit_for(model.motion, input.map_or(InputKind::Force, |i| i.kind).unit());
    let list = |values: &[f64]| match values {
        [rest @ .., last] if !rest.is_empty() => {
            format!("{} and {}", rest.iter().map(|x| short(*x)).collect::<Vec<_>>().join(", "), short(*last))
        }
        _ => values.iter().map(|x| short(*x)).collect(),
    };
    let excitation = &trial.choice.excitation;
    let shape = match &excitation.shape {
        Shape::Sweep { amplitude, from, to, tilt, .. } if *tilt != 0.0 => {
            format!("a sweep from {} to {} Hz that begins with {} {unit} and gets smaller", short(*from), short(*to), short(*amplitude))
        }
        Shape::Sweep { amplitude, from, to, .. } => {
            format!("a sweep of {} {unit} from {} to {} Hz", short(*amplitude), short(*from), short(*to))
        }
        Shape::Multisine { peak, rms, from, to, levels, .. } => {
            let size = peak.or(*rms).unwrap_or(0.0);
            let sizes: Vec<f64> = levels.iter().map(|l| l * size).collect();
            format!("a multisine from {} to {} Hz with peaks of {} {unit}", short(*from), short(*to), list(&sizes))
        }
        Shape::Triangle { amplitude, period, nested, .. } => {
            let inner = if *nested > 0 { " with reversals within reversals" } else { "" };
            format!("a triangle{inner} of {} {unit} with periods of {} s", short(*amplitude), list(period))
        }
        Shape::Steps { amplitude, hold, .. } => format!("steps of {} {unit}, {} s each", list(amplitude), short(*hold)),
        Shape::Impacts { amplitude, width, .. } => format!("knocks of {} {unit}, {} ms long", list(amplitude), short(1e3 * width)),
        Shape::Sines { amplitude, frequency, .. } => format!("sines of {} {unit} at {} Hz", list(amplitude), list(frequency)),
    };
    let bias = if excitation.offset != 0.0 { format!(" about {} {unit}", short(excitation.offset)) } else { String::new() };
    let name = input.map_or("", |i| i.name.as_str());
    format!("{shape}{bias} on {name} for {} s", short(trial.record.len as f64 * trial.record.period))
}

/// Names of two structures without what both have.
pub(super) fn names(a: &Structure, b: &Structure) -> [String; 2] {
    let own = |s: &Structure, o: &Structure| {
        let list: Vec<&str> = only(s, o).iter().map(|h| h.id.as_str()).collect();
        if list.is_empty() { "nothing more".to_string() } else { list.join(" + ") }
    };
    [own(a, b), own(b, a)]
}

/// What one structure adds and the other does not.
fn only<'a>(s: &'a Structure, other: &Structure) -> Vec<&'a Hypothesis> {
    s.added.iter().filter(|h| other.added.iter().all(|o| o.id != h.id)).collect()
}

/// The property that separates two structures, where each has one effect that the other does not have.
pub(super) fn separator(a: &Structure, b: &Structure) -> Option<&'static str> {
    let (a, b) = (only(a, b), only(b, a));
    let ([a], [b]) = (a.as_slice(), b.as_slice()) else { return None };
    let same_place = a.place.same(&b.place);
    let (x, y) = (a.physics.mark, b.physics.mark);
    use Mark::*;
    let pair = |p: Mark, q: Mark| (x == p && y == q) || (x == q && y == p);
    let said = match () {
        () if x == y && !same_place => "the same effect at another place loads other bodies, and each has its own resonance",
        () if pair(Dry, Viscous) => "dry friction is the same at every speed, viscous friction grows with speed: two speeds separate them",
        () if pair(Dry, Drag) || pair(Viscous, Drag) => "drag grows with the square of the speed: two speeds separate them",
        () if pair(Dry, NearRest) => "friction near rest shows in slow motion",
        () if pair(Dry, Presliding) || pair(NearRest, Presliding) => {
            "presliding friction rises over a distance after each reversal, dry friction jumps with the sign of the velocity"
        }
        () if pair(Presliding, Memory) => "reversals within reversals show the memory of the force",
        () if pair(Dry, Gap) || pair(Presliding, Gap) => {
            "a gap transmits no force, and small motion stays within it; friction acts at any amplitude"
        }
        () if pair(Delay, Gap) || pair(Lag, Gap) => "the lag of a gap falls with the amplitude, that of a delay grows with the frequency",
        () if pair(Delay, Lag) => "a delay changes only the phase, a lag also lowers the gain: high frequencies separate them",
        () if pair(Delay, Mass) || pair(Lag, Mass) => "inertia lowers the gain without a phase change; a lag changes the phase",
        () if pair(Delay, Soft) || pair(Lag, Soft) => "a compliance brings a resonance, a lag does not",
        () if pair(Limit, Shape) => {
            "a limit of the drive depends on the command, a softening spring on the displacement: several amplitudes separate them"
        }
        () if pair(Lopsided, Bias) => "an offset acts at rest and at every speed, asymmetric friction changes sign with the motion",
        () if pair(Ripple, Dry) || pair(Ripple, Bias) => "a ripple depends on position, in both directions alike",
        () if pair(Dry, Lopsided) => "asymmetric friction differs by direction: motion both ways about a bias separates them",
        () if [Spring, Shape, Mass, Soft, Limit].iter().any(|other| pair(Dry, *other)) => {
            "dry friction does not grow with the motion: several amplitudes separate them"
        }
        () => return None,
    };
    Some(said)
}

/// The information needed to decide between two structures that no recording of the same signals can separate.
pub(super) fn same_force(a: &Structure, b: &Structure) -> &'static str {
    let own = [only(a, b), only(b, a)].concat();
    own.iter().find_map(|h| h.physics.facts.twin).unwrap_or("they are the same force under two names")
}
