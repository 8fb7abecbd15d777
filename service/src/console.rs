//! The console: the page in the browser, built from `console/` and put into the program.

use axum::{
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use rust_embed::RustEmbed;

/// The built page; empty where the program was built without it.
#[derive(RustEmbed)]
#[folder = "../console/dist"]
#[allow_missing = true]
struct Built;

/// Shown where the program was built without the console.
const WITHOUT: &str = r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Toile</title></head><body>
<h1>Toile is running, but this program was built without its console</h1>
<p>Run <code>make</code> in the project's folder, which builds the console and then the program, and start
<code>toile serve</code> again. The HTTP API works without it: see <a href="/api/openapi.json">/api/openapi.json</a>.</p>
</body></html>
"#;

/// Policy of the page: nothing from elsewhere, nothing written into the page itself.
pub const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
    connect-src 'self' blob:; font-src 'self'; worker-src 'self'; media-src 'self'; manifest-src 'self'; base-uri 'none'; \
    form-action 'self'; frame-ancestors 'none'";

/// True where the program has the console in it.
pub fn is_built() -> bool {
    Built::get("index.html").is_some()
}

/// The file of the console at `way`; the page itself for `/`.
pub fn file(way: &str, asked: &HeaderMap) -> Response {
    let way = way.trim_start_matches('/');
    let name = if way.is_empty() { "index.html" } else { way };
    let accepts_gzip = asked.get(header::ACCEPT_ENCODING).is_some_and(|v| v.to_str().is_ok_and(|v| v.contains("gzip")));
    // The build leaves a packed twin beside what is worth packing.
    let packed = accepts_gzip.then(|| Built::get(&format!("{name}.gz"))).flatten();
    let is_packed = packed.is_some();
    let Some(found) = packed.or_else(|| Built::get(name)) else {
        return if name == "index.html" { without() } else { StatusCode::NOT_FOUND.into_response() };
    };
    let tag = format!("\"{}\"", found.metadata.sha256_hash().iter().map(|b| format!("{b:02x}")).collect::<String>());
    let is_same = asked.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes());
    let mut answer =
        if is_same { StatusCode::NOT_MODIFIED.into_response() } else { found.data.into_owned().into_response() };
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind(name)));
    headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    // Names of assets change with their content.
    let keep = if name.starts_with("assets/") { "public, max-age=31536000, immutable" } else { "no-cache" };
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(keep));
    if is_packed {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        headers.insert(header::ETAG, tag);
    }
    answer
}

fn without() -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], WITHOUT).into_response()
}

/// Media type by a file's name.
pub fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, end)| end) {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "wasm" => "application/wasm",
        "glb" | "vrm" => "model/gltf-binary",
        "csv" => "text/csv; charset=utf-8",
        "txt" | "toml" | "tum" | "log" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}
