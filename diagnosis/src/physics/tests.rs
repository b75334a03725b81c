//! All hypotheses on all devices: what they do to a model and to its file, and whether it still moves.

use super::*;
use crate::hypothesis::{Against, Family, HypothesisError, Parameter, Run, refined, starts_beside};
use backdrive_plant::elements::KINDS;
use backdrive_plant::model::{InputKind, OutputKind};
use backdrive_plant::stepper::{Options, simulate};
use backdrive_plant::write::patch;
use std::path::{Path, PathBuf};

/// Samples and sample time of the test runs.
const SAMPLES: usize = 400;

/// Text and model of every device at hand.
pub(super) fn devices() -> Vec<(String, String, Model)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files: Vec<PathBuf> = Vec::new();
    let in_folder = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| Some(e.ok()?.path()));
    files.extend(in_folder(root.join("plant/models")).filter(|p| p.extension().is_some_and(|e| e == "toml")));
    files.extend(in_folder(root.join("../shared/concealed/dev")).map(|p| p.join("model.toml")).filter(|p| p.is_file()));
    files.sort();
    assert!(files.len() >= 14, "the plant's models are not where they were");
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("readable");
        let model = Model::load(&path).expect("a model");
        // Lists in files beside the model are not in its text.
        Model::from_toml(&text, "model").is_ok().then(|| (path.display().to_string(), text, model))
    };
    files.into_iter().filter_map(read).collect()
}

/// A sample time that resolves the model, and inputs that move it.
fn run(model: &Model) -> (Vec<Vec<f64>>, f64) {
    let period = 1e-3;
    let sine = |amplitude: f64, hz: f64| {
        (0..SAMPLES)
            .map(|k| {
                let t = k as f64 * period;
                amplitude * (1.0 - (-t / 0.05).exp()) * ((std::f64::consts::TAU * hz * t).sin() + 0.3 * (17.0 * hz * t).sin())
            })
            .collect::<Vec<f64>>()
    };
    // Enough to break every friction loose.
    let friction: f64 = model
        .elements
        .iter()
        .filter_map(|e| Some(level(physics_named(e.law.kind().name).filter(|p| p.family == Family::Friction)?, &e.law)))
        .sum();
    let force = 2.0 + 3.0 * friction;
    let inputs = model.inputs.iter().enumerate();
    (inputs.map(|(i, input)| sine(if input.kind == InputKind::Force { force } else { 2e-3 }, 9.0 + i as f64)).collect(), period)
}

fn driven((inputs, period): &(Vec<Vec<f64>>, f64)) -> Run {
    Run { inputs: inputs.clone(), period: *period, begins: Vec::new() }
}

pub(super) fn hypotheses(model: &Model) -> (Vec<Hypothesis>, (Vec<Vec<f64>>, f64)) {
    let run = run(model);
    let scales = Scales::of(model, &[driven(&run)]).expect("the device moves");
    (all(model, &scales), run)
}

#[test]
fn applying_and_editing_the_file_give_the_same_model() {
    for (name, text, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        assert!(hypotheses.len() > 10, "{name}: {}", hypotheses.len());
        for h in &hypotheses {
            for start in &h.starts {
                let applied = h.apply(&model, start).unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_ne!(applied, model, "{name}: {} changes nothing", h.id);
                let edited = patch(&text, &h.edits(&model, start).expect("edits")).unwrap_or_else(|e| panic!("{name}: {}: {e}", h.id));
                let read = Model::from_toml(&edited, "edited").unwrap_or_else(|e| panic!("{name}: {}: {e}\n{edited}", h.id));
                assert_eq!(read, applied, "{name}: {}", h.id);
            }
        }
    }
}

#[test]
fn values_stand_where_the_paths_say() {
    for (name, _, model) in devices() {
        for h in hypotheses(&model).0 {
            let start = &h.starts[0];
            let applied = h.apply(&model, start).expect("applies");
            let found = h.values_in(&applied, &model).unwrap_or_else(|| panic!("{name}: {}: a path leads nowhere", h.id));
            for ((p, wanted), found) in h.parameters.iter().zip(start).zip(found) {
                assert!((found - wanted).abs() <= 1e-9 * wanted.abs().max(1e-9), "{name}: {} {}: {found}, not {wanted}", h.id, p.key);
                assert!(!p.unit.is_empty() && p.path.ends_with(&p.key) || p.path.starts_with("bodies."), "{}", p.path);
            }
        }
    }
}

