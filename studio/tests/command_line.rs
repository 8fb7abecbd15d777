//! The command line itself: help, exit codes, JSON.

mod common;

use common::{exits, toile};

#[test]
fn help_shows_the_usual_way_and_every_command_has_an_example() {
    let help = |words: &[&str]| {
        let done = toile().args(words).output().unwrap();
        assert_eq!(done.status.code(), Some(0));
        String::from_utf8(done.stdout).unwrap()
    };
    let text = help(&["--help"]);
    assert!(text.contains("toile process anna") && text.contains("Exit codes"), "{text}");
    for command in [
        "import",
        "inspect",
        "fuse",
        "fit",
        "extract",
        "edit",
        "reorder",
        "export",
        "animate",
        "sculpt",
        "shape",
        "wear",
        "measure",
        "capture",
        "devices",
        "process",
        "batch",
        "catalog",
        "archive",
        "settings",
        "demo",
        "synthesize",
        "completions",
        "serve",
    ] {
        assert!(text.contains(command), "{command} is not in the help");
        let own = help(&[command, "--help"]);
        assert!(own.contains("Example") && own.contains(&format!("toile {command}")), "{own}");
    }
}

#[test]
fn a_wrong_command_line_exits_with_2_and_says_so_in_json_too() {
    for words in [&["proces", "anna"][..], &["process"], &["process", "anna", "--voxels", "3"], &["import", "x"], &[]] {
        let done = toile().args(words).output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{words:?}");
        assert!(done.stdout.is_empty(), "{words:?}");
    }
    let answer = exits(2, toile().args(["process", "anna", "--voxels", "3"]));
    assert_eq!(answer["error"]["kind"], "usage");
    assert!(answer["error"]["message"].as_str().unwrap().contains("--voxels"), "{answer}");
}

#[test]
fn what_is_not_there_is_named() {
    for words in [&["inspect", "no/such"][..], &["fuse", "no/such"], &["fit", "no/such"], &["export", "no/such"]] {
        let answer = exits(1, toile().args(words));
        assert!(answer["error"]["message"].as_str().unwrap().contains("no/such"), "{answer}");
    }
    let answer = exits(1, toile().args(["process", "no/such", "nor/this"]));
    assert_eq!(answer["failures"].as_array().map(Vec::len), Some(2), "{answer}");
    assert_eq!(answer["results"].as_array().map(Vec::len), Some(2), "a failed subject does not stop the next");
}

#[test]
fn completions_name_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let done = toile().args(["completions", shell]).output().unwrap();
        assert!(String::from_utf8(done.stdout).unwrap().contains("synthesize"), "{shell}");
    }
}

#[test]
fn a_motion_that_cannot_be_used_is_said_before_any_work() {
    let dir = tempfile::tempdir().unwrap();
    let bvh = dir.path().join("snake.bvh");
    std::fs::write(
        &bvh,
        "HIERARCHY\nROOT link1\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT link2\n{\nOFFSET 0 1 0\n\
         CHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.04\n0 0 0 0 0 0\n",
    )
    .unwrap();
    let answer = exits(1, toile().args(["process", "anna", "--motion"]).arg(&bvh));
    let message = answer["error"]["message"].as_str().unwrap();
    assert!(message.contains("snake.bvh") && message.contains("joint"), "{message}");
    let answer = exits(1, toile().args(["process", "anna", "--motion", "no/such.bvh"]));
    assert!(answer["error"]["message"].as_str().unwrap().contains("no/such.bvh"), "{answer}");
}

#[test]
fn a_margin_needs_culling_and_is_a_length() {
    let subject = tempfile::tempdir().unwrap();
    let export = |words: &[&str]| exits(2, toile().arg("export").arg(subject.path()).args(words));
    export(&["--cull-margin", "50"]);
    export(&["--cull-hidden", "--mcap", "plain.mcap"]);
    let answer = export(&["--cull-hidden", "--cull-margin", "5000"]);
    assert!(answer["error"]["message"].as_str().unwrap().contains("--cull-margin 5000"), "{answer}");
}

#[test]
fn formats_that_there_are_not_are_named_with_those_there_are() {
    let subject = tempfile::tempdir().unwrap();
    let answer = exits(2, toile().arg("export").arg(subject.path()).args(["--to", "glb,fbx"]));
    let message = answer["error"]["message"].as_str().unwrap();
    assert!(message.contains("fbx") && message.contains("glb, vrm, obj, ply, bvh, usda"), "{message}");
}

#[test]
fn a_thickness_that_no_cloth_has_is_said_before_any_work() {
    let recording = common::Recording::new(3, 3);
    exits(0, toile().args(recording.import("body")));
    exits(0, toile().args(recording.import("coat")));
    let path = recording.subject().join("subject.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("{text}\nthickness_mm = 11.0\n")).unwrap();
    let answer = exits(1, toile().arg("process").arg(recording.subject()));
    let message = answer.to_string();
    assert!(message.contains("subject.toml") && message.contains("thickness_mm`: 11 is not between"), "{message}");
    assert!(!recording.subject().join("build").exists(), "nothing was fused");
}

#[test]
fn edits_that_cannot_be_used_are_named_and_not_kept() {
    let recording = common::Recording::new(3, 3);
    exits(0, toile().args(recording.import("body")));
    let file = recording.folder().join("edits.json");
    for (text, says) in [
        ("{", "not a valid edits file"),
        (r#"{"version": 2}"#, "version 2"),
        (r#"{"version": 1, "stroke": []}"#, "stroke"),
        (r#"{"version": 1, "strokes": [{"mark": "belongs", "points": [], "radius": 0.1}]}"#, "stroke 1"),
        (r#"{"version": 1, "hems": [{"points": [[0, 0, 0], [0, 1, 0]], "reach": 9}]}"#, "hem line 1"),
    ] {
        std::fs::write(&file, text).unwrap();
        let answer = exits(1, toile().arg("edit").arg(recording.subject()).args(["body", "--strokes"]).arg(&file));
        let message = answer["error"]["message"].as_str().unwrap();
        assert!(message.contains("edits.json") && message.contains(says), "{answer}");
        assert!(!recording.subject().join("edits").exists());
    }
}
