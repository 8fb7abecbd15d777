//! A take that is a finished scan of another program: its files as they were given, in a folder of their own.
//!
//! ```text
//! takes/00-body.scan/
//!   scan.toml                    which file is the mesh, and what was said of its unit and axes
//!   body.obj  body.mtl  tex/skin.png
//! ```

use std::{
    fs::{self, File},
    io,
    os::unix::fs::PermissionsExt,
    path::{Component, Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use toile_scans::{Unit, Up};

use super::about::parse_toml;
use crate::{
    CaptureError,
    files::{atomic_write, open_regular, part_path, read_text, sync_parent},
};

/// The file that says what the others are.
const NOTE: &str = "scan.toml";
/// The extension of the folder.
pub(super) const EXTENSION: &str = "scan";

/// A finished scan as a take.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanTake {
    #[serde(skip)]
    folder: PathBuf,
    /// Name of the mesh file in the folder.
    file: String,
    /// Names of the files beside it that it refers to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    beside: Vec<String>,
    /// The unit of its lengths, where somebody said it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// The axis that points up, where somebody said it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Up>,
}

impl ScanTake {
    /// True where a path is the folder of such a take.
    pub fn is_at(path: &Path) -> bool {
        path.is_dir() && path.join(NOTE).is_file()
    }

    /// Opens a take that is a scan.
    ///
    /// # Errors
    /// [`CaptureError`] where its `scan.toml` cannot be used.
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        let path = folder.join(NOTE);
        let take: Self = parse_toml(&read_text(&path)?).map_err(|reason| CaptureError::format(&path, reason))?;
        let take = Self { folder: folder.to_path_buf(), ..take };
        if let Some(name) = take.names().find(|name| !is_inside(name)) {
            return Err(CaptureError::format(&path, format!("names `{name}`, which is not in its folder")));
        }
        Ok(take)
    }

    /// Copies a mesh file and what it refers to into the new folder `folder`, byte for byte and read-only. The folder appears
    /// whole or not at all.
    ///
    /// # Errors
    /// [`CaptureError`] where a file cannot be read or written.
    pub fn create(folder: &Path, mesh: &Path, unit: Option<Unit>, up: Option<Up>) -> Result<Self, CaptureError> {
        let name = mesh.file_name().and_then(|name| name.to_str());
        let file =
            name.ok_or_else(|| CaptureError::format(mesh, "its name is not valid UTF-8; rename it"))?.to_string();
        let beside = toile_scans::others(mesh).map_err(|error| CaptureError::format(mesh, error.to_string()))?;
        let take = Self { folder: folder.to_path_buf(), file, beside, unit, up };
        let part = part_path(folder);
        if part.exists() {
            // Half a copy of an import that was killed: its source is where it was.
            fs::remove_dir_all(&part).map_err(|error| CaptureError::io(&part, error))?;
        }
        let copied = take.copy_all(mesh.parent().unwrap_or(Path::new("")), &part);
        copied.and_then(|()| fs::rename(&part, folder).map_err(|error| CaptureError::io(folder, error))).inspect_err(
            |_| {
                drop(fs::remove_dir_all(&part));
            },
        )?;
        sync_parent(folder)?;
        Ok(take)
    }

    fn copy_all(&self, from: &Path, to: &Path) -> Result<(), CaptureError> {
        fs::create_dir_all(to).map_err(|error| CaptureError::io(to, error))?;
        for name in self.names() {
            let target = to.join(name);
            let wrong = |error| CaptureError::io(&target, error);
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent).map_err(wrong)?;
            }
            let mut source = open_regular(&from.join(name))?;
            let mut copy = File::create_new(&target).map_err(wrong)?;
            io::copy(&mut source, &mut copy).map_err(wrong)?;
            copy.set_permissions(fs::Permissions::from_mode(0o444)).map_err(wrong)?;
            copy.sync_all().map_err(wrong)?;
        }
        let note = to.join(NOTE);
        let text = toml::to_string(self).map_err(|error| CaptureError::format(&note, error.to_string()))?;
        atomic_write(&note, text.as_bytes())
    }

    /// The mesh file.
    pub fn mesh_path(&self) -> PathBuf {
        self.folder.join(&self.file)
    }

    /// All files of the take.
    pub fn files(&self) -> Vec<PathBuf> {
        self.names().chain([NOTE]).map(|name| self.folder.join(name)).collect()
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.file.as_str()).chain(self.beside.iter().map(String::as_str))
    }
}

fn is_inside(name: &str) -> bool {
    !name.is_empty() && Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJ: &str = "mtllib body.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";

    #[test]
    fn what_was_given_is_kept_byte_for_byte_and_read_only() {
        let dir = tempfile::tempdir().unwrap();
        let from = dir.path().join("from");
        fs::create_dir_all(from.join("tex")).unwrap();
        for (name, text) in
            [("body.obj", OBJ), ("body.mtl", "newmtl a\nmap_Kd tex\\a.png\n"), ("tex/a.png", "x"), ("b.png", "y")]
        {
            fs::write(from.join(name), text).unwrap();
        }
        let folder = dir.path().join("takes/00-body.scan");
        fs::create_dir_all(part_path(&folder)).unwrap();
        fs::write(part_path(&folder).join("body.obj"), "half").unwrap();
        let take = ScanTake::create(&folder, &from.join("body.obj"), Some(Unit::Inch), None).unwrap();
        assert_eq!((ScanTake::open(&folder).unwrap(), ScanTake::is_at(&folder)), (take.clone(), true));
        let names: Vec<_> =
            take.files().iter().map(|f| f.strip_prefix(&folder).unwrap().display().to_string()).collect();
        assert_eq!(names, ["body.obj", "body.mtl", "tex/a.png", "scan.toml"]);
        assert_eq!(fs::read_to_string(take.mesh_path()).unwrap(), OBJ);
        assert!(fs::metadata(take.mesh_path()).unwrap().permissions().readonly());
        assert!(!part_path(&folder).exists());
    }

    #[test]
    fn a_note_that_leads_elsewhere_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["../secret.obj", "/etc/passwd", ""] {
            fs::write(dir.path().join(NOTE), format!("file = \"a.obj\"\nbeside = [\"{name}\"]\n")).unwrap();
            assert!(ScanTake::open(dir.path()).unwrap_err().to_string().contains("not in its folder"), "{name}");
        }
        fs::write(dir.path().join(NOTE), "file = 3\n").unwrap();
        assert!(ScanTake::open(dir.path()).is_err());
    }
}
