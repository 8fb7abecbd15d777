//! Motion: BVH, retargeting, the shipped walk.
