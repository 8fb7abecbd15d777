//! Holds the arrows between crates: who may import whom, and that ARCHITECTURE.md names every crate.

use std::{collections::BTreeMap, path::Path};

/// Crate and what it may import, besides packages from the registry. The table of ARCHITECTURE.md.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("toile-geometry", &[]),
    ("toile-capture", &["toile-geometry"]),
    ("toile-fusion", &["toile-geometry", "toile-capture"]),
    ("toile-character", &["toile-geometry"]),
    ("toile-fitting", &["toile-geometry", "toile-character"]),
    ("toile-garments", &["toile-geometry", "toile-character"]),
    ("toile-animation", &["toile-geometry", "toile-character"]),
    ("toile-avatar", &["toile-geometry", "toile-character"]),
    ("toile-render", &["toile-geometry"]),
    ("toile-synthetic", &["toile-geometry", "toile-capture", "toile-character", "toile-render"]),
    ("toile-stereo", &["toile-geometry", "toile-capture"]),
    ("toile-driver-stereo", &["toile-geometry", "toile-capture", "toile-stereo", "toile-driver-transport"]),
    ("toile-driver-synthetic", &["toile-geometry", "toile-capture", "toile-synthetic"]),
    ("toile-driver-transport", &[]),
    ("toile-driver-kinect1", &["toile-geometry", "toile-capture", "toile-driver-transport"]),
    ("toile-driver-kinect2", &["toile-geometry", "toile-capture", "toile-driver-transport"]),
    ("toile-driver-realsense", &["toile-geometry", "toile-capture", "toile-driver-transport"]),
    ("toile-driver-models", &["toile-geometry", "toile-capture", "toile-synthetic", "toile-driver-transport"]),
    ("toile-driver-uvc-depth", &["toile-geometry", "toile-capture", "toile-driver-transport"]),
    ("toile-driver-webcam", &["toile-geometry", "toile-capture"]),
    ("v4l2-sys-mit", &[]),
    (
        "toile-pipeline",
        &[
            "toile-geometry",
            "toile-capture",
            "toile-fusion",
            "toile-character",
            "toile-fitting",
            "toile-garments",
            "toile-animation",
            "toile-avatar",
            "toile-render",
        ],
    ),
    (
        "toile-live",
        &[
            "toile-geometry",
            "toile-capture",
            "toile-fusion",
            "toile-synthetic",
            "toile-driver-kinect1",
            "toile-driver-kinect2",
            "toile-driver-realsense",
            "toile-driver-stereo",
            "toile-driver-synthetic",
            "toile-driver-transport",
            "toile-driver-uvc-depth",
        ],
    ),
];

/// Crates that bring everything together and may import all others.
const TOP: &[&str] = &["toile-studio", "toile-tests"];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Every member's folder, name and imports of other members (dev-dependencies left out).
fn members() -> BTreeMap<String, (String, Vec<String>)> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("the workspace has a manifest");
    let list = manifest.split("members = [").nth(1).and_then(|s| s.split(']').next()).expect("members are listed");
    let folders = list.split(',').map(|s| s.trim().trim_matches('"')).filter(|s| !s.is_empty());
    folders.map(|folder| (folder.to_string(), read_member(folder))).collect()
}

fn read_member(folder: &str) -> (String, Vec<String>) {
    let text = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).expect("a member has a manifest");
    let name = text.lines().find_map(|l| l.strip_prefix("name = ")).expect("a member has a name").trim_matches('"');
    let section = text.split("\n[dependencies]").nth(1).unwrap_or_default().split("\n[").next().unwrap_or_default();
    let imports = section.lines().filter_map(|l| l.split(['.', ' ', '=']).next()).filter(|n| n.starts_with("toile-"));
    (name.to_string(), imports.map(String::from).collect())
}

#[test]
fn no_crate_imports_against_the_arrows() {
    let mut wrong = Vec::new();
    for (folder, (name, imports)) in members() {
        if TOP.contains(&name.as_str()) {
            continue;
        }
        match MAY_IMPORT.iter().find(|(n, _)| *n == name) {
            None => wrong.push(format!("{folder}: {name} is in no row of the table of imports")),
            Some((_, allowed)) => wrong.extend(
                imports
                    .iter()
                    .filter(|i| !allowed.contains(&i.as_str()))
                    .map(|i| format!("{name} must not import {i}")),
            ),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn architecture_names_every_crate_folder() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    let missing: Vec<_> = members().into_keys().filter(|folder| !text.contains(&format!("`{folder}/`"))).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md does not name {missing:?}");
}

#[test]
fn every_package_the_product_was_asked_to_use_is_imported_by_a_crate_and_explained() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    for package in ["nokhwa", "v4l", "rusb", "nalgebra", "kiddo", "image", "rayon", "serde"] {
        let users = members().into_keys().filter(|folder| {
            let manifest = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap_or_default();
            manifest.contains(&format!("\n{package}.workspace"))
        });
        assert!(users.count() > 0, "no crate uses {package}");
        assert!(text.contains(&format!("`{package}`")), "ARCHITECTURE.md does not say what {package} does");
    }
}
