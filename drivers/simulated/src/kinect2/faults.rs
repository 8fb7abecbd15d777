//! Commands that go wrong.

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
    /// It becomes ready only after it was asked this many times.
    Slow(u32),
}
