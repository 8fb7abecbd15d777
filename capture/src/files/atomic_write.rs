//! Files that appear whole or not at all.

use std::{
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use super::part::{create_beside, create_parent, sync_parent};
use crate::CaptureError;

/// Writes `bytes` to `path` so that readers see the old file or the new one, never a half: beside, synced, renamed.
/// Folders above are created where they are missing. A link at `path` is replaced, not followed.
///
/// # Errors
/// [`CaptureError::DiskFull`] or [`CaptureError::Io`]; `path` is then as it was, and nothing is left beside it.
pub fn atomic_write(path: &Path, bytes: &[u8]) -> Result<(), CaptureError> {
    atomic_write_with(path, |file| file.write_all(bytes))
}

/// Like [`atomic_write`], with a closure that writes the file's content.
///
/// # Errors
/// As [`atomic_write`]; also what the closure answers.
pub fn atomic_write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>,
) -> Result<(), CaptureError> {
    Beside::write(path, write)?.publish()
}

/// Writes several files so that none appears unless all could be written.
///
/// # Errors
/// As [`atomic_write`]; no file was replaced then, unless a rename itself failed (or the process was killed) between
/// the first and the last of them.
pub fn atomic_write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<(), CaptureError> {
    let written: Vec<Beside> = files
        .iter()
        .map(|(path, bytes)| Beside::write(path, |file| file.write_all(bytes)))
        .collect::<Result<_, _>>()?;
    written.into_iter().try_for_each(Beside::publish)
}

/// A whole file under its temporary name; removed unless it is published.
struct Beside<'a> {
    path: &'a Path,
    /// `None` once it is published: the name may then belong to another writer already.
    part: Option<PathBuf>,
    /// Held open: its lock shows other processes that the temporary name is in use.
    file: File,
}

impl<'a> Beside<'a> {
    fn write(
        path: &'a Path,
        write: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>,
    ) -> Result<Self, CaptureError> {
        create_parent(path)?;
        let (part, file) = create_beside(path)?;
        let beside = Self { path, part: Some(part), file };
        beside.fill(write).map_err(|error| CaptureError::io(path, error))?;
        Ok(beside)
    }

    fn fill(&self, write: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>) -> std::io::Result<()> {
        let mut writer = BufWriter::new(&self.file);
        write(&mut writer)?;
        writer.flush()?;
        drop(writer);
        self.file.sync_all()
    }

    fn publish(mut self) -> Result<(), CaptureError> {
        if let Some(part) = &self.part {
            fs::rename(part, self.path).map_err(|error| CaptureError::io(self.path, error))?;
        }
        self.part = None;
        sync_parent(self.path)
    }
}

impl Drop for Beside<'_> {
    fn drop(&mut self) {
        if let Some(part) = &self.part {
            // A failure here leaves a file that the next write removes.
            let _ = fs::remove_file(part);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{io, os::unix::fs::symlink};

    use super::*;
    use crate::files::part_path;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_whole_files_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/file.json");
        atomic_write(&path, b"old").unwrap();
        atomic_write(&path, b"new").unwrap();
        let failed = atomic_write_with(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("the writer gave up"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(path.parent().unwrap()), ["file.json"]);
    }

    #[test]
    fn links_and_pipes_under_the_temporary_name_are_removed_and_never_followed() {
        let folder = tempfile::tempdir().unwrap();
        let outside = folder.path().join("outside");
        fs::write(&outside, b"precious").unwrap();
        let path = folder.path().join("scan.ply");
        symlink(&outside, part_path(&path)).unwrap();
        atomic_write(&path, b"scan").unwrap();
        rustix::fs::mknodat(
            rustix::fs::CWD,
            part_path(&path),
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR,
            0,
        )
        .unwrap();
        atomic_write(&path, b"again").unwrap();
        symlink(&outside, folder.path().join("link.ply")).unwrap();
        atomic_write(&folder.path().join("link.ply"), b"not a link any more").unwrap();
        assert_eq!(fs::read(&outside).unwrap(), b"precious");
        assert_eq!(fs::read(&path).unwrap(), b"again");
        assert_eq!(names(folder.path()), ["link.ply", "outside", "scan.ply"]);
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_what_a_running_one_writes_is_not_touched() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        fs::write(part_path(&path), b"left by a process that was killed").unwrap();
        let first = Beside::write(&path, |file| file.write_all(b"first")).unwrap();
        let second = Beside::write(&path, |file| file.write_all(b"second")).unwrap();
        assert_ne!(first.part, second.part);
        first.publish().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        second.publish().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(folder.path()), ["a.json"]);
    }

    #[test]
    fn many_writers_of_one_file_never_tear_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        std::thread::scope(|scope| {
            for n in 0..8_u8 {
                let path = &path;
                scope.spawn(move || (0..40).for_each(|_| atomic_write(path, &[n; 5000]).unwrap()));
            }
            for _ in 0..200 {
                let Ok(bytes) = fs::read(&path) else { continue };
                assert!(bytes.len() == 5000 && bytes.iter().all(|byte| *byte == bytes[0]), "a torn file was seen");
            }
        });
        assert_eq!(names(folder.path()), ["report.json"]);
    }

    #[test]
    fn of_several_files_none_appears_when_one_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        fs::create_dir(part_path(&b)).unwrap();
        let files = [(a.clone(), vec![1]), (b.clone(), vec![2])];
        assert!(atomic_write_all(&files).is_err());
        assert_eq!(names(folder.path()), ["b.part"]);
        fs::remove_dir(part_path(&b)).unwrap();
        atomic_write_all(&files).unwrap();
        assert_eq!((fs::read(&a).unwrap(), fs::read(&b).unwrap()), (vec![1], vec![2]));
    }

    #[test]
    fn a_full_disk_is_named() {
        let full = Path::new("/dev/full");
        let mut file = fs::OpenOptions::new().write(true).open(full).expect("Linux has /dev/full");
        let error = file.write_all(b"x").expect_err("a full device takes nothing");
        assert!(CaptureError::io(full, error).to_string().contains("the disk is full"));
    }
}
