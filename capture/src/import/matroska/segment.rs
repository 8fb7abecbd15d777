//! What a Matroska file holds (RFC 9559): tracks, tags, attached files, and where the frames of each track lie.
//!
//! The lists of places that a finished file has (cues, seek heads) are not used, nor is the length that the file states for
//! itself: a recorder that was killed has not written them. Elements are read one after the other; behind a damaged stretch
//! the next cluster is looked for.

use std::io::{Read, Seek};

use super::{
    ebml::{Ebml, Element, children, parse_length, text, unsigned},
    track::Track,
};

const SEGMENT: u32 = 0x1853_8067;
const INFO: u32 = 0x1549_a966;
const TIME_SCALE: u32 = 0x002a_d7b1;
const TRACKS: u32 = 0x1654_ae6b;
const TRACK: u32 = 0xae;
const TAGS: u32 = 0x1254_c367;
const ATTACHMENTS: u32 = 0x1941_a469;
const CLUSTER: u32 = 0x1f43_b675;
const CLUSTER_TIME: u32 = 0xe7;
const SIMPLE_BLOCK: u32 = 0xa3;
const BLOCK_GROUP: u32 = 0xa0;
const BLOCK: u32 = 0xa1;
const VOID: u32 = 0xec;
const CHECKSUM: u32 = 0xbf;
/// Elements beside those above that a file may have: its head, seek heads, cues and chapters.
const PASSED_OVER: [u32; 6] = [0x1a45_dfa3, 0x114d_9b74, 0x1c53_bb6b, 0x1043_a770, VOID, CHECKSUM];
/// What may stand first in a cluster.
const FIRST_IN_CLUSTER: [u32; 3] = [CLUSTER_TIME, VOID, CHECKSUM];

/// Tracks, tags and what is attached take at most so many bytes each; a calibration has some thousands.
const MAX_LIST: u64 = 32 << 20;
/// More frames than these are not listed: three tracks for six hours at 30 a second.
const MAX_BLOCKS: usize = 1 << 21;
/// Bytes that are searched at once for the next cluster.
const WINDOW: u64 = 1 << 20;

/// A frame of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    /// Number of its track.
    pub(super) track: u64,
    pub(super) time_ns: i64,
    /// Where its bytes lie, and how many.
    pub(super) at: u64,
    pub(super) length: u64,
}

/// A named value, of a track or attached file where it says one's id.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tag {
    pub(super) name: String,
    pub(super) value: String,
}

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct Segment {
    /// Nanoseconds a unit of time.
    scale: u64,
    pub(super) tracks: Vec<Track>,
    pub(super) tags: Vec<Tag>,
    /// Attached files: names and bytes.
    pub(super) files: Vec<(String, Vec<u8>)>,
    pub(super) blocks: Vec<Block>,
    /// What could not be read, a sentence each.
    pub(super) losses: Vec<String>,
}

