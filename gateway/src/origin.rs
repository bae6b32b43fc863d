//! The names by which this server is reached, and the pages that may use it. A page of another origin could otherwise reach a
//! server on loopback through its visitor's browser, by a name of its own that leads there.

use std::net::IpAddr;

use axum::http::HeaderMap;

/// Checks a request's Host and Origin. Programs send no Origin.
///
/// # Errors
/// A sentence on the request that names another server, or comes from another page.
pub(crate) fn check(headers: &HeaderMap, hosts: &[String], origins: &[String]) -> Result<(), String> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok());
    let host = text("host").unwrap_or_default();
    let name = name_of(host);
    let is_known = is_local(name) || hosts.iter().any(|known| known.eq_ignore_ascii_case(name));
    if !is_known && name.parse::<IpAddr>().is_err() {
        return Err(format!("Host {host:?} is not a name of this server: give it by --host"));
    }
    let Some(origin) = text("origin") else {
        // A picture or a link in another page has no origin, but its browser says where it is from.
        let is_foreign = text("sec-fetch-site").is_some_and(|site| site == "cross-site" || site == "same-site");
        let is_visit = text("sec-fetch-mode") == Some("navigate");
        return if is_foreign && !is_visit { Err(foreign("of another page")) } else { Ok(()) };
    };
    let is_own = origin.split_once("://").is_some_and(|(_, authority)| authority.eq_ignore_ascii_case(host));
    let is_allowed = origins.iter().any(|allowed| allowed.eq_ignore_ascii_case(origin));
    if is_own || is_allowed { Ok(()) } else { Err(foreign(origin)) }
}

fn foreign(origin: &str) -> String {
    format!("Origin {origin:?} is not this server: give it by --allow-origin, or let the proxy pass Host with its port")
}

fn is_local(name: &str) -> bool {
    name.eq_ignore_ascii_case("localhost") || name.to_ascii_lowercase().ends_with(".localhost")
}

/// The name or the address in `name:port`, `[address]:port`, or either without its port.
fn name_of(host: &str) -> &str {
    match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((address, _)) => address,
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    }
}

#[cfg(test)]
mod tests {
    use axum::http::header;

    use super::*;

    fn checked(host: &str, origin: Option<&str>) -> Result<(), String> {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        check(&headers, &["render.example".to_owned()], &["https://portal.example".to_owned()])
    }

    #[test]
    fn a_server_answers_to_addresses_and_to_its_names() {
        for host in
            ["127.0.0.1:7420", "[::1]:7420", "192.168.1.7", "localhost:80", "Render.Example:7420", "a.localhost"]
        {
            assert_eq!(checked(host, None), Ok(()), "{host}");
        }
        for host in ["evil.example:7420", "", "localhost.evil.example"] {
            assert!(checked(host, None).unwrap_err().starts_with(&format!("Host {host:?}")));
        }
    }

    #[test]
    fn a_page_of_another_origin_is_refused() {
        assert_eq!(checked("localhost:7420", Some("http://localhost:7420")), Ok(()));
        assert_eq!(checked("localhost:7420", Some("https://portal.example")), Ok(()));
        for origin in ["http://localhost:7421", "http://evil.example", "null"] {
            let error = checked("localhost:7420", Some(origin)).unwrap_err();
            assert!(error.starts_with(&format!("Origin {origin:?}")), "{error}");
        }
    }

    #[test]
    fn a_picture_in_another_page_is_refused_and_a_link_is_not() {
        let from = |site: &str, mode: &str| {
            let fields = [("host", "localhost"), ("sec-fetch-site", site), ("sec-fetch-mode", mode)];
            let headers = fields.map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap()));
            check(&HeaderMap::from_iter(headers), &[], &[]).is_ok()
        };
        assert!(!from("cross-site", "no-cors") && !from("same-site", "no-cors"));
        assert!(from("cross-site", "navigate") && from("same-origin", "no-cors") && from("none", "navigate"));
    }
}
