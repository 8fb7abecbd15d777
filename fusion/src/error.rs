//! Errors of fusion.

/// Why there is no scan. A poor scan is not an error but a warning in the report.
#[derive(Debug, thiserror::Error)]
pub enum FusionError {
    /// The source failed.
    #[error(transparent)]
    Capture(#[from] toile_capture::CaptureError),
    /// No frame carries depth.
    #[error("none of the {frames} frames has depth; fusion needs a depth camera")]
    NoDepth {
        /// Frames seen.
        frames: usize,
    },
    /// Nothing turns before the camera.
    #[error(
        "nobody in it: {reason}; record a person who turns in front of a resting camera, or fuse everything with \
         the volume `all`"
    )]
    NobodyInIt {
        /// The thing that was looked for and not found.
        reason: String,
    },
    /// Resting sensors around a subject that stands still do not see enough of it in common.
    #[error(
        "the sensors `{sensors}` {reason}, and nothing turns before them: place them so that each sees part of what its \
         neighbour sees, and find where they stand with `toile calibrate RIG --board`; or record a turn"
    )]
    NoOverlap {
        /// Their names.
        sensors: String,
        /// The problem.
        reason: String,
    },
    /// The settings contradict themselves.
    #[error("settings: {0}")]
    Settings(String),
    /// The sensor's calibration cannot be used.
    #[error("sensor {sensor}: {reason}")]
    Calibration {
        /// Index of the sensor.
        sensor: usize,
        /// The problem.
        reason: String,
    },
    /// Tracking found no frames that agree.
    #[error("only {tracked} of {frames} frames could be tracked ({reason}); nothing to make a scan of")]
    NotTracked {
        /// Why the first of the others was dropped.
        reason: String,
        /// Frames with a trusted pose.
        tracked: usize,
        /// Frames seen.
        frames: usize,
    },
    /// The volume needs more memory than is allowed.
    #[error("the scene spans {extent_m:.1} m, too much for voxels of {voxel_mm:.1} mm; choose larger voxels")]
    TooLarge {
        /// Largest extent, metres.
        extent_m: f64,
        /// Voxel size, millimetres.
        voxel_mm: f64,
    },
}
