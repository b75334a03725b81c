//! Which hosts are missing, and why, to the knowledge of this one.

use super::{ENOUGH, Here, Round, There};
use backdrive_nodes::transport::ros2::interfaces;
use backdrive_nodes::transport::ros2::overheard::Overheard;
use std::net::Ipv4Addr;

impl Round {
    /// Who is missing, and why.
    pub(super) fn look(&mut self, here: &Here) {
        if self.begun.is_some() {
            self.overheard = None;
            return;
        }
        let overheard = self.overheard.as_mut().map(Overheard::others).unwrap_or_default();
        let mut missing = Vec::new();
        for (host, other) in &self.others {
            match other.heard {
                None => missing.push(self.why_absent(host, &overheard)),
                Some(_) if other.lost => missing.push(format!("host {host}: no longer responds")),
                Some(_) if !other.ready && other.missing.is_empty() => {
                    missing.push(format!("host {host}: is there, its nodes are still starting"))
                }
                Some(_) if !other.ready => missing.extend(other.missing.iter().map(|m| format!("host {host}: {m}"))),
                Some(_) if other.clocks.len() < ENOUGH => missing.push(format!("host {host}: its clock is being measured")),
                Some(_) => {}
            }
        }
        if missing.is_empty() && here.ready && self.name != self.leader {
            missing.push(format!("host {}: has not sent the start time", self.leader));
        }
        let elsewhere = overheard.iter().filter(|(domain, _)| *domain != self.network.domain);
        if self.others.values().any(|o| o.heard.is_none()) {
            missing.extend(elsewhere.map(|(domain, address)| {
                format!(
                    "{address} announces itself in ROS domain {domain}, this host in {}: is ROS_DOMAIN_ID the same on both?",
                    self.network.domain
                )
            }));
        }
        let _ = self.send.send(There::Missing(missing));
    }

    fn why_absent(&self, host: &str, heard_of: &[(u16, Ipv4Addr)]) -> String {
        let all = interfaces().unwrap_or_default();
        let used: Vec<_> =
            all.iter().filter(|i| i.up && (self.network.interfaces.is_empty() || self.network.interfaces.contains(&i.address))).collect();
        let over = used.iter().map(|i| format!("{} ({})", i.address, i.name)).collect::<Vec<_>>().join(", ");
        let domain = self.network.domain;
        let why = if self.foreign {
            "a program there has another secret: is the file of --secret the same on both hosts?".to_string()
        } else if !used.iter().any(|i| !i.loopback) {
            "only the loopback is up here: connect the network or name another --interface".to_string()
        } else if self.network.peers.is_empty() && !used.iter().any(|i| i.multicast && !i.loopback) {
            "none of these interfaces can multicast: name its address with --peer, or `address` under [hosts] in the graph".to_string()
        } else if let Some((_, address)) = heard_of.iter().find(|(d, _)| *d == domain) {
            format!("{address} announces itself in this domain but does not answer: is its way back open (firewall, interface)?")
        } else if self.network.peers.is_empty() {
            format!(
                "is `backdrive run ... --host {host}` started there, with the same ROS_DOMAIN_ID? Where the network has no multicast, name its address with --peer"
            )
        } else {
            let peers = self.network.peers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            format!(
                "is `backdrive run ... --host {host}` started there, with the same ROS_DOMAIN_ID? It is searched for at {peers} and by \
                    multicast"
            )
        };
        format!("host {host}: does not respond in ROS domain {domain} on {over}; {why}")
    }
}
