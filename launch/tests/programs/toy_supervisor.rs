//! Supervises a graph of toy nodes: `HOME CLOCK STEPS NAME[,restart][,records] ARGUMENTS.. [/ NAME ..]`.
//! Prints the report as JSON. `graph HOME FILE BAG SECONDS CLOCK` does the same with a graph file, whose nodes are this program too.

use backdrive_launch::{Display, NodePlan, Plan, RunHome, SuperviseOptions, supervise_plan};
use backdrive_nodes::stage::{Clock, Timing};
use std::time::Duration;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [home, clock, steps, nodes @ ..] = &arguments[..] else { return Err("too few arguments".into()) };
    let toy = std::env::current_exe()?.with_file_name("toy-node").to_string_lossy().into_owned();
    let nodes = nodes.split(|a| a == "/").filter_map(|words| {
        let mut flags = words.first()?.split(',');
        let name = flags.next()?.to_string();
        let flags: Vec<&str> = flags.collect();
        let command = Some([std::slice::from_ref(&toy), &words[1..]].concat());
        let (restart, records) = (flags.contains(&"restart"), flags.contains(&"records"));
        Some(NodePlan { kind: name.clone(), name, command, restart, records, has_gains: false })
    });
    let clock = if clock == "realtime" { Clock::Realtime } else { Clock::Lockstep };
    let plan = Plan {
        title: "toys".to_string(),
        text: "title = \"toys\"\n".to_string(),
        timing: Timing { rate_hz: 1000.0, clock, steps: steps.parse().ok(), peer_timeout_s: 1.0 },
        bag: None,
        nodes: nodes.collect(),
    };
    let options = SuperviseOptions {
        home: RunHome::at(home),
        grace: Duration::from_millis(500),
        display: Display::Auto,
        status_every: Duration::from_millis(500),
        ..SuperviseOptions::default()
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let report = runtime.block_on(supervise_plan(plan, options))?;
    println!("{}", serde_json::to_string(&report)?);
    Ok(())
}
