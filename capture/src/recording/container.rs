//! An MCAP file as chunks, with every length checked and torn ends understood.
//!
//! The format: <https://mcap.dev/spec>. Why this is not the `mcap` crate's reader: `docs/decisions/0007-own-mcap-reader.md`.
//! At most one chunk is in memory at a time, and each is unpacked once as long as its frames are read in their order.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    bytes::Cursor,
    loss::Ending,
    records::{OP_CHANNEL, OP_MESSAGE, OP_SCHEMA},
};
use crate::{CaptureError, files::open_regular};

/// The largest chunk that is read, packed or unpacked, bytes. Writers close a chunk after 1 to 4 MiB, or after one image.
const MAX_CHUNK_BYTES: u64 = 128 << 20;
/// The largest metadata record that is read.
const MAX_METADATA_BYTES: u64 = 16 << 20;
/// Records outside of chunks are gathered up to this size, so that they are read like chunks of the usual size.
const LOOSE_CHUNK_BYTES: u64 = 4 << 20;
/// Operation code and length before each record.
const HEAD_BYTES: u64 = 9;

const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
const OP_CHUNK: u8 = 0x06;
const OP_METADATA: u8 = 0x0C;
const OP_DATA_END: u8 = 0x0F;

/// Where a chunk's records stand in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chunk {
    offset: u64,
    pub(super) length: u64,
    packing: Packing,
    /// Of the unpacked records; 0 where the writer did not compute it.
    crc: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Packing {
    /// Records that stand in the file without a chunk around them.
    Loose,
    Plain,
    /// Unpacks to this many bytes.
    Zstd(usize),
}

/// The content of the file, known from the heads of its records alone.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub(super) chunks: Vec<Chunk>,
    /// The content of the metadata record that was asked for, as bytes of a string map.
    pub(super) metadata: Option<Vec<u8>>,
    /// Schema and channel records of the summary section, as they stand in a chunk; empty in a torn file.
    pub(super) summary: Vec<u8>,
    pub(super) ending: Ending,
    /// Where the data end, and their checksum where the writer computed one.
    data_end: Option<(u64, u32)>,
}

/// An MCAP file that is open for reading.
#[derive(Debug)]
pub(super) struct Container {
    path: PathBuf,
    file: File,
    length: u64,
    /// The records of the packed chunk at this offset, which were unpacked last.
    unpacked: Option<(u64, Arc<Vec<u8>>)>,
}

impl Container {
    /// Opens a file and checks that it is MCAP.
    pub(super) fn open(path: &Path) -> Result<Self, CaptureError> {
        let mut file = open_regular(path)?;
        let length = file.metadata().map_err(|error| CaptureError::io(path, error))?.len();
        if length == 0 {
            return Err(CaptureError::format(path, "the file is empty: nothing was recorded into it"));
        }
        let mut magic = Vec::new();
        file.by_ref().take(8).read_to_end(&mut magic).map_err(|error| CaptureError::io(path, error))?;
        if magic != MAGIC {
            return Err(CaptureError::format(path, "is not an MCAP recording (its first bytes are not MCAP's)"));
        }
        Ok(Self { path: path.to_path_buf(), file, length, unpacked: None })
    }

    /// Walks over the heads of all records; keeps the metadata record called `metadata`.
    pub(super) fn outline(&mut self, metadata: &str) -> Result<Outline, CaptureError> {
        let mut outline = Outline::default();
        let mut at = MAGIC.len() as u64;
        while let Some((op, length)) = self.record_head(at)? {
            let body = at + HEAD_BYTES;
            match op {
                OP_CHUNK => match self.chunk(body, length)? {
                    Some(chunk) => outline.chunks.push(chunk),
                    None => outline.ending.add_damaged(length),
                },
                OP_METADATA if length <= MAX_METADATA_BYTES && outline.metadata.is_none() => {
                    outline.metadata = named_content(&self.read(body, length)?, metadata);
                }
                OP_SCHEMA | OP_CHANNEL if outline.ending.closed && length <= MAX_METADATA_BYTES => {
                    outline.summary.extend(self.read(at, HEAD_BYTES + length)?);
                }
                OP_SCHEMA | OP_CHANNEL | OP_MESSAGE if !outline.ending.closed => {
                    if length > MAX_CHUNK_BYTES {
                        return Err(self.too_large(length));
                    }
                    add_loose(&mut outline.chunks, at, HEAD_BYTES + length);
                }
                OP_DATA_END => {
                    outline.ending.closed = true;
                    outline.data_end = Cursor(&self.read(body, length.min(4))?).u32().map(|crc| (at, crc));
                }
                _ => {}
            }
            at = body + length;
        }
        if !outline.ending.closed {
            outline.ending.torn_bytes = self.length.saturating_sub(at);
        }
        Ok(outline)
    }

