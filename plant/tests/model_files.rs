//! Model files: what is read, what is written, and how the wrong ones are refused.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/skipped.rs"]
mod skipped;

use backdrive_plant::elements::{Damper, Law, Spring};
use backdrive_plant::model::{Fragment, Hold, InputKind, Model, OutputKind};
use backdrive_plant::parse::ModelFile;
use backdrive_plant::write::{Edit, ElementSpec, PatchError, Value, patch, round_significant};
use naming::assert_names;
use skipped::skipped;
use std::path::{Path, PathBuf};

fn here(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)
}

fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    files.sort();
    files
}

const MASTER: &str = r#"# A master.
name = "m"
title = "a master"

[bodies]
motor = 0.01     # kg, weighed
handle = 0.04

# The cable, as bought.
[[elements]]
name = "cable"
kind = "spring"
between = ["motor", "handle"]
stiffness = 39500.0  # N/m

[[elements]]
kind = "damper"
between = ["motor", "handle"]
damping = 3

[[inputs]]
name = "feedback_force"
kind = "force"
on = "motor"
saturation = 8.9 # N

[[outputs]]
name = "motor_position"
kind = "position"
of = "motor"

[[outputs]]
name = "cable_force"
kind = "force"
element = ["cable", "element1"]
noise = 0.01

[[axes]]
name = "forward"
user = "handle"
feedback = "feedback_force"
measured = "motor_position"
travel = [-0.05, 0.05]
"#;

#[test]
fn reads_every_section_and_its_defaults() {
    let m = Model::from_toml(MASTER, "m.toml").unwrap();
    assert_eq!((m.name.as_str(), m.bodies.len(), m.elements.len()), ("m", 2, 2));
    assert_eq!(m.elements[1].name, "element1");
    assert_eq!(m.elements[1].law, Law::Damper(Damper { damping: 3.0 }));
    let input = &m.inputs[0];
    assert_eq!((input.kind, input.hold, input.gain, input.saturation), (InputKind::Force, Hold::Zero, 1.0, 8.9));
    assert!(input.bandwidth.is_infinite());
    assert_eq!(m.outputs[1].kind, OutputKind::Force(vec![0, 1]));
    assert_eq!(m.axes[0].travel, Some([-0.05, 0.05]));
    assert_eq!((m.axes[0].scale, m.axes[0].force, m.axes[0].holds_user), (1.0, None, false));
    let moved = Model::from_toml("[bodies]\na = 0\n[[inputs]]\nname='x'\nkind='motion'\non='a'\n", "m.toml").unwrap();
    assert_eq!(moved.inputs[0].hold, Hold::Cubic);
    assert_eq!(Model::from_toml("", "empty.toml").unwrap().name, "empty");
}

#[test]
fn every_file_of_ours_reads_and_round_trips() {
    for folder in ["models", "grips", "environments"] {
        for path in toml_files(&here(folder)) {
            let read = ModelFile::load(&path).unwrap_or_else(|e| panic!("{e}"));
            let stem = path.file_stem().unwrap().to_str().unwrap();
            let again = match &read {
                ModelFile::Device(m) => {
                    assert_eq!((m.name.as_str(), folder), (stem, "models"));
                    assert!(!m.axes.is_empty(), "{stem} has no axes");
                    ModelFile::Device(Model::from_toml(&m.to_toml(), "again.toml").unwrap())
                }
                ModelFile::Fragment(f) => {
                    // Variants of one fragment share its name, so that what they attach is called the same.
                    assert!(stem.starts_with(&f.network.name), "{stem} is named {}", f.network.name);
                    assert_eq!(f.hand.is_some(), folder == "grips");
                    ModelFile::Fragment(Fragment::from_toml(&f.to_toml(), "again.toml").unwrap())
                }
            };
            assert_eq!(read, again, "{}", path.display());
        }
    }
}

/// The concealed cases are not part of the repository: without them there is nothing to check.
#[test]
fn every_concealed_case_reads_and_round_trips() {
    let dev = here("../../shared/concealed/dev");
    let Ok(cases) = std::fs::read_dir(&dev) else {
        skipped("no concealed cases beside the workspace");
        return;
    };
    for case in cases {
        let path = case.unwrap().path().join("model.toml");
        match Model::load(&path) {
            Ok(model) => assert_eq!(model, Model::from_toml(&model.to_toml(), "again.toml").unwrap()),
            Err(e) => panic!("{e}"),
        }
    }
}

