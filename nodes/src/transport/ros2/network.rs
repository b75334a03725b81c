//! Where on the network the nodes of a graph meet.

use serde::{Deserialize, Serialize};
use std::net::Ipv4Addr;

/// Highest domain whose ports exist (RTPS 2.5, section 9.6.2.3).
pub const MAX_DOMAIN: u16 = 232;

/// Where on the network the nodes of a graph meet.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Network {
    /// DDS domain, 0 to [`MAX_DOMAIN`]; for other ROS tools the `ROS_DOMAIN_ID`.
    pub domain: u16,
    /// Addresses of this host's interfaces to use; all when empty.
    pub interfaces: Vec<Ipv4Addr>,
    /// Hosts that are informed of this one's nodes by unicast, for networks without multicast.
    pub peers: Vec<Ipv4Addr>,
}

/// A network that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// No such domain.
    #[error("{from} = `{given}` is not a domain: expected a whole number from 0 to {MAX_DOMAIN}")]
    Domain {
        /// Its source, such as `ROS_DOMAIN_ID`.
        from: &'static str,
        /// What.
        given: String,
    },
    /// No such interface.
    #[error("this host has no interface `{given}` with an IPv4 address; it has {}", .has.join(", "))]
    Interface {
        /// Name or address that was given.
        given: String,
        /// Names and addresses of those that there are.
        has: Vec<String>,
    },
    /// The system does not say which interfaces there are.
    #[error("cannot list the network interfaces: {0}")]
    List(String),
}

impl Network {
    /// The domain of `ROS_DOMAIN_ID`, or 0 where it is not set, and all interfaces.
    ///
    /// # Errors
    /// `ROS_DOMAIN_ID` is no domain.
    pub fn from_environment() -> Result<Network, NetworkError> {
        Ok(Network { domain: domain_of(std::env::var("ROS_DOMAIN_ID").ok().as_deref())?, ..Network::default() })
    }

    /// Adds an interface of this host by its name or address.
    ///
    /// # Errors
    /// There is none such.
    pub fn add_interface(&mut self, given: &str) -> Result<(), NetworkError> {
        let all = interfaces()?;
        let found: Vec<Ipv4Addr> = all.iter().filter(|i| i.name == given || i.address.to_string() == given).map(|i| i.address).collect();
        if found.is_empty() {
            let has = all.iter().map(|i| format!("{} ({})", i.name, i.address)).collect();
            return Err(NetworkError::Interface { given: given.to_string(), has });
        }
        self.interfaces.extend(found);
        Ok(())
    }

    /// Whether the domain and the interfaces exist.
    pub(crate) fn check(&self) -> Result<(), NetworkError> {
        if self.domain > MAX_DOMAIN {
            return Err(NetworkError::Domain { from: "domain", given: self.domain.to_string() });
        }
        for address in &self.interfaces {
            Network::default().add_interface(&address.to_string())?;
        }
        Ok(())
    }
}

fn domain_of(text: Option<&str>) -> Result<u16, NetworkError> {
    match text.map(str::trim) {
        None | Some("") => Ok(0),
        Some(text) => text
            .parse()
            .ok()
            .filter(|domain| *domain <= MAX_DOMAIN)
            .ok_or_else(|| NetworkError::Domain { from: "ROS_DOMAIN_ID", given: text.to_string() }),
    }
}

/// An interface of this host with an IPv4 address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interface {
    /// Such as `eth0`.
    pub name: String,
    /// Its address.
    pub address: Ipv4Addr,
    /// Whether it is up.
    pub up: bool,
    /// Whether multicast can be sent on it.
    pub multicast: bool,
    /// Whether it leads back to this host.
    pub loopback: bool,
}

/// The interfaces of this host that have an IPv4 address.
///
/// # Errors
/// The system does not say.
pub fn interfaces() -> Result<Vec<Interface>, NetworkError> {
    use nix::libc;
    let mut first: *mut libc::ifaddrs = std::ptr::null_mut();
    // SAFETY: fills the pointer with a list that is freed below.
    if unsafe { libc::getifaddrs(&mut first) } != 0 {
        return Err(NetworkError::List(std::io::Error::last_os_error().to_string()));
    }
    let (mut found, mut next) = (Vec::new(), first);
    // SAFETY: the list is as getifaddrs made it, and is read until its end only.
    while let Some(entry) = unsafe { next.as_ref() } {
        next = entry.ifa_next;
        // SAFETY: an address of family AF_INET is a sockaddr_in, and a name ends with a zero.
        let (address, name) = unsafe {
            let Some(family) = entry.ifa_addr.as_ref().map(|a| i32::from(a.sa_family)) else { continue };
            if family != libc::AF_INET {
                continue;
            }
            let address = (*entry.ifa_addr.cast::<libc::sockaddr_in>()).sin_addr.s_addr;
            (address, std::ffi::CStr::from_ptr(entry.ifa_name).to_string_lossy().into_owned())
        };
        let has = |flag: i32| entry.ifa_flags & flag as u32 != 0;
        found.push(Interface {
            name,
            address: Ipv4Addr::from(u32::from_be(address)),
            up: has(libc::IFF_UP),
            multicast: has(libc::IFF_MULTICAST),
            loopback: has(libc::IFF_LOOPBACK),
        });
    }
    // SAFETY: made by getifaddrs, and nothing borrows from it any more.
    unsafe { libc::freeifaddrs(first) };
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_domain_is_what_other_ros_tools_take_it_for() {
        assert_eq!(domain_of(None), Ok(0));
        assert_eq!(domain_of(Some(" 42 ")), Ok(42));
        for wrong in ["233", "-1", "seven", "1.5"] {
            let told = domain_of(Some(wrong)).unwrap_err().to_string();
            assert!(told.contains("ROS_DOMAIN_ID") && told.contains("0 to 232"), "{told}");
        }
    }

    #[test]
    fn an_interface_has_a_name_and_an_address() {
        let all = interfaces().unwrap();
        let Some(one) = all.first() else { return };
        let (mut by_name, mut by_address) = (Network::default(), Network::default());
        by_name.add_interface(&one.name).unwrap();
        by_address.add_interface(&one.address.to_string()).unwrap();
        assert!(by_name.interfaces.contains(&one.address) && by_address.interfaces.contains(&one.address));
        let told = by_name.add_interface("no_such0").unwrap_err().to_string();
        assert!(told.contains("no_such0") && told.contains(&one.name), "{told}");
    }
}
