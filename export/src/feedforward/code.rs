//! Terms as expressions of a language, and the whole as a file of it.

use super::terms::{Joint, Term};
use crate::names::identifier;
use backdrive_plant::model::Model;
use std::collections::BTreeSet;

/// How a language writes what terms are made of.
pub(super) struct Dialect {
    /// Of `tanh`, `exp` and `sin`, and of the magnitude.
    function: fn(&str, &str) -> String,
    /// The second where the first holds, else the third.
    choice: fn(&str, &str, &str) -> String,
}

/// C99.
pub(super) const C: Dialect = Dialect {
    function: |name, of| if name == "abs" { format!("fabs({of})") } else { format!("{name}({of})") },
    choice: |when, then, other| format!("({when} ? {then} : {other})"),
};

/// Python 3.
pub(super) const PYTHON: Dialect = Dialect {
    function: |name, of| if name == "abs" { format!("abs({of})") } else { format!("math.{name}({of})") },
    choice: |when, then, other| format!("({then} if {when} else {other})"),
};

/// A number that both languages read as one with a fraction.
fn n(value: f64) -> String {
    format!("{value:?}")
}

impl Dialect {
    fn two(&self, when: &str, [then, other]: [f64; 2]) -> String {
        if then == other { n(then) } else { (self.choice)(when, &n(then), &n(other)) }
    }

    /// A term, of `q`, `dq`, `load` and the smooth sign `s`.
    fn term(&self, term: &Term) -> String {
        let abs_load = (self.function)("abs", "load");
        match *term {
            Term::Coulomb { positive, negative } => format!("{} * s", self.two("dq > 0.0", [positive, negative])),
            Term::Stribeck { coulomb, rest, velocity } => {
                let share = (self.function)("exp", &format!("-(dq / {v}) * (dq / {v})", v = n(velocity)));
                format!("({} + {} * {share}) * s", n(coulomb), n(rest - coulomb))
            }
            Term::Load { driving, driven } => format!("{} * {abs_load} * s", self.two("load * dq > 0.0", [driving, driven])),
            Term::Viscous { positive, negative } => format!("{} * dq", self.two("dq > 0.0", [positive, negative])),
            Term::Drag { coefficient } => format!("{} * dq * {}", n(coefficient), (self.function)("abs", "dq")),
            Term::Spring { stiffness, rest, cubic } => {
                let linear = if rest == 0.0 { format!("{} * q", n(stiffness)) } else { format!("{} * (q - {})", n(stiffness), n(rest)) };
                if cubic == 0.0 { linear } else { format!("{linear} + {} * q * q * q", n(cubic)) }
            }
            Term::Cogging { amplitude, period, phase } => {
                let angle = format!("{} * q + {}", n(std::f64::consts::TAU / period), n(phase));
                format!("{} * {}", n(amplitude), (self.function)("sin", &angle))
            }
            Term::Constant { force } => n(force),
        }
    }
}

/// What a reader of the file should know.
fn heading(model: &Model) -> Vec<String> {
    let what = if model.title.is_empty() { &model.name } else { &model.title };
    let mut all = vec![format!("Feed-forward of friction and the like: {what}.")];
    if !model.source.is_empty() {
        all.push(format!("Source of the parameters: {}.", model.source.trim_end_matches('.')));
    }
    all.extend(
        [
            "Each function returns the effort along +q with which a motor compensates the listed terms.",
            "q: position, dq: velocity, load: force of what the joint drives, positive where it resists motion along +q.",
            "The sign of dq is tanh(dq/width): exact to rounding from 20 widths on. What moves together adds up.",
        ]
        .map(str::to_owned),
    );
    all
}

/// Names of the functions.
pub(super) fn names(model: &Model, joints: &[Joint]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let of = |joint: &Joint| if model.name.is_empty() { joint.name.clone() } else { format!("{}_{}", model.name, joint.name) };
    joints.iter().map(|joint| identifier(&of(joint), &mut taken)).collect()
}

/// As C99.
pub(super) fn c(model: &Model, joints: &[Joint]) -> String {
    // What a user wrote does not end the comment.
    let mut out: String = heading(model).iter().map(|line| format!("/* {} */\n", line.replace("*/", "* /"))).collect();
    out += "#include <math.h>\n";
    for (joint, name) in joints.iter().zip(names(model, joints)) {
        out += &format!(
            "\n/* {}: {}; q in {p}, dq in {p}/s */\ndouble {name}(double q, double dq, double load)\n{{\n    const double width = {}; /* {p}/s */\n    \
             const double s = tanh(dq / width);\n    double effort = 0.0;\n",
            joint.name.replace("*/", "* /"),
            joint.unit,
            n(joint.width),
            p = joint.position_unit
        );
        for (element, kind, term) in &joint.terms {
            out += &format!("    effort += {}; /* {} ({kind}) */\n", C.term(term), element.replace("*/", "* /"));
        }
        out += "    (void)q;\n    (void)s;\n    (void)load;\n    return effort;\n}\n";
    }
    out
}

/// As Python 3.
pub(super) fn python(model: &Model, joints: &[Joint]) -> String {
    let one_line = |text: &str| text.replace(['\n', '\r'], " ");
    let mut out: String = heading(model).iter().map(|line| format!("# {}\n", one_line(line))).collect();
    out += "import math\n";
    for (joint, name) in joints.iter().zip(names(model, joints)) {
        out += &format!(
            "\n\ndef {name}(q, dq, load=0.0):\n    # {}: {}; q in {p}, dq in {p}/s\n    width = {}  # {p}/s\n    s = math.tanh(dq / width)\n    effort = 0.0\n",
            one_line(&joint.name),
            joint.unit,
            n(joint.width),
            p = joint.position_unit
        );
        for (element, kind, term) in &joint.terms {
            out += &format!("    effort += {}  # {} ({kind})\n", PYTHON.term(term), one_line(element));
        }
        out += "    return effort\n";
    }
    out
}
