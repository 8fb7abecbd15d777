//! Packets to whole frames. A frame that misses a byte is dropped and counted; the next one begins at the next first
//! packet.

use toile_driver_transport::PacketStatus;

use crate::protocol::{Role, Stream, parse_packet};

/// Losses of a stream so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Packets that the sequence numbers say were sent and that did not arrive whole.
    pub packets: u64,
    /// Packets that arrived but cannot be used: wrong header, wrong length, out of place.
    pub bad_packets: u64,
    /// Frames that were begun and are not whole.
    pub torn_frames: u64,
}

/// Collects the packets of one stream.
#[derive(Debug)]
pub struct Assembler {
    stream: Stream,
    bytes: Vec<u8>,
    /// Bytes of the frame so far; `None` until a frame begins.
    filled: Option<usize>,
    next_sequence: Option<u8>,
    losses: Losses,
}

impl Assembler {
    /// For frames of `frame_bytes` bytes.
    pub fn new(stream: Stream, frame_bytes: usize) -> Self {
        Self { stream, bytes: vec![0; frame_bytes], filled: None, next_sequence: None, losses: Losses::default() }
    }

    /// Losses so far.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Forgets the frame that is being collected: packets will have been missed without anybody's fault.
    pub fn restart(&mut self) {
        (self.filled, self.next_sequence) = (None, None);
    }

    /// Takes what one isochronous packet brought; gives a frame's bytes and the camera's ticks when it is whole.
    pub fn push(&mut self, status: PacketStatus, packet: &[u8]) -> Option<(u32, &[u8])> {
        if status != PacketStatus::Completed || packet.is_empty() {
            // Most packets are empty: the camera has nothing to send. A damaged one shows in the sequence.
            return None;
        }
        let Ok(packet) = parse_packet(self.stream, packet) else {
            self.losses.bad_packets += 1;
            self.tear();
            return None;
        };
        self.follow(packet.sequence);
        if packet.role == Role::First {
            self.tear();
            self.filled = Some(0);
        }
        let start = self.filled?;
        let end = start + packet.data.len();
        let whole = end == self.bytes.len();
        let fits = match packet.role {
            Role::First | Role::Middle => packet.data.len() == self.stream.payload() && end < self.bytes.len(),
            Role::Last => whole,
        };
        if !fits {
            self.losses.bad_packets += 1;
            self.tear();
            return None;
        }
        self.bytes[start..end].copy_from_slice(packet.data);
        self.filled = if whole { None } else { Some(end) };
        whole.then_some((packet.ticks, &self.bytes[..]))
    }

    /// Counts what the sequence numbers skip; a skip tears the frame.
    fn follow(&mut self, sequence: u8) {
        let skipped = self.next_sequence.map_or(0, |next| sequence.wrapping_sub(next));
        self.next_sequence = Some(sequence.wrapping_add(1));
        if skipped > 0 {
            self.losses.packets += u64::from(skipped);
            self.tear();
        }
    }

    fn tear(&mut self) {
        if self.filled.take().is_some() {
            self.losses.torn_frames += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const FRAME: usize = 2 * 1748 + 100;

    fn packets(frame: u8, sequence: u8) -> Vec<Vec<u8>> {
        let header = |i: u8, flag: u8| vec![b'R', b'B', 0, flag, 0, sequence.wrapping_add(i), 0, 0, frame, 0, 0, 0];
        vec![
            [header(0, 0x71), vec![frame; 1748]].concat(),
            [header(1, 0x72), vec![frame; 1748]].concat(),
            [header(2, 0x75), vec![frame; 100]].concat(),
        ]
    }

    fn run(assembler: &mut Assembler, packets: &[Vec<u8>]) -> Vec<u32> {
        let push = |p: &Vec<u8>| assembler.push(PacketStatus::Completed, p).map(|(ticks, _)| ticks);
        packets.iter().filter_map(push).collect()
    }

    #[test]
    fn whole_frames_come_out_and_a_gap_costs_its_frame_only() {
        let mut assembler = Assembler::new(Stream::Depth, FRAME);
        let mut all: Vec<Vec<u8>> = (0..4).flat_map(|f| packets(f, 254u8.wrapping_add(3 * f))).collect();
        all.remove(4);
        all.insert(2, Vec::new());
        assert_eq!(run(&mut assembler, &all), [0, 2, 3]);
        assert_eq!(assembler.losses(), Losses { packets: 1, bad_packets: 0, torn_frames: 1 });
    }

    #[test]
    fn a_start_in_the_middle_waits_for_the_next_frame_without_a_loss() {
        let mut assembler = Assembler::new(Stream::Depth, FRAME);
        let all = [&packets(0, 10)[1..], &packets(1, 13)].concat();
        assert_eq!(run(&mut assembler, &all), [1]);
        assert_eq!(assembler.losses(), Losses::default());
    }

    #[test]
    fn short_long_and_misplaced_packets_are_bad() {
        for (i, length) in [(1, 1700), (1, 1800), (2, 111), (2, 113), (0, 12), (1, 5)] {
            let mut assembler = Assembler::new(Stream::Depth, FRAME);
            let mut all = [packets(0, 0), packets(1, 3)].concat();
            all[i].resize(length, 0);
            assert_eq!(run(&mut assembler, &all), [1], "{i} {length}");
            assert!(assembler.losses().torn_frames == 1 && assembler.losses().bad_packets > 0, "{i} {length}");
        }
    }

    proptest! {
        #[test]
        fn no_packets_upset_it(
            packets in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..40), 0..8u8, 0..2100usize), 0..60)
        ) {
            let mut assembler = Assembler::new(Stream::Depth, FRAME);
            for (mut bytes, role, length) in packets {
                bytes.splice(0..0, [b'R', b'B', 0, 0x70 | role, 0]);
                bytes.resize(length, 1);
                let _ = assembler.push(PacketStatus::Completed, &bytes);
            }
        }
    }
}
