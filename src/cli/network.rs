//! How messages travel, and where on the network.

use clap::{Args, ValueEnum};

/// How messages travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Transport {
    /// A process per node over shared memory.
    Iceoryx2,
    /// A process per node over ROS 2 (DDS).
    Ros2,
    /// All nodes in this process.
    Inproc,
}

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