#[test]
fn ids_are_unique_and_starts_lie_in_their_ranges() {
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        for (i, h) in hypotheses.iter().enumerate() {
            assert!(hypotheses[..i].iter().all(|other| other.id != h.id), "{name}: {} twice", h.id);
            assert!(!h.starts.is_empty() && !h.parameters.is_empty(), "{name}: {}", h.id);
            assert!(h.same_as.as_ref().is_none_or(|path| model.values_at(path).is_ok()), "{name}: {} {:?}", h.id, h.same_as);
            assert!(h.replaces.iter().all(|e| model.elements.iter().any(|m| m.name == *e)), "{name}: {}", h.id);
            for p in &h.parameters {
                let (low, high) = p.range;
                assert!(low < high && low.is_finite() && high.is_finite(), "{name}: {} {}: {:?}", h.id, p.key, p.range);
                assert!(!p.log || low > 0.0, "{name}: {} {}", h.id, p.key);
                assert!(p.neutral.is_none_or(|n| n.is_infinite() || (low..=high).contains(&n)), "{name}: {} {}: {p:?}", h.id, p.key);
            }
            for start in &h.starts {
                assert_eq!(start.len(), h.parameters.len());
                for (x, p) in start.iter().zip(&h.parameters) {
                    assert!((p.range.0..=p.range.1).contains(x), "{name}: {} {} {x}", h.id, p.key);
                }
            }
        }
    }
}

#[test]
fn every_corner_of_the_ranges_is_a_model() {
    let (name, _, model) = devices().into_iter().find(|d| d.0.ends_with("impulse-engine.toml")).expect("there");
    for h in hypotheses(&model).0 {
        for corner in 0..1usize << h.parameters.len().min(5) {
            let at = |(i, p): (usize, &Parameter)| if corner >> i & 1 == 0 { p.range.0 } else { p.range.1 };
            let values: Vec<f64> = h.parameters.iter().enumerate().map(at).collect();
            assert!(h.apply(&model, &values).is_ok(), "{name}: {} {values:?}: {:?}", h.id, h.apply(&model, &values).err());
        }
    }
}

#[test]
fn every_kind_that_can_be_simulated_is_proposed() {
    let devices = devices();
    let mut proposed: Vec<&str> = devices.iter().flat_map(|(_, _, m)| hypotheses(m).0).map(|h| h.physics.name).collect();
    proposed.sort_unstable();
    proposed.dedup();
    for physics in PHYSICS {
        let kind = KINDS.iter().find(|k| k.name == physics.name);
        let can = kind.is_none_or(|k| {
            let ones: Vec<Vec<f64>> = k.parameters.iter().map(|_| vec![1.0]).collect();
            !matches!((k.build)(&ones), Err(e) if e.contains("not available"))
        });
        // Its curves are loops that were measured, not parameters that a search could move; maxwell_slip is proposed for the same memory.
        let measured = physics.name == "preisach_lugre";
        assert_eq!(proposed.contains(&physics.name), can && !measured, "{}", physics.name);
    }
    assert!(KINDS.iter().all(|k| physics_named(k.name).is_some()), "an element kind is no physics");
    for key in ["delay", "bandwidth", "saturation", "gain", "back_emf", "offset", "inertia", "series_compliance"] {
        assert!(proposed.contains(&key), "{key}");
    }
}

