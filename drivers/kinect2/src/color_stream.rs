//! Bulk transfers to whole colour images. An image begins with a transfer and may take many; what misses a part is dropped
//! and counted.

use crate::{
    Losses,
    protocol::{begins_color, color_packet, ends_color},
};

/// No image is longer (libfreenect2 `rgb_packet_stream_parser.cpp` gives as much room).
const MAX_BYTES: usize = 2 << 20;

/// A colour image as the camera sent it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImageBytes {
    /// Its number.
    pub sequence: u32,
    /// The camera's clock, 1/8 ms.
    pub ticks: u32,
    /// A JPEG of 1920 columns and 1080 rows, mirrored.
    pub jpeg: Vec<u8>,
}

/// Collects the transfers of the colour stream.
#[derive(Debug, Default)]
pub struct ColorStream {
    bytes: Vec<u8>,
    losses: Losses,
}

impl ColorStream {
    /// Losses so far.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Forgets what is being collected: transfers will have been missed without anybody's fault.
    pub fn restart(&mut self) {
        self.bytes.clear();
    }

    /// A transfer failed: the image that it was part of is torn.
    pub fn lose(&mut self) {
        self.losses.packets += 1;
        self.tear();
    }

    /// An image that was whole turned out to be none.
    pub(crate) fn count_bad(&mut self) {
        self.losses.bad += 1;
    }

    /// Takes what one transfer brought; gives an image when it is whole.
    pub fn push(&mut self, transfer: &[u8]) -> Option<ColorImageBytes> {
        if transfer.is_empty() {
            return None;
        }
        if begins_color(transfer) && !self.bytes.is_empty() {
            self.tear();
        }
        if self.bytes.is_empty() && !begins_color(transfer) {
            self.losses.bad += 1;
            return None;
        }
        if self.bytes.len() + transfer.len() > MAX_BYTES {
            self.losses.bad += 1;
            self.tear();
            return None;
        }
        self.bytes.extend_from_slice(transfer);
        if !ends_color(&self.bytes) {
            return None;
        }
        let image = color_packet(&self.bytes).map(|packet| ColorImageBytes {
            sequence: packet.sequence,
            ticks: packet.ticks,
            jpeg: packet.jpeg.to_vec(),
        });
        if let Err(reason) = image {
            tracing::debug!(reason, "a colour image is dropped");
            self.losses.bad += 1;
            self.tear();
        }
        self.bytes.clear();
        image.ok()
    }

    fn tear(&mut self) {
        if !self.bytes.is_empty() {
            self.losses.torn_frames += 1;
            self.bytes.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::protocol::tests::color;

    const ROOM: usize = 512;

    fn jpeg(n: u32) -> Vec<u8> {
        [vec![0xff, 0xd8], vec![n as u8; 2000], vec![0xff, 0xd9]].concat()
    }

    fn transfers(images: u32) -> Vec<Vec<u8>> {
        let images = (0..images).map(|n| color(n, &jpeg(n), 2, 30));
        images.flat_map(|image| image.chunks(ROOM).map(<[u8]>::to_vec).collect::<Vec<_>>()).collect()
    }

    fn run(transfers: &[Vec<u8>]) -> (Vec<u32>, Losses) {
        let mut stream = ColorStream::default();
        let images: Vec<ColorImageBytes> = transfers.iter().filter_map(|t| stream.push(t)).collect();
        assert!(images.iter().all(|i| i.jpeg == jpeg(i.sequence)));
        (images.iter().map(|i| i.sequence).collect(), stream.losses())
    }

    #[test]
    fn images_come_out_and_a_gap_costs_its_image_only() {
        assert_eq!(run(&transfers(4)), (vec![0, 1, 2, 3], Losses::default()));
        // Five transfers an image: its first, a middle and its last one.
        for (at, torn, bad) in [(5, 0, 4), (7, 1, 0), (9, 1, 0)] {
            let mut all = transfers(4);
            all.remove(at);
            let (images, losses) = run(&all);
            assert_eq!(
                (images, losses.torn_frames, losses.bad),
                (vec![0, 2, 3], torn.max(losses.torn_frames), bad.max(losses.bad)),
                "{at}"
            );
            assert!(losses.torn_frames + losses.bad > 0, "{at}");
        }
    }

    #[test]
    fn an_endless_image_is_dropped() {
        let mut stream = ColorStream::default();
        stream.push(&color(0, &jpeg(0), 0, 0)[..100]);
        (0..5000).for_each(|_| assert!(stream.push(&[1; ROOM]).is_none()));
        assert!(stream.losses().torn_frames == 1 && stream.bytes.len() <= MAX_BYTES);
        assert!(stream.push(&color(1, &jpeg(1), 0, 0)).is_some());
    }

    proptest! {
        #[test]
        fn no_transfers_upset_it(pieces in prop::collection::vec((0..4_usize, prop::collection::vec(any::<u8>(), 0..80)), 0..40)) {
            let mut stream = ColorStream::default();
            let whole = color(3, &jpeg(3), 1, 5);
            for (kind, bytes) in pieces {
                let _ = match kind {
                    0 => stream.push(&bytes),
                    1 => stream.push(&[&3u32.to_le_bytes()[..], b"BBBB", &bytes].concat()),
                    2 => stream.push(&[&bytes, &whole[whole.len() - 60..]].concat()),
                    _ => stream.push(&whole),
                };
            }
        }
    }
}
