//! What goes wrong, and when.

/// A fault of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Which stream, from 0 over all camera parts.
    pub stream: usize,
    /// In which frame, counted by the camera since it was opened.
    pub frame: u64,
    /// From which packet (bulk: read) of that frame.
    pub packet: usize,
    /// What happens.
    pub what: StreamFault,
}

/// What can happen to packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamFault {
    /// So many packets never arrive; `usize::MAX`: the whole frame.
    Lost(usize),
    /// So many packets arrive damaged (isochronous only).
    Damaged(usize),
    /// The packet has only so many bytes, header included.
    Short(usize),
    /// The packet has so many bytes too many.
    Long(usize),
    /// The camera breaks the frame off here; the next frame follows.
    Torn,
    /// This packet and those after it come so many microframes late (isochronous only).
    Late(u64),
    /// The packet's header says that it has so many bytes.
    HeaderLength(u8),
    /// The packet's header says that the frame is damaged.
    ErrorBit,
    /// The camera tells this time instead of the frame's, microseconds.
    Time(u32),
    /// The camera tells no time of the frame.
    NoTime,
    /// Nothing comes any more, until the stream is switched off and on.
    Silent,
    /// The endpoint refuses.
    Stall,
    /// The cable is pulled.
    Unplug,
}
