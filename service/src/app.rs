//! All addresses behind the checks that every request passes.

use axum::{
    Extension, Json, Router,
    extract::{DefaultBodyLimit, Request, State},
    http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header},
    middleware::{Next, from_fn_with_state},
    response::{IntoResponse, Response},
    routing::get,
};
use std::sync::{Arc, atomic::Ordering};
use utoipa::{
    OpenApi,
    openapi::{Content, OpenApi as Document, Ref, ResponseBuilder, path::Operation, security},
};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    console,
    error::Refusal,
    limits::{Common, Share},
    pictures::What,
    routes::{archive, capture, devices, edits, events, files, jobs, metrics, session, subject},
    service::Service,
};

/// Bodies of requests, bytes; edits have a limit of their own.
const MOST_BYTES: usize = 64 << 10;
/// The edits of a layer: 100,000 points in full precision take half of it.
const MOST_EDIT_BYTES: usize = 16 << 20;

/// Scans, jobs and capture of Toile over HTTP.
#[derive(OpenApi)]
#[openapi(
    info(title = "Toile", description = "Scans of people, layer by layer, to animated avatars: the archive, its jobs, and the capture."),
    components(schemas(What)),
    tags((name = "archive"), (name = "subjects"), (name = "edits"), (name = "jobs"), (name = "capture"), (name = "service"))
)]
struct Api;

/// All addresses, and their description.
fn routes() -> (Router<Service>, Document) {
    let edits =
        OpenApiRouter::new().routes(routes!(edits::get, edits::put)).layer(DefaultBodyLimit::max(MOST_EDIT_BYTES));
    let (router, mut document) = OpenApiRouter::with_openapi(Api::openapi())
        .routes(routes!(archive::list))
        .routes(routes!(archive::create))
        .routes(routes!(subject::subject, archive::remove))
        .routes(routes!(archive::binned))
        .routes(routes!(archive::restore))
        .routes(routes!(subject::picture))
        .routes(routes!(subject::frame))
        .routes(routes!(subject::next))
        .routes(routes!(subject::motions))
        .routes(routes!(jobs::list, jobs::add))
        .routes(routes!(jobs::rebuild))
        .routes(routes!(jobs::get))
        .routes(routes!(jobs::cancel))
        .routes(routes!(jobs::retry))
        .routes(routes!(jobs::log))
        .routes(routes!(events::events))
        .routes(routes!(devices::devices))
        .routes(routes!(capture::now, capture::open))
        .routes(routes!(capture::start))
        .routes(routes!(capture::stop))
        .routes(routes!(capture::accept))
        .routes(routes!(capture::retake))
        .routes(routes!(capture::discard))
        .routes(routes!(capture::live))
        .routes(routes!(session::login))
        .routes(routes!(metrics::metrics))
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .merge(edits)
        .split_for_parts();
    describe(&mut document);
    // A wildcard is written otherwise there than in a description.
    (router.route("/api/subjects/{id}/files/{*way}", get(files::file)), document)
}

/// What every address has in common.
fn describe(document: &mut Document) {
    let (way, item) = files_path();
    document.paths.paths.insert(way, item);
    for item in document.paths.paths.values_mut() {
        let all = [&mut item.get, &mut item.put, &mut item.post, &mut item.delete];
        all.into_iter().flatten().for_each(add_common_refusals);
    }
    let cookie = security::SecurityScheme::ApiKey(security::ApiKey::Cookie(security::ApiKeyValue::new("toile")));
    document.components.get_or_insert_with(Default::default).add_security_scheme("token", cookie);
}

/// What every request may be refused with.
fn add_common_refusals(operation: &mut Operation) {
    let told = || Content::new(Some(Ref::from_schema_name("Told")));
    let refusal = |why: &str| ResponseBuilder::new().description(why).content("application/json", told()).build();
    let all = [
        ("401", "The token is missing or wrong"),
        ("403", "A page from elsewhere asks, or the service is called by a name that is not its own"),
        ("429", "There are too many requests"),
    ];
    let responses = &mut operation.responses.responses;
    for (status, why) in all {
        responses.entry(status.into()).or_insert_with(|| refusal(why).into());
    }
    if operation.parameters.is_some() {
        responses.entry("400".into()).or_insert_with(|| refusal("A part of the address cannot be read").into());
    }
}

