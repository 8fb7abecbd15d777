//! Subjects on disk and their inspection.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{image_folder, record_frames};
use toile_capture::{CaptureError, Layer, LockedSubject, Recorder, RecorderOptions, Subject, import, inspect};

fn add(subject: &mut LockedSubject, name: &str, frames: u64) {
    let garment =
        [("jeans", "trousers"), ("02-scarf", "other"), ("top", "top")].iter().find(|g| g.0 == name).map(|g| g.1);
    let take = subject.next_take(name, garment).unwrap();
    record_frames(&take.path, frames, 1, 1200);
    assert_eq!(subject.accept(take).unwrap(), None);
}

#[test]
fn takes_are_numbered_and_come_back() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path().join("deep/maple");
    let mut subject = LockedSubject::open_or_create(&folder).unwrap();
    add(&mut subject, "body", 2);
    add(&mut subject, "jeans", 3);
    let wrong = subject.next_take("99-scarf", None).unwrap_err().to_string();
    assert!(wrong.contains("the next take is number 2"), "{wrong}");
    add(&mut subject, "02-scarf", 1);
    drop(subject);
    let again = LockedSubject::open_or_create(&folder).unwrap();
    assert_eq!(*again, Subject::open(&folder).unwrap());
    let labels: Vec<_> = again.layers().iter().map(Layer::label).collect();
    assert_eq!(labels, ["00-body", "01-jeans", "02-scarf"]);
    let types: Vec<_> = again.layers().iter().map(|layer| layer.garment.as_deref()).collect();
    assert_eq!(types, [None, Some("trousers"), Some("other")]);
    assert_eq!((again.name(), again.date().len()), ("maple", 10));
    let layer = again.layer("01-jeans").unwrap();
    assert!(again.take_path(layer).ends_with("takes/01-jeans.mcap") && again.take_path(layer).is_file());
    assert!(again.build_folder(layer).ends_with("build/01-jeans"));
    assert!(again.edits_path(layer).ends_with("edits/01-jeans.json"));
    for (name, reason) in
        [("jeans", "--retake"), ("", "not a layer name"), ("../x", "not a layer name"), ("Å", "not a layer name")]
    {
        assert!(again.next_take(name, None).unwrap_err().to_string().contains(reason), "{name}");
    }
    drop(again);
    assert!(LockedSubject::create(&folder).unwrap_err().to_string().contains("exists already"));
}

#[test]
fn a_first_take_may_be_dressed_where_that_is_said() {
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(temp.path()).unwrap();
    // Without saying so, too: garments may have been taken off, and the body come last.
    assert_eq!(subject.next_take("clothes", None).unwrap().layer.label(), "00-clothes");
    assert!(subject.dressed_take("body", None).unwrap_err().to_string().contains("not called `body`"));
    let take = subject.dressed_take("t-shirt", Some("top")).unwrap();
    record_frames(&take.path, 2, 1, 1200);
    subject.accept(take).unwrap();
    assert_eq!(subject.layers()[0].label(), "00-t-shirt");
    assert_eq!(subject.layers()[0].garment.as_deref(), Some("top"));
    assert!(subject.dressed_take("coat", None).unwrap_err().to_string().contains("has takes already"));
    assert_eq!(subject.next_take("coat", None).unwrap().layer.label(), "01-coat");
}

#[test]
fn a_retake_keeps_the_old_take() {
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(temp.path()).unwrap();
    add(&mut subject, "body", 2);
    add(&mut subject, "wrap", 3);
    let path = subject.take_path(&subject.layers()[1]);
    for round in 1..=2 {
        let old = fs::read(&path).unwrap();
        let take = subject.retake("wrap", Some("skirt")).unwrap();
        record_frames(&take.path, 3 + round, 1, 4000);
        assert_eq!(fs::read(&path).unwrap(), old, "the old take stays until the new one is accepted");
        let kept = subject.accept(take).unwrap().unwrap();
        assert!(kept.ends_with(format!("takes/rejected/01-wrap.{round}.mcap")), "{}", kept.display());
        assert_eq!(fs::read(kept).unwrap(), old);
        assert_ne!(fs::read(&path).unwrap(), old);
    }
    drop(subject);
    let mut again = LockedSubject::open(temp.path()).unwrap();
    assert_eq!((again.layers().len(), again.layers()[1].garment.as_deref()), (2, Some("skirt")));
    assert!(again.retake("hat", None).unwrap_err().to_string().contains("body, wrap"));
    let missing = again.next_take("hat", None).unwrap();
    assert!(again.accept(missing).unwrap_err().to_string().contains("not recorded"));
}

