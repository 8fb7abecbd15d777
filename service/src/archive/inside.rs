//! Files below a folder, opened one step at a time so that neither `..` nor a symbolic link leads out of it.

use std::{
    fs::File,
    io,
    os::fd::OwnedFd,
    path::{Component, Path},
};

use rustix::fs::{CWD, Mode, OFlags, openat};

/// Opens a regular file below `root`.
///
/// Every folder on the way is opened by itself and may not be a link, so a link that is put there meanwhile is refused too.
///
/// # Errors
/// The system's error; [`io::ErrorKind::NotFound`] for whatever is not a plain way down to a regular file.
pub fn open_inside(root: &Path, way: &str) -> io::Result<File> {
    let not_there = || io::Error::from(io::ErrorKind::NotFound);
    let names: Vec<&std::ffi::OsStr> = Path::new(way)
        .components()
        .map(|part| if let Component::Normal(name) = part { Ok(name) } else { Err(not_there()) })
        .collect::<io::Result<_>>()?;
    let (file, folders) = names.split_last().ok_or_else(not_there)?;
    let folder_flags = OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC | OFlags::PATH;
    let mut folder: OwnedFd = openat(CWD, root, folder_flags, Mode::empty())?;
    for name in folders {
        folder = openat(&folder, *name, folder_flags, Mode::empty())?;
    }
    // Without NONBLOCK, opening a FIFO waits until somebody writes into it.
    let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = File::from(openat(&folder, *file, flags, Mode::empty())?);
    if file.metadata()?.is_file() { Ok(file) } else { Err(not_there()) }
}

#[cfg(test)]
mod tests {
    use std::{fs, io::Read, os::unix::fs::symlink};

    use super::*;

    #[test]
    fn only_plain_ways_down_to_regular_files_are_opened() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("anna");
        fs::create_dir_all(root.join("build/body")).unwrap();
        fs::write(root.join("build/body/body.ply"), "ply").unwrap();
        fs::write(dir.path().join("secret"), "secret").unwrap();
        symlink(dir.path().join("secret"), root.join("link")).unwrap();
        symlink(dir.path(), root.join("up")).unwrap();
        symlink(&root, dir.path().join("anna2")).unwrap();
        let mut text = String::new();
        open_inside(&root, "build/body/body.ply").unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "ply");
        let ways = ["", ".", "..", "../secret", "build/../../secret", "/etc/passwd", "link", "up/secret", "build", "a"];
        for way in ways {
            assert!(open_inside(&root, way).is_err(), "{way}");
        }
        assert!(open_inside(&dir.path().join("anna2"), "build/body/body.ply").is_err(), "the folder itself is a link");
    }
}