#[test]
fn at_its_neutral_values_a_hypothesis_changes_no_output() {
    for (name, _, model) in devices() {
        let (hypotheses, (inputs, period)) = hypotheses(&model);
        let before = simulate(&model, &inputs, period, &Options::default()).expect("simulates");
        for h in hypotheses.iter().filter(|h| h.parameters.iter().any(|p| p.neutral.is_some())) {
            let values: Vec<f64> = h.parameters.iter().zip(&h.starts[0]).map(|(p, s)| p.neutral.unwrap_or(*s)).collect();
            let same = h.apply(&model, &values).expect("applies");
            // Another structure is advanced in another way; a friction that is now a path law has no exact stick.
            let limit = if h.replaces.is_empty() { 0.02 } else { 0.03 };
            if ["lugre", "preisach_lugre", "maxwell_slip", "dahl"].contains(&h.physics.name) && !h.replaces.is_empty() {
                continue;
            }
            let after = simulate(&same, &inputs, period, &Options::default()).expect("simulates");
            for ((a, b), output) in before.iter().zip(&after).zip(&model.outputs) {
                // A backlash is spring and damper in one: who reads the spring then reads both.
                if h.physics.name == "backlash" && matches!(output.kind, OutputKind::Force(_)) {
                    continue;
                }
                let size = a.iter().map(|x| x * x).sum::<f64>().sqrt();
                let error = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
                assert!(error <= limit * size, "{name}: {} {}: {}", h.id, output.name, error / size);
            }
        }
    }
}

#[test]
fn every_start_moves_and_is_seen() {
    for (name, _, model) in devices() {
        let (hypotheses, (inputs, period)) = hypotheses(&model);
        let before = simulate(&model, &inputs, period, &Options::default()).expect("simulates");
        let finite = before.iter().flatten().all(|y| y.is_finite());
        for h in &hypotheses {
            let mut seen = false;
            for start in &h.starts {
                let applied = h.apply(&model, start).expect("applies");
                let after = simulate(&applied, &inputs, period, &Options::default()).unwrap_or_else(|e| panic!("{name}: {}: {e}", h.id));
                // A spring that softens may give way under a force: that start is one that a fit rejects. Any other stays finite.
                let gives_way = h.physics.name == "cubic_spring" && start.last().is_some_and(|cubic| *cubic < 0.0);
                let stays = after.iter().flatten().all(|y| y.is_finite());
                assert!(!finite || stays || gives_way, "{name}: {} {start:?}", h.id);
                seen |= stays && before.iter().zip(&after).any(|(a, b)| a.iter().zip(b).any(|(x, y)| (x - y).abs() > 1e-9 * x.abs()));
            }
            // A stop on the side that a device never comes to is not touched.
            let one_sided = ["contact", "hunt_crossley"].contains(&h.physics.name);
            assert!(seen || one_sided, "{name}: {} shows in no output", h.id);
        }
    }
}

#[test]
fn two_may_be_applied_one_after_the_other() {
    let (_, text, model) = devices().into_iter().find(|d| d.0.ends_with("impulse-engine-linear.toml")).expect("there");
    let (hypotheses, _) = hypotheses(&model);
    for first in &hypotheses {
        let one = first.apply(&model, &first.starts[0]).expect("applies");
        let one_text = patch(&text, &first.edits(&model, &first.starts[0]).expect("edits")).expect("patches");
        for second in hypotheses.iter().filter(|h| h.compatible(first)) {
            let both = second.apply(&one, &second.starts[0]).unwrap_or_else(|e| panic!("{} on {}: {e}", second.id, first.id));
            let text = patch(&one_text, &second.edits(&one, &second.starts[0]).expect("edits")).expect("patches");
            assert_eq!(Model::from_toml(&text, "both").expect("a model"), both, "{} on {}", second.id, first.id);
        }
    }
}

