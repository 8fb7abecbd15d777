//! What can go wrong with motion.

use std::path::PathBuf;

/// Errors of the animation crate.
#[derive(Debug, thiserror::Error)]
pub enum AnimationError {
    /// A motion file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A BVH file is not what its format says.
    #[error("{name}, line {line}: {reason}")]
    Bvh {
        /// The file, or what stands for it.
        name: String,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong there.
        reason: String,
    },
    /// The joints of a motion could not be recognised.
    #[error(
        "unknown skeleton: no {missing} among the joints {found}; a motion needs upper and lower legs, feet, \
         upper and lower arms of both sides and a spine between them; rename the joints in the BVH file, \
         for example to the names of VRM bones"
    )]
    UnknownSkeleton {
        /// What is needed and not there.
        missing: String,
        /// The joints that are there.
        found: String,
    },
    /// A motion or a skeleton that nothing can be made of.
    #[error("motion: {0}")]
    Motion(String),
    /// A setting out of its range.
    #[error("setting {name} is {value}; it must be {range}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
}
