//! Where each frame's images stand in a recording of ours.

use std::{collections::BTreeMap, path::Path};

use super::{
    container::{Container, Outline},
    message::{ImageMessage, Stamp},
    records::{Record, records},
    scan::{MAX_FRAMES, for_each_record},
    schema::Schema,
};
use crate::CaptureError;

/// A frame's numbers, and where its images are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) stamp: Stamp,
    pub(super) depth: Option<Location>,
    pub(super) color: Option<Location>,
}

/// Where a message's data stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Location {
    pub(super) schema: Schema,
    pub(super) chunk: usize,
    /// In the chunk's records.
    pub(super) start: u64,
    pub(super) length: u64,
}

/// The frames of a file.
pub(super) struct Frames {
    pub(super) entries: Vec<Entry>,
    /// Messages whose channel's declaration is lost.
    pub(super) orphans: u64,
}

/// Reads the file once and finds its frames.
pub(super) fn find_frames(
    path: &Path,
    container: &mut Container,
    outline: &mut Outline,
) -> Result<Frames, CaptureError> {
    let mut index =
        Index { path, channels: BTreeMap::new(), schemas: BTreeMap::new(), entries: Vec::new(), orphans: 0 };
    // The summary declares channels again, which helps where the chunk that declares them is damaged.
    for record in records(&outline.summary).flatten() {
        index.add(0, record)?;
    }
    for_each_record(container, outline, |chunk, record| index.add(chunk, record))?;
    Ok(Frames { entries: index.entries, orphans: index.orphans })
}

/// Collects where each frame's messages stand, while the file is read.
struct Index<'a> {
    path: &'a Path,
    /// Every channel that was declared; `None` for those that are not ours.
    channels: BTreeMap<u16, Option<(Schema, bool)>>,
    schemas: BTreeMap<u16, Schema>,
    entries: Vec<Entry>,
    orphans: u64,
}

impl Index<'_> {
    fn add(&mut self, chunk: usize, record: Record) -> Result<(), CaptureError> {
        match record {
            Record::Schema { id, name } => {
                if let Some(schema) = Schema::from_name(name) {
                    self.schemas.insert(id, schema);
                }
            }
            Record::Channel { id, schema_id, metadata, .. } => {
                let is_depth = metadata.get("toile.stream").map(|stream| stream == "depth");
                self.channels.insert(id, self.schemas.get(&schema_id).copied().zip(is_depth));
            }
            Record::Message { channel_id, start, data, .. } => self.add_message(chunk, channel_id, start, data)?,
            Record::Other => {}
        }
        Ok(())
    }

    fn add_message(&mut self, chunk: usize, channel: u16, start: u64, data: &[u8]) -> Result<(), CaptureError> {
        let (schema, is_depth) = match self.channels.get(&channel) {
            Some(Some((Schema::CameraCalibration, _)) | None) => return Ok(()),
            Some(Some(channel)) => *channel,
            None => {
                self.orphans += 1;
                return Ok(());
            }
        };
        let stamp = ImageMessage::decode(schema, data).and_then(|message| message.stamp).ok_or_else(|| {
            CaptureError::format(self.path, format!("an image message in chunk {chunk} is not readable"))
        })?;
        let location = Location { schema, chunk, start, length: data.len() as u64 };
        let entry = self.entry(stamp)?;
        *if is_depth { &mut entry.depth } else { &mut entry.color } = Some(location);
        Ok(())
    }

    /// The frame of that stamp: the last one, or a new one.
    fn entry(&mut self, stamp: Stamp) -> Result<&mut Entry, CaptureError> {
        let is_new = self.entries.last().is_none_or(|last| last.stamp.frame_index != stamp.frame_index);
        if is_new && self.entries.len() >= MAX_FRAMES {
            let reason = format!("has more than {MAX_FRAMES} frames; split the recording");
            return Err(CaptureError::format(self.path, reason));
        }
        if is_new {
            self.entries.push(Entry { stamp, depth: None, color: None });
        }
        let last = self.entries.len() - 1;
        Ok(&mut self.entries[last])
    }
}