#[test]
fn an_output_keeps_the_element_that_it_reads() {
    let text = "name = 'a'\n[bodies]\na = 1.0\nb = 1.0\n[[elements]]\nname = 'k'\nkind = 'spring'\nbetween = ['a', 'b']\nstiffness = 900.0\n\
        [[elements]]\nname = 'd'\nkind = 'damper'\nbetween = ['a', 'b']\ndamping = 2.0\n[[elements]]\nname = 'g'\nkind = 'spring'\n\
        between = ['b', 'ground']\nstiffness = 500.0\n[[inputs]]\nname = 'u'\nkind = 'force'\non = 'a'\n\
        [[outputs]]\nname = 'f'\nkind = 'force'\nelement = ['k', 'd']\n[[outputs]]\nname = 'h'\nkind = 'force'\nelement = 'g'\n";
    let model = Model::from_toml(text, "a").expect("a model");
    let (hypotheses, _) = hypotheses(&model);
    let backlash = hypotheses.iter().find(|h| h.id == "backlash@a-b").expect("proposed");
    assert_eq!(backlash.replaces, ["k", "d"]);
    let after = backlash.apply(&model, &[1e-3, 900.0, 2.0]).expect("applies");
    assert_eq!(after.elements.len(), 3, "the damper that is read stays, without damping");
    assert_eq!(after.values_at("elements.d.damping").expect("there"), [0.0]);
    let other = hypotheses.iter().find(|h| h.id == "backlash@b-ground").expect("proposed");
    assert!(other.compatible(backlash));
    let series = hypotheses.iter().find(|h| h.id == "series_compliance@b-a").expect("proposed");
    let split = series.apply(&model, &[5e3, 1.0, 0.1]).expect("applies");
    // The original elements stay on the first body's side, and keep their direction.
    assert_eq!(split.elements[0].between, [Some(2), Some(1)]);
    assert_eq!(split.elements[3].between, [Some(2), Some(0)]);
}

#[test]
fn play_takes_a_share_of_the_deflection_that_the_joint_has() {
    let text = "name = 'a'\n[bodies]\na = 1.0\nb = 1.0\n[[elements]]\nname = 'k'\nkind = 'spring'\nbetween = ['a', 'b']\nstiffness = 900.0\n\
        [[elements]]\nname = 'g'\nkind = 'spring'\nbetween = ['b', 'ground']\nstiffness = 500.0\n[[inputs]]\nname = 'u'\nkind = 'force'\non = 'a'\n\
        [[outputs]]\nname = 'y'\nkind = 'position'\nof = 'a'\n";
    let model = Model::from_toml(text, "a").expect("a model");
    let runs = [run(&model)];
    let scales = Scales::of(&model, &runs.clone().map(|run| driven(&run))).expect("the device moves");
    let peak = scales.motion([Some(0), Some(1)])[0].peak;
    let hypotheses = all(&model, &scales);
    let backlash = hypotheses.iter().find(|h| h.id == "backlash@a-b").expect("proposed");
    // Two of the starts push as hard at the largest deflection as the spring did, one with half of it in the gap, one with most of it.
    let same = |start: &&Vec<f64>| ((peak - 0.5 * start[0]) * start[1] / (900.0 * peak) - 1.0).abs() < 1e-9;
    let gaps: Vec<f64> = backlash.starts.iter().filter(same).map(|start| start[0] / (2.0 * peak)).collect();
    assert_eq!(gaps.len(), 2, "{gaps:?}");
    assert!((gaps[0] - 0.5).abs() < 1e-9 && (gaps[1] - 0.8).abs() < 1e-9, "{gaps:?}");
}

#[test]
fn withholding_takes_what_contains_it_along() {
    let gone = withheld(&["coulomb"]);
    for name in ["coulomb", "stribeck", "dahl", "lugre", "asymmetric_coulomb"] {
        assert!(gone.contains(&name), "{name}");
    }
    assert!(!gone.contains(&"damper"));
    assert!(withheld(&["dahl"]).contains(&"lugre") && !withheld(&["dahl"]).contains(&"stribeck"));
    assert_eq!(withheld(&["damper"]).len(), 3, "{:?}", withheld(&["damper"]));
    assert!(withheld(&["back_emf"]).contains(&"damper"));
    for physics in PHYSICS {
        assert!(physics.facts.contains.iter().all(|c| physics_named(c).is_some()), "{}", physics.name);
    }
}

