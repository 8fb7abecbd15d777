//! ROS 1 bags, version 2.0 (wiki.ros.org/Bags/Format/2.0): records of chunks, which hold records of messages. A bag without an
//! index (`.active`, or cut off) is read like any other: record by record from its start.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use super::log::{Log, LogMessage, Opened, Topic};
use super::reader::Coding;
use crate::{CaptureError, files::open_regular};

/// What every bag starts with.
pub(in crate::import) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// The largest chunk, unpacked, bytes: recorders write them at less than 1 MiB by default.
const MAX_CHUNK: u64 = 512 << 20;
/// The largest header of a record, bytes.
const MAX_HEADER: u64 = 1 << 20;

const CONNECTION: u8 = 7;
const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;

/// A chunk in the file.
#[derive(Debug, Clone)]
struct Chunk {
    offset: u64,
    length: u64,
    unpacked: u64,
    packing: Packing,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    None,
    Lz4,
    Bz2,
}

/// A bag, open.
#[derive(Debug)]
pub(super) struct Bag {
    path: PathBuf,
    file: File,
    chunks: Vec<Chunk>,
    /// The chunk that was unpacked last.
    unpacked: Option<(usize, Vec<u8>)>,
    /// Where each message's data are: chunk, start, length.
    places: Vec<(usize, usize, usize)>,
}

impl Bag {
    /// Opens a bag; gives it with what is in it.
    ///
    /// # Errors
    /// [`CaptureError`] where it is not a bag or a chunk in it is damaged.
    pub(super) fn open(path: &Path) -> Result<Opened<Self>, CaptureError> {
        let file = open_regular(path)?;
        let mut bag = Self { path: path.to_path_buf(), file, chunks: Vec::new(), unpacked: None, places: Vec::new() };
        let ending = bag.find_chunks()?;
        let mut contents = Contents::default();
        for k in 0..bag.chunks.len() {
            let bytes = bag.unpack(k)?;
            let found = contents.read(k, &bytes);
            found.map_err(|reason| CaptureError::format(path, format!("chunk {k} {reason}")))?;
        }
        bag.places = contents.places;
        Ok(Opened { log: bag, topics: contents.topics, messages: contents.messages, ending })
    }

    /// Lists the chunks; a sentence where the file ends in the middle of one.
    fn find_chunks(&mut self) -> Result<Option<String>, CaptureError> {
        let length = self.file.metadata().map_err(|error| CaptureError::io(&self.path, error))?.len();
        let mut at = MAGIC.len() as u64;
        while at < length {
            let Some((header, data_at, data_length)) = self.record(at)? else { break };
            let end = data_at.saturating_add(data_length);
            if end > length {
                break;
            }
            if field(&header, "op") == Some(&[CHUNK]) {
                let packing = match field(&header, "compression") {
                    Some(b"none") => Packing::None,
                    Some(b"lz4") => Packing::Lz4,
                    Some(b"bz2") => Packing::Bz2,
                    _ => return Err(CaptureError::format(&self.path, "a chunk is packed in a way that is not known")),
                };
                let unpacked = field(&header, "size").and_then(number).map_or(data_length, u64::from);
                self.chunks.push(Chunk { offset: data_at, length: data_length, unpacked, packing });
            }
            at = end;
        }
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((at < length).then(|| format!("{name}: the bag ends in the middle; what stands before was read")))
    }

    /// Header, place and length of the data of the record at `at`; `None` where the file ends in it.
    fn record(&mut self, at: u64) -> Result<Option<(Vec<u8>, u64, u64)>, CaptureError> {
        let Some(length) = self.word(at)?.filter(|length| u64::from(*length) <= MAX_HEADER) else { return Ok(None) };
        let header = self.read(at + 4, u64::from(length))?;
        let data_at = at + 4 + u64::from(length);
        let data_length = self.word(data_at)?;
        Ok(header.zip(data_length).map(|(header, length)| (header, data_at + 4, u64::from(length))))
    }

    fn word(&mut self, at: u64) -> Result<Option<u32>, CaptureError> {
        Ok(self.read(at, 4)?.and_then(|bytes| number(&bytes)))
    }

    /// Bytes of the file; `None` where it ends before.
    fn read(&mut self, at: u64, length: u64) -> Result<Option<Vec<u8>>, CaptureError> {
        let wrap = |error| CaptureError::io(&self.path, error);
        self.file.seek(SeekFrom::Start(at)).map_err(wrap)?;
        let mut bytes = Vec::new();
        (&mut self.file).take(length).read_to_end(&mut bytes).map_err(wrap)?;
        Ok((bytes.len() as u64 == length).then_some(bytes))
    }

