//! What can go wrong with a fit.

/// Errors of the fitting crate: there is no answer at all. A poor answer is a [`crate::Verdict`], not an error.
#[derive(Debug, thiserror::Error)]
pub enum FittingError {
    /// The mesh cannot be fitted to.
    #[error("scan: {0}")]
    Scan(String),
    /// The mesh to be posed cannot be used.
    #[error("mesh to pose: {0}")]
    Mesh(String),
    /// A setting is out of its range.
    #[error("setting {name}: {reason}")]
    Setting {
        /// The field.
        name: &'static str,
        /// What is wrong and what it may be.
        reason: String,
    },
    /// The normal equations or the elastic system have no solution.
    #[error("{what} could not be solved: the scan leaves the body undetermined; scan more of the body")]
    Singular {
        /// Which system.
        what: &'static str,
    },
    /// Parts of a character do not fit together.
    #[error(transparent)]
    Character(#[from] toile_character::CharacterError),
}
