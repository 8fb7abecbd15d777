//! EBML, the tree of elements that Matroska files are made of (RFC 8794): each an id, a length, and its data.

use std::io::{Read, Seek, SeekFrom};

/// The longest head of an element: four bytes of id, eight of length.
const HEAD: u64 = 12;

/// An element in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) id: u32,
    /// Where its data begin.
    pub(super) start: u64,
    /// Where they end; `None` where the writer did not know yet. It may lie beyond the file.
    pub(super) end: Option<u64>,
}

/// A file of elements.
#[derive(Debug)]
pub(super) struct Ebml<R> {
    reader: R,
    /// Bytes in it.
    pub(super) length: u64,
}

impl<R: Read + Seek> Ebml<R> {
    /// # Errors
    /// The system's message.
    pub(super) fn new(mut reader: R) -> Result<Self, String> {
        let length = reader.seek(SeekFrom::End(0)).map_err(|error| error.to_string())?;
        Ok(Self { reader, length })
    }

    /// The head of the element at a place; `None` where there is none, or the file ends in it.
    ///
    /// # Errors
    /// The system's message.
    pub(super) fn element(&mut self, at: u64) -> Result<Option<Element>, String> {
        let head = self.bytes(at, HEAD)?;
        Ok(parse_head(&head).map(|(id, size, length)| {
            let start = at + length;
            Element { id, start, end: size.map(|size| start.saturating_add(size)) }
        }))
    }

    /// Up to `count` bytes from a place; fewer where the file ends.
    ///
    /// # Errors
    /// The system's message.
    pub(super) fn bytes(&mut self, at: u64, count: u64) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let read =
            self.reader.seek(SeekFrom::Start(at)).and_then(|_| (&mut self.reader).take(count).read_to_end(&mut bytes));
        read.map(|_| bytes).map_err(|error| error.to_string())
    }

    /// The data of an element of at most `limit` bytes; `None` where it is longer or the file ends in it.
    ///
    /// # Errors
    /// The system's message.
    pub(super) fn data(&mut self, element: &Element, limit: u64) -> Result<Option<Vec<u8>>, String> {
        let Some(length) = element.end.map(|end| end - element.start).filter(|length| *length <= limit) else {
            return Ok(None);
        };
        let bytes = self.bytes(element.start, length)?;
        Ok(Some(bytes).filter(|bytes| bytes.len() as u64 == length))
    }
}

/// Id, length of the data (`None`: not known) and length of the head.
fn parse_head(bytes: &[u8]) -> Option<(u32, Option<u64>, u64)> {
    let id_length = bytes.first()?.leading_zeros() as usize + 1;
    if id_length > 4 {
        return None;
    }
    let id = bytes.get(..id_length)?.iter().fold(0, |id, byte| id << 8 | u32::from(*byte));
    let (size, size_length) = parse_length(bytes.get(id_length..)?)?;
    Some((id, size, (id_length + size_length) as u64))
}

/// A length of variable size and how many bytes it takes; all ones mean that it is not known.
pub(super) fn parse_length(bytes: &[u8]) -> Option<(Option<u64>, usize)> {
    let count = bytes.first()?.leading_zeros() as usize + 1;
    if count > 8 {
        return None;
    }
    let value = bytes.get(..count)?.iter().fold(0, |value, byte| value << 8 | u64::from(*byte));
    let mask = (1_u64 << (7 * count)) - 1;
    let value = value & mask;
    Some(((value != mask).then_some(value), count))
}

/// The elements in the data of another one, up to the first that is not whole.
pub(super) fn children(mut bytes: &[u8]) -> Vec<(u32, &[u8])> {
    let mut list = Vec::new();
    while let Some((id, Some(size), head)) = parse_head(bytes) {
        let data = usize::try_from(size).ok().and_then(|size| bytes.get(head as usize..)?.get(..size));
        let Some(data) = data else { break };
        list.push((id, data));
        bytes = &bytes[head as usize + data.len()..];
    }
    list
}

/// A whole number.
pub(super) fn unsigned(bytes: &[u8]) -> Option<u64> {
    (bytes.len() <= 8).then(|| bytes.iter().fold(0, |value, byte| value << 8 | u64::from(*byte)))
}

/// A text without the zeros that may fill it up.
pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_and_lengths_of_every_size() {
        assert_eq!(parse_head(&[0xec, 0x81, 7]), Some((0xec, Some(1), 2)));
        assert_eq!(parse_head(&[0x1f, 0x43, 0xb6, 0x75, 0x40, 0x80]), Some((0x1f43_b675, Some(128), 6)));
        assert_eq!(parse_head(&[0xa3, 0xff]), Some((0xa3, None, 2)), "not known yet");
        assert_eq!(parse_head(&[0xa3, 0x01, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff]), Some((0xa3, None, 9)));
        assert_eq!((parse_head(&[0x08, 0x81]), parse_head(&[0xa3, 0x00]), parse_head(&[])), (None, None, None));
        assert_eq!(children(&[0xd7, 0x81, 5, 0x83, 0x82, 1]), [(0xd7, &[5][..])], "the second one is cut off");
        assert_eq!((unsigned(&[1, 2]), unsigned(&[0; 9]), text(b"MJPG\0\0").as_str()), (Some(258), None, "MJPG"));
    }
}