#[test]
fn contradicting_values_are_brought_together_and_wrong_ones_are_refused() {
    let (_, _, model) = devices().into_iter().find(|d| d.0.ends_with("rigid-mass.toml")).expect("there");
    let (hypotheses, _) = hypotheses(&model);
    let stribeck = hypotheses.iter().find(|h| h.physics.name == "stribeck").expect("proposed");
    let after = stribeck.apply(&model, &[0.3, 0.1, 0.01]).expect("applies");
    assert_eq!(stribeck.values_in(&after, &model), Some(vec![0.3, 0.3, 0.01]));
    assert!(matches!(stribeck.apply(&model, &[0.3]), Err(HypothesisError::Count { .. })));
    assert!(matches!(stribeck.apply(&model, &[0.3, f64::NAN, 0.1]), Err(HypothesisError::Value { .. })));
    assert!(matches!(stribeck.apply(&model, &[-0.3, 0.1, 0.1]), Err(HypothesisError::Value { .. })));
    let inertia = hypotheses.iter().find(|h| h.physics.name == "inertia").expect("proposed");
    assert!(matches!(inertia.apply(&Model::default(), &[0.1]), Err(HypothesisError::NoSuch { .. })));
}

#[test]
fn a_law_drawn_more_finely_begins_where_the_coarse_one_ends() {
    // What sliders pull with at first loading.
    let pull = |values: &[f64], x: f64| -> f64 {
        let (stiffness, force) = values.split_at(values.len() / 2);
        stiffness.iter().zip(force).map(|(k, f)| (k * x).min(*f)).sum()
    };
    let mut pairs = 0;
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        for coarse in hypotheses.iter().filter(|h| h.physics.name == "maxwell_slip") {
            // Sliders that carry unequal shares, as those of a fit.
            let mut values = coarse.starts[0].clone();
            let count = values.len() / 2;
            (0..count).for_each(|i| values[count + i] *= 1.0 + i as f64);
            let level: f64 = values[count..].iter().sum();
            let slips: Vec<f64> = (0..count).map(|i| values[count + i] / values[i]).collect();
            for (fine, start) in hypotheses.iter().filter_map(|h| Some((h, refined(coarse, &values, h)?))) {
                assert_eq!(start.len(), fine.parameters.len());
                assert!(fine.parameters.len() > coarse.parameters.len() && fine.place.same(&coarse.place));
                for slip in &slips {
                    for x in [0.1, 0.5, 0.7, 1.0, 1.4, 2.0].map(|share| share * slip) {
                        let off = (pull(&start, x) - pull(&values, x)).abs();
                        // Where a slider slips, one of its halves still pulls with two thirds: a sixth of its force less, at most.
                        assert!(off <= level / 6.0 * (1.0 + 1e-12), "{name}: {} at {x}: {off} of {level}", fine.id);
                    }
                }
                let far = 1e3 * slips.iter().fold(0.0_f64, |a, b| a.max(*b));
                assert!((pull(&start, far) / level - 1.0).abs() < 1e-12, "{name}: {}", fine.id);
                pairs += 1;
            }
            assert!(refined(coarse, &values, coarse).is_none());
        }
    }
    assert!(pairs > 10, "{pairs}");
}

#[test]
fn many_contacts_begin_where_one_bristle_ends() {
    let (mut sliders, mut bristles) = (0, 0);
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        for coarse in hypotheses.iter().filter(|h| ["dahl", "lugre"].contains(&h.physics.name)) {
            let values = &coarse.starts[0];
            let number = |key: &str| coarse.parameters.iter().zip(values).find(|(p, _)| p.key == key).map(|(_, v)| *v);
            let (stiffness, level) = (number("stiffness").expect("has one"), number("coulomb").expect("has one"));
            let finer = hypotheses.iter().filter(|h| h.physics.family == Family::Friction || h.physics.name == "maxwell_slip");
            for (fine, start) in finer.filter_map(|h| Some((h, refined(coarse, values, h)?))) {
                assert!(fine.parameters.len() > coarse.parameters.len() && fine.place.same(&coarse.place), "{name}: {}", fine.id);
                if fine.physics.name == "lugre" {
                    let of = |key: &str| fine.parameters.iter().zip(&start).find(|(p, _)| p.key == key).map(|(_, v)| *v);
                    assert_eq!((of("stiffness"), of("coulomb")), (Some(stiffness), Some(level)), "{name}: {}", fine.id);
                    assert!(of("static") > Some(level));
                    bristles += 1;
                    continue;
                }
                let (stiffnesses, forces) = start.split_at(start.len() / 2);
                let pull = |x: f64| -> f64 { stiffnesses.iter().zip(forces).map(|(k, f)| (k * x).min(*f)).sum() };
                for x in (0..60).map(|i| 0.1 * f64::from(i) * level / stiffness) {
                    // Dahl's law with exponent 1, whose force at first loading is known.
                    let exact = level * (1.0 - (-stiffness * x / level).exp());
                    let most = level / (forces.len() as f64 + 0.25);
                    assert!((pull(x) - exact).abs() < most, "{name}: {} at {x}: {} and {exact} of {level}", fine.id, pull(x));
                }
                assert!((forces.iter().sum::<f64>() / level - 1.0).abs() < 1e-12, "{name}: {}", fine.id);
                sliders += 1;
            }
        }
    }
    assert!(sliders > 10 && bristles > 5, "{sliders} and {bristles}");
}