fn files_path() -> (String, utoipa::openapi::PathItem) {
    #[derive(OpenApi)]
    #[openapi(paths(files::file))]
    struct Files;
    let mut paths = Files::openapi().paths.paths;
    paths.pop_first().unwrap_or_default()
}

/// The description of all addresses: OpenAPI 3.1.
pub fn description() -> Document {
    routes().1
}

/// All addresses of a service, behind the checks that every request passes: rate, name, origin, token.
pub fn app(service: Service) -> Router {
    let (router, document) = routes();
    let document = Arc::new(document);
    router
        .route("/api/openapi.json", get(move || async move { Json((*document).clone()) }))
        .fallback(page)
        .method_not_allowed_fallback(|| async {
            Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "this address does not take that method")
        })
        .layer(from_fn_with_state((service.clone(), Arc::new(Common::default())), guard))
        .with_state(service)
}

/// The console, for every address that is not the API's.
async fn page(State(service): State<Service>, method: Method, uri: Uri, headers: HeaderMap) -> Response {
    if uri.path().starts_with("/api/") {
        return Refusal::missing("there is no such address; /api/openapi.json lists all").into_response();
    }
    if method != Method::GET && method != Method::HEAD {
        return Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "this address is only read").into_response();
    }
    let token = uri.query().and_then(|query| query.split('&').find_map(|pair| pair.strip_prefix("token=")));
    if let (Some(token), "/") = (token, uri.path())
        && let Ok(cookie) = service.access.cookie(token)
        && let Ok(cookie) = HeaderValue::from_str(&cookie)
    {
        let headers = [(header::SET_COOKIE, cookie), (header::LOCATION, HeaderValue::from_static("/"))];
        return (StatusCode::SEE_OTHER, headers).into_response();
    }
    console::file(uri.path(), &headers)
}

/// The checks that every request passes, and the headers that every answer gets.
async fn guard(
    State((service, common)): State<(Service, Arc<Common>)>,
    share: Option<Extension<Arc<Share>>>,
    request: Request,
    next: Next,
) -> Response {
    service.metrics.requests.fetch_add(1, Ordering::Relaxed);
    let is_secret = request.uri().path().starts_with("/api/") && request.uri().path() != "/api/login"
        || request.uri().path() == "/metrics";
    let mut answer = if !common.lets(share.as_ref().map(|share| &*share.0)) {
        service.metrics.too_many.fetch_add(1, Ordering::Relaxed);
        Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too many requests; wait a second").into_response()
    } else if let Err(refusal) = service.access.check_origin(request.method(), request.headers()) {
        tracing::warn!("refused {} {}: {}", request.method(), request.uri().path(), refusal.sentence);
        refusal.into_response()
    } else if let Err(refusal) = if is_secret { service.access.check_token(request.headers()) } else { Ok(()) } {
        refusal.into_response()
    } else {
        sentence(next.run(request).await)
    };
    let count = match answer.status() {
        status if status.is_client_error() => Some(&service.metrics.refused),
        status if status.is_server_error() => Some(&service.metrics.failed),
        _ => None,
    };
    if let Some(count) = count {
        count.fetch_add(1, Ordering::Relaxed);
    }
    protect(answer.headers_mut());
    answer
}

/// A refusal of the framework itself, such as of a number that is none, as one sentence in JSON.
fn sentence(answer: Response) -> Response {
    let is_text =
        answer.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind.as_bytes().starts_with(b"text/plain"));
    if !(answer.status().is_client_error() && is_text) {
        return answer;
    }
    let sentence = match answer.status() {
        StatusCode::PAYLOAD_TOO_LARGE => "the body is larger than what this address takes",
        StatusCode::NOT_FOUND => "there is no such address",
        _ => "a part of the address or the query cannot be read; /api/openapi.json says what belongs there",
    };
    Refusal::new(answer.status(), sentence).into_response()
}

/// Nothing from elsewhere may be loaded by our pages, nor our answers by pages from elsewhere.
fn protect(headers: &mut HeaderMap) {
    let all = [
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
        ("referrer-policy", "no-referrer"),
        ("x-content-type-options", "nosniff"),
        ("permissions-policy", "camera=(), geolocation=(), microphone=(self), fullscreen=(self)"),
    ];
    for (name, value) in all {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(console::POLICY));
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
}