    /// False where the checksum over all data does not hold; true where it does or there is none.
    pub(super) fn data_are_intact(&mut self, outline: &Outline) -> Result<bool, CaptureError> {
        let Some((end, crc)) = outline.data_end.filter(|(_, crc)| *crc != 0) else { return Ok(true) };
        let wrap = |error| CaptureError::io(&self.path, error);
        self.file.seek(SeekFrom::Start(0)).map_err(wrap)?;
        let (mut hasher, mut block, mut left) = (crc32fast::Hasher::new(), vec![0; 1 << 20], end);
        while left > 0 {
            let part = &mut block[..left.min(1 << 20) as usize];
            self.file.read_exact(part).map_err(wrap)?;
            hasher.update(part);
            left -= part.len() as u64;
        }
        Ok(hasher.finalize() == crc)
    }

    /// Reads a chunk's records and checks them; `None` where they are damaged.
    pub(super) fn checked_records(&mut self, chunk: &Chunk) -> Option<Arc<Vec<u8>>> {
        let records = self.chunk_records(chunk).ok()?;
        (chunk.crc == 0 || crc32fast::hash(&records) == chunk.crc).then_some(records)
    }

    /// Reads `length` bytes at `start` of a chunk's records.
    pub(super) fn read_in_chunk(&mut self, chunk: &Chunk, start: u64, length: u64) -> Result<Vec<u8>, CaptureError> {
        let shorter = || CaptureError::format(&self.path, "a chunk is shorter than it was when the file was opened");
        let end = start.checked_add(length).ok_or_else(shorter)?;
        if !matches!(chunk.packing, Packing::Zstd(_)) {
            return if end <= chunk.length { self.read(chunk.offset + start, length) } else { Err(shorter()) };
        }
        let records = self.chunk_records(chunk)?;
        let bytes = records.get(start as usize..end as usize).map(<[u8]>::to_vec);
        bytes.ok_or_else(|| CaptureError::format(&self.path, "a chunk is shorter than it was when the file was opened"))
    }

    fn chunk_records(&mut self, chunk: &Chunk) -> Result<Arc<Vec<u8>>, CaptureError> {
        let Packing::Zstd(size) = chunk.packing else { return self.read(chunk.offset, chunk.length).map(Arc::new) };
        if let Some((_, records)) = self.unpacked.as_ref().filter(|(offset, _)| *offset == chunk.offset) {
            return Ok(records.clone());
        }
        self.unpacked = None;
        let packed = self.read(chunk.offset, chunk.length)?;
        let records = zstd::bulk::decompress(&packed, size)
            .map_err(|error| CaptureError::format(&self.path, format!("a chunk does not unpack: {error}")))?;
        let records = Arc::new(records);
        self.unpacked = Some((chunk.offset, records.clone()));
        Ok(records)
    }

    /// Operation code and length of the record at `at`; `None` where no whole record is left.
    fn record_head(&mut self, at: u64) -> Result<Option<(u8, u64)>, CaptureError> {
        let Some(left) = self.length.checked_sub(at).and_then(|left| left.checked_sub(HEAD_BYTES)) else {
            return Ok(None);
        };
        let bytes = self.read(at, HEAD_BYTES)?;
        let mut cursor = Cursor(&bytes);
        let head = cursor.u8().zip(cursor.u64());
        Ok(head.filter(|(_, length)| *length <= left))
    }

