//! The addresses, asked as a page would.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::fs;

use axum::{
    body::Body,
    http::{Method, StatusCode},
};
use common::{Asked, request};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use toile_capture::SubjectLock;
use tower::ServiceExt;

#[tokio::test]
async fn subjects_are_created_listed_removed_and_brought_back() {
    let asked = Asked::new();
    let made = asked.post("/api/subjects", &json!({ "id": "anna", "name": "Anna B." })).await;
    assert_eq!((made.status, made.json()["state"].as_str()), (StatusCode::CREATED, Some("empty")));
    asked.create("ben").await;
    let again = asked.post("/api/subjects", &json!({ "id": "anna" })).await;
    assert_eq!(again.status, StatusCode::CONFLICT);
    for id in ["", "..", "a/b", ".toile", "a b"] {
        let refused = asked.post("/api/subjects", &json!({ "id": id })).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{id}");
    }
    let list = asked.get("/api/archive").await.json();
    let names: Vec<&str> = list["subjects"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!((list["name"].as_str(), names), (Some("archive"), vec!["Anna B.", "ben"]));
    let removed = asked.send(Method::DELETE, "/api/subjects/anna", &Value::Null).await.json();
    assert_eq!(asked.get("/api/subjects/anna").await.status, StatusCode::NOT_FOUND);
    assert_eq!(asked.get("/api/bin").await.json()[0]["name"], "Anna B.");
    let undo = removed["undo"].as_str().unwrap();
    let back = asked.press(&format!("/api/bin/{undo}/restore")).await;
    assert_eq!((back.status, back.json()["id"].as_str()), (StatusCode::OK, Some("anna")));
    assert_eq!(asked.press(&format!("/api/bin/{undo}/restore")).await.status, StatusCode::NOT_FOUND);
}

#[tokio::test]
async fn a_subject_is_told_with_its_files_and_what_could_be_next() {
    let asked = Asked::new();
    let path = asked.create("anna").await;
    fs::create_dir_all(path.join("build/00-body")).unwrap();
    fs::write(path.join("build/00-body/scan.ply"), "ply").unwrap();
    let anna = asked.get("/api/subjects/anna").await.json();
    assert_eq!(anna["files"], json!(["build/00-body/scan.ply", "subject.toml"]));
    assert_eq!((anna["takes"].clone(), anna["stature_m"].clone()), (json!([]), Value::Null));
    let next = asked.get("/api/subjects/anna/next").await.json();
    assert_eq!((next["layer"].clone(), next["name"].clone()), (json!(0), json!("body")));
    assert_eq!(asked.get("/api/motions").await.json()[0]["name"], "walk");
    assert_eq!(asked.get("/api/subjects/anna/picture").await.status, StatusCode::NOT_FOUND);
    assert_eq!(asked.get("/api/subjects/anna/takes/0/frames/0").await.status, StatusCode::NOT_FOUND);
    assert_eq!(asked.get("/api/subjects/anna/layers/1/edit").await.status, StatusCode::NOT_FOUND);
}

#[tokio::test]
async fn files_are_given_whole_in_part_or_not_at_all() {
    let asked = Asked::new();
    let path = asked.create("anna").await;
    fs::write(path.join("avatar.glb"), "0123456789").unwrap();
    let whole = asked.get("/api/subjects/anna/files/avatar.glb").await;
    assert_eq!((whole.status, whole.body.as_slice()), (StatusCode::OK, &b"0123456789"[..]));
    assert_eq!(whole.headers["content-type"], "model/gltf-binary");
    let with = |name: &'static str, value: String| {
        request(Method::GET, "/api/subjects/anna/files/avatar.glb").header(name, value).body(Body::empty()).unwrap()
    };
    let tag = whole.headers["etag"].to_str().unwrap().to_string();
    assert_eq!(asked.ask(with("if-none-match", tag)).await.status, StatusCode::NOT_MODIFIED);
    let part = asked.ask(with("range", "bytes=2-4".into())).await;
    assert_eq!((part.status, part.body.as_slice()), (StatusCode::PARTIAL_CONTENT, &b"234"[..]));
    assert_eq!(part.headers["content-range"], "bytes 2-4/10");
    assert_eq!(asked.ask(with("range", "bytes=20-".into())).await.status, StatusCode::RANGE_NOT_SATISFIABLE);
    let kept = asked.get("/api/subjects/anna/files/avatar.glb?download=1").await;
    assert_eq!(kept.headers["content-disposition"], "attachment; filename=\"avatar.glb\"");
    fs::write(path.join("report.html"), "<style>b{}</style>").unwrap();
    let page = asked.get("/api/subjects/anna/files/report.html").await;
    assert!(page.headers["content-security-policy"].to_str().unwrap().contains("sandbox"));
}

