//! Isochronous packets to whole depth packets. What misses a byte is dropped and counted; the next image begins after the
//! next short packet, and the next depth packet with the next number.

use toile_driver_transport::PacketStatus;

use crate::{
    Losses,
    decode::{IMAGE_BYTES, PACKET_BYTES},
    protocol::{DEPTH_FOOTER, depth_footer},
};

/// Bytes of an image with its footer.
const WHOLE: usize = IMAGE_BYTES + DEPTH_FOOTER;
/// All ten images of a packet are there.
const ALL_TEN: u32 = 0x3ff;

/// Ten images of one exposure, as the camera sent them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthPacket {
    /// Its number.
    pub sequence: u32,
    /// The camera's clock at its first image that came, 1/8 ms.
    pub ticks: u32,
    /// [`PACKET_BYTES`] bytes.
    pub bytes: Vec<u8>,
}

/// Collects the images of the depth stream.
#[derive(Debug)]
pub struct DepthStream {
    /// The image that is being collected.
    image: Vec<u8>,
    /// Bytes of it when the camera last paused: an end that was lost shows only there.
    paused_at: usize,
    /// Bytes are missing: wait for the next image.
    torn: bool,
    packet: Option<DepthPacket>,
    /// A bit for each image of the packet that is there.
    images: u32,
    losses: Losses,
}

impl Default for DepthStream {
    fn default() -> Self {
        // Until something short or empty comes, this may be the middle of an image.
        let image = Vec::with_capacity(WHOLE);
        Self { image, paused_at: 0, torn: true, packet: None, images: 0, losses: Losses::default() }
    }
}

impl DepthStream {
    /// Losses so far.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Forgets what is being collected: packets will have been missed without anybody's fault.
    pub fn restart(&mut self) {
        self.image.clear();
        (self.paused_at, self.torn, self.packet, self.images) = (0, true, None, 0);
    }

    /// Takes what one isochronous packet of `room` bytes brought; gives a depth packet when all its images are there.
    pub fn push(&mut self, status: PacketStatus, bytes: &[u8], room: usize) -> Option<DepthPacket> {
        if status != PacketStatus::Completed {
            self.losses.packets += 1;
            self.tear();
            return None;
        }
        if bytes.is_empty() {
            // Between images the camera has nothing to send (libfreenect2 takes this for the boundary).
            self.torn = false;
            self.paused_at = self.image.len();
            return None;
        }
        let ends = bytes.len() < room;
        if self.torn {
            self.torn = !ends;
            return None;
        }
        if self.image.len() + bytes.len() > WHOLE {
            // The end of the image before the pause was lost.
            self.losses.bad += 1;
            self.image.drain(..self.paused_at);
            self.paused_at = 0;
            if self.image.len() + bytes.len() > WHOLE {
                self.image.clear();
                self.torn = !ends;
                return None;
            }
        }
        self.image.extend_from_slice(bytes);
        if self.image.len() == WHOLE {
            return self.take_image();
        }
        if ends {
            self.losses.bad += 1;
            self.image.clear();
            self.paused_at = 0;
        }
        None
    }

    /// An image is whole: puts it into its packet.
    fn take_image(&mut self) -> Option<DepthPacket> {
        self.paused_at = 0;
        let footer = depth_footer(&self.image[IMAGE_BYTES..]);
        let footer = footer.filter(|f| f.length as usize == IMAGE_BYTES && f.image < 10);
        let Some(footer) = footer else {
            self.losses.bad += 1;
            self.image.clear();
            return None;
        };
        if self.packet.as_ref().is_none_or(|packet| packet.sequence != footer.sequence) {
            self.losses.torn_frames += u64::from(self.packet.is_some());
            let bytes = self.packet.take().map_or_else(|| vec![0; PACKET_BYTES], |packet| packet.bytes);
            self.packet = Some(DepthPacket { sequence: footer.sequence, ticks: footer.ticks, bytes });
            self.images = 0;
        }
        let start = footer.image as usize * IMAGE_BYTES;
        if let Some(packet) = &mut self.packet {
            packet.bytes[start..start + IMAGE_BYTES].copy_from_slice(&self.image[..IMAGE_BYTES]);
        }
        self.image.clear();
        self.images |= 1 << footer.image;
        if self.images == ALL_TEN { self.packet.take() } else { None }
    }

