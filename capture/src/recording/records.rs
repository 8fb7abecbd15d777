//! The records inside a chunk.

use std::collections::BTreeMap;

use super::bytes::Cursor;

pub(super) const OP_SCHEMA: u8 = 0x03;
pub(super) const OP_CHANNEL: u8 = 0x04;
pub(super) const OP_MESSAGE: u8 = 0x05;

/// One record inside a chunk.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Record<'a> {
    /// A schema's id and name.
    Schema { id: u16, name: &'a str },
    /// A channel.
    Channel { id: u16, schema_id: u16, topic: &'a str, encoding: &'a str, metadata: BTreeMap<String, String> },
    /// A message: its log time in nanoseconds, and its data with where they start in the chunk's records.
    Message { channel_id: u16, log_time: u64, start: u64, data: &'a [u8] },
    /// Anything else.
    Other,
}

/// The records of a chunk, one by one; `None` at the first bytes that are not a record.
pub(super) struct Records<'a> {
    cursor: Cursor<'a>,
    length: usize,
}

/// The records in `bytes`.
pub(super) fn records(bytes: &[u8]) -> Records<'_> {
    Records { cursor: Cursor(bytes), length: bytes.len() }
}

impl<'a> Records<'a> {
    fn take_record(&mut self) -> Option<Record<'a>> {
        let op = self.cursor.u8()?;
        let length = usize::try_from(self.cursor.u64()?).ok()?;
        let mut body = Cursor(self.cursor.take(length)?);
        Some(match op {
            OP_SCHEMA => Record::Schema { id: body.u16()?, name: body.string()? },
            OP_CHANNEL => Record::Channel {
                id: body.u16()?,
                schema_id: body.u16()?,
                topic: body.string()?,
                encoding: body.string()?,
                metadata: body.map()?,
            },
            OP_MESSAGE => {
                let channel_id = body.u16()?;
                body.u32()?;
                let log_time = body.u64()?;
                body.u64()?;
                let start = self.length - self.cursor.0.len() - body.0.len();
                Record::Message { channel_id, log_time, start: start as u64, data: body.0 }
            }
            _ => Record::Other,
        })
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Option<Record<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.cursor.0.is_empty() {
            return None;
        }
        let record = self.take_record();
        if record.is_none() {
            self.cursor = Cursor(&[]);
        }
        Some(record)
    }
}
