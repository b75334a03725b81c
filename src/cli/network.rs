//! How messages travel, and where on the network.

use backdrive_launch::asked::Asked;
use clap::Args;

/// Where on the network ROS 2 is spoken.
#[derive(Debug, Clone, Default, Args)]
pub struct Network {
    /// ROS domain, 0 to 232, in place of ROS_DOMAIN_ID.
    #[arg(long, value_name = "N")]
    pub domain: Option<u16>,
    /// Name or address of a network interface to use; may be given again. All without.
    #[arg(long, value_name = "NAME")]
    pub interface: Vec<String>,
    /// Address (IPv4) or name of a host to tell by unicast, where there is no multicast; may be given again.
    #[arg(long, value_name = "HOST")]
    pub peer: Vec<String>,
}

impl Network {
    /// As the run takes it.
    pub fn asked(&self) -> Asked {
        Asked { domain: self.domain, interfaces: self.interface.clone(), peers: self.peer.clone() }
    }
}
