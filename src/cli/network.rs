//! How messages travel, and where on the network.

use backdrive_launch::asked::Asked;
use clap::Args;

/// Network settings of ROS 2.
#[derive(Debug, Clone, Default, Args)]
pub struct Network {
    /// ROS domain, 0 to 232, instead of ROS_DOMAIN_ID.
    #[arg(long, value_name = "N")]
    pub domain: Option<u16>,
    /// Name or address of a network interface to use; may be given several times. Without this all.
    #[arg(long, value_name = "NAME")]
    pub interface: Vec<String>,
    /// Address (IPv4) or name of a host to reach by unicast, if there is no multicast; may be given several times.
    #[arg(long, value_name = "HOST")]
    pub peer: Vec<String>,
}

impl Network {
    /// As the run takes it.
    pub fn asked(&self) -> Asked {
        Asked { domain: self.domain, interfaces: self.interface.clone(), peers: self.peer.clone() }
    }
}
