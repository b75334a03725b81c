//! Paper 003 as a whole: a bench recorded on the graph, identified from its bags in the paper's way, and validated as the paper validates. Its
//! observer is compared with an extended Kalman filter and a derivative.

mod compare;
mod page;
mod reported;
mod user_force;
mod world;

use crate::error::failed;
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_control::observer::{System, Weights, design, kalman};
use backdrive_testbench::{Asked, Record, Validation, identify, validate};
use reported::Reported;

/// The study.
pub const STUDY: Study = Study {
    name: "engine_bench",
    about: "paper 003 as a whole: a test bench recorded, identified from bags, validated; its observer compared",
    needs: ("", &[]),
    run,
};

/// What is known of every bench before: data sheets, plates, and the points at which it was recorded.
fn asked() -> Asked {
    Asked {
        engine_inertia: world::SHEET.engine,
        stiffness: world::SHEET.stiffness,
        power: 240e3,
        plateau_s: 3.5,
        lag_points: [vec![0.0, 0.5, 1.0], vec![80.0, 160.0, 240.0]],
        observation: world::OBSERVATION,
    }
}

fn bench(context: &Context, seed: u64) -> Result<Reported, StudyError> {
    let out = context.out.join(format!("bench-{seed}"));
    let world = world::World::make(seed, &out)?;
    let record = |name: &str| -> Result<Record, StudyError> { Record::of_bag(&world.record(name)?).map_err(failed) };
    let (unfired, map, steps) = (record("unfired")?, record("map")?, record("lag")?);
    let (dragged, unseen) = (record("unfired-other")?, record("validation")?);
    let identified = identify(&asked(), &unfired, &map, &steps).map_err(failed)?;
    world.keep(&identified)?;
    let validation = validate(&identified.bench, &asked().observation, &dragged, &unseen).map_err(failed)?;
    let observation = asked().observation;
    let tuned = compare::Tuning::best(&identified.bench, &observation, &steps, &world.engine.engine);
    let comparison = compare::compare(&identified.bench, &observation, &unseen, &world.other_day.engine, tuned).map_err(failed)?;
    Ok(Reported { seed, world, identified, steps, unseen, dragged, validation, comparison })
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut report = Report::new("Paper 003, as a whole: a test bench identified from its bags");
    gains(&mut report)?;
    let seeds: &[u64] = if context.quick { &[1] } else { &[1, 2, 3] };
    let mut told = Vec::new();
    for seed in seeds {
        let one = bench(context, *seed)?;
        numbers(&mut report, &one);
        told.push(one);
    }
    correlations(&mut report, &told);
    compare::table(&mut report, &told.iter().map(|t| &t.comparison).collect::<Vec<_>>());
    let users = user_force::run(context)?;
    user_force::table(&mut report, &users);
    report.notes.push(
        "The benches are simulated (launch/engine-test-bench-identify.toml with numbers drawn from the seed): sensor noise, combustion ripple, a converter \
         that is off and late, and another day's engine map in the validation. The paper's constants, gains and recordings are lost."
            .to_string(),
    );
    page::write(context, &report, &told, &users)?;
    Ok(report)
}

/// The golden observer: what is independent of any bench.
fn gains(report: &mut Report) -> Result<(), StudyError> {
    let system = System::shaft(0.9, 0.7, 2e4, 12.0, [0.1, 0.1]);
    let weights = Weights::default();
    let near = design(&system, &weights, 1.05).map_err(failed)?;
    let far = design(&system, &weights, 2.0).map_err(failed)?;
    let (_, l) = kalman(&system, &weights).map_err(failed)?;
    let source = "SciPy's bisection; CLARABEL's inequality gives 0.118265";
    let close = (near.least_m / 0.118248 - 1.0).abs() < 1e-4;
    report.line("least m of the example observer", format!("{:.6}", near.least_m), "0.118248", source, Some(close));
    let slow = near.poles(&system);
    let fast = slow.iter().map(|p| p.re).fold(0.0, f64::min);
    let text = format!("L {:.0}, poles {:.1} to {:.0} /s", near.l.amax(), slow[0].re, fast);
    report.line("5 % above it", text, "L 148, poles -3.0 to -62 /s", "SciPy", Some((near.l.amax() / 148.0 - 1.0).abs() < 0.05));
    report.line(
        "twice it; infinite m",
        format!("L {:.1}; {:.4}, {:.4}", far.l.amax(), l[(0, 0)], l[(0, 1)]),
        "L 14; 7.0722, 7.0700",
        "SciPy",
        None,
    );
    let largest = format!("{:.1e}, P {:.1e}", near.check.largest, near.check.least_of_p);
    report.line("inequality: largest eigenvalue, P's smallest", largest, "below 0, above 0", "(6) of the paper", Some(near.check.holds()));
    report.figure("least m", near.least_m);
    Ok(())
}

