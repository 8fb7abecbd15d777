//! BVH text to a motion, every complaint with its line.

use std::path::Path;

use toile_geometry::{GeometryError, file::read_limited};

use super::{
    frames, hierarchy,
    lines::Lines,
    model::{Bvh, BvhJoint, Channel},
};
use crate::AnimationError;

/// Maximum size of a file, bytes.
const MAX_BYTES: u64 = 120 << 20;

/// Reads a BVH file.
///
/// # Errors
/// [`AnimationError::Io`] where it cannot be read, [`AnimationError::Bvh`] with the line where it is wrong.
pub fn read(path: &Path) -> Result<Bvh, AnimationError> {
    let bytes = read_limited(path, MAX_BYTES).map_err(|e| match e {
        GeometryError::Io { path, source } => AnimationError::Io { path, source },
        other => AnimationError::File(other),
    })?;
    parse(&String::from_utf8_lossy(&bytes), &path.display().to_string())
}

/// Parses the text of a BVH file; `name` stands for the file in errors.
///
/// Any channel order, any white space, byte order marks, names with blanks, Windows line ends and braces on the joint's
/// own line are read. A number of frames that differs from the announced one by a row too many or one missing gives a
/// warning.
///
/// # Errors
/// [`AnimationError::Bvh`] with the line of the first thing that is wrong.
pub fn parse(text: &str, name: &str) -> Result<Bvh, AnimationError> {
    let mut lines = Lines::new(text, name);
    lines.expect("HIERARCHY", "a BVH file starts with HIERARCHY")?;
    let joints = hierarchy::read(&mut lines)?;
    let channels = joints.iter().map(|j| j.channels.len()).sum();
    let frames::Frames { frame_time, rows, warnings } = frames::read(channels, &mut lines)?;
    let positions_add = positions_add(&joints, &rows);
    Ok(Bvh { joints, frame_time, frames: rows, positions_add, warnings })
}

/// True where the position channels below the root are nearer to zero than to their joints' offsets.
fn positions_add(joints: &[BvhJoint], frames: &[Vec<f64>]) -> bool {
    let (mut from_zero, mut from_offset) = (0.0, 0.0);
    for frame in frames {
        let mut values = frame.iter();
        for joint in joints {
            for (channel, value) in joint.channels.iter().zip(&mut values) {
                if let (Channel::Position(axis), Some(_)) = (*channel, joint.parent) {
                    from_zero += value.abs();
                    from_offset += (value - joint.offset[axis]).abs();
                }
            }
        }
    }
    from_zero < from_offset
}
