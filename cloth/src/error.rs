//! What can be wrong with a sheet.

use thiserror::Error;

/// What can be wrong with a sheet.
#[derive(Debug, Error)]
pub enum ClothError {
    /// A fabric's property is outside of its range, or a file of fabrics cannot be read.
    #[error("fabric {fabric}: {reason}")]
    Fabric {
        /// Name of the fabric, or of the file.
        fabric: String,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// The rest shape cannot be simulated.
    #[error("the sheet cannot be simulated: {0}")]
    Sheet(String),
    /// A time step that is not a positive number of seconds.
    #[error("a time step of {0} seconds is not positive")]
    TimeStep(f64),
}