#[tokio::test]
async fn no_way_leads_out_of_the_archive() {
    let asked = Asked::new();
    let path = asked.create("anna").await;
    let outside = asked.root.parent().unwrap().join("secret");
    fs::write(&outside, "secret").unwrap();
    std::os::unix::fs::symlink(&outside, path.join("link.ply")).unwrap();
    std::os::unix::fs::symlink(asked.root.parent().unwrap(), path.join("up")).unwrap();
    std::os::unix::fs::symlink(&path, asked.root.join("alias")).unwrap();
    for way in [
        "/api/subjects/anna/files/../../secret",
        "/api/subjects/anna/files/%2e%2e/%2e%2e/secret",
        "/api/subjects/anna/files/..%2f..%2fsecret",
        "/api/subjects/anna/files/build/%2e%2e/%2e%2e/%2e%2e/secret",
        "/api/subjects/anna/files//etc/passwd",
        "/api/subjects/anna/files/%2fetc%2fpasswd",
        "/api/subjects/anna/files/link.ply",
        "/api/subjects/anna/files/up/secret",
        "/api/subjects/anna/files/subject.toml%00",
        "/api/subjects/alias/files/subject.toml",
        "/api/subjects/../files/secret",
        "/api/subjects/%2e%2e/files/secret",
        "/api/subjects/.toile/files/jobs.sqlite",
        "/../secret",
        "/assets/%2e%2e/%2e%2e/secret",
    ] {
        let answer = asked.get(way).await;
        assert!(answer.status.is_client_error(), "{way}: {}", answer.status);
        assert!(!answer.body.windows(6).any(|w| w == b"secret" || w == b"root:x"), "{way}");
    }
}

#[tokio::test]
async fn what_others_hold_is_told_as_busy() {
    let asked = Asked::new();
    let path = asked.create("anna").await;
    let lock = SubjectLock::acquire(&path).unwrap();
    assert_eq!(asked.get("/api/archive").await.json()["subjects"][0]["state"], "busy");
    let job = asked.post("/api/jobs", &json!({ "kind": "process", "subject": "anna" })).await;
    assert_eq!(job.status, StatusCode::CONFLICT);
    assert!(job.sentence().contains("another toile is writing here"), "{}", job.sentence());
    assert_eq!(asked.send(Method::DELETE, "/api/subjects/anna", &Value::Null).await.status, StatusCode::CONFLICT);
    let capture = json!({ "device": "virtual", "subject": "anna", "name": "body" });
    assert_eq!(asked.post("/api/capture", &capture).await.status, StatusCode::CONFLICT);
    drop(lock);
    assert_eq!(asked.get("/api/archive").await.json()["subjects"][0]["state"], "empty");
}

#[tokio::test]
async fn jobs_run_fail_in_words_and_are_tried_again() {
    let asked = Asked::new();
    asked.create("anna").await;
    let job = asked.post("/api/jobs", &json!({ "kind": "process", "subject": "anna", "options": {} })).await;
    assert_eq!(job.status, StatusCode::ACCEPTED);
    let over = |job: &Value| ["done", "failed", "cancelled"].contains(&job["state"].as_str().unwrap());
    let failed = asked.until("/api/jobs/1", over).await;
    assert_eq!((failed["state"].as_str(), failed["attempt"].as_u64()), (Some("failed"), Some(1)));
    assert!(failed["error"].as_str().unwrap().contains("has no take yet"), "{failed}");
    assert_eq!(asked.get("/api/archive").await.json()["subjects"][0]["state"], "failed");
    let log = asked.get("/api/jobs/1/log").await;
    assert!(String::from_utf8(log.body).unwrap().contains("failed: "));
    assert_eq!(asked.press("/api/jobs/1/cancel").await.status, StatusCode::CONFLICT);
    assert_eq!(asked.press("/api/jobs/1/retry").await.status, StatusCode::ACCEPTED);
    let again = asked.until("/api/jobs/1", over).await;
    assert_eq!((again["state"].as_str(), again["attempt"].as_u64()), (Some("failed"), Some(2)));
    for (body, status) in [
        (json!({ "kind": "process", "subject": "nobody" }), 404),
        (json!({ "kind": "bake", "subject": "anna" }), 422),
        (json!({ "kind": "rebuild", "subject": "anna" }), 422),
        (json!({ "kind": "animate", "subject": "anna", "options": { "fps": 0 } }), 422),
        (json!({ "kind": "process", "subject": "anna", "options": { "colour": 1 } }), 422),
    ] {
        assert_eq!(asked.post("/api/jobs", &body).await.status.as_u16(), status, "{body}");
    }
    assert_eq!(asked.get("/api/jobs/99").await.status, StatusCode::NOT_FOUND);
    let metrics = String::from_utf8(asked.get("/metrics").await.body).unwrap();
    assert!(metrics.contains("toile_jobs{state=\"failed\"} 1"), "{metrics}");
}

