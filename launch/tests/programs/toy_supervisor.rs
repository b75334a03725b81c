//! Supervises a graph of toy nodes: `HOME CLOCK STEPS NAME[,restart][,records] ARGUMENTS.. [/ NAME ..]`.
//! Prints the report as JSON. `graph HOME FILE BAG SECONDS CLOCK` does the same with a graph file, whose nodes are this program too.

use backdrive_launch::join::join_as;
use backdrive_launch::{NodePlan, Place, Plan, RunHome, SuperviseOptions, supervise_plan};
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_nodes::stage::{Clock, Timing};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (home, plan) = match &words[..] {
        ["node", "--run", run, "--name", name] => return Ok(join_as(Path::new(run), name)),
        ["graph", home, file, bag, seconds, clock] => {
            let changes = Overrides {
                bag: Some(PathBuf::from(bag)),
                duration_s: Some(seconds.parse()?),
                clock: Clock::ALL.into_iter().find(|(word, _)| word == clock).map(|(_, clock)| clock),
                ..Overrides::default()
            };
            (home, Plan::of(&Graph::load(Path::new(file), &changes)?, &Place::default()))
        }
        [home, clock, steps, nodes @ ..] => (home, toys(clock, steps, nodes)?),
        _ => return Err("too few arguments".into()),
    };
    let options = SuperviseOptions {
        home: RunHome::at(home),
        grace: Duration::from_millis(500),
        status_every: Duration::from_millis(500),
        ..SuperviseOptions::default()
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let report = runtime.block_on(supervise_plan(plan, options))?;
    println!("{}", serde_json::to_string(&report)?);
    Ok(ExitCode::SUCCESS)
}

fn toys(clock: &str, steps: &str, nodes: &[&str]) -> Outcome<Plan> {
    let toy = std::env::current_exe()?.with_file_name("toy-node").to_string_lossy().into_owned();
    let nodes = nodes.split(|a| *a == "/").filter_map(|words| {
        let mut flags = words.first()?.split(',');
        let name = flags.next()?.to_string();
        let flags: Vec<&str> = flags.collect();
        let command = [toy.as_str()].iter().chain(&words[1..]).map(|w| w.to_string()).collect();
        let (restart, records) = (flags.contains(&"restart"), flags.contains(&"records"));
        Some(NodePlan { kind: name.clone(), name, command: Some(command), restart, records, ..NodePlan::default() })
    });
    let clock = if clock == "realtime" { Clock::Realtime } else { Clock::Lockstep };
    Ok(Plan {
        title: "toys".to_string(),
        text: "title = \"toys\"\n".to_string(),
        held: Vec::new(),
        timing: Timing { rate_hz: 1000.0, clock, steps: steps.parse().ok(), peer_timeout_s: 1.0 },
        bag: None,
        nodes: nodes.collect(),
        place: Place::default(),
        hosts: Vec::new(),
    })
}
