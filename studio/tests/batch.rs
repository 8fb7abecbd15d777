//! Archives: what is stale, side by side, killed and gone on, the catalogue, packing and forgetting.
#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
    thread,
    time::Duration,
};

use common::{copy_takes, exits, files_ending, toile};
use serde_json::Value;

/// A small person, recorded once for all tests, and the same processed by `toile process` alone.
struct Small {
    dir: tempfile::TempDir,
}

impl Small {
    fn get() -> &'static Self {
        static SMALL: OnceLock<Small> = OnceLock::new();
        SMALL.get_or_init(|| {
            let small = Self { dir: tempfile::tempdir().unwrap() };
            let words = ["--seed", "3", "--frames", "30", "--garments", ""];
            exits(0, toile().args(["synthesize", "--out"]).arg(small.recorded()).args(words));
            copy_takes(&small.recorded(), &small.processed());
            exits(0, toile().arg("process").arg(small.processed()));
            small
        })
    }

    fn recorded(&self) -> PathBuf {
        self.dir.path().join("recorded")
    }

    fn processed(&self) -> PathBuf {
        self.dir.path().join("processed")
    }
}

/// An archive of copies of the small person.
fn archive(names: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for name in names {
        copy_takes(&Small::get().recorded(), &dir.path().join(name));
    }
    dir
}

/// A copy of all files, with their times where `times`.
fn copy_all(from: &Path, to: &Path, times: bool) {
    let done = Command::new("cp").arg(if times { "-a" } else { "-r" }).arg(from).arg(to).status().unwrap();
    assert!(done.success());
}

/// The last line of the answer of a batch, and the lines before it.
fn batch(code: i32, archive: &Path, words: &[&str]) -> (Value, Vec<Value>) {
    let done = toile().arg("batch").arg(archive).args(words).arg("--json").output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert_eq!(done.status.code(), Some(code), "{out}\n{err}");
    let mut lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (lines.pop().unwrap(), lines)
}

/// Every result of a subject that must be the same to the byte, with its content.
fn results(subject: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<PathBuf> =
        ["ply", "json", "glb", "vrm", "tum", "csv"].iter().flat_map(|end| files_ending(subject, end)).collect();
    files.retain(|path| !path.ends_with("timings.json") && !path.starts_with(subject.join("truth")));
    files.sort();
    let name = |path: &PathBuf| path.strip_prefix(subject).unwrap().to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), fs::read(path).unwrap())).collect()
}

fn assert_same_results(subject: &Path) {
    let (was, is) = (results(&Small::get().processed()), results(subject));
    let names = |all: &[(String, Vec<u8>)]| all.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&is), names(&was), "{}", subject.display());
    // The name of the subject is in the avatar and in the records of what depends on it; it is the same in all copies.
    for ((name, is), (_, was)) in is.iter().zip(&was) {
        assert!(is == was, "{name} of {} differs", subject.display());
    }
}

fn standing(answer: &Value, subject: &str) -> (String, String) {
    let all = answer["results"]["subjects"].as_array().unwrap();
    let one = all.iter().find(|one| one["subject"] == subject).unwrap();
    (one["standing"].as_str().unwrap_or("-").to_string(), one["why"].to_string() + &one["left"].to_string())
}