/// Does what a program does until it is killed just before it can enter the take.
fn record_and_be_killed(folder: &Path, name: &str, garment: Option<&str>, retake: bool) {
    let subject = LockedSubject::open(folder).unwrap();
    let take = if retake { subject.retake(name, garment) } else { subject.next_take(name, garment) };
    let mut take = take.unwrap();
    (take.rig, take.source) = ("three sensors".into(), "/somewhere".into());
    subject.announce(&take).unwrap();
    record_frames(&take.path, 2, 1, 4000);
}

#[test]
fn a_take_whose_program_was_killed_keeps_its_type_and_rig() {
    let temp = tempfile::tempdir().unwrap();
    add(&mut LockedSubject::create(temp.path()).unwrap(), "body", 2);
    record_and_be_killed(temp.path(), "wrap", Some("skirt"), false);
    let read = Subject::open(temp.path()).unwrap();
    assert_eq!((read.layers()[1].garment.as_deref(), read.rig()), (Some("skirt"), "three sensors"));
    assert!(temp.path().join("pending.toml").is_file(), "reading changes nothing");
    let completed = LockedSubject::open(temp.path()).unwrap();
    assert_eq!(*completed, read);
    assert_eq!(completed.completed("wrap", "/somewhere"), Some(&read.layers()[1]), "it need not be imported again");
    assert_eq!(completed.completed("wrap", "/elsewhere"), None);
    drop(completed);
    assert!(!temp.path().join("pending.toml").exists());
    let later = LockedSubject::open(temp.path()).unwrap();
    assert_eq!(*later, read);
    assert_eq!(later.completed("wrap", "/somewhere"), None);
}

#[test]
fn a_retake_whose_program_was_killed_is_completed() {
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(temp.path()).unwrap();
    add(&mut subject, "body", 2);
    add(&mut subject, "wrap", 5);
    drop(subject);
    record_and_be_killed(temp.path(), "wrap", Some("dress"), true);
    let path = temp.path().join("takes/01-wrap.mcap");
    // Once killed before the old take moved away, once after.
    for rejected in 1..=2 {
        let completed = LockedSubject::open(temp.path()).unwrap();
        assert_eq!(completed.layers()[1].garment.as_deref(), Some("dress"));
        assert!(temp.path().join(format!("takes/rejected/01-wrap.{rejected}.mcap")).is_file());
        assert!(path.is_file() && !temp.path().join("takes/01-wrap.retake.mcap").exists());
        drop(completed);
        record_and_be_killed(temp.path(), "wrap", None, true);
        fs::rename(&path, temp.path().join("takes/rejected/01-wrap.2.mcap")).unwrap();
    }
}

#[test]
fn takes_that_nobody_noted_are_adopted_and_lost_retakes_are_kept() {
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(temp.path()).unwrap();
    add(&mut subject, "body", 2);
    record_frames(&subject.next_take("skirt", None).unwrap().path, 2, 1, 4000);
    drop(subject);
    let mut reopened = LockedSubject::open(temp.path()).unwrap();
    assert_eq!(reopened.layers()[1].label(), "01-skirt", "recorded, but not yet in subject.toml");
    add(&mut reopened, "coat", 1);
    // One that was recorded, but never accepted, is kept too.
    record_frames(&reopened.retake("skirt", None).unwrap().path, 3, 1, 4000);
    let take = reopened.retake("skirt", None).unwrap();
    assert!(temp.path().join("takes/rejected/01-skirt.1.mcap").is_file() && !take.path.exists());
}

