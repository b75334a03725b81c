//! The steering compensator on its rig: its tables found again and the checks of its paper, in the short form; whole where BACKDRIVE_STUDIES is 1.

use backdrive_studies::data::Data;
use backdrive_studies::steering::bench::{Bench, stroke};
use backdrive_studies::steering::device::{Parameter, SAE_10, TABLE_2, TABLE_3_RUN_2};
use backdrive_studies::steering::identify::{Cost, cost, fit, residuals, rms};
use backdrive_studies::study_named;

fn long() -> bool {
    std::env::var_os("BACKDRIVE_STUDIES").is_some_and(|v| v == "1")
}

#[test]
fn the_tables_are_found_again() {
    let out = tempfile::tempdir().unwrap();
    let report = study_named("steering").unwrap().run(&Data::find(None), out.path(), !long(), 1.0).unwrap();
    println!("{}", report.text());
    for table in ["Table I", "Table II", "Table III run 1", "Table III run 2"] {
        let worst = report.figure_named(&format!("{table} worst"));
        assert!(worst < 0.03, "{table}: {worst}");
    }
    // Leaving the gap out makes the gearbox look soft; with it the stiffness is back.
    for scale in if long() { vec!["1", "2", "0.5"] } else { vec!["1"] } {
        let [low, back] = ["bias", "recovered"].map(|name| report.figure_named(&format!("{name} {scale}")));
        assert!((0.10..=0.60).contains(&low) && back.abs() < 0.03, "{scale}: {low} {back}");
    }
    assert!((0.15..=0.40).contains(&report.figure_named("bias 1")));
    let [sudden, refined, measured] = ["sudden", "refined", "measured"].map(|name| report.figure_named(&format!("phase {name}")));
    assert!(refined < sudden - 1.0 && (refined - measured).abs() < 1.0, "{sudden} {refined} {measured}");
    for f in ["0.1", "3.2", "8.1", "20.2"] {
        assert!(report.figure_named(&format!("nrmse {f}")) < 0.1, "{f}");
    }
    let page = std::fs::read_to_string(out.path().join("steering/report.html")).unwrap();
    assert!(page.matches("<figure>").count() >= 23, "{}", page.matches("<figure>").count());
}

/// The rig and the bare simulation are two ways to one admittance: sensors, controller and noise leave little between them.
#[test]
fn the_rig_gives_the_simulated_admittance() {
    let bench = Bench::load().unwrap();
    let frequencies = [0.5, 3.24, 20.21];
    let curve = bench.curve(&TABLE_3_RUN_2, SAE_10, 1.0, &frequencies).unwrap();
    let found = residuals(&TABLE_3_RUN_2, std::slice::from_ref(&curve));
    assert!(rms(&found) < 0.01, "{found:?}");
    assert!(cost(&found, Cost::Modulus) <= found.iter().map(|r| r.norm()).sum::<f64>());
    let recorded = bench.record(&TABLE_3_RUN_2, SAE_10, 3.24, stroke(3.24, 1.0)).unwrap();
    assert_eq!(recorded.force.len(), recorded.demand.len());
}

/// Two parameters of one oil are found from a few points, by either reading of the cost.
#[test]
fn a_fit_ends_where_the_data_were_made() {
    let bench = Bench::load().unwrap();
    let curve = [bench.curve(&TABLE_2, SAE_10, 1.0, &[0.5, 1.5, 4.0, 9.0]).unwrap()];
    let free = [Parameter::Oil(SAE_10), Parameter::Beside(SAE_10)];
    let start = TABLE_2.with(free[0], 900.0).with(free[1], 600.0);
    for by in [Cost::Modulus, Cost::Squared] {
        let found = fit(&start, &curve, &free, by, 20);
        for p in free {
            assert!((found.device.get(p) / TABLE_2.get(p) - 1.0).abs() < 0.02, "{by:?} {p:?}: {found:?}");
        }
        assert!(found.rms < 0.01);
    }
}
