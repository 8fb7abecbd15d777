//! The pages name what exists: every crate, every package that was asked for, and no file that is not there.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::workspace::{members, top};

fn architecture() -> String {
    fs::read_to_string(top().join("ARCHITECTURE.md")).unwrap()
}

#[test]
fn architecture_names_every_crate_folder() {
    let text = architecture();
    let folders = members().into_values().map(|m| m.folder);
    let missing: Vec<_> = folders.filter(|folder| !text.contains(&format!("`{folder}/`"))).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md does not name {missing:?}");
}

#[test]
fn every_package_the_product_was_asked_to_use_is_imported_by_a_crate_and_explained() {
    let (text, members) = (architecture(), members());
    for package in ["nokhwa", "v4l", "rusb", "nalgebra", "kiddo", "image", "rayon", "serde"] {
        assert!(members.values().any(|m| m.imports.iter().any(|i| i == package)), "no crate uses {package}");
        assert!(text.contains(&format!("`{package}`")), "ARCHITECTURE.md does not say what {package} does");
    }
}

/// Every page of the project: the Markdown files at the top, in docs/ and in recorded/.
fn pages() -> Vec<PathBuf> {
    let (mut pages, mut open) = (Vec::new(), vec![top().join("docs"), top().join("recorded")]);
    pages.extend(fs::read_dir(top()).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_file()));
    while let Some(folder) = open.pop() {
        for path in fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            if path.is_dir() { open.push(path) } else { pages.push(path) }
        }
    }
    pages.retain(|p| p.extension().is_some_and(|e| e == "md"));
    pages
}

/// The targets of the links and pictures in a page, without anchors; web addresses left out.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let targets = targets.map(|t| t.split('#').next().unwrap_or_default());
    targets.filter(|t| !t.is_empty() && !t.contains("://") && !t.contains(' ')).collect()
}

#[test]
fn every_link_leads_to_a_file_of_the_project() {
    let (top, mut wrong) = (top(), Vec::new());
    let included = [("architecture.md", "ARCHITECTURE.md"), ("glossary.md", "GLOSSARY.md")];
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for target in links(&text) {
            let leads_to = page.parent().unwrap().join(target).canonicalize();
            if !leads_to.is_ok_and(|path| path.starts_with(&top)) {
                wrong.push(format!("{}: {target}", page.strip_prefix(&top).unwrap().display()));
            }
        }
    }
    for (inside, outside) in included {
        assert!(top.join("docs").join(inside).exists() && top.join(outside).exists(), "{inside} shows {outside}");
    }
    assert!(wrong.is_empty(), "these links lead to no file of the project:\n{}", wrong.join("\n"));
}

#[test]
fn the_book_lists_every_page_of_the_docs() {
    let summary = fs::read_to_string(top().join("docs/SUMMARY.md")).unwrap();
    let listed = links(&summary);
    let docs = top().join("docs");
    let inside = |page: &Path| page.strip_prefix(&docs).ok().map(|p| p.display().to_string());
    let missing: Vec<_> = pages()
        .iter()
        .filter_map(|p| inside(p))
        .filter(|p| p != "SUMMARY.md" && !listed.contains(&p.as_str()))
        .collect();
    assert!(missing.is_empty(), "docs/SUMMARY.md does not list {missing:?}");
}
