//! Packing: one file a subject, a tar archive in zstd, with a manifest of hashes at its start.

use std::{
    fs::{self, File},
    io::{self, BufReader, Read, Write},
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde::Serialize;
use toile_capture::{SubjectLock, files::atomic_write_with};
use toile_pipeline::{hash_file, json};

use super::files::{FileFacts, MANIFEST, Manifest, list, stamp};
use crate::{ArchiveError, find::subjects};

/// zstd's level: takes are compressed already, meshes gain little from more.
const LEVEL: i32 = 3;
/// The largest manifest that is read, bytes.
const MAX_MANIFEST: u64 = 64 << 20;

/// A subject that was packed.
#[derive(Debug, Clone, Serialize)]
pub struct Packed {
    /// The subject's path in the archive.
    pub subject: PathBuf,
    /// Its pack.
    pub file: PathBuf,
    /// Length of the pack, bytes.
    pub bytes: u64,
    /// True where the pack was there already and holds the same.
    pub was_there: bool,
    /// Why it could not be packed.
    pub failed: Option<String>,
}

/// Packs every subject of an archive into a file of its own in `folder`; without results where `takes_only`. A pack that
/// holds the same already is kept, so that a run that was interrupted goes on.
///
/// # Errors
/// [`ArchiveError`] where the archive cannot be listed; a subject that cannot be packed is told in its [`Packed`].
pub fn pack(archive: &Path, folder: &Path, takes_only: bool) -> Result<Vec<Packed>, ArchiveError> {
    let one = |subject: PathBuf| {
        let file = packed_path(folder, &subject);
        match pack_subject(archive, &subject, &file, takes_only) {
            Ok((bytes, was_there)) => Packed { subject, file, bytes, was_there, failed: None },
            Err(error) => Packed { subject, file, bytes: 0, was_there: false, failed: Some(error.to_string()) },
        }
    };
    Ok(subjects(archive)?.into_par_iter().map(one).collect())
}

/// Where the pack of a subject is.
pub(super) fn packed_path(folder: &Path, subject: &Path) -> PathBuf {
    let mut name = subject.as_os_str().to_owned();
    name.push(".tar.zst");
    folder.join(name)
}

fn pack_subject(archive: &Path, subject: &Path, file: &Path, takes_only: bool) -> Result<(u64, bool), ArchiveError> {
    let root = archive.join(subject);
    let _lock = SubjectLock::acquire(&root)?;
    let before = File::open(file).ok().and_then(|found| read_manifest(&mut open(found).ok()?).ok());
    let manifest = manifest(&root, subject, takes_only, before.as_ref())?;
    let length =
        |path: &Path| fs::metadata(path).map(|found| found.len()).map_err(|error| ArchiveError::io(path, error));
    if before.as_ref() == Some(&manifest) {
        return Ok((length(file)?, true));
    }
    let bytes = json::pretty(&manifest)?;
    let mut wrong = None;
    let written = atomic_write_with(file, |out| {
        let mut tar = tar::Builder::new(zstd::Encoder::new(out, LEVEL)?);
        append(&mut tar, MANIFEST, bytes.len() as u64, bytes.as_slice())?;
        for (name, facts) in &manifest.files {
            let path = root.join(name);
            let opened = File::open(&path).inspect_err(|_| wrong = Some(path.clone()))?;
            append(&mut tar, name, facts.bytes, BufReader::new(opened).take(facts.bytes))?;
        }
        tar.into_inner()?.finish().map(drop)
    });
    if let Some(path) = wrong {
        return Err(ArchiveError::refused(&path, "cannot be read"));
    }
    written?;
    Ok((length(file)?, false))
}

/// What the subject holds now. Hashes are taken over from an earlier manifest where size and time are the same.
fn manifest(
    root: &Path,
    subject: &Path,
    takes_only: bool,
    before: Option<&Manifest>,
) -> Result<Manifest, ArchiveError> {
    let mut files = std::collections::BTreeMap::new();
    for name in list(root)? {
        let is_source = ["takes/", "edits/"].iter().any(|folder| name.starts_with(folder))
            || Path::new(&name).extension().is_some_and(|e| e == "toml");
        if name.contains(".part") || (takes_only && !is_source) {
            continue;
        }
        let (bytes, modified_ns) = stamp(&root.join(&name))?;
        let known =
            before.and_then(|b| b.files.get(&name)).filter(|f| (f.bytes, f.modified_ns) == (bytes, modified_ns));
        let sha256 = known.map_or_else(|| hash_file(&root.join(&name)), |facts| Ok(facts.sha256.clone()))?;
        files.insert(name, FileFacts { bytes, modified_ns, sha256 });
    }
    Ok(Manifest { version: 1, subject: subject.to_string_lossy().into_owned(), files })
}

fn append(tar: &mut tar::Builder<impl Write>, name: &str, bytes: u64, content: impl Read) -> io::Result<()> {
    let mut header = tar::Header::new_gnu();
    header.set_size(bytes);
    header.set_mode(0o644);
    header.set_entry_type(tar::EntryType::Regular);
    tar.append_data(&mut header, name, content)
}

/// A pack, to be read from its start.
pub(super) fn open(file: File) -> io::Result<tar::Archive<zstd::Decoder<'static, BufReader<File>>>> {
    Ok(tar::Archive::new(zstd::Decoder::new(file)?))
}

/// The manifest of a pack that was just opened.
pub(super) fn read_manifest<R: Read>(tar: &mut tar::Archive<R>) -> io::Result<Manifest> {
    let wrong = |reason: &str| io::Error::new(io::ErrorKind::InvalidData, reason.to_string());
    let first = tar.entries()?.next().ok_or_else(|| wrong("holds nothing"))??;
    if first.path()?.to_str() != Some(MANIFEST) {
        return Err(wrong("is no pack of Toile's: its first entry is not a manifest"));
    }
    let mut bytes = Vec::new();
    first.take(MAX_MANIFEST).read_to_end(&mut bytes)?;
    let manifest: Manifest = serde_json::from_slice(&bytes)?;
    if manifest.version == 1 { Ok(manifest) } else { Err(wrong("is a pack of a later version of Toile")) }
}
