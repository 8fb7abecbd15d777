//! Errors of extracting a garment from a scan.

use toile_character::GarmentType;

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
    /// Labels by the nearest body vertex need a template, and this type of garment has none.
    #[error(
        "garments of type {0} have no template for labels by the nearest body vertex: give the layer a type (top, \
         trousers, skirt, dress, jacket, hat or shoes) in subject.toml, or set labelling = \"graph-cut\""
    )]
    NoTemplate(GarmentType),
    /// A number of the settings is outside of its range.
    #[error("{name} = {value} is outside of its range, {least} to {most}")]
    Settings {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f32,
        /// The smallest value that is accepted.
        least: f32,
        /// The largest value that is accepted.
        most: f32,
    },
}
