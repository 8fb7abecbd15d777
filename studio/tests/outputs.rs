//! Nothing captured is ever overwritten, names cannot steer a terminal, and settings are named where they are wrong.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::{ffi::OsStr, fs, os::unix::ffi::OsStrExt};

use common::{Recording, exits, toile};

#[test]
fn no_command_writes_over_a_take_or_a_file_of_another_kind() {
    let recording = Recording::new(4, 4);
    exits(0, toile().args(recording.import("body")));
    let (anna, take) = (recording.subject(), recording.subject().join("takes/00-body.mcap"));
    let before = fs::read(&take).unwrap();
    let notes = recording.folder().join("notes.txt");
    fs::write(&notes, "mine").unwrap();
    for option in ["--glb", "--vrm"] {
        for path in [&take, &anna.join("edits/new.glb"), &notes] {
            exits(2, toile().arg("export").arg(&anna).arg(option).arg(path));
        }
    }
    exits(2, toile().arg("export").arg(&take).arg("--mcap").arg(&take));
    exits(2, toile().arg("export").arg(&take).arg("--mcap").arg(anna.join("takes/01-plain.mcap")));
    exits(2, toile().arg("fuse").arg(&take).arg("--out").arg(anna.join("takes")));
    assert!(fs::read(&take).unwrap() == before && fs::read(&notes).unwrap() == b"mine");
    assert_eq!(fs::read_dir(anna.join("takes")).unwrap().count(), 1);
    let plain = recording.folder().join("plain.mcap");
    exits(0, toile().arg("export").arg(&take).arg("--mcap").arg(&plain));
    exits(2, toile().arg("export").arg(&take).arg("--mcap").arg(&plain));
}

#[test]
fn an_export_into_a_subject_or_twice_into_one_file_is_refused() {
    let recording = Recording::new(4, 4);
    exits(0, toile().args(recording.import("body")));
    let (anna, one) = (recording.subject(), recording.folder().join("x.glb"));
    for name in ["toile.toml", "pending.toml", "build/01-x/scan.ply", "edits", "avatar.vrm"] {
        exits(2, toile().arg("export").arg(&anna).arg("--glb").arg(anna.join(name)));
        assert!(!anna.join(name).exists(), "{name}");
    }
    exits(2, toile().arg("export").arg(&anna).arg("--vrm").arg(anna.join("avatar.glb")));
    exits(2, toile().arg("export").arg(&anna).arg("--glb").arg(&one).arg("--vrm").arg(&one));
}

#[test]
fn of_two_that_make_a_person_in_one_folder_at_once_one_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let make = |seed: &str| {
        let mut command = toile();
        command.arg("synthesize").arg("--out").arg(dir.path().join("fold"));
        command.args(["--as", "folders", "--garments", "", "--frames", "3", "--seed", seed, "--json"]);
        command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap()
    };
    let mut codes: Vec<_> = ["1", "2"].map(make).into_iter().map(|mut run| run.wait().unwrap().code()).collect();
    codes.sort();
    assert_eq!(codes, [Some(0), Some(2)]);
}

#[test]
fn the_demo_does_not_write_over_recordings_of_the_same_name() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["recorded/anna", "out/anna"] {
        fs::create_dir_all(dir.path().join(name).join("takes")).unwrap();
        fs::write(dir.path().join(name).join("subject.toml"), "name = \"anna\"\n").unwrap();
        fs::write(dir.path().join(name).join("takes/00-body.mcap"), name).unwrap();
    }
    let (recorded, out) = (dir.path().join("recorded"), dir.path().join("out"));
    exits(2, toile().arg("demo").arg("--recorded").arg(recorded).arg("--out").arg(&out));
    assert_eq!(fs::read(out.join("anna/takes/00-body.mcap")).unwrap(), b"out/anna");
}

#[test]
fn paths_that_are_not_text_are_read_and_written() {
    let dir = tempfile::tempdir().unwrap();
    let odd = dir.path().join(OsStr::from_bytes(b"M\xfcller"));
    let words = ["--garments", "", "--frames", "2", "--clean"];
    let reported = exits(0, toile().arg("synthesize").arg("--out").arg(&odd).args(words));
    assert!(reported["results"]["out"].as_str().unwrap().contains('\u{fffd}'), "{reported}");
    exits(0, toile().arg("inspect").arg(&odd));
    let copy = dir.path().join(OsStr::from_bytes(b"\xff"));
    exits(
        0,
        toile().arg("import").arg(odd.join("takes/00-body.mcap")).arg("--subject").arg(&copy).args(["--layer", "body"]),
    );
    for command in ["measure", "fit"] {
        let reported = exits(1, toile().arg(command).arg("--scan").arg(odd.join("none.ply")).arg("--out").arg(&copy));
        assert_eq!(reported["error"]["kind"], "io", "{reported}");
    }
}

#[test]
fn names_cannot_steer_the_terminal() {
    let dir = tempfile::tempdir().unwrap();
    let odd = dir.path().join("a\u{1b}[2Jb");
    let done = toile().arg("inspect").arg(&odd).output().unwrap();
    assert!(!done.stderr.contains(&0x1b) && !done.stderr.is_empty());
}

#[test]
fn settings_are_printed_as_a_file_and_wrong_ones_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let printed = toile().args(["settings", "--print"]).output().unwrap();
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(text.contains("# metres; 0.0005 to 0.05; default 0.004\nvoxel_size = 0.004"), "{text}");
    let file = dir.path().join("toile.toml");
    fs::write(&file, &text).unwrap();
    let reported = exits(0, toile().arg("settings").arg("--settings").arg(&file));
    assert_eq!(reported["results"]["fusion"]["voxel_size"], 0.004);
    fs::write(&file, "[fusion]\nvoxel_sise = 0.004\n").unwrap();
    for words in [vec!["settings"], vec!["process"], vec!["extract"], vec!["measure"], vec!["export"], vec!["fuse"]] {
        let recording = Recording::new(4, 4);
        exits(0, toile().args(recording.import("body")));
        let reported = exits(1, toile().args(&words).arg(recording.subject()).arg("--settings").arg(&file));
        // Of several subjects each failure is reported with its subject.
        let error = if words == ["process"] { &reported["results"][0]["error"] } else { &reported["error"] };
        assert_eq!((&error["kind"], &error["field"]), (&"format".into(), &"fusion.voxel_sise".into()), "{reported}");
        assert!(error["file"].as_str().unwrap().ends_with("toile.toml"));
        assert!(error["message"].as_str().unwrap().contains("line 2"), "{reported}");
    }
}