#[test]
fn one_process_at_a_time_may_write() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path().join("anna");
    let held = LockedSubject::create(&folder).unwrap();
    for second in [LockedSubject::open(&folder), LockedSubject::open_or_create(&folder), LockedSubject::create(&folder)]
    {
        assert!(matches!(second, Err(CaptureError::Busy { .. })), "{second:?}");
    }
    assert!(Subject::open(&folder).is_ok(), "reading needs no lock");
    held.give_up();
    assert!(!folder.exists(), "nothing was recorded into it");
}

#[test]
fn broken_subjects_get_one_clear_sentence() {
    let temp = tempfile::tempdir().unwrap();
    assert!(Subject::open(temp.path()).unwrap_err().to_string().contains("is not a subject folder"));
    for (text, expected) in [
        ("name = \"x\"\nlayers = 3\n", "line 2"),
        ("nothing", "line 1"),
        ("date = \"2026-01-01\"\n", "missing field `name`"),
        ("name = \"x\"\n[[layers]]\nname = \"../../etc\"\n", "`../../etc` is not a layer name"),
        ("name = \"x\"\n[[layers]]\nname = \"a\"\n[[layers]]\nname = \"a\"\n", "two layers are called `a`"),
        ("name = \"x\"\n[[layers]]\nname = \"a\"\ntype = 5\n", "line 4"),
    ] {
        fs::write(temp.path().join("subject.toml"), text).unwrap();
        let error = Subject::open(temp.path()).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}\nexpected {expected}");
    }
}

#[test]
fn inspection_finds_healthy_and_damaged_takes() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("images"), 6);
    let good = inspect(&folder).unwrap();
    assert!(good.healthy && !good.data_lost, "{good}");
    let sensor = &good.takes[0].sensors[0];
    assert_eq!((sensor.frames, sensor.lost_frames, sensor.depth_valid_share), (6, 0, 1.0));
    assert!((sensor.fps_measured - 10.0).abs() < 1e-9 && (good.takes[0].duration_s - 0.5).abs() < 1e-9);
    assert!(good.to_string().contains("healthy"));
    for file in ["depth/000002.png", "color/000002.jpg", "color/000004.jpg"] {
        fs::remove_file(folder.join(file)).unwrap();
    }
    let gap = inspect(&folder).unwrap();
    assert!(!gap.healthy && !gap.data_lost);
    let text = gap.to_string();
    assert!(text.contains("1 frames lost") && text.contains("have no colour: 4"), "{text}");
    assert_eq!(gap.takes[0].sensors[0].gaps[0].before_frame, 3);
}

#[test]
fn colour_that_is_damaged_behind_its_header_is_counted_and_said() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("images"), 6);
    // Pixels that do not compress, so that most of the file lies behind the header.
    let noise =
        image::RgbImage::from_fn(24, 16, |u, v| image::Rgb([(u * 97 + v * 57) as u8, (u * v * 31) as u8, v as u8]));
    let [cut, overwritten, padded] = [1, 3, 4].map(|i| folder.join(format!("color/{i:06}.jpg")));
    noise.save(&cut).unwrap();
    let whole = fs::read(&cut).unwrap();
    let scan = whole.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap() + 14;
    fs::write(&cut, &whole[..usize::midpoint(scan, whole.len())]).unwrap();
    let mut bytes = whole.clone();
    bytes[scan + 20..scan + 60].copy_from_slice(&[0xff, 0xd5].repeat(20));
    fs::write(&overwritten, bytes).unwrap();
    // Some cameras send whole packets, so that zeros follow the image.
    fs::write(&padded, [whole, vec![0; 300]].concat()).unwrap();
    let found = inspect(&folder).unwrap();
    assert_eq!(found.takes[0].sensors[0].damaged_color, [1, 3]);
    assert!(!found.healthy && found.data_lost, "{found}");
    assert!(found.to_string().contains("2 frames have a damaged colour image: 1, 3"), "{found}");
}