#[test]
fn a_batch_does_what_is_stale_leaves_out_what_fails_twice_and_then_has_nothing_to_do() {
    let dir = archive(&["a", "more/b", "bad"]);
    fs::write(dir.path().join("bad/takes/00-body.mcap"), b"\x89MCAP0\r\nand nothing else").unwrap();
    let (plan, _) = batch(0, dir.path(), &["--dry-run"]);
    assert_eq!(plan["results"]["due"], 3, "{plan}");
    let (answer, events) = batch(1, dir.path(), &[]);
    let outcome = |name: &str| {
        answer["results"]["ended"].as_array().unwrap().iter().find(|e| e["subject"] == name).unwrap().clone()
    };
    assert_eq!((&outcome("a")["outcome"], &outcome("more/b")["outcome"]), (&"done".into(), &"done".into()));
    assert_eq!((&outcome("bad")["outcome"], &outcome("bad")["attempts"]), (&"failed".into(), &2.into()), "{answer}");
    assert!(events.iter().any(|event| event["event"] == "again" && event["subject"] == "bad"), "{events:?}");
    assert!(events.iter().any(|event| event["event"] == "ends" && event["seconds_left"].is_number()));
    assert_same_results(&dir.path().join("a"));
    assert_same_results(&dir.path().join("more/b"));

    let (again, _) = batch(0, dir.path(), &[]);
    assert_eq!((&again["results"]["up_to_date"], &again["results"]["left_out"]), (&2.into(), &1.into()), "{again}");
    assert!(again["warnings"].to_string().contains("bad is left out: it failed twice"), "{again}");
    let (tried, _) = batch(1, dir.path(), &["--again"]);
    assert_eq!(tried["results"]["ended"].as_array().unwrap().len(), 1);
    // It changed: it is tried again.
    fs::copy(Small::get().recorded().join("takes/00-body.mcap"), dir.path().join("bad/takes/00-body.mcap")).unwrap();
    let (mended, _) = batch(0, dir.path(), &[]);
    assert_eq!(mended["results"]["ended"][0]["outcome"], "done", "{mended}");

    let doc = exits(0, toile().arg("catalog").arg(dir.path()).args(["girths"]));
    let rows = doc["results"]["table"]["rows"].as_array().unwrap();
    assert!(rows.iter().any(|row| row[0] == "more/b" && row[1].as_str().unwrap().contains("waist")), "{doc}");
    let runs = exits(
        0,
        toile().arg("catalog").arg(dir.path()).args(["--sql", "SELECT outcome FROM runs WHERE subject = 'bad'"]),
    );
    assert_eq!(runs["results"]["table"]["rows"].as_array().unwrap().len(), 3);
}

