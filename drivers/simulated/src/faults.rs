//! Faults of a stream, and their times: the same for every camera.

/// A fault of a stream; `S` says which stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault<S> {
    /// Which stream.
    pub stream: S,
    /// In which frame, counted by the camera since it was opened.
    pub frame: u64,
    /// From which packet, transfer or read of that frame.
    pub packet: usize,
    /// The fault.
    pub what: StreamFault,
}

/// Faults of packets. A fault of something that a camera's packets do not have does nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamFault {
    /// This many packets are sent but never arrive; `usize::MAX`: the rest of the frame.
    Lost(usize),
    /// This many packets arrive damaged.
    Damaged(usize),
    /// The packet has only this many bytes, header included.
    Short(usize),
    /// The packet has this many bytes too many.
    Long(usize),
    /// The camera breaks the frame off here; the next frame follows.
    Torn,
    /// This packet and those after it come this many microframes late.
    Late(u64),
    /// The packet begins with other bytes.
    BadBegin,
    /// The packet ends with other bytes (a footer, where it is the last of an image).
    BadEnd,
    /// The packet's header says that it is another kind of packet.
    BadFlag,
    /// The packet's header says that it has this many bytes.
    HeaderLength(u8),
    /// The packet's header says that the frame is damaged.
    ErrorBit,
    /// The camera states this number instead of the frame's.
    Sequence(u32),
    /// The camera states this time instead of the frame's, in units of its clock.
    Time(u32),
    /// The camera states no time of the frame.
    NoTime,
    /// Nothing comes any more, until the stream is switched off and on.
    Silent,
    /// The endpoint refuses.
    Stall,
    /// The cable is pulled.
    Unplug,
}

impl StreamFault {
    /// How many packets it concerns, from its first one on.
    fn reach(self) -> usize {
        match self {
            Self::Lost(count) | Self::Damaged(count) => count,
            // Which packets are sent when is asked of `Faults::late_packet`.
            Self::Late(_) => 0,
            Self::Time(_) | Self::NoTime | Self::Sequence(_) => usize::MAX,
            _ => 1,
        }
    }

    /// Makes a packet shorter or longer where the fault says so.
    pub(crate) fn cut(self, packet: &mut Vec<u8>) {
        match self {
            Self::Short(length) => packet.truncate(length),
            Self::Long(more) => packet.resize(packet.len() + more, 0x5a),
            _ => {}
        }
    }
}

/// The faults of a camera.
#[derive(Debug, Clone)]
pub(crate) struct Faults<S>(Vec<Fault<S>>);

impl<S> Default for Faults<S> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<S: Copy + PartialEq> Faults<S> {
    /// Adds faults.
    pub(crate) fn extend(&mut self, faults: impl IntoIterator<Item = Fault<S>>) {
        self.0.extend(faults);
    }

    /// All faults of a frame.
    pub(crate) fn of_frame(&self, stream: S, frame: u64) -> impl DoubleEndedIterator<Item = &Fault<S>> {
        self.0.iter().filter(move |fault| fault.stream == stream && fault.frame == frame)
    }

    /// The fate of a packet.
    pub(crate) fn at(&self, stream: S, frame: u64, packet: usize) -> Option<StreamFault> {
        let hits =
            |fault: &&Fault<S>| (fault.packet..fault.packet.saturating_add(fault.what.reach())).contains(&packet);
        self.of_frame(stream, frame).find(hits).map(|fault| fault.what)
    }

    /// Which packet is sent when packet `due` is due; `None` while the camera is late.
    pub(crate) fn late_packet(&self, stream: S, frame: u64, due: usize) -> Option<usize> {
        let late =
            self.of_frame(stream, frame).filter(|fault| due >= fault.packet).find_map(|fault| match fault.what {
                StreamFault::Late(late) => Some((fault.packet, late as usize)),
                _ => None,
            });
        late.map_or(Some(due), |(from, late)| Some(from + due.checked_sub(from + late)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_concern_the_packets_that_they_say() {
        let mut faults = Faults::default();
        let of = |packet, what| Fault { stream: 'd', frame: 3, packet, what };
        faults.extend([of(2, StreamFault::Lost(2)), of(6, StreamFault::Torn), of(8, StreamFault::Time(5))]);
        let hit = |packet| faults.at('d', 3, packet);
        assert_eq!([1, 2, 3, 4].map(hit), [None, Some(StreamFault::Lost(2)), Some(StreamFault::Lost(2)), None]);
        assert_eq!([6, 7, 8, 99].map(|p| hit(p).is_some()), [true, false, true, true]);
        assert_eq!((faults.at('c', 3, 2), faults.at('d', 4, 2)), (None, None));
    }

    #[test]
    fn late_packets_follow_after_their_delay() {
        let mut faults = Faults::default();
        faults.extend([Fault { stream: 0, frame: 1, packet: 2, what: StreamFault::Late(3) }]);
        let sent: Vec<_> = (0..8).map(|due| faults.late_packet(0, 1, due)).collect();
        assert_eq!(sent, [Some(0), Some(1), None, None, None, Some(2), Some(3), Some(4)]);
        assert_eq!(faults.at(0, 1, 2), None, "a late packet is whole");
    }
}
