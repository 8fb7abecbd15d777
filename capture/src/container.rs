//! Reading MCAP records from a file chunk by chunk, with every length checked and torn ends understood.
//!
//! The format: <https://mcap.dev/spec>. Only one chunk is in memory at a time.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use crate::{CaptureError, files::open_regular};

/// The largest chunk that is read; ours stay near 4 MiB.
const MAX_CHUNK_BYTES: u64 = 512 << 20;
/// The largest metadata record that is read.
const MAX_METADATA_BYTES: u64 = 16 << 20;

const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
const OP_SCHEMA: u8 = 0x03;
const OP_CHANNEL: u8 = 0x04;
const OP_MESSAGE: u8 = 0x05;
const OP_CHUNK: u8 = 0x06;
const OP_METADATA: u8 = 0x0C;
const OP_DATA_END: u8 = 0x0F;

/// Where a chunk's records stand in the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chunk {
    offset: u64,
    pub(crate) length: u64,
    uncompressed: u64,
    zstd: bool,
    crc: u32,
}

/// How a scan ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Ending {
    /// True when the end of the data was reached as the writer meant it.
    pub(crate) closed: bool,
    /// Bytes after the last whole record.
    pub(crate) torn_bytes: u64,
    /// Chunks whose checksum did not hold.
    pub(crate) damaged_chunks: u32,
    /// Bytes in them.
    pub(crate) damaged_bytes: u64,
}

impl Ending {
    /// Counts a chunk of `bytes` bytes as damaged.
    pub(crate) fn add_damaged(&mut self, bytes: u64) {
        self.damaged_chunks += 1;
        self.damaged_bytes += bytes;
    }
}

