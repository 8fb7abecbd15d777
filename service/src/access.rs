//! Who may ask: token, host and origin; and random numbers for tokens.

use std::{io, net::IpAddr};

use axum::http::{HeaderMap, Method, StatusCode, header};
use subtle::ConstantTimeEq;

use crate::error::Refusal;

/// Name of the cookie that carries the token.
const COOKIE: &str = "toile";

/// `bytes` random bytes of the system as hexadecimal digits.
///
/// # Errors
/// The system's error where it has no random numbers.
pub fn random_hex(bytes: usize) -> io::Result<String> {
    let mut random = vec![0; bytes];
    getrandom::fill(&mut random).map_err(|error| io::Error::other(error.to_string()))?;
    Ok(random.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The rules by which requests are let in.
#[derive(Debug, Clone)]
pub struct Access {
    /// What callers must show; `None` on loopback.
    pub token: Option<String>,
    /// True where connections are encrypted.
    pub is_tls: bool,
    /// Names by which this machine may be called, besides its addresses. Empty: only loopback names.
    pub names: Vec<String>,
}

impl Access {
    /// Only this machine may ask, without a token.
    pub fn loopback() -> Self {
        Self { token: None, is_tls: false, names: Vec::new() }
    }

    /// Whoever shows `token` may ask, from anywhere; the machine is also called by `names`.
    pub fn with_token(token: String, names: Vec<String>, is_tls: bool) -> Self {
        Self { token: Some(token), is_tls, names }
    }

    /// Checks by which name the service is called, and that no page from elsewhere asks.
    ///
    /// A page from elsewhere that resolves its own name to this machine (DNS rebinding) is caught by the name; one that
    /// sends requests to this address, by `Origin` and `Sec-Fetch-Site`, which browsers set and pages cannot.
    ///
    /// # Errors
    /// 403 says which of both is wrong.
    pub fn check_origin(&self, method: &Method, headers: &HeaderMap) -> Result<(), Refusal> {
        let forbidden = |sentence: &str| Err(Refusal::new(StatusCode::FORBIDDEN, sentence));
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("\0"));
        let host = text(header::HOST).unwrap_or("");
        if !self.is_own(host) {
            return forbidden("the service is not called by this name; use the address that it printed");
        }
        let scheme = if self.is_tls { "https" } else { "http" };
        if let Some(origin) = text(header::ORIGIN)
            && origin != format!("{scheme}://{host}")
        {
            return forbidden("a page from elsewhere may not use this service");
        }
        let is_visit =
            method == Method::GET && text(header::HeaderName::from_static("sec-fetch-mode")) == Some("navigate");
        match text(header::HeaderName::from_static("sec-fetch-site")) {
            None | Some("same-origin" | "none") => Ok(()),
            Some(_) if is_visit => Ok(()),
            Some(_) => forbidden("a page from elsewhere may not use this service"),
        }
    }

    /// Whether `host` (with or without a port) is a name of this machine: DNS cannot make an address lead elsewhere.
    fn is_own(&self, host: &str) -> bool {
        let name = match host.strip_prefix('[') {
            Some(rest) => rest.split_once(']').map_or("", |(address, _)| address),
            None => host.rsplit_once(':').map_or(host, |(name, _)| name),
        };
        let address = name.parse::<IpAddr>().ok();
        match &self.token {
            None => name == "localhost" || address.is_some_and(|address| address.is_loopback()),
            Some(_) => {
                name == "localhost" || address.is_some() || self.names.iter().any(|n| n.eq_ignore_ascii_case(name))
            }
        }
    }

    /// Checks the token of a request.
    ///
    /// # Errors
    /// 401 where it is missing or wrong.
    pub fn check_token(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let Some(token) = &self.token else { return Ok(()) };
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let shown = cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        let bearer = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok()?.strip_prefix("Bearer "));
        let mut shown = shown.filter(|(name, _)| *name == COOKIE).map(|(_, value)| value).chain(bearer);
        if shown.any(|shown| is_same(shown, token)) {
            return Ok(());
        }
        let sentence = "sign in with the token that `toile serve` printed when it was started";
        Err(Refusal::new(StatusCode::UNAUTHORIZED, sentence))
    }

    /// The cookie for who shows the right token.
    ///
    /// # Errors
    /// 401 where it is wrong.
    pub fn cookie(&self, shown: &str) -> Result<String, Refusal> {
        let secure = if self.is_tls { "; Secure" } else { "" };
        match &self.token {
            Some(token) if is_same(shown, token) => {
                Ok(format!("{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict{secure}"))
            }
            Some(_) => Err(Refusal::new(StatusCode::UNAUTHORIZED, "this is not the token that `toile serve` printed")),
            None => Ok(format!("{COOKIE}=none; Path=/; HttpOnly; SameSite=Strict; Max-Age=0")),
        }
    }
}

