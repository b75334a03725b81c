//! Presliding hysteresis: the deformed Dahl model and the Preisach operator against closed forms, a grid of relays and each other.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod stepper_common;

use backdrive_plant::model::OutputKind::{Force, Position};
use backdrive_plant::preisach::{DahlLoop, MeasuredLoop, Operator, Relays, Transition, everett_sum, fit};
use naming::assert_names;
use stepper_common::*;

const DAHL: DahlLoop = DahlLoop { force: 0.35, slope: 2.0 };

/// A repeatable walk of turns within ±reach.
fn walk(reach: f64, turns: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut number = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..turns).map(|_| reach * (2.0 * number() - 1.0)).collect()
}

/// A family bent through loops that are no Dahl loops.
fn bent() -> Transition {
    let mut rows = Vec::new();
    for reach in [0.05, 0.1, 0.2, 0.4, 0.8] {
        for k in 0..=20 {
            let q = reach * (1.0 - 0.1 * f64::from(k));
            rows.push([reach, q, DAHL.falling(q, reach) * (1.0 + 0.1 * reach) - 0.02 * (reach - q)]);
        }
    }
    Transition::measured(DAHL, &rows).unwrap()
}

#[test]
fn a_deformed_dahl_loop_leaves_reversals_at_its_slope_closes_and_runs_to_its_force() {
    let f_r = DAHL.reversal_force(0.2);
    // Computed from eqs (11)-(13) by others, in double precision.
    assert!((f_r - 0.154_740_502_5).abs() < 1e-10 && (DAHL.energy(0.2) - 0.038_047_778_6).abs() < 1e-10);
    assert!((DAHL.falling(0.2, 0.2) - f_r).abs() < 1e-15 && (DAHL.falling(-0.2, 0.2) + f_r).abs() < 1e-9);
    assert!((DAHL.rising(-0.2, 0.2) + f_r).abs() < 1e-15 && (DAHL.rising(0.2, 0.2) - f_r).abs() < 1e-9);
    let d = 1e-7;
    for (near, at) in [(DAHL.rising(-0.2 + d, 0.2), DAHL.rising(-0.2, 0.2)), (DAHL.falling(0.2, 0.2), DAHL.falling(0.2 - d, 0.2))] {
        assert!(((near - at) / d - 2.0).abs() < 1e-5, "{}", (near - at) / d);
    }
    assert!((DAHL.rising(1e12, 0.2) - 0.35).abs() < 1e-9 && (DAHL.falling(-1e12, 0.2) + 0.35).abs() < 1e-9);
    assert!((DAHL.reversal_force(DAHL.reversal_of(0.3)) - 0.3).abs() < 1e-14);
    let slope = (DAHL.reversal_force(0.2 + 1e-6) - DAHL.reversal_force(0.2 - 1e-6)) / 2e-6;
    assert!((slope - DAHL.reversal_slope(0.2)).abs() < 1e-9);
}

#[test]
fn an_operator_on_dahl_curves_gives_their_loops_and_their_energy() {
    let mut operator = Operator::new(DAHL);
    let n = 20_000;
    let (mut area, mut before) = (0.0, operator.step(0.2));
    assert!((before - DAHL.reversal_force(0.2)).abs() < 1e-15);
    for i in 1..=2 * n {
        let (q, falls) =
            if i <= n { (0.2 - 0.4 * f64::from(i) / f64::from(n), true) } else { (-0.2 + 0.4 * f64::from(i - n) / f64::from(n), false) };
        let now = operator.step(q);
        let exact = if falls { DAHL.falling(q, 0.2) } else { DAHL.rising(q, 0.2) };
        assert!((now - exact).abs() < 1e-14, "{q}: {now} {exact}");
        area += 0.5 * (now + before) * if falls { -0.4 } else { 0.4 } / f64::from(n);
        before = now;
    }
    assert!((area / DAHL.energy(0.2) - 1.0).abs() < 1e-8, "{area}");
}

