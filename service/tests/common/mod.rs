//! A service on a temporary archive, asked without a server.

#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::missing_panics_doc)] // each test file uses a part of it

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use axum::{
    Router,
    body::Body,
    http::{Method, Request, StatusCode},
};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use toile_service::{Access, Service, app};
use tower::ServiceExt;

pub struct Asked {
    pub service: Service,
    pub app: Router,
    pub root: PathBuf,
    _dir: tempfile::TempDir,
}

/// An answer: status, headers, body.
pub struct Answer {
    pub status: StatusCode,
    pub headers: axum::http::HeaderMap,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&self.body)))
    }

    /// The sentence of a refusal.
    pub fn sentence(&self) -> String {
        self.json()["error"].as_str().unwrap_or_else(|| panic!("no sentence")).to_string()
    }
}

impl Asked {
    pub fn new() -> Self {
        Self::with(Access::loopback())
    }

    pub fn with(access: Access) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("archive");
        let service = Service::open(&root, access).unwrap();
        Self { app: app(service.clone()), service, root, _dir: dir }
    }

    pub async fn ask(&self, request: Request<Body>) -> Answer {
        let answer = self.app.clone().oneshot(request).await.unwrap();
        let (status, headers) = (answer.status(), answer.headers().clone());
        let body = answer.into_body().collect().await.unwrap().to_bytes().to_vec();
        Answer { status, headers, body }
    }

    pub async fn get(&self, path: &str) -> Answer {
        self.ask(request(Method::GET, path).body(Body::empty()).unwrap()).await
    }

    pub async fn send(&self, method: Method, path: &str, body: &Value) -> Answer {
        let request = request(method, path).header("content-type", "application/json");
        self.ask(request.body(Body::from(body.to_string())).unwrap()).await
    }

    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        self.send(Method::POST, path, body).await
    }

    /// A post without a body.
    pub async fn press(&self, path: &str) -> Answer {
        self.ask(request(Method::POST, path).body(Body::empty()).unwrap()).await
    }

    pub async fn create(&self, id: &str) -> PathBuf {
        let made = self.post("/api/subjects", &json!({ "id": id })).await;
        assert_eq!(made.status, StatusCode::CREATED, "{}", String::from_utf8_lossy(&made.body));
        self.root.join(id)
    }

    /// Asks again until `is_so`, at most half a minute.
    pub async fn until(&self, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let value = self.get(path).await.json();
            if is_so(&value) {
                return value;
            }
            assert!(began.elapsed() < Duration::from_secs(30), "{path}: {value}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

pub fn request(method: Method, path: &str) -> axum::http::request::Builder {
    Request::builder().method(method).uri(path).header("host", "localhost:8717")
}
