//! The archive: a folder of subjects, and the service's own files beside them in `.toile/`.

pub mod bin;
mod detail;
mod id;
mod inside;
mod locks;
mod recordings;
mod summary;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use toile_capture::{CaptureError, LockedSubject, SubjectLock};

pub use self::{
    bin::{Binned, Undo},
    detail::{Detail, detail},
    id::SubjectId,
    inside::open_inside,
    recordings::Recordings,
    summary::{State, Summaries, Summary},
};
use crate::error::{Refusal, ServiceError};

/// Folder of the service's own files: queue, logs, bin.
const OWN: &str = ".toile";

/// A folder of subjects that this service works on, and no other one.
pub struct Archive {
    root: PathBuf,
    _held: SubjectLock,
}

impl Archive {
    /// Opens an archive; a missing folder is created.
    ///
    /// # Errors
    /// [`ServiceError`] where it is no folder, may not be written, or another service has it.
    pub fn open(root: &Path) -> Result<Self, ServiceError> {
        let refused = |source| ServiceError::NoPermission { path: root.to_path_buf(), source };
        if fs::metadata(root).is_ok_and(|about| !about.is_dir()) {
            return Err(ServiceError::NotAFolder(root.to_path_buf()));
        }
        let own = root.join(OWN);
        fs::create_dir_all(&own).map_err(refused)?;
        let held = SubjectLock::acquire(&own).map_err(|error| match error {
            CaptureError::Busy { .. } => ServiceError::InUse(root.to_path_buf()),
            other => refused(io::Error::other(other.to_string())),
        })?;
        // A folder that exists need not be one that may be written.
        let trial = own.join("trial");
        fs::write(&trial, []).and_then(|()| fs::remove_file(&trial)).map_err(refused)?;
        fs::create_dir_all(own.join("logs")).map_err(refused)?;
        let root = fs::canonicalize(root).map_err(refused)?;
        Ok(Self { root, _held: held })
    }

    /// The folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Its name.
    pub fn name(&self) -> String {
        self.root.file_name().map_or_else(|| "archive".into(), |name| name.to_string_lossy().into_owned())
    }

    /// A file of the service's own.
    pub fn own(&self, name: &str) -> PathBuf {
        self.root.join(OWN).join(name)
    }

    /// The folder that a subject of that name has or would have.
    pub fn path_of(&self, id: &SubjectId) -> PathBuf {
        self.root.join(id.as_str())
    }

    /// The folder of an existing subject.
    ///
    /// # Errors
    /// 404 where the archive has no such subject, or the folder is a link.
    pub fn subject(&self, id: &str) -> Result<PathBuf, Refusal> {
        let path = self.path_of(&SubjectId::new(id)?);
        if is_subject(&path) { Ok(path) } else { Err(Refusal::missing(format!("there is no subject `{id}`"))) }
    }

    /// The names of all subjects, in their order.
    pub fn subjects(&self) -> Vec<String> {
        let folders = fs::read_dir(&self.root).into_iter().flatten().flatten();
        let names = folders.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> =
            names.filter(|name| SubjectId::is_valid(name) && is_subject(&self.root.join(name))).collect();
        names.sort_unstable();
        names
    }

    /// Creates a subject.
    ///
    /// # Errors
    /// 422 for a name that no folder can have here, 409 where it exists, 507 on a full disk.
    pub fn create(&self, id: &str, name: Option<&str>) -> Result<PathBuf, Refusal> {
        let id = SubjectId::new(id).map_err(|refusal| Refusal::unusable(refusal.sentence))?;
        let path = self.path_of(&id);
        if fs::symlink_metadata(&path).is_ok() {
            return Err(Refusal::conflict(format!("there is a folder `{}` in the archive already", id.as_str())));
        }
        let mut subject = LockedSubject::create(&path)?;
        if let Some(name) = name.map(str::trim).filter(|name| !name.is_empty()) {
            subject.set_name(name)?;
        }
        Ok(path)
    }
}

/// True for a folder, not a link to one, that has a `subject.toml` of its own.
fn is_subject(path: &Path) -> bool {
    let is = |path: &Path, check: fn(&fs::FileType) -> bool| {
        fs::symlink_metadata(path).is_ok_and(|about| check(&about.file_type()))
    };
    is(path, fs::FileType::is_dir) && is(&path.join("subject.toml"), fs::FileType::is_file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_an_archive_is_told_in_a_sentence() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(matches!(Archive::open(&file), Err(ServiceError::NotAFolder(_))));
        assert!(matches!(Archive::open(&file.join("below")), Err(ServiceError::NoPermission { .. })));
        let root = dir.path().join("archive");
        let first = Archive::open(&root).unwrap();
        assert!(matches!(Archive::open(&root), Err(ServiceError::InUse(_))));
        drop(first);
        assert!(Archive::open(&root).is_ok());
    }

    #[test]
    fn subjects_are_plain_folders_with_a_subject_in_them() {
        let dir = tempfile::tempdir().unwrap();
        let archive = Archive::open(&dir.path().join("archive")).unwrap();
        archive.create("anna", Some("Anna B.")).unwrap();
        archive.create("ben", None).unwrap();
        assert_eq!(archive.create("anna", None).unwrap_err().status, 409);
        assert_eq!(archive.create("../anna", None).unwrap_err().status, 422);
        LockedSubject::create(&dir.path().join("outside")).unwrap();
        std::os::unix::fs::symlink(dir.path().join("outside"), archive.root().join("cleo")).unwrap();
        fs::create_dir(archive.root().join("no-subject")).unwrap();
        assert_eq!(archive.subjects(), ["anna", "ben"]);
        assert_eq!(toile_capture::Subject::open(&archive.subject("anna").unwrap()).unwrap().name(), "Anna B.");
        for id in ["cleo", "no-subject", "..", ".toile", "nobody"] {
            assert_eq!(archive.subject(id).unwrap_err().status, 404, "{id}");
        }
    }
}
