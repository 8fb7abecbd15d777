//! Errors of drawing.

/// Errors of the render crate.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A mesh to draw breaks the rules of meshes.
    #[error("mesh {index} of the picture: {source}")]
    Mesh {
        /// Its place in the list.
        index: usize,
        /// The reason.
        source: toile_geometry::GeometryError,
    },
    /// A mesh was to be coloured by an attribute that it does not have.
    #[error("mesh {index} of the picture has no attribute \"{name}\" to be coloured by")]
    Attribute {
        /// Its place in the list.
        index: usize,
        /// The attribute that was requested.
        name: String,
    },
    /// There is nothing to draw or no pixel to draw on.
    #[error("the picture cannot be drawn: {0}")]
    Empty(String),
    /// The encoder refused the image.
    #[error("PNG: {0}")]
    Encode(#[from] image::ImageError),
}