#[test]
fn planning_sees_what_changed_and_where_the_work_begins() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["copied", "damaged", "edited", "gone", "kept", "set", "withdrawn", "emptied"] {
        copy_all(&Small::get().processed(), &dir.path().join(name), name != "copied");
    }
    let at = |name: &str| dir.path().join(name);
    fs::write(at("damaged/build/00-body/trajectory.tum"), fs::read(at("kept/build/00-body/trajectory.tum")).unwrap())
        .unwrap();
    fs::create_dir_all(at("edited/edits")).unwrap();
    fs::write(at("edited/edits/body.json"), r#"{"version": 1, "components": 12}"#).unwrap();
    fs::remove_file(at("gone/avatar.vrm")).unwrap();
    fs::write(at("set/toile.toml"), "[fit.conformation]\nrounds = 2\n").unwrap();
    fs::remove_dir_all(at("emptied/build")).unwrap();
    let toml = at("withdrawn/subject.toml");
    fs::write(&toml, format!("consent = \"withdrawn\"\n{}", fs::read_to_string(&toml).unwrap())).unwrap();
    let (plan, _) = batch(0, dir.path(), &["--dry-run"]);
    let is = |name: &str, word: &str, why: &str| {
        let (standing, told) = standing(&plan, name);
        assert!(standing == word && told.contains(why), "{name}: {standing}, {told}");
    };
    is("kept", "up-to-date", "");
    is("copied", "up-to-date", "");
    is("damaged", "stale", "trajectory.tum was written anew");
    is("edited", "stale", "edits/body.json changed");
    is("gone", "stale", "avatar.vrm is missing");
    is("set", "stale", "[fit] of its settings");
    is("withdrawn", "withheld", "consent was withdrawn");
    is("emptied", "stale", "never processed");
    let steps = |name: &str| {
        let all = plan["results"]["subjects"].as_array().unwrap();
        all.iter().find(|one| one["subject"] == name).unwrap()["steps"].to_string()
    };
    assert_eq!(steps("gone"), r#"["avatar/export","report/report"]"#);
    assert!(steps("set").starts_with(r#"["body/fit""#) && steps("damaged").starts_with(r#"["00-body/fuse""#));
    let (only, _) = batch(0, dir.path(), &["--dry-run", "--stage", "fuse"]);
    assert_eq!(only["results"]["due"], 2, "{only}");
    let (old, _) = batch(0, dir.path(), &["--dry-run", "--since-version", "0.0.1"]);
    assert_eq!(old["results"]["due"], 1, "only the one without results: {old}");
    let refused = exits(1, toile().arg("process").arg(at("withdrawn")));
    assert!(refused.to_string().contains("consent was withdrawn"), "{refused}");
}

#[test]
fn a_batch_that_is_killed_at_any_time_goes_on_and_its_processes_end_with_it() {
    let names = ["a", "b", "c"];
    let dir = archive(&names);
    for kill in 0..4u32 {
        let mut child = toile()
            .arg("batch")
            .arg(dir.path())
            .args(["--workers", "2", "--quiet"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        thread::sleep(Duration::from_millis(150 + 450 * u64::from(kill)));
        drop(child.kill());
        drop(child.wait());
    }
    // The processes of a batch that is gone hold no lock any more.
    batch(0, dir.path(), &["--wait", "5"]);
    names.iter().for_each(|name| assert_same_results(&dir.path().join(name)));
    let left = files_ending(dir.path(), ".part");
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn two_batches_on_one_archive_do_every_subject_once() {
    let names = ["a", "b", "c", "d"];
    let dir = archive(&names);
    let start = || {
        let words = ["--workers", "1", "--json"];
        let mut command = toile();
        command.arg("batch").arg(dir.path()).args(words).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().unwrap()
    };
    let both = [start(), start()].map(|child| child.wait_with_output().unwrap());
    let outcomes: Vec<String> = both
        .iter()
        .flat_map(|done| {
            let text = String::from_utf8_lossy(&done.stdout).into_owned();
            let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
            last["results"]["ended"]
                .as_array()
                .unwrap()
                .iter()
                .map(|e| e["outcome"].as_str().unwrap().to_string())
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(both.iter().all(|done| done.status.success()), "{outcomes:?}");
    assert_eq!(outcomes.iter().filter(|outcome| *outcome == "done").count(), 4, "{outcomes:?}");
    names.iter().for_each(|name| assert_same_results(&dir.path().join(name)));
    // What the other one did counts as done, and the bar never goes back.
    for done in &both {
        let shares = shares(&String::from_utf8_lossy(&done.stderr));
        assert!(shares.is_sorted() && !shares.is_empty(), "{shares:?}");
    }
}

/// The percentages that a run without a terminal told.
fn shares(said: &str) -> Vec<u32> {
    let share = |line: &str| line.strip_prefix('[')?.split_once(" %]")?.0.trim().parse().ok();
    said.lines().filter_map(share).collect()
}

#[test]
fn the_figures_of_a_running_batch_are_at_a_port_of_this_machine() {
    let dir = archive(&["a", "b"]);
    let mut command = toile();
    command.arg("batch").arg(dir.path()).args(["--workers", "1", "--json", "--metrics-port", "0"]);
    let mut running = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(running.stdout.take().unwrap()).lines();
    let first: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
    let url = first["url"].as_str().unwrap().to_string();
    let host = url.strip_prefix("http://").unwrap().strip_suffix("/metrics").unwrap();
    // It has begun with the first subject.
    lines.next().unwrap().unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    assert!(text.contains("\ntoile_batch_subjects_due 2\n"), "{text}");
    assert!(text.contains("\ntoile_batch_subjects_running 1\n"), "{text}");
    running.kill().unwrap();
    running.wait().unwrap();
}

#[test]
fn memory_decides_how_many_run_side_by_side() {
    let names = ["a", "b", "c"];
    let dir = archive(&names);
    let (answer, _) = batch(0, dir.path(), &["--workers", "3", "--memory", "100M"]);
    assert_eq!(answer["results"]["most_at_once"], 1, "{answer}");
    names.iter().for_each(|name| assert!(dir.path().join(name).join("avatar.glb").is_file()));
}

#[test]
fn a_pack_brings_everything_back_and_a_damaged_one_brings_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (archive, packs, back) = (dir.path().join("archive"), dir.path().join("packs"), dir.path().join("back"));
    fs::create_dir_all(archive.join("2026")).unwrap();
    fs::create_dir_all(&back).unwrap();
    copy_all(&Small::get().processed(), &archive.join("2026/anna"), true);
    exits(0, toile().args(["archive", "pack"]).arg(&archive).arg("--out").arg(&packs));
    let again = exits(0, toile().args(["archive", "pack"]).arg(&archive).arg("--out").arg(&packs));
    assert_eq!(again["results"][0]["was_there"], true);
    exits(0, toile().args(["archive", "unpack"]).arg(&packs).arg("--into").arg(&back));
    assert_same_results(&back.join("2026/anna"));
    let (plan, _) = batch(0, &back, &["--dry-run"]);
    assert_eq!(standing(&plan, "2026/anna").0, "up-to-date", "{plan}");
    let checked = exits(0, toile().args(["archive", "check"]).arg(&back));
    assert!(checked["results"][0]["same"].as_u64().unwrap() > 10, "{checked}");
    let ply = back.join("2026/anna/build/00-body/scan.ply");
    let mut bytes = fs::read(&ply).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 1;
    fs::write(&ply, bytes).unwrap();
    let damaged = exits(1, toile().args(["archive", "check"]).arg(&back));
    assert!(damaged["failures"].to_string().contains("scan.ply"), "{damaged}");

    let pack = packs.join("2026/anna.tar.zst");
    let whole = fs::read(&pack).unwrap();
    fs::write(&pack, &whole[..whole.len() / 2]).unwrap();
    let torn = dir.path().join("torn");
    fs::create_dir_all(&torn).unwrap();
    exits(1, toile().args(["archive", "unpack"]).arg(&packs).arg("--into").arg(&torn));
    assert!(!torn.join("2026").exists());
}

#[test]
fn a_person_who_is_forgotten_is_nowhere_and_does_not_come_back() {
    let dir = archive(&["anna", "ben"]);
    let packs = tempfile::tempdir().unwrap();
    exits(0, toile().arg("catalog").arg(dir.path()));
    exits(0, toile().args(["archive", "pack"]).arg(dir.path()).arg("--out").arg(packs.path()));
    let kept = packs.path().join("kept");
    fs::copy(packs.path().join("anna.tar.zst"), &kept).unwrap();
    exits(0, toile().args(["archive", "forget"]).arg(dir.path()).args(["anna", "--also"]).arg(packs.path()));
    assert!(!dir.path().join("anna").exists() && !packs.path().join("anna.tar.zst").exists());
    for file in files_ending(dir.path().join(".toile").as_path(), "") {
        let bytes = fs::read(&file).unwrap();
        let named = file.to_string_lossy().contains("anna") || bytes.windows(4).any(|four| four == b"anna");
        assert!(!named, "{} still names the person", file.display());
    }
    let refused = exits(1, toile().args(["archive", "unpack"]).arg(&kept).arg("--into").arg(dir.path()));
    assert!(refused["failures"].to_string().contains("was forgotten on"), "{refused}");
    copy_takes(&Small::get().recorded(), &dir.path().join("anna"));
    let (plan, _) = batch(0, dir.path(), &["--dry-run"]);
    assert!(standing(&plan, "anna").1.contains("was forgotten"), "{plan}");
    exits(1, toile().args(["archive", "forget"]).arg(dir.path()).arg("nobody"));
}

#[test]
fn what_another_version_made_different_is_told_with_pictures() {
    let dir = tempfile::tempdir().unwrap();
    let (archive, old) = (dir.path().join("archive"), dir.path().join("old"));
    fs::create_dir_all(&archive).unwrap();
    for name in ["same", "other"] {
        copy_all(&Small::get().processed(), &archive.join(name), true);
    }
    fs::write(archive.join("other/toile.toml"), "[fusion]\nvoxel_size = 0.006\n").unwrap();
    let (_, _) = batch(0, &archive, &["--keep", old.to_str().unwrap()]);
    copy_all(&archive.join("same"), &old.join("same"), true);
    let (answer, _) = batch(0, &archive, &["--compare", old.to_str().unwrap()]);
    let changes = answer["results"]["compared"].as_array().unwrap();
    assert_eq!((&changes[0]["subject"], changes.len()), (&"other".into(), 2), "{answer}");
    let body = &changes[0]["surfaces"][0];
    assert!(body["mean_mm"].as_f64().unwrap() > 0.01 && body["iou"].as_f64().unwrap() > 0.9, "{answer}");
    assert_eq!(changes[1]["surfaces"][0]["mean_mm"], 0.0);
    let page = fs::read_to_string(archive.join(".toile/compare/compare.html")).unwrap();
    assert!(
        page.contains("other.png") && !page.contains("same.png") && archive.join(".toile/compare/other.png").is_file()
    );
}