/// Each wrong file with the whole message that it is refused with.
#[test]
fn wrong_files_are_refused_with_file_line_key_and_what_to_do() {
    let bodies = "[bodies]\nmotor = 0.01\nhandle = 0.04\n";
    let spring = |keys: &str| format!("{bodies}[[elements]]\nname = \"cable\"\n{keys}\n");
    let good = "kind = \"spring\"\nbetween = [\"motor\", \"handle\"]\nstiffness = 5.0";
    let force = format!("{bodies}[[inputs]]\nname = \"f\"\nkind = \"force\"\non = \"motor\"\n");
    let cases: Vec<(String, &str)> = vec![
        ("a = [1,\nb = 2".into(), "x.toml:2: is not valid TOML at column 3: unexpected `=` in array, expected value, `]`"),
        ("[bodies]\nmotor = -1".into(), "x.toml:2: bodies.motor: must be at least 0, is -1"),
        ("[bodies]\nmotor = \"1\"".into(), "x.toml:2: bodies.motor: expected a number, found the string \"1\""),
        (
            "[bodies]\nmotor = 0".into(),
            "x.toml:2: bodies.motor: a free body without inertia; give it some, or an inerter, or prescribe it with a motion input",
        ),
        ("[bodies]\nground = 1".into(), "x.toml:2: bodies.ground: ground always exists and has no inertia; omit it"),
        ("[body]\nmotor = 1".into(), "x.toml:1: unknown key \"body\"; did you mean \"bodies\"?"),
        ("[elements]\n".into(), "x.toml:1: elements: expected a list of tables: write [[elements]], not [elements]"),
        (
            spring("kind = \"sprng\"\nbetween = [\"motor\", \"handle\"]"),
            "x.toml:6: elements[0] \"cable\" kind: unknown element kind \"sprng\"; did you mean \"spring\"?",
        ),
        (
            spring("kind = \"spring\"\nbetween = [\"motor\", \"hadle\"]\nstiffness = 1"),
            "x.toml:7: elements[0] \"cable\" between: unknown body \"hadle\"; did you mean \"handle\"?",
        ),
        (
            spring("kind = \"spring\"\nbetween = [\"motor\"]\nstiffness = 1"),
            "x.toml:7: elements[0] \"cable\" between: expected two bodies, found 1",
        ),
        (
            spring("kind = \"spring\"\nbetween = [\"motor\", \"motor\"]\nstiffness = 1"),
            "x.toml:7: elements[0] \"cable\" between: both ends are \"motor\"",
        ),
        (
            spring("kind = \"spring\"\nbetween = [\"motor\", \"port\"]\nstiffness = 1"),
            "x.toml:7: elements[0] \"cable\" between: only a fragment has a port: its file has kind = \"fragment\"",
        ),
        (
            spring("kind = \"spring\"\nbetween = [\"motor\", \"handle\"]\nstifness = 1"),
            "x.toml:8: elements[0] \"cable\": unknown key \"stifness\"; did you mean \"stiffness\"?",
        ),
        (
            spring("kind = \"damper\"\nbetween = [\"motor\", \"handle\"]"),
            "x.toml:4: elements[0] \"cable\": missing key \"damping\" of kind \"damper\": b, N s/m",
        ),
        (
            spring(&format!("{good}\ncolour = 3")),
            "x.toml:9: elements[0] \"cable\": unknown key \"colour\"; known here: name, kind, between, stiffness, rest",
        ),
        (
            format!("{}[[elements]]\nname = \"cable\"\n{good}", spring(good)),
            "x.toml:10: elements[1] \"cable\" name: another element has this name",
        ),
        (format!("{force}hold = \"cubik\""), "x.toml:8: inputs[0] \"f\" hold: unknown value \"cubik\"; did you mean \"cubic\"?"),
        (format!("{force}delay = -0.1"), "x.toml:8: inputs[0] \"f\" delay: must be at least 0, is -0.1"),
        (
            format!("{force}[[outputs]]\nname = \"f\"\nkind = \"position\"\nof = \"motor\""),
            "x.toml:9: outputs[0] \"f\" name: an input has this name already",
        ),
        (
            format!("{force}[[outputs]]\nname = \"y\"\nkind = \"force\"\nelement = \"cable\""),
            "x.toml:11: outputs[0] \"y\" element: unknown element \"cable\"; there is none here",
        ),
        (
            format!("{force}[[outputs]]\nname = \"y\"\nkind = \"reaction\"\nof = \"motor\""),
            "x.toml:11: outputs[0] \"y\" of: no motion input prescribes this body, so nothing exerts a reaction on it",
        ),
        (
            format!("{force}[[axes]]\nname = \"a\"\nuser = \"handle\"\nfeedback = \"g\"\nmeasured = \"y\""),
            "x.toml:11: axes[0] \"a\" feedback: unknown input \"g\"; there is f",
        ),
        ("kind = \"fragment\"".into(), "x.toml: is a fragment (a grip or an environment), expected the model of a device"),
    ];
    for (text, expected) in cases {
        let error = Model::from_toml(&text, "x.toml").expect_err(expected);
        assert_eq!(error.to_string(), expected, "\n{text}");
    }
    assert_eq!(
        Fragment::from_toml("", "x.toml").unwrap_err().to_string(),
        "x.toml: is the model of a device, expected a fragment (a grip or an environment): its file has kind = \"fragment\""
    );
    assert_eq!(
        Fragment::from_toml("kind = \"fragment\"\n[bodies]\nport = 1", "x.toml").unwrap_err().to_string(),
        "x.toml:3: bodies.port: represents the body of the device to which the fragment is attached; omit it"
    );
}

