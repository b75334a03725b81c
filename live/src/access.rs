//! Who may look, and who may change something: two tokens, and checks of the headers by which a browser shows where a request comes from.
//!
//! A page of another site can send a browser to this server, and a name of its own can be made to point to it. So the host of a request must be a
//! loopback name or an address in figures, with the port of this server, and its origin, where it has one, must be the same.

use std::net::IpAddr;

/// What a request may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Look.
    Watch,
    /// Look and change.
    Control,
}

/// The tokens of a server.
#[derive(Debug, Clone)]
pub(crate) struct Access {
    pub control: String,
    pub watch: String,
    pub port: u16,
}

impl Access {
    /// Checks a request; on refusal a reason without anything secret.
    pub fn check(&self, host: Option<&str>, origin: Option<&str>, token: Option<&str>) -> Result<Role, &'static str> {
        let host = host.ok_or("no Host header")?;
        if !self.is_own(host) {
            return Err("a Host header of another site");
        }
        if origin.is_some_and(|origin| origin.strip_prefix("http://").is_none_or(|site| !site.eq_ignore_ascii_case(host))) {
            return Err("a request of another site (Origin)");
        }
        let token = token.ok_or("no token")?;
        match (same(token, &self.control), same(token, &self.watch)) {
            (true, _) => Ok(Role::Control),
            (_, true) => Ok(Role::Watch),
            _ => Err("a wrong token"),
        }
    }

    fn is_own(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return false };
        let name = name.trim_start_matches('[').trim_end_matches(']');
        port.parse() == Ok(self.port) && (name.eq_ignore_ascii_case("localhost") || name.parse::<IpAddr>().is_ok())
    }
}

/// Whether two tokens are the same, in a time that does not depend on where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_request_of_its_own_page_with_a_token_is_taken() {
        let access = Access { control: "c".repeat(32), watch: "w".repeat(32), port: 8000 };
        let control = Some("c".repeat(32));
        let ask = |host: &str, origin: Option<&str>, token: &Option<String>| access.check(Some(host), origin, token.as_deref());
        assert_eq!(ask("127.0.0.1:8000", Some("http://127.0.0.1:8000"), &control), Ok(Role::Control));
        assert_eq!(ask("localhost:8000", None, &control), Ok(Role::Control));
        assert_eq!(ask("[::1]:8000", None, &Some("w".repeat(32))), Ok(Role::Watch));
        for host in ["evil.example:8000", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.evil.example:8000", ""] {
            assert!(ask(host, None, &control).is_err(), "{host}");
        }
        for origin in ["http://evil.example", "null", "https://127.0.0.1:8000", "http://127.0.0.1:8001", "http://localhost:8000"] {
            assert!(ask("127.0.0.1:8000", Some(origin), &control).is_err(), "{origin}");
        }
        for token in [None, Some(String::new()), Some("c".repeat(31)), Some("c".repeat(33)), Some("x".repeat(32))] {
            assert!(ask("127.0.0.1:8000", None, &token).is_err());
        }
        assert!(access.check(None, None, control.as_deref()).is_err());
    }
}