    /// The chunk whose record body is `length` bytes at `body`; `None` where its head is damaged.
    fn chunk(&mut self, body: u64, length: u64) -> Result<Option<Chunk>, CaptureError> {
        let head = self.read(body, length.min(64))?;
        let Some(head) = ChunkHead::parse(&head) else { return Ok(None) };
        if head.start.checked_add(head.packed) != Some(length) {
            return Ok(None);
        }
        if head.packed > MAX_CHUNK_BYTES {
            return Err(self.too_large(head.packed));
        }
        let offset = body + head.start;
        let packing = match head.compression {
            "" => Packing::Plain,
            "zstd" if head.unpacked <= MAX_CHUNK_BYTES => Packing::Zstd(head.unpacked as usize),
            // A damaged head says another size than the packed bytes themselves.
            "zstd" if self.zstd_size(offset, head.packed)?.is_some_and(|size| size != head.unpacked) => {
                return Ok(None);
            }
            "zstd" => return Err(self.too_large(head.unpacked)),
            other => {
                let reason = format!(
                    "its chunks are compressed with {other}, which is not read here; convert it, for example with \
                     `mcap compress --compression zstd`"
                );
                return Err(CaptureError::format(&self.path, reason));
            }
        };
        Ok(Some(Chunk { offset, length: head.packed, packing, crc: head.crc }))
    }

    /// The unpacked size that the packed bytes themselves claim.
    fn zstd_size(&mut self, offset: u64, packed: u64) -> Result<Option<u64>, CaptureError> {
        // A frame's head has at most 18 bytes.
        let head = self.read(offset, packed.min(18))?;
        Ok(zstd::zstd_safe::get_frame_content_size(&head).ok().flatten())
    }

    fn too_large(&self, bytes: u64) -> CaptureError {
        let reason = format!(
            "a chunk has {} MiB of records, but at most {} MiB are read at a time; write it anew with smaller chunks, for \
             example with `mcap compress --chunk-size 4194304`",
            bytes >> 20,
            MAX_CHUNK_BYTES >> 20
        );
        CaptureError::format(&self.path, reason)
    }

    /// Reads `length` bytes, which the caller knows to be in the file.
    fn read(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, CaptureError> {
        let mut bytes = vec![0; length as usize];
        let read = self.file.seek(SeekFrom::Start(offset)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|error| CaptureError::io(&self.path, error))?;
        Ok(bytes)
    }
}

/// The head of a chunk, before its records.
struct ChunkHead<'a> {
    unpacked: u64,
    crc: u32,
    compression: &'a str,
    packed: u64,
    /// Bytes of this head.
    start: u64,
}

impl<'a> ChunkHead<'a> {
    fn parse(bytes: &'a [u8]) -> Option<Self> {
        let mut cursor = Cursor(bytes);
        cursor.take(16)?;
        let (unpacked, crc) = (cursor.u64()?, cursor.u32()?);
        let (compression, packed) = (cursor.string()?, cursor.u64()?);
        Some(Self { unpacked, crc, compression, packed, start: (bytes.len() - cursor.0.len()) as u64 })
    }
}

/// Adds a record that stands outside of all chunks.
fn add_loose(chunks: &mut Vec<Chunk>, at: u64, length: u64) {
    match chunks.last_mut() {
        Some(last)
            if last.packing == Packing::Loose
                && last.offset + last.length == at
                && last.length + length <= LOOSE_CHUNK_BYTES =>
        {
            last.length += length;
        }
        _ => chunks.push(Chunk { offset: at, length, packing: Packing::Loose, crc: 0 }),
    }
}

/// The content after the name in a metadata record, where the name is `name`.
fn named_content(bytes: &[u8], name: &str) -> Option<Vec<u8>> {
    let mut cursor = Cursor(bytes);
    (cursor.string()? == name).then(|| cursor.0.to_vec())
}
