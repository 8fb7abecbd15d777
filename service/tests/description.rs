//! Requests made from the description itself, sound and spoilt: none may be answered with 5xx, or with a status that the
//! description does not have.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use axum::{body::Body, http::Method};
use common::{Asked, request};
use serde_json::{Value, json};
use toile_capture::{DepthImage, DeviceIdentity, Frame, Recorder, RecorderOptions, Rig, Sensor};
use toile_geometry::{Rigid, camera::PinholeCamera};

/// Requests a run.
const REQUESTS: usize = 1500;

/// A small generator of numbers (xorshift): the same requests in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

const WORDS: [&str; 16] = [
    "anna",
    "body",
    "0",
    "1",
    "-1",
    "99999999999999999999",
    "",
    "..",
    "%2e%2e",
    "%00",
    "%FF",
    "a b",
    "\u{e4}",
    "null",
    "1.jpg",
    "walk",
];

const QUERIES: [&str; 6] = ["?what=colour", "?what=x", "?sensor=9", "?sensor=-1", "?download=1", "?%FF=%FF"];

/// A value of a schema, or now and then something else.
fn value(random: &mut Random, schema: &Value, all: &Value) -> Value {
    if random.below(8) == 0 {
        let wild = [Value::Null, json!(-1), json!(1e300), json!("x".repeat(300)), json!([]), json!({}), json!(true)];
        return random.one(&wild).clone();
    }
    if let Some(name) = schema["$ref"].as_str() {
        return value(random, &all["components"]["schemas"][name.rsplit('/').next().unwrap()], all);
    }
    if let Some(of) = schema["oneOf"].as_array().or(schema["anyOf"].as_array()).or(schema["allOf"].as_array()) {
        let chosen = random.one(of).clone();
        return value(random, &chosen, all);
    }
    if let Some(of) = schema["enum"].as_array() {
        return random.one(of).clone();
    }
    let kind = schema["type"].as_str().or(schema["type"].as_array().and_then(|kinds| kinds[0].as_str()));
    match kind {
        Some("string") => json!(random.one(&WORDS)),
        Some("integer") => json!(random.below(4)),
        Some("number") => json!(random.below(100) as f64 / 7.0),
        Some("boolean") => json!(random.below(2) == 0),
        Some("array") => (0..random.below(3)).map(|_| value(random, &schema["items"], all)).collect(),
        Some("object") => {
            let fields = schema["properties"].as_object().cloned().unwrap_or_default();
            let kept: Vec<_> = fields.into_iter().filter(|_| random.below(5) > 0).collect();
            kept.into_iter()
                .map(|(name, field)| (name, value(random, &field, all)))
                .collect::<serde_json::Map<_, _>>()
                .into()
        }
        _ => json!({ "version": 1, "strokes": [{ "mark": "belongs", "points": [[0, 1, 0]], "radius": 0.01 }] }),
    }
}

/// A subject with one frame of a take.
fn add_take(root: &std::path::Path) {
    let sensor = Sensor {
        name: "front".into(),
        identity: DeviceIdentity::default(),
        depth: PinholeCamera::ideal(2, 1, 2.0, 2.0, 0.5, 0.0),
        depth_scale: 0.001,
        color: None,
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: 30.0,
    };
    let path = root.join("takes/00-body.mcap");
    let mut recorder = Recorder::create(&path, &Rig { sensors: vec![sensor] }, RecorderOptions::default()).unwrap();
    let depth = Some(DepthImage { width: 2, height: 1, values: vec![1500, 0] }.into());
    let times = (1_000_000, 2_000_000);
    let frame = Frame {
        sensor: 0,
        index: 0,
        device_frame: 0,
        lost_before: 0,
        device_time_ns: times.0,
        host_time_ns: times.1,
        depth,
        color: None,
    };
    recorder.write(&frame).unwrap();
    recorder.finish().unwrap();
}

#[tokio::test]
async fn requests_made_from_the_description_get_answers_that_it_has() {
    let asked = Asked::new();
    let root = asked.create("anna").await;
    add_take(&root);
    assert_eq!(asked.get("/api/subjects/anna").await.json()["takes"][0]["frames"], 1);
    assert_eq!(asked.get("/api/subjects/anna/takes/0/frames/0.jpg").await.headers["content-type"], "image/jpeg");
    let all = asked.get("/api/openapi.json").await.json();
    let mut operations = Vec::new();
    for (path, item) in all["paths"].as_object().unwrap() {
        // Events and live pictures do not end by themselves.
        if path.ends_with("/events") || path.ends_with("/live") {
            continue;
        }
        for method in ["get", "put", "post", "delete"].into_iter().filter(|method| item[*method].is_object()) {
            operations.push((path.clone(), method, item[method].clone()));
        }
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..REQUESTS {
        let (path, method, operation) = random.one(&operations).clone();
        let mut way = path.clone();
        while let (Some(from), Some(to)) = (way.find('{'), way.find('}')) {
            let name = way[from + 1..to].to_string();
            let word = if random.below(3) > 0 && name == "id" { "anna" } else { random.one(&WORDS) };
            let word = if word.is_empty() { "x" } else { word };
            way.replace_range(from..=to, &word.replace(' ', "%20").replace('\u{e4}', "%C3%A4"));
        }
        if random.below(4) == 0 {
            way.push_str(random.one::<&str>(&QUERIES));
        }
        let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
        let body = value(&mut random, schema, &all);
        let verb = Method::from_bytes(method.to_ascii_uppercase().as_bytes()).unwrap();
        let mut sent = request(verb, &way);
        if random.below(10) > 0 {
            sent = sent.header("content-type", "application/json");
        }
        let answer = asked.ask(sent.body(Body::from(body.to_string())).unwrap()).await;
        let status = answer.status.as_u16();
        if status == 429 {
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
        seen.insert((path.clone(), status));
        assert!(status < 500, "{method} {way} {body}: {status} {}", String::from_utf8_lossy(&answer.body));
        assert!(
            operation["responses"][status.to_string()].is_object(),
            "{method} {way} {body}: {status} is not in the description: {}",
            String::from_utf8_lossy(&answer.body)
        );
    }
    assert!(seen.len() > 50, "{}", seen.len());
}
