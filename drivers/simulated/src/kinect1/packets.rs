//! Frames as packets: twelve bytes of header, then a part of the frame.

use super::SIZE;

/// Endpoint of the video stream.
pub const VIDEO_ENDPOINT: u8 = 0x81;
/// Endpoint of the depth stream.
pub const DEPTH_ENDPOINT: u8 = 0x82;

/// One of the camera's streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Colour or infrared.
    Video,
    /// Depth.
    Depth,
}

impl Stream {
    /// Bytes of a packet without its header (libfreenect `freenect_internal.h`: 1920 and 1760 with it).
    pub fn payload(self) -> usize {
        match self {
            Self::Video => 1908,
            Self::Depth => 1748,
        }
    }

    /// Upper half of the header's flag.
    fn flag(self) -> u8 {
        match self {
            Self::Video => 0x80,
            Self::Depth => 0x70,
        }
    }
}

/// Packet `index` of a frame's bytes.
pub fn packet(stream: Stream, frame: &[u8], index: usize, sequence: u8, ticks: u32) -> Vec<u8> {
    let chunks = frame.chunks(stream.payload());
    let count = chunks.len();
    let chunk = frame.chunks(stream.payload()).nth(index).unwrap_or_default();
    let role = match index {
        0 => 1,
        i if i + 1 == count => 5,
        _ => 2,
    };
    // The wiki ("USB Protocol Information") saw no time in the first packet of a frame.
    let ticks = if index == 0 { 0 } else { ticks };
    let mut bytes = vec![b'R', b'B', 0, stream.flag() | role, 0, sequence, 0, 0];
    bytes.extend(ticks.to_le_bytes());
    bytes.extend(chunk);
    bytes
}

/// Values of `bits` bits each, the highest bit first, without gaps.
pub fn pack(values: &[u16], bits: u32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.len() * bits as usize / 8 + 1);
    let (mut waiting, mut count) = (0u32, 0);
    for &value in values {
        waiting = waiting << bits | u32::from(value) & ((1 << bits) - 1);
        count += bits;
        while count >= 8 {
            count -= 8;
            bytes.push((waiting >> count) as u8);
            waiting &= (1 << count) - 1;
        }
    }
    if count > 0 {
        bytes.push((waiting << (8 - count)) as u8);
    }
    bytes
}

/// Every pixel's one colour behind the filter: green, red, green, ... in even rows; blue, green, ... in odd ones.
pub fn mosaic(pixels: &[[u8; 3]]) -> Vec<u8> {
    let color = |i: usize| match ((i / SIZE.0) % 2, i % 2) {
        (0, 1) => 0,
        (1, 0) => 2,
        _ => 1,
    };
    pixels.iter().enumerate().map(|(i, rgb)| rgb[color(i)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_stand_one_after_another() {
        assert_eq!(pack(&[0b101_0101_0101, 0b111_1111_1111], 11), [0b1010_1010, 0b1011_1111, 0b1111_1100]);
        assert_eq!(pack(&[1, 2, 3, 1023], 10), [0b0000_0000, 0b0100_0000, 0b0010_0000, 0b0000_1111, 0xff]);
    }

    #[test]
    fn a_frame_of_depth_has_242_packets_and_the_last_is_short() {
        let frame = vec![7; 640 * 480 * 11 / 8];
        assert_eq!(frame.len().div_ceil(Stream::Depth.payload()), 242);
        let last = packet(Stream::Depth, &frame, 241, 9, 5);
        assert_eq!((last.len(), last[3], last[5]), (12 + 422_400 - 241 * 1748, 0x75, 9));
        assert_eq!(packet(Stream::Video, &vec![0; 307_200], 0, 0, 5)[3..12], [0x81, 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}
