//! Elements of the nominal model count, whatever their law; torque that is clipped or without its sign is no ground for a claim; a joint may have no motor.

use crate::common::{AS_STATED, Beside, URDF, series, set, write};
use crate::naming::assert_names;
use backdrive_diagnosis::arms::diagnose::{Found, diagnose};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::regression::{Data, parts_of};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::{NextExperiment, Parameter, Word};
use backdrive_plant::robot::{RobotFile, Tree};
use backdrive_plant::set::RecordingSet;
use std::path::Path;

type Columns = [Vec<f64>; 7];

fn problem(folder: &Path) -> Problem {
    Problem::open(&RecordingSet::open(folder).unwrap(), None).unwrap()
}

fn with(folder: &Path, elements: &str) {
    std::fs::write(folder.join("arm.toml"), format!("name = \"arm\"\n[robot]\nfile = \"arm.urdf\"\n{elements}")).unwrap();
}

fn at_elbow(kind: &str, parameters: &str) -> String {
    format!("[[elements]]\nname = \"seal\"\nkind = \"{kind}\"\nbetween = [\"elbow\", \"ground\"]\n{parameters}\n")
}

fn found(folder: &Path) -> Found {
    diagnose(&problem(folder), &Options::default(), None, &|_| ()).unwrap()
}

/// Findings as effect and place.
fn claims(found: &Found) -> Vec<(String, Place)> {
    found.verdict.findings.iter().map(|f| (f.physics.clone(), f.place.clone())).collect()
}

/// Share of the elbow's torque that the nominal model as given leaves, in rows where it moves.
fn left_at_elbow(folder: &Path) -> f64 {
    let problem = problem(folder);
    let data = Data::new(&problem, None, false).unwrap();
    let fit = data.fit(&data.nominal_structure(), &data.weights(&data.torque)).unwrap();
    (data.mean_square(&fit.residual, 1, false) / data.mean_square(&data.torque, 1, false)).sqrt()
}

/// Laws that the regression has no terms for, and what they are at the elbow in words of their own: of position and velocity.
type Torque = fn(f64, f64) -> f64;

const DRY: Torque = |_, v| 0.3 * v.signum();

fn laws() -> Vec<(&'static str, &'static str, Torque)> {
    vec![
        ("lugre", "coulomb = 0.3\nstatic = 0.3\nvelocity = 0.1\nstiffness = 600.0\ndamping = 0.5", DRY),
        ("maxwell_slip", "stiffness = [400.0, 200.0]\nforce = [0.2, 0.1]", DRY),
        ("bouc_wen", "stiffness = 600.0\nratio = 0.0\namplitude = 1.0\nbeta = 1000.0\ngamma = 1000.0\nexponent = 1.0", DRY),
        ("warm_friction", "force = 0.3\nhalf_heat = 1e6\ncooling_time = 10.0", DRY),
        ("friction_deficit", "coulomb = 0.3\nrest = 0.1\nvelocity = 1e-4", DRY),
        ("cubic_spring", "stiffness = 0.8\ncubic = 1.5", |q, _| 0.8 * q + 1.5 * q * q * q),
        ("contact", "stiffness = 6.0\ngap = 0.1", |q, _| 6.0 * (q - 0.1).max(0.0)),
        ("hunt_crossley", "stiffness = 9.0\nexponent = 2.0\ngap = -0.1", |q, _| 9.0 * (q + 0.1).max(0.0).powi(2)),
        ("backlash", "gap = 0.2\nstiffness = 4.0", |q, _| 4.0 * (q - q.clamp(-0.1, 0.1))),
        (
            "hysteretic_spring",
            "stiffness_positive = 2.0\nstiffness_negative = 2.0\noffset_positive = 0.3\noffset_negative = -0.3\nbandwidth = 2000.0",
            |q, v| 2.0 * q + 0.3 * v.signum(),
        ),
        ("creep", "stiffness = 3.0\ncreep_stiffness = [1e5]\ntime = [0.5]", |q, _| 3.0 * q),
    ]
}

