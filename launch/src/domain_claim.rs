//! One run of a machine speaks for a node in a ROS domain.
//!
//! Two runs that speak on the same topics refuse each other's messages, and each ends because of the other. Which of them goes on is decided before a node
//! is started: a run binds a name for each of its nodes. The system gives the name to one process alone and frees it when that ends, however it ends. The
//! names (abstract addresses of Unix sockets) belong to the network in which the machine's participants find each other, whoever their user is.

use crate::error::LaunchError;
use crate::place::{Place, Wire};
use crate::plan::{NodePlan, Plan};
use backdrive_nodes::transport::ros2::interfaces;
use std::net::Ipv4Addr;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

/// Names that are held for as long as it lives.
pub(crate) struct DomainClaim(#[expect(dead_code, reason = "they are held open")] Vec<UnixDatagram>);

impl DomainClaim {
    /// Takes the names of all nodes that this host runs; none where the run has no network.
    ///
    /// # Errors
    /// Another run has one of them.
    pub fn take(plan: &Plan) -> Result<DomainClaim, LaunchError> {
        if plan.place.wire != Wire::Ros2 {
            return Ok(DomainClaim(Vec::new()));
        }
        // Of a run on several hosts each has a recorder, all of one name.
        let recorder_of = plan.place.host.as_deref().map(|host| format!(" of {host}")).unwrap_or_default();
        let all = plan.nodes.iter().flat_map(NodePlan::nodes);
        let mut nodes: Vec<String> =
            all.map(|node| if node.kind == "recorder" { format!("{}{recorder_of}", node.name) } else { node.name }).collect();
        // In one order, so that of two runs that begin at the same instant one has them all.
        nodes.sort();
        let mut held = Vec::new();
        for address in addresses(&plan.place) {
            for node in &nodes {
                match bind(&plan.place, address, node) {
                    Ok(socket) => held.push(socket),
                    Err(error) if error.kind() == std::io::ErrorKind::AddrInUse => {
                        return Err(LaunchError::DomainTaken { domain: plan.place.network.domain, node: node.clone() });
                    }
                    // Where the system has no such names, the nodes still find out that another run speaks.
                    Err(_) => {}
                }
            }
        }
        Ok(DomainClaim(held))
    }
}

/// The interfaces that a run uses: runs that share none never meet.
fn addresses(place: &Place) -> Vec<Ipv4Addr> {
    let mut addresses = place.network.interfaces.clone();
    if addresses.is_empty() {
        addresses = interfaces().unwrap_or_default().iter().map(|interface| interface.address).collect();
    }
    addresses.sort();
    addresses.dedup();
    addresses
}

fn bind(place: &Place, address: Ipv4Addr, node: &str) -> std::io::Result<UnixDatagram> {
    let name = format!("backdrive domain {} {address} {node}", place.network.domain);
    UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(name)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_nodes::graph::{Graph, Overrides};
    use std::path::Path;

    fn plan(graph: &str, domain: u16, interfaces: &[Ipv4Addr], host: Option<&str>) -> Plan {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(graph);
        let mut place = Place { wire: Wire::Ros2, host: host.map(str::to_owned), ..Place::default() };
        (place.network.domain, place.network.interfaces) = (domain, interfaces.to_vec());
        Plan::of(&Graph::load(&path, &Overrides::default()).unwrap(), &place)
    }

    #[test]
    fn of_two_runs_in_a_domain_one_has_it_until_it_ends() {
        let here = &[Ipv4Addr::new(127, 0, 0, 1)];
        let run = || DomainClaim::take(&plan("contact.toml", 231, here, None));
        let first = run().unwrap();
        let Err(LaunchError::DomainTaken { domain, node }) = run() else { panic!("a second run has the domain too") };
        assert_eq!((domain, node.as_str()), (231, "canceller"));
        // Another domain, another network, and shared memory are other places.
        assert!(DomainClaim::take(&plan("contact.toml", 230, here, None)).is_ok());
        assert!(DomainClaim::take(&plan("contact.toml", 231, &[Ipv4Addr::new(127, 0, 0, 2)], None)).is_ok());
        assert!(DomainClaim::take(&Plan { place: Place::default(), ..plan("contact.toml", 231, here, None) }).is_ok());
        drop(first);
        assert!(run().is_ok());
    }

    #[test]
    fn of_many_runs_that_begin_at_once_exactly_one_has_the_domain() {
        // Each round has names of its own: a process that another test starts holds those of the round before until it runs its program.
        for round in 0..50 {
            let plan = plan("contact.toml", 229, &[Ipv4Addr::new(127, 0, 1, round)], None);
            let all = std::sync::Barrier::new(4);
            let take = || {
                all.wait();
                let claim = DomainClaim::take(&plan);
                // Held until all have tried.
                all.wait();
                claim.is_ok()
            };
            let won = std::thread::scope(|scope| [0; 4].map(|_| scope.spawn(take)).map(|run| run.join().unwrap()));
            assert_eq!(won.iter().filter(|won| **won).count(), 1, "{won:?}");
        }
    }

    #[test]
    fn hosts_of_one_run_share_a_domain_on_one_machine() {
        let here = &[Ipv4Addr::new(127, 0, 0, 1)];
        let hosts: Vec<String> = Graph::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("contact-hosts.toml"), &Overrides::default())
            .unwrap()
            .hosts
            .iter()
            .map(|host| host.name.clone())
            .collect();
        let claims: Vec<_> =
            hosts.iter().map(|host| DomainClaim::take(&plan("contact-hosts.toml", 228, here, Some(host))).unwrap()).collect();
        assert!(claims.len() == 2 && DomainClaim::take(&plan("contact.toml", 228, here, None)).is_err());
    }
}
