//! Bytes to packets and commands, and back. Nothing here trusts a length.

/// Video endpoint, with the direction bit (libfreenect `src/cameras.c`, `freenect_start_video`).
pub const VIDEO_ENDPOINT: u8 = 0x81;
/// Depth endpoint (`freenect_start_depth`).
pub const DEPTH_ENDPOINT: u8 = 0x82;
/// Bytes of an isochronous packet where the descriptors do not say (libfreenect `src/usb_libusb10.h`).
pub const PACKET_ROOM: usize = 1920;
/// Bytes of a packet's header (`struct pkt_hdr` in libfreenect `src/cameras.c`).
const HEADER: usize = 12;
/// Bytes of a command's header (`cam_hdr` in libfreenect `src/flags.c`).
const COMMAND_HEADER: usize = 8;
/// Room that the camera expects an answer to have (libfreenect `src/flags.c`, `send_cmd`).
pub const ANSWER_ROOM: usize = 0x200;

/// One of the camera's streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Colour or infrared.
    Video,
    /// Depth.
    Depth,
}

impl Stream {
    /// Its endpoint.
    pub fn endpoint(self) -> u8 {
        match self {
            Self::Video => VIDEO_ENDPOINT,
            Self::Depth => DEPTH_ENDPOINT,
        }
    }

    /// Bytes of the frame that each packet but the last carries (libfreenect `src/freenect_internal.h`: packets of 1920
    /// and 1760 bytes with their header).
    pub fn payload(self) -> usize {
        match self {
            Self::Video => 1920 - HEADER,
            Self::Depth => 1760 - HEADER,
        }
    }

    /// Upper half of its packets' flag (libfreenect `src/cameras.c`; Linux' gspca `kinect.c` calls it `stream_flag`).
    fn flag(self) -> u8 {
        match self {
            Self::Video => 0x80,
            Self::Depth => 0x70,
        }
    }
}

/// Where in its frame a packet stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The first.
    First,
    /// Between.
    Middle,
    /// The last.
    Last,
}

/// A packet, borrowed from its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Where in its frame it stands.
    pub role: Role,
    /// Counts the stream's packets and wraps.
    pub sequence: u8,
    /// The camera's clock, wrapping; 0 in a frame's first packet.
    pub ticks: u32,
    /// A part of the frame.
    pub data: &'a [u8],
}

/// Why bytes are not a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketFault {
    /// Fewer bytes than a header.
    Short,
    /// It does not begin with "RB".
    Magic,
    /// The flag is of no role, or of another stream.
    Flag,
}

/// Reads a packet of `stream`.
///
/// # Errors
/// [`PacketFault`] where it is not a packet.
pub fn parse_packet(stream: Stream, bytes: &[u8]) -> Result<Packet<'_>, PacketFault> {
    let (header, data) = bytes.split_first_chunk::<HEADER>().ok_or(PacketFault::Short)?;
    if header[..2] != *b"RB" {
        return Err(PacketFault::Magic);
    }
    let role = match header[3].checked_sub(stream.flag()) {
        Some(1) => Role::First,
        Some(2) => Role::Middle,
        Some(5) => Role::Last,
        _ => return Err(PacketFault::Flag),
    };
    let ticks = u32::from_le_bytes([header[8], header[9], header[10], header[11]]);
    Ok(Packet { role, sequence: header[5], ticks, data })
}

/// The bytes of a command: "GM", its words' number, command, tag, words (libfreenect `src/flags.c`, `send_cmd`).
pub fn command(command: u16, tag: u16, words: &[u16]) -> Vec<u8> {
    let header = [words.len() as u16, command, tag];
    let words = header.iter().chain(words).flat_map(|word| word.to_le_bytes());
    b"GM".iter().copied().chain(words).collect()
}

/// The data of an answer to a command: "RB", words, command, tag, data.
///
/// # Errors
/// The problem.
pub fn answer(bytes: &[u8], command: u16, tag: u16) -> Result<&[u8], String> {
    let Some((header, data)) = bytes.split_first_chunk::<COMMAND_HEADER>() else {
        return Err(format!("the answer has {} bytes, fewer than its header", bytes.len()));
    };
    let word = |i: usize| u16::from_le_bytes([header[2 * i], header[2 * i + 1]]);
    if header[..2] != *b"RB" {
        return Err(format!("the answer begins with {:02x} {:02x}", header[0], header[1]));
    }
    if word(2) != command {
        return Err(format!("the answer is to command {:#04x}", word(2)));
    }
    if word(3) != tag {
        return Err(format!("the answer is to request {} instead of {tag}", word(3)));
    }
    if 2 * usize::from(word(1)) != data.len() {
        return Err(format!("the answer says {} words and has {} bytes", word(1), data.len()));
    }
    Ok(data)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_packet_is_distinguished_from_other_bytes() {
        let mut bytes = vec![b'R', b'B', 0, 0x75, 0, 200, 0, 0, 1, 2, 0, 0, 9, 9];
        let packet = parse_packet(Stream::Depth, &bytes).unwrap();
        assert_eq!(packet, Packet { role: Role::Last, sequence: 200, ticks: 513, data: &[9, 9] });
        assert_eq!(parse_packet(Stream::Video, &bytes), Err(PacketFault::Flag));
        assert_eq!(parse_packet(Stream::Depth, &bytes[..11]), Err(PacketFault::Short));
        bytes[3] = 0x6f;
        assert_eq!(parse_packet(Stream::Depth, &bytes), Err(PacketFault::Flag));
        for start in [*b"rB", *b"Rb"] {
            bytes[..2].copy_from_slice(&start);
            assert_eq!(parse_packet(Stream::Depth, &bytes), Err(PacketFault::Magic));
        }
    }

    #[test]
    fn commands_are_little_endian_words() {
        assert_eq!(command(3, 7, &[0x0105, 0]), [b'G', b'M', 2, 0, 3, 0, 7, 0, 5, 1, 0, 0]);
        assert_eq!(answer(&[b'R', b'B', 1, 0, 3, 0, 7, 0, 0, 0], 3, 7), Ok(&[0, 0][..]));
    }

    #[test]
    fn every_lie_of_an_answer_is_named() {
        let good = [b'R', b'B', 1, 0, 3, 0, 7, 0, 0, 0];
        let spoiled = |i: usize| {
            let mut bytes = good;
            bytes[i] ^= 0x11;
            answer(&bytes, 3, 7).unwrap_err()
        };
        assert!(spoiled(0).contains("begins with"));
        assert!(spoiled(2).contains("words and has 2 bytes"));
        assert!(spoiled(4).contains("command 0x12"));
        assert!(spoiled(6).contains("request"));
        assert!(answer(&good[..5], 3, 7).unwrap_err().contains("5 bytes"));
    }

    proptest! {
        #[test]
        fn no_bytes_upset_the_parsers(bytes in prop::collection::vec(any::<u8>(), 0..2100), magic in any::<bool>()) {
            let mut bytes = bytes;
            if magic && bytes.len() > 3 {
                bytes[..2].copy_from_slice(b"RB");
                bytes[3] = 0x70 | bytes[3] & 7;
            }
            let _ = parse_packet(Stream::Video, &bytes);
            if let Ok(packet) = parse_packet(Stream::Depth, &bytes) {
                prop_assert_eq!(packet.data.len(), bytes.len() - 12);
            }
            let _ = answer(&bytes, 3, 0);
        }
    }
}
