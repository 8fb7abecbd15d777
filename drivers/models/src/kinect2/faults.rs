//! What goes wrong, and when.

/// One of the camera's streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Depth, in isochronous packets: nine for each of ten images.
    Depth,
    /// Colour, in bulk transfers.
    Color,
}

/// A fault of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Which stream.
    pub stream: Stream,
    /// In which frame, counted by the camera since it was opened.
    pub frame: u64,
    /// From which packet or transfer of that frame.
    pub packet: usize,
    /// What happens.
    pub what: StreamFault,
}

/// What can happen to packets and transfers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamFault {
    /// So many never arrive.
    Lost(usize),
    /// So many arrive damaged.
    Damaged(usize),
    /// It has only so many bytes.
    Short(usize),
    /// It has so many bytes too many.
    Long(usize),
    /// The camera breaks the frame off here.
    Torn,
    /// This and those after it come so many microframes late.
    Late(u64),
    /// The bytes at the end of it (a footer, where it is the last of an image) are others.
    BadEnd,
    /// The first bytes are others.
    BadBegin,
    /// The camera tells this number instead of the frame's (depth only).
    Sequence(u32),
    /// The camera tells this time instead of the frame's, ticks (depth only).
    Ticks(u32),
    /// Nothing comes any more.
    Silent,
    /// The endpoint stalls.
    Stall,
    /// The cable is pulled.
    Unplug,
}

/// How the camera answers its commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandFault {
    /// The request is refused.
    Stall,
    /// Nothing comes.
    Silence,
    /// The completion begins with other bytes.
    BadMagic,
    /// The completion is of another request.
    BadSequence,
    /// The completion comes without an answer before it.
    Premature,
    /// Answers have half of their bytes.
    Short,
    /// The answers' bytes are all 0xff.
    Nonsense,
    /// Calibration tables are all 0xff.
    NonsenseCalibration,
    /// It becomes ready only after so many looks.
    Slow(u32),
}
