//! The body asset, skeleton, joint names, poses, skin weights and skinning.
