//! Errors of the fits.

/// Errors of the fitting crate: there is no result at all. A poor result is a [`crate::Verdict`], not an error.
#[derive(Debug, thiserror::Error)]
pub enum FittingError {
    /// The mesh cannot be fitted to.
    #[error("scan: {0}")]
    Scan(String),
    /// The mesh to be posed cannot be used.
    #[error("mesh to pose: {0}")]
    Mesh(String),
    /// A measure that was asked for is none, or nobody has it.
    #[error("{0}")]
    Measure(String),
    /// A setting is out of its range.
    #[error("setting {name}: {reason}")]
    Setting {
        /// The field.
        name: &'static str,
        /// Its value and the values it may have.
        reason: String,
    },
    /// The normal equations or the elastic system have no solution.
    #[error("{what} could not be solved: the scan does not determine the body; scan more of it")]
    Singular {
        /// The unknowns that were solved for.
        what: &'static str,
    },
    /// Parts of a character do not match.
    #[error(transparent)]
    Character(#[from] toile_character::CharacterError),
}
