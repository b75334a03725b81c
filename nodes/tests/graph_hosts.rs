//! `[hosts]` in graph files: what they mean, and what is wrong with wrong ones.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_nodes::build::{credit_listeners, credit_topic, topics};
use backdrive_nodes::graph::{Files, Graph, Overrides};
use backdrive_plant::tomlfile::FileError;
use naming::assert_names;
use std::path::{Path, PathBuf};

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/contact-hosts.toml")
}

fn with(change: impl FnOnce(String) -> String) -> Result<Graph, FileError> {
    Graph::from_text(&change(std::fs::read_to_string(path()).unwrap()), &path(), &Overrides::default(), &Files::Disk)
}

#[test]
fn every_node_is_on_its_host_and_the_recorder_on_each() {
    let graph = with(|text| text).unwrap();
    let on = |host: &str| graph.nodes.iter().filter(|n| graph.runs_on(n, host)).map(|n| n.name.as_str()).collect::<Vec<_>>();
    assert_eq!(on("desk"), ["operator", "master", "canceller", "scaling", "recorder"]);
    assert_eq!(on("robot"), ["slave", "recorder"]);
    assert_eq!(graph.recorders(), [Some("desk"), Some("robot")]);
    assert!(graph.bag_of(Some("robot")).unwrap().ends_with("contact-hosts-robot.mcap"));
    assert_eq!(graph.bag_of(None), None);
    // Scaling and both recorders hear the slave.
    let slave = topics(&graph).into_iter().find(|t| t.topic.name == "/slave/measured_js").unwrap();
    assert_eq!((slave.woken, slave.listeners), (1, 3));
    assert!(topics(&graph).iter().any(|t| t.topic.name == "/host_robot/events"));
    let alone = graph.on_one_host();
    assert_eq!((alone.recorders(), alone.bag_of(None).is_some()), (vec![None], true));
}

#[test]
fn in_lockstep_the_source_waits_for_every_recorder() {
    let graph = with(|text| text.replace("clock = \"realtime\" ", "clock = \"lockstep\" ")).unwrap();
    assert_eq!(credit_listeners(&graph), 1);
    let plan = backdrive_nodes::build::plan(&graph, "operator").unwrap();
    let gates: Vec<&str> = plan.stages[0].inputs.iter().map(|i| i.topic.name.as_str()).collect();
    assert_eq!(gates, [credit_topic(Some("desk")).name, credit_topic(Some("robot")).name]);
    // A lockstep bag holds nothing of the machines.
    assert!(!topics(&graph).iter().any(|t| t.topic.name.starts_with("/host_")));
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let wrong = |from: &str, to: &str| with(|text| text.replacen(from, to, 1)).unwrap_err().to_string();
    let told = wrong("host = \"robot\"", "host = \"robt\"");
    assert_names(&told, &["contact-hosts.toml:", "robot"]);
    let told = wrong("host = \"robot\"\n", "");
    assert_names(&told, &["slave", "desk", "robot"]);
    let told = wrong("[hosts.robot]", "[hosts.robot]\naddress = \"robot.local\"");
    assert_names(&told, &["address"]);
    let told = wrong("[hosts.robot]", "[hosts.\"ro bot\"]");
    assert!(told.contains("letters, digits"), "{told}");
    let told = wrong("[hosts.robot]", "[hosts.robot]\nadress = \"10.0.0.1\"");
    assert_names(&told, &["adress"]);
}
