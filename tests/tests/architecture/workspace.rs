//! The workspace as `cargo metadata` describes it.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

/// A member of the workspace.
pub struct Member {
    /// Its folder, relative to the top.
    pub folder: String,
    /// The packages that it is built with, those of its build script included.
    pub imports: Vec<String>,
    /// The packages that only its tests, benches and examples use.
    pub tests_with: Vec<String>,
}

/// The top of the project.
pub fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// Every member by the name of its package.
pub fn members() -> BTreeMap<String, Member> {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().unwrap();
    packages.iter().map(|p| (p["name"].as_str().unwrap().to_string(), member(p))).collect()
}

fn metadata() -> Value {
    let cargo = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--locked", "--offline"])
        .current_dir(top())
        .output()
        .unwrap();
    assert!(cargo.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&cargo.stderr));
    serde_json::from_slice(&cargo.stdout).unwrap()
}

fn member(package: &Value) -> Member {
    let manifest = Path::new(package["manifest_path"].as_str().unwrap());
    let folder = manifest.parent().unwrap().strip_prefix(top()).unwrap().display().to_string();
    let of_kind = |wanted: Option<&str>| -> Vec<String> {
        let all = package["dependencies"].as_array().unwrap().iter();
        all.filter(|d| d["kind"].as_str() == wanted).map(|d| d["name"].as_str().unwrap().to_string()).collect()
    };
    let imports = [of_kind(None), of_kind(Some("build"))].concat();
    Member { folder, imports, tests_with: of_kind(Some("dev")) }
}

/// Every Rust file below `folder`, with its text.
pub fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(next) = open.pop() {
        for path in std::fs::read_dir(&next).unwrap().map(|e| e.unwrap().path()) {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push((path.clone(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found
}