/// Compares in a time that does not depend on where both differ.
fn is_same(shown: &str, token: &str) -> bool {
    bool::from(shown.as_bytes().ct_eq(token.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap())).collect()
    }

    fn is_let_in(access: &Access, pairs: &[(&'static str, &str)]) -> bool {
        access.check_origin(&Method::POST, &headers(pairs)).is_ok()
    }

    #[test]
    fn on_loopback_only_loopback_names_are_its_own() {
        let access = Access::loopback();
        for host in ["localhost:8000", "127.0.0.1:8000", "[::1]:8000", "127.8.8.8"] {
            assert!(is_let_in(&access, &[("host", host)]), "{host}");
        }
        for host in
            ["", "evil.example:8000", "localhost.evil.example", "192.168.0.2:80", "127.0.0.1.evil.example:80", "[::1"]
        {
            assert!(!is_let_in(&access, &[("host", host)]), "{host}");
        }
        assert!(!is_let_in(&access, &[]));
    }

    #[test]
    fn pages_from_elsewhere_are_refused() {
        let access = Access::loopback();
        let host = ("host", "localhost:8000");
        assert!(is_let_in(&access, &[host, ("origin", "http://localhost:8000"), ("sec-fetch-site", "same-origin")]));
        for origin in ["http://evil.example", "null", "https://localhost:8000", "http://localhost:9000", ""] {
            assert!(!is_let_in(&access, &[host, ("origin", origin)]), "{origin}");
        }
        for site in ["cross-site", "same-site"] {
            assert!(!is_let_in(&access, &[host, ("sec-fetch-site", site)]), "{site}");
        }
        let visit = headers(&[host, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")]);
        assert!(access.check_origin(&Method::GET, &visit).is_ok(), "a link to the page may be followed");
        assert!(access.check_origin(&Method::POST, &visit).is_err());
    }

    #[test]
    fn with_a_token_nobody_is_let_in_without_it() {
        let access = Access::with_token("s3cret".into(), vec!["studio".into()], true);
        assert!(is_let_in(&access, &[("host", "Studio:443")]) && is_let_in(&access, &[("host", "10.0.0.4:443")]));
        assert!(!is_let_in(&access, &[("host", "evil.example")]));
        let is_signed_in = |pairs: &[(&'static str, &str)]| access.check_token(&headers(pairs)).is_ok();
        assert!(
            is_signed_in(&[("cookie", "a=b; toile=s3cret")]) && is_signed_in(&[("authorization", "Bearer s3cret")])
        );
        for cookie in ["", "toile=", "toile=s3cre", "toile=s3cretx", "other=s3cret"] {
            assert!(!is_signed_in(&[("cookie", cookie)]), "{cookie}");
        }
        assert!(access.cookie("s3cre").is_err());
        let cookie = access.cookie("s3cret").unwrap();
        assert!(cookie.contains("SameSite=Strict") && cookie.contains("HttpOnly") && cookie.contains("Secure"));
    }
}