#[test]
fn a_hysteretic_spring_begins_where_dahl_friction_beside_a_spring_ends() {
    use backdrive_plant::elements::{Dahl, HystereticSpring, PathLaw};
    let mut pairs = 0;
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        for coarse in hypotheses.iter().filter(|h| h.physics.name == "dahl") {
            let values = coarse.starts[0].clone();
            for (fine, start) in hypotheses.iter().filter_map(|h| Some((h, refined(coarse, &values, h)?))) {
                let &[up, down, plus, minus, bandwidth] = &start[..] else { continue };
                if fine.physics.name != "hysteretic_spring" {
                    continue;
                }
                let friction = Dahl { stiffness: values[0], coulomb: values[1] };
                let spring = HystereticSpring {
                    stiffness_positive: up,
                    stiffness_negative: down,
                    offset_positive: plus,
                    offset_negative: minus,
                    bandwidth,
                };
                assert!(up == down && (up == 0.0) == fine.replaces.is_empty(), "{name}: {}", fine.id);
                let slip = values[1] / values[0];
                let (mut of_friction, mut of_spring, mut from) = ([0.0], [0.0], 0.0);
                for x in [0.3, 2.0, 1.0, 3.0, -2.0, -1.9, 4.0].map(|share| share * slip) {
                    friction.advance(&mut of_friction, from, x, 1e-3);
                    spring.advance(&mut of_spring, from, x, 1e-3);
                    from = x;
                    let (beside, alone) = (friction.force(&of_friction, x, 0.0) + up * x, spring.force(&of_spring, x, 0.0));
                    assert!((beside - alone).abs() < 1e-9 * (values[1] + up * x.abs()), "{name}: {} at {x}: {beside} and {alone}", fine.id);
                }
                pairs += 1;
            }
        }
    }
    assert!(pairs > 5, "{pairs}");
}

#[test]
fn a_play_with_round_edges_begins_where_the_sharp_one_ends() {
    use backdrive_plant::elements::{Backlash, PathLaw};
    let mut pairs = 0;
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        for coarse in hypotheses.iter().filter(|h| h.physics.name == "backlash") {
            let values = coarse.starts[0].clone();
            for (fine, start) in hypotheses.iter().filter_map(|h| Some((h, refined(coarse, &values, h)?))) {
                assert!(fine.parameters.len() == 4 && values.len() == 3 && fine.place.same(&coarse.place), "{name}: {}", fine.id);
                let law = |v: &[f64]| Backlash { gap: v[0], stiffness: v[1], damping: 0.0, rounding: v.get(3).copied().unwrap_or(0.0) };
                let (sharp, round) = (law(&values), law(&start));
                for x in (-40..=40).map(|i| 0.1 * f64::from(i) * values[0]) {
                    let pull = |law: &Backlash| {
                        let mut memory = [0.0];
                        law.advance(&mut memory, 0.0, x, 1e-3);
                        law.force(&memory, x, 0.0)
                    };
                    // A contact rounded over w gives w/2 of twist at the contact itself, and nowhere more.
                    assert!((pull(&round) - pull(&sharp)).abs() <= 0.5 * start[3] * values[1] * (1.0 + 1e-9), "{name}: {} at {x}", fine.id);
                }
                pairs += 1;
            }
        }
    }
    assert!(pairs > 3, "{pairs}");
}

