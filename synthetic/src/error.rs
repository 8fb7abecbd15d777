//! Errors of the virtual rig.

/// Errors of the synthetic crate.
#[derive(Debug, thiserror::Error)]
pub enum SyntheticError {
    /// A setting is outside its range.
    #[error("setting {name}: {reason}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Why it cannot be used, and which values are allowed.
        reason: String,
    },
    /// The subject has no take of this number.
    #[error("the subject has no take {take}: its takes are 0 to {last}")]
    NoTake {
        /// The take asked for.
        take: usize,
        /// The last one there is.
        last: usize,
    },
    /// A garment cannot be made for this person.
    #[error("garment {name}: {reason}")]
    Garment {
        /// Its name.
        name: String,
        /// Why not.
        reason: String,
    },
    /// The body asset cannot be used.
    #[error(transparent)]
    Character(#[from] toile_character::CharacterError),
    /// A file could not be written, or a frame could not be recorded.
    #[error(transparent)]
    Capture(#[from] toile_capture::CaptureError),
    /// An image could not be encoded.
    #[error("frame {index}: {reason}")]
    Encode {
        /// Index of the frame.
        index: usize,
        /// The encoder's message.
        reason: String,
    },
}

impl SyntheticError {
    /// A setting that is out of range.
    pub(crate) fn setting(name: &'static str, reason: impl Into<String>) -> Self {
        Self::Setting { name, reason: reason.into() }
    }
}
