//! Graphs on several hosts: which node runs where.

use super::{Graph, Host, Node, NodeKind};
use backdrive_plant::tomlfile::{FileError, Table, unknown};
use std::path::PathBuf;

/// Reads `[hosts]`.
pub(super) fn read_hosts(top: &mut Table) -> Result<Vec<Host>, FileError> {
    let Some(mut table) = top.table("hosts")? else { return Ok(Vec::new()) };
    let mut hosts = Vec::new();
    for name in table.keys() {
        if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') || name.starts_with(|c: char| c.is_ascii_digit()) {
            return Err(table.error_at(&name, "must be letters, digits and _, not beginning with a digit: it becomes part of topic names"));
        }
        let Some(mut host) = table.table(&name)? else { continue };
        let line = host.line();
        let address = match host.string("address")? {
            None => None,
            Some(text) => match text.parse() {
                Ok(address) => Some(address),
                Err(_) => return Err(host.error_at("address", format!("expected an IPv4 address such as \"10.0.0.2\", found \"{text}\""))),
            },
        };
        let interface = host.string("interface")?;
        host.finish()?;
        hosts.push(Host { name, address, interface, line });
    }
    table.finish()?;
    Ok(hosts)
}

/// Reads `host` of a node.
pub(super) fn read_host(table: &mut Table, kind: NodeKind, hosts: &[Host]) -> Result<Option<String>, FileError> {
    match table.string("host")? {
        Some(name) if hosts.iter().any(|h| h.name == name) => Ok(Some(name)),
        Some(name) => Err(table.error_at("host", unknown("host", &name, hosts.iter().map(|h| h.name.as_str())))),
        None if hosts.is_empty() || kind == NodeKind::Recorder => Ok(None),
        None => Err(table.error(format!("needs a host: {}", hosts.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(" or ")))),
    }
}

impl Graph {
    /// A host by its name.
    pub fn host(&self, name: &str) -> Option<&Host> {
        self.hosts.iter().find(|h| h.name == name)
    }

    /// Whether a node runs on this host. A recorder that names none runs on each.
    pub fn runs_on(&self, node: &Node, host: &str) -> bool {
        node.host.as_deref().map_or(node.kind == NodeKind::Recorder, |h| h == host)
    }

    /// The same graph with everything on one host.
    pub fn on_one_host(mut self) -> Graph {
        self.hosts.clear();
        self.nodes.iter_mut().for_each(|n| n.host = None);
        self
    }

    /// The hosts that record; `None` stands for the one host of a graph that names none.
    pub fn recorders(&self) -> Vec<Option<&str>> {
        match self.node_of(NodeKind::Recorder) {
            None => Vec::new(),
            Some(_) if self.hosts.is_empty() => vec![None],
            Some(node) => self.hosts.iter().map(|h| h.name.as_str()).filter(|h| self.runs_on(node, h)).map(Some).collect(),
        }
    }

    /// The bag of a host, each with the host's name in its own; `None` where it does not record.
    pub fn bag_of(&self, host: Option<&str>) -> Option<PathBuf> {
        let bag = self.bag.as_ref().filter(|_| self.recorders().contains(&host))?;
        let Some(host) = host else { return Some(bag.clone()) };
        let stem = bag.file_stem().unwrap_or_default().to_string_lossy();
        Some(bag.with_file_name(format!("{stem}-{host}.mcap")))
    }
}