#[test]
fn inner_loops_are_wiped_out_whatever_happened_in_them() {
    for curves in [Transition::from(DAHL), bent()] {
        let (mut with, mut without) = (Operator::new(curves.clone()), Operator::new(curves));
        for z in [0.5, -0.3] {
            with.step(z);
            without.step(z);
        }
        for z in walk(1.0, 400, 3).into_iter().map(|z| -0.3 + 0.25 * (z + 1.0)) {
            with.step(z);
        }
        assert!(with.turning_points().len() > 2);
        for z in [0.3, 0.31, 0.499, -0.1, 0.7, -0.7] {
            assert_eq!(with.step(z), without.step(z), "{z}");
            assert_eq!(with.turning_points(), without.turning_points());
        }
    }
}

#[test]
fn loops_between_the_same_turns_are_congruent() {
    for curves in [Transition::from(DAHL), bent()] {
        // Two histories, then the same loop between 0.1 and 0.2.
        let of = |history: &[f64]| {
            let mut operator = Operator::new(curves.clone());
            history.iter().for_each(|z| {
                operator.step(*z);
            });
            let first = operator.step(0.1);
            [0.13, 0.2, 0.17, 0.12, 0.1].map(|z| operator.step(z) - first)
        };
        let first = of(&[0.9, -0.8, 0.3]);
        for history in [&[-0.9, 0.6][..], &[0.9, -0.8, 0.7, -0.2, 0.6, 0.0, 0.4]] {
            for (a, b) in first.iter().zip(of(history)) {
                assert!((a - b).abs() < 1e-15, "{a} {b}");
            }
        }
        assert_eq!(first[4], 0.0);
    }
}

#[test]
fn the_sum_over_turning_points_is_the_operator() {
    for curves in [Transition::from(DAHL), bent()] {
        let mut operator = Operator::new(curves.clone());
        for z in walk(0.7, 3000, 5) {
            let force = operator.step(z);
            let sum = everett_sum(&curves, &operator.turning_points(), z);
            assert!((force - sum).abs() < 1e-13, "{z}: {force} {sum}");
        }
    }
}

#[test]
fn a_grid_of_relays_is_the_operator() {
    for (curves, seed) in [(Transition::from(DAHL), 7), (bent(), 8)] {
        let (mut operator, mut relays) = (Operator::new(curves.clone()), Relays::new(&curves, 0.8, 400));
        let mut worst = 0.0_f64;
        for z in walk(0.75, 300, seed) {
            worst = worst.max((operator.step(z) - relays.step(z)).abs());
        }
        let range = 2.0 * curves.rise(0.8, 1.6).force;
        println!("largest difference {:.4} % of the range at 400 relays", 100.0 * worst / range);
        assert!(worst < 0.01 * range, "{worst} of {range}");
        assert!(worst > 0.0, "relays are not the same sum");
    }
}

#[test]
fn no_closed_loop_gives_energy() {
    for curves in [Transition::from(DAHL), bent()] {
        let turns = walk(0.8, 40, 11);
        for (i, low) in turns.iter().enumerate() {
            for high in turns[..i].iter().filter(|high| *high > low) {
                let mut operator = Operator::new(curves.clone());
                [0.9, *low].iter().for_each(|z| {
                    operator.step(*z);
                });
                let (mut area, mut before, n) = (0.0, operator.force(), 200);
                for k in 1..=2 * n {
                    let part = f64::from(if k <= n { k } else { 2 * n - k }) / f64::from(n);
                    let now = operator.step(low + part * (high - low));
                    area += 0.5 * (now + before) * (high - low) / f64::from(if k <= n { n } else { -n });
                    before = now;
                }
                assert!(area > -1e-12, "{low} {high}: {area}");
            }
        }
    }
}

#[test]
fn more_turns_than_are_remembered_leave_the_force_where_it_was() {
    let mut operator = Operator::new(DAHL);
    let mut turns = Vec::new();
    for k in 0..100 {
        let z = 0.5 * 0.9_f64.powi(k) * if k % 2 == 0 { 1.0 } else { -1.0 };
        let (force, all) = (operator.step(z), everett_sum(&DAHL.into(), &turns, z));
        assert!((force - all).abs() < 1e-9, "{k}: {force} {all}");
        turns.push(z);
    }
    assert!(operator.turning_points().len() < turns.len());
    // The outermost turns are still known.
    assert!((operator.step(0.5) - DAHL.reversal_force(0.5)).abs() < 1e-15);
}

