//! Unpacking: a subject appears whole, with all hashes right, or not at all.

use std::{
    fs::{self, File, FileTimes},
    io::{self, Read},
    path::{Path, PathBuf},
    time::{Duration, UNIX_EPOCH},
};

use rayon::prelude::*;
use serde::Serialize;
use toile_pipeline::hash_file;

use super::{
    files::{MANIFEST, Manifest, inside},
    pack::{open, read_manifest},
    tombstone::forgotten,
};
use crate::{ArchiveError, state};

/// A pack that was unpacked.
#[derive(Debug, Clone, Serialize)]
pub struct Unpacked {
    /// The pack.
    pub file: PathBuf,
    /// The subject's path in the archive, where the pack says so.
    pub subject: Option<PathBuf>,
    /// True where the subject is in the archive already.
    pub was_there: bool,
    /// Why it could not be unpacked.
    pub failed: Option<String>,
}

/// Unpacks every `*.tar.zst` below `packs` (or that one file) into an archive. Subjects that are there already are passed over, so
/// that a run that was interrupted goes on.
///
/// # Errors
/// [`ArchiveError`] where a folder cannot be listed; a pack that is damaged, or whose subject was forgotten, is told in its
/// [`Unpacked`].
pub fn unpack(packs: &Path, archive: &Path) -> Result<Vec<Unpacked>, ArchiveError> {
    let files = if packs.is_file() {
        vec![packs.to_path_buf()]
    } else {
        super::files::list(packs)?
            .into_iter()
            .filter(|name| name.ends_with(".tar.zst"))
            .map(|name| packs.join(name))
            .collect()
    };
    let one = |file: PathBuf| match unpack_file(&file, archive) {
        Ok((subject, was_there)) => Unpacked { file, subject: Some(subject), was_there, failed: None },
        Err(error) => Unpacked { file, subject: None, was_there: false, failed: Some(error.to_string()) },
    };
    Ok(files.into_par_iter().map(one).collect())
}

fn unpack_file(file: &Path, archive: &Path) -> Result<(PathBuf, bool), ArchiveError> {
    let wrong = |error: io::Error| ArchiveError::io(file, error);
    let mut tar = open(File::open(file).map_err(wrong)?).map_err(wrong)?;
    let manifest = read_manifest(&mut tar).map_err(wrong)?;
    let Some(root) = inside(archive, &manifest.subject) else {
        return Err(ArchiveError::refused(
            file,
            format!("its subject `{}` leads out of the archive", manifest.subject),
        ));
    };
    let subject = PathBuf::from(&manifest.subject);
    if let Some(day) = forgotten(archive, &subject) {
        return Err(ArchiveError::refused(file, format!("its subject was forgotten on {day}; remove the pack too")));
    }
    if root.exists() {
        return Ok((subject, true));
    }
    let beside = state::folder(archive).join("unpacking").join(state::file_name(&subject));
    if beside.exists() {
        fs::remove_dir_all(&beside).map_err(|error| ArchiveError::io(&beside, error))?;
    }
    let done = fill(file, &beside, &manifest).and_then(|()| publish(&beside, &root));
    if done.is_err() {
        // What is left is removed by the next unpacking.
        drop(fs::remove_dir_all(&beside));
    }
    done.map(|()| (subject, false))
}

/// Writes the files of a pack into `folder` and checks them.
fn fill(file: &Path, folder: &Path, manifest: &Manifest) -> Result<(), ArchiveError> {
    let wrong = |error: io::Error| ArchiveError::io(file, error);
    let mut tar = open(File::open(file).map_err(wrong)?).map_err(wrong)?;
    let mut seen = 0;
    for entry in tar.entries().map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let name = entry.path().map_err(wrong)?.to_string_lossy().into_owned();
        if name == MANIFEST && seen == 0 {
            continue;
        }
        let (Some(facts), Some(path)) = (manifest.files.get(&name), inside(folder, &name)) else {
            return Err(ArchiveError::refused(file, format!("holds `{name}`, which its manifest does not")));
        };
        let at = |error| ArchiveError::io(&path, error);
        fs::create_dir_all(path.parent().unwrap_or(folder)).map_err(at)?;
        let mut out = File::create_new(&path).map_err(at)?;
        io::copy(&mut entry.take(facts.bytes), &mut out).map_err(at)?;
        let modified = UNIX_EPOCH + Duration::from_nanos(facts.modified_ns);
        out.set_times(FileTimes::new().set_modified(modified)).map_err(at)?;
        out.sync_all().map_err(at)?;
        if hash_file(&path)? != facts.sha256 {
            return Err(ArchiveError::refused(file, format!("`{name}` in it is damaged; fetch the pack again")));
        }
        seen += 1;
    }
    if seen == manifest.files.len() {
        Ok(())
    } else {
        Err(ArchiveError::refused(file, "it lacks files of its manifest; fetch it again"))
    }
}

fn publish(beside: &Path, root: &Path) -> Result<(), ArchiveError> {
    let wrong = |error| ArchiveError::io(root, error);
    if let Some(folder) = root.parent() {
        fs::create_dir_all(folder).map_err(wrong)?;
    }
    fs::rename(beside, root).map_err(wrong)
}