#[test]
fn friction_laws_begin_at_the_level_of_the_one_before() {
    let mut seen = std::collections::BTreeSet::new();
    for (name, _, model) in devices() {
        let (hypotheses, _) = hypotheses(&model);
        let is_force = |p: &Parameter| p.unit == "N" || p.unit == "N m";
        for law in hypotheses.iter().filter(|h| h.physics.name == "dahl") {
            let mut values = law.starts[0].clone();
            let slot = law.parameters.iter().position(is_force).expect("has a level");
            values[slot] *= 1.7;
            for other in hypotheses.iter().filter(|h| !h.physics.facts.sliding.is_empty() && h.place.same(&law.place) && h.id != law.id) {
                for start in starts_beside(law, &values, other) {
                    let forces: Vec<f64> = other.parameters.iter().zip(&start).filter(|(p, _)| is_force(p)).map(|(_, v)| *v).collect();
                    let together: f64 = forces.iter().sum();
                    let level = if other.physics.name == "maxwell_slip" { together } else { together / forces.len() as f64 };
                    assert!(
                        (level / values[slot] - 1.0).abs() < 1e-12,
                        "{name}: {} from {}: {level} for {}",
                        other.id,
                        law.id,
                        values[slot]
                    );
                    seen.insert(other.physics.name);
                }
            }
        }
    }
    assert!(["coulomb", "asymmetric_coulomb", "stribeck", "lugre"].iter().all(|law| seen.contains(law)), "{seen:?}");
}

/// Keys of inputs and outputs that are effects where a model file does not state them.
const SIGNAL_KEYS: [&str; 6] = ["gain", "saturation", "delay", "bandwidth", "back_emf", "offset"];

#[test]
fn every_physics_is_an_element_kind_a_key_of_a_signal_or_a_body() {
    for physics in PHYSICS {
        // Gravity on a body that turns is a ripple with one period a turn.
        let name = if physics.name == "gravity" { "cogging" } else { physics.name };
        let kind = KINDS.iter().find(|k| k.name == name);
        let of_signal = SIGNAL_KEYS.contains(&physics.name);
        assert!(kind.is_some() || of_signal || ["inertia", "series_compliance"].contains(&physics.name), "{}", physics.name);
        // The keys of its parameters are those of the model file.
        let keys: Vec<&str> =
            kind.map_or(vec![physics.name, "stiffness", "damping", "inertia"], |k| k.parameters.iter().map(|p| p.key).collect());
        for key in physics.facts.sliding.iter().chain(physics.facts.from_level).chain([&physics.size]) {
            assert!(keys.contains(key), "{}: no parameter {key}", physics.name);
        }
        assert!(physics.family == Family::Friction || physics.facts.sliding.is_empty(), "{}: levels of dry friction", physics.name);
        assert!(!physics.words.is_empty() && physics.words.chars().all(|c| c != '_'), "{}", physics.name);
        assert!(!physics.state_at("a-b").is_empty());
        let at_signal = matches!(physics.against, Against::Signal | Against::SignalRate);
        assert!(!at_signal || of_signal, "{}: drawn against a signal", physics.name);
    }
    assert!(KINDS.iter().all(|k| physics_named(k.name).is_some()), "an element kind is no physics");
    assert!(SIGNAL_KEYS.iter().all(|k| physics_named(k).is_some()), "a key of a signal is no physics");
}

#[test]
fn what_remembers_its_path_is_what_the_stepper_gives_a_memory() {
    for kind in KINDS {
        // Falling or growing from key to key: some kinds ask for one or the other.
        let with = |step: f64| {
            let value = |(i, p): (usize, &backdrive_plant::elements::Parameter)| match p.default_values() {
                Some(default) => default,
                None => vec![step.powi(i as i32)],
            };
            (kind.build)(&kind.parameters.iter().enumerate().map(value).collect::<Vec<_>>())
        };
        let law = with(1.0).or_else(|_| with(0.5)).or_else(|_| with(2.0)).unwrap_or_else(|e| panic!("{}: {e}", kind.name));
        assert_eq!(physics_named(kind.name).map(|p| p.facts.memory), Some(law.memory_len() > 0), "{}", kind.name);
    }
}