#[test]
fn loops_give_their_numbers_and_their_curves_back() {
    let noise = walk(1.0, 100_000, 13);
    let mut loops = Vec::new();
    for (i, reach) in [0.05, 0.1, 0.2, 0.4, 0.8].into_iter().enumerate() {
        let (mut q, mut f) = (Vec::new(), Vec::new());
        for k in 0..2000 {
            let z = 0.1 + reach * (std::f64::consts::TAU * f64::from(k) / 2000.0).sin();
            let rises = !(500..1500).contains(&k);
            q.push(z);
            let force = if rises { DAHL.rising(z - 0.1, reach) } else { DAHL.falling(z - 0.1, reach) };
            f.push(0.03 + force + 2e-3 * noise[2000 * i + k as usize]);
        }
        loops.push(MeasuredLoop::from_cycle(&q, &f).unwrap());
    }
    let found = fit(&loops).unwrap();
    assert!((found.dahl.force / 0.35 - 1.0).abs() < 5e-3 && (found.dahl.slope / 2.0 - 1.0).abs() < 5e-3, "{found:?}");
    assert!((found.rms / (2e-3 / 3f64.sqrt()) - 1.0).abs() < 0.2, "{found:?}");
    let rows: Vec<[f64; 3]> = loops.iter().flat_map(|l| l.rows(41)).collect();
    let curves = Transition::measured(found.dahl, &rows).unwrap();
    let (mut measured, mut exact) = (Operator::new(curves), Operator::new(DAHL));
    for z in walk(0.8, 1000, 17) {
        assert!((measured.step(z) - exact.step(z)).abs() < 4e-3, "{z}");
    }
    assert!(MeasuredLoop::from_cycle(&[0.0; 9], &[0.0; 9]).is_err() && fit(&[]).is_err());
    assert!(MeasuredLoop::from_cycle(&[0.0, f64::NAN, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0], &[0.0; 8]).is_err());
}

#[test]
fn rows_that_are_no_falling_branches_are_refused() {
    let bad: &[&[[f64; 3]]] = &[
        &[[0.1, 0.1, 0.2]],
        &[[0.1, 0.1, 0.2], [0.1, 0.0, 0.3]],
        &[[0.1, 0.1, 0.2], [0.1, 0.2, 0.1]],
        &[[0.1, 0.05, 0.2], [0.1, 0.0, 0.1]],
        &[[0.2, 0.2, 0.2], [0.2, 0.0, 0.1], [0.1, 0.1, 0.2], [0.1, 0.0, 0.1]],
        &[[f64::NAN, 0.1, 0.2]],
    ];
    for rows in bad {
        let error = Transition::measured(DAHL, rows).unwrap_err();
        assert!(error.starts_with("curves"), "{error}");
    }
}

#[test]
fn a_model_file_names_its_measured_loops_and_says_what_is_wrong_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axis.toml");
    let text = |more: &str| {
        format!(
            "[bodies]\nm = 1.0\n[[elements]]\nname = \"friction\"\nkind = \"preisach_lugre\"\nbetween = [\"m\", \"ground\"]\nstiffness = 2.0\n\
             damping = 0.01\ncoulomb = 0.3\nstatic = 0.32\nvelocity = 0.1\nbreak_away = 3.0\nloop_force = 0.35\nloop_slope = 2.0\n{more}\n"
        )
    };
    let load = |more: &str, rows: &str| {
        std::fs::write(&path, text(more)).unwrap();
        std::fs::write(folder.path().join("loops.csv"), rows).unwrap();
        backdrive_plant::model::Model::load(&path)
    };
    let plain = load("", "").unwrap();
    let bent = load("curves = \"loops.csv\"", "reach,position,force\n0.2,0.2,0.15\n0.2,0.0,0.0\n0.2,-0.2,-0.15\n").unwrap();
    assert_ne!(plain, bent);
    for model in [plain, bent] {
        assert_eq!(backdrive_plant::model::Model::from_toml(&model.to_toml(), "again.toml").unwrap().elements, model.elements);
    }
    for (more, rows, says) in [
        ("curves = \"loops.csv\"", "0.2,0.2\n", "rows of three"),
        ("curves = \"loops.csv\"", "0.2,0.2,0.1\n0.2,0.0,0.2\n", "row 2: force must fall"),
        ("curves = \"absent.csv\"", "", "absent.csv"),
        ("gate = 0.99", "", "lower gate"),
        ("gate = 1.5", "", "gate"),
    ] {
        let error = load(more, rows).unwrap_err().to_string();
        assert_names(&error, &["axis.toml", says]);
    }
}

