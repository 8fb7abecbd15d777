//! A bounding-volume hierarchy over triangles: closest point, rays, overlaps, winding numbers.
//!
//! One traversal (`bvh/traverse.rs`) serves all queries, split as in `parry`: the tree knows boxes, a query knows which box to
//! look into first, which to leave out and what to do with the triangles of a leaf. Building is deterministic; queries
//! may run in parallel.

pub(crate) mod build;
mod closest;
mod far_field;
mod overlap;
mod pairs;
mod ray;
#[cfg(test)]
mod tests;
pub(crate) mod traverse;
pub(crate) mod tree;
mod triangles;
mod winding;

pub use closest::Closest;
pub use ray::RayHit;
pub use triangles::Bvh;
