//! Takes in another order.
#![allow(clippy::unwrap_used)]

mod common;

use std::{collections::BTreeMap, fs, path::Path};

use common::record_frames;
use toile_capture::{Layer, LockedSubject, Subject, subject::NewName};

/// A subject with takes of these names (and types by the same name), each of another length, with edits.
fn subject(folder: &Path, names: &[&str]) -> LockedSubject {
    let mut subject = LockedSubject::create(folder).unwrap();
    fs::create_dir_all(folder.join("edits")).unwrap();
    for (number, name) in names.iter().enumerate() {
        let take = subject.next_take(name, Some(name)).unwrap();
        record_frames(&take.path, 1 + number as u64, 1, 1200);
        subject.accept(take).unwrap();
        fs::write(folder.join(format!("edits/{number:02}-{name}.json")), *name).unwrap();
        fs::create_dir_all(folder.join(format!("build/{number:02}-{name}"))).unwrap();
    }
    subject
}

/// Every file of a subject but its description, by content.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let names = ["takes", "edits"].into_iter().flat_map(|place| {
        fs::read_dir(folder.join(place))
            .unwrap()
            .map(move |e| format!("{place}/{}", e.unwrap().file_name().to_string_lossy()))
    });
    names.map(|name| (name.clone(), fs::read(folder.join(&name)).unwrap_or_default())).collect()
}

fn labels(subject: &Subject) -> Vec<String> {
    subject.layers().iter().map(Layer::label).collect()
}

fn named(names: &[&str]) -> Vec<NewName> {
    names.iter().map(|name| NewName { name: (*name).into(), garment: Some(format!("new {name}")) }).collect()
}

#[test]
fn garments_that_were_taken_off_are_put_in_order() {
    let temp = tempfile::tempdir().unwrap();
    let mut anna = subject(temp.path(), &["coat", "top", "body"]);
    assert_eq!(anna.layers()[0].garment.as_deref(), Some("coat"), "the first take need not be the body");
    let said = anna.wrong_order().unwrap();
    assert!(said.contains("--reverse") && said.contains("take 0 is 00-coat"), "{said}");
    fs::write(temp.path().join("takes/01-top.retake.mcap.part"), "half").unwrap();
    let before = files(temp.path());
    let done = anna.reorder(&[2, 1, 0], None).unwrap();
    let pair = |was: &str, is: &str| (was.to_string(), is.to_string());
    assert_eq!(done.takes, [pair("02-body", "00-body"), pair("01-top", "01-top"), pair("00-coat", "02-coat")]);
    assert!(done.remarks.is_empty() && anna.wrong_order().is_none(), "{done:?}");
    assert_eq!(labels(&anna), ["00-body", "01-top", "02-coat"]);
    assert_eq!((anna.layers()[0].garment.as_deref(), anna.layers()[2].garment.as_deref()), (None, Some("coat")));
    let after = files(temp.path());
    for (was, is) in [("00-coat", "02-coat"), ("01-top", "01-top"), ("02-body", "00-body")] {
        for (place, end) in [("takes", "mcap"), ("edits", "json")] {
            let name = |label| format!("{place}/{label}.{end}");
            assert_eq!(after[&name(is)], before[&name(was)], "{is}");
        }
    }
    assert!(after.contains_key("takes/01-top.retake.mcap.part") && after.len() == before.len());
    let built = |label: &str| temp.path().join("build").join(label).exists();
    assert!(built("01-top") && !built("00-coat") && !built("02-body") && !temp.path().join("reorder.toml").exists());
    drop(anna);
    assert_eq!(labels(&Subject::open(temp.path()).unwrap()), ["00-body", "01-top", "02-coat"]);
}

#[test]
fn takes_are_exchanged_below_names_that_stay() {
    let temp = tempfile::tempdir().unwrap();
    let mut anna = subject(temp.path(), &["body", "top", "coat"]);
    let file = temp.path().join("subject.toml");
    let text =
        fs::read_to_string(&file).unwrap().replace("type = \"coat\"", "thickness_mm = 2.5 # wool\ntype = \"coat\"");
    fs::write(&file, text).unwrap();
    fs::write(temp.path().join("edits/body.json"), "of take 0").unwrap();
    drop(anna);
    anna = LockedSubject::open(temp.path()).unwrap();
    let before = files(temp.path());
    let done = anna.reorder(&[2, 1, 0], Some(&named(&["body", "vest", "coat"]))).unwrap();
    assert_eq!(labels(&anna), ["00-body", "01-vest", "02-coat"]);
    let facts = |n: usize| (anna.layers()[n].garment.clone(), anna.layers()[n].thickness_mm);
    assert_eq!([facts(1), facts(2)], [(Some("new vest".into()), None), (Some("coat".into()), Some(2.5))]);
    assert!(fs::read_to_string(&file).unwrap().contains("thickness_mm = 2.5 # wool"));
    assert!(done.remarks[0].contains("01-top") && done.remarks[0].contains("type top"), "{done:?}");
    assert!(done.remarks[1].contains("body-of-02-coat.json"), "{done:?}");
    let after = files(temp.path());
    assert_eq!(after["takes/00-body.mcap"], before["takes/02-coat.mcap"]);
    assert_eq!(after["takes/02-coat.mcap"], before["takes/00-body.mcap"]);
    assert_eq!(after["takes/01-vest.mcap"], before["takes/01-top.mcap"]);
    // Once more, and everything is where it was.
    let done = anna.reorder(&[2, 1, 0], Some(&named(&["body", "top", "coat"]))).unwrap();
    assert!(!done.remarks.iter().any(|remark| remark.contains("edits/body.json")), "{done:?}");
    assert_eq!(files(temp.path()), before);
}
