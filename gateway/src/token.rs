//! The token of a gateway that others can reach. Its link sets a cookie; programs send it as a bearer token.

use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse as _, Response};

use crate::responses::Refusal;

/// The first part of the cookie's name.
const COOKIE: &str = "myriorama_";
const QUERY: &str = "token=";
const BYTES: usize = 16;

/// A secret, compared in constant time. It is in no log.
#[derive(Clone)]
pub struct Token(String);

impl Token {
    /// A random token.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub fn random() -> std::io::Result<Self> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// The query of a link that carries the token.
    #[must_use]
    pub fn query(&self) -> String {
        format!("?{QUERY}{}", self.0)
    }

    /// The answer to a request that opens the link or lacks the token; `None` where it needs no token or brings it. The page itself
    /// is no secret: only what is below `/api/` is. A cookie that is set by a link in another page is not sent with the redirect
    /// that follows.
    pub(crate) fn intercept(&self, uri: &Uri, headers: &HeaderMap, is_secure: bool) -> Option<Response> {
        let link = uri.query().and_then(|query| query.split('&').find_map(|part| part.strip_prefix(QUERY)));
        if link.is_some_and(|given| self.is(given)) {
            return Some(self.redirect(uri, is_secure));
        }
        let bearer = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok()?.strip_prefix("Bearer "));
        let is_open = !uri.path().starts_with("/api/");
        if is_open || bearer.is_some_and(|given| self.is(given)) || self.cookies(headers).any(|given| self.is(given)) {
            return None;
        }
        let reason = "the token is missing: open the link that the gateway printed, or send it as a bearer token";
        Some(Refusal(StatusCode::UNAUTHORIZED, reason.to_owned()).into_response())
    }

    /// The answer to the link: a cookie, and the same address without the token. It is relative, so that the page may be under
    /// any path.
    fn redirect(&self, uri: &Uri, is_secure: bool) -> Response {
        let secure = if is_secure { "; Secure" } else { "" };
        let cookie = format!("{}={}; HttpOnly; SameSite=Strict{secure}", self.cookie(), self.0);
        let fields = [
            (header::SET_COOKIE, HeaderValue::from_str(&cookie).unwrap_or(HeaderValue::from_static(""))),
            (header::LOCATION, HeaderValue::from_str(&without_token(uri)).unwrap_or(HeaderValue::from_static("./"))),
            (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
            (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
        ];
        (StatusCode::SEE_OTHER, fields).into_response()
    }

    fn is(&self, given: &str) -> bool {
        // Hashes compare in constant time.
        blake3::hash(given.as_bytes()) == blake3::hash(self.0.as_bytes())
    }

    /// Gateways on different ports of a host share its cookies: each has a name of its own.
    fn cookie(&self) -> String {
        format!("{COOKIE}{}", &blake3::hash(self.0.as_bytes()).to_hex()[..8])
    }

    fn cookies<'h>(&self, headers: &'h HeaderMap) -> impl Iterator<Item = &'h str> + use<'h> {
        let own = self.cookie();
        let all = headers.get_all(header::COOKIE).into_iter().filter_map(|value| value.to_str().ok());
        let pairs = all.flat_map(|value| value.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.filter_map(move |(name, value)| (name == own).then_some(value))
    }
}

/// The last part of an address, without the token.
fn without_token(uri: &Uri) -> String {
    let name = uri.path().rsplit('/').next().unwrap_or_default();
    let rest: Vec<&str> = uri
        .query()
        .unwrap_or_default()
        .split('&')
        .filter(|part| !part.is_empty() && !part.starts_with(QUERY))
        .collect();
    let query = if rest.is_empty() { String::new() } else { format!("?{}", rest.join("&")) };
    format!("./{name}{query}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intercepted(path: &str, name: header::HeaderName, value: &str) -> Option<StatusCode> {
        let token = Token("secret".to_owned());
        let mut headers = HeaderMap::new();
        headers.insert(name, value.parse().unwrap());
        token.intercept(&path.parse().unwrap(), &headers, false).map(|answer| answer.status())
    }

    #[test]
    fn a_cookie_or_a_bearer_token_opens_the_api() {
        let path = "/api/v1/view.png?size=8x8";
        let name = Token("secret".to_owned()).cookie();
        assert_eq!(intercepted(path, header::COOKIE, &format!("a=b; {name}=secret")), None);
        assert_eq!(intercepted(path, header::AUTHORIZATION, "Bearer secret"), None);
        assert_eq!(intercepted(path, header::AUTHORIZATION, "Basic secret"), Some(StatusCode::UNAUTHORIZED));
        assert_eq!(intercepted(path, header::COOKIE, &format!("{name}=secre")), Some(StatusCode::UNAUTHORIZED));
        let other = Token("other".to_owned()).cookie();
        assert_eq!(intercepted(path, header::COOKIE, &format!("{other}=secret")), Some(StatusCode::UNAUTHORIZED));
        assert_eq!(intercepted(path, header::COOKIE, &format!("{other}=other; {name}=secret")), None);
    }

    #[test]
    fn the_page_is_open_and_its_link_sets_the_cookie() {
        assert_eq!(intercepted("/main.js", header::ACCEPT, "*/*"), None);
        assert_eq!(intercepted("/?token=secret", header::ACCEPT, "*/*"), Some(StatusCode::SEE_OTHER));
        assert_eq!(intercepted("/api/v1/socket?token=wrong", header::ACCEPT, "*/*"), Some(StatusCode::UNAUTHORIZED));
        for (link, location) in [
            ("/?token=secret", "./"),
            ("/status?token=secret", "./status"),
            ("/a/b?x=1&token=secret&y=2", "./b?x=1&y=2"),
        ] {
            let answer = Token("secret".to_owned()).redirect(&link.parse().unwrap(), true);
            assert_eq!(answer.headers()[header::LOCATION], location);
        }
        let answer = Token("secret".to_owned()).redirect(&Uri::from_static("/"), true);
        let cookie = answer.headers()[header::SET_COOKIE].to_str().unwrap();
        let name = Token("secret".to_owned()).cookie();
        assert!(cookie.starts_with(&format!("{name}=secret; HttpOnly; SameSite=Strict; Secure")), "{cookie}");
    }

    #[test]
    fn tokens_differ() {
        assert_ne!(Token::random().unwrap().query(), Token::random().unwrap().query());
    }
}
