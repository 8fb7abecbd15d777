//! Garments that were taken off instead of put on.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::fs;

use common::{exits, toile};

#[test]
fn a_session_in_which_garments_were_taken_off_is_found_said_and_put_in_order() {
    let dir = tempfile::tempdir().unwrap();
    let [made, eva] = ["made", "eva"].map(|name| dir.path().join(name));
    exits(0, toile().arg("synthesize").arg("--out").arg(&made).args(["--garments", "trousers", "--frames", "50"]));
    let import = |take: &str, layer: &str| {
        let mut command = toile();
        command.arg("import").arg(made.join("takes").join(take)).arg("--subject").arg(&eva).args(["--layer", layer]);
        command
    };

    // As it was recorded, each take by the outermost garment that is worn in it.
    let first = exits(0, &mut import("01-trousers.mcap", "trousers"));
    assert!(first["warnings"].to_string().contains("no take is called `body`"), "{first}");
    let second = exits(0, &mut import("00-body.mcap", "body"));
    assert!(second["warnings"].to_string().contains("--reverse"), "{second}");
    let refused = exits(1, toile().arg("process").arg(&eva)).to_string();
    assert!(refused.contains("take 0 is 00-trousers") && refused.contains("toile reorder"), "{refused}");
    let done = exits(0, toile().arg("reorder").arg(&eva).arg("--reverse"));
    assert_eq!(done["results"][0], serde_json::json!({ "was": "01-body", "is": "00-body" }), "{done}");
    let same = |take: &str| fs::read(eva.join("takes").join(take)).unwrap().len();
    assert!(same("00-body.mcap") < same("01-trousers.mcap"), "the dressed take is the second one");

    // The same under names that hide it: the scans tell.
    exits(0, toile().arg("reorder").arg(&eva).args(["--reverse", "--names", "body,trousers"]));
    let told = toile().arg("fit").arg(&eva).arg("--json").output().unwrap();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(
        told.contains("get smaller from take to take") && told.contains("--reverse --names body,trousers"),
        "{told}"
    );
    exits(0, toile().arg("reorder").arg(&eva).args(["--reverse", "--names", "body,trousers"]));
    let fitted = exits(0, toile().arg("fit").arg(&eva));
    assert!(!fitted.to_string().contains("get smaller"), "{fitted}");

    let unknown = exits(1, toile().arg("reorder").arg(&eva).args(["--order", "body,coat"])).to_string();
    assert!(unknown.contains("no layer `coat`") && unknown.contains("00-body, 01-trousers"), "{unknown}");
}
