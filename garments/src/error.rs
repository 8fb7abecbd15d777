//! What can go wrong while a garment is taken out of a scan.

/// Errors of the garments crate. A take that shows no garment is a result with a warning, not an error.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum GarmentError {
    /// A mesh that is needed has no triangles.
    #[error("the {0} has no triangles: fuse and fit this take first")]
    Empty(&'static str),
    /// Lengths that must agree do not.
    #[error("{0}")]
    Mismatch(String),
    /// A mesh breaks its own rules.
    #[error("{0}")]
    Mesh(String),
    /// Edits that cannot be used.
    #[error("{0}")]
    Edits(String),
}