#[tokio::test]
async fn events_say_hello_and_what_happens() {
    let asked = Asked::new();
    let events = request(Method::GET, "/api/events").body(Body::empty()).unwrap();
    let mut events = asked.app.clone().oneshot(events).await.unwrap().into_body();
    asked.create("anna").await;
    asked.post("/api/jobs", &json!({ "kind": "process", "subject": "anna" })).await;
    let mut text = String::new();
    while !text.contains("\"failed\"") {
        let frame = tokio::time::timeout(std::time::Duration::from_secs(20), events.frame()).await.unwrap();
        text.push_str(&String::from_utf8_lossy(frame.unwrap().unwrap().data_ref().unwrap()));
    }
    let events: Vec<Value> =
        text.lines().filter_map(|l| l.strip_prefix("data: ")).map(|l| serde_json::from_str(l).unwrap()).collect();
    assert!(events[0]["hello"]["version"].is_string() && events[1]["capture"]["state"] == "idle", "{events:?}");
    assert!(events.contains(&json!({ "archive": "changed" })));
    assert!(events.iter().any(|e| e["job"]["state"] == "running"), "{events:?}");
    assert!(events.iter().all(|e| e.as_object().unwrap().len() == 1));
}

#[tokio::test]
async fn edits_of_the_body_are_checked_and_kept() {
    let asked = Asked::new();
    let path = asked.create("anna").await;
    fs::create_dir(path.join("takes")).unwrap();
    fs::write(path.join("takes/00-body.mcap"), "").unwrap();
    let way = "/api/subjects/anna/layers/0/edit";
    let empty = asked.get(way).await;
    assert_eq!(empty.json(), json!({ "version": 1, "landmarks": {} }));
    let given = json!({ "version": 1, "landmarks": { "navel": [0.0, 1.0, 0.1] } });
    assert_eq!(asked.send(Method::PUT, way, &given).await.json(), given);
    let kept: Value = serde_json::from_str(&fs::read_to_string(path.join("edits/body.json")).unwrap()).unwrap();
    assert_eq!(kept, given);
    let wrong = asked.send(Method::PUT, way, &json!({ "version": 1, "landmark": {} })).await;
    assert_eq!(wrong.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", wrong.sentence());
    let stale = request(Method::PUT, way)
        .header("content-type", "application/json")
        .header("if-match", empty.headers["etag"].clone());
    let stale = asked.ask(stale.body(Body::from(given.to_string())).unwrap()).await;
    assert_eq!(stale.status, StatusCode::PRECONDITION_FAILED);
    let nothing = json!({ "version": 1, "landmarks": {} });
    assert_eq!(asked.send(Method::PUT, way, &nothing).await.json(), nothing);
    assert!(!path.join("edits/body.json").exists());
}

#[tokio::test]
async fn a_description_of_every_address_is_given() {
    let asked = Asked::new();
    let description = asked.get("/api/openapi.json").await.json();
    assert!(description["openapi"].as_str().unwrap().starts_with("3.1"));
    let paths = description["paths"].as_object().unwrap();
    assert!(paths.len() >= 25 && paths.contains_key("/api/subjects/{id}/files/{way}"), "{:?}", paths.keys());
    let all = paths.values().flat_map(|path| path.as_object().unwrap().iter());
    for (method, told) in all.filter(|(method, _)| ["get", "put", "post", "delete"].contains(&method.as_str())) {
        assert!(told["summary"].is_string() && told["responses"].is_object(), "{method}: {told}");
    }
}
