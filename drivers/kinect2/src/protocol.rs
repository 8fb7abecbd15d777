//! Bytes to commands, answers, depth images and colour images, and back. Nothing here trusts a length.

/// Commands go out here, answers come in there, colour and depth too, with the direction bit (libfreenect2
/// `protocol/usb_control.h`).
pub const COMMAND_OUT: u8 = 0x02;
/// See [`COMMAND_OUT`].
pub const COMMAND_IN: u8 = 0x81;
/// Bulk endpoint of colour.
pub const COLOR_ENDPOINT: u8 = 0x83;
/// Isochronous endpoint of depth.
pub const DEPTH_ENDPOINT: u8 = 0x84;
/// Bytes that a depth packet of the bus must have room for (libfreenect2 `Freenect2DeviceImpl::open`).
pub const DEPTH_PACKET_ROOM: usize = 0x8400;

/// Begins every command (libfreenect2 `protocol/command.h`, `MagicNumber`).
const COMMAND_MAGIC: u32 = 0x0602_2009;
/// Begins every completion (libfreenect2 `protocol/command_transaction.h`), which has this many bytes.
const COMPLETION_MAGIC: u32 = 0x0a6f_e000;
/// Length of the answer that ends a command.
pub const COMPLETION_BYTES: usize = 16;
/// Bytes of what follows each image of a depth packet (libfreenect2 `depth_packet_stream_parser.h`,
/// `DepthSubPacketFooter`).
pub const DEPTH_FOOTER: usize = 6 * 4 + 32 * 4;
/// Bytes before and after a colour image (libfreenect2 `rgb_packet_stream_parser.cpp`, `RawRgbPacket`,
/// `RgbPacketFooter`).
pub const COLOR_HEADER: usize = 8;
/// See [`COLOR_HEADER`].
pub const COLOR_FOOTER: usize = 14 * 4;
/// "BBBB" after a colour image's number and in its footer, "9999" at the footer's beginning.
const COLOR_BEGIN: u32 = 0x4242_4242;
const COLOR_END: u32 = 0x3939_3939;
/// A JPEG ends so, at most three bytes before its filler (libfreenect2: padding to four bytes).
const JPEG_END: [u8; 2] = [0xff, 0xd9];

/// Little-endian word `i` of some bytes.
fn word(bytes: &[u8], i: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(4 * i..)?.first_chunk()?))
}

/// The bytes of a command: magic, number, room for the answer, command, 0, parameters.
pub fn command(code: u32, sequence: u32, room: u32, parameters: &[u32]) -> Vec<u8> {
    let header = [COMMAND_MAGIC, sequence, room, code, 0];
    header.iter().chain(parameters).flat_map(|word| word.to_le_bytes()).collect()
}

/// True where bytes are a completion and no data.
pub fn is_completion(bytes: &[u8]) -> bool {
    bytes.len() == COMPLETION_BYTES && word(bytes, 0) == Some(COMPLETION_MAGIC)
}

/// Checks that bytes are the completion of command number `sequence`.
///
/// # Errors
/// The problem.
pub fn completion(bytes: &[u8], sequence: u32) -> Result<(), String> {
    if !is_completion(bytes) {
        return Err(format!("{} bytes came instead of its completion", bytes.len()));
    }
    match word(bytes, 1) {
        Some(number) if number == sequence => Ok(()),
        number => Err(format!("the completion is of request {} instead of {sequence}", number.unwrap_or(0))),
    }
}

/// The main firmware's version, such as `4.3.3913.0` (libfreenect2 `FirmwareVersionResponse`: the fourth of several
/// entries of sixteen bytes).
pub fn firmware(bytes: &[u8]) -> Option<String> {
    let entry = bytes.get(48..64)?;
    let (version, revision, build) = (word(entry, 0)?, word(entry, 1)?, word(entry, 2)?);
    Some(format!("{}.{}.{revision}.{build}", version >> 16, version & 0xffff))
}

