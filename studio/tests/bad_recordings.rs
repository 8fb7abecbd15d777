//! Recordings that are not as they should be: one clear sentence, the right exit code, nothing lost or half-written.

mod common;

use std::fs;

use common::{Recording, exits, toile};

#[test]
fn a_whole_folder_is_imported_without_a_word_of_warning() {
    let recording = Recording::new(6, 6);
    let answer = exits(0, toile().args(recording.import("body")));
    assert_eq!(answer["warnings"].as_array().map(Vec::len), Some(0), "{answer}");
    assert!(recording.subject().join("takes/00-body.mcap").is_file());
    let answer = exits(0, toile().arg("inspect").arg(recording.subject()));
    assert!(answer.to_string().contains("00-body"), "{answer}");
}

#[test]
fn missing_frames_are_counted_and_the_rest_is_kept() {
    let recording = Recording::new(6, 6);
    for file in ["depth/000003.png", "color/000003.png"] {
        fs::remove_file(recording.folder().join(file)).unwrap();
    }
    let answer = exits(3, toile().args(recording.import("body")));
    let lost = answer["lost"].to_string();
    assert!(lost.contains("1 missing") && lost.contains("(3)"), "{answer}");
    assert!(recording.subject().join("takes/00-body.mcap").is_file());
}

#[test]
fn unequal_counts_of_depth_and_colour_are_reported() {
    let recording = Recording::new(6, 4);
    let answer = exits(3, toile().args(recording.import("body")));
    let lost = answer["lost"].to_string();
    assert!(lost.contains('6') && lost.contains('4'), "{answer}");
}

#[test]
fn a_wrong_camera_field_is_named() {
    for (field, value) in [("fx", "\"wide\""), ("fx", "-1.0"), ("width", "0"), ("depth_scale", "-0.001")] {
        let recording = Recording::new(3, 3);
        recording.set_camera(field, Some(value));
        let answer = exits(1, toile().args(recording.import("body")));
        let message = answer["error"]["message"].as_str().unwrap();
        assert!(message.contains("camera.json") && message.contains(field), "{field} = {value}: {message}");
        assert_eq!(answer["error"]["field"], field, "{answer}");
        assert!(answer["error"]["file"].as_str().unwrap().ends_with("camera.json"), "{answer}");
        assert!(recording.nothing_was_written(), "{field} = {value}");
    }
}

#[test]
fn a_missing_camera_field_is_named() {
    for field in ["fx", "cy", "height"] {
        let recording = Recording::new(3, 3);
        recording.set_camera(field, None);
        let message = exits(1, toile().args(recording.import("body")))["error"]["message"].to_string();
        assert!(message.contains("camera.json") && message.contains(field), "{field}: {message}");
        assert!(recording.nothing_was_written());
    }
}

#[test]
fn a_camera_of_another_size_than_the_pictures_is_refused() {
    let recording = Recording::new(3, 3);
    recording.set_camera("width", Some("640"));
    let message = exits(1, toile().args(recording.import("body")))["error"]["message"].to_string();
    assert!(message.contains("640"), "{message}");
    assert!(recording.nothing_was_written());
}

#[test]
fn a_torn_picture_is_named() {
    let recording = Recording::new(4, 4);
    let path = recording.folder().join("depth/000002.png");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let done = toile().args(recording.import("body")).output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(matches!(done.status.code(), Some(1 | 3)) && text.contains("000002"), "{text}");
}

#[test]
fn an_empty_folder_says_what_is_expected() {
    let recording = Recording::new(0, 0);
    let message = exits(1, toile().args(recording.import("body")))["error"]["message"].to_string();
    assert!(message.contains("recording"), "{message}");
    assert!(recording.nothing_was_written());
}

#[test]
fn an_empty_mcap_and_a_foreign_one_are_distinguished_from_ours() {
    let dir = tempfile::tempdir().unwrap();
    let magic = b"\x89MCAP0\r\n";
    for (name, bytes, says) in [
        ("empty.mcap", &b""[..], "empty"),
        ("text.mcap", b"this is a letter to my aunt", "MCAP"),
        ("cut.mcap", magic, "cut off"),
    ] {
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        for command in ["inspect", "fuse"] {
            let message = exits(1, toile().arg(command).arg(&path))["error"]["message"].to_string();
            assert!(message.contains(says) && message.contains(name), "{command}: {message}");
        }
    }
}

