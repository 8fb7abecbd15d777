//! Numbers in glTF's buffers, with every offset and length checked.

use std::borrow::Cow;

use super::{
    super::{Beside, MAX_BYTES},
    json::{Accessor, Root},
};

/// The JSON with the bytes of its buffers.
pub(super) struct File<'a> {
    pub root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> File<'a> {
    pub(super) fn new(root: &'a Root, binary: Option<&'a [u8]>, beside: &Beside) -> Result<Self, String> {
        let buffer = |(k, buffer): (usize, &super::json::Buffer)| -> Result<Cow<'a, [u8]>, String> {
            let bytes: Cow<'a, [u8]> = match (&buffer.uri, binary) {
                (Some(uri), _) => match data_uri(uri) {
                    Some(bytes) => bytes?.into(),
                    None => beside.read(&unescape(uri), MAX_BYTES)?.into(),
                },
                (None, Some(binary)) if k == 0 => binary.into(),
                (None, _) => return Err(format!("buffer {k} is nowhere: neither in the file nor beside it")),
            };
            if bytes.len() < buffer.byte_length {
                return Err(format!("is cut off: buffer {k} holds {} of {} bytes", bytes.len(), buffer.byte_length));
            }
            Ok(bytes)
        };
        Ok(Self { root, buffers: root.buffers.iter().enumerate().map(buffer).collect::<Result<_, _>>()? })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], String> {
        let wrong = || format!("buffer view {index} lies outside of its buffer");
        let view = self.root.buffer_views.get(index).ok_or_else(wrong)?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(wrong)?;
        buffer.get(view.byte_offset..).and_then(|rest| rest.get(..view.byte_length)).ok_or_else(wrong)
    }

    /// The numbers of an accessor with `N` components an element, as they count: normalised integers from −1 or 0 to 1.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, String> {
        let (accessor, elements) = self.elements(index, N)?;
        let (component, normalized) = (accessor.component_type, accessor.normalized);
        let size = component_size(component);
        Ok(elements.map(|e| std::array::from_fn(|k| float(&e[k * size..], component, normalized))).collect())
    }

    /// The whole numbers of an accessor with `N` components an element.
    pub(super) fn whole<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, String> {
        let (accessor, elements) = self.elements(index, N)?;
        let (component, size) = (accessor.component_type, component_size(accessor.component_type));
        if !matches!(component, 5121 | 5123 | 5125) {
            return Err(format!("accessor {index} must hold whole numbers"));
        }
        Ok(elements.map(|e| std::array::from_fn(|k| whole(&e[k * size..], component))).collect())
    }

    /// The number of components an element of an accessor has.
    pub(super) fn components(&self, index: usize) -> usize {
        self.root.accessors.get(index).map_or(0, |accessor| components(&accessor.shape))
    }

    /// The bytes of each element.
    fn elements(&self, index: usize, width: usize) -> Result<(&Accessor, impl Iterator<Item = &[u8]>), String> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| format!("accessor {index} is missing"))?;
        let size = component_size(accessor.component_type) * width;
        if components(&accessor.shape) != width || size == 0 {
            return Err(format!(
                "accessor {index} is a {} of a type that has no place there",
                super::super::printable(&accessor.shape)
            ));
        }
        if accessor.sparse.is_some() {
            return Err(format!("accessor {index} is sparse, which is not read; export it without sparse accessors"));
        }
        let Some(view) = accessor.buffer_view else {
            return Err(format!("accessor {index} has no data; it may be compressed: export without compression"));
        };
        let stride = self.root.buffer_views.get(view).and_then(|v| v.byte_stride).unwrap_or(size);
        let bytes = self.view(view)?.get(accessor.byte_offset..).unwrap_or_default();
        let needed = accessor.count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        if stride < size || needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(format!("accessor {index} of {} elements lies outside of its buffer", accessor.count));
        }
        Ok((accessor, (0..accessor.count).map(move |i| &bytes[i * stride..i * stride + size])))
    }
}

fn components(shape: &str) -> usize {
    match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => 0,
    }
}

fn component_size(kind: u32) -> usize {
    match kind {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => 0,
    }
}

fn whole(b: &[u8], kind: u32) -> u32 {
    match kind {
        5121 => u32::from(b[0]),
        5123 => u32::from(u16::from_le_bytes([b[0], b[1]])),
        _ => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
    }
}

fn float(b: &[u8], kind: u32, normalized: bool) -> f32 {
    let (value, most) = match kind {
        5126 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        5120 => (f32::from(b[0] as i8), 127.0),
        5121 => (f32::from(b[0]), 255.0),
        5122 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
        5123 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
        _ => return whole(b, kind) as f32,
    };
    if normalized { (value / most).max(-1.0) } else { value }
}

/// The bytes of a data URI in base 64; `None` where it is the name of a file.
pub(super) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let (head, text) = uri.strip_prefix("data:")?.split_once(',')?;
    if !head.ends_with("base64") {
        return Some(Err("has a data URI that is not in base 64".into()));
    }
    Some(base64(text).ok_or_else(|| "has a data URI that is damaged".into()))
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let value = |b: u8| match b {
        b'A'..=b'Z' => Some(b - b'A'),
        b'a'..=b'z' => Some(b - b'a' + 26),
        b'0'..=b'9' => Some(b - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    };
    let (mut bytes, mut bits, mut count) = (Vec::with_capacity(text.len() / 4 * 3), 0_u32, 0);
    for b in text.trim_end_matches('=').bytes() {
        bits = bits << 6 | u32::from(value(b)?);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}

/// A URI's name of a file: `%20` is a blank, and so on.
pub(super) fn unescape(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, behind @ ..] = rest {
        let code = behind.get(..2).and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        match code.filter(|_| *first == b'%') {
            Some(code) => (bytes.push(code), rest = &behind[2..]),
            None => (bytes.push(*first), rest = behind),
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
