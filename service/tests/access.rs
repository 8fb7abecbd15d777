//! Who may ask: pages from elsewhere, wrong names, missing tokens, too much.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use axum::{
    body::Body,
    http::{Method, Request, StatusCode},
};
use common::{Asked, request};
use serde_json::json;
use toile_service::Access;

#[tokio::test]
async fn a_page_from_elsewhere_can_neither_read_nor_start_anything() {
    let asked = Asked::new();
    asked.create("anna").await;
    let body = json!({ "kind": "process", "subject": "anna" }).to_string();
    for (name, value) in [
        ("origin", "http://evil.example"),
        ("origin", "null"),
        ("origin", "http://localhost:1"),
        ("sec-fetch-site", "cross-site"),
        ("sec-fetch-site", "same-site"),
    ] {
        for (method, path) in [
            (Method::GET, "/api/archive"),
            (Method::POST, "/api/jobs"),
            (Method::DELETE, "/api/subjects/anna"),
            (Method::GET, "/api/events"),
            (Method::GET, "/api/capture/live"),
            (Method::GET, "/api/subjects/anna/files/subject.toml"),
            (Method::GET, "/metrics"),
        ] {
            let wrong = request(method, path).header("content-type", "application/json").header(name, value);
            let answer = asked.ask(wrong.body(Body::from(body.clone())).unwrap()).await;
            assert_eq!(answer.status, StatusCode::FORBIDDEN, "{path} {name}: {value}");
        }
    }
    // A form of a page from elsewhere that sends no origin still cannot say that it is JSON.
    let form = request(Method::POST, "/api/jobs").header("content-type", "text/plain");
    let answer = asked.ask(form.body(Body::from(body)).unwrap()).await;
    assert_eq!(answer.status, StatusCode::UNSUPPORTED_MEDIA_TYPE);
    for host in ["evil.example:8717", "192.168.0.9:8717", "localhost.evil.example"] {
        let wrong = Request::builder().uri("/api/archive").header("host", host).body(Body::empty()).unwrap();
        assert_eq!(asked.ask(wrong).await.status, StatusCode::FORBIDDEN, "{host}");
    }
    let none = Request::builder().uri("/api/archive").body(Body::empty()).unwrap();
    assert_eq!(asked.ask(none).await.status, StatusCode::FORBIDDEN);
}

#[tokio::test]
async fn with_a_token_the_page_is_readable_and_everything_else_is_not() {
    let asked = Asked::with(Access::with_token("s3cret".into(), Vec::new(), false));
    assert_eq!(asked.get("/").await.status, StatusCode::OK);
    for path in ["/api/archive", "/api/events", "/api/capture/live", "/metrics", "/api/openapi.json"] {
        assert_eq!(asked.get(path).await.status, StatusCode::UNAUTHORIZED, "{path}");
    }
    let wrong = asked.post("/api/login", &json!({ "token": "guess" })).await;
    assert_eq!(wrong.status, StatusCode::UNAUTHORIZED);
    let right = asked.post("/api/login", &json!({ "token": "s3cret" })).await;
    assert_eq!(right.status, StatusCode::NO_CONTENT);
    let cookie = right.headers["set-cookie"].to_str().unwrap();
    assert!(cookie.contains("SameSite=Strict") && cookie.contains("HttpOnly"), "{cookie}");
    let shown = request(Method::GET, "/api/archive").header("cookie", cookie.split(';').next().unwrap());
    assert_eq!(asked.ask(shown.body(Body::empty()).unwrap()).await.status, StatusCode::OK);
    let visit = asked.get("/?token=s3cret").await;
    assert_eq!(visit.status, StatusCode::SEE_OTHER);
    assert_eq!(visit.headers["location"], "/");
}

#[tokio::test]
async fn every_answer_forbids_what_is_not_needed() {
    let asked = Asked::new();
    for path in ["/", "/api/archive", "/api/nothing", "/nothing.js"] {
        let headers = asked.get(path).await.headers;
        let policy = headers["content-security-policy"].to_str().unwrap();
        assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
        assert_eq!(headers["x-content-type-options"], "nosniff");
        assert_eq!(headers["cross-origin-resource-policy"], "same-origin");
    }
}

#[tokio::test]
async fn bodies_and_rates_are_limited() {
    let asked = Asked::new();
    let large = request(Method::POST, "/api/subjects").header("content-type", "application/json");
    let answer = asked.ask(large.body(Body::from(vec![b' '; 1 << 20])).unwrap()).await;
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE);
    let mut refused = 0;
    for _ in 0..3000 {
        refused += u32::from(asked.get("/api/capture").await.status == StatusCode::TOO_MANY_REQUESTS);
    }
    assert!(refused > 500, "{refused}");
}

#[tokio::test]
async fn nonsense_is_refused_in_one_sentence() {
    let asked = Asked::new();
    asked.create("anna").await;
    for (method, path, status) in [
        (Method::GET, "/api/jobs/x", 400),
        (Method::GET, "/api/jobs/99999999999999999999", 400),
        (Method::GET, "/api/subjects/anna/takes/-1/frames/0", 400),
        (Method::GET, "/api/subjects/anna/takes/0/frames/0?what=sound", 400),
        (Method::GET, "/api/subjects/%FF/picture", 400),
        (Method::GET, "/api/nothing", 404),
        (Method::PUT, "/api/archive", 405),
        (Method::POST, "/", 405),
    ] {
        let answer = asked.ask(request(method, path).body(Body::empty()).unwrap()).await;
        assert_eq!(answer.status.as_u16(), status, "{path}");
        assert!(!answer.sentence().is_empty());
    }
    for body in ["", "{", "[]", "null", "{\"id\": 3}", "{\"id\": \"a\", \"x\": 1}"] {
        let answer = request(Method::POST, "/api/subjects").header("content-type", "application/json");
        let answer = asked.ask(answer.body(Body::from(body)).unwrap()).await;
        assert!([400, 422].contains(&answer.status.as_u16()), "{body}: {}", answer.status);
        assert!(!answer.sentence().contains('\n'));
    }
}