/// The serial number: letters and digits in every other byte up to a zero.
pub fn serial(bytes: &[u8]) -> Option<String> {
    let text: String = bytes.iter().step_by(2).map(|&b| char::from(b)).take_while(|c| *c != '\0').collect();
    (!text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric())).then_some(text)
}

/// The footer of an image of a depth packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DepthFooter {
    /// The camera's clock, 1/8 ms.
    pub ticks: u32,
    /// Number of the packet.
    pub sequence: u32,
    /// Which of its ten images.
    pub image: u32,
    /// Bytes of the image.
    pub length: u32,
}

/// Reads the footer of an image of a depth packet; `None` of other lengths.
pub fn depth_footer(bytes: &[u8]) -> Option<DepthFooter> {
    if bytes.len() != DEPTH_FOOTER {
        return None;
    }
    Some(DepthFooter {
        ticks: word(bytes, 2)?,
        sequence: word(bytes, 3)?,
        image: word(bytes, 4)?,
        length: word(bytes, 5)?,
    })
}

/// A colour image, borrowed from its bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorPacket<'a> {
    /// Its number.
    pub sequence: u32,
    /// The camera's clock, 1/8 ms.
    pub ticks: u32,
    /// The image.
    pub jpeg: &'a [u8],
}

/// True where bytes are the beginning of a colour image.
pub fn begins_color(bytes: &[u8]) -> bool {
    word(bytes, 1) == Some(COLOR_BEGIN)
}

/// True where bytes end as a colour image of their length does.
pub fn ends_color(bytes: &[u8]) -> bool {
    let Some(start) = bytes.len().checked_sub(COLOR_FOOTER) else { return false };
    let footer = &bytes[start..];
    word(footer, 0) == Some(COLOR_END) && word(footer, 8) == Some(COLOR_BEGIN)
}

