//! How long a sweep over gains takes: 200 gains of 5 s each at 5 kHz, nonlinear sixth-order master, all cores.
//!
//!     cargo bench --bench sweep
//!
//! Prints wall-clock and core time for the contact task with its canceller and with none, sensors and limits as in the file;
//! then where the time goes: building a loop, stepping it, and judging it.

use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::sweep::{log_grid, sweep};
use backdrive_stability::resimulate::{RunOptions, Scenario};
use nix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

const DURATION_S: f64 = 5.0;

fn scenario(canceller: Option<&str>) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("launch/contact.toml");
    let changes = Overrides { canceller: canceller.map(Into::into), duration_s: Some(DURATION_S), ..Overrides::default() };
    let graph = Graph::load(&path, &changes).expect("the contact graph is part of the workspace");
    Scenario::new(graph, None, None).expect("has a loop")
}

/// Time that all threads of this process have had a core.
fn core_time() -> Duration {
    clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).map(Duration::from).unwrap_or_default()
}

fn main() {
    let gains = log_grid(0.1, 50.0, 200);
    let never = AtomicBool::new(false);
    println!(
        "{} gains of {DURATION_S} s each at 5 kHz, {} cores",
        gains.len(),
        std::thread::available_parallelism().map_or(1, |n| n.get())
    );
    println!("canceller      wall, s   core, s   verdicts");
    for canceller in [None, Some("none")] {
        let scenario = scenario(canceller);
        let (start, core) = (Instant::now(), core_time());
        let runs = sweep(&scenario, &gains, &RunOptions::default(), &|_| {}, &never).expect("every gain can be run");
        let (wall, core) = (start.elapsed().as_secs_f64(), (core_time() - core).as_secs_f64());
        let count = |word: &str| runs.iter().flatten().filter(|(_, run)| run.outcome.word() == word).count();
        let words = ["stable", "limit_cycle", "unstable", "limited"].map(|word| format!("{} {word}", count(word)));
        println!("{:<12} {wall:>9.2} {core:>9.2}   {}", if canceller.is_some() { "none" } else { "sixth order" }, words.join(", "));
    }

    let scenario = scenario(None);
    let time = |what: &str, work: &dyn Fn()| {
        let mut times: Vec<f64> = (0..10)
            .map(|_| {
                let core = core_time();
                work();
                (core_time() - core).as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{what:<44} {:>8.2} ms", times[5]);
    };
    println!("\none run at mu*lambda = 0.3, core time, median of 10");
    time("the whole run", &|| {
        let run = scenario.run(scenario.gain(0.3), &RunOptions::default(), &never).expect("runs");
        assert_eq!(run.outcome, Outcome::Stable);
    });
    let short = {
        let mut graph = scenario.graph().clone();
        graph.timing.steps = Some(1);
        Scenario::new(graph, None, None).expect("has a loop")
    };
    time("building a loop", &|| drop(short.run(short.gain(0.3), &RunOptions::default(), &never).expect("runs")));
    time("stepping it, hearing nothing", &|| {
        let graph = scenario.graph();
        let nodes = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder);
        let plans = nodes.map(|n| backdrive_nodes::build::plan(graph, &n.name).expect("builds")).collect();
        let mut sequence = backdrive_nodes::sequence::Sequence::new(plans, &graph.timing).expect("has no loop");
        sequence.run(graph.timing.steps.expect("has a length"), None);
    });
}
