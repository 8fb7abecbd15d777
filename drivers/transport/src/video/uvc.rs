//! What Linux' `uvcvideo` does between USB and a video node, pure: descriptors to streams, payloads to pictures.
//!
//! Facts: USB Device Class Definition for Video Devices 1.1 (chapters 2.4.3 and 3), and `uvc_driver.c`, `uvc_video.c`
//! (`uvc_video_decode_start`, `_data`, `_end`, `_meta`) of Linux 6.1. Nothing is believed that a device says of lengths.

use super::FourCc;

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
    /// What it is.
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
                found.push((Function { interface, ..Function::default() }, bytes[12.min(bytes.len())..].to_vec()))
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
                here.and_then(|s| s.formats.last_mut()).into_iter().for_each(|f| f.sizes.push(size(bytes)))
            }
            (5, endpoint, 2) => here.into_iter().for_each(|s| {
                s.endpoint = endpoint;
                let told = usize::from(u16::from_le_bytes([byte(4), byte(5)]));
                if byte(3) & 3 == 1 {
                    // Bits 12:11 say how many more transactions a microframe has (USB 2.0 §9.6.6).
                    s.alternates.push((alternate, (told & 0x7ff) * (1 + (told >> 11 & 3))));
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
        Some(told) => FourCc([told[0], told[1], told[2], told[3]]),
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

/// A picture as it was sent.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sent {
    /// Its bytes.
    pub picture: Vec<u8>,
    /// Headers of its payloads where they differ, each behind eight bytes of host time and two of the bus' frame number
    /// (`struct uvc_meta_buf` of `linux/uvcvideo.h`).
    pub metadata: Vec<u8>,
    /// The driver's number.
    pub sequence: u32,
    /// Bytes are missing or were damaged.
    pub is_damaged: bool,
    /// When its first payload came.
    pub time_ns: i64,
}

/// Payloads to pictures.
#[derive(Debug, Clone)]
pub struct Assembler {
    /// Bytes of every picture; 0 for those that differ (JPEG).
    size: usize,
    /// Room of a buffer.
    room: usize,
    whole_headers: bool,
    last_id: Option<bool>,
    sequence: u32,
    last_clock: Vec<u8>,
    begun: Option<Sent>,
}

/// Bits of a payload's header (UVC 1.1, table 2-5).
const FRAME_ID: u8 = 0x01;
const END: u8 = 0x02;
const HAS_TIME: u8 = 0x04;
const HAS_CLOCK: u8 = 0x08;
const ERROR: u8 = 0x40;
/// Room of a metadata buffer (`UVC_METADATA_BUF_SIZE` of `uvcvideo.h`).
const METADATA_ROOM: usize = 10_240;

impl Assembler {
    /// For pictures of `size` bytes (0: of any size), in buffers of `room`; `whole_headers`: metadata has all of them.
    pub fn new(size: usize, room: usize, whole_headers: bool) -> Self {
        Self { size, room, whole_headers, last_id: None, sequence: 0, last_clock: Vec::new(), begun: None }
    }

    /// Takes a payload that came at `time_ns`; gives the pictures that it ends.
    pub fn push(&mut self, payload: &[u8], time_ns: i64) -> Vec<Sent> {
        let mut done = Vec::new();
        let [length, flags, ..] = *payload else { return done };
        let Some((header, data)) = payload.split_at_checked(usize::from(length)).filter(|_| length >= 2) else {
            return done;
        };
        let id = flags & FRAME_ID != 0;
        if self.last_id != Some(id) {
            done.extend(self.end());
            self.sequence = self.sequence.wrapping_add(u32::from(self.last_id.is_some()));
            self.last_id = Some(id);
            self.begun = Some(Sent { sequence: self.sequence, time_ns, ..Sent::default() });
        }
        // What comes after a picture's end with its number belongs to none.
        let Some(sent) = &mut self.begun else { return done };
        sent.is_damaged |= flags & ERROR != 0;
        let fits = data.len().min(self.room.saturating_sub(sent.picture.len()));
        sent.picture.extend(&data[..fits]);
        sent.is_damaged |= fits < data.len();
        self.keep(header, flags, time_ns);
        if flags & END != 0 && self.begun.as_ref().is_some_and(|s| !s.picture.is_empty()) {
            done.extend(self.end());
        }
        done
    }

    /// A packet was damaged on the bus.
    pub fn damage(&mut self) {
        self.begun.iter_mut().for_each(|sent| sent.is_damaged = true);
    }

    fn end(&mut self) -> Option<Sent> {
        let mut sent = self.begun.take()?;
        sent.is_damaged |= self.size != 0 && sent.picture.len() != self.size;
        Some(sent)
    }

    /// `uvc_video_decode_meta`.
    fn keep(&mut self, header: &[u8], flags: u8, time_ns: i64) {
        let Some(sent) = &mut self.begun else { return };
        let clock = if flags & HAS_TIME != 0 { 6 } else { 2 };
        let standard = clock + if flags & HAS_CLOCK != 0 { 6 } else { 0 };
        let header = if self.whole_headers { header } else { &header[..header.len().min(standard)] };
        let is_known = flags & HAS_CLOCK == 0 || header.get(clock..standard) == Some(&self.last_clock);
        if header.len() <= 2 || header.len() == standard && is_known {
            return;
        }
        self.last_clock = header.get(clock..standard).unwrap_or_default().to_vec();
        if sent.metadata.len() + header.len() + 10 <= METADATA_ROOM {
            sent.metadata.extend(time_ns.to_ne_bytes());
            sent.metadata.extend([0, 0]);
            sent.metadata.extend(header);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn payload(flags: u8, data: &[u8]) -> Vec<u8> {
        [&[2, flags][..], data].concat()
    }

    #[test]
    fn pictures_end_by_their_last_payload_or_by_the_next_picture() {
        let mut assembler = Assembler::new(4, 4, false);
        assert!(assembler.push(&payload(0, &[1, 2]), 5).is_empty());
        let whole = assembler.push(&payload(2, &[3, 4]), 6);
        assert_eq!((whole[0].picture.as_slice(), whole[0].sequence, whole[0].time_ns), (&[1, 2, 3, 4][..], 0, 5));
        assert!(!whole[0].is_damaged);
        // Stragglers of the picture that has ended, then one that breaks off.
        assert!(assembler.push(&payload(2, &[9]), 7).is_empty());
        assert!(assembler.push(&payload(1, &[5]), 8).is_empty());
        let torn = assembler.push(&payload(0, &[6]), 9);
        assert!(torn[0].is_damaged && torn[0].sequence == 1 && torn[0].picture == [5]);
        // Too much for the buffer.
        let long = assembler.push(&payload(2, &[6; 9]), 9);
        assert!(long[0].is_damaged && long[0].picture.len() == 4);
    }

    proptest! {
        #[test]
        fn no_bytes_upset_the_parsers(
            payloads in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..90), 0..40),
            lengths in prop::collection::vec((2..14u8, 0..=255u8), 0..40),
            whole in any::<bool>(),
        ) {
            functions(&payloads.concat());
            let mut assembler = Assembler::new(64, 64, whole);
            for (i, payload) in payloads.iter().enumerate() {
                // Half of them have a header that may be one.
                let likely = lengths.get(i).filter(|_| i % 2 == 0);
                let header = likely.map(|(length, flags)| vec![*length, *flags]).unwrap_or_default();
                for sent in assembler.push(&[header, payload.clone()].concat(), 0) {
                    prop_assert!(sent.picture.len() <= 64 && sent.metadata.len() <= METADATA_ROOM);
                    prop_assert!(sent.is_damaged || sent.picture.len() == 64);
                }
            }
        }
    }

    #[test]
    fn headers_that_say_nonsense_are_left_out() {
        let mut assembler = Assembler::new(2, 2, false);
        for bytes in [&[][..], &[2], &[0, 0, 1], &[1, 0, 1], &[9, 0, 1, 1]] {
            assert!(assembler.push(bytes, 0).is_empty(), "{bytes:?}");
        }
        assert!(assembler.push(&payload(ERROR | END, &[1, 2]), 0)[0].is_damaged);
    }

    #[test]
    fn a_header_that_repeats_the_clock_is_told_once_and_a_longer_one_always() {
        let header = [12, HAS_TIME | HAS_CLOCK, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0];
        let long = [&[14][..], &header[1..], &[7, 7]].concat();
        let metadata = |whole| {
            let mut assembler = Assembler::new(0, 9, whole);
            [&header[..], &header, &long].into_iter().for_each(|h| drop(assembler.push(&[h, &[1]].concat(), 0)));
            assembler.end().unwrap().metadata.len()
        };
        assert_eq!((metadata(false), metadata(true)), (22, 22 + 24));
    }
}
