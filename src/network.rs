//! From the command line, the environment and the graph to where on the network a run meets.

use crate::cli::{self, Transport};
use crate::failure::Failure;
use backdrive_launch::{Place, Wire};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::transport::ros2::{MAX_DOMAIN, Network};

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
    network.peers.clone_from(&options.peer);
    Ok(network)
}

/// Where the nodes of a graph meet, on one of its hosts if one is named.
pub fn place(graph: &Graph, transport: Option<Transport>, host: Option<&str>, options: &cli::Network) -> Result<Place, Failure> {
    let wire = match (transport, host) {
        (Some(Transport::Iceoryx2) | None, None) => return Ok(Place::default()),
        (Some(Transport::Iceoryx2), Some(_)) => Wire::Iceoryx2,
        _ => Wire::Ros2,
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
    Ok(Place { wire, network, host: host.map(str::to_string), overwrite: false })
}