/// Reads a whole colour image.
///
/// # Errors
/// The problem.
pub fn color_packet(bytes: &[u8]) -> Result<ColorPacket<'_>, &'static str> {
    let inner = bytes.len().checked_sub(COLOR_HEADER + COLOR_FOOTER).ok_or("it is too short")?;
    if !begins_color(bytes) || !ends_color(bytes) {
        return Err("it has no beginning or no end");
    }
    let footer = &bytes[COLOR_HEADER + inner..];
    let (sequence, number) = (word(bytes, 0), word(footer, 1));
    if sequence != number {
        return Err("its two numbers differ");
    }
    if word(footer, 9).map(|length| length as usize) != Some(bytes.len()) {
        return Err("it has another length than it says");
    }
    let filler = word(footer, 2).map_or(usize::MAX, |length| length as usize);
    let end = inner.checked_sub(filler).ok_or("its filler is longer than it")?;
    let image = &bytes[COLOR_HEADER..COLOR_HEADER + end];
    let jpeg =
        (0..4).filter_map(|padding| image.get(..end.checked_sub(padding)?)).find(|jpeg| jpeg.ends_with(&JPEG_END));
    let jpeg = jpeg.ok_or("there is no JPEG in it")?;
    Ok(ColorPacket { sequence: sequence.unwrap_or(0), ticks: word(footer, 5).unwrap_or(0), jpeg })
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A colour image of this JPEG.
    pub(crate) fn color(sequence: u32, jpeg: &[u8], padding: usize, filler: usize) -> Vec<u8> {
        let mut bytes = [sequence, COLOR_BEGIN].iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
        bytes.extend(jpeg);
        bytes.resize(bytes.len() + padding, 0xa5);
        bytes.resize(bytes.len() + filler, b'Z');
        let length = (bytes.len() + COLOR_FOOTER) as u32;
        let footer = [COLOR_END, sequence, filler as u32, 0, 0, 77, 0, 0, COLOR_BEGIN, length, 0, 0, 0, 0];
        bytes.extend(footer.iter().flat_map(|w| w.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_command_is_its_words() {
        let bytes = command(0x22, 7, 0x80, &[1]);
        let words: Vec<u32> = (0..6).filter_map(|i| word(&bytes, i)).collect();
        assert_eq!((bytes.len(), words), (24, vec![0x0602_2009, 7, 0x80, 0x22, 0, 1]));
    }

    #[test]
    fn every_lie_of_a_completion_is_named() {
        let good: Vec<u8> = [COMPLETION_MAGIC, 9, 0, 0].iter().flat_map(|w| w.to_le_bytes()).collect();
        assert_eq!(completion(&good, 9), Ok(()));
        assert!(completion(&good, 8).unwrap_err().contains("request 9 instead of 8"));
        assert!(completion(&good[..12], 9).unwrap_err().contains("12 bytes"));
        assert!(!is_completion(&[0; 16]));
    }

    #[test]
    fn who_it_is() {
        let text: Vec<u8> = "0123AB".bytes().flat_map(|b| [b, 0]).chain([0; 20]).collect();
        assert_eq!(serial(&text).as_deref(), Some("0123AB"));
        assert_eq!((serial(&[0xff; 40]), serial(&[])), (None, None));
        let mut versions = vec![0; 112];
        versions[48..60].copy_from_slice(&[3, 0, 4, 0, 0x49, 0x0f, 0, 0, 5, 0, 0, 0]);
        assert_eq!(firmware(&versions).as_deref(), Some("4.3.3913.5"));
        assert_eq!(firmware(&versions[..60]), None);
    }

    #[test]
    fn a_colour_image_is_found_between_padding_and_filler() {
        let jpeg = [0xff, 0xd8, 1, 2, 3, 0xff, 0xd9];
        for padding in 0..4 {
            let bytes = color(5, &jpeg, padding, 9);
            assert_eq!(color_packet(&bytes), Ok(ColorPacket { sequence: 5, ticks: 77, jpeg: &jpeg }));
        }
        let spoiled = |at: usize| {
            let mut bytes = color(5, &jpeg, 1, 9);
            let at = if at < 100 { at } else { bytes.len() + 100 - 200 + at - 100 };
            bytes[at] ^= 0x10;
            color_packet(&bytes).unwrap_err()
        };
        assert_eq!(spoiled(0), "its two numbers differ");
        assert_eq!(spoiled(4), "it has no beginning or no end");
        assert_eq!(spoiled(14), "there is no JPEG in it");
        assert_eq!(color_packet(&color(5, &jpeg, 4, 9)), Err("there is no JPEG in it"));
        let mut bytes = color(5, &jpeg, 1, 9);
        let length = bytes.len();
        bytes[length - COLOR_FOOTER + 8] = 200;
        assert_eq!(color_packet(&bytes), Err("its filler is longer than it"));
        bytes.insert(20, 0);
        assert_eq!(color_packet(&bytes), Err("it has another length than it says"));
        assert_eq!(color_packet(&bytes[..63]), Err("it is too short"));
    }

    proptest! {
        #[test]
        fn no_bytes_upset_the_parsers(bytes in prop::collection::vec(any::<u8>(), 0..300), ends in any::<bool>()) {
            let mut bytes = bytes;
            if ends && bytes.len() >= COLOR_HEADER + COLOR_FOOTER {
                let (footer, length) = (bytes.len() - COLOR_FOOTER, bytes.len() as u32);
                bytes[4..8].copy_from_slice(b"BBBB");
                bytes[footer..footer + 4].copy_from_slice(b"9999");
                bytes[footer + 32..footer + 36].copy_from_slice(b"BBBB");
                bytes[footer + 36..footer + 40].copy_from_slice(&length.to_le_bytes());
                bytes.copy_within(0..4, footer + 4);
            }
            if let Ok(packet) = color_packet(&bytes) {
                prop_assert!(packet.jpeg.len() + COLOR_HEADER + COLOR_FOOTER <= bytes.len());
            }
            let _ = (completion(&bytes, 1), firmware(&bytes), serial(&bytes), depth_footer(&bytes));
        }
    }
}
