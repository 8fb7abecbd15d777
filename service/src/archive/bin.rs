//! The bin: removed subjects, until they are restored or somebody empties it by hand.

use std::{fs, path::Path, time::UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use toile_capture::{LockedSubject, Subject, SubjectLock};
use utoipa::ToSchema;

use super::{Archive, SubjectId, is_subject};
use crate::{access::random_hex, error::Refusal};

/// How to bring a removed subject back.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "undo": "5f3c9a0b11d2e4f6" }))]
pub struct Undo {
    /// What `POST /api/bin/{token}/restore` takes.
    pub undo: String,
}

/// A removed subject.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "undo": "5f3c9a0b11d2e4f6", "id": "anna", "name": "Anna", "removed": 1796000000.0 }))]
pub struct Binned {
    /// What `POST /api/bin/{token}/restore` takes.
    pub undo: String,
    /// The name of its folder.
    pub id: String,
    /// The subject's name.
    pub name: String,
    /// When it was removed, Unix seconds.
    pub removed: f64,
}

impl Archive {
    /// Moves a subject to the bin.
    ///
    /// # Errors
    /// 404 where there is none, 409 while somebody works on it.
    pub fn remove(&self, id: &str) -> Result<Undo, Refusal> {
        let path = self.subject(id)?;
        let _lock = SubjectLock::acquire(&path)?;
        let undo = random_hex(8).map_err(|error| Refusal::failure(error.to_string()))?;
        let place = self.own("bin").join(&undo);
        let failed = |error: std::io::Error| Refusal::failure(format!("{}: {error}", place.display()));
        fs::create_dir_all(&place).map_err(failed)?;
        fs::rename(&path, place.join(id)).map_err(failed)?;
        Ok(Undo { undo })
    }

    /// What is in the bin, the last removed first.
    pub fn binned(&self) -> Vec<Binned> {
        let places = fs::read_dir(self.own("bin")).into_iter().flatten().flatten();
        let mut all: Vec<Binned> = places
            .filter_map(|place| {
                let (undo, id) = (place.file_name().into_string().ok()?, content(&place.path())?);
                let subject = Subject::open(&place.path().join(&id)).ok();
                let name = subject.map_or_else(|| id.clone(), |subject| subject.name().to_string());
                let removed = place.metadata().ok()?.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
                Some(Binned { undo, id, name, removed: removed.as_secs_f64() })
            })
            .collect();
        all.sort_by(|a, b| b.removed.total_cmp(&a.removed).then_with(|| a.undo.cmp(&b.undo)));
        all
    }

    /// Brings a subject back; gives its id.
    ///
    /// # Errors
    /// 404 where the bin has no such token, 409 where the name is taken again.
    pub fn restore(&self, undo: &str) -> Result<String, Refusal> {
        let missing = || Refusal::missing("the bin has no such entry");
        if undo.is_empty() || !undo.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(missing());
        }
        let place = self.own("bin").join(undo);
        let id = content(&place).ok_or_else(missing)?;
        let path = self.root.join(&id);
        if fs::symlink_metadata(&path).is_ok() {
            return Err(Refusal::conflict(format!("there is a subject `{id}` again; rename or remove that one first")));
        }
        fs::rename(place.join(&id), &path).map_err(|error| Refusal::failure(format!("{}: {error}", path.display())))?;
        // An empty folder that stays is not listed.
        drop(fs::remove_dir(&place));
        // What a killed program had left half done is completed, as on every opening.
        drop(LockedSubject::open(&path));
        Ok(id)
    }
}

/// The subject in a place of the bin.
fn content(place: &Path) -> Option<String> {
    let names = fs::read_dir(place).ok()?.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let mut names = names.filter(|name| SubjectId::is_valid(name) && is_subject(&place.join(name)));
    names.next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_removed_subject_comes_back_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let archive = Archive::open(dir.path()).unwrap();
        let path = archive.create("anna", Some("Anna B.")).unwrap();
        fs::write(path.join("note"), "kept").unwrap();
        let lock = SubjectLock::acquire(&path).unwrap();
        assert_eq!(archive.remove("anna").unwrap_err().status, 409, "somebody works on it");
        drop(lock);
        let Undo { undo } = archive.remove("anna").unwrap();
        assert!(archive.subjects().is_empty());
        let binned = archive.binned();
        assert_eq!((binned[0].undo.as_str(), binned[0].name.as_str()), (undo.as_str(), "Anna B."));
        archive.create("anna", None).unwrap();
        assert_eq!(archive.restore(&undo).unwrap_err().status, 409, "the name is taken");
        archive.remove("anna").unwrap();
        assert_eq!(archive.restore(&undo).unwrap(), "anna");
        assert_eq!(fs::read_to_string(path.join("note")).unwrap(), "kept");
        for wrong in ["", "..", "../..", &undo, "zz"] {
            assert_eq!(archive.restore(wrong).unwrap_err().status, 404, "{wrong}");
        }
    }
}
