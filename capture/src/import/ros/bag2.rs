//! ROS 2 bags: a folder with `metadata.yaml` and the files that it lists, each SQLite (`.db3`) or MCAP; or one `.db3` alone.

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use super::{
    db3,
    log::{Log, LogMessage, Opened, Topic},
    mcap,
};
use crate::{
    CaptureError,
    files::{is_there, read_text},
    import::inventory::{Listing, has_extension, last_number},
    printable,
};

const METADATA: &str = "metadata.yaml";
const STORAGES: [&str; 2] = ["db3", "mcap"];
/// The largest message, unpacked, bytes.
const MAX_MESSAGE: u64 = 512 << 20;
/// What data packed with zstd begin with; a message of CDR begins with a zero.
const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// True for the folder of a bag. MCAP alone may be anything else, too.
pub(in crate::import) fn is_here(listing: &Listing) -> bool {
    let of = |extension: &str| {
        let packed = format!(".{extension}.zstd");
        listing.files.iter().any(|name| has_extension(name, &[extension]) || name.ends_with(&packed))
    };
    of("db3") || (of("mcap") && listing.files.iter().any(|name| name == METADATA))
}

/// Opens a folder or a file.
///
/// # Errors
/// [`CaptureError`] that says which file of it is missing or cannot be read.
pub(super) fn open(path: &Path) -> Result<Opened<Bag2>, CaptureError> {
    let (files, mut endings) = if path.is_dir() { files(path)? } else { (vec![path.to_path_buf()], Vec::new()) };
    let mut bag = Bag2 { logs: Vec::new(), places: Vec::new() };
    let (mut topics, mut messages) = (Vec::new(), Vec::new());
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".mcap") {
            bag.add(mcap::open(file)?, &mut topics, &mut messages, &mut endings);
        } else {
            bag.add(db3::open(file)?, &mut topics, &mut messages, &mut endings);
        }
    }
    let mut order: Vec<usize> = (0..messages.len()).collect();
    order.sort_by_key(|&k| messages[k].time_ns);
    bag.places = order.iter().map(|&k| bag.places[k]).collect();
    let messages = order.iter().map(|&k| messages[k]).collect();
    Ok(Opened { log: bag, topics, messages, ending: (!endings.is_empty()).then(|| endings.join("; ")) })
}

/// The files of a folder in their order, and a sentence for each that is listed but not there.
fn files(path: &Path) -> Result<(Vec<PathBuf>, Vec<String>), CaptureError> {
    let listing = Listing::read(path)?;
    let mut names = Vec::new();
    let metadata = path.join(METADATA);
    if is_there(&metadata) {
        names = listed(&read_text(&metadata)?);
    }
    if names.is_empty() {
        // A recorder that was killed has not written the list.
        names = listing.files.iter().filter(|name| has_extension(name, &STORAGES)).cloned().collect();
        names.sort_by_key(|name| (last_number(name), name.clone()));
    }
    let (mut files, mut missing) = (Vec::new(), Vec::new());
    for name in names {
        let unpacked = name.strip_suffix(".zstd").unwrap_or(&name);
        if listing.files.iter().any(|file| file == unpacked) {
            files.push(path.join(unpacked));
        } else if listing.files.contains(&name) {
            let reason = "is packed as a whole file, which is not read; unpack it in its place with `zstd -d`";
            return Err(CaptureError::format(&path.join(&name), reason));
        } else {
            missing.push(format!("{METADATA} lists {}, which is not in the folder", printable(unpacked)));
        }
    }
    if files.is_empty() {
        let packed = listing.files.iter().find(|name| Path::new(name).extension().is_some_and(|e| e == "zstd"));
        let reason = packed.map_or_else(
            || "has none of the files that its metadata.yaml lists".to_string(),
            |name| {
                format!("{} is packed as a whole file, which is not read; unpack it with `zstd -d`", printable(name))
            },
        );
        return Err(CaptureError::format(path, reason));
    }
    Ok((files, missing))
}

/// The names behind `relative_file_paths:`, without folders.
fn listed(metadata: &str) -> Vec<String> {
    let behind = metadata.lines().skip_while(|line| line.trim() != "relative_file_paths:").skip(1);
    let items = behind.map_while(|line| line.trim().strip_prefix("- "));
    let name = |item: &str| item.trim().trim_matches(['"', '\'']).rsplit('/').next().unwrap_or_default().to_string();
    items.map(name).collect()
}

/// The files of a bag, open.
#[derive(Debug)]
pub(super) struct Bag2 {
    logs: Vec<Box<dyn Log>>,
    /// File and message in it.
    places: Vec<(usize, usize)>,
}

impl Bag2 {
    fn add<L: Log + 'static>(
        &mut self,
        opened: Opened<L>,
        topics: &mut Vec<Topic>,
        messages: &mut Vec<LogMessage>,
        endings: &mut Vec<String>,
    ) {
        let mut index = Vec::new();
        for topic in opened.topics {
            let known = topics.iter().position(|t| *t == topic);
            index.push(known.unwrap_or(topics.len()));
            if known.is_none() {
                topics.push(topic);
            }
        }
        let file = self.logs.len();
        for (k, message) in opened.messages.into_iter().enumerate() {
            messages.push(LogMessage { topic: index[message.topic], ..message });
            self.places.push((file, k));
        }
        endings.extend(opened.ending);
        self.logs.push(Box::new(opened.log));
    }
}

impl Log for Bag2 {
    fn payload(&mut self, k: usize) -> Result<Vec<u8>, String> {
        let (file, message) = self.places[k];
        let bytes = self.logs[file].payload(message)?;
        if !bytes.starts_with(ZSTD) {
            return Ok(bytes);
        }
        let mut unpacked = Vec::new();
        let read =
            zstd::Decoder::new(&bytes[..]).and_then(|packed| packed.take(MAX_MESSAGE).read_to_end(&mut unpacked));
        read.map(|_| unpacked).map_err(|error| format!("message cannot be unpacked: {error}"))
    }
}