#[test]
fn a_torn_recording_is_read_as_far_as_it_goes_and_exits_with_3() {
    let recording = Recording::with_noise(20);
    exits(0, toile().args(recording.import("body")));
    let take = recording.subject().join("takes/00-body.mcap");
    let bytes = fs::read(&take).unwrap();
    fs::write(&take, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let answer = exits(3, toile().arg("inspect").arg(&take));
    assert!(answer["lost"].to_string().contains("frames were read"), "{answer}");
}

#[test]
fn a_layer_is_not_overwritten_but_retaken() {
    let recording = Recording::new(3, 3);
    exits(0, toile().args(recording.import("body")));
    let take = recording.subject().join("takes/00-body.mcap");
    let before = fs::read(&take).unwrap();
    let message = exits(1, toile().args(recording.import("body")))["error"]["message"].to_string();
    assert!(message.contains("--retake"), "{message}");
    assert_eq!(fs::read(&take).unwrap(), before);
    exits(0, toile().args(recording.import("body")).arg("--retake"));
    let rejected = fs::read_dir(recording.subject().join("takes/rejected")).unwrap().count();
    assert_eq!(rejected, 1);
}

#[test]
fn a_half_take_of_a_killed_capture_is_kept_by_an_import() {
    let recording = Recording::new(3, 3);
    exits(0, toile().args(recording.import("body")));
    let takes = recording.subject().join("takes");
    let part = takes.join("00-body.retake.mcap.part");
    fs::write(&part, "what a killed capture left").unwrap();
    let told = exits(0, toile().arg("inspect").arg(recording.subject()));
    assert!(told["warnings"].to_string().contains("00-body.retake.mcap.part"), "{told}");
    let told = exits(0, toile().args(recording.import("body")).arg("--retake"));
    let kept = takes.join("00-body.retake.mcap.part.1");
    assert_eq!(fs::read_to_string(&kept).unwrap(), "what a killed capture left");
    assert!(told["warnings"].to_string().contains("00-body.retake.mcap.part.1"), "{told}");
    assert!(!part.exists());
}

#[test]
fn of_a_damaged_recording_everything_else_is_exported_and_a_full_disk_leaves_nothing() {
    let recording = Recording::with_noise(20);
    exits(0, toile().args(recording.import("body")));
    let take = recording.subject().join("takes/00-body.mcap");
    let mut bytes = fs::read(&take).unwrap();
    let late = bytes.len() * 3 / 4;
    bytes[late..late + 64].fill(0x5a);
    let damaged = recording.folder().join("damaged.mcap");
    fs::write(&damaged, &bytes).unwrap();
    let plain = recording.folder().join("plain.mcap");
    let told = exits(3, toile().arg("export").arg(&damaged).arg("--mcap").arg(&plain));
    assert!(told["lost"][0].as_str().unwrap().contains("damaged.mcap"), "{told}");
    assert!(told["results"]["frames"].as_u64().unwrap() >= 1, "{told}");
    let full = recording.folder().join("full.mcap");
    let mut limited = std::process::Command::new("sh");
    let (program, take, out) = (env!("CARGO_BIN_EXE_toile"), take.display(), full.display());
    limited.arg("-c").arg(format!("ulimit -f 600; exec {program} export {take} --mcap {out} --json"));
    let told = exits(1, &mut limited);
    assert!(told["error"]["message"].as_str().unwrap().contains("full.mcap"), "{told}");
    assert!(!full.exists() && !full.with_extension("mcap.part").exists());
}

#[test]
fn a_full_disk_at_import_leaves_nothing_half_written() {
    let recording = Recording::with_noise(4);
    let takes = recording.subject().join("takes");
    fs::create_dir_all(&takes).unwrap();
    std::os::unix::fs::symlink("/dev/full", takes.join("00-body.mcap.part")).unwrap();
    // An import replaces an old .part, so the disk is made full by a limit on the size of files instead; the signal that
    // comes with it must not end the program before it can say so.
    let mut limited = std::process::Command::new("sh");
    let words = recording.import("body").join(" ");
    limited.arg("-c").arg(format!("ulimit -f 8; exec {} {words}", env!("CARGO_BIN_EXE_toile")));
    let answer = exits(1, &mut limited);
    let message = answer["error"]["message"].as_str().unwrap();
    assert!(message.contains("disk") && message.contains("free some space"), "{message}");
    assert!(!takes.join("00-body.mcap").exists());
}

/// Starts the same import several times at once; gives how many ended well. The others were refused.
fn at_once(words: &[Vec<String>]) -> usize {
    let start =
        |words: &Vec<String>| toile().args(words).stdout(std::process::Stdio::piped()).spawn().expect("toile starts");
    let started: Vec<_> = words.iter().map(start).collect();
    let mut done = 0;
    for child in started {
        let output = child.wait_with_output().expect("toile ends");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        match output.status.code() {
            Some(0) => done += 1,
            Some(1) => assert!(text.contains("\"busy\""), "{text}"),
            other => panic!("{other:?}: {text}"),
        }
    }
    done
}

#[test]
fn imports_at_once_lose_no_layer_and_tear_no_take() {
    let recording = Recording::with_noise(5);
    exits(0, toile().args(recording.import("body")));
    let takes = recording.subject().join("takes");
    let count = || toile_capture::Subject::open(&recording.subject()).unwrap().layers().len();
    let done = at_once(&["coat", "scarf", "hat"].map(|name| recording.import(name)));
    assert!(done >= 1 && count() == 1 + done, "{done} were imported, there are {} layers", count());
    let retake = || [recording.import("body"), vec!["--retake".into()]].concat();
    let done = at_once(&[retake(), retake(), retake()]);
    assert_eq!(fs::read_dir(takes.join("rejected")).unwrap().count(), done);
    exits(0, toile().arg("inspect").arg(recording.subject()));
}

#[test]
fn an_import_killed_before_it_could_enter_its_take_is_completed_by_the_same_command() {
    let recording = Recording::new(6, 6);
    exits(0, toile().args(recording.import("body")));
    // What the program does, up to where it is killed.
    let subject = toile_capture::LockedSubject::open(&recording.subject()).unwrap();
    let mut take = subject.next_take("wrap", Some("skirt")).unwrap();
    take.source = recording.folder().to_str().unwrap().into();
    subject.announce(&take).unwrap();
    fs::copy(recording.subject().join("takes/00-body.mcap"), &take.path).unwrap();
    drop(subject);
    let answer = exits(0, toile().args(recording.import("wrap")).args(["--type", "skirt"]));
    assert!(answer["results"]["take"].as_str().unwrap().ends_with("takes/01-wrap.mcap"), "{answer}");
    let subject = toile_capture::Subject::open(&recording.subject()).unwrap();
    assert_eq!(subject.layers()[1].garment.as_deref(), Some("skirt"));
    exits(1, toile().args(recording.import("wrap")));
}

#[test]
fn pipes_are_refused_at_once_and_any_folder_name_will_do() {
    use std::os::unix::ffi::OsStrExt;
    let recording = Recording::new(4, 4);
    let pipe = recording.folder().with_file_name("pipe.mcap");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for command in ["inspect", "fuse"] {
        let message = exits(1, toile().arg(command).arg(&pipe))["error"]["message"].to_string();
        assert!(message.contains("not a regular file") && message.contains("pipe.mcap"), "{message}");
    }
    let name = std::ffi::OsStr::from_bytes(b"M\xfcller\x1b[2J");
    let subject = recording.folder().with_file_name(name);
    let mut import = toile();
    import.arg("import").arg(recording.folder()).arg("--subject").arg(&subject).args(["--layer", "body"]);
    exits(0, &mut import);
    let shown = toile().arg("inspect").arg(&subject).output().unwrap();
    assert!(shown.status.success() && !shown.stdout.contains(&0x1b), "{}", String::from_utf8_lossy(&shown.stdout));
}