#[test]
fn every_law_that_the_file_states_counts_in_the_torque() {
    for (kind, parameters, truth) in laws() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path();
        set(place, &AS_STATED, "", |c: &mut Columns| {
            for i in 0..c[0].len() {
                let more = truth(c[2][i], c[4][i]);
                c[6][i] += more;
            }
        });
        let without = left_at_elbow(place);
        with(place, &at_elbow(kind, parameters));
        let stated = left_at_elbow(place);
        assert!(stated < 0.06 && stated < 0.5 * without, "{kind}: {:.1} % remain, {:.1} % without it", 100.0 * stated, 100.0 * without);
        // The same on the ground's side of the element.
        with(place, &at_elbow(kind, parameters).replace("[\"elbow\", \"ground\"]", "[\"ground\", \"elbow\"]"));
        let turned = left_at_elbow(place);
        let is_odd = truth(0.3, 1.0) == -truth(-0.3, -1.0);
        assert_eq!(turned < 0.06, is_odd, "{kind}: {:.1} % remain with its ends changed over", 100.0 * turned);
    }
}

#[test]
fn an_element_between_two_joints_counts_at_both() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &AS_STATED, "", |c: &mut Columns| {
        for i in 0..c[0].len() {
            let belt = 5.0 * (c[2][i] - c[1][i]) + 0.4 * (c[4][i] - c[3][i]);
            c[6][i] += belt;
            c[5][i] -= belt;
        }
    });
    let between = |kind: &str, more: &str| format!("[[elements]]\nkind = \"{kind}\"\nbetween = [\"elbow\", \"shoulder\"]\n{more}\n");
    with(place, &(between("spring", "stiffness = 5.0") + &between("damper", "damping = 0.4")));
    assert!(left_at_elbow(place) < 0.04, "{}", left_at_elbow(place));
}

#[test]
fn a_law_without_a_term_is_not_found_a_second_time_nor_written_twice() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    with(place, &at_elbow("lugre", laws()[0].1));
    let found = found(place);
    assert_eq!(found.verdict.word, Word::NothingMissing, "{}", found.verdict.sentence);
    assert!(found.notes.iter().any(|note| note.contains("\"seal\" (lugre) is computed along the measured motion")), "{:?}", found.notes);
    let elbow: Vec<&str> = found.model.split("[[elements]]").skip(1).filter(|e| e.contains("\"elbow\"") && !e.contains("damper")).collect();
    assert!(elbow.len() == 1 && elbow[0].contains("lugre"), "{}", found.model);
}

#[test]
fn what_cannot_count_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &AS_STATED, "", |_| {});
    let at_the_tip = "[point.tool]\nlink = \"tip\"\n[[elements]]\nname = \"leash\"\nkind = \"spring\"\nbetween = [\"tool.x\", \"ground\"]\nstiffness = 3.0\n";
    let by_load =
        "[[elements]]\nname = \"belt\"\nkind = \"load_friction\"\nbetween = [\"elbow\", \"shoulder\"]\nforce = 0.1\ncoefficient = 0.1\n";
    with(place, &format!("{at_the_tip}{by_load}"));
    let found = found(place);
    let of = |name: &str| {
        found
            .verdict
            .audit
            .iter()
            .find(|r| r.what == "element" && r.place.contains(name))
            .unwrap_or_else(|| panic!("{:?}", found.verdict.audit))
    };
    let (leash, belt) = (of("leash"), of("belt"));
    assert!(
        leash.place == "arm.toml:7: element \"leash\"" && leash.message.contains("(spring) is not used: it acts on tool.x"),
        "{leash:?}"
    );
    assert!(belt.message.contains("load that is not known") && belt.weight == Weight::Caution, "{belt:?}");
}

#[test]
fn every_kind_has_terms_or_a_torque_along_the_motion_or_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &AS_STATED, "", |_| {});
    let mut seen = 0;
    for (kind, parameters) in laws().iter().map(|l| (l.0, l.1)).chain([
        ("coulomb", "force = 0.1"),
        ("spring", "stiffness = 1.0"),
        ("cogging", "amplitude = 0.1\nperiod = 0.2\nphase = 0.0"),
        ("dahl", "stiffness = 100.0\ncoulomb = 0.1"),
        ("inerter", "inertance = 0.01"),
    ]) {
        with(place, &at_elbow(kind, parameters));
        let problem = problem(place);
        let data = Data::new(&problem, None, false).unwrap();
        let given = problem.given.iter().find(|g| g.name == "seal").unwrap_or_else(|| panic!("{kind} is nowhere"));
        let bare = Data::new(&Problem { given: Vec::new(), ..problem.clone() }, None, false).map(|d| d.nominal).unwrap();
        assert_eq!(parts_of(&given.law).is_empty(), bare != data.nominal, "{kind}");
        seen += 1;
    }
    assert!(seen > 15);
}

