//! Takes that do not make a good session: messages, the exit code, and the files on disk afterwards.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use common::{Recording, copy_takes, exits, files_ending, toile};

/// A synthetic subject with a body and a trousers take of few frames, made once.
fn olga() -> &'static Path {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let make = || {
        let dir = tempfile::tempdir().unwrap();
        let subject = dir.path().join("olga");
        let words = ["--garments", "trousers", "--frames", "60", "--seed", "5"];
        exits(0, toile().arg("synthesize").arg("--out").arg(&subject).args(words));
        (dir, subject)
    };
    &MADE.get_or_init(make).1
}

fn copy_of_olga() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("olga");
    copy_takes(olga(), &subject);
    (dir, subject)
}

/// Leaves the subject only its body take.
fn drop_trousers(subject: &Path) {
    fs::remove_file(subject.join("takes/01-trousers.mcap")).unwrap();
    let toml = fs::read_to_string(subject.join("subject.toml")).unwrap();
    let body = toml.split("[[layers]]").take(2).collect::<Vec<_>>().join("[[layers]]");
    fs::write(subject.join("subject.toml"), body).unwrap();
}

#[test]
fn a_take_with_nobody_in_it() {
    let recording = Recording::new(12, 12);
    exits(0, toile().args(recording.import("body")));
    let answer = exits(1, toile().arg("process").arg(recording.subject()));
    let message = answer["failures"][0].as_str().unwrap();
    assert!(message.contains("takes/00-body.mcap") && message.contains("nobody"), "{message}");
    assert!(files_ending(&recording.subject().join("build"), "scan.ply").is_empty());
}

#[test]
fn a_turn_that_is_not_full_is_a_warning() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("half");
    let words = ["--garments", "", "--frames", "36", "--degrees", "220", "--seed", "6"];
    exits(0, toile().arg("synthesize").arg("--out").arg(&subject).args(words));
    let answer = exits(0, toile().arg("fuse").arg(&subject));
    let warnings = answer["warnings"].to_string();
    assert!(warnings.contains("00-body") && warnings.contains("the turn is not full"), "{answer}");
    assert!(subject.join("build/00-body/scan.ply").is_file());
}

#[test]
fn damaged_colour_is_counted_where_a_take_is_fused() {
    let dir = tempfile::tempdir().unwrap();
    let folders = dir.path().join("half");
    let words = ["--as", "folders", "--garments", "", "--frames", "36", "--degrees", "220", "--seed", "6"];
    exits(0, toile().arg("synthesize").arg("--out").arg(&folders).args(words));
    let take = folders.join("00-body");
    let picture = take.join("color/000003.jpg");
    let whole = fs::read(&picture).unwrap();
    fs::write(&picture, &whole[..whole.len() / 2]).unwrap();
    let answer = exits(3, toile().arg("fuse").arg(&take).arg("--out").arg(dir.path().join("scan")));
    assert!(answer["lost"].to_string().contains("the colour image of 1 frames is damaged"), "{answer}");
}

#[test]
fn a_garment_take_that_shows_no_new_garment() {
    let (_dir, subject) = copy_of_olga();
    // The trousers take shows the body once more.
    fs::copy(subject.join("takes/00-body.mcap"), subject.join("takes/01-trousers.mcap")).unwrap();
    let answer = exits(1, toile().arg("process").arg(&subject));
    let message = answer["failures"].to_string();
    assert!(message.contains("takes/01-trousers.mcap") && message.contains("no new garment"), "{answer}");
    assert!(message.contains("--retake"), "{message}");
    assert_eq!(answer["results"][0]["layers"], serde_json::json!(["body"]), "the avatar is made of what there is");
    assert!(subject.join("avatar.glb").is_file() && !subject.join("build/01-trousers/garment.ply").exists());
    let page = fs::read_to_string(subject.join("report.html")).unwrap();
    assert!(page.contains("no new garment"), "the report says so too");
}

/// A subject whose takes are copies of `takes` of another one, as layers of these names and without given types.
fn session_of(from: &Path, to: &Path, takes: &[(&str, &str)]) {
    fs::create_dir_all(to.join("takes")).unwrap();
    let mut toml = String::from("name = \"eva\"\n");
    for (number, (take, name)) in takes.iter().enumerate() {
        fs::copy(from.join(format!("takes/{take}.mcap")), to.join(format!("takes/{number:02}-{name}.mcap"))).unwrap();
        toml.push_str(&format!("\n[[layers]]\nname = \"{name}\"\n"));
    }
    fs::write(to.join("subject.toml"), toml).unwrap();
}

