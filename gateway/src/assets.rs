//! The page's files, as they are in `page/`.

use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse as _, Response};

/// The program's version.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Only files of this server are loaded and connected to.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Names, media types and texts of files, by their endings.
macro_rules! files {
    ($($ending:literal $media_type:literal: $($name:ident)*;)*) => {
        &[$($((
            concat!(stringify!($name), ".", $ending),
            concat!($media_type, "; charset=utf-8"),
            include_str!(concat!("../page/", stringify!($name), ".", $ending)),
        )),*),*]
    };
}

const FILES: &[(&str, &str, &str)] = files! {
    "html" "text/html": index status;
    "css" "text/css": style;
    "js" "text/javascript": api camera compare dom frusta input link main marks measure notices overlays panels pictures
        playback poses screen statistics status;
};

/// The answer to a request for a file; without a body where the browser has it already.
pub(crate) fn answer(name: &str, headers: &HeaderMap) -> Response {
    let Some((_, media_type, text)) = FILES.iter().find(|(known, ..)| *known == name) else {
        return (StatusCode::NOT_FOUND, "no such page\n").into_response();
    };
    let etag = format!("\"{}\"", &blake3::hash(text.as_bytes()).to_hex()[..32]);
    let has_it = headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == etag.as_bytes());
    let body = if has_it { StatusCode::NOT_MODIFIED.into_response() } else { (*text).into_response() };
    let fields = [
        (header::CONTENT_TYPE, *media_type),
        (header::ETAG, &etag),
        (header::CACHE_CONTROL, "no-cache"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ];
    (fields, body).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_sent_once() {
        let first = answer("index.html", &HeaderMap::new());
        assert_eq!(first.status(), StatusCode::OK);
        let mut headers = HeaderMap::new();
        headers.insert(header::IF_NONE_MATCH, first.headers()[header::ETAG].clone());
        assert_eq!(answer("index.html", &headers).status(), StatusCode::NOT_MODIFIED);
        assert_eq!(answer("main.js", &headers).status(), StatusCode::OK);
        assert_eq!(answer("../Cargo.toml", &headers).status(), StatusCode::NOT_FOUND);
    }

    #[test]
    fn the_page_is_small() {
        let bytes: usize = FILES.iter().map(|(.., text)| text.len()).sum();
        assert!(bytes <= 120_000, "{bytes}");
        for (name, _, text) in FILES {
            assert!(text.lines().count() < 400, "{name}");
        }
    }

    #[test]
    fn the_page_names_no_address() {
        let all: String = FILES.iter().map(|(.., text)| *text).collect();
        for absolute in ["http://", "https://", "href=\"/", "src=\"/"] {
            assert!(!all.contains(absolute), "{absolute}");
        }
    }
}
