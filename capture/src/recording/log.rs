//! A recording of another program as messages by channel, whatever they mean.

use std::{collections::BTreeMap, path::Path};

use super::{
    container::{Chunk, Container},
    loss::Loss,
    metadata,
    records::Record,
    scan::for_each_record,
};
use crate::CaptureError;

/// A channel of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LogChannel {
    pub(crate) topic: String,
    pub(crate) schema: String,
    pub(crate) encoding: String,
}

/// Where a message's data are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    chunk: usize,
    start: u64,
    length: u64,
}

/// A message of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LogMessage {
    /// Its channel, by index.
    pub(crate) channel: usize,
    /// Nanoseconds.
    pub(crate) log_time: u64,
    pub(crate) place: Place,
}

/// An MCAP file as messages.
#[derive(Debug)]
pub(crate) struct MessageLog {
    container: Container,
    chunks: Vec<Chunk>,
    loss: Option<Loss>,
}

impl MessageLog {
    /// Opens a file; gives it with its channels and messages in the order of the file.
    ///
    /// # Errors
    /// [`CaptureError`] where it cannot be read, or is a recording of this program, which is read otherwise.
    pub(crate) fn open(path: &Path) -> Result<(Self, Vec<LogChannel>, Vec<LogMessage>), CaptureError> {
        let mut container = Container::open(path)?;
        let mut outline = container.outline(metadata::NAME)?;
        if outline.metadata.is_some() {
            return Err(CaptureError::format(path, "is a recording of Toile's own"));
        }
        let (mut schemas, mut index) = (BTreeMap::new(), BTreeMap::new());
        let (mut channels, mut messages) = (Vec::new(), Vec::new());
        for_each_record(&mut container, &mut outline, |chunk, record| {
            match record {
                Record::Schema { id, name } => drop(schemas.insert(id, name.to_string())),
                Record::Channel { id, schema_id, topic, encoding, .. } => {
                    let schema = schemas.get(&schema_id).cloned().unwrap_or_default();
                    index.entry(id).or_insert_with(|| {
                        channels.push(LogChannel { topic: topic.to_string(), schema, encoding: encoding.to_string() });
                        channels.len() - 1
                    });
                }
                Record::Message { channel_id, log_time, start, data } => {
                    let place = Place { chunk, start, length: data.len() as u64 };
                    messages.extend(index.get(&channel_id).map(|&channel| LogMessage { channel, log_time, place }));
                }
                Record::Other => {}
            }
            Ok(())
        })?;
        let loss = outline.ending.loss(messages.len() as u64, None, 0);
        Ok((Self { container, chunks: outline.chunks, loss }, channels, messages))
    }

    /// The losses, where the file is torn or damaged.
    pub(crate) fn take_loss(&mut self) -> Option<Loss> {
        self.loss.take()
    }

    /// The data of a message.
    ///
    /// # Errors
    /// [`CaptureError`] where the file changed since it was opened.
    pub(crate) fn read(&mut self, place: Place) -> Result<Vec<u8>, CaptureError> {
        self.container.read_in_chunk(&self.chunks[place.chunk], place.start, place.length)
    }
}
