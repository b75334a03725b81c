//! From what is asked, the environment and the graph to where on the network a run meets.

use crate::{LaunchError, Place, Wire, secret};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::transport::ros2::{MAX_DOMAIN, Network};
use std::fmt::Display;
use std::net::{Ipv4Addr, ToSocketAddrs};
use std::path::PathBuf;

/// Where on the network ROS 2 is spoken.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// ROS domain, 0 to 232; `None` for that of `ROS_DOMAIN_ID`.
    pub domain: Option<u16>,
    /// Names or addresses of the network interfaces to use; all where none is named.
    pub interfaces: Vec<String>,
    /// Addresses (IPv4) or names of hosts that get unicast announcements.
    pub peers: Vec<String>,
}

/// Where the nodes of a run meet.
#[derive(Debug, Clone, Default)]
pub struct Meeting {
    /// How messages travel; `None` for shared memory on one host, else ROS 2.
    pub wire: Option<Wire>,
    /// The host of the graph whose nodes run here.
    pub host: Option<String>,
    /// File of the secret that the hosts share.
    pub secret: Option<PathBuf>,
    /// Where on the network.
    pub network: Asked,
}

/// What of the network, the hosts or the secret is wrong: a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct AskedError(String);

fn wrong(message: impl Display) -> AskedError {
    AskedError(message.to_string())
}

/// The domain of `--domain` or `ROS_DOMAIN_ID`, and the interfaces and peers that are named.
///
/// # Errors
/// The domain is above 232, or an interface or a host is not found.
pub fn network(options: &Asked) -> Result<Network, AskedError> {
    let mut network = match options.domain {
        Some(domain) if domain <= MAX_DOMAIN => Network { domain, ..Network::default() },
        Some(domain) => return Err(wrong(format!("--domain {domain}: expected 0 to {MAX_DOMAIN}"))),
        None => Network::from_environment().map_err(wrong)?,
    };
    for interface in &options.interfaces {
        network.add_interface(interface).map_err(|e| wrong(format!("--interface: {e}")))?;
    }
    network.peers = options.peers.iter().map(|name| address(name)).collect::<Result<_, _>>()?;
    Ok(network)
}

/// The IPv4 address of a host. RTPS, over which the nodes meet, is spoken over IPv4 only.
fn address(name: &str) -> Result<Ipv4Addr, AskedError> {
    if let Ok(address) = name.parse() {
        return Ok(address);
    }
    let only = "nodes meet over IPv4 only: name an IPv4 address of that host (on it: `ip -4 address`)";
    if name.trim_matches(['[', ']']).parse::<std::net::Ipv6Addr>().is_ok() {
        return Err(wrong(format!("--peer {name}: is an IPv6 address, and {only}")));
    }
    let found = (name, 0)
        .to_socket_addrs()
        .map_err(|e| wrong(format!("--peer {name}: no host of that name is found ({e}); check its spelling, or name its IPv4 address")))?;
    let first = found.into_iter().find_map(|found| match found.ip() {
        std::net::IpAddr::V4(address) => Some(address),
        std::net::IpAddr::V6(_) => None,
    });
    first.ok_or_else(|| wrong(format!("--peer {name}: has IPv6 addresses only, and {only}")))
}

/// Where the nodes of a graph meet, on one of its hosts if one is named.
///
/// # Errors
/// The graph has no such host, the secret is missing or cannot be read, or the network options are wrong.
pub fn place(graph: &Graph, asked: &Meeting) -> Result<Place, AskedError> {
    let (wire, host, secret) = (asked.wire, asked.host.as_deref(), asked.secret.as_deref());
    if secret.is_some() && host.is_none() {
        return Err(wrong("--secret is for several hosts; omit it without --host"));
    }
    let wire = match (wire, host) {
        (Some(Wire::Iceoryx2) | None, None) => return Ok(Place::default()),
        (Some(Wire::Iceoryx2), Some(_)) => Wire::Iceoryx2,
        (Some(Wire::Ros2), _) | (None, Some(_)) => Wire::Ros2,
    };
    let mut network = network(&asked.network)?;
    if let Some(name) = host {
        let file = graph.path.display();
        if graph.hosts.is_empty() {
            return Err(wrong(format!("{file}: has no [hosts], so --host has no effect; omit it")));
        }
        let Some(here) = graph.host(name) else {
            let known = graph.hosts.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(wrong(format!("{file}: has no host \"{name}\"; it has {known}")));
        };
        if !graph.nodes.iter().any(|n| graph.runs_on(n, name)) {
            return Err(wrong(format!("{file}:{}: host \"{name}\" has no node", here.line)));
        }
        if let (true, Some(interface)) = (network.interfaces.is_empty(), &here.interface) {
            network.add_interface(interface).map_err(|e| wrong(format!("{file}:{}: hosts.{name}.interface: {e}", here.line)))?;
        }
        network.peers.extend(graph.hosts.iter().filter(|h| h.name != name).filter_map(|h| h.address));
    }
    let secret = match (secret, host) {
        (Some(path), _) => Some(secret::read(path).map_err(|e| wrong(format!("--secret: {e}")))?),
        (None, Some(_)) => return Err(wrong(LaunchError::NoSecret)),
        (None, None) => None,
    };
    Ok(Place { wire, network, host: host.map(str::to_string), secret, overwrite: false })
}
