//! From the command line, the environment and the graph to where on the network a run meets.

use crate::cli;
use crate::failure::Failure;
use backdrive_launch::{LaunchError, Place, Wire};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::transport::ros2::{MAX_DOMAIN, Network};
use std::net::{Ipv4Addr, ToSocketAddrs};
use std::path::Path;

/// The domain of `--domain` or `ROS_DOMAIN_ID`, and the interfaces and peers that are named.
pub fn network(options: &cli::Network) -> Result<Network, Failure> {
    let mut network = match options.domain {
        Some(domain) if domain <= MAX_DOMAIN => Network { domain, ..Network::default() },
        Some(domain) => return Err(Failure::input(format!("--domain {domain}: expected 0 to {MAX_DOMAIN}"))),
        None => Network::from_environment().map_err(Failure::input)?,
    };
    for interface in &options.interface {
        network.add_interface(interface).map_err(|e| Failure::input(format!("--interface: {e}")))?;
    }
    network.peers = options.peer.iter().map(|name| address(name)).collect::<Result<_, _>>()?;
    Ok(network)
}

/// The IPv4 address of a host. RTPS, over which the nodes meet, is spoken over IPv4 only.
fn address(name: &str) -> Result<Ipv4Addr, Failure> {
    if let Ok(address) = name.parse() {
        return Ok(address);
    }
    let only = "nodes meet over IPv4 only: name an IPv4 address of that host (on it: `ip -4 address`)";
    if name.trim_matches(['[', ']']).parse::<std::net::Ipv6Addr>().is_ok() {
        return Err(Failure::input(format!("--peer {name}: is an IPv6 address, and {only}")));
    }
    let found = (name, 0).to_socket_addrs().map_err(|e| {
        Failure::input(format!("--peer {name}: no host of that name is found ({e}); check its spelling, or name its IPv4 address"))
    })?;
    let first = found.into_iter().find_map(|found| match found.ip() {
        std::net::IpAddr::V4(address) => Some(address),
        std::net::IpAddr::V6(_) => None,
    });
    first.ok_or_else(|| Failure::input(format!("--peer {name}: has IPv6 addresses only, and {only}")))
}

/// Where the nodes of a graph meet, on one of its hosts if one is named. Without a `wire`: shared memory on one host, else ROS 2.
pub fn place(
    graph: &Graph,
    wire: Option<Wire>,
    host: Option<&str>,
    secret: Option<&Path>,
    options: &cli::Network,
) -> Result<Place, Failure> {
    if secret.is_some() && host.is_none() {
        return Err(Failure::input("--secret is what several hosts share; leave it out without --host"));
    }
    let wire = match (wire, host) {
        (Some(Wire::Iceoryx2) | None, None) => return Ok(Place::default()),
        (Some(Wire::Iceoryx2), Some(_)) => Wire::Iceoryx2,
        (Some(Wire::Ros2), _) | (None, Some(_)) => Wire::Ros2,
    };
    let mut network = network(options)?;
    if let Some(name) = host {
        let file = graph.path.display();
        if graph.hosts.is_empty() {
            return Err(Failure::input(format!("{file}: has no [hosts], so --host means nothing here")));
        }
        let Some(here) = graph.host(name) else {
            let known = graph.hosts.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(Failure::input(format!("{file}: has no host \"{name}\"; it has {known}")));
        };
        if !graph.nodes.iter().any(|n| graph.runs_on(n, name)) {
            return Err(Failure::input(format!("{file}:{}: host \"{name}\" has no node", here.line)));
        }
        if let (true, Some(interface)) = (network.interfaces.is_empty(), &here.interface) {
            network.add_interface(interface).map_err(|e| Failure::input(format!("{file}:{}: hosts.{name}.interface: {e}", here.line)))?;
        }
        network.peers.extend(graph.hosts.iter().filter(|h| h.name != name).filter_map(|h| h.address));
    }
    let secret = match (secret, host) {
        (Some(path), _) => Some(backdrive_launch::secret::read(path).map_err(|e| Failure::input(format!("--secret: {e}")))?),
        (None, Some(_)) => return Err(Failure::from(LaunchError::NoSecret)),
        (None, None) => None,
    };
    Ok(Place { wire, network, host: host.map(str::to_string), secret, overwrite: false })
}