impl Segment {
    /// Reads everything but frames.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub(super) fn read<R: Read + Seek>(file: &mut Ebml<R>) -> Result<Self, String> {
        let mut segment = Self { scale: 1_000_000, ..Self::default() };
        let mut at = 0;
        while at < file.length {
            let next = match file.element(at)? {
                Some(element) => segment.add(file, &element)?,
                None => None,
            };
            let Some(next) = next else {
                let Some(found) = next_cluster(file, at + 1)? else {
                    segment.losses.push(
                        "it ends in the middle, as where the recorder was stopped; what stands before was read".into(),
                    );
                    break;
                };
                segment.losses.push(format!("bytes {at} to {found} are damaged and were passed over"));
                at = found;
                continue;
            };
            at = next;
        }
        Ok(segment)
    }

    /// Reads an element; the place of the one behind it, or `None` where it is damaged or cut off.
    fn add<R: Read + Seek>(&mut self, file: &mut Ebml<R>, element: &Element) -> Result<Option<u64>, String> {
        match element.id {
            SEGMENT => return Ok(Some(element.start)),
            CLUSTER => return self.add_cluster(file, element),
            INFO | TRACKS | TAGS | ATTACHMENTS => {}
            id if PASSED_OVER.contains(&id) => return Ok(element.end.filter(|end| *end <= file.length)),
            _ => return Ok(None),
        }
        let Some(bytes) = file.data(element, MAX_LIST)? else { return Ok(None) };
        let list = children(&bytes);
        match element.id {
            INFO => {
                let scale = list.iter().find(|(id, _)| *id == TIME_SCALE).and_then(|(_, bytes)| unsigned(bytes));
                self.scale = scale.filter(|scale| *scale > 0).unwrap_or(self.scale);
            }
            TRACKS if self.tracks.is_empty() => {
                self.tracks = list.iter().filter(|(id, _)| *id == TRACK).map(|(_, bytes)| Track::read(bytes)).collect();
            }
            TAGS => self.tags.extend(list.iter().flat_map(|(_, tag)| tags(tag))),
            ATTACHMENTS => self.files.extend(list.iter().filter_map(|(_, file)| attached(file))),
            _ => {}
        }
        Ok(element.end)
    }

    /// Lists the frames of a cluster; the place behind it, or `None` where the file is damaged or ends in it.
    fn add_cluster<R: Read + Seek>(&mut self, file: &mut Ebml<R>, cluster: &Element) -> Result<Option<u64>, String> {
        let (mut at, mut time) = (cluster.start, 0);
        let end = cluster.end.unwrap_or(file.length);
        while at < end {
            let Some(child) = file.element(at)? else { return Ok(None) };
            if cluster.end.is_none() && (child.id == CLUSTER || is_beside_clusters(child.id)) {
                return Ok(Some(at));
            }
            let Some(child_end) = child.end.filter(|child_end| *child_end <= end.min(file.length)) else {
                return Ok(None);
            };
            match child.id {
                CLUSTER_TIME => time = file.data(&child, 8)?.and_then(|bytes| unsigned(&bytes)).unwrap_or(0),
                SIMPLE_BLOCK => self.add_block(file, time, child.start, child_end)?,
                BLOCK_GROUP => {
                    let inner = file.element(child.start)?.filter(|inner| inner.id == BLOCK);
                    let inner = inner.and_then(|inner| Some((inner.start, inner.end.filter(|end| *end <= child_end)?)));
                    if let Some((start, inner_end)) = inner {
                        self.add_block(file, time, start, inner_end)?;
                    }
                }
                _ => {}
            }
            at = child_end;
        }
        Ok(Some(at))
    }

    /// A block: its track, its time after its cluster's, flags, and the frame.
    fn add_block<R: Read + Seek>(&mut self, file: &mut Ebml<R>, time: u64, start: u64, end: u64) -> Result<(), String> {
        let head = file.bytes(start, (end - start).min(12))?;
        let Some((Some(track), count)) = parse_length(&head) else { return Ok(()) };
        let Some(&[high, low, flags]) = head.get(count..).and_then(|rest| rest.first_chunk::<3>()) else {
            return Ok(());
        };
        if !self.tracks.iter().any(|known| known.number == track && known.is_video) {
            return Ok(());
        }
        if flags & 0x06 != 0 {
            return Err("packs several frames into one block (lacing), which is not read for pictures".into());
        }
        if self.blocks.len() >= MAX_BLOCKS {
            return Err(format!("has more than {MAX_BLOCKS} frames; split the recording"));
        }
        let units = i64::try_from(time).unwrap_or(i64::MAX).saturating_add(i64::from(i16::from_be_bytes([high, low])));
        let time_ns = units.saturating_mul(i64::try_from(self.scale).unwrap_or(i64::MAX));
        let at = start + count as u64 + 3;
        self.blocks.push(Block { track, time_ns, at, length: end - at });
        Ok(())
    }

    /// The value of a tag.
    pub(super) fn tag(&self, name: &str) -> Option<&str> {
        self.tags.iter().find(|tag| tag.name == name).map(|tag| tag.value.as_str())
    }
}

/// True for what stands beside clusters.
fn is_beside_clusters(id: u32) -> bool {
    let beside = [SEGMENT, INFO, TRACKS, TAGS, ATTACHMENTS];
    beside.contains(&id) || (PASSED_OVER.contains(&id) && id != VOID && id != CHECKSUM)
}

/// Where the next cluster begins, from a place on.
fn next_cluster<R: Read + Seek>(file: &mut Ebml<R>, from: u64) -> Result<Option<u64>, String> {
    let id = CLUSTER.to_be_bytes();
    let mut at = from;
    while at < file.length {
        let bytes = file.bytes(at, WINDOW)?;
        for k in (0..bytes.len().saturating_sub(3)).filter(|&k| bytes[k..k + 4] == id) {
            let place = at + k as u64;
            let first = match file.element(place)? {
                Some(cluster) => file.element(cluster.start)?,
                None => None,
            };
            if first.is_some_and(|first| FIRST_IN_CLUSTER.contains(&first.id)) {
                return Ok(Some(place));
            }
        }
        // The id may lie across two windows.
        at += WINDOW - 3;
    }
    Ok(None)
}

fn tags(tag: &[u8]) -> Vec<Tag> {
    const SIMPLE: u32 = 0x67c8;
    let one = |simple: &[u8]| {
        let fields = children(simple);
        let of = |id: u32| fields.iter().find(|(found, _)| *found == id).map(|(_, bytes)| text(bytes));
        Some(Tag { name: of(0x45a3)?, value: of(0x4487)? })
    };
    children(tag).iter().filter(|(id, _)| *id == SIMPLE).filter_map(|(_, simple)| one(simple)).collect()
}

fn attached(file: &[u8]) -> Option<(String, Vec<u8>)> {
    let fields = children(file);
    let of = |id: u32| fields.iter().find(|(found, _)| *found == id).map(|(_, bytes)| *bytes);
    Some((text(of(0x466e)?), of(0x465c)?.to_vec()))
}
