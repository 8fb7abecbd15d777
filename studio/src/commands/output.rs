//! Where a command may write: never over what was captured, edited or built, and never over a file of another kind.

use std::{
    fs,
    io::Read,
    path::{Component, Path, PathBuf},
};

use toile_capture::{
    files::{is_there, open_regular},
    printable_path,
};
use toile_pipeline::steps_in;

use crate::StudioError;

/// Folders of a subject that hold what cannot be built again, and what is built.
const OF_SUBJECT: [&str; 4] = ["takes", "worn", "edits", "build"];
/// The longest name of a file, bytes, with room for what stands behind it while it is written.
const LONGEST_NAME: usize = 255 - ".63.part".len();

/// A kind of file that an avatar is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// With its motion.
    Glb,
    /// In a T-pose.
    Vrm,
}

impl Model {
    /// What it is called in its subject's folder.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Glb => "avatar.glb",
            Self::Vrm => "avatar.vrm",
        }
    }

    fn other(self) -> Self {
        if self == Self::Glb { Self::Vrm } else { Self::Glb }
    }
}

/// Checks that the avatar of `subject` may be written to `path` as a `model`: it is new, or replaces a file of that kind.
/// Inside of a subject's folder, it must be the subject's own file of that kind.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_model(path: &Path, model: Model, subject: &Path) -> Result<(), StudioError> {
    check_name(path)?;
    let own = subject.join(model.file_name());
    let is_own = resolved(path) == resolved(&own) && !fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink());
    let is_inside = |place: &Path| place.ancestors().skip(1).any(|folder| is_there(&folder.join("subject.toml")));
    let of_subject = OF_SUBJECT.map(|name| resolved(&subject.join(name)));
    let is_among = |place: &Path| of_subject.iter().any(|folder| place.starts_with(folder));
    if !is_own && [written(path), resolved(path)].iter().any(|place| is_inside(place) || is_among(place)) {
        let reason =
            format!("lies in a subject's folder, where only {} is written; choose another place", printable_path(&own));
        return Err(refused(path, &reason));
    }
    let other = model.other().file_name().rsplit_once('.').map_or("", |(_, extension)| extension);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(other)) {
        return Err(refused(path, &format!("would not be a .{other} file in spite of its name; choose another name")));
    }
    if !is_there(path) {
        return Ok(());
    }
    let mut magic = [0; 4];
    let is_glb = open_regular(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok() && magic == *b"glTF");
    if is_glb { Ok(()) } else { Err(refused(path, "exists already and is not a GLB or VRM file; choose another name")) }
}

/// True where both paths name the same file.
pub fn is_same_place(a: &Path, b: &Path) -> bool {
    resolved(a) == resolved(b) || written(a) == written(b)
}

/// Checks that a new recording may be written to `path`.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_new(path: &Path) -> Result<(), StudioError> {
    check_name(path)?;
    check_place(path)?;
    let is_in_subject = path.parent().is_some_and(|folder| is_there(&folder.join("subject.toml")));
    if is_in_subject && path.extension().is_none_or(|extension| extension != "mcap") {
        return Err(refused(path, "lies in a subject's folder and does not end in .mcap; choose another name"));
    }
    if is_there(path) {
        return Err(refused(path, "exists already; choose another name, or remove it first"));
    }
    Ok(())
}

/// Checks that the files of `step` may be written into `folder`: none of them is `input`, and those that exist were written
/// by an earlier run of it, whose record is in `report.json`.
///
/// # Errors
/// [`StudioError::Usage`] says why not.
pub fn check_stage(folder: &Path, step: &str, files: &[&str], input: &Path) -> Result<(), StudioError> {
    let steps = steps_in(folder);
    let (is_ours, has_record) = (!steps.is_empty(), steps.iter().any(|known| known == step));
    let input = input.canonicalize().ok();
    let records = ["report.json", "timings.json"];
    for name in files.iter().chain(&records) {
        let path = folder.join(name);
        check_place(&path)?;
        if !is_there(&path) {
            continue;
        }
        if input.is_some() && path.canonicalize().ok() == input {
            return Err(refused(&path, "is the input itself; choose another --out"));
        }
        if !(has_record || is_ours && records.contains(name)) {
            return Err(refused(&path, "exists already and is not from an earlier run; choose another --out"));
        }
    }
    Ok(())
}

/// Refuses what can be no file's name.
fn check_name(path: &Path) -> Result<(), StudioError> {
    let Some(name) = path.file_name() else { return Err(refused(path, "is no name of a file; give one")) };
    if path.is_dir() {
        return Err(refused(path, "is a folder; give the name of a file, such as one in it"));
    }
    if name.len() > LONGEST_NAME {
        let reason = format!("has a name of {} bytes, but at most {LONGEST_NAME} are possible", name.len());
        return Err(refused(path, &reason));
    }
    Ok(())
}

fn check_place(path: &Path) -> Result<(), StudioError> {
    let holds = |folder: &Path| {
        let is_of_subject = folder.file_name().is_some_and(|name| OF_SUBJECT.iter().any(|known| name == *known));
        is_of_subject && folder.parent().is_some_and(|subject| is_there(&subject.join("subject.toml")))
    };
    if [written(path), resolved(path)].iter().any(|place| place.ancestors().skip(1).any(holds)) {
        return Err(refused(
            path,
            "lies among a subject's takes, edits or what is built of them; choose another place",
        ));
    }
    Ok(())
}

