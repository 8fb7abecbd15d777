//! The records of an `.oni` file (OpenNI 1 and 2): a head of 28 bytes (24 in old files), fields, and for pictures their bytes.

use std::{
    collections::BTreeMap,
    io::{Read, Seek, SeekFrom},
};

/// A file starts with its magic, its version, and the largest time and number of a node.
const FILE_HEAD: u64 = 24;
const RECORD_MAGIC: u32 = 0x0052_494e;
/// Files before this version have places of 32 bits.
const FIRST_OF_64_BITS: [u32; 4] = [1, 0, 1, 0];
/// Fields of a record besides its pictures take at most so many bytes: the largest are tables of 20 kB.
const MAX_FIELDS: u64 = 1 << 20;
/// The largest picture, packed, bytes.
const MAX_PICTURE: u64 = 160 << 20;
/// More pictures than these are not listed: nine hours of two streams at 30 a second.
const MAX_PICTURES: usize = 1 << 21;

const INTEGER: u32 = 0x03;
const GENERAL: u32 = 0x06;
const NEW_DATA: u32 = 0x0a;
const END: u32 = 0x0b;
const SEEK_TABLE: u32 = 0x0e;
const NODE_ADDED: [u32; 3] = [0x02, 0x0c, 0x0d];

/// A picture in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) time_us: u64,
    pub(super) frame: u32,
    pub(super) at: u64,
    pub(super) length: u64,
}

/// A stream, or a device.
#[derive(Debug, Clone, Default)]
pub(super) struct Node {
    /// 2 is depth, 3 colour, 5 infrared.
    pub(super) kind: u32,
    /// Four letters.
    pub(super) codec: String,
    pub(super) integers: BTreeMap<String, u64>,
    pub(super) general: BTreeMap<String, Vec<u8>>,
    pub(super) pictures: Vec<Place>,
}

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct Records {
    pub(super) nodes: BTreeMap<u32, Node>,
    /// The file ends before its end record.
    pub(super) is_torn: bool,
}

impl Records {
    /// Reads everything but pictures.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub(super) fn read<R: Read + Seek>(file: &mut R) -> Result<Self, String> {
        let head = bytes(file, 0, FILE_HEAD)?;
        if head.len() < FILE_HEAD as usize {
            return Err("is cut off in its head".into());
        }
        let version =
            [u32::from(head[4]), u32::from(head[5]), u32::from(head[6]) | u32::from(head[7]) << 8, word(&head, 8)];
        let head_length = if version < FIRST_OF_64_BITS { 24 } else { 28 };
        let mut records = Self { is_torn: true, ..Self::default() };
        let (mut at, mut count) = (FILE_HEAD, 0);
        loop {
            let head = bytes(file, at, head_length)?;
            if head.len() < head_length as usize || word(&head, 0) != RECORD_MAGIC {
                break;
            }
            let [kind, node, fields, payload] = [4, 8, 12, 16].map(|k| word(&head, k));
            if kind == END {
                records.is_torn = false;
                break;
            }
            let length = u64::from(fields).checked_sub(head_length).filter(|length| *length <= MAX_FIELDS);
            let Some(length) = length else { break };
            let data = bytes(file, at + head_length, length)?;
            if data.len() as u64 != length {
                break;
            }
            // Only pictures and lists of places have a payload; some recorders leave a length in other records, too.
            let payload = if [NEW_DATA, SEEK_TABLE].contains(&kind) { u64::from(payload) } else { 0 };
            let place = at + u64::from(fields);
            if payload > 0 && (payload > MAX_PICTURE || bytes(file, place + payload - 1, 1)?.is_empty()) {
                break;
            }
            count += usize::from(kind == NEW_DATA);
            if count > MAX_PICTURES {
                return Err(format!("has more than {MAX_PICTURES} pictures; split the recording"));
            }
            records.add(kind, node, &data, (place, payload));
            at = place + payload;
        }
        Ok(records)
    }

    fn add(&mut self, kind: u32, node: u32, data: &[u8], (at, length): (u64, u64)) {
        let node = self.nodes.entry(node).or_default();
        if NODE_ADDED.contains(&kind) {
            let Some((_, rest)) = name(data).filter(|(_, rest)| rest.len() >= 8) else { return };
            node.kind = word(rest, 0);
            node.codec = String::from_utf8_lossy(&rest[4..8]).into_owned();
        } else if kind == NEW_DATA && data.len() >= 12 {
            let time_us = u64::from(word(data, 0)) | u64::from(word(data, 4)) << 32;
            node.pictures.push(Place { time_us, frame: word(data, 8), at, length });
        } else if matches!(kind, INTEGER | GENERAL) {
            let Some((name, rest)) = name(data).filter(|(_, rest)| rest.len() >= 4) else { return };
            let Some(value) = rest.get(4..4 + word(rest, 0) as usize) else { return };
            if kind == GENERAL {
                node.general.insert(name, value.to_vec());
            } else if let Some(value) = value.first_chunk::<8>() {
                node.integers.insert(name, u64::from_le_bytes(*value));
            }
        }
    }
}

/// Bytes of a file; fewer where it ends before.
pub(super) fn bytes<R: Read + Seek>(file: &mut R, at: u64, count: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.take(count).read_to_end(&mut bytes));
    read.map(|_| bytes).map_err(|error| error.to_string())
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// A text with its length before and a zero behind, and what follows.
fn name(data: &[u8]) -> Option<(String, &[u8])> {
    let rest = data.get(4..)?;
    let (text, rest) = rest.split_at_checked(word(data, 0) as usize)?;
    Some((String::from_utf8_lossy(text).trim_end_matches('\0').to_string(), rest))
}
