//! Errors of characters.

/// Errors of the character crate.
#[derive(Debug, thiserror::Error)]
pub enum CharacterError {
    /// The body asset is torn or of another kind.
    #[error("body asset: {0}")]
    Asset(String),
    /// Parts of a character do not fit together.
    #[error("character: {0}")]
    Mismatch(String),
}
