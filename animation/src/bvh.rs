//! BVH motion files: the hierarchy with its channels, the frames, and where they put the joints.
//!
//! Source: the format as Biovision's files and its many writers use it. A joint's rotation is the product of its
//! rotation channels in file order. The root's position channels are its place. Files disagree about position
//! channels of other joints, which most lack: some repeat the offset there, some add to it; which one is found from
//! the values ([`Bvh::positions_add`]). They disagree about units and the up axis too: values stay as written.

mod frames;
mod hierarchy;
mod lines;
mod model;
mod of_motion;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use model::{Bvh, BvhJoint, Channel, FRAME_TIMES, RestJoint};
pub use read::{parse, read};
pub use write::write;