#[test]
fn a_grip_goes_on_any_axis_and_pushes_with_the_right_sign() {
    let grip = Fragment::load(&here("grips/normal.toml")).unwrap();
    let mut m = Model::from_toml(MASTER, "m.toml").unwrap();
    let user = m.axes[0].user;
    let on = m.attach(&grip, user, "grip");
    assert_eq!(on.prefix, "grip");
    let names: Vec<&str> = on.elements.iter().map(|e| m.elements[*e].name.as_str()).collect();
    assert_eq!(names, ["grip.spring", "grip.damper"]);
    assert!(on.elements.iter().all(|e| m.elements[*e].between[0] == Some(user)));
    let hand = on.hand_input.unwrap();
    assert_eq!((m.inputs[hand].name.as_str(), m.inputs[hand].kind, m.inputs[hand].hold), ("grip.hand", InputKind::Motion, Hold::Linear));
    assert_eq!(m.bodies[m.inputs[hand].on].name, "grip.hand");
    assert_eq!((on.port_first.len(), on.port_second.len()), (2, 0));
    // A stretched grip pulls the handle back.
    let force = m.add_port_force(&on);
    let mut outputs = vec![0.0; m.outputs.len()];
    outputs[m.outputs.len() - 1] = 3.0;
    assert_eq!(force.of(&outputs), -3.0);
    // A second grip of the same prefix does not take the first one's names.
    let second = m.attach(&grip, 0, "grip");
    assert_eq!((second.prefix.as_str(), m.bodies.last().unwrap().name.as_str()), ("grip2", "grip2.hand"));
    assert_eq!(m, Model::from_toml(&m.to_toml(), "again.toml").unwrap());
}

#[test]
fn a_fragment_may_have_bodies_of_its_own_and_end_on_the_port() {
    let text = "kind = 'fragment'\n[bodies]\npad = 0.1\n[[elements]]\nname='a'\nkind='spring'\nbetween=['pad','port']\nstiffness=1\n\
        [[elements]]\nname='b'\nkind='damper'\nbetween=['pad','ground']\ndamping=1\n[[outputs]]\nname='y'\nkind='force'\nelement='b'\n";
    let fragment = Fragment::from_toml(text, "x.toml").unwrap();
    let mut m = Model::from_toml(MASTER, "m.toml").unwrap();
    let on = m.attach(&fragment, 1, "wall");
    assert_eq!((on.bodies.as_slice(), on.port_second.as_slice(), on.hand_input), ([2].as_slice(), [2].as_slice(), None));
    assert_eq!(m.elements[2].between, [Some(2), Some(1)]);
    assert_eq!(m.outputs[2].kind, OutputKind::Force(vec![3]));
    let force = m.add_port_force(&on);
    assert_eq!(force.of(&[0.0, 0.0, 0.0, 4.0]), 4.0);
}

