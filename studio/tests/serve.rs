//! `toile serve`: its address, what it refuses to begin with, and what is left when it is killed.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use common::{exits, toile};
use serde_json::{Value, json};
use toile_capture::Replay;

/// A running service, killed at the end.
struct Served {
    child: Child,
    host: String,
}

impl Served {
    fn start(archive: &Path) -> Self {
        let mut command = toile();
        command.arg("serve").arg(archive).args(["--port", "0"]).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let host = line.trim().strip_prefix("http://").unwrap().strip_suffix('/').unwrap().to_string();
        Self { child, host }
    }

    /// The status and body of an answer.
    fn ask(&self, method: &str, path: &str, body: &Value) -> (u16, Value) {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let (host, body) = (&self.host, if body.is_null() { String::new() } else { body.to_string() });
        let kind = if body.is_empty() { "" } else { "content-type: application/json\r\n" };
        let head = format!("{method} {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n{kind}");
        write!(stream, "{head}content-length: {}\r\n\r\n{body}", body.len()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, serde_json::from_str(body).unwrap_or(Value::Null))
    }

    fn post(&self, path: &str, body: &Value) -> Value {
        let (status, value) = self.ask("POST", path, body);
        assert!(status < 300, "{path}: {status} {value}");
        value
    }

    fn until(&self, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let value = self.ask("GET", path, &Value::Null).1;
            if is_so(&value) {
                return value;
            }
            assert!(began.elapsed() < Duration::from_mins(2), "{path}: {value}");
            sleep(Duration::from_millis(50));
        }
    }

    fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

#[test]
fn what_cannot_be_served_is_told_in_one_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let archive = dir.path().join("archive");
    let served = Served::start(&archive);
    let refused = |code: i32, args: &[&str]| {
        let told = exits(code, toile().arg("serve").args(args));
        told["error"]["message"].as_str().unwrap().to_string()
    };
    let archive = archive.to_str().unwrap();
    assert!(refused(1, &[archive, "--port", "0"]).contains("another `toile serve` works on this archive"));
    let port = served.host.rsplit_once(':').unwrap().1;
    let other = dir.path().join("other");
    assert!(refused(1, &[other.to_str().unwrap(), "--port", port]).contains("another program listens on this port"));
    let file = dir.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(refused(1, &[file.to_str().unwrap(), "--port", "0"]).contains("is not a folder"));
    let tls = ["--port", "0", "--tls-cert", file.to_str().unwrap(), "--tls-key", file.to_str().unwrap()];
    assert!(refused(1, &[&[other.to_str().unwrap()], &tls[..]].concat()).contains("PEM"));
    assert!(refused(1, &[other.to_str().unwrap(), "--listen", "203.0.113.1"]).contains("does not have this address"));
}

#[test]
fn a_killed_recording_is_whole_up_to_its_last_chunk_and_the_service_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let archive = dir.path().join("archive");
    let served = Served::start(&archive);
    served.post("/api/subjects", &json!({ "id": "anna" }));
    let capture = json!({ "device": "virtual", "subject": "anna", "name": "body" });
    served.post("/api/capture", &capture);
    served.until("/api/capture", |now| now["state"] == "preview");
    served.post("/api/capture/start", &Value::Null);
    // Long enough for a chunk to be whole.
    served.until("/api/capture", |now| now["frames"].as_u64() > Some(150));
    served.kill();
    let part = archive.join("anna/takes/00-body.mcap.part");
    let frames = Replay::open(&part).unwrap().len();
    assert!(frames > 20, "{frames} frames");
    let served = Served::start(&archive);
    assert_eq!(served.ask("GET", "/api/capture", &Value::Null).1["state"], "idle");
    let anna = served.ask("GET", "/api/subjects/anna", &Value::Null).1;
    assert!(anna["notices"][0]["text"].as_str().unwrap().contains("interrupted"), "{anna}");
    // The next take of the same layer keeps what was left.
    served.post("/api/capture", &capture);
    served.until("/api/capture", |now| now["state"] == "preview");
    served.post("/api/capture/start", &Value::Null);
    served.until("/api/capture", |now| now["frames"].as_u64() > Some(30));
    served.post("/api/capture/stop", &Value::Null);
    let review = served.until("/api/capture", |now| now["state"] == "review");
    assert_eq!((review["dropped"].as_u64(), review["take_file"].as_str()), (Some(0), Some("takes/00-body.mcap")));
    served.post("/api/capture/accept", &json!({}));
    let anna = served.ask("GET", "/api/subjects/anna", &Value::Null).1;
    assert!(anna["takes"][0]["frames"].as_u64() > Some(29) && anna["takes"][0]["state"] == "ok", "{anna}");
    assert!(Replay::open(&archive.join("anna/takes/00-body.mcap.part.1")).unwrap().len() == frames);
}

#[test]
fn a_killed_job_begins_again_and_a_cancelled_one_ends() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("rowan");
    let recorded = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recorded/rowan");
    fs::create_dir_all(subject.join("takes")).unwrap();
    fs::copy(recorded.join("subject.toml"), subject.join("subject.toml")).unwrap();
    for take in fs::read_dir(recorded.join("takes")).unwrap().flatten() {
        fs::copy(take.path(), subject.join("takes").join(take.file_name())).unwrap();
    }
    let served = Served::start(dir.path());
    served.post("/api/jobs", &json!({ "kind": "process", "subject": "rowan" }));
    served.until("/api/jobs/1", |job| job["step"].is_string());
    // The command line is told that the subject is busy.
    let busy = exits(1, toile().arg("fuse").arg(&subject));
    assert!(busy["error"]["message"].as_str().unwrap().contains("another toile is writing here"), "{busy}");
    served.kill();
    let served = Served::start(dir.path());
    served.until("/api/jobs/1", |job| job["attempt"] == 2 && job["step"].is_string());
    served.post("/api/jobs/1/cancel", &Value::Null);
    served.until("/api/jobs/1", |job| job["state"] == "cancelled");
    assert_eq!(served.ask("GET", "/api/archive", &Value::Null).1["subjects"][0]["state"], "recorded");
}