#[test]
fn clipped_torque_is_said_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let limit = 3.0;
    set(place, &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |c: &mut Columns| c[5].iter_mut().for_each(|t| *t = t.clamp(-limit, limit)));
    let found = found(place);
    let said: Vec<_> = found.verdict.audit.iter().filter(|r| r.what == "saturated").collect();
    assert!(!said.is_empty() && said.iter().all(|r| r.place.ends_with("shoulder.torque") && r.message.contains("3.0000 in")), "{said:?}");
    assert_eq!(
        claims(&found),
        [("coulomb".to_string(), Place::Between("elbow".to_string(), "ground".to_string()))],
        "{}",
        found.verdict.sentence
    );
    let Some(Parameter::One(force)) = found.verdict.findings[0].parameters.get("force") else { panic!("{:?}", found.verdict.findings) };
    assert!((force.value - 0.3).abs() < 0.01, "{}", force.value);
}

#[test]
fn torque_without_its_sign_is_said_and_nothing_is_claimed_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |c: &mut Columns| {
        [5, 6].iter().for_each(|k| c[*k].iter_mut().for_each(|t| *t = t.abs()))
    });
    let both = found(place);
    let signs = |found: &Found| found.verdict.audit.iter().filter(|r| r.what == "sign" && r.message.contains("without its sign")).count();
    assert_eq!((both.verdict.word, signs(&both), both.verdict.findings.len()), (Word::CannotTell, 2, 0), "{}", both.verdict.sentence);
    assert_names(&both.verdict.sentence, &["shoulder, elbow"]);

    // At one joint: the other is diagnosed, and this one is written as the file has it.
    set(place, &Beside { dry: [0.5, 0.3], ..AS_STATED }, "", |c: &mut Columns| c[6].iter_mut().for_each(|t| *t = t.abs()));
    let one = found(place);
    assert_eq!(signs(&one), 1, "{:?}", one.verdict.audit);
    let elbow = Place::Between("elbow".to_string(), "ground".to_string());
    assert!(claims(&one).iter().all(|(_, place)| *place != elbow), "{}", one.verdict.sentence);
    assert_names(&one.model, &["damping = 0.04"]);
}

#[test]
fn a_torque_of_one_sign_is_not_taken_for_one_without_its_sign() {
    let folder = tempfile::tempdir().unwrap();
    // A counterweight that pulls harder than the links.
    set(folder.path(), &AS_STATED, "", |c: &mut Columns| c[5].iter_mut().for_each(|t| *t += 60.0));
    let problem = problem(folder.path());
    assert_eq!(Data::new(&problem, None, false).unwrap().unsigned, [false, false]);
}

/// A pendulum without a motor on a driven shoulder.
fn swing(seed: u64, damping: f64) -> Columns {
    let tree = Tree::new(&RobotFile::from_xml(URDF, "arm.urdf").unwrap().robot).unwrap();
    let path = series(seed, [0.0; 2], 0.5);
    let mut work = tree.workspace();
    let mut inverse = |q: [f64; 2], v: [f64; 2], a: [f64; 2]| {
        let mut f = [0.0; 2];
        tree.inverse_dynamics(&q, &v, &a, &mut work, &mut f);
        f
    };
    let (mut q2, mut v2, step, each) = (0.8, 0.0, 2.5e-4, 20);
    let mut out: Columns = Default::default();
    for i in 0..2400 * each {
        let [q, v, a] = path(i as f64 * step);
        let (q, v) = ([q[0], q2], [v[0], v2]);
        let rest = inverse(q, v, [a[0], 0.0])[1] + damping * v2;
        let own = inverse(q, [0.0; 2], [0.0, 1.0])[1] - inverse(q, [0.0; 2], [0.0; 2])[1];
        let a2 = -rest / own;
        if i % each == 0 {
            let tau = inverse(q, v, [a[0], a2])[0] + 0.1 * v[0] + 0.2 * v[0].signum();
            [i as f64 * step, q[0], q2, v[0], v2, tau, 0.0].iter().zip(&mut out).for_each(|(x, column)| column.push(*x));
        }
        v2 += step * a2;
        q2 += step * v2;
    }
    out
}