/// The path as it is written, whole and without `..`: links in it are not followed.
fn written(path: &Path) -> PathBuf {
    let mut place = PathBuf::new();
    for part in std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()).components() {
        if part == Component::ParentDir {
            place.pop();
        } else {
            place.push(part);
        }
    }
    place
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
            assert!(check_model(&anna.join(place), Model::Glb, &anna).is_err(), "{place}");
            assert!(check_new(&anna.join(place)).is_err(), "{place}");
            assert!(check_stage(&anna.join(place), "fuse", &["scan.ply"], Path::new("in")).is_err(), "{place}");
        }
        assert!(check_model(&link.join("new.glb"), Model::Glb, &anna).is_err());
        assert!(check_model(&dir.path().join("takes/x.glb"), Model::Glb, &anna).is_ok());
    }

    #[test]
    fn inside_a_subject_only_its_own_files_of_the_right_kind_are_written() {
        let (dir, anna) = subject();
        let olga = dir.path().join("olga");
        fs::create_dir(&olga).unwrap();
        fs::write(olga.join("subject.toml"), "").unwrap();
        fs::remove_dir(anna.join("edits")).unwrap();
        let elsewhere = dir.path().join("elsewhere");
        fs::create_dir(&elsewhere).unwrap();
        std::os::unix::fs::symlink(&elsewhere, anna.join("edits")).unwrap();
        let refused = |path: &Path, model| check_model(path, model, &anna).is_err();
        for name in
            ["edits", "toile.toml", "pending.toml", "mine.glb", "build/01-x/scan.ply", "edits/a.glb", "x/../y.glb"]
        {
            assert!(refused(&anna.join(name), Model::Glb) && refused(&anna.join(name), Model::Vrm), "{name}");
        }
        assert!(refused(&elsewhere.join("a.glb"), Model::Glb), "where the subject's edits really are");
        assert!(refused(&olga.join("avatar.glb"), Model::Glb), "another subject's");
        for (name, model, is_refused) in [
            ("avatar.glb", Model::Glb, false),
            ("avatar.vrm", Model::Vrm, false),
            ("avatar.glb", Model::Vrm, true),
            ("avatar.vrm", Model::Glb, true),
        ] {
            assert_eq!(refused(&anna.join(name), model), is_refused, "{name}");
        }
        assert!(refused(&dir.path().join("x.vrm"), Model::Glb) && refused(&dir.path().join("x.glb"), Model::Vrm));
        let long = dir.path().join("x".repeat(300));
        assert!(check_model(&long, Model::Glb, &anna).unwrap_err().to_string().contains("300 bytes"));
        assert!(check_new(&elsewhere).unwrap_err().to_string().contains("is a folder"));
        assert!(is_same_place(&anna.join("../x.glb"), &dir.path().join("x.glb")));
    }

    #[test]
    fn only_files_of_the_same_kind_are_replaced() {
        let (dir, _) = subject();
        let path = dir.path().join("notes.txt");
        fs::write(&path, "mine").unwrap();
        let anna = dir.path().join("anna");
        assert!(check_model(&path, Model::Glb, &anna).is_err() && check_new(&path).is_err());
        fs::write(&path, b"glTF\x02\0\0\0").unwrap();
        assert!(check_model(&path, Model::Glb, &anna).is_ok() && check_new(&path).is_err());
    }

    #[test]
    fn a_stage_replaces_only_what_an_earlier_run_wrote_and_never_its_input() {
        let (dir, _) = subject();
        let (folder, scan) = (dir.path().join("out"), dir.path().join("out/body.ply"));
        fs::create_dir(&folder).unwrap();
        let check = |files: &[&str], input: &Path| check_stage(&folder, "fit", files, input);
        let input = dir.path().join("scan.ply");
        assert!(check(&["body.ply"], &input).is_ok());
        fs::write(&scan, "ply").unwrap();
        assert!(check(&["body.ply"], &input).is_err());
        let report = folder.join("report.json");
        fs::write(&report, "{}").unwrap();
        assert!(
            check(&["body.ply"], &input).is_err() && check(&["pose.json"], &input).is_err(),
            "somebody else's report"
        );
        fs::remove_file(&report).unwrap();
        fs::write(folder.join("timings.json"), "{}").unwrap();
        assert!(check(&["pose.json"], &input).is_err(), "somebody else's times");
        fs::write(&report, record_of("fuse")).unwrap();
        assert!(check(&["body.ply"], &input).is_err() && check(&["pose.json"], &input).is_ok(), "of another step");
        fs::write(&report, record_of("fit")).unwrap();
        assert!(check(&["body.ply"], &input).is_ok());
        assert!(check(&["body.ply"], &scan).is_err());
    }

    /// A report with a sealed record of one step.
    fn record_of(step: &str) -> String {
        // SHA-256 of `{"version":1}`.
        let seal = "2430f1a2ad2982d0067885488a4c89e21ad1d7c83b115ba8f1b20acc88dfaea8";
        format!(r#"{{"program": "toile", "stages": {{"{step}": {{"version": 1, "seal": "{seal}"}}}}}}"#)
    }
}
