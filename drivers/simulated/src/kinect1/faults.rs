//! Commands that go wrong.

/// How the camera answers its commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandFault {
    /// The answer is empty this many times before it is there.
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
