//! Where a command may write: never over what was captured or edited, and never over a file of another kind.

use std::{
    fs,
    io::Read,
    path::{Path, PathBuf},
};

use toile_capture::{files::open_regular, printable_path};

use crate::StudioError;

/// Folders of a subject that hold what cannot be built again.
const CAPTURED: [&str; 2] = ["takes", "edits"];

/// Checks that a GLB or VRM file may be written to `path`: it is new, or replaces a file of that kind.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_model(path: &Path) -> Result<(), StudioError> {
    check_place(path)?;
    if fs::symlink_metadata(path).is_err() {
        return Ok(());
    }
    let mut magic = [0; 4];
    let is_glb = open_regular(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok() && magic == *b"glTF");
    if is_glb { Ok(()) } else { Err(refused(path, "exists already and is not a GLB or VRM file; choose another name")) }
}

/// Checks that a new file may be written to `path`.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_new(path: &Path) -> Result<(), StudioError> {
    check_place(path)?;
    match fs::symlink_metadata(path) {
        Ok(_) => Err(refused(path, "exists already; choose another name, or remove it first")),
        Err(_) => Ok(()),
    }
}

/// Checks that a stage's files may be written into `folder`: none of them is `input`, and those that exist were written by
/// an earlier run, whose `report.json` is there.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_stage(folder: &Path, files: &[&str], input: &Path) -> Result<(), StudioError> {
    let has_record = folder.join("report.json").is_file();
    let input = input.canonicalize().ok();
    for path in files.iter().map(|name| folder.join(name)) {
        check_place(&path)?;
        let Ok(there) = path.canonicalize() else { continue };
        if input.as_ref() == Some(&there) {
            return Err(refused(&path, "is the input itself; choose another --out"));
        }
        if !has_record {
            return Err(refused(&path, "exists already and is not from an earlier run; choose another --out"));
        }
    }
    Ok(())
}

fn check_place(path: &Path) -> Result<(), StudioError> {
    let place = resolved(path);
    let holds = |folder: &Path| {
        let is_captured = folder.file_name().is_some_and(|name| CAPTURED.iter().any(|captured| name == *captured));
        is_captured && folder.parent().is_some_and(|subject| subject.join("subject.toml").exists())
    };
    if place.ancestors().skip(1).any(holds) {
        return Err(refused(
            path,
            "lies among a subject's takes or edits, which nothing is written over; choose another place",
        ));
    }
    Ok(())
}

/// The path with links resolved as far as it exists.
fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    for known in absolute.ancestors() {
        if let (Ok(real), Ok(rest)) = (known.canonicalize(), absolute.strip_prefix(known)) {
            return if rest.as_os_str().is_empty() { real } else { real.join(rest) };
        }
    }
    absolute
}

fn refused(path: &Path, why: &str) -> StudioError {
    StudioError::Usage(format!("{} {why}", printable_path(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subject() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let anna = dir.path().join("anna");
        for folder in ["takes/rejected", "edits", "build"] {
            fs::create_dir_all(anna.join(folder)).unwrap();
        }
        fs::write(anna.join("subject.toml"), "name = \"anna\"").unwrap();
        fs::write(anna.join("takes/00-body.mcap"), "take").unwrap();
        (dir, anna)
    }

    #[test]
    fn nothing_is_written_among_takes_and_edits_by_any_way() {
        let (dir, anna) = subject();
        let link = dir.path().join("link");
        std::os::unix::fs::symlink(anna.join("takes"), &link).unwrap();
        for place in
            ["takes/00-body.mcap", "takes/new.glb", "takes/rejected/new.glb", "edits/a/b.glb", "build/../takes/x"]
        {
            for check in [check_model, check_new] {
                assert!(check(&anna.join(place)).is_err(), "{place}");
            }
            assert!(check_stage(&anna.join(place), &["scan.ply"], Path::new("in")).is_err(), "{place}");
        }
        assert!(check_model(&link.join("new.glb")).is_err());
        assert!(check_model(&anna.join("mine.glb")).is_ok() && check_model(&dir.path().join("takes/x.glb")).is_ok());
    }

    #[test]
    fn only_files_of_the_same_kind_are_replaced() {
        let (dir, _) = subject();
        let path = dir.path().join("notes.txt");
        fs::write(&path, "mine").unwrap();
        assert!(check_model(&path).is_err() && check_new(&path).is_err());
        fs::write(&path, b"glTF\x02\0\0\0").unwrap();
        assert!(check_model(&path).is_ok() && check_new(&path).is_err());
    }

    #[test]
    fn a_stage_replaces_only_what_an_earlier_run_wrote_and_never_its_input() {
        let (dir, _) = subject();
        let (folder, scan) = (dir.path().join("out"), dir.path().join("out/body.ply"));
        fs::create_dir(&folder).unwrap();
        assert!(check_stage(&folder, &["body.ply"], &dir.path().join("scan.ply")).is_ok());
        fs::write(&scan, "ply").unwrap();
        assert!(check_stage(&folder, &["body.ply"], &dir.path().join("scan.ply")).is_err());
        fs::write(folder.join("report.json"), "{}").unwrap();
        assert!(check_stage(&folder, &["body.ply"], &dir.path().join("scan.ply")).is_ok());
        assert!(check_stage(&folder, &["body.ply"], &scan).is_err());
    }
}