/// A kilogram under a bias of 0.5 N and a sine of 0.2 N, below a friction of 1 N: position at the end of each cycle, m.
fn cycles_under_bias(friction: backdrive_plant::model::Element) -> Vec<f64> {
    let model = model(&[1.0], vec![friction], vec![force_input(0)], vec![Position(0)]);
    let force = samples(12_000, 1e-3, |t| (0.5 * t).min(0.5) + if t > 1.0 { 0.2 * (std::f64::consts::TAU * (t - 1.0)).sin() } else { 0.0 });
    let y = run(&model, &[force], 1e-3, None);
    (2..12).map(|k| y[0][1000 * k]).collect()
}

/// f_p reaches the static force, 1 N, at 0.25 mm.
fn preisach_lugre(gate: f64) -> backdrive_plant::model::Element {
    let values = [2e4, 100.0, 1.0, 1.0, 1e-3, 2.5e-4, 1.5, 2e4].map(|v| vec![v]);
    let all: Vec<Vec<f64>> = values.into_iter().chain([vec![], vec![gate]]).collect();
    let law = (backdrive_plant::elements::kind_named("preisach_lugre").unwrap().build)(&all).unwrap();
    backdrive_plant::model::Element { name: "friction".to_owned(), between: [at(0), GROUND], law }
}

#[test]
fn lugre_and_the_literal_law_drift_under_a_bias_and_the_gated_one_does_not() {
    let per_cycle = |friction| {
        let at = cycles_under_bias(friction);
        (at[9] - at[4]) / 5.0
    };
    let lugre = per_cycle(element("lugre", [at(0), GROUND], &[2e4, 100.0, 1.0, 1.0, 1e-3]));
    let (literal, gated) = (per_cycle(preisach_lugre(0.0)), per_cycle(preisach_lugre(1.0)));
    println!("drift per cycle: LuGre {:.2} um, eqs (4)-(6) {:.2} um, gated {:.4} um", 1e6 * lugre, 1e6 * literal, 1e6 * gated);
    // Slowly, LuGre's is (F_C/s0) [ln(0.7/0.3) - ln(1.7/1.3)].
    assert!((lugre / (5e-5 * ((0.7_f64 / 0.3).ln() - (1.7_f64 / 1.3).ln())) - 1.0).abs() < 0.02, "{lugre}");
    assert!(literal > 10e-6 && literal < 100e-6, "{literal}");
    assert!(gated.abs() < 1e-7, "{gated}");
}

#[test]
fn the_stepper_converges_under_step_halving() {
    for gate in [0.0, 1.0] {
        let model = model(
            &[1.0],
            vec![preisach_lugre(gate), damper([at(0), GROUND], 5.0), spring([at(0), GROUND], 2e3)],
            vec![force_input(0)],
            vec![Position(0), Force(vec![0])],
        );
        // Beyond break-away and back, with turns within turns.
        let force = samples(3000, 1e-3, |t| 1.6 * (6.0 * t).sin() + 0.5 * (31.0 * t).sin());
        let at = |substeps| run(&model, std::slice::from_ref(&force), 1e-3, Some(substeps));
        let (coarse, fine, finest) = (at(2), at(8), at(64));
        let far = |y: &[Vec<f64>]| {
            (0..2)
                .map(|i| largest(y[i].iter().zip(&finest[i]).map(|(a, b)| a - b)) / largest(finest[i].iter().copied()))
                .fold(0.0, f64::max)
        };
        println!("gate {gate}: {:.2e} with 2 substeps, {:.2e} with 8", far(&coarse), far(&fine));
        assert!(far(&fine) < 2e-3 && far(&fine) < 0.5 * far(&coarse), "gate {gate}: {} {}", far(&coarse), far(&fine));
    }
}
