//! Configuration descriptors to camera parts, streams, formats and sizes, pure.

use crate::video::FourCc;

/// One picture size of a format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureSize {
    /// `bFrameIndex`.
    pub index: u8,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Intervals on offer, units of 100 ns, up to 8.
    pub intervals: [u32; 8],
}

/// A format of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamFormat {
    /// `bFormatIndex`.
    pub index: u8,
    /// Its identity.
    pub code: FourCc,
    /// Its sizes.
    pub sizes: Vec<PictureSize>,
}

/// A streaming interface.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Streaming {
    /// Its number.
    pub interface: u8,
    /// Its endpoint.
    pub endpoint: u8,
    /// Alternate settings and the bytes that a microframe has there; none where it is a bulk endpoint.
    pub alternates: Vec<(u8, usize)>,
    /// Its formats.
    pub formats: Vec<StreamFormat>,
}

/// A camera part: a control interface and its streams.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Function {
    /// Number of the control interface.
    pub interface: u8,
    /// Its extension units.
    pub extensions: Vec<u8>,
    /// Its streams, in the order of the control interface's list.
    pub streams: Vec<Streaming>,
}

/// The camera parts of a configuration descriptor.
pub fn functions(configuration: &[u8]) -> Vec<Function> {
    let (mut found, mut streams): (Vec<(Function, Vec<u8>)>, Vec<Streaming>) = (Vec::new(), Vec::new());
    let (mut interface, mut alternate, mut kind) = (0, 0, 0);
    let mut rest = configuration;
    while let [length, tag, ..] = *rest {
        let Some((bytes, after)) = rest.split_at_checked(usize::from(length).max(2)) else { break };
        rest = after;
        let byte = |i: usize| bytes.get(i).copied().unwrap_or(0);
        let here = streams.iter_mut().find(|s| s.interface == interface);
        match (tag, byte(2), kind) {
            (4, number, _) => {
                (interface, alternate, kind) = (number, byte(3), if byte(5) == 14 { byte(6) } else { 0 });
                if kind == 2 && here.is_none_or(|s| s.interface != number) && alternate == 0 {
                    streams.push(Streaming { interface, ..Streaming::default() });
                }
            }
            (0x24, 1, 1) => {
                found.push((Function { interface, ..Function::default() }, bytes[12.min(bytes.len())..].to_vec()));
            }
            (0x24, 6, 1) => found.iter_mut().for_each(|(f, _)| {
                if f.interface == interface {
                    f.extensions.push(byte(3));
                }
            }),
            (0x24, 4 | 6, 2) => here.into_iter().for_each(|s| {
                s.formats.push(StreamFormat { index: byte(3), code: code(byte(2), bytes), sizes: Vec::new() });
            }),
            (0x24, 5 | 7, 2) => {
                here.and_then(|s| s.formats.last_mut()).into_iter().for_each(|f| f.sizes.push(size(bytes)));
            }
            (5, endpoint, 2) => here.into_iter().for_each(|s| {
                s.endpoint = endpoint;
                let stated = usize::from(u16::from_le_bytes([byte(4), byte(5)]));
                if byte(3) & 3 == 1 {
                    // Bits 12:11 say how many more transactions a microframe has (USB 2.0 §9.6.6).
                    s.alternates.push((alternate, (stated & 0x7ff) * (1 + (stated >> 11 & 3))));
                }
            }),
            _ => {}
        }
    }
    let of = |(mut function, numbers): (Function, Vec<u8>)| {
        function.streams = numbers.iter().filter_map(|n| streams.iter().find(|s| s.interface == *n).cloned()).collect();
        function
    };
    found.into_iter().map(of).collect()
}

/// The code that stands in the first bytes of a format's GUID; two have another name in V4L2 (`uvc_fmts`).
fn code(subtype: u8, bytes: &[u8]) -> FourCc {
    match bytes.get(5..9) {
        _ if subtype == 6 => FourCc::MJPG,
        Some(b"YUY2") => FourCc::YUYV,
        Some(b"Y800" | b"2\0\0\0") => FourCc::GREY,
        Some(stated) => FourCc([stated[0], stated[1], stated[2], stated[3]]),
        None => FourCc([0; 4]),
    }
}

fn size(bytes: &[u8]) -> PictureSize {
    let byte = |i: usize| bytes.get(i).copied().unwrap_or(0);
    let short = |i| u32::from(u16::from_le_bytes([byte(i), byte(i + 1)]));
    let long = |i| u32::from_le_bytes([byte(i), byte(i + 1), byte(i + 2), byte(i + 3)]);
    let count = usize::from(byte(25)).min(8);
    let intervals = std::array::from_fn(|i| if i < count { long(26 + 4 * i) } else { 0 });
    PictureSize { index: byte(3), width: short(5), height: short(7), intervals }
}