/// A pendulum on a shoulder whose torque no law explains: `stated` is the elbow's damping in the file, that of the arm is 0.01.
fn beside_a_riddle(folder: &Path, stated: &str, at_shoulder: fn(f64) -> f64) {
    set(
        folder,
        &AS_STATED,
        "[joints.shoulder]\nposition = \"q1\"\ntorque = \"tau1\"\n[joints.elbow]\nposition = \"q2\"\ntorque = 0\n",
        |_| {},
    );
    std::fs::write(folder.join("arm.urdf"), URDF.replace("<dynamics damping=\"0.04\"/>", stated)).unwrap();
    for (seed, name) in ["a.csv", "b.csv", "c.csv"].iter().enumerate() {
        let mut columns = swing(seed as u64 + 5, 0.01);
        for i in 0..columns[0].len() {
            columns[5][i] = at_shoulder(columns[1][i]);
        }
        write(&folder.join(name), &columns);
    }
}

#[test]
fn the_friction_of_a_joint_without_a_motor_is_its_own_whatever_the_others_torque_is() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let near = |x: f64| (x - 0.01).abs() < 5e-4;
    {
        beside_a_riddle(place, "<dynamics damping=\"0.04\"/>", |q| 3.0 * q.sin());
        let found = found(place);
        let damping =
            found.verdict.parameters.get("elements.elbow_damping.damping").unwrap_or_else(|| panic!("{:?}", found.verdict.sentence));
        assert!(near(damping.value) && damping.nominal == 0.04, "{damping:?}");
        let said = "By the equation of elbow, which has no motor, elbow_damping.damping is ";
        assert!(found.verdict.sentence.contains(said), "{}", found.verdict.sentence);
        let elbow = &found.verdict.arm.as_ref().unwrap().joints[1];
        assert!(elbow.diagnosed < 0.02, "{elbow:?}");
    }
    // Not stated by the file, it is missing.
    beside_a_riddle(place, "", |q| 3.0 * q.sin());
    let found = found(place);
    let elbow = Place::Between("elbow".to_string(), "ground".to_string());
    let damper = found.verdict.findings.iter().find(|f| f.physics == "damper" && f.place == elbow);
    let Some(Parameter::One(damping)) = damper.and_then(|f| f.parameters.get("damping")) else { panic!("{}", found.verdict.sentence) };
    assert!(near(damping.value), "{damping:?}");
}

#[test]
fn a_joint_without_a_motor_is_diagnosed_by_its_equation() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    set(place, &AS_STATED, "", |_| {});
    std::fs::write(place.join("arm.urdf"), URDF.replace("<dynamics damping=\"0.04\"/>", "")).unwrap();
    for (seed, name) in ["a.csv", "b.csv", "c.csv"].iter().enumerate() {
        write(&place.join(name), &swing(seed as u64 + 5, 0.01));
    }
    let refused = diagnose(&problem(place), &Options::default(), None, &|_| ()).unwrap_err().to_string();
    assert_names(&refused, &["elbow.torque", "[joints.elbow]"]);

    let joints = "[joints.shoulder]\nposition = \"q1\"\ntorque = \"tau1\"\n[joints.elbow]\nposition = \"q2\"\ntorque = 0\n";
    let text = std::fs::read_to_string(place.join("set.toml")).unwrap();
    std::fs::write(place.join("set.toml"), text + joints).unwrap();
    let found = found(place);
    // The shoulder's motion moves the elbow, so its friction cannot always be distinguished from the shoulder's torque constant; it is named in any
    // case.
    assert_names(&found.verdict.sentence, &["viscous friction", "elbow"]);
    let elbow = &found.verdict.arm.as_ref().unwrap().joints[1];
    assert!(elbow.diagnosed < 0.05 && elbow.loop_diagnosed.is_none_or(|share| share < 0.5), "{elbow:?}");

    // What is planned next moves no joint that has no motor.
    let Some(NextExperiment::Planned(planned)) = &found.verdict.next_experiment else { panic!("{:?}", found.verdict.next_experiment) };
    assert!(found.experiment.starts_with("t,shoulder.position\n"), "{}", &found.experiment[..80]);
    assert!(planned.input == "all joints with a motor", "{planned:?}");
    assert_names(&planned.sentence, &["elbow"]);

    let set = place.join("set.toml");
    let wrong = std::fs::read_to_string(&set).unwrap().replace("torque = 0\n", "torque = 0.5\n");
    std::fs::write(&set, wrong).unwrap();
    let error = RecordingSet::open(place).unwrap_err().to_string();
    assert_names(&error, &["joints.elbow"]);
}
