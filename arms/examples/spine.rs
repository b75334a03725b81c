//! Prints what a search finds in a set: a view for development.
use backdrive_arms::{physics::At, problem::Problem, regression::Data, search};
use backdrive_plant::set::RecordingSet;
fn main() {
    let mut args = std::env::args().skip(1);
    let set = RecordingSet::open(args.next().unwrap_or_default().as_ref()).unwrap_or_else(|e| panic!("{e}"));
    let corner = args.next().and_then(|c| c.parse().ok());
    let problem = Problem::open(&set, None).unwrap_or_else(|e| panic!("{e}"));
    let began = std::time::Instant::now();
    let mut data = Data::new(&problem, corner, false).unwrap_or_else(|e| panic!("{e}"));
    println!("{:?} rows {} blocks {} ({:.2} s)", data.rates, data.layout.rows, data.blocks.len(), began.elapsed().as_secs_f64());
    let found = search::search(&mut data, &[]).unwrap_or_else(|e| panic!("{e}"));
    for (name, fit) in [("as given", &found.as_given), ("refit", &found.refit), ("best", &found.best)] {
        print!("{name:9} tolerance {} score {:9.1} numbers {:.1} ", fit.structure.tolerance, fit.score, fit.numbers);
        for j in 0..problem.joints.len() {
            for (label, residual, held) in [("fit", &fit.residual, false), ("unseen", &fit.unseen, false), ("held", &fit.residual, true)] {
                print!(
                    " {label}{} {:.2} %",
                    j + 1,
                    100.0 * (data.mean_square(residual, j, held) / data.mean_square(&data.torque, j, held)).sqrt()
                );
            }
        }
        println!();
    }
    let whole = Data::new(&problem, corner, true).unwrap_or_else(|e| panic!("{e}"));
    for (name, fit) in [("as given", &found.as_given), ("refit", &found.refit), ("best", &found.best)] {
        let r = whole.residual_of(fit);
        let share =
            |j: usize| format!("{:.2} %", 100.0 * (whole.mean_square(&r, j, true) / whole.mean_square(&whole.torque, j, true)).sqrt());
        println!("whole, held out, {name}: {}", (0..problem.joints.len()).map(share).collect::<Vec<_>>().join(", "));
    }
    println!("weights {:?} slip {:?}", found.weights, found.best.structure.slip);
    for (term, place) in found.best.structure.terms.iter().zip(&found.best.places) {
        let name = |at: At| at.joint().map_or("arm".to_string(), |j| problem.joints[j].clone());
        let values: Vec<String> =
            place.clone().map(|i| format!("{:.5} ± {:.5}", found.best.values[i], 1.96 * found.best.errors[i])).collect();
        println!("  {:20} {:10} {:?} {:?} {}", term.physics.facts().name, name(term.at), term.at, term.shape, values.join(", "));
    }
    for ((i, gain), rivals) in search::added(&found.best.structure).iter().zip(&found.gains).zip(&found.rivals) {
        let near: Vec<String> = rivals.iter().take(3).map(|(t, d)| format!("{} {:?} +{d:.1}", t.physics.facts().name, t.at)).collect();
        println!(
            "  term {i}: gain {:.3} ({:.1} errors); or {}",
            gain.map_or(0.0, |g| g.mean),
            gain.map_or(0.0, |g| g.in_errors()),
            near.join(", ")
        );
    }
    for t in &found.tried {
        println!(
            "    tried {} {:?} {:?} worth {:.1} gain {:.3} ({:.1}){}",
            t.term.physics.facts().name,
            t.term.at,
            t.term.shape,
            t.worth,
            t.gain.map_or(0.0, |g| g.mean),
            t.gain.map_or(0.0, |g| g.in_errors()),
            if t.taken { " taken" } else { "" }
        );
    }
    for (k, p) in search::parameters(&data, &found.best).iter().enumerate() {
        println!("  {} {:.4?} nominal {:.4?}", problem.joints[k], p, problem.bodies.nominal[k]);
    }
    let all: Vec<String> = search::added(&found.best.structure)
        .iter()
        .map(|i| {
            let t = &found.best.structure.terms[*i];
            format!("{}@{}", t.physics.facts().name, t.at.joint().map_or("arm".to_string(), |j| problem.joints[j].clone()))
        })
        .collect();
    println!("FOUND: {}", all.join(" "));
    println!("{:.2} s", began.elapsed().as_secs_f64());
}