/// One record inside a chunk.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Record<'a> {
    /// A schema's id and name.
    Schema { id: u16, name: &'a str },
    /// A channel.
    Channel { id: u16, schema_id: u16, metadata: BTreeMap<String, String> },
    /// A message, with where its data starts in the chunk's records.
    Message { channel_id: u16, start: usize, data: &'a [u8] },
}

/// What stands in the file, known from the heads of its records alone.
#[derive(Debug, Default)]
pub(crate) struct Outline {
    pub(crate) chunks: Vec<Chunk>,
    pub(crate) metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Schema and channel records of the summary section, as they stand in a chunk; empty in a torn file.
    pub(crate) summary: Vec<u8>,
    pub(crate) ending: Ending,
}

/// An MCAP file that is open for reading.
#[derive(Debug)]
pub(crate) struct Container {
    pub(crate) path: PathBuf,
    file: File,
    length: u64,
}

impl Container {
    /// Opens a file and checks that it is MCAP.
    pub(crate) fn open(path: &Path) -> Result<Self, CaptureError> {
        let mut file = open_regular(path)?;
        let length = file.metadata().map_err(|error| CaptureError::io(path, error))?.len();
        if length == 0 {
            return Err(CaptureError::format(path, "the file is empty: nothing was recorded into it"));
        }
        let mut magic = Vec::new();
        file.by_ref().take(8).read_to_end(&mut magic).map_err(|error| CaptureError::io(path, error))?;
        if magic != MAGIC {
            return Err(CaptureError::format(path, "is no MCAP recording (its first bytes are not MCAP's)"));
        }
        Ok(Self { path: path.to_path_buf(), file, length })
    }

    /// Walks over the heads of all records.
    pub(crate) fn outline(&mut self) -> Result<Outline, CaptureError> {
        let mut outline = Outline::default();
        let mut at = MAGIC.len() as u64;
        while at < self.length {
            let Some((op, length)) = self.record_header(at)? else { break };
            let body = at + 9;
            match op {
                OP_CHUNK => match self.parse_chunk(body, length)? {
                    Some(chunk) => outline.chunks.push(chunk),
                    None => outline.ending.add_damaged(length),
                },
                OP_METADATA if length <= MAX_METADATA_BYTES => {
                    let bytes = self.read(body, length)?;
                    outline.metadata.extend(parse_metadata(&bytes));
                }
                OP_SCHEMA | OP_CHANNEL if outline.ending.closed && length <= MAX_METADATA_BYTES => {
                    outline.summary.extend(self.read(at, 9 + length)?);
                }
                OP_DATA_END => outline.ending.closed = true,
                _ => {}
            }
            at = body + length;
        }
        if !outline.ending.closed {
            outline.ending.torn_bytes = self.length.saturating_sub(at);
        }
        Ok(outline)
    }

    /// Reads a chunk's records and checks them; `None` where they are damaged.
    pub(crate) fn checked_records(&mut self, chunk: &Chunk) -> Option<Vec<u8>> {
        let records = self.chunk_records(chunk).ok()?;
        (chunk.crc == 0 || crc32fast::hash(&records) == chunk.crc).then_some(records)
    }

    fn chunk_records(&mut self, chunk: &Chunk) -> Result<Vec<u8>, CaptureError> {
        let bytes = self.read(chunk.offset, chunk.length)?;
        if !chunk.zstd {
            return Ok(bytes);
        }
        zstd::bulk::decompress(&bytes, chunk.uncompressed as usize)
            .map_err(|error| CaptureError::format(&self.path, format!("a chunk does not unpack: {error}")))
    }

    /// Reads `length` bytes at `start` of a chunk's records.
    pub(crate) fn read_in_chunk(&mut self, chunk: &Chunk, start: u64, length: u64) -> Result<Vec<u8>, CaptureError> {
        if !chunk.zstd {
            return self.read(chunk.offset + start, length);
        }
        let records = self.chunk_records(chunk)?;
        let range = start as usize..(start + length) as usize;
        let message = records.get(range).map(<[u8]>::to_vec);
        message.ok_or_else(|| CaptureError::format(&self.path, "a chunk is shorter than it was when it was opened"))
    }

    /// Operation code and length of the record at `at`; `None` where it does not fit into the file.
    fn record_header(&mut self, at: u64) -> Result<Option<(u8, u64)>, CaptureError> {
        if self.length - at < 9 {
            return Ok(None);
        }
        let bytes = self.read(at, 9)?;
        let mut cursor = Cursor(&bytes);
        let (Some(op), Some(length)) = (cursor.u8(), cursor.u64()) else { return Ok(None) };
        let fits = length <= self.length - at - 9;
        Ok(fits.then_some((op, length)))
    }

    fn parse_chunk(&mut self, body: u64, length: u64) -> Result<Option<Chunk>, CaptureError> {
        let head = self.read(body, length.min(64))?;
        let mut cursor = Cursor(&head);
        let head = (|| {
            cursor.take(16)?;
            let (uncompressed, crc) = (cursor.u64()?, cursor.u32()?);
            Some((uncompressed, crc, cursor.string()?.to_string(), cursor.u64()?))
        })();
        let Some((uncompressed, crc, compression, records)) = head else { return Ok(None) };
        let start = 16 + 8 + 4 + 4 + compression.len() as u64 + 8;
        if start + records != length || uncompressed > MAX_CHUNK_BYTES || length > MAX_CHUNK_BYTES {
            return Ok(None);
        }
        let zstd = match compression.as_str() {
            "" => false,
            "zstd" => true,
            other => {
                let reason =
                    format!("its chunks are compressed with {other}, which is not read here; use none or zstd");
                return Err(CaptureError::format(&self.path, reason));
            }
        };
        Ok(Some(Chunk { offset: body + start, length: records, uncompressed, zstd, crc }))
    }

    fn read(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, CaptureError> {
        let mut bytes = vec![0; length as usize];
        let read = self.file.seek(SeekFrom::Start(offset)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|error| CaptureError::io(&self.path, error))?;
        Ok(bytes)
    }
}

/// The schemas, channels and messages of a chunk; `None` where its bytes are not records.
pub(crate) fn records(bytes: &[u8]) -> Option<Vec<Record<'_>>> {
    let mut records = Vec::new();
    let mut cursor = Cursor(bytes);
    while !cursor.0.is_empty() {
        let op = cursor.u8()?;
        let length = usize::try_from(cursor.u64()?).ok()?;
        let mut body = Cursor(cursor.take(length)?);
        match op {
            OP_SCHEMA => records.push(Record::Schema { id: body.u16()?, name: body.string()? }),
            OP_CHANNEL => {
                let (id, schema_id) = (body.u16()?, body.u16()?);
                body.string()?;
                body.string()?;
                records.push(Record::Channel { id, schema_id, metadata: body.map()? });
            }
            OP_MESSAGE => {
                let channel_id = body.u16()?;
                body.take(20)?;
                let start = bytes.len() - cursor.0.len() - body.0.len();
                records.push(Record::Message { channel_id, start, data: body.0 });
            }
            _ => {}
        }
    }
    Some(records)
}

fn parse_metadata(bytes: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut cursor = Cursor(bytes);
    Some((cursor.string()?.to_string(), cursor.map()?))
}

/// Takes little-endian values from the front of bytes.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()? as usize;
        let mut pairs = Cursor(self.take(length)?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.string()?.to_string(), pairs.string()?.to_string());
        }
        Some(map)
    }
}