#[test]
fn nothing_new_something_taken_off_and_two_at_once_are_said_and_the_other_takes_are_used() {
    let dir = tempfile::tempdir().unwrap();
    let made = dir.path().join("made");
    let words = ["--garments", "trousers,tshirt", "--frames", "60", "--seed", "5"];
    exits(0, toile().arg("synthesize").arg("--out").arg(&made).args(words));

    let eva = dir.path().join("eva");
    let (bare, dressed) = ("00-body", "02-tshirt");
    session_of(&made, &eva, &[(bare, "body"), (bare, "again"), (dressed, "both"), (bare, "less")]);
    let answer = exits(1, toile().arg("process").arg(&eva));
    let failures: Vec<&str> = answer["failures"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    assert_eq!(failures.len(), 2, "{answer}");
    assert!(failures[0].contains("takes/01-again.mcap") && failures[0].contains("no new garment"), "{answer}");
    assert!(failures[1].contains("takes/03-less.mcap") && failures[1].contains("no new garment"), "{answer}");
    let said = |warnings: &serde_json::Value, layer: &str, what: &str| {
        let about = |w: &&serde_json::Value| w.as_str().unwrap().starts_with(layer) && w.to_string().contains(what);
        warnings.as_array().unwrap().iter().filter(about).count()
    };
    let counted = |what: &str| ["01-again", "02-both", "03-less"].map(|l| said(&answer["warnings"], l, what));
    assert_eq!((counted("taken off"), counted("two garments")), ([0, 0, 1], [0, 1, 0]), "{answer}");
    assert_eq!(answer["results"][0]["layers"], serde_json::json!(["body", "02-both"]), "{answer}");
    assert!(eva.join("build/02-both/garment.ply").is_file() && !eva.join("build/03-less/garment.ply").exists());
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(eva.join("build/03-less/report.json")).unwrap()).unwrap();
    assert!(record["stages"]["cut"]["failures"].to_string().contains("no new garment"), "{record}");
    assert_eq!(said(&record["stages"]["pose"]["warnings"], "03-less", "taken off"), 1, "{record}");
    let again = exits(1, toile().arg("process").arg(&eva));
    assert_eq!((&again["failures"], &again["warnings"]), (&answer["failures"], &answer["warnings"]), "said each time");
}

#[test]
fn a_full_disk_while_processing_leaves_no_half_file_and_the_next_run_goes_on() {
    let (_dir, subject) = copy_of_olga();
    drop_trousers(&subject);
    let mut limited = Command::new("sh");
    let words = format!("ulimit -f 600; exec {} fuse {} --json", env!("CARGO_BIN_EXE_toile"), subject.display());
    let answer = exits(1, limited.arg("-c").arg(words));
    let message = answer["error"]["message"].as_str().unwrap();
    assert!(message.contains("scan.ply") && message.contains("free some space"), "{message}");
    assert!(files_ending(&subject.join("build"), "scan.ply").is_empty());
    assert!(files_ending(&subject, ".part").is_empty());
    exits(0, toile().arg("fuse").arg(&subject));
    assert!(subject.join("build/00-body/scan.ply").is_file());
}

#[test]
fn a_take_torn_by_a_power_cut_is_used_as_far_as_it_goes_and_exits_with_3() {
    let (_dir, subject) = copy_of_olga();
    drop_trousers(&subject);
    let take = subject.join("takes/00-body.mcap");
    let plain = subject.join("plain.mcap");
    // In the plain encoding the recording has several chunks.
    exits(0, toile().arg("export").arg(&take).arg("--mcap").arg(&plain));
    let bytes = fs::read(&plain).unwrap();
    fs::write(&take, &bytes[..bytes.len() * 9 / 10]).unwrap();
    fs::remove_file(&plain).unwrap();
    let answer = exits(3, toile().arg("fuse").arg(&subject));
    let lost = answer["lost"].to_string();
    assert!(lost.contains("00-body.mcap") && lost.contains("frames were read"), "{answer}");
    let again = exits(3, toile().arg("fuse").arg(&subject));
    assert_eq!(again["lost"], answer["lost"], "a skipped stage still says what is lost");
}

#[test]
fn a_failed_subject_does_not_stop_the_next() {
    let (_dir, subject) = copy_of_olga();
    drop_trousers(&subject);
    let empty = Recording::new(12, 12);
    exits(0, toile().args(empty.import("body")));
    let answer = exits(1, toile().arg("process").arg(empty.subject()).arg(&subject));
    let outcomes: Vec<_> = answer["results"].as_array().unwrap().iter().map(|r| r["outcome"].clone()).collect();
    assert_eq!(outcomes, ["failed", "done"]);
    assert!(subject.join("avatar.glb").is_file());
}

#[test]
fn a_subject_without_takes_says_how_to_get_one() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("subject.toml"), "name = \"nobody\"\n").unwrap();
    let message = exits(1, toile().arg("process").arg(dir.path()))["failures"].to_string();
    assert!(message.contains("toile import"), "{message}");
    let message = exits(1, toile().arg("process").arg(dir.path().join("takes")))["failures"].to_string();
    assert!(message.contains("takes"), "{message}");
}