    fn unpack(&mut self, k: usize) -> Result<Vec<u8>, CaptureError> {
        let Chunk { offset, length, unpacked, packing } = self.chunks[k].clone();
        let wrong = |reason: String| CaptureError::format(&self.path, format!("chunk {k} {reason}"));
        if unpacked > MAX_CHUNK || length > MAX_CHUNK {
            return Err(wrong(format!("holds {unpacked} bytes, which is more than the {MAX_CHUNK} that are unpacked")));
        }
        let packed = self.read(offset, length)?.ok_or_else(|| {
            CaptureError::format(&self.path, format!("chunk {k} is shorter than it was when the file was opened"))
        })?;
        unpack(&packed, packing, unpacked)
            .map_err(|reason| CaptureError::format(&self.path, format!("chunk {k} {reason}")))
    }
}

impl Log for Bag {
    fn payload(&mut self, message: usize) -> Result<Vec<u8>, String> {
        let (chunk, start, length) = self.places[message];
        if self.unpacked.as_ref().is_none_or(|(k, _)| *k != chunk) {
            let bytes = self.unpack(chunk).map_err(|error| error.reason())?;
            self.unpacked = Some((chunk, bytes));
        }
        let bytes = self.unpacked.as_ref().and_then(|(_, bytes)| bytes.get(start..start + length));
        bytes.map(<[u8]>::to_vec).ok_or_else(|| "is not where it was when the file was opened".into())
    }
}

fn unpack(packed: &[u8], packing: Packing, size: u64) -> Result<Vec<u8>, String> {
    let read = |reader: &mut dyn Read| {
        let mut bytes = Vec::new();
        let read = reader.take(size + 1).read_to_end(&mut bytes);
        read.map_err(|error| format!("cannot be unpacked: {error}")).map(|_| bytes)
    };
    let bytes = match packing {
        Packing::None => packed.to_vec(),
        Packing::Lz4 => read(&mut lz4_flex::frame::FrameDecoder::new(packed))?,
        Packing::Bz2 => read(&mut bzip2_rs::DecoderReader::new(packed))?,
    };
    if bytes.len() as u64 == size { Ok(bytes) } else { Err(format!("does not unpack to its {size} bytes")) }
}

/// What chunks hold.
#[derive(Default)]
struct Contents {
    topics: Vec<Topic>,
    /// The topic of each connection.
    connections: BTreeMap<u32, usize>,
    messages: Vec<LogMessage>,
    places: Vec<(usize, usize, usize)>,
}

impl Contents {
    fn read(&mut self, chunk: usize, bytes: &[u8]) -> Result<(), String> {
        const CUT: &str = "ends in the middle of a record";
        let mut at = 0;
        while at < bytes.len() {
            let word = |at: usize| bytes.get(at..at + 4).and_then(number).map(|n| n as usize).ok_or(CUT);
            let header = bytes.get(at + 4..).and_then(|rest| rest.get(..word(at).ok()?)).ok_or(CUT)?;
            let start = at + 4 + header.len() + 4;
            let length = word(start - 4)?;
            let data = bytes.get(start..).and_then(|rest| rest.get(..length)).ok_or(CUT)?;
            self.add(header, data, (chunk, start, length));
            at = start + length;
        }
        Ok(())
    }

    fn add(&mut self, header: &[u8], data: &[u8], place: (usize, usize, usize)) {
        let Some(connection) = field(header, "conn").and_then(number) else { return };
        match field(header, "op") {
            Some(&[CONNECTION]) => {
                let text =
                    |bytes: Option<&[u8]>| bytes.map_or_else(String::new, |b| String::from_utf8_lossy(b).into_owned());
                let topic =
                    Topic { name: text(field(header, "topic")), kind: text(field(data, "type")), coding: Coding::Ros1 };
                let known = self.topics.iter().position(|t| *t == topic);
                let index = known.unwrap_or(self.topics.len());
                if known.is_none() {
                    self.topics.push(topic);
                }
                self.connections.insert(connection, index);
            }
            Some(&[MESSAGE]) => {
                let Some(&topic) = self.connections.get(&connection) else { return };
                let time = field(header, "time").and_then(|b| Some((number(b)?, number(b.get(4..)?)?)));
                let (seconds, nanoseconds) = time.unwrap_or_default();
                let time_ns = i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds);
                self.messages.push(LogMessage { topic, time_ns });
                self.places.push(place);
            }
            _ => {}
        }
    }
}

/// The value of a field of a record's header.
fn field<'a>(mut header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    while !header.is_empty() {
        let length = number(header)? as usize;
        let entry = header.get(4..)?.get(..length)?;
        header = &header[4 + length..];
        let split = entry.iter().position(|b| *b == b'=')?;
        if &entry[..split] == name.as_bytes() {
            return Some(&entry[split + 1..]);
        }
    }
    None
}

fn number(bytes: &[u8]) -> Option<u32> {
    bytes.first_chunk::<4>().map(|b| u32::from_le_bytes(*b))
}
