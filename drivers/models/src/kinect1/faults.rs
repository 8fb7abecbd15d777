//! What goes wrong, and when.

use super::Stream;

/// A fault of a stream of packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Which stream.
    pub stream: Stream,
    /// In which frame, counted by the camera since it was opened.
    pub frame: u64,
    /// From which packet of that frame.
    pub packet: usize,
    /// What happens.
    pub what: StreamFault,
}

/// What can happen to packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamFault {
    /// So many packets are sent but never arrive; the sequence numbers tell.
    Lost(usize),
    /// So many packets arrive damaged.
    Damaged(usize),
    /// The packet has only so many bytes, header included.
    Short(usize),
    /// The packet has so many bytes too many.
    Long(usize),
    /// The camera breaks the frame off here; the next frame follows in sequence.
    Torn,
    /// This packet and those after it come so many microframes late.
    Late(u64),
    /// The packet's header begins with other bytes.
    BadMagic,
    /// The packet's header says what it is not.
    BadFlag,
    /// The camera tells this time instead of the frame's, ticks.
    Ticks(u32),
    /// Nothing comes any more.
    Silent,
    /// The cable is pulled.
    Unplug,
}

/// How the camera answers its commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandFault {
    /// The answer is empty so many times before it is there.
    Slow(u32),
    /// The request is refused.
    Stall,
    /// Nothing comes.
    Silence,
    /// The answer begins with other bytes.
    BadMagic,
    /// The answer is to another request.
    BadTag,
    /// The answer is to another command.
    BadCommand,
    /// The answer says another length than it has.
    BadLength,
    /// The answer has fewer bytes than such an answer has.
    Short,
    /// The answer's bytes are all 0xff.
    Nonsense,
}
