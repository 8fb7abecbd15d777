//! Errors of bodies of primitives; every message is a sentence that names the place and the remedy.

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
pub enum ImplicitError {
    /// A body's file is not what its format says.
    #[error("line {line}: {reason}")]
    Line {
        /// Line of the file, from 1.
        line: usize,
        /// The problem and the remedy.
        reason: String,
    },
    /// A body breaks a rule that no line of a file can be blamed for.
    #[error("{0}")]
    Body(String),
    /// From the template body.
    #[error(transparent)]
    Character(#[from] toile_character::CharacterError),
}
