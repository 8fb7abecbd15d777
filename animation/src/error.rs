//! Errors of motion.

use std::path::PathBuf;

/// Errors of the animation crate.
#[derive(Debug, thiserror::Error)]
pub enum AnimationError {
    /// A motion file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A motion file is not one that can be read, such as a folder or a pipe.
    #[error(transparent)]
    File(toile_geometry::GeometryError),
    /// A BVH file is not what its format says.
    #[error("{name}, line {line}: {reason}")]
    Bvh {
        /// The file, or a name that stands for it.
        name: String,
        /// Line, counted from 1.
        line: usize,
        /// The reason.
        reason: String,
    },
    /// The joints of a motion could not be recognised.
    #[error(
        "the skeleton is not recognised: there is no {missing} among the joints {found}; a motion needs upper and \
         lower legs, feet, upper and lower arms on both sides and a spine between them; rename the joints in the \
         BVH file, for example to the names of VRM bones"
    )]
    UnknownSkeleton {
        /// The part of the body that is missing.
        missing: String,
        /// The joints of the file.
        found: String,
    },
    /// A motion or a skeleton that cannot be used.
    #[error("motion: {0}")]
    Motion(String),
    /// A setting out of its range.
    #[error("setting {name} is {value}; it must be {range}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        range: &'static str,
    },
}