#[test]
fn a_patch_keeps_comments_order_and_everything_it_does_not_name() {
    let set = |path: &str, x: f64, comment: Option<&str>| Edit::Set {
        path: path.into(),
        value: Value::Number(x),
        comment: comment.map(str::to_string),
    };
    let element = |name: &str, between: [&str; 2], law: Law| ElementSpec { name: name.into(), between: between.map(str::to_string), law };
    let edits = [
        set("bodies.motor", 0.0108, Some("refitted, was 0.01")),
        set("elements.cable.stiffness", 38900.0, Some("refitted")),
        set("elements.element1.damping", 3.5, None),
        set("inputs.feedback_force.delay", 4e-4, Some("found")),
        set("outputs.motor_position.gain", 1.01, None),
        Edit::PutBody { name: "drum".into(), inertia: 0.0175, comment: Some("found".into()) },
        Edit::PutElement {
            element: element("cable", ["motor", "drum"], Law::Spring(Spring { stiffness: 38900.0, rest: 0.0 })),
            comment: None,
        },
        Edit::PutElement {
            element: element("linkage", ["drum", "handle"], Law::Spring(Spring { stiffness: 4000.0, rest: 0.0 })),
            comment: Some("found: a compliance\nthat was left out".into()),
        },
    ];
    let text = patch(MASTER, &edits).unwrap();
    let expected = MASTER
        .replace("motor = 0.01     # kg, weighed", "motor = 0.0108     # kg, weighed; refitted, was 0.01")
        .replace("handle = 0.04\n", "handle = 0.04\ndrum = 0.0175  # found\n")
        .replace("between = [\"motor\", \"handle\"]\nstiffness = 39500.0  # N/m", "between = [\"motor\", \"drum\"]\nstiffness = 38900.0  # N/m; refitted")
        .replace(
            "damping = 3\n",
            "damping = 3.5\n\n# found: a compliance that was left out\n[[elements]]\nname = \"linkage\"\nkind = \"spring\"\nbetween = [\"drum\", \"handle\"]\nstiffness = 4000.0\n",
        )
        .replace("saturation = 8.9 # N\n", "saturation = 8.9 # N\ndelay = 0.0004  # found\n")
        .replace("of = \"motor\"\n", "of = \"motor\"\ngain = 1.01\n");
    assert_eq!(text, expected);
    let m = Model::from_toml(&text, "m.toml").unwrap();
    assert_eq!(m.bodies.len(), 3);
    assert_eq!(m.element_spec(2).unwrap().between, ["drum", "handle"]);

    let removed = patch(MASTER, &[Edit::RemoveElement { name: "cable".into() }]).unwrap();
    assert!(!removed.contains("as bought") && removed.contains("name = \"element1\""), "{removed}");

    let replaced = Edit::PutElement { element: element("cable", ["motor", "handle"], Law::Damper(Damper { damping: 1.0 })), comment: None };
    let text = patch(MASTER, &[replaced]).unwrap();
    assert_names(&text, &["kind = \"damper\"\nbetween = [\"motor\", \"handle\"]\ndamping = 1.0\n\n[[elements]]\nkind"]);

    let wrong = |path: &str| patch(MASTER, &[set(path, 1.0, None)]).unwrap_err();
    assert_eq!(wrong("elements.cabel.stiffness"), PatchError::NoSuch { section: "elements".into(), name: "cabel".into() });
    assert_eq!(wrong("nonsense"), PatchError::Path("nonsense".into()));
    assert_eq!(wrong("bodies.none").to_string(), "there is no \"none\" among the model's bodies");
}

