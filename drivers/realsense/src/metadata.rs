//! Metadata buffers to device time and frame number.
//!
//! A buffer is a row of blocks (`struct uvc_meta_buf` of `linux/uvcvideo.h`): eight bytes of host time, two of the bus'
//! frame number, then a payload's header as UVC has it (length, flags, time stamp, clock), behind which RealSense
//! cameras send blocks of their own (`md_capture_timing` of librealsense `src/metadata.h`). Kernels that do not know the
//! camera leave those out (V4L2_META_FMT_UVC instead of _D4XX).

/// The camera's metadata of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Metadata {
    /// Its clock at the picture, microseconds, 32 bits.
    pub time_us: Option<u32>,
    /// Its number of the picture.
    pub frame: Option<u32>,
    /// Exposure, microseconds.
    pub exposure_us: Option<u32>,
}

/// Host time and frame number of the bus.
const BEFORE_HEADER: usize = 10;
/// Flags of a header that has a time stamp, and a clock (UVC 1.1, table 2-5).
const HAS_TIME: u8 = 0x04;
const HAS_CLOCK: u8 = 0x08;
/// Bytes of the standard header with time stamp and clock.
const STANDARD: usize = 12;
/// `META_DATA_INTEL_CAPTURE_TIMING_ID`, and bits of its flags.
const CAPTURE_TIMING: u32 = 0x8000_0001;
const HAS_FRAME: u32 = 1;
const HAS_EXPOSURE: u32 = 1 << 3;

/// The metadata of a buffer's blocks together; nothing where they are damaged. `is_whole`: the headers are whole.
pub fn parse(mut bytes: &[u8], is_whole: bool) -> Metadata {
    let mut found = Metadata::default();
    while let Some(&[length, flags]) = bytes.get(BEFORE_HEADER..BEFORE_HEADER + 2) {
        // Of a header that is cut to its standard part, the length is still the whole one's (`uvc_video_decode_meta`).
        let time = if flags & HAS_TIME != 0 { 4 } else { 0 };
        let standard = 2 + time + if flags & HAS_CLOCK != 0 { 6 } else { 0 };
        let length = if is_whole { length.into() } else { usize::from(length).min(standard) };
        let end = BEFORE_HEADER + length;
        let (Some(header), 2..) = (bytes.get(BEFORE_HEADER..end), length) else { break };
        if header[1] & HAS_TIME != 0 && found.time_us.is_none() {
            found.time_us = word(header, 2);
        }
        timing(header.get(STANDARD..).unwrap_or_default(), &mut found);
        bytes = &bytes[end..];
    }
    found
}

/// Blocks: what it is, how long it is with these two numbers, version, flags, values.
fn timing(mut blocks: &[u8], found: &mut Metadata) {
    while let (Some(kind), Some(length)) = (word(blocks, 0), word(blocks, 4)) {
        let Some(block) = blocks.get(..length as usize).filter(|block| block.len() >= 8) else { return };
        let flags = word(block, 12).unwrap_or(0);
        if kind == CAPTURE_TIMING {
            let value = |has: u32, at| if flags & has != 0 { word(block, at) } else { None };
            found.frame = value(HAS_FRAME, 16).or(found.frame);
            found.exposure_us = value(HAS_EXPOSURE, 28).or(found.exposure_us);
        }
        blocks = &blocks[block.len()..];
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn block(extra: &[u32]) -> Vec<u8> {
        let mut bytes = vec![0; 10];
        bytes.extend([12 + 4 * extra.len() as u8, 0x8c, 1, 2, 0, 0, 9, 9, 9, 9, 9, 9]);
        bytes.extend(extra.iter().flat_map(|w| w.to_le_bytes()));
        bytes
    }

    #[test]
    fn the_first_time_and_the_timing_block_are_found() {
        let mut bytes = block(&[]);
        assert_eq!(parse(&bytes, true), Metadata { time_us: Some(513), ..Metadata::default() });
        bytes.extend(block(&[0x8000_0003, 12, 0, CAPTURE_TIMING, 40, 1, 0x3f, 77, 0, 0, 8500, 0, 0]));
        assert_eq!(parse(&bytes, true), Metadata { time_us: Some(513), frame: Some(77), exposure_us: Some(8500) });
        bytes.truncate(bytes.len() - 1);
        assert_eq!(parse(&bytes, true).frame, None);
        // Cut to the standard part, with the whole one's length.
        let mut cut = block(&[1, 2, 3]);
        cut.truncate(22);
        cut.extend(block(&[]));
        assert_eq!(parse(&cut, false).time_us, Some(513));
    }

    proptest! {
        #[test]
        fn no_buffer_makes_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = (parse(&bytes, true), parse(&bytes, false));
        }
    }
}
