//! `toile wear` before any work: what is no garment, and who cannot wear one.

mod common;

use std::fs;

use common::{Recording, exits, toile};

#[test]
fn what_is_no_garment_or_cannot_be_worn_is_told_in_a_sentence() {
    let recording = Recording::new(3, 3);
    exits(0, toile().args(recording.import("body")));
    let (subject, dir) = (recording.subject(), tempfile::tempdir().unwrap());
    let message = |garment: &str| {
        let answer = exits(1, toile().arg("wear").arg(garment).arg(&subject));
        answer["error"]["message"].as_str().unwrap().to_string()
    };
    let unprocessed = message("t-shirt");
    assert!(unprocessed.contains("no body yet") && unprocessed.contains("toile process"), "{unprocessed}");
    // As if it had been processed: what is wrong with the garment is said before the body is read.
    fs::create_dir_all(subject.join("build/body")).unwrap();
    fs::write(subject.join("build/body/body.json"), "{}").unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_string()
    };
    let bare = br#"{"asset":{"version":"2.0"},"nodes":[{"name":"coat"}]}"#;
    for (garment, said) in [
        ("no/such".to_string(), "no garment"),
        ("toga".to_string(), "t-shirt"),
        (file("coat.obj", b"v 0 0 0\n"), "no skin"),
        (file("coat.gltf", bare), "no mesh in it has a skin"),
        (file("coat.glb", b"glTF"), "not a glTF file"),
        (subject.to_str().unwrap().to_string(), "SUBJECT/jacket"),
        (format!("{}/body", subject.display()), "the body and no garment"),
    ] {
        let told = message(&garment);
        assert!(told.contains(said), "{garment}: {told}");
    }
    let answer = exits(2, toile().arg("wear").arg(subject.join("coat")).arg(&subject));
    assert!(answer["error"]["message"].as_str().unwrap().contains("no layer `coat`"), "{answer}");
    let answer = exits(1, toile().args(["wear", "coat"]).arg(&subject).arg("--off"));
    assert!(answer["error"]["message"].as_str().unwrap().contains("nothing was put on it"), "{answer}");
    assert!(!subject.join("worn").exists(), "nothing is half-written");
}