#[test]
fn names_cannot_steer_the_terminal() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("a\u{1b}[2Jb"), 2);
    let text = inspect(&folder).unwrap().to_string();
    assert!(!text.contains('\u{1b}') && text.contains("a\\u{1b}[2Jb"), "{text}");
    let error = inspect(&folder.join("none")).unwrap_err().to_string();
    assert!(!error.contains('\u{1b}') && error.contains("none"), "{error}");
}

#[test]
fn inspection_of_torn_takes_and_subjects() {
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(&temp.path().join("elm")).unwrap();
    add(&mut subject, "body", 4);
    add(&mut subject, "top", 4);
    let path = subject.take_path(&subject.layers()[1]);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let report = inspect(subject.folder()).unwrap();
    assert!(report.data_lost && report.takes[0].loss.is_none() && report.takes[1].loss.is_some());
    let text = report.to_string();
    assert!(text.contains("subject elm") && text.contains("01-top (top)") && text.contains("cut off"), "{text}");
    serde_json::to_string(&report).unwrap();
    fs::write(&path, b"").unwrap();
    assert!(inspect(subject.folder()).unwrap().to_string().contains("the file is empty"));
    assert!(inspect(Path::new("/nowhere")).unwrap_err().to_string().contains("/nowhere"));
}

#[test]
fn real_subject_imports_and_is_healthy() {
    let Some(data) = toile_outside::data("subjects/birch") else { return };
    let temp = tempfile::tempdir().unwrap();
    let mut subject = LockedSubject::create(&temp.path().join("birch")).unwrap();
    for (name, from) in [("body", "00-body"), ("skirt", "01-skirt")] {
        let mut source = import::open(&data.join(from), None).unwrap();
        let take = subject.next_take(name, None).unwrap();
        let recorder = Recorder::create(&take.path, source.rig(), RecorderOptions::default()).unwrap();
        assert!(import::record(source.as_mut(), recorder, &|_| ()).unwrap().is_complete());
        subject.accept(take).unwrap();
    }
    let report = inspect(subject.folder()).unwrap();
    assert!(report.healthy, "{report}");
    assert_eq!(report.takes[1].frames, 100);
}

#[test]
fn fields_that_are_not_known_and_comments_are_kept_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("anna");
    let mut subject = LockedSubject::create(&folder).unwrap();
    add(&mut subject, "body", 1);
    drop(subject);
    let file = folder.join("subject.toml");
    let text = fs::read_to_string(&file).unwrap();
    let text = text.replacen("name = ", "# our own numbers\nstudio = 7 # cellar\nname = ", 1);
    fs::write(&file, format!("{text}tpye = \"top\"\n")).unwrap();
    let mut subject = LockedSubject::open(&folder).unwrap();
    subject.set_rig("kinect1").unwrap();
    let said = subject.remarks();
    assert!(said.len() == 2 && said[0].contains("`studio`") && said[1].contains("`tpye` of layer 00-body"), "{said:?}");
    let text = fs::read_to_string(&file).unwrap();
    for part in ["# our own numbers\nstudio = 7 # cellar\n", "tpye = \"top\"", "rig = \"kinect1\""] {
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(toile_capture::Subject::open(&folder).unwrap().rig(), "kinect1");
}

#[test]
fn a_half_take_that_a_killed_capture_left_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("anna");
    let mut subject = LockedSubject::create(&folder).unwrap();
    add(&mut subject, "body", 1);
    assert!(subject.remarks().is_empty());
    for name in ["01-top.mcap.part", "00-body.retake.mcap.part.2", "notes.part"] {
        fs::write(folder.join("takes").join(name), "half").unwrap();
    }
    let said = subject.remarks();
    assert!(said.len() == 2 && said[0].contains("00-body.retake.mcap.part.2"), "{said:?}");
    assert!(said[1].contains("01-top.mcap.part") && said[1].contains("toile import"), "{said:?}");
}