/// What was identified beside what is true.
fn numbers(report: &mut Report, told: &Reported) {
    let (found, truth) = (&told.identified.bench.shaft, &told.world.shaft);
    let seed = told.seed;
    let mut line = |what: &str, found: f64, truth: f64, unit: &str, most: f64| {
        let off = found / truth - 1.0;
        let text = format!("{found:.4} {unit} ({:+.1} %)", 100.0 * off);
        report.line(&format!("bench {seed}: {what}"), text, format!("{truth:.4} {unit}"), "the simulated truth", Some(off.abs() < most));
        report.figure(&format!("{seed} {what}"), off);
    };
    line("J_A", found.dynamometer, truth.dynamometer, "kg m2", 0.03);
    line("J_C, friction without lag", told.identified.first.values[0], truth.engine, "kg m2", 0.06);
    line("J_C", found.engine, truth.engine, "kg m2", 0.03);
    line("c", found.stiffness, truth.stiffness, "N m/rad", 0.03);
    line("d by poles", told.identified.first_damping, truth.damping, "N m s/rad", 0.3);
    line("d", found.damping, truth.damping, "N m s/rad", 0.1);
    let machine = (&told.identified.bench.dynamometer, &told.world.dynamometer);
    line("dynamometer's frequency", machine.0.frequency_hz, machine.1.frequency_hz, "Hz", 0.05);
    let range = |values: &[f64]| values.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(*v), high.max(*v)));
    let (lags, true_lags) = (told.identified.bench.engine.lag.values(), told.world.engine.engine.lag.values());
    let worst = lags.iter().zip(true_lags).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let ((low, high), (least, most)) = (range(lags), range(true_lags));
    let text = format!("{low:.2} to {high:.2} s (worst point {:.0} % off)", 100.0 * worst);
    report.line(
        &format!("bench {seed}: lag"),
        text,
        format!("{least:.2} to {most:.2} s"),
        "the simulated truth; 0.4 [A] to 2.1 s in the paper",
        Some(worst < 0.25),
    );
    report.figure(&format!("{seed} lag"), worst);
}

/// The paper's correlations beside ours, over all benches.
fn correlations(report: &mut Report, told: &[Reported]) {
    let mut line = |what: &str, pick: &dyn Fn(&Validation) -> f64, paper: &str, place: &str, least: Option<f64>| {
        let values: Vec<f64> = told.iter().map(|t| 100.0 * pick(&t.validation)).collect();
        let text = values.iter().map(|v| format!("{v:.1}")).collect::<Vec<_>>().join(", ");
        let worst = values.iter().copied().fold(f64::INFINITY, f64::min);
        report.line(what, format!("{text} %"), paper, place, least.map(|l| worst >= 100.0 * l));
        report.figure(what, worst / 100.0);
    };
    line("w_A, mechanical model, closed loop", &|v| v.mechanical_closed, "93 %", "Section III-A", Some(0.93));
    line("w_A, mechanical model under T_A and friction", &|v| v.mechanical_open, "93 %", "Fig. 4", None);
    line("w_C of T_A and observed T_C", &|v| v.observer[0], "drawn, no number", "Fig. 6", Some(0.93));
    line("w_A of T_A and observed T_C", &|v| v.observer[1], "drawn, no number", "Fig. 6", Some(0.93));
    line("T_C, engine model and observer", &|v| v.engine, "about 90 % [R]", "Fig. 9", Some(0.9));
    line("T_A, dynamometer, dragged and shaken", &|v| v.dynamometer[0], "88 to 95 %", "Fig. 10", Some(0.88));
    line("T_A, dynamometer, test cycle", &|v| v.dynamometer[1], "88 to 95 %", "Fig. 10", Some(0.88));
    line("w_C, whole bench", &|v| v.whole[0], "drawn, no number", "Fig. 11", None);
    line("T_A, whole bench", &|v| v.whole[1], "drawn, no number", "Fig. 12", None);
}