    fn tear(&mut self) {
        self.image.clear();
        (self.paused_at, self.torn) = (0, true);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ROOM: usize = 33_792;

    fn image(sequence: u32, index: u32) -> Vec<u8> {
        let mut bytes = vec![sequence as u8 ^ index as u8; IMAGE_BYTES];
        let footer = [0, 0, 100 + sequence, sequence, index, IMAGE_BYTES as u32];
        bytes.extend(footer.iter().flat_map(|w: &u32| w.to_le_bytes()));
        bytes.resize(WHOLE, 0);
        bytes
    }

    /// Bus packets of whole frames with a pause after each image.
    fn packets(frames: u32) -> Vec<Vec<u8>> {
        let images = (0..frames).flat_map(|s| (0..10).map(move |i| image(s, i)));
        let with_pause = |bytes: Vec<u8>| {
            let chunks = bytes.chunks(ROOM).map(<[u8]>::to_vec).collect::<Vec<_>>();
            chunks.into_iter().chain([Vec::new()])
        };
        [Vec::new()].into_iter().chain(images.flat_map(with_pause)).collect()
    }

    fn run(packets: &[Vec<u8>]) -> (Vec<u32>, Losses) {
        let mut stream = DepthStream::default();
        let whole = packets.iter().filter_map(|p| stream.push(PacketStatus::Completed, p, ROOM));
        let whole: Vec<DepthPacket> = whole.collect();
        assert!(whole.iter().all(|p| p.bytes[3 * IMAGE_BYTES] == p.sequence as u8 ^ 3 && p.ticks == 100 + p.sequence));
        (whole.iter().map(|p| p.sequence).collect(), stream.losses())
    }

    #[test]
    fn whole_packets_come_out() {
        assert_eq!(run(&packets(3)), (vec![0, 1, 2], Losses::default()));
    }

    #[test]
    fn a_lost_packet_costs_its_frame_only_wherever_it_was() {
        // Ten bus packets an image: first, middle, the short last one, and those of the frame's last image.
        for at in [101, 105, 109, 111, 191, 195, 199] {
            let mut all = packets(3);
            all[at].clear();
            let (whole, losses) = run(&all);
            assert_eq!(whole, [0, 2], "{at}");
            assert_eq!((losses.torn_frames, losses.bad), (1, 1), "{at}");
        }
    }

    #[test]
    fn short_and_long_packets_are_bad() {
        for (at, length) in [(103, 700), (109, 3), (109, 30_000), (103, 1), (109, ROOM)] {
            let mut all = packets(3);
            all[at].resize(length, 9);
            let (whole, losses) = run(&all);
            assert_eq!(whole, [0, 2], "{at} {length}");
            assert!(losses.bad > 0 && losses.torn_frames == 1, "{at} {length}");
        }
    }

    #[test]
    fn a_pause_within_an_image_is_not_a_loss() {
        let mut all = packets(2);
        (0..4).for_each(|_| all.insert(104, Vec::new()));
        assert_eq!(run(&all), (vec![0, 1], Losses::default()));
    }

    #[test]
    fn a_start_in_the_middle_waits_for_the_next_frame() {
        let (whole, losses) = run(&packets(3)[55..]);
        assert_eq!((whole, losses.bad, losses.torn_frames), (vec![1, 2], 0, 1));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn no_packets_upset_it(lengths in prop::collection::vec((0..3_usize, 0..ROOM), 0..120), footer: [u32; 6]) {
            let mut stream = DepthStream::default();
            for (kind, length) in lengths {
                let mut bytes = vec![7; match kind { 0 => ROOM, 1 => length, _ => WHOLE % ROOM }];
                if let Some(at) = bytes.len().checked_sub(DEPTH_FOOTER) {
                    let words: Vec<u8> = footer.iter().flat_map(|w| w.to_le_bytes()).collect();
                    bytes[at..at + 24].copy_from_slice(&words);
                }
                let _ = stream.push(PacketStatus::Completed, &bytes, ROOM);
            }
        }
    }
}