#[test]
fn a_list_may_stand_in_a_file_beside_the_model() {
    let dir = tempfile::tempdir().unwrap();
    let model = |name: &str| {
        let text = format!(
            "[bodies]\na = 1\n[[elements]]\nkind = 'maxwell_slip'\nbetween = ['a', 'ground']\nstiffness = '{name}'\nforce = [1, 2]\n"
        );
        std::fs::write(dir.path().join("x.toml"), text).unwrap();
        let shorten = |e: backdrive_plant::tomlfile::FileError| e.to_string().replace(&format!("{}/", dir.path().display()), "");
        Model::load(&dir.path().join("x.toml")).map_err(shorten)
    };
    std::fs::write(dir.path().join("k.csv"), "# N/m\nk\n3\n4\n").unwrap();
    assert_eq!(model("k.csv").unwrap().elements[0].law.values()[0], [3.0, 4.0]);
    std::fs::write(dir.path().join("k.csv"), "3\nfour\n").unwrap();
    assert_eq!(model("k.csv").unwrap_err(), "k.csv:2: column 1: expected a number, found \"four\"");
    assert_eq!(model("none.csv").unwrap_err(), "x.toml:6: elements[0] \"element0\" stiffness: \"none.csv\": there is no such file");
}

#[test]
fn a_fragment_may_move_its_hand_itself() {
    let text = "kind='fragment'\n[[elements]]\nname='s'\nkind='spring'\nbetween=['port','hand']\nstiffness=1\n\
        [[inputs]]\nname='intent'\nkind='motion'\non='hand'\nhold='cubic'\n";
    let mut m = Model::from_toml(MASTER, "m.toml").unwrap();
    let on = m.attach(&Fragment::from_toml(text, "x.toml").unwrap(), 1, "grip");
    assert_eq!((m.inputs.len(), m.inputs[on.hand_input.unwrap()].name.as_str()), (2, "grip.intent"));
}

#[test]
fn a_patch_without_edits_is_the_file() {
    for folder in ["models", "grips", "environments"] {
        for path in toml_files(&here(folder)) {
            let text = std::fs::read_to_string(&path).unwrap();
            assert_eq!(patch(&text, &[]).unwrap(), text);
        }
    }
}

#[test]
fn numbers_are_read_and_set_by_path() {
    let mut m = Model::from_toml(MASTER, "m.toml").unwrap();
    for path in m.parameter_paths() {
        let values = m.values_at(&path).unwrap();
        m.set_values_at(&path, &values).unwrap();
    }
    assert_eq!(m, Model::from_toml(MASTER, "m.toml").unwrap());
    m.set_values_at("elements.cable.stiffness", &[5.0]).unwrap();
    m.set_values_at("inputs.feedback_force.saturation", &[f64::INFINITY]).unwrap();
    m.set_values_at("outputs.cable_force.noise", &[0.5]).unwrap();
    m.set_values_at("bodies.motor", &[2.0]).unwrap();
    assert_eq!(m.values_at("elements.cable.stiffness"), Ok(vec![5.0]));
    assert_eq!((m.inputs[0].saturation, m.outputs[1].noise, m.bodies[0].inertia), (f64::INFINITY, 0.5, 2.0));
    let mut wrong = |path: &str, values: &[f64]| m.set_values_at(path, values).unwrap_err();
    assert_eq!(wrong("bodies.moter", &[1.0]), "unknown body \"moter\"; did you mean \"motor\"?");
    assert_eq!(wrong("bodies.motor", &[-1.0]), "bodies.motor must be at least 0, is -1");
    assert_eq!(wrong("elements.cable.stif", &[1.0]), "unknown key \"stif\"; did you mean \"stiffness\"?");
    assert_eq!(wrong("elements.cable.stiffness", &[1.0, 2.0]), "elements.cable.stiffness takes one number, not 2");
    assert_eq!(wrong("inputs.feedback_force.delay", &[f64::NAN]), "inputs.feedback_force.delay must be a finite number, is NaN");
    assert!(wrong("elements", &[1.0]).starts_with("\"elements\" is not the path of a parameter; expected bodies.NAME"));
}

#[test]
fn numbers_are_rounded_to_significant_digits() {
    assert_eq!(round_significant(38_912.345, 4), 38_910.0);
    assert_eq!(round_significant(-2.346e-7, 3), -2.35e-7);
    assert_eq!(round_significant(0.0, 3), 0.0);
}
