//! The header of a PLY file: its format, elements and their properties.

/// Maximum count of an element; a torn header must not keep the reader busy.
const MAX_ELEMENTS: usize = 200_000_000;
/// Maximum number of elements and of properties: files have a handful, and every one costs memory.
const MAX_PROPERTIES: usize = 1000;

/// How numbers are written after the header.
#[derive(Clone, Copy)]
pub(super) enum Format {
    Ascii,
    Binary { big_endian: bool },
}

/// Type of a number.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Result<Self, String> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            other => return Err(format!("the header has a property of unknown type \"{other}\"")),
        })
    }

    /// Bytes of a number in binary files.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A property of an element: one number, or a list where `list_count` gives the type of its length.
pub(super) struct Property {
    pub name: String,
    pub list_count: Option<Scalar>,
    pub scalar: Scalar,
}

/// A table of the file.
pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

/// The content of the header.
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
}

/// Reads the header; returns it and the bytes that follow.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    if !bytes.starts_with(b"ply") {
        return Err("is not a PLY file: it does not start with \"ply\"".into());
    }
    let end = find(bytes, b"end_header").ok_or("the PLY header has no end: end_header is missing")?;
    let body = find(&bytes[end..], b"\n").map(|n| &bytes[end + n + 1..]).ok_or("the file ends in its header")?;
    let text = String::from_utf8_lossy(&bytes[..end]);
    let mut header = Header { format: Format::Ascii, elements: Vec::new() };
    text.lines().try_for_each(|line| read_line(&mut header, line))?;
    match header.elements.iter().find(|e| e.count > 0 && e.properties.is_empty()) {
        Some(element) => Err(format!("element \"{}\" of the header lacks properties", element.name)),
        None => Ok((header, body)),
    }
}

fn read_line(header: &mut Header, line: &str) -> Result<(), String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words[..] {
        ["format", "ascii", _] => header.format = Format::Ascii,
        ["format", "binary_little_endian", _] => header.format = Format::Binary { big_endian: false },
        ["format", "binary_big_endian", _] => header.format = Format::Binary { big_endian: true },
        ["format", other, ..] => return Err(format!("the header names the unknown format \"{other}\"")),
        ["element", name, count] => {
            let count = count.parse().ok().filter(|&n| n <= MAX_ELEMENTS);
            let count = count.ok_or(format!("\"{line}\" in the header needs a count from 0 to {MAX_ELEMENTS}"))?;
            header.elements.push(Element { name: name.into(), count, properties: Vec::new() });
        }
        ["property", "list", count, scalar, name] => {
            return push_property(header, name, Some(Scalar::parse(count)?), Scalar::parse(scalar)?);
        }
        ["property", scalar, name] => return push_property(header, name, None, Scalar::parse(scalar)?),
        _ => {}
    }
    Ok(())
}

fn push_property(header: &mut Header, name: &str, list_count: Option<Scalar>, scalar: Scalar) -> Result<(), String> {
    let count = header.elements.iter().map(|e| 1 + e.properties.len()).sum::<usize>();
    let element = header.elements.last_mut().ok_or("the header has a property before any element")?;
    if count >= MAX_PROPERTIES {
        return Err(format!("the header has more than {MAX_PROPERTIES} elements and properties"));
    }
    element.properties.push(Property { name: name.into(), list_count, scalar });
    Ok(())
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|w| w == what)
}
