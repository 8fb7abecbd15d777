//! Files in a ZIP archive (PKWARE's APPNOTE), stored or deflated, without encryption and below 4 GiB.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::Path,
};

use crate::{CaptureError, files::open_regular};

/// The largest file that is unpacked, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// The end record is looked for in this many bytes: a comment may follow it.
const TAIL: u64 = 22 + 65_535;

/// Where a file lies in the archive.
#[derive(Debug, Clone, Copy)]
struct Place {
    offset: u32,
    packed: u32,
    size: u32,
    method: u16,
}

/// An archive, open.
#[derive(Debug)]
pub(super) struct Archive {
    file: File,
    places: BTreeMap<String, Place>,
}

impl Archive {
    /// Opens an archive and lists it.
    ///
    /// # Errors
    /// [`CaptureError`] where it is not an archive that can be read.
    pub(super) fn open(path: &Path) -> Result<Self, CaptureError> {
        let mut file = open_regular(path)?;
        let length = file.metadata().map_err(|error| CaptureError::io(path, error))?.len();
        let tail_at = length.saturating_sub(TAIL);
        let tail = read(&mut file, tail_at, length - tail_at).map_err(|reason| CaptureError::format(path, reason))?;
        let found = directory(&tail).and_then(|(at, size)| {
            let list = read(&mut file, u64::from(at), u64::from(size))?;
            Ok(places(&list))
        });
        let places = found.map_err(|reason| CaptureError::format(path, reason))?;
        Ok(Self { file, places })
    }

    /// The names in it.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.places.keys().map(String::as_str)
    }

    /// The bytes of a file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let Place { offset, packed, size, method } = *self.places.get(name).ok_or("is not in the archive")?;
        if u64::from(size.max(packed)) > MAX_BYTES {
            return Err(format!("holds {size} bytes, which are too many"));
        }
        let head = read(&mut self.file, u64::from(offset), 30)?;
        let [names, extra] = [26, 28].map(|at| u64::from(u16::from_le_bytes([head[at], head[at + 1]])));
        let bytes = read(&mut self.file, u64::from(offset) + 30 + names + extra, u64::from(packed))?;
        match method {
            0 => Ok(bytes),
            8 => miniz_oxide::inflate::decompress_to_vec_with_limit(&bytes, size as usize)
                .map_err(|error| format!("cannot be unpacked: {error}")),
            other => Err(format!("is packed by the method {other}, which is not read")),
        }
    }
}

fn read(file: &mut File, at: u64, length: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let taken = file.seek(SeekFrom::Start(at)).and_then(|_| file.take(length).read_to_end(&mut bytes));
    taken.map_err(|error| error.to_string())?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err("the archive is cut off".into()) }
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk::<4>().map(|b| u32::from_le_bytes(*b))
}

/// Offset and length of the list of files, from the end of the archive.
fn directory(tail: &[u8]) -> Result<(u32, u32), String> {
    let at =
        tail.windows(4).rposition(|w| w == b"PK\x05\x06").ok_or("is not a whole ZIP archive: its end is missing")?;
    match (u32_at(tail, at + 16), u32_at(tail, at + 12)) {
        (Some(u32::MAX), _) => {
            Err("is a ZIP archive of more than 4 GiB, which is not read; unpack it and import the folder".into())
        }
        (Some(offset), Some(size)) if u64::from(size) <= MAX_BYTES => Ok((offset, size)),
        _ => Err("is not a whole ZIP archive: its end is damaged".into()),
    }
}

/// The files of the list; it ends where it is damaged.
fn places(list: &[u8]) -> BTreeMap<String, Place> {
    let mut places = BTreeMap::new();
    let mut at = 0;
    while list.get(at..at + 4) == Some(b"PK\x01\x02") {
        let entry = || {
            let [names, extra, comment] = [u16_at(list, at + 28)?, u16_at(list, at + 30)?, u16_at(list, at + 32)?];
            let name = list.get(at + 46..)?.get(..usize::from(names))?;
            let place = Place {
                offset: u32_at(list, at + 42)?,
                packed: u32_at(list, at + 20)?,
                size: u32_at(list, at + 24)?,
                method: u16_at(list, at + 10)?,
            };
            let next = at + 46 + usize::from(names) + usize::from(extra) + usize::from(comment);
            Some((String::from_utf8_lossy(name).into_owned(), place, next))
        };
        let Some((name, place, next)) = entry() else { break };
        places.insert(name, place);
        at = next;
    }
    places
}

/// Reads the end and the list of an archive; for `fuzz/`.
pub(super) fn parse(bytes: &[u8]) {
    let _ = (directory(bytes).is_ok(), places(bytes).len());
}
